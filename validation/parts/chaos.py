"""Regular and chaotic motion: sections, a chaotic layer, frequencies and Lyapunov exponents.

Poincare sections are shown for several tops, from integrable to chaotic. The width of a chaotic
layer is compared with Melnikov's theory.
"""

import math
from functools import partial

import numpy as np

from ..drawing import section_plots as drawing
from ..drawing.field import draw_field
from ..references import kowalewski, melnikov
from . import frequency_data, lyapunov_exponents, section_data
from .formatting import format_brief, format_power, join_sentences, number_word
from .part import Part, write_csv
from .tasks import Task

SMALL = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # relative differences of the moments in the layer
SHOWN = (1e-2, 1e-4)
NEAR = "8 %"  # the top whose frequencies are shown
CLOSE = (1.18, 1.65), (1.48, 2.15)  # opposite corners of the inset
FILES = {
    "layer.csv": ("e", "kick", "melnikov", "half_width", "predicted"),
    "exponents.csv": ("top", "starts", "chaotic", "exponent", "error", "certificate"),
    "kowalewski.csv": ("region", "g", "h", "least", "greatest", "off", "critical"),
}


def choose_numbers(size):
    """Return the numbers of orbits and points of a report."""
    return {
        "orbits": min(size.members, 90),
        "crossings": 60 if size.quick else 450,
        "turning": 6 if size.quick else min(size.members, 100),
        "swings": 200 if size.quick else 2000,
        "side": {"quick": 5, "default": 26}.get(size.name, 64),
    }


def measure_energy_drift(size):
    """Return `size` extended by the largest energy drift and the number of recorded states."""
    findings = []
    for name in section_data.BODIES:
        section = section_data.compute_section(name, size["orbits"], size["crossings"])
        findings.append(float(np.abs(section.energy / section_data.ENERGY - 1.0).max()))
    states = len(section_data.BODIES) * size["orbits"] * size["crossings"]
    return size | {"energy": max(findings), "states": states}


def measure_kowalewski(size):
    """Yield the range and the critical values of the Kowalewski integral for each pair (g, h)."""
    for number, (g, h) in enumerate(kowalewski.REGIONS):
        section = section_data.compute_kowalewski_section(number, size["orbits"], size["crossings"])
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


def measure_layer(swings):
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


def measure_frequencies(orbits):
    rows = frequency_data.measure_rotation(orbits, NEAR)
    return {
        "rows": [row.tolist() for row in rows],
        "off": frequency_data.largest_frequency_error(orbits // 3),
    }


def measure_exponents(size):
    """Compute Lyapunov exponents for a table of bodies, and for a map over energy and momentum."""
    table = [
        lyapunov_exponents.summarize_exponents(name, size["orbits"]) for name in section_data.BODIES
    ]
    return {"table": table, "map": lyapunov_exponents.map_exponents(size["side"]).tolist()}


def list_tasks(problems, size, store):
    numbers = choose_numbers(size)
    name = size.name
    yield Task(f"chaos/order/{name}", partial(measure_energy_drift, numbers), 3.0)
    yield Task(f"chaos/kowalewski/{name}", lambda: list(measure_kowalewski(numbers)), 4.0)
    yield Task(f"chaos/layer/{name}", lambda: list(measure_layer(numbers["swings"])), 2.0)
    measure = partial(measure_frequencies, numbers["turning"])
    yield Task(f"chaos/frequencies/{name}", measure, 5.0)
    yield Task(f"chaos/exponents/{name}", partial(measure_exponents, numbers), 20.0)


def load_findings(problems, store):
    names = "order", "kowalewski", "layer", "frequencies", "exponents"
    findings = {name: store.under(f"chaos/{name}/") for name in names}
    return {name: values[-1] for name, values in findings.items() if values}


def body_panels(size):
    for name in section_data.BODIES:
        section = section_data.compute_section(name, size["orbits"], size["crossings"])
        yield (
            name,
            section_data.panel_data(
                section, section_data.average_by_orbit(section, section.axial_momentum)
            ),
        )


def region_panels(size):
    for number, (g, h) in enumerate(kowalewski.REGIONS):
        section = section_data.compute_kowalewski_section(number, size["orbits"], size["crossings"])
        K = section.kowalewski**0.25
        yield f"{number + 1}: g = {g:g}, h = {h:g}", section_data.panel_data(section, K)


def draw_layer(rows, size):
    angles, changes = {}, {}
    for e in SHOWN:
        spin, axial = melnikov.measure_swings(e, size["swings"] // 10)
        name = f"e = {format_power(e)}"
        angles[name], changes[name] = spin.ravel(), (np.diff(axial, axis=1) / e).ravel()
    return (
        drawing.draw_kicks(angles, changes, melnikov.melnikov_amplitude()),
        drawing.draw_widths(
            [row["e"] for row in rows],
            [row["half_width"] for row in rows],
            melnikov.layer_half_width(),
        ),
    )


def draw_rotation(rows, size):
    section = section_data.compute_section(NEAR, size["orbits"], size["crossings"])
    panel = section_data.panel_data(
        section, section_data.average_by_orbit(section, section.axial_momentum)
    )
    return drawing.draw_section_and_rotation(
        panel, f"moments {NEAR} apart", [np.array(row, float) for row in rows]
    )


def draw_exponents(rows):
    return draw_field(
        np.array(rows, float),
        (*lyapunov_exponents.VERTICALS, *lyapunov_exponents.ENERGIES),
        ("vertical momentum", "energy", "largest Lyapunov exponent"),
    )


def build_context(findings):
    size = findings["order"]
    widest = max(g for g, _ in kowalewski.REGIONS) + 0.2
    context = {"size": size, "seconds": None, "regions": None, "layer": None, "rotation": None}
    context["exponents"] = findings.get("exponents")
    context["order"] = drawing.draw_sections(dict(body_panels(size)), 3, 3.1)
    if "kowalewski" in findings:
        context["regions"] = drawing.draw_sections(dict(region_panels(size)), 5, 2.4)
        context["plane"] = drawing.draw_regions(
            kowalewski.region_borders(widest), kowalewski.REGIONS, widest, 4.6, CLOSE
        )
        context["values"] = findings["kowalewski"]
    if "layer" in findings:
        context["layer"] = draw_layer(findings["layer"], size)
        context["swings"] = findings["layer"]
    if "frequencies" in findings:
        context["rotation"] = draw_rotation(findings["frequencies"]["rows"], size)
        context["off"], context["near"] = findings["frequencies"]["off"], NEAR
    if context["exponents"]:
        context["map"] = draw_exponents(context["exponents"]["map"])
        context["long"], context["times"] = lyapunov_exponents.LONG, lyapunov_exponents.TIMES
        context["mapped"] = lyapunov_exponents.MAPPED
        context["starts"] = number_word(lyapunov_exponents.STARTS)
    return context


def conclude(findings):
    return join_sentences(
        f"Sections of {findings['order']['states']} states conserve their energy to "
        f"{format_power(findings['order']['energy'])}, for regular and chaotic motions.",
        describe_regions(findings.get("kowalewski")),
        describe_layer(findings.get("layer")),
        describe_frequencies(findings.get("frequencies")),
        describe_exponents(findings.get("exponents")),
    )


def build_lead(findings):
    order = findings["order"]
    return {"energy": format_power(order["energy"]), "crossings": order["crossings"]}


def describe_regions(rows):
    if not rows:
        return ""
    error = max(row["off"] for row in rows)
    count = sum(row["greatest"] <= row["critical"][-1] * (1.0 + 1e-9) for row in rows)
    return (
        f"Kowalewski's integral is constant to {format_power(error)} of its maximum on all "
        f"{number_word(len(rows))} kinds of sections, within the theoretical bounds on {count} of "
        f"{len(rows)}."
    )


def describe_layer(rows):
    if not rows:
        return ""
    finest = rows[0]
    error = abs(finest["kick"] / finest["melnikov"] - 1.0)
    ratios = [row["half_width"] / row["predicted"] for row in rows]
    decades = round(math.log10(rows[-1]["e"] / finest["e"]))
    return (
        "Along the separatrix of the upright top the change of axial momentum per swing agrees "
        f"with Melnikov's integral to {format_power(error)} at e = {format_power(finest['e'])}. "
        f"Over {number_word(decades)} decades the chaotic layer is {format_brief(min(ratios))} to "
        f"{format_brief(max(ratios))} times as wide as by Chirikov's criterion."
    )


def describe_frequencies(frequencies):
    return (
        frequencies
        and "The largest frequency error of random Lagrange tops is "
        f"{format_power(frequencies['off'])}."
    )


def describe_exponents(exponents):
    """Summarize the Lyapunov exponents in a sentence."""
    if not exponents:
        return ""
    first, *_, last = exponents["table"]
    number = str(first["chaotic"] or "none")
    text = f"{number.capitalize()} of {first['starts']} starts of the Lagrange top are chaotic"
    if last["error"] is None:
        return f"{text}."
    return (
        f"{text}; of the last top {last['chaotic']} are, with an exponent of "
        f"{last['exponent']:.4f} \N{PLUS-MINUS SIGN} {last['error']:.4f}."
    )


def list_files(findings, metadata):
    rows = {"layer.csv": findings.get("layer"), "kowalewski.csv": findings.get("kowalewski")}
    rows["exponents.csv"] = findings.get("exponents", {}).get("table")
    return [(name, write_csv(FILES[name], rows[name])) for name in FILES if rows[name]]


PART = Part(
    "chaos",
    "Chaos",
    "Order and chaos",
    list_tasks,
    load_findings,
    build_context,
    conclude,
    list_files=list_files,
    list_methods=lambda findings: {"taylor"},
    build_lead=build_lead,
    is_lead_row=True,
)
