"""Time and memory saved by omitting unneeded computations and output.

The time saved by omitting gravity and by exploiting symmetry is measured for each method. For each
scene, the savings in time and memory are measured separately for each omitted computation.
"""

from dataclasses import dataclass, replace
from functools import partial

import kreisel as kr
import numpy as np

from ..competitors import timing
from ..competitors.single_runs import choose_setting
from ..references.problems import load_problem
from .formatting import format_brief, join_sentences
from .part import Part, write_csv
from .tasks import Task

STEPS, STEP, TOL = 4000, 2.0**-6, 1e-9
LEAST_OF_FORMS, LEAST_OF_OMISSIONS = 5, 12  # minimum numbers of timing rounds
COLUMNS = ("kind", "name", "case", "seconds", "seconds_with", "bytes", "bytes_with")
STATES = 1000
WANT = ("nutation", "energy")  # quantities that are invariant under rotations about the vertical
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
SPLIT = "suzuki4"  # a fixed-step method with a special form for symmetric bodies
GRAVITY, GENERAL_FORM = "gravity", "the general form of the body"
FORMS = ("general form", "symmetric form", "no gravity")
SAVINGS = {
    "the general form of a symmetric body": ("general form", "symmetric form"),
    "gravity": ("symmetric form", "no gravity"),
}


@dataclass(frozen=True)
class OmissionFindings:
    """Measurements of the time and memory saved by omitting unneeded computations."""

    forms: list
    scenes: list

    @property
    def rows(self):
        return [*self.forms, *(row for scene in self.scenes for row in scene["rows"])]


def make_asymmetric(problem):
    """Return a top with unequal moments of inertia, so that no method can exploit the symmetry."""
    i1, i2, i3 = problem.inertia
    return replace(problem, user=None, inertia=(i1, i2 * UNEQUAL, i3)).to_scene()


def scene_forms(problem):
    """Return three variants of a top: asymmetric, symmetric, and without gravity."""
    scene = problem.to_scene()
    return dict(
        zip(FORMS, (make_asymmetric(problem), scene, scene.replace(gravity=0.0)), strict=True)
    )


def measure_forms(rounds):
    """Measure the run time of each method with and without gravity and symmetry."""
    calls, keys = [], []
    for form, scene in scene_forms(load_problem("thesis")).items():
        for method in kr.methods.values():
            if method.suits(scene):
                words = choose_setting(method, STEP, TOL).keywords
                keys.append({"kind": "form", "name": method.name, "case": form})
                calls.append(partial(kr.solve, scene, STEPS * STEP, method.name, **words))
    seconds = timing.best_times(calls, rounds, trials=2)
    return [key | {"seconds": each} for key, each in zip(keys, seconds, strict=True)]


def path_bytes(path):
    """Return the memory [bytes] needed for the quantities in a path."""
    return len(path) * path.plan.bytes


def bytes_with_quantities(path):
    return path_bytes(path) + sum(getattr(path, name).nbytes for name in QUANTITIES)


def list_omissions(problem, end):
    """Yield the name of each optional computation, and two functions that include and omit it.

    Both functions return the memory [bytes] occupied by their results.
    """
    scene = problem.to_scene()
    times, step = np.linspace(0.0, end, STATES), end / (4 * STATES)

    def make_run(scene, t=times, count=path_bytes, **words):
        return lambda: count(kr.solve(scene, t, **words))

    series = {"method": "taylor", "tol": TOL}
    whole = make_run(scene, **series)
    level, full = (
        make_run(scene, want=WANT, **series),
        make_run(scene, want=(*WANT, "q"), **series),
    )
    yield GRAVITY, make_run(scene), make_run(scene.replace(gravity=0.0))
    if problem.symmetric:
        general, own = (
            make_run(top, end, method=SPLIT, step=step) for top in (make_asymmetric(problem), scene)
        )
        yield GENERAL_FORM, general, own
    yield "attitude", full, level
    yield "intermediate states", whole, make_run(scene, end, **series)
    yield (
        "quantities not requested",
        make_run(scene, count=bytes_with_quantities, **series),
        whole,
    )
    yield "the states themselves", whole, make_run(scene, want=("energy",), **series)


def measure_scene(problem, end, rounds):
    """Return the integration plans, and the time and memory with and without each omission."""
    scene, cases = problem.to_scene(), list(list_omissions(problem, end))
    calls = [call for _, *pair in cases for call in pair]
    sizes, seconds = [call() for call in calls], timing.best_times(calls, rounds)
    return {
        "scene": problem.name,
        "plans": {"all": str(kr.plan(scene)), "level": str(kr.plan(scene, want=WANT))},
        "rows": [
            {
                "kind": "scene",
                "name": problem.name,
                "case": omission,
                "seconds": seconds[2 * i + 1],
                "bytes": sizes[2 * i + 1],
                "seconds_with": seconds[2 * i],
                "bytes_with": sizes[2 * i],
            }
            for i, (omission, *_) in enumerate(cases)
        ],
    }


def list_tasks(problems, size, store):
    rounds = max(LEAST_OF_FORMS, size.rounds)
    yield Task("left out/form", partial(measure_forms, rounds), 1.0)
    rounds = max(LEAST_OF_OMISSIONS, size.rounds)
    for problem, end in problems:
        yield Task(f"omissions/{problem.name}", partial(measure_scene, problem, end, rounds), 0.3)


def load_findings(problems, store):
    rows = [row for of_form in store.under("left out/") for row in of_form]
    scenes = store.under("omissions/")
    return OmissionFindings(rows, scenes) if rows or scenes else None


def group_seconds(rows):
    """Return the run times [s] of each method with and without gravity and symmetry."""
    lines = {}
    for row in rows:
        lines.setdefault(row["name"], {})[row["case"]] = row["seconds"]
    return lines


def build_context(findings):
    return {
        "forms": FORMS,
        "lines": group_seconds(findings.forms),
        "omissions": findings.scenes,
        "wanted": WANT,
        "states": STATES,
    }


def compute_savings(findings):
    """Return, for each optional computation, the speedups obtained by omitting it."""
    lines = group_seconds(findings.forms).values()
    speedups = {
        omission: [line[before] / line[after] for line in lines if before in line and after in line]
        for omission, (before, after) in SAVINGS.items()
    }
    for row in (row for scene in findings.scenes for row in scene["rows"]):
        if row["case"] not in (GRAVITY, GENERAL_FORM):
            speedups.setdefault(row["case"], []).append(row["seconds_with"] / row["seconds"])
    return {omission: ratios for omission, ratios in speedups.items() if ratios}


def conclude(findings):
    return join_sentences(*(describe_saving(*each) for each in compute_savings(findings).items()))


def describe_saving(omission, ratios):
    """Describe a median speedup, as in '1.5 times as fast' or '18 % slower'."""
    middle = float(np.median(ratios))
    percent = round(100 * (1 / middle - 1))
    if abs(percent) < 3:
        effect = "makes no difference"
    elif percent > 0:
        effect = f"makes a run {percent} % slower"
    elif middle < 1.1:
        effect = f"makes a run {-percent} % faster"
    else:
        effect = f"makes a run {format_brief(middle)} times as fast"
    return (
        f"Leaving out {omission} {effect} in the median "
        f"({format_brief(min(ratios))} to {format_brief(max(ratios))} times as fast)."
    )


PART = Part(
    "omissions",
    "Left out",
    "Time saved by what is left out",
    list_tasks,
    load_findings,
    build_context,
    conclude,
    list_files=lambda findings, metadata: [("omissions.csv", write_csv(COLUMNS, findings.rows))],
    list_methods=lambda findings: {row["name"] for row in findings.forms},
)
