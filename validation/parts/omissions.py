"""What each scene can do without: kreisel's plan of it, and what leaving things out saves, in time and memory, one omission
at a time against the same run with it.
"""

from dataclasses import replace

import kreisel as kr
import numpy as np

from ..peers import measure
from .budget import Task

STATES, TOL = 1000, 1e-9
LEAST = 12  # rounds of the timing
WANT = ("nutation", "energy")  # level: the same when the top is turned about the vertical
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
UNEQUAL = 1e-9
SPLIT = "suzuki4"  # of fixed step, for any body: it has a form for symmetric ones


def memory(path):
    """Bytes that a path keeps: of each state what was wanted, or the eight numbers of it."""
    return len(path) * path.plan.bytes


def all_quantities(path):
    return memory(path) + sum(getattr(path, name).nbytes for name in QUANTITIES)


def unequal(problem):
    """The same top with two equal moments made different: all that is known of symmetric ones is lost."""
    i1, i2, i3 = problem.inertia
    return replace(problem, user=None, inertia=(i1, i2 * (1 + UNEQUAL), i3)).scene()


def omissions(problem, end):
    """(what is left out, a run with it, a run without it); a run returns its bytes."""
    scene = problem.scene()
    times, step = np.linspace(0.0, end, STATES), end / (4 * STATES)

    def solved(scene, t=times, count=memory, **how):
        return lambda: count(kr.solve(scene, t, **how))

    series = {"method": "taylor", "tol": TOL}
    yield "gravity", solved(scene), solved(scene.replace(gravity=0.0))
    if problem.symmetric:
        yield (
            "the general form of the body",
            *(solved(top, end, method=SPLIT, step=step) for top in (unequal(problem), scene)),
        )
    yield "attitude", solved(scene, want=(*WANT, "q"), **series), solved(scene, want=WANT, **series)
    yield "states on the way", solved(scene, **series), solved(scene, end, **series)
    yield (
        "quantities nobody asks for",
        solved(scene, count=all_quantities, **series),
        solved(scene, **series),
    )
    yield (
        "the states themselves",
        solved(scene, **series),
        solved(scene, want=("energy",), **series),
    )


def examine(problem, end, rounds):
    """A row an omission: the best of interleaved runs, since a disturbance only adds."""
    scene, found = problem.scene(), list(omissions(problem, end))
    calls = [call for _, *pair in found for call in pair]
    sizes, about = [call() for call in calls], [measure.once(call) for call in calls]
    samples, interrupted = measure.interleaved(calls, about, rounds)
    if interrupted:
        raise KeyboardInterrupt
    seconds = [min(got) for got in samples]
    plans = {"all": str(kr.plan(scene)), "level": str(kr.plan(scene, want=WANT))}
    return {
        "scene": problem.name,
        "plans": plans,
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
            for i, (what, *_) in enumerate(found)
        ],
    }


def tasks(problems, plan):
    for problem, end in problems:
        yield Task(
            f"omissions/{problem.name}",
            lambda problem=problem, end=end: examine(problem, end, max(LEAST, plan.rounds)),
            0.3,
        )


def scenes(store):
    return store.under("omissions/")
