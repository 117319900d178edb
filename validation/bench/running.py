"""Running: what leaving out saves, in time and memory; how soon Ctrl-C stops; what a checkpoint costs.

    python -m validation.bench.running [--rounds 25]

Each ratio is the time of the whole over the time of what is wanted, the fastest of rounds in turn; must and stretch
beside it.
"""

import argparse
import subprocess
import sys
import tracemalloc
from statistics import median

import kreisel as kr
import numpy as np

from ..peers import measure

TOP, END, MANY = kr.scenes.asymmetric, 100.0, 1_000_000
WANT = ("nutation", "energy")
STOPS = {
    "30 digits": "kr.solve(top, 1e9, digits=30, progress=send)",
    "dense output, 1e7 states": "kr.solve(top, np.linspace(0, 10, 10_000_000), progress=send)",
    "implicit_midpoint": "kr.solve(top, 1e9, 'implicit_midpoint', step=.01, progress=send)",
    "geometric": "kr.solve(kr.scenes.thesis, 1e6, 'geometric', error=1e-3, progress=send)",
    "exact, 1e7 states": "kr.solve(kr.scenes.thesis, np.linspace(0, 10, 10_000_000), progress=send)",
    "want, 1e7 states": "kr.solve(top, np.linspace(0, 1e8, 10_000_000), want=('energy',), progress=send)",
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


def verdict(value, must, better):
    return "" if must is None else "PASS" if better(value, must) else "MISSED"


def ratio(name, whole, part, rounds, must=None, stretch=None):
    calls = [whole, part]
    for call in calls:
        call()
    samples, _ = measure.interleaved(calls, [measure.once(call) for call in calls], rounds)
    slow, fast = map(min, samples)
    bound = "" if must is None else f"must {must}, stretch {stretch}"
    print(
        f"{name:<66}{slow * 1e6:10.1f} us {fast * 1e6:10.1f} us {slow / fast:6.2f}  {bound:<24}"
        f"{verdict(slow / fast, must, float.__ge__)}"
    )


def record(scene, times, leave_heading=False):
    return lambda: kr._core.record(scene._block, "taylor", 0.0, 0.0, 0, 0, leave_heading, times)


def in_full(t):
    path = kr.solve(TOP, t)
    return path.nutation, path.energy


def peak(call):
    tracemalloc.start()
    call()
    size = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return size


def left_out(rounds):
    ends, few, symmetric = np.array([0.0, END]), np.linspace(0, END, 1000), kr.scenes.thesis
    still = symmetric.replace(gravity=0.0)
    i1, i2, i3 = symmetric.body.inertia
    general = symmetric.replace(
        body=kr.Body(symmetric.body.mass, (i1, i2 * 1.001, i3), symmetric.body.com)
    )
    print("Left out: the whole, without it, and how many times faster")
    ratio(
        "attitude, in C: want nutation and energy at the end",
        record(TOP, ends),
        record(TOP, ends, True),
        rounds,
        1.1,
        1.3,
    )
    ratio(
        "attitude, the call from Python, quantities computed",
        lambda: in_full(END),
        lambda: kr.solve(TOP, END, want=WANT),
        rounds,
        1.1,
        1.3,
    )
    ratio(
        "attitude, and 1000 states on the way",
        lambda: in_full(few),
        lambda: kr.solve(TOP, few, want=WANT),
        rounds,
    )
    ratio("1000 states on the way: start and end only", record(TOP, few), record(TOP, ends), rounds)
    ratio(
        "quantities: none asked of 1000 states",
        lambda: in_full(few),
        lambda: kr.solve(TOP, few),
        rounds,
    )
    ratio(
        "gravity, taylor a step: the kernel keeps its lanes",
        by_step(symmetric),
        by_step(still),
        rounds,
    )
    ratio(
        "general form, taylor a step: two equal moments share lanes",
        by_step(general),
        by_step(symmetric),
        rounds,
    )
    ratio(
        "series: the closed form of a Lagrange top",
        record(symmetric, ends),
        lambda: kr.solve(symmetric, END),
        rounds,
    )
    times = np.linspace(0, 10, MANY)
    for name, call in {
        "all states": lambda: kr.solve(TOP, times),
        f"want={WANT}": lambda: kr.solve(TOP, times, want=WANT),
        f"a stream of want={WANT}": lambda: [None for _ in kr.stream(TOP, times, want=WANT)],
    }.items():
        print(f"memory, {MANY:,} states: {name:<40}{peak(call) / 1e6:8.1f} MB")


def by_step(scene):
    """So many steps of a top that they take about as long as a call can tell, the same number for every scene."""
    return lambda: kr._core.record(scene._block, "taylor", 0.0, 0.0, 0, 1000, False, [1e5])


def stops():
    print("Ctrl-C: until it is raised, median and longest of five; must 50 ms")
    for name, code in STOPS.items():
        took = [
            float(
                subprocess.run(
                    [sys.executable, "-c", STOPPED.format(code)],
                    capture_output=True,
                    text=True,
                    check=True,
                    timeout=60,
                ).stdout
            )
            for _ in range(5)
        ]
        print(
            f"{name:<40}{1e3 * median(took):8.1f} ms {1e3 * max(took):8.1f} ms  {verdict(median(took), 0.05, float.__le__)}"
        )


def checkpoints(rounds):
    print("Checkpoints: made, read, and their size")
    for name, how in {
        "taylor": {},
        "taylor, 30 digits": {"digits": 30},
        "extrap": {"method": "extrap"},
        "strang": {"method": "strang", "step": 0.01},
    }.items():
        run = kr.start(TOP, **how)
        run.to(5.0)
        saved = run.checkpoint
        calls = [lambda run=run: run.checkpoint, lambda saved=saved: kr.resume(saved)]
        samples, _ = measure.interleaved(calls, [measure.once(call) for call in calls], rounds)
        make, read = (1e6 * min(got) for got in samples)
        print(f"{name:<40}{make:8.0f} us {read:8.0f} us {len(saved):8} bytes")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--rounds", type=int, default=25)
    rounds = parser.parse_args().rounds
    left_out(rounds)
    stops()
    checkpoints(rounds)


if __name__ == "__main__":
    main()
