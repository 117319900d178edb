"""Ensembles: the gain of a second thread, large ensembles, and errors relative to individual runs.

    python -m validation.benchmarks.ensemble_speed [threads large single]

Random tops of one body are solved to t = 100. The reference is a series with 30 digits. Each figure
is printed with the required value `must`. The part `ensembles` of the report compares the speed
with that of other programs.
"""

import argparse
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from statistics import median

import kreisel as kr
import numpy as np

from ..competitors import ensemble_runs, timing
from ..competitors.single_runs import Setting
from ..parts.ensembles import compute_sleeping_map
from ..references.problems import attitude_errors
from ..references.random_ensembles import SCENES, compute_conditioning, compute_truths, draw_tops

ROOT = Path(__file__).parents[2]
BUSY = 0.5  # system load above which a warning is printed
LARGE = """
import kreisel as kr, numpy as np, sys
from validation.references.random_ensembles import draw_tops
tops = draw_tops("Lagrange", int(sys.argv[1])).ensemble()
kr.reduce(tops, np.linspace(0, 100, 101), {"nutation": ("min", "max", "mean")})
print(next(line for line in open("/proc/self/status") if line.startswith("VmHWM")).split()[1])
"""


def print_grade(what, value, must, unit="", at_most=False):
    """Print a measured value with the required value."""
    grade = "must" if (value <= must if at_most else value >= must) else "MISSED"
    print(f"{what:62} {value:9.3g}{unit}  must {must:g}: {grade}", flush=True)


def print_peak_memory(what, command):
    """Print the peak memory of a program, which must print this memory itself [kB]."""
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    print_grade(f"{what}: peak memory", float(done.stdout) / 1000, 300, unit=" MB", at_most=True)


def threads(options):
    """Print the speedups by two threads, and by two simultaneous calls on one thread each.

    The second speedup is the largest that the machine allows, because the calls share no work.
    """
    cases = {"asymmetric": ("taylor", Setting(tol=1e-9)), "Lagrange": ("exact", Setting())}
    for kind, (method, setting) in cases.items():
        for n in (options.tops, 10 * options.tops) if method == "exact" else (options.tops,):
            tops = draw_tops(kind, n)
            one, two = (ensemble_runs.make_kreisel_call(method, tops, setting, k) for k in (1, 2))
            gain, given = measure_gains(one, two, options.rounds)
            print_grade(f"{n} {kind} tops, {method}: one thread / two", gain, 1.8)
            print(f"{'two such calls in sequence / in parallel':62} {given:9.3g}")


def measure_gains(one, two, rounds):
    """Return the median speedups by two threads and by two simultaneous calls."""
    with ThreadPoolExecutor(2) as pool:

        def beside():
            for future in [pool.submit(one) for _ in range(2)]:
                future.result()

        calls = one, two, beside
        samples, _ = timing.time_in_turn(calls, [timing.time_once(call) for call in calls], rounds)
    gain = median(a / b for a, b in zip(samples[0], samples[1], strict=True))
    return gain, median(2.0 * a / c for a, c in zip(samples[0], samples[2], strict=True))


def large(options):
    """Print the time and the memory needed to solve a very large ensemble."""
    n = options.large
    side, build = options.side, draw_tops("Lagrange", n).ensemble
    for what, call, must in (
        (f"an ensemble of {n:.0e} built", build, 0.5),
        (f"the {side} x {side} sleeping map", partial(compute_sleeping_map, side), 0.5),
    ):
        seconds = median(timing.time_once(call) for _ in range(options.rounds))
        print_grade(what, seconds, must, unit=" s", at_most=True)
    print_peak_memory(f"{n:.0e} tops with reduce", [sys.executable, "-c", LARGE, str(n)])


def single(options):
    """Print the ratio of the errors of an ensemble to the errors of individual runs.

    The error of each top is divided by the effect of one rounding error at its start.
    """
    for kind in SCENES:
        tops = draw_tops(kind, options.sample)
        true, unit = compute_truths(tops), compute_conditioning(tops)
        closed = [("exact", Setting())] if kind == "Lagrange" else []
        for method, setting in [
            *closed,
            *(("taylor", Setting(tol=10.0**-k)) for k in range(6, 16, 3)),
        ]:
            many_q = ensemble_runs.make_kreisel_call(method, tops, setting, 2)()
            one_q = [
                kr.solve(tops.scene(k), [tops.end], method, **setting.keywords).q[-1]
                for k in range(len(tops))
            ]
            errors = [attitude_errors(q, true) / unit for q in (many_q, one_q)]
            print_error_ratios(f"{kind}, {method} {setting}", *errors)


def print_error_ratios(what, many_errors, one_errors):
    a, b = np.median(many_errors), np.median(one_errors)
    print_grade(f"{what}: median error / single's", a / b, 1.3, at_most=True)
    a, b = many_errors.max(), one_errors.max()
    print_grade(f"{what}: largest / largest of singles", a / b, 3, at_most=True)


FIGURES = {f.__name__: f for f in (threads, large, single)}


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.ensemble_speed", description=__doc__.splitlines()[0]
    )
    parser.add_argument(
        "what", nargs="*", choices=[*FIGURES, []], help="figures to print (default: all)"
    )
    parser.add_argument("--tops", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--quick", action="store_true", help="few tops, to test the program")
    options = parser.parse_args(argv)
    options.sample, options.large, options.side = 400, 1_000_000, 500
    if options.quick:
        options.tops, options.rounds = min(options.tops, 400), min(options.rounds, 2)
        options.sample, options.large, options.side = 200, 10_000, 50
    if (load := os.getloadavg()[0]) > BUSY:
        print(
            f"the machine is busy (load {load:.1f}); ratios are inaccurate, "
            "and two threads gain little"
        )
    for name in options.what or FIGURES:
        FIGURES[name](options)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
