"""Regular and chaotic motion: sections, a chaotic layer, frequencies and Lyapunov exponents."""

from functools import partial

import numpy as np

from ..drawing import fields as drawing
from ..references import kowalewski, melnikov
from . import chaos_data
from .formatting import format_power
from .part import write_csv
from .tasks import Task

SMALL = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # relative differences of the moments in the layer
SHOWN = (1e-2, 1e-4)
NEAR = "8 %"  # the top whose frequencies are shown
CLOSE = (1.18, 1.65), (1.48, 2.15)  # opposite corners of the inset
TOPICS = "order", "kowalewski", "layer", "frequencies", "exponents"


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
    for name in chaos_data.BODIES:
        section = chaos_data.compute_section(name, size["orbits"], size["crossings"])
        findings.append(float(np.abs(section.energy / chaos_data.ENERGY - 1.0).max()))
    states = len(chaos_data.BODIES) * size["orbits"] * size["crossings"]
    return size | {"energy": max(findings), "states": states}


def measure_kowalewski(size):
    """Yield the range and the critical values of the Kowalewski integral for each pair (g, h)."""
    for number, (g, h) in enumerate(kowalewski.REGIONS):
        section = chaos_data.compute_kowalewski_section(number, size["orbits"], size["crossings"])
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
    rows = chaos_data.measure_rotation(orbits, NEAR)
    return {
        "rows": [row.tolist() for row in rows],
        "off": chaos_data.largest_frequency_error(orbits // 3),
    }


def measure_exponents(size):
    """Compute Lyapunov exponents for a table of bodies, and for a map over energy and momentum."""
    table = [chaos_data.summarize_exponents(name, size["orbits"]) for name in chaos_data.BODIES]
    return {"table": table, "map": chaos_data.map_exponents(size["side"]).tolist()}


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
    findings = {name: store.under(f"chaos/{name}/") for name in TOPICS}
    return {name: values[-1] for name, values in findings.items() if values}


def draw_kowalewski(size):
    """Draw the sections of all regions, and the regions themselves."""
    panels = {}
    for number, (g, h) in enumerate(kowalewski.REGIONS):
        section = chaos_data.compute_kowalewski_section(number, size["orbits"], size["crossings"])
        panel = chaos_data.panel_data(section, section.kowalewski**0.25)
        panels[f"{number + 1}: g = {g:g}, h = {h:g}"] = panel
    widest = max(g for g, _ in kowalewski.REGIONS) + 0.2
    borders = kowalewski.region_borders(widest)
    return (
        drawing.draw_sections(panels, 5, 2.4),
        drawing.draw_regions(borders, kowalewski.REGIONS, widest, 4.6, CLOSE),
    )


def draw_layer(rows, size):
    kicks = {}
    for e in SHOWN:
        spin, axial = melnikov.measure_swings(e, size["swings"] // 10)
        kicks[f"e = {format_power(e)}"] = spin.ravel(), (np.diff(axial, axis=1) / e).ravel()
    widths = [row["e"] for row in rows], [row["half_width"] for row in rows]
    return (
        drawing.draw_kicks(kicks, melnikov.melnikov_amplitude()),
        drawing.draw_widths(*widths, melnikov.layer_half_width()),
    )


def draw_rotation(rows, panel):
    rotation = [np.array(row, float) for row in rows]
    return drawing.draw_section_and_rotation(panel, f"moments {NEAR} apart", rotation)


def draw_exponents(rows):
    extent = *chaos_data.VERTICALS, *chaos_data.ENERGIES
    labels = "vertical momentum", "energy", "largest Lyapunov exponent"
    return drawing.draw_field(np.array(rows, float), extent, labels)


def build_context(findings):
    size = findings["order"]
    panels = {
        name: chaos_data.panel_data(
            chaos_data.compute_section(name, size["orbits"], size["crossings"])
        )
        for name in chaos_data.BODIES
    }
    context = dict.fromkeys(TOPICS) | findings
    context |= {"size": size, "order": drawing.draw_sections(panels, 3, 3.1), "near": NEAR}
    if rows := context["kowalewski"]:
        context["regions"], context["plane"] = draw_kowalewski(size)
        within = [row["greatest"] <= row["critical"][-1] * (1.0 + 1e-9) for row in rows]
        context |= {"within": sum(within), "off": max(row["off"] for row in rows)}
    if rows := context["layer"]:
        context["pictures"] = draw_layer(rows, size)
        context["kick_error"] = abs(rows[0]["kick"] / rows[0]["melnikov"] - 1.0)
        context["decades"] = round(np.log10(rows[-1]["e"] / rows[0]["e"]))
        context["widths"] = [row["half_width"] / row["predicted"] for row in rows]
    if context["frequencies"]:
        context["rotation"] = draw_rotation(context["frequencies"]["rows"], panels[NEAR])
    if context["exponents"]:
        context["map"] = draw_exponents(context["exponents"]["map"])
        context["long"], context["times"] = chaos_data.LONG, chaos_data.TIMES
        context["mapped"], context["starts"] = chaos_data.MAPPED, chaos_data.STARTS
    return context


def list_files(findings, metadata):
    tables = {
        "layer.csv": findings.get("layer"),
        "exponents.csv": findings.get("exponents", {}).get("table"),
        "kowalewski.csv": findings.get("kowalewski"),
    }
    return [(name, write_csv(rows)) for name, rows in tables.items() if rows]


def list_methods(findings):
    return ["taylor"]
