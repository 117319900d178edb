"""The run time and memory of a sweep, and the time to plan, interrupt and verify it.

    python -m validation.benchmarks.sweep_costs [cost memory plan stop check]

`must` is the required result. `cost` computes the same tops part by part, once as a sweep and once
as ensembles without files. In each round, both computations are timed in turn. The files are
written to --folder.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import kreisel as kr
import numpy as np

from ..competitors import timing
from .ensemble_speed import BUSY, print_grade, print_peak_memory

KEPT = {"nutation": ("min", "max", "mean")}
TIMES = np.linspace(0, 100, 101)
MILLION = 1_000_000
MEMORY = """
import sys
import kreisel as kr, numpy as np
tops = kr.Source.random(kr.scenes.sleeping, int(sys.argv[2]), spin=(0, 20), tilt=(0.01, 1))
kept = {"nutation": ("min", "max", "mean")}
kr.sweep(tops, np.linspace(0, 100, 101), folder=sys.argv[1], reduce=kept)
print(next(line for line in open("/proc/self/status") if line.startswith("VmHWM")).split()[1])
"""
STOPPED = """
import sys
from validation.benchmarks.sweep_costs import run_sweep
def tell(share):
    print(share, flush=True)
run_sweep(sys.argv[1], int(sys.argv[2]), progress=tell)
"""
PLAN = """
t = { from = 0, to = 100, n = 101 }
scene = "sleeping"
[reduce]
nutation = ["min", "max", "mean"]
[random]
n = %d
spin = [0, 20]
tilt = [0.01, 1]
"""


def make_source(n):
    """Return a source of random Lagrange tops."""
    return kr.Source.random(kr.scenes.sleeping, n, seed=1, spin=(0, 20), tilt=(0.01, 1))


def run_sweep(folder, n, **more):
    return kr.sweep(make_source(n), TIMES, folder=folder, reduce=KEPT, **more)


def cost(options):
    """Print the ratio of the time of a sweep to the time of the same ensembles without files."""
    tops, ratios = make_source(options.tops), []
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        part = kr.sweep(tops, TIMES, folder=f"{folder}/plan", reduce=KEPT, parts=range(0)).plan[
            "part_size"
        ]

        def without():
            for begin in range(0, len(tops), part):
                kr.reduce(tops[begin : begin + part], TIMES, KEPT)

        for k in range(options.rounds):
            files = timing.time_once(lambda k=k: run_sweep(f"{folder}/{k}", options.tops))
            ratios.append(files / timing.time_once(without))
        size = sum(file.stat().st_size for file in Path(folder, "0").iterdir())
    print(f"{options.tops} tops: {1e-6 * size:.3g} MB in {-(-options.tops // part)} parts")
    print(f"rounds: {', '.join(f'{ratio:.3f}' for ratio in ratios)}")
    print_grade("a sweep / the same ensembles without files", median(ratios), 1.1, at_most=True)


def memory(options):
    """Print the peak memory of a process that runs a sweep."""
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        command = [sys.executable, "-c", MEMORY, f"{folder}/runs", str(options.tops)]
        print_peak_memory(f"{options.tops} tops with reductions", command)


def plan(options):
    """Print the time to plan a sweep of very many tops."""
    spin, tilt = np.linspace(0, 20, 10_000), np.linspace(0.01, 1, 10_000)
    makers = {
        "grid": lambda: kr.Source.grid(kr.scenes.sleeping, spin=spin, tilt=tilt),
        "random": lambda: make_source(10**8),
    }
    for name, make in makers.items():
        seconds = []
        for _ in range(options.rounds):
            with tempfile.TemporaryDirectory(dir=options.folder) as folder:
                seconds.append(timing.time_once(lambda f=folder, m=make: make_plan(m(), f)))
        print_grade(f"1e8 tops planned: {name}", median(seconds), 1, unit=" s", at_most=True)


def make_plan(tops, folder):
    found = kr.sweep(tops, TIMES, folder=f"{folder}/runs", reduce=KEPT, parts=range(0))
    assert found.size == 10**8 and found.present == []


def stop(options):
    """Print the time until Ctrl-C ends a sweep that is computing a part."""
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        command = [sys.executable, "-c", STOPPED, f"{folder}/here", str(10**7)]
        time_interrupt("by threads", command, subprocess.PIPE)
        file = Path(folder, "plan.toml")
        file.write_text(PLAN % 10**7)
        command = [sys.executable, "-m", "kreisel", "sweep", str(file), "--folder", f"{folder}/by"]
        time_interrupt("by 2 processes", [*command, "--workers", "2"], None, Path(folder, "by"))


def time_interrupt(what, command, said, parts=None):
    """Send Ctrl-C when a part exists or progress is reported, and wait until the process ends."""
    with subprocess.Popen(command, stdout=said, stderr=subprocess.DEVNULL) as run:
        if parts is None:
            run.stdout.readline()
        while parts is not None and not list(parts.glob("part-*")):
            time.sleep(0.05)
        begun = time.perf_counter()
        run.send_signal(signal.SIGINT)
        run.wait()
        seconds = time.perf_counter() - begun
    print_grade(f"Ctrl-C, {what}", seconds, 1, unit=" s", at_most=True)


def check(options):
    """Print the rate at which parts are verified."""
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        found = run_sweep(f"{folder}/runs", options.tops)
        size = sum(file.stat().st_size for file in Path(found.folder).iterdir())
        seconds = median(timing.time_once(found.check) for _ in range(options.rounds))
    print(f"{'verification of all parts':62} {1e-6 * size / seconds:9.3g} MB/s")


FIGURES = {f.__name__: f for f in (cost, memory, plan, stop, check)}


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.sweep_costs", description=__doc__.splitlines()[0]
    )
    parser.add_argument(
        "what", nargs="*", choices=[*FIGURES, []], help="figures to print (default: all)"
    )
    parser.add_argument("--tops", type=int, default=MILLION)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--folder", default=None, help="parent of the temporary folders")
    options = parser.parse_args(argv)
    if (load := os.getloadavg()[0]) > BUSY:
        print(f"the machine is busy (load {load:.1f}); times are inaccurate")
    for name in options.what or FIGURES:
        FIGURES[name](options)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
