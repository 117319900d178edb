"""Many tops at once, beside heyoka's batches, GSL and SciPy at equal error: python -m
validation.bench.ensemble [throughput threads large single]

Random tops of one body to t = 100, in two threads. Each contender runs at several tolerances, all
in turn, round by round; times are those of a top, read off where the median attitude errors of a
sample are equal, and what is graded is the median over the rounds of ratios to heyoka's batches of
eight, led by hand. The errors are those against a series of 30 digits. `must` and `stretch` are
what was promised. SciPy moves a few tops only, on one thread, and is counted as if two shared them.
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

from ..parts.many import TARGETS, sleeping_map
from ..peers import equal_error, measure, movers
from ..peers.contenders import Setting
from ..truth.many import SCENES, conditioning, random, truths
from ..truth.problems import attitude_errors

ROOT = Path(__file__).parents[2]
BOUNDS = {movers.HEYOKA: (2.2, 3), movers.OWN_CALL: (8, None)}  # of asymmetric tops: must, stretch
BUSY = 0.5  # from this load on
CLOSED = 25, 50  # of Lagrange tops, in closed form, beside heyoka's batches
LARGE = """
import kreisel as kr, numpy as np, sys
from validation.truth.many import random
tops = random("Lagrange", int(sys.argv[1])).ensemble()
kr.reduce(tops, np.linspace(0, 100, 101), {"nutation": ("min", "max", "mean")})
print(next(line for line in open("/proc/self/status") if line.startswith("VmHWM")).split()[1])
"""


def graded(what, value, must, stretch=None, unit="", at_most=False):
    """Prints a figure beside what was promised."""
    sign = -1 if at_most else 1
    grades = {"stretch": stretch, "must": must}
    met = (name for name, bound in grades.items() if bound and sign * value >= sign * bound)
    bounds = f"must {must:g}" + (f" stretch {stretch:g}" if stretch else "")
    print(f"{what:62} {value:9.3g}{unit}  {bounds}: {next(met, 'MISSED')}", flush=True)


def throughput(options):
    for kind in SCENES:
        tops = random(kind, options.tops)
        found = equal_error.runs(
            tops,
            movers.suited(tops, options.each),
            truths(tops.first(options.sample)),
            options.rounds,
        )
        print(f"\n{kind} tops: {len(tops)} to t = {tops.end:g}, {options.rounds} rounds")
        print(f"{'':26} {'setting':12} tops  us a top   median     90 %  largest error [rad]")
        for run in found:
            print(
                f"{run.mover:26} {run.setting:12}{run.tops:6}{1e6 * median(run.seconds):10.2f}"
                f"{run.middle:9.1e}{run.bad:9.1e}{run.worst:9.1e}"
            )
        groups = equal_error.by_mover(found)
        if kind == "Lagrange":
            closed(groups)
        at_equal_error(kind, groups)


def closed(groups):
    own, peer = groups[movers.CLOSED.name], groups[movers.HEYOKA]
    graded("Lagrange: 90 % of the closed form's errors [rad]", own[0].bad, 1e-14, at_most=True)
    value, *_ = equal_error.ratio(peer, own, 1e-6)
    graded(f"Lagrange: {movers.HEYOKA} at 1e-6 / closed form", value, *CLOSED)


def at_equal_error(kind, groups):
    own = groups[movers.SERIES.name]
    for name, peer in groups.items():
        if name not in movers.OWN:
            for target in (*TARGETS, equal_error.tightest(own, peer)):
                told = equal_error.ratio(peer, own, target)
                compared(f"{kind} at {target:.1e}: {name} / taylor", told, bounds_of(kind, name))


def bounds_of(kind, name):
    return BOUNDS.get(name) if kind == "asymmetric" else None


def compared(what, told, bounds):
    value, theirs, ours = told
    if np.isnan(value):
        print(f"{what:62}   not reached")
    elif bounds:
        graded(what, value, *bounds, f" {1e6 * theirs:9.2f} / {1e6 * ours:.2f} us")
    else:
        print(f"{what:62} {value:9.3g} {1e6 * theirs:9.2f} / {1e6 * ours:.2f} us")


def threads(options):
    """Prints how much faster two threads are than one, and how much two calls beside each other,
    one thread each: more than that the machine does not give."""
    cases = {"asymmetric": ("taylor", Setting(tol=1e-9)), "Lagrange": ("exact", Setting())}
    for kind, (method, setting) in cases.items():
        for n in (options.tops, 10 * options.tops) if method == "exact" else (options.tops,):
            tops = random(kind, n)
            one, two = (movers.by_kreisel(method, tops, setting, k) for k in (1, 2))
            gain, given = gains(one, two, options.rounds)
            graded(f"{n} {kind} tops, {method}: one thread / two", gain, 1.8)
            print(f"{'two such calls one after the other / beside each other':62} {given:9.3g}")


def gains(one, two, rounds):
    """Gives the medians over the rounds of one call over the other, and over half of the time that
    the first takes twice beside itself."""
    with ThreadPoolExecutor(2) as pool:

        def beside():
            for future in [pool.submit(one) for _ in range(2)]:
                future.result()

        calls = one, two, beside
        samples, _ = measure.interleaved(calls, [measure.once(call) for call in calls], rounds)
    gain = median(a / b for a, b in zip(samples[0], samples[1], strict=True))
    return gain, median(2.0 * a / c for a, c in zip(samples[0], samples[2], strict=True))


def large(options):
    """Prints what very many tops take of time and memory."""
    n = options.large
    side, build = options.side, random("Lagrange", n).ensemble
    for what, call, must in (
        (f"an ensemble of {n:.0e} built", build, 0.5),
        (f"the {side} x {side} sleeping map", partial(sleeping_map, side), 0.5),
    ):
        seconds = median(measure.once(call) for _ in range(options.rounds))
        graded(what, seconds, must, unit=" s", at_most=True)
    command = [sys.executable, "-c", LARGE, str(n)]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    graded(
        f"{n:.0e} tops with reduce: peak memory",
        float(done.stdout) / 1000,
        300,
        unit=" MB",
        at_most=True,
    )


def single(options):
    """Prints the errors of an ensemble over those of single runs, in units of what a rounding of
    the start does to each top."""
    for kind in SCENES:
        tops = random(kind, options.sample)
        true, unit = truths(tops), conditioning(tops)
        closed = [("exact", Setting())] if kind == "Lagrange" else []
        for method, setting in [
            *closed,
            *(("taylor", Setting(tol=10.0**-k)) for k in range(6, 16, 3)),
        ]:
            many_q = movers.by_kreisel(method, tops, setting, 2)()
            one_q = [
                kr.solve(tops.scene(k), [tops.end], method, **setting.words).q[-1]
                for k in range(len(tops))
            ]
            errors = [attitude_errors(q, true) / unit for q in (many_q, one_q)]
            within(f"{kind}, {method} {setting}", *errors)


def within(what, many_errors, one_errors):
    a, b = np.median(many_errors), np.median(one_errors)
    graded(f"{what}: median error / single's", a / b, 1.3, at_most=True)
    a, b = many_errors.max(), one_errors.max()
    graded(f"{what}: largest / largest of singles", a / b, 3, at_most=True)


FIGURES = {f.__name__: f for f in (throughput, threads, large, single)}


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.bench.ensemble", description=__doc__
    )
    parser.add_argument("what", nargs="*", choices=[*FIGURES, []], help="which figures; else all")
    parser.add_argument("--tops", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--quick", action="store_true", help="few tops: shows that all works")
    options = parser.parse_args(argv)
    options.sample, options.large, options.side, options.each = 400, 1_000_000, 500, 1
    if options.quick:
        options.tops, options.rounds = min(options.tops, 400), min(options.rounds, 2)
        options.sample, options.large, options.side, options.each = 200, 10_000, 50, 3
    if (load := os.getloadavg()[0]) > BUSY:
        print(f"the machine is busy (load {load:.1f}): ratios are rough, two threads gain little")
    for name in options.what or FIGURES:
        FIGURES[name](options)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
