"""What may be left out, and what that saves: gravity and the general form of a body for each
method; and for each scene all that kreisel's plan of it leaves out, one omission at a time against
a run with it, in time and memory."""

from dataclasses import dataclass, replace
from functools import partial

import kreisel as kr
import numpy as np

from ..competitors import timing
from ..competitors.single_runs import choose_setting
from ..references.problems import load_problem
from .budget import Task
from .formatting import brief, in_a_row
from .part import Part, csv_text

STEPS, STEP, TOL = 4000, 2.0**-6, 1e-9
LEAST_OF_FORMS, LEAST_OF_OMISSIONS = 5, 12  # rounds of the timing
COLUMNS = ("kind", "name", "case", "seconds", "seconds_with", "bytes", "bytes_with")
STATES = 1000
WANT = ("nutation", "energy")  # a turn of the top about the vertical does not change these
QUANTITIES = (
    "velocity",
    "torque",
    "frame",
    "apex",
    "kinetic",
    "potential",
    "energy",
    "vertical_momentum",
    "axial_momentum",
)
UNEQUAL = 1 + 1e-9
SPLIT = "suzuki4"  # of fixed step, for any body: it has a form for symmetric ones
GRAVITY, GENERAL_FORM = "gravity", "the general form of the body"
FORMS = ("general form", "symmetric form", "no gravity")
SAVINGS = {
    "a symmetric body's form": ("general form", "symmetric form"),
    "gravity": ("symmetric form", "no gravity"),
}


@dataclass(frozen=True)
class LeftOut:
    """What was found: rows of methods by form, and of each scene its plans and its rows."""

    forms: list
    scenes: list

    @property
    def rows(self):
        return [*self.forms, *(row for scene in self.scenes for row in scene["rows"])]


def unequal(problem):
    """Gives the top with its two equal moments made different, so that all that is known of
    symmetric ones is lost."""
    i1, i2, i3 = problem.inertia
    return replace(problem, user=None, inertia=(i1, i2 * UNEQUAL, i3)).to_scene()


def forms(problem):
    """Gives one top as a general body, as a symmetric one, and without gravity."""
    scene = problem.to_scene()
    return dict(zip(FORMS, (unequal(problem), scene, scene.replace(gravity=0.0)), strict=True))


def by_form(rounds):
    """Measures each method, to one end, on each form of the thesis' top."""
    calls, keys = [], []
    for form, scene in forms(load_problem("thesis")).items():
        for method in kr.methods.values():
            if method.suits(scene):
                words = choose_setting(method, STEP, TOL).keywords
                keys.append({"kind": "form", "name": method.name, "case": form})
                calls.append(partial(kr.solve, scene, STEPS * STEP, method.name, **words))
    seconds = timing.best_times(calls, rounds, trials=2)
    return [key | {"seconds": each} for key, each in zip(keys, seconds, strict=True)]


def memory(path):
    """Gives the bytes that a path keeps: of each state what was wanted, or its eight numbers."""
    return len(path) * path.plan.bytes


def all_quantities(path):
    return memory(path) + sum(getattr(path, name).nbytes for name in QUANTITIES)


def omissions(problem, end):
    """Gives (what is left out, a run with it, a run without it) of each; a run gives its bytes."""
    scene = problem.to_scene()
    times, step = np.linspace(0.0, end, STATES), end / (4 * STATES)

    def solved(scene, t=times, count=memory, **words):
        return lambda: count(kr.solve(scene, t, **words))

    series = {"method": "taylor", "tol": TOL}
    whole = solved(scene, **series)
    level, turned = solved(scene, want=WANT, **series), solved(scene, want=(*WANT, "q"), **series)
    yield GRAVITY, solved(scene), solved(scene.replace(gravity=0.0))
    if problem.symmetric:
        general, own = (
            solved(top, end, method=SPLIT, step=step) for top in (unequal(problem), scene)
        )
        yield GENERAL_FORM, general, own
    yield "attitude", turned, level
    yield "states on the way", whole, solved(scene, end, **series)
    yield "quantities nobody asks for", solved(scene, count=all_quantities, **series), whole
    yield "the states themselves", whole, solved(scene, want=("energy",), **series)


def examine(problem, end, rounds):
    """Measures a row an omission."""
    scene, cases = problem.to_scene(), list(omissions(problem, end))
    calls = [call for _, *pair in cases for call in pair]
    sizes, seconds = [call() for call in calls], timing.best_times(calls, rounds)
    return {
        "scene": problem.name,
        "plans": {"all": str(kr.plan(scene)), "level": str(kr.plan(scene, want=WANT))},
        "rows": [
            {
                "kind": "scene",
                "name": problem.name,
                "case": what,
                "seconds": seconds[2 * i + 1],
                "bytes": sizes[2 * i + 1],
                "seconds_with": seconds[2 * i],
                "bytes_with": sizes[2 * i],
            }
            for i, (what, *_) in enumerate(cases)
        ],
    }


def tasks(problems, budget, store):
    rounds = max(LEAST_OF_FORMS, budget.rounds)
    yield Task("left out/form", partial(by_form, rounds), 1.0)
    rounds = max(LEAST_OF_OMISSIONS, budget.rounds)
    for problem, end in problems:
        yield Task(f"omissions/{problem.name}", partial(examine, problem, end, rounds), 0.3)


def found(problems, store):
    rows = [row for of_form in store.under("left out/") for row in of_form]
    scenes = store.under("omissions/")
    return LeftOut(rows, scenes) if rows or scenes else None


def seconds_by_form(rows):
    """Gives the seconds of each method on each form."""
    lines = {}
    for row in rows:
        lines.setdefault(row["name"], {})[row["case"]] = row["seconds"]
    return lines


def shown(left):
    return {
        "forms": FORMS,
        "lines": seconds_by_form(left.forms),
        "omissions": left.scenes,
        "wanted": WANT,
        "states": STATES,
    }


def savings(left):
    """Gives how many times as fast runs are without something, by what is left out."""
    lines = seconds_by_form(left.forms).values()
    saved = {
        what: [line[before] / line[after] for line in lines if before in line and after in line]
        for what, (before, after) in SAVINGS.items()
    }
    for row in (row for scene in left.scenes for row in scene["rows"]):
        if row["case"] not in (GRAVITY, GENERAL_FORM):
            saved.setdefault(row["case"], []).append(row["seconds_with"] / row["seconds"])
    return {what: ratios for what, ratios in saved.items() if ratios}


def concluded(left):
    return in_a_row(*(of_saving(*each) for each in savings(left).items()))


def of_saving(what, ratios):
    """Return a sentence on the speed gained in the median: '1.5 times as fast', '18 % slower'."""
    middle = float(np.median(ratios))
    percent = round(100 * (1 / middle - 1))
    if abs(percent) < 3:
        effect = "makes no difference"
    elif percent > 0:
        effect = f"makes a run {percent} % slower"
    elif middle < 1.1:
        effect = f"makes a run {-percent} % faster"
    else:
        effect = f"makes a run {brief(middle)} times as fast"
    return (
        f"Leaving out {what} {effect} in the median "
        f"({brief(min(ratios))} to {brief(max(ratios))} times as fast)."
    )


PART = Part(
    "omissions",
    "Left out",
    "What is left out",
    tasks,
    found,
    shown,
    concluded,
    files=lambda left, about: [("omissions.csv", csv_text(COLUMNS, left.rows))],
    methods=lambda left: {row["name"] for row in left.forms},
)
