"""The stability atlas, which tests all methods on stiff tops and under extreme conditions."""

from collections import Counter
from functools import partial
from statistics import median

import kreisel as kr

from ..competitors import single_runs
from ..drawing import verdicts as drawing
from . import atlas_cases, atlas_cells, verdicts
from .part import write_csv
from .tasks import Task

COUNTED = (verdicts.BLOW_UP, verdicts.BEYOND, verdicts.REDUCED, verdicts.DRIFT)
DOTS = {verdicts.RIGHT: "\N{BULLET}", verdicts.WITHIN_TOLERANCE: "="}


def list_tasks(problems, size, store):
    for case in atlas_cases.list_cases(size.quick):
        weight = 1.5 if case.closed else 0.95
        yield Task(case.key, partial(atlas_cells.make_cells, case), weight)


def load_findings(problems, store):
    """Return the cells of the atlas."""
    return [cell for of_case in store.under("atlas/") for cell in of_case]


def column_names(cells):
    """Return the names of all methods and other integrators that have been tested."""
    names = {cell["method"] for cell in cells}
    return [name for name in (*kr.methods, *single_runs.RECORDERS) if name in names]


def make_square(cell):
    """Return the row, column, error, mark and frame of a result in the heat map."""
    verdict = cell["verdict"]
    error = cell["attitude_error"] if verdict in verdicts.CAME_TO_THE_END else None
    mark = DOTS.get(verdict, "") + cell["mark"]
    return cell["case"], cell["method"], error, mark, verdict == verdicts.SILENT


def family_contexts(cells):
    for name, (_, description) in atlas_cases.FAMILIES.items():
        own = [cell for cell in cells if cell["family"] == name]
        if own:
            svg = drawing.draw_heatmap(list(map(make_square, own)), column_names(own))
            yield name, description, svg, collect_notes(own)


def explain_cell(cell):
    """Return the verdict and a message if a run failed or is unexpectedly wrong, else None."""
    verdict = cell["verdict"]
    if verdict in ("stopped", "refused"):
        # The full message is in the CSV file.
        return verdict, cell["message"].split(f": {cell['method']}")[0]
    if verdict == verdicts.SILENT or (verdict == "lost" and cell["tol"]):
        word = "silently wrong" if verdict == verdicts.SILENT else verdict
        error, difference = f"{cell['attitude_error']:.1g}", f"{cell['second_run']:.1g}"
        return word, f"error {error} rad; the finer run differs by {difference} rad"
    return None


def collect_notes(cells):
    """Return a dictionary of explanations, each with its cases by methods."""
    notes, methods = {}, {}
    for cell in cells:
        if note := explain_cell(cell):
            methods.setdefault((note, cell["case"]), []).append(cell["method"])
    for (note, case), names in methods.items():
        notes.setdefault(note, {}).setdefault(", ".join(names), []).append(case)
    return notes


def count_verdicts(cells):
    """Yield, for each method, the number of results with each verdict and each mark."""
    for name in column_names(cells):
        own = [cell for cell in cells if cell["method"] == name]
        errors = [c["attitude_error"] for c in own if c["verdict"] in verdicts.CAME_TO_THE_END]
        yield {
            "method": name,
            "cells": len(own),
            "middle": median(errors) if errors else None,
            "counts": [sum(cell["verdict"] == word for cell in own) for word in verdicts.VERDICTS],
            "marks": [sum(cell["mark"] == letter for cell in own) for letter in COUNTED],
        }


def build_context(cells):
    counts = list(count_verdicts(cells))
    names = ["silently wrong" if word == verdicts.SILENT else word for word in verdicts.VERDICTS]
    met = [i for i, word in enumerate(verdicts.VERDICTS) if word in verdicts.MET]
    order = sorted(counts, key=lambda line: -sum(line["counts"][i] for i in met))
    complete = [cell for cell in cells if cell["verdict"] in verdicts.CAME_TO_THE_END]
    return {
        "bars": drawing.draw_bars({line["method"]: line["counts"] for line in order}, names),
        "families": list(family_contexts(cells)),
        "counts": counts,
        "names": names,
        "marks": verdicts.MARKS,
        "signs": verdicts.SIGNS,
        "counted": COUNTED,
        "lost": verdicts.LOST,
        "key": drawing.draw_key(),
        "cells": cells,
        "complete": complete,
        "silent": [cell for cell in cells if cell["verdict"] == verdicts.SILENT],
        "verdicts": Counter(cell["verdict"] for cell in cells),
        "shown_by": Counter(cell.get("shown_by") for cell in complete),
        "best": Counter(c["method"] for c in cells if c["verdict"] in verdicts.MET),
        "worst": Counter(c["method"] for c in cells if c["verdict"] in ("lost", "stopped")),
        "beyond": [cell["method"] for cell in complete if cell["mark"] == verdicts.BEYOND],
        "promised": verdicts.PROMISED,
    }


def list_files(cells, metadata):
    yield (
        "stability.csv",
        write_csv(
            {key: f"{x:.4g}" if isinstance(x, float) else x for key, x in cell.items()}
            for cell in cells
        ),
    )


def terminal_lines(cells):
    silent = [cell for cell in cells if cell["verdict"] == verdicts.SILENT]
    yield f"atlas: {len(cells)} cells, silently wrong: {len(silent)}"
    for cell in silent:
        place = f"{cell['method']}: {cell['family']}, {cell['case']}"
        yield f"  {place}: {cell['attitude_error']:.0e} rad"


def list_methods(cells):
    return {cell["method"] for cell in cells}
