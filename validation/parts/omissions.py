"""Time and memory saved by omitting unneeded computations and output."""

from dataclasses import replace
from functools import partial
from statistics import median

import kreisel as kr
import numpy as np

from ..competitors import timing
from .part import write_csv
from .tasks import Task

TOL = 1e-9
LEAST_ROUNDS = 12  # of timing
STATES = 1000
WANT = ("nutation", "energy")  # quantities that are invariant under rotations about the vertical
QUANTITIES = (
    *("velocity", "torque", "frame", "apex", "kinetic", "potential"),
    *("energy", "vertical_momentum", "axial_momentum"),
)
UNEQUAL = 1 + 1e-9
SPLIT = "suzuki4"  # a fixed-step method with a special form for symmetric bodies


def make_asymmetric(problem):
    """Return a top with unequal moments of inertia, so that no method can exploit the symmetry."""
    i1, i2, i3 = problem.inertia
    return replace(problem, user=None, inertia=(i1, i2 * UNEQUAL, i3)).to_scene()


def path_bytes(path):
    """Return the memory [bytes] needed for the quantities in a path."""
    return len(path) * path.plan.bytes


def bytes_with_quantities(path):
    return path_bytes(path) + sum(getattr(path, name).nbytes for name in QUANTITIES)


def list_omissions(problem, end):
    """Yield the name of each optional computation, and two functions that include and omit it."""
    scene = problem.to_scene()
    times, step = np.linspace(0.0, end, STATES), end / (4 * STATES)

    def make_run(scene, t=times, count=path_bytes, **words):
        return lambda: count(kr.solve(scene, t, **words))

    series = partial(make_run, scene, method="taylor", tol=TOL)
    yield "gravity", make_run(scene), make_run(scene.replace(gravity=0.0))
    if problem.symmetric:
        tops = make_asymmetric(problem), scene
        yield (
            "the general form of a symmetric body",
            *(make_run(top, end, method=SPLIT, step=step) for top in tops),
        )
    yield "attitude", series(want=(*WANT, "q")), series(want=WANT)
    yield "intermediate states", series(), series(t=end)
    yield "quantities not requested", series(count=bytes_with_quantities), series()
    yield "the states themselves", series(), series(want=("energy",))


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
    rounds = size.rounds if size.quick else max(LEAST_ROUNDS, size.rounds)
    for problem, end in problems:
        yield Task(f"omissions/{problem.name}", partial(measure_scene, problem, end, rounds), 0.3)


def load_findings(problems, store):
    return store.under("omissions/")


def build_context(scenes):
    speedups = {}
    for row in (row for scene in scenes for row in scene["rows"]):
        speedups.setdefault(row["case"], []).append(row["seconds_with"] / row["seconds"])
    savings = {name: (median(own), own) for name, own in speedups.items()}
    return {
        "omissions": scenes,
        "wanted": WANT,
        "states": STATES,
        "savings": dict(sorted(savings.items(), key=lambda saving: -saving[1][0])),
    }


def list_files(scenes, metadata):
    yield "omissions.csv", write_csv(row for scene in scenes for row in scene["rows"])
