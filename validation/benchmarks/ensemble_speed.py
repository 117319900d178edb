"""The speed of many tops at once, compared with heyoka's batches, GSL and SciPy at equal error.

    python -m validation.benchmarks.ensemble_speed [throughput threads large single]

Random tops of one body are solved to t = 100 in two threads. Every program runs at several
tolerances. In each round, all runs are timed in turn. Times per top are interpolated to equal
median attitude errors, which are measured on a sample of the tops. The reference is a series with
30 digits. In each round, the time of heyoka's batches of eight is compared with kreisel's time. The
median of this ratio over the rounds is printed with the required ratio `must` and the desired ratio
`stretch`. In parentheses is the ratio of the least times. SciPy solves only a few tops on one
thread. The measured time is halved, as if two threads shared the tops.
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

from ..competitors import ensemble_runs, equal_error, timing
from ..competitors.single_runs import Setting
from ..parts.ensembles import TARGETS, compute_sleeping_map
from ..references.problems import attitude_errors
from ..references.random_ensembles import SCENES, compute_conditioning, compute_truths, draw_tops

ROOT = Path(__file__).parents[2]
BOUNDS = {
    ensemble_runs.HEYOKA: (2.2, 3),
    ensemble_runs.OWN_CALL: (8, None),
}  # required and desired ratio for asymmetric tops
BUSY = 0.5  # system load above which a warning is printed
CLOSED = 25, 50  # required and desired ratio for Lagrange tops in closed form to heyoka's batches
LARGE = """
import kreisel as kr, numpy as np, sys
from validation.references.random_ensembles import draw_tops
tops = draw_tops("Lagrange", int(sys.argv[1])).ensemble()
kr.reduce(tops, np.linspace(0, 100, 101), {"nutation": ("min", "max", "mean")})
print(next(line for line in open("/proc/self/status") if line.startswith("VmHWM")).split()[1])
"""


def print_grade(what, value, must, stretch=None, unit="", at_most=False):
    """Print a measured ratio with the required and the desired ratio."""
    sign = -1 if at_most else 1
    grades = {"stretch": stretch, "must": must}
    met = (name for name, bound in grades.items() if bound and sign * value >= sign * bound)
    bounds = f"must {must:g}" + (f" stretch {stretch:g}" if stretch else "")
    print(f"{what:62} {value:9.3g}{unit}  {bounds}: {next(met, 'MISSED')}", flush=True)


def print_peak_memory(what, command):
    """Print the peak memory of a program, which must print this memory itself [kB]."""
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    print_grade(f"{what}: peak memory", float(done.stdout) / 1000, 300, unit=" MB", at_most=True)


def throughput(options):
    for kind in SCENES:
        tops = draw_tops(kind, options.tops)
        found = equal_error.measure_runs(
            tops,
            ensemble_runs.select_movers(tops, options.each),
            compute_truths(tops.first(options.sample)),
            options.rounds,
        )
        print(f"\n{kind} tops: {len(tops)} to t = {tops.end:g}, {options.rounds} rounds")
        print(f"{'':26} {'setting':12} tops  us/top    median     90 %  largest error [rad]")
        for run in found:
            print(
                f"{run.mover:26} {run.setting:12}{run.tops:6}{1e6 * median(run.seconds):10.2f}"
                f"{run.middle:9.1e}{run.bad:9.1e}{run.worst:9.1e}"
            )
        groups = equal_error.group_by_mover(found)
        if kind == "Lagrange":
            print_closed_form(groups)
        print_at_equal_error(kind, groups)


def print_closed_form(groups):
    own, peer = groups[ensemble_runs.CLOSED.name], groups[ensemble_runs.HEYOKA]
    print_grade("Lagrange: 90 % of the closed form's errors [rad]", own[0].bad, 1e-14, at_most=True)
    value, *_ = equal_error.time_ratio(peer, own, 1e-6)
    print_grade(f"Lagrange: {ensemble_runs.HEYOKA} at 1e-6 / closed form", value, *CLOSED)


def print_at_equal_error(kind, groups):
    own = groups[ensemble_runs.SERIES.name]
    for name, peer in groups.items():
        if name not in ensemble_runs.OWN:
            for target in (*TARGETS, equal_error.tightest_common_error(own, peer)):
                told = equal_error.time_ratio(peer, own, target)
                least = equal_error.least_ratio(peer, own, target)
                what = f"{kind} at {target:.1e}: {name} / taylor (least {least:.2f})"
                print_comparison(what, told, find_bounds(kind, name))


def find_bounds(kind, name):
    return BOUNDS.get(name) if kind == "asymmetric" else None


def print_comparison(what, told, bounds):
    value, theirs, ours = told
    if np.isnan(value):
        print(f"{what:62}   not reached")
    elif bounds:
        print_grade(what, value, *bounds, f" {1e6 * theirs:9.2f} / {1e6 * ours:.2f} us")
    else:
        print(f"{what:62} {value:9.3g} {1e6 * theirs:9.2f} / {1e6 * ours:.2f} us")


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


FIGURES = {f.__name__: f for f in (throughput, threads, large, single)}


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
    options.sample, options.large, options.side, options.each = 400, 1_000_000, 500, 1
    if options.quick:
        options.tops, options.rounds = min(options.tops, 400), min(options.rounds, 2)
        options.sample, options.large, options.side, options.each = 200, 10_000, 50, 3
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
