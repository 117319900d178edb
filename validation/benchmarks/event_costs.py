"""The cost of event detection, compared with heyoka.

    python -m validation.benchmarks.event_costs

The time of a run to t = 1000 with one event is divided by the time of a run without events. Both
programs run alternately in one process, at the tightest tolerance and at 1e-9. heyoka uses its own
event detection. Each line of output ends with the ratio of heyoka's time to kreisel's time, and
with both numbers of events. heyoka also counts the start, which is an event in both scenes. The
nutation event is a zero of the time derivative of the apex height, and the plane is apex_x = 0.
"""

import argparse

import heyoka as hy
import kreisel as kr
import numpy as np

from ..references import equations
from ..references.problems import load_problem
from .taylor_speed import EPS, median_times

END = 1000.0
EVENTS = {
    "nutation": kr.events.nutation(),
    "plane": kr.events.plane((1, 0, 0)),
    "loop": kr.events.loop(),
}


def event_functions(problem):
    """Return the three event functions for heyoka, in the variables of equations.py.

    The derivatives use <n, P>' = <n, P x W>.
    """
    q, w = hy.make_vars("qw", "qx", "qy", "qz"), hy.make_vars("a", "b", "c")
    lever = np.array(problem.lever, dtype=float)
    n = (lever / np.linalg.norm(lever)).tolist()
    up = [
        2 * (q[1] * q[3] - q[0] * q[2]),
        2 * (q[2] * q[3] + q[0] * q[1]),
        q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3],
    ]
    east = [
        q[0] * q[0] + q[1] * q[1] - q[2] * q[2] - q[3] * q[3],
        2 * (q[1] * q[2] - q[0] * q[3]),
        2 * (q[1] * q[3] + q[0] * q[2]),
    ]
    cross = [n[i] * (up[j] * w[k] - up[k] * w[j]) for i, j, k in equations.CYCLE if n[i]]
    along = [n[i] * w[i] for i in range(3) if n[i]], [n[i] * up[i] for i in range(3) if n[i]]
    return {
        "nutation": sum(cross[1:], cross[0]),
        "plane": sum((n[i] * east[i] for i in range(3) if n[i]), hy.expression(0.0)),
        "loop": up[0] * w[0]
        + up[1] * w[1]
        + up[2] * w[2]
        - sum(along[0][1:], along[0][0]) * sum(along[1][1:], along[1][0]),
    }


def make_kreisel_run(problem, tol, event=None):
    scene = problem.to_scene()

    def run():
        path = kr.solve(scene, END, "taylor", tol=tol, events=None if event is None else [event])
        return 0 if event is None else len(path.events)

    return run


def make_heyoka_run(problem, tol, function=None):
    system, start = equations.build_system(problem)
    found = []
    watched = (
        []
        if function is None
        else [hy.nt_event(function, lambda top, time, sign: found.append(time))]
    )
    top = hy.taylor_adaptive(system, start, tol=tol, nt_events=watched)

    def run():
        found.clear()
        top.time = 0.0
        top.state[:] = start
        top.propagate_until(END)
        return len(found)

    return run


def print_comparison(problem, tol, theirs, word):
    runs = [
        make_kreisel_run(problem, tol),
        make_kreisel_run(problem, tol, EVENTS[word]),
        make_heyoka_run(problem, theirs),
        make_heyoka_run(problem, theirs, event_functions(problem)[word]),
    ]
    _, own, _, peer = (run() for run in runs)
    a, b, c, d = median_times(runs, 21)
    print(
        f"{problem.name} {tol or 'tightest'} {word:9} with/without event: {b / a:.2f}, "
        f"heyoka {d / c:.2f};"
        f" heyoka/kreisel with event {d / b:.2f} ({b * 1e6:.0f} us); events {own}, heyoka {peer}",
        flush=True,
    )


def main(argv=None):
    argparse.ArgumentParser(
        prog="python -m validation.benchmarks.event_costs", description=__doc__.splitlines()[0]
    ).parse_args(argv)
    for name in ("thesis", "asymmetric_regular"):
        for tol, theirs in ((None, EPS), (1e-9, 1e-9)):
            for word in EVENTS:
                print_comparison(load_problem(name), tol, theirs, word)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
