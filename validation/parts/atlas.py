"""The stability atlas, which tests all methods on stiff tops and under extreme conditions."""

from collections import Counter
from dataclasses import dataclass
from functools import partial

import kreisel as kr
import numpy as np

from ..competitors import single_runs
from ..drawing import heatmap
from ..drawing.time_series import choose_colours, draw_time_series
from ..drawing.verdict_bars import draw_verdict_bars
from . import atlas_cases, atlas_cells, stiff_needle, verdicts
from .formatting import count_word, join_counts, join_sentences, join_words, verb_be
from .part import Part, write_csv
from .tasks import Task

COLUMNS = (
    "family",
    "case",
    "method",
    "step",
    "tol",
    "end",
    "turns",
    "verdict",
    "shown_by",
    "mark",
    "attitude_error",
    "second_run",
    "shown",
    "promised",
    "rounding",
    "energy_error",
    "conditioning",
    "truth_bits",
    "agreement",
    "steps",
    "evaluations",
    "message",
)
COUNTED = (verdicts.BLOW_UP, verdicts.BEYOND, verdicts.REDUCED, verdicts.DRIFT)
COURSES = {"attitude": "attitude error [rad]", "energy": "energy error, relative"}


@dataclass(frozen=True)
class Atlas:
    """All results of the stability atlas."""

    cells: list
    needle_lines: list


def list_tasks(problems, size, store):
    for case in atlas_cases.list_cases(size.quick):
        weight = 1.5 if case.closed else 0.7
        yield Task(case.key, partial(atlas_cells.make_cells, case), weight)
    yield from stiff_needle.list_tasks(size)


def load_findings(problems, store):
    cells = [cell for of_case in store.under("atlas/") for cell in of_case]
    return Atlas(cells, stiff_needle.load_findings(store)) if cells else None


def column_names(cells):
    """Return the names of all methods and other integrators that have been tested."""
    names = {cell["method"] for cell in cells}
    return [name for name in (*kr.methods, *single_runs.RECORDERS) if name in names]


def make_square(cell):
    """Return the heat-map square that represents a result."""
    is_complete = cell["verdict"] in verdicts.CAME_TO_THE_END
    dot = {verdicts.RIGHT: "•", verdicts.WITHIN_TOLERANCE: "="}.get(cell["verdict"], "")
    return heatmap.Square(
        cell["case"],
        cell["method"],
        cell["attitude_error"] if is_complete else None,
        dot + cell["mark"],
        cell["verdict"] == verdicts.SILENT,
    )


def family_contexts(cells):
    for name, (_, description) in atlas_cases.FAMILIES.items():
        own = [cell for cell in cells if cell["family"] == name]
        if own:
            yield {
                "name": name,
                "about": description,
                "svg": heatmap.draw_heatmap(list(map(make_square, own)), column_names(own)),
                "notes": list(collect_notes(own)),
            }


def describe_cell(cell):
    """Return the verdict and a message if a run failed or is unexpectedly wrong, else None.

    A message is returned for failed runs, for errors that a user could not detect, and for large
    errors of adaptive methods.
    """
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
    """Yield the rows of the table that explains failed runs and unexpected errors.

    Test cases for which the report gives the same explanation share one row of the table.
    """
    explanations = {}
    for cell in cells:
        if describe_cell(cell):
            explanations.setdefault(describe_cell(cell), {}).setdefault(cell["case"], []).append(
                cell["method"]
            )
    for (word, message), by_case in explanations.items():
        cases_by_methods = {}
        for case, methods in by_case.items():
            cases_by_methods.setdefault(", ".join(methods), []).append(case)
        yield {
            "verdict": word,
            "message": message,
            "whom": [
                {"methods": methods_text, "cases": "; ".join(own)}
                for methods_text, own in cases_by_methods.items()
            ],
        }


def count_verdicts(cells):
    """Yield, for each method, the number of results with each verdict."""
    for name in column_names(cells):
        own = [cell for cell in cells if cell["method"] == name]
        errors = [c["attitude_error"] for c in own if c["verdict"] in verdicts.CAME_TO_THE_END]
        yield {
            "method": name,
            "cells": len(own),
            "middle": float(np.median(errors)) if errors else None,
            "counts": [sum(cell["verdict"] == word for cell in own) for word in verdicts.VERDICTS],
            "marks": [sum(cell["mark"] == letter for cell in own) for letter in COUNTED],
        }


def draw_verdicts(counts):
    """Draw a bar chart that shows how often each method received each verdict."""
    names = ["silently wrong" if word == verdicts.SILENT else word for word in verdicts.VERDICTS]
    indices = [list(verdicts.VERDICTS).index(word) for word in verdicts.MET]
    order = sorted(counts, key=lambda line: -sum(line["counts"][i] for i in indices))
    return draw_verdict_bars({line["method"]: line["counts"] for line in order}, names)


def needle_context(lines):
    colours = choose_colours(line["kind"] for line in lines)
    return {
        "kinds": colours,
        "courses": [
            {"label": label, "svg": draw_time_series(lines, name, label, colours)}
            for name, label in COURSES.items()
        ]
        if lines
        else [],
        "needle": stiff_needle.conclude(lines),
    }


def build_context(atlas):
    counts = list(count_verdicts(atlas.cells))
    return needle_context(atlas.needle_lines) | {
        "bars": draw_verdicts(counts),
        "families": list(family_contexts(atlas.cells)),
        "counts": counts,
        "words": list(verdicts.VERDICTS),
        "marks": verdicts.MARKS,
        "signs": verdicts.SIGNS,
        "counted": COUNTED,
        "lost": verdicts.LOST,
        "key": heatmap.draw_key(),
    }


def is_silent(cell):
    return cell["verdict"] == verdicts.SILENT


def conclude(atlas):
    complete_cells = [cell for cell in atlas.cells if cell["verdict"] in verdicts.CAME_TO_THE_END]
    if not complete_cells:
        return ""
    return join_sentences(
        describe_silent_cells(atlas.cells),
        describe_verdicts(atlas.cells),
        describe_signs(complete_cells),
        describe_methods(atlas.cells),
        describe_tolerance_failures(complete_cells),
    )


def describe_silent_cells(cells):
    silent = [f"{cell['method']} on {cell['case']}" for cell in cells if is_silent(cell)]
    n, names = len(silent), f": {join_words(silent)}" if silent else ""
    return (
        f"{count_word(n).capitalize()} of {len(cells)} cells {verb_be(n)} silently wrong{names}. "
        "A cell is one method on one top. It is silently wrong if neither a finer run nor the step "
        "reveals its error."
    )


def describe_verdicts(cells):
    n = Counter(cell["verdict"] for cell in cells)

    def share(verdict):
        return f"{100 * n[verdict] / len(cells):.0f} %"

    return (
        f"{share('right')} are right: no error beyond rounding. "
        f"{share('within tolerance')} are within the requested tolerance. "
        f"{share('degraded')} are degraded: a larger error, but less than {verdicts.LOST:g} rad. "
        f"{share('lost')} are lost: an even larger error. "
        f"{share('stopped')} stopped early and {share('refused')} did not start, with a message."
    )


def describe_signs(cells):
    n = Counter(cell.get("shown_by") for cell in cells)
    return (
        f"Of the degraded and lost cells, {n['second run']:,} are revealed by a finer run, and "
        f"{n['large step']} by the step itself; {n['tolerance']} lie within the tolerance times "
        f"the number of steps, and {n['rounding']} are due to rounding errors."
    )


def describe_methods(cells):
    counts = Counter(cell["method"] for cell in cells if cell["verdict"] in verdicts.MET)
    ill = Counter(cell["method"] for cell in cells if cell["verdict"] in ("lost", "stopped"))
    (best, count), *_ = counts.most_common(1) or [("none", 0)]
    worst = join_words(f"{name} ({n})" for name, n in ill.most_common(3))
    return (
        f"{best} is right or within tolerance most often ({count} cells); most often lost or "
        f"stopped are {worst}."
    )


def describe_tolerance_failures(cells):
    methods = [cell["method"] for cell in cells if cell["mark"] == verdicts.BEYOND]
    if not methods:
        return ""
    return (
        f"Errors more than {verdicts.PROMISED:g} times those explained by the tolerance: "
        f"{join_counts(methods)}."
    )


def write_table(cells):
    def format_value(value):
        return f"{value:.4g}" if isinstance(value, float) else value

    return write_csv(
        COLUMNS, ({key: format_value(value) for key, value in cell.items()} for cell in cells)
    )


def list_files(atlas, metadata):
    yield "stability.csv", write_table(atlas.cells)
    if atlas.needle_lines:
        yield "stiff.csv", stiff_needle.write_table(atlas.needle_lines)


def terminal_lines(atlas):
    silent = list(filter(is_silent, atlas.cells))
    yield f"atlas: {len(atlas.cells)} cells, silently wrong: {len(silent)}"
    for cell in silent:
        place = f"{cell['method']}: {cell['family']}, {cell['case']}"
        yield f"  {place}: {cell['attitude_error']:.0e} rad"


PART = Part(
    "atlas",
    "Stability",
    "The stability atlas",
    list_tasks,
    load_findings,
    build_context,
    conclude,
    list_files=list_files,
    terminal_lines=terminal_lines,
    list_methods=lambda atlas: {cell["method"] for cell in atlas.cells},
)
