"""How exact kreisel.exact is, against truths that share no formula with it: python -m
validation.bench.exact_truth

The tops of exact_cases, by name and at random, are computed by quadrature in 50 digits, some of
them by heyoka in 128 bit, too, which checks the quadrature; and the k-th state of the Bobenko-Suris
map against the map in 113 bits. Errors are angles [rad]; those of the momentum are in units of the
largest that the top's energy allows. --full: 20,000 tops.
"""

import argparse
import math
import multiprocessing
import shutil
import subprocess
import tempfile
from pathlib import Path
from textwrap import fill

import kreisel as kr
import mpmath as mp
import numpy as np

from ..truth import exact_cases as cases
from ..truth import reference
from ..truth.quadrature import DIGITS, Euler, Lagrange, attitude_error, dot

HERE = Path(__file__).parent
TIMES = (1.0, 1e3, 1e6)
TRUTH_TIMES = (7.0, 1e6)  # of the C tests


def trusted(case):
    """Gives the truth of a case, and the scale of its momentum."""
    if cases.is_lagrange(case):
        i1, i3, lever, q, m = case
        kinetic = np.dot(m, m) / (2 * min(i1, i3))
        scale = math.sqrt(2 * max(i1, i3) * (kinetic + 2 * abs(lever)))
        return Lagrange(i1, i3, lever, cases.unit(q), m), scale
    inertia, q, m = case
    return Euler(inertia, cases.unit(q), m, cases.digits(case)), float(np.linalg.norm(m))


def momentum_error(truth, m, scale):
    with mp.workdps(DIGITS):
        off = [a - mp.mpf(float(b)) for a, b in zip(truth, m, strict=True)]
        return float(mp.sqrt(dot(off, off))) / scale


def errors(case, times):
    """Gives (attitude error, momentum error) at each time, and k'^2, the distance from a
    separatrix."""
    truth, scale = trusted(case)
    path = kr.exact(cases.scene(case))(list(times))
    found = []
    for t, q, m in zip(times, path.q, path.m, strict=True):
        attitude, momentum = truth(t)
        found.append((attitude_error(attitude, q), momentum_error(momentum, m, scale)))
    return found, float(truth.kp2)


def random_error(job):
    seed, number, euler = job
    rng = np.random.default_rng((seed, number))
    case = cases.random_euler(rng) if euler else cases.random_lagrange(rng, number)
    t = cases.random_time(rng)
    ((attitude, momentum),) = errors(case, [t])[0]
    return attitude, momentum, number, t


def summary(title, found):
    attitude = np.array([row[0] for row in found])
    momentum = np.array([row[1] for row in found])
    worst = max(found)
    print(f"{title}: {len(found)} tops, t log-uniform in 0.01 .. 1e6")
    for name, values in {"attitude": attitude, "momentum": momentum}.items():
        print(
            f"  {name}  median {np.median(values):.1e}  99 % {np.quantile(values, 0.99):.1e}  "
            f"99.9 % {np.quantile(values, 0.999):.1e}  worst {values.max():.1e}"
        )
    print(f"  worst is number {worst[2]} at t = {worst[3]:.3g}", flush=True)


def line(name, text, found):
    errors = " ".join(f"{attitude:.1e}" for attitude, _ in found)
    largest = max(momentum for _, momentum in found)
    print(f"  {name:34} {text}   {errors}   {largest:.1e}", flush=True)


def named():
    times = ", ".join(f"{t:g}" for t in TIMES)
    print(f"named cases: attitude errors at t = {times}; the largest momentum error")
    worst = 0.0
    for name, case in {**cases.LAGRANGE, **cases.EULER}.items():
        found, kp2 = errors(case, TIMES)
        worst = max(worst, *(attitude for attitude, _ in found))
        line(name, f"k'^2 {kp2:7.1e}", found)
    print(f"  worst {worst:.1e}")


def by_heyoka():
    """Holds the quadrature against heyoka in 128 bit."""
    names = ("tilted", "upside down", "disc", "unstable sleep, leaning 1e-2", "free")
    print("quadrature against heyoka in 128 bit at t = 7:")
    for name in names:
        case = {**cases.LAGRANGE, **cases.EULER}[name]
        stepped = reference.states(cases.problem(name, case), [7.0])[0][:4]
        print(f"  {name:34} {reference.angle(trusted(case)[0](7)[0], stepped):.1e}", flush=True)


class QuadMap:
    """The Bobenko-Suris map in 113 bits, a case a line (exact_map.c)."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.program = Path(self.folder.name) / "exact_map"
        compiler = shutil.which("gcc") or exit("needs gcc, with libquadmath")
        subprocess.run(
            [compiler, "-O2", HERE / "exact_map.c", "-lquadmath", "-o", self.program], check=True
        )

    def __call__(self, jobs):
        """Gives the states of each (case, step, whole numbers k), 7 mpmath numbers each."""
        lines = []
        for (i1, i3, lever, q, m), step, ks in jobs:
            numbers = (i1, i3, lever, step, *cases.unit(q), *m)
            lines.append(
                " ".join([*(float(x).hex() for x in numbers), str(len(ks)), *map(str, ks)])
            )
        done = subprocess.run(
            [self.program],
            input="\n".join(lines) + "\n",
            capture_output=True,
            text=True,
            check=True,
        )
        rows = iter(done.stdout.splitlines())
        with mp.workdps(DIGITS):
            return [
                [[mp.mpf(word) for word in next(rows).split()] for _ in ks] for _, _, ks in jobs
            ]


def map_errors(job, states):
    case, step, ks = job
    try:
        path = kr.exact(cases.scene(case), map="bobenko_suris", step=step)(ks)
    except ValueError:
        return None  # next to a separatrix
    _, scale = trusted(case)
    return [
        (attitude_error(truth[:4], q), momentum_error(truth[4:], m, scale))
        for truth, q, m in zip(states, path.q, path.m, strict=True)
    ]


def maps(tops, most):
    quad = QuadMap()
    ks = [k for k in (1, 10, 1000, 30000, 1000000) if k <= most]
    jobs = [(cases.LAGRANGE[name], step, ks) for name, step in cases.MAPS]
    at = ", ".join(map(str, ks))
    print(f"the map, named cases: attitude errors at k = {at}; the largest momentum error")
    for (name, step), job, states in zip(cases.MAPS, jobs, quad(jobs), strict=True):
        line(name, f"step {step:5g}", map_errors(job, states))
    random_maps(quad, tops)


def random_maps(quad, tops):
    jobs = [cases.random_map(np.random.default_rng((5, number)), number) for number in range(tops)]
    found = [map_errors(job, states) for job, states in zip(jobs, quad(jobs), strict=True)]
    refused = sum(rows is None for rows in found)
    attitude = np.array([max(error for error, _ in rows) for rows in found if rows])
    print(f"the map, {tops} random tops, k = 1, 10, 1000")
    print(f"  ({refused} refused, next to a separatrix):")
    print(
        f"  attitude  median {np.median(attitude):.1e}  99 % {np.quantile(attitude, 0.99):.1e}  "
        f"worst {attitude.max():.1e}"
    )


def header():
    """Prints tests/c/exact_truth.h."""

    def row(numbers):
        return "{" + ", ".join(f"{float(x):.17g}" for x in numbers) + "}"

    lines = []
    for name, case in {**cases.LAGRANGE, **cases.EULER}.items():
        inertia, lever = cases.inertia_and_lever(case)
        truth, q = trusted(case)[0], cases.unit(case[-2])
        for t in (*TRUTH_TIMES, *cases.TRANSITS.get(name, ())):
            attitude, momentum = truth(t)
            line = (
                f'{{"{name}", {row(inertia)}, {lever:.17g}, {row(q)}, {row(case[-1])}, {t:g}, '
                f"{{{row(attitude)}, {row(momentum)}}}}},"
            )
            lines.append(fill(line, 100, initial_indent=" " * 4, subsequent_indent=" " * 5))
    print(HEADER.replace("ROWS", "\n".join(lines)), end="")


HEADER = """/* Where tops are, by quadrature in 50 digits or more. This file is printed by
 * `python -m validation.bench.exact_truth --header`. */
/* clang-format off */
#ifndef KR_EXACT_TRUTH_H
#define KR_EXACT_TRUTH_H
#include "kreisel.h"

typedef struct exact_truth {
    const char *name;
    kr_vec3 inertia;
    double lever; /* mass gravity com, along T */
    kr_quat q;
    kr_vec3 m;
    double t;
    struct { kr_quat q; kr_vec3 m; } at;
} exact_truth;

static const exact_truth exact_truths[] = {
ROWS
};
#endif
"""


def command_line(argv):
    parser = argparse.ArgumentParser(
        prog="python -m validation.bench.exact_truth", description=__doc__
    )
    parser.add_argument(
        "--full", action="store_true", help="20,000 tops, the map to k = 1e6; minutes"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--header", action="store_true", help="print tests/c/exact_truth.h")
    return parser.parse_args(argv)


def main(argv=None):
    chosen = command_line(argv)
    if chosen.header:
        header()
        return 0
    named()
    by_heyoka()
    maps(4000 if chosen.full else 100, 1000000 if chosen.full else 30000)
    with multiprocessing.Pool() as pool:
        for title, tops, euler in (
            ("Lagrange tops", 20000 if chosen.full else 300, False),
            ("free bodies", 4000 if chosen.full else 100, True),
        ):
            jobs = ((chosen.seed, number, euler) for number in range(tops))
            summary(title, list(pool.imap_unordered(random_error, jobs, chunksize=20)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
