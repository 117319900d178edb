"""Order and chaos: sections of tops from integrable to chaotic, the ten of Kowalewski's top, the
layer along a separatrix beside Melnikov's theory, frequencies, and Lyapunov exponents."""

from functools import partial

import numpy as np

from ..drawing import section_plots as drawing
from ..drawing.field import field
from ..references import kowalewski, melnikov
from . import frequency_data, lyapunov_exponents, section_data
from .budget import Task
from .formatting import brief, in_a_row, power
from .part import Part, csv_text

SMALL = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # by which the moments of the layer's tops differ
SHOWN = (1e-2, 1e-4)
NEAR = "8 %"  # the top whose frequencies are shown
CLOSE = (1.18, 1.65), (1.48, 2.15)  # the crowded part of the plane of regions
FILES = {
    "layer.csv": ("e", "kick", "melnikov", "half_width", "predicted"),
    "exponents.csv": ("top", "starts", "chaotic", "exponent", "error", "certificate"),
    "kowalewski.csv": ("region", "g", "h", "least", "greatest", "off", "critical"),
}


def sizes(budget):
    """Gives how many orbits and crossings a picture has, orbits with frequencies, and swings."""
    return {
        "orbits": min(budget.members, 90),
        "crossings": 60 if budget.quick else 450,
        "turning": 6 if budget.quick else min(budget.members, 100),
        "swings": 200 if budget.quick else 2000,
        "side": {"quick": 5, "default": 26}.get(budget.name, 64),
    }


def order(size):
    """Gives how far the energy strays in sections, relatively, and how many states they have."""
    found = []
    for name in section_data.BODIES:
        section = section_data.of_body(name, size["orbits"], size["crossings"])
        found.append(float(np.abs(section.energy / section_data.ENERGY - 1.0).max()))
    states = len(section_data.BODIES) * size["orbits"] * size["crossings"]
    return size | {"energy": max(found), "states": states}


def integrable(size):
    """Gives of each region what K the section has, how far an orbit strays from its own, and what
    theory says of it."""
    for number, (g, h) in enumerate(kowalewski.REGIONS):
        section = section_data.of_kowalewski(number, size["orbits"], size["crossings"])
        K = section.kowalewski.reshape(len(section), -1)
        yield {
            "region": number + 1,
            "g": g,
            "h": h,
            "least": float(K.min()),
            "greatest": float(K.max()),
            "off": float(np.ptp(K, axis=1).max() / K.max()),
            "critical": [value for value, _ in kowalewski.critical_values(g, h)],
        }


def layer(swings):
    for e in SMALL:
        spin, axial = melnikov.measure_swings(e, swings)
        change, wave = np.diff(axial, axis=1) / e, np.sin(2.0 * spin)
        yield {
            "e": e,
            "kick": float((change * wave).sum() / (wave * wave).sum()),
            "melnikov": melnikov.melnikov_amplitude(),
            "half_width": float(np.abs(axial - melnikov.VERTICAL).max()),
            "predicted": e * melnikov.layer_half_width(),
        }


def turning(orbits):
    rows = frequency_data.rotation(orbits, NEAR)
    return {
        "rows": [row.tolist() for row in rows],
        "off": frequency_data.off_closed_form(orbits // 3),
    }


def growing(size):
    """Gives the table of exponents and the map of them."""
    table = [lyapunov_exponents.told(name, size["orbits"]) for name in section_data.BODIES]
    return {"table": table, "map": lyapunov_exponents.mapped(size["side"]).tolist()}


def tasks(problems, budget, store):
    size = sizes(budget)
    name = budget.name
    yield Task(f"chaos/order/{name}", partial(order, size), 3.0)
    yield Task(f"chaos/kowalewski/{name}", lambda: list(integrable(size)), 4.0)
    yield Task(f"chaos/layer/{name}", lambda: list(layer(size["swings"])), 2.0)
    yield Task(f"chaos/frequencies/{name}", partial(turning, size["turning"]), 12.0, until=0.9)
    yield Task(f"chaos/exponents/{name}", partial(growing, size), 10.0, until=0.9)


def found(problems, store):
    names = "order", "kowalewski", "layer", "frequencies", "exponents"
    known = {name: store.under(f"chaos/{name}/") for name in names}
    return {name: values[-1] for name, values in known.items() if values}


def panels_of_bodies(size):
    for name in section_data.BODIES:
        section = section_data.of_body(name, size["orbits"], size["crossings"])
        yield (
            name,
            section_data.drawn(section, section_data.by_orbit(section, section.axial_momentum)),
        )


def panels_of_regions(size):
    for number, (g, h) in enumerate(kowalewski.REGIONS):
        section = section_data.of_kowalewski(number, size["orbits"], size["crossings"])
        K = section.kowalewski**0.25
        yield f"{number + 1}: g = {g:g}, h = {h:g}", section_data.drawn(section, K)


def pictures_of_layer(rows, size):
    angles, changes = {}, {}
    for e in SHOWN:
        spin, axial = melnikov.measure_swings(e, size["swings"] // 10)
        name = f"e = {power(e)}"
        angles[name], changes[name] = spin.ravel(), (np.diff(axial, axis=1) / e).ravel()
    return (
        drawing.kicks(angles, changes, melnikov.melnikov_amplitude()),
        drawing.widths(
            [row["e"] for row in rows],
            [row["half_width"] for row in rows],
            melnikov.layer_half_width(),
        ),
    )


def picture_of_rotation(rows, size):
    section = section_data.of_body(NEAR, size["orbits"], size["crossings"])
    panel = section_data.drawn(section, section_data.by_orbit(section, section.axial_momentum))
    return drawing.beside_rotation(
        panel, "moments 8 % apart", [np.array(row, float) for row in rows]
    )


def picture_of_exponents(rows):
    return field(
        np.array(rows, float),
        (*lyapunov_exponents.VERTICALS, *lyapunov_exponents.ENERGIES),
        ("vertical momentum", "energy", "largest Lyapunov exponent"),
    )


def shown(findings):
    size = findings["order"]
    widest = max(g for g, _ in kowalewski.REGIONS) + 0.2
    told = {"size": size, "seconds": None, "regions": None, "layer": None, "rotation": None}
    told["exponents"] = findings.get("exponents")
    told["order"] = drawing.cuts(dict(panels_of_bodies(size)), 3, 3.1)
    if "kowalewski" in findings:
        told["regions"] = drawing.cuts(dict(panels_of_regions(size)), 5, 2.4)
        told["plane"] = drawing.map_of_regions(
            kowalewski.region_borders(widest), kowalewski.REGIONS, widest, 4.6, CLOSE
        )
        told["values"] = findings["kowalewski"]
    if "layer" in findings:
        told["layer"] = pictures_of_layer(findings["layer"], size)
        told["swings"] = findings["layer"]
    if "frequencies" in findings:
        told["rotation"] = picture_of_rotation(findings["frequencies"]["rows"], size)
        told["off"] = findings["frequencies"]["off"]
    if told["exponents"]:
        told["map"] = picture_of_exponents(told["exponents"]["map"])
        told["long"], told["times"] = lyapunov_exponents.LONG, lyapunov_exponents.TIMES
    return told


def concluded(findings):
    return in_a_row(
        f"Sections of {findings['order']['states']} states keep their energy to "
        f"{power(findings['order']['energy'])}, whether they are regular or chaotic.",
        of_regions(findings.get("kowalewski")),
        of_layer(findings.get("layer")),
        of_frequencies(findings.get("frequencies")),
        of_exponents(findings.get("exponents")),
    )


def of_regions(rows):
    if not rows:
        return ""
    off = max(row["off"] for row in rows)
    met = sum(row["greatest"] <= row["critical"][-1] * (1.0 + 1e-9) for row in rows)
    return (
        f"Kowalewski's integral stays constant to {power(off)} of its greatest value on all ten "
        f"kinds of sections, within the bounds of theory on {met} of {len(rows)}."
    )


def of_layer(rows):
    if not rows:
        return ""
    finest = rows[0]
    off = abs(finest["kick"] / finest["melnikov"] - 1.0)
    ratios = [row["half_width"] / row["predicted"] for row in rows]
    return (
        f"Along the separatrix of the upright top swings change the axial momentum as Melnikov's "
        f"integral says, to {power(off)} at e = {power(finest['e'])}; over {len(rows)} decades the "
        f"layer of chaos is {brief(min(ratios))} to {brief(max(ratios))} times as wide as "
        "Chirikov's criterion has it."
    )


def of_frequencies(known):
    return (
        known and f"Frequencies of random Lagrange tops are off by {power(known['off'])} at most."
    )


def of_exponents(known):
    """Says how chaos grows, and that none is seen where there is none."""
    if not known:
        return ""
    first, *_, last = known["table"]
    called = first["chaotic"] or "none"
    said = f"Of {first['starts']} starts of the Lagrange top {called} are called chaotic"
    if last["error"] is None:
        return f"{said}."
    return (
        f"{said}; of the last top {last['chaotic']}, with an exponent of {last['exponent']:.4f} "
        f"\N{PLUS-MINUS SIGN} {last['error']:.4f}."
    )


def files(findings, about):
    rows = {"layer.csv": findings.get("layer"), "kowalewski.csv": findings.get("kowalewski")}
    rows["exponents.csv"] = findings.get("exponents", {}).get("table")
    return [(name, csv_text(FILES[name], rows[name])) for name in FILES if rows[name]]


PART = Part(
    "chaos",
    "Chaos",
    "Order and chaos",
    tasks,
    found,
    shown,
    concluded,
    short="Order and chaos",
    files=files,
    methods=lambda findings: {"taylor"},
)
