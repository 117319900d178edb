"""The stability atlas: what becomes of each method where a top is stiff or extreme."""

from collections import Counter
from dataclasses import dataclass
from functools import partial

import kreisel as kr
import numpy as np

from ..competitors import single_runs
from ..drawing import heatmap
from ..drawing.time_series import colours_of, time_courses
from . import atlas_cases, atlas_cells, stiff_needle, verdicts
from .budget import Task
from .formatting import count, counted, in_a_row, is_or_are, listed
from .part import Part, csv_text

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
    """What was found: the cells, and the lines of the stiff needle."""

    cells: list
    watched: list


def tasks(problems, budget, store):
    for case in atlas_cases.cases(budget.quick):
        weight = 6.0 if case.closed else 0.4
        yield Task(case.key, partial(atlas_cells.examine, case), weight, until=1.0)
    yield from stiff_needle.tasks(budget)


def found(problems, store):
    known = [cell for of_case in store.under("atlas/") for cell in of_case]
    return Atlas(known, stiff_needle.found(store)) if known else None


def columns(found):
    """Gives methods, then peers, as far as they ran."""
    ran = {cell["method"] for cell in found}
    return [name for name in (*kr.methods, *single_runs.RECORDERS) if name in ran]


def square(cell):
    """Gives what the heat map shows of a cell."""
    ran = cell["verdict"] in verdicts.CAME_TO_THE_END
    dot = {verdicts.RIGHT: "•", verdicts.AS_ASKED: "="}.get(cell["verdict"], "")
    return heatmap.Square(
        cell["case"],
        cell["method"],
        cell["attitude_error"] if ran else None,
        dot + cell["mark"],
        cell["verdict"] == verdicts.SILENT,
    )


def families_shown(found):
    for name, (_, about) in atlas_cases.FAMILIES.items():
        own = [cell for cell in found if cell["family"] == name]
        if own:
            yield {
                "name": name,
                "about": about,
                "svg": heatmap.heatmap(list(map(square, own)), columns(own)),
                "notes": list(notes(own)),
            }


def note(cell):
    """Words what is to be said of a cell: that it stopped, was refused, is wrong in silence, or
    lost in spite of a tolerance; None if nothing is."""
    verdict = cell["verdict"]
    if verdict in ("stopped", "refused"):
        # The rest of the message stands in the table's file.
        return verdict, cell["message"].split(f": {cell['method']}")[0]
    if verdict == verdicts.SILENT or (verdict == "lost" and cell["tol"]):
        word = "wrong in silence" if verdict == verdicts.SILENT else verdict
        off, apart = f"{cell['attitude_error']:.1g}", f"{cell['second_run']:.1g}"
        return word, f"off by {off} rad; finer, it comes out {apart} rad away"
    return None


def notes(found):
    """Gives what is said, of which cases by which methods; cases of which all is alike stand
    together."""
    said = {}
    for cell in found:
        if note(cell):
            said.setdefault(note(cell), {}).setdefault(cell["case"], []).append(cell["method"])
    for (word, message), by_case in said.items():
        whom = {}
        for case, methods in by_case.items():
            whom.setdefault(", ".join(methods), []).append(case)
        yield {
            "verdict": word,
            "message": message,
            "whom": [{"methods": who, "cases": "; ".join(own)} for who, own in whom.items()],
        }


def counts(found):
    """Gives how often each method is what."""
    for name in columns(found):
        own = [cell for cell in found if cell["method"] == name]
        known = [c["attitude_error"] for c in own if c["verdict"] in verdicts.CAME_TO_THE_END]
        yield {
            "method": name,
            "cells": len(own),
            "middle": float(np.median(known)) if known else None,
            "counts": [sum(cell["verdict"] == word for cell in own) for word in verdicts.VERDICTS],
            "marks": [sum(cell["mark"] == letter for cell in own) for letter in COUNTED],
        }


def needle_shown(lines):
    colours = colours_of(line["kind"] for line in lines)
    return {
        "kinds": colours,
        "courses": [
            {"label": label, "svg": time_courses(lines, name, label, colours)}
            for name, label in COURSES.items()
        ]
        if lines
        else [],
        "needle": stiff_needle.concluded(lines),
    }


def shown(atlas):
    return needle_shown(atlas.watched) | {
        "families": list(families_shown(atlas.cells)),
        "counts": list(counts(atlas.cells)),
        "words": list(verdicts.VERDICTS),
        "marks": verdicts.MARKS,
        "signs": verdicts.SIGNS,
        "counted": COUNTED,
        "lost": verdicts.LOST,
        "key": heatmap.key(),
    }


def is_silent(cell):
    return cell["verdict"] == verdicts.SILENT


def concluded(atlas):
    ran = [cell for cell in atlas.cells if cell["verdict"] in verdicts.CAME_TO_THE_END]
    if not ran:
        return ""
    return in_a_row(
        of_silence(atlas.cells),
        of_verdicts(atlas.cells),
        of_signs(ran),
        of_methods(atlas.cells),
        of_tolerances(ran),
    )


def of_silence(found):
    silent = [f"{cell['method']} on {cell['case']}" for cell in found if is_silent(cell)]
    n, which = len(silent), f": {listed(silent)}" if silent else ""
    return f"Of {len(found)} cells {count(n)} {is_or_are(n)} wrong in silence{which}."


def of_verdicts(found):
    n = Counter(cell["verdict"] for cell in found)
    return (
        f"{n['right']} are right, {n['as asked']} as asked, {n['degraded']} degraded, "
        f"{n['lost']} lost, {n['stopped']} stopped with a message and {n['refused']} refused with "
        "one."
    )


def of_signs(ran):
    n = Counter(cell.get("shown_by") for cell in ran)
    return (
        f"{n['second run']:,} of the degraded and lost cells show up in a finer run, "
        f"{n['large step']} in the step itself; {n['tolerance']} lie within the tolerance times "
        f"the number of steps, and {n['rounding']} are accumulated rounding."
    )


def of_methods(found):
    met = Counter(cell["method"] for cell in found if cell["verdict"] in verdicts.MET)
    ill = Counter(cell["method"] for cell in found if cell["verdict"] in ("lost", "stopped"))
    (best, often), *_ = met.most_common(1) or [("none", 0)]
    worst = listed(f"{name} ({n})" for name, n in ill.most_common(3))
    return (
        f"Most often right or as asked is {best} ({often} cells); most often lost or stopped are "
        f"{worst}."
    )


def of_tolerances(ran):
    beyond = [cell["method"] for cell in ran if cell["mark"] == verdicts.BEYOND]
    if not beyond:
        return ""
    return (
        f"More than {verdicts.PROMISED:g} times off what the tolerance explains: {counted(beyond)}."
    )


def table(found):
    def written(value):
        return f"{value:.4g}" if isinstance(value, float) else value

    return csv_text(
        COLUMNS, ({key: written(value) for key, value in cell.items()} for cell in found)
    )


def files(atlas, about):
    yield "stability.csv", table(atlas.cells)
    if atlas.watched:
        yield "stiff.csv", stiff_needle.table(atlas.watched)


def told(atlas):
    silent = list(filter(is_silent, atlas.cells))
    yield f"atlas: {len(atlas.cells)} cells, wrong in silence: {len(silent)}"
    for cell in silent:
        where = f"{cell['method']}: {cell['family']}, {cell['case']}"
        yield f"  {where}: {cell['attitude_error']:.0e} rad"


PART = Part(
    "atlas",
    "Stability",
    "The stability atlas",
    tasks,
    found,
    shown,
    concluded,
    short="Stability",
    files=files,
    told=told,
    methods=lambda atlas: {cell["method"] for cell in atlas.cells},
)
