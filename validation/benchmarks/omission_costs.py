"""The time saved by omitting output and computation, the delay of Ctrl-C, and checkpoint costs.

    python -m validation.benchmarks.omission_costs [--rounds 25]

Each ratio is the time of the complete run divided by the time of the run with omissions. Both times
are the shortest of several interleaved rounds. The required and desired ratios are printed beside
each ratio.
"""

import argparse
import subprocess
import sys
import tracemalloc
from functools import partial
from statistics import median

import kreisel as kr
import numpy as np

from ..competitors import compiled_core, timing

TOP, END, MANY = kr.scenes.asymmetric, 100.0, 1_000_000
WANT = ("nutation", "energy")
MANY_TIMES = "np.linspace(0, 10, 10_000_000), progress=send"
STOPS = {
    "30 digits": "kr.solve(top, 1e9, digits=30, progress=send)",
    "dense output, 1e7 states": f"kr.solve(top, {MANY_TIMES})",
    "implicit_midpoint": "kr.solve(top, 1e9, 'implicit_midpoint', step=.01, progress=send)",
    "geometric": "kr.solve(kr.scenes.thesis, 1e6, 'geometric', error=1e-3, progress=send)",
    "exact, 1e7 states": f"kr.solve(kr.scenes.thesis, {MANY_TIMES})",
    "want, 1e7 states": f"kr.solve(top, 1e7 * {MANY_TIMES}, want=('energy',))",
    "a stream": "list(kr.stream(top, np.inf, 'strang', step=.01, every=200, progress=send))",
}
STOPPED = """
import numpy as np, os, signal, sys, threading, time, kreisel as kr
top, sent, timers = kr.scenes.asymmetric, [], []
def kill():
    sent.append(time.perf_counter())
    os.kill(os.getpid(), signal.SIGINT)
def send(t):
    if not timers:
        timers.append(threading.Timer(0.02, kill))
        timers[0].start()
try:
    {}
except KeyboardInterrupt:
    print(time.perf_counter() - sent[0])
"""


def grade(value, must, better):
    return "" if must is None else "PASS" if better(value, must) else "MISSED"


def print_ratio(rounds, name, whole, part, must=None, stretch=None):
    for call in (whole, part):
        call()
    slow, fast = timing.best_times([whole, part], rounds)
    bound = "" if must is None else f"must {must}, stretch {stretch}"
    print(
        f"{name:<66}{slow * 1e6:10.1f} us {fast * 1e6:10.1f} us {slow / fast:6.2f}  {bound:<24}"
        f"{grade(slow / fast, must, float.__ge__)}"
    )


def make_recording(scene, times, leave_heading=False):
    return compiled_core.make_recording_call(
        compiled_core.scene_bytes(scene), "taylor", times, leave_heading=leave_heading
    )


def solve_all(t):
    path = kr.solve(TOP, t)
    return path.nutation, path.energy


def solve_selection(t):
    return kr.solve(TOP, t, want=WANT)


def peak_memory(call):
    tracemalloc.start()
    call()
    size = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return size


def print_omissions(rounds):
    print("Omissions: time with, time without, and speedup")
    for case in (*output_cases(), *problem_cases()):
        print_ratio(rounds, *case)
    times = np.linspace(0, 10, MANY)
    for name, call in {
        "all states": lambda: kr.solve(TOP, times),
        f"want={WANT}": lambda: solve_selection(times),
        f"a stream of want={WANT}": lambda: [None for _ in kr.stream(TOP, times, want=WANT)],
    }.items():
        print(f"memory, {MANY:,} states: {name:<40}{peak_memory(call) / 1e6:8.1f} MB")


def output_cases():
    """Yield cases with less output as (name, complete run, reduced run, optional bounds)."""
    ends, few = np.array([0.0, END]), np.linspace(0, END, 1000)
    yield (
        "attitude, in C: want nutation and energy at the end",
        make_recording(TOP, ends),
        make_recording(TOP, ends, leave_heading=True),
        *(1.1, 1.3),
    )
    yield (
        "attitude, the call from Python, quantities computed",
        partial(solve_all, END),
        partial(solve_selection, END),
        *(1.1, 1.3),
    )
    yield (
        "attitude, with 1000 intermediate states",
        partial(solve_all, few),
        partial(solve_selection, few),
    )
    yield (
        "1000 intermediate states: start and end only",
        make_recording(TOP, few),
        make_recording(TOP, ends),
    )
    every = partial(kr.solve, TOP, few)
    yield "quantities: none of 1000 states requested", partial(solve_all, few), every


def problem_cases():
    """Yield cases with less computation as (name, complete run, reduced run)."""
    symmetric, ends = kr.scenes.thesis, np.array([0.0, END])
    still, body = symmetric.replace(gravity=0.0), symmetric.body
    i1, i2, i3 = body.inertia
    general = symmetric.replace(
        body=kr.Body(body.mass, (i1, i2 * 1.001, i3), body.com, unphysical=True)
    )
    yield (
        "gravity, taylor a step: the kernel keeps its lanes",
        make_step_run(symmetric),
        make_step_run(still),
    )
    yield (
        "general form, taylor a step: two equal moments share lanes",
        make_step_run(general),
        make_step_run(symmetric),
    )
    yield (
        "series: the closed form of a Lagrange top",
        make_recording(symmetric, ends),
        partial(kr.solve, symmetric, END),
    )


def make_step_run(scene):
    """Return a call that makes a fixed number of steps, so many that it can be timed."""
    return compiled_core.make_recording_call(
        compiled_core.scene_bytes(scene), "taylor", np.array([1e5]), most=1000
    )


def time_interrupt(code):
    command = [sys.executable, "-c", STOPPED.format(code)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    return float(done.stdout)


def print_interrupts():
    print("Ctrl-C: time until KeyboardInterrupt, median and longest of five; bound 50 ms")
    for name, code in STOPS.items():
        took = [time_interrupt(code) for _ in range(5)]
        middle = median(took)
        said = grade(middle, 0.05, float.__le__)
        print(f"{name:<40}{1e3 * middle:8.1f} ms {1e3 * max(took):8.1f} ms  {said}")


def print_checkpoints(rounds):
    print("Checkpoints: time to make, time to read, and size")
    for name, words in {
        "taylor": {},
        "taylor, 30 digits": {"digits": 30},
        "extrap": {"method": "extrap"},
        "strang": {"method": "strang", "step": 0.01},
    }.items():
        run = kr.start(TOP, **words)
        run.to(5.0)
        saved = run.checkpoint
        calls = [partial(getattr, run, "checkpoint"), partial(kr.resume, saved)]
        make, read = (1e6 * seconds for seconds in timing.best_times(calls, rounds))
        print(f"{name:<40}{make:8.0f} us {read:8.0f} us {len(saved):8} bytes")


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.omission_costs", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--rounds", type=int, default=25)
    rounds = parser.parse_args(argv).rounds
    print_omissions(rounds)
    print_interrupts()
    print_checkpoints(rounds)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
