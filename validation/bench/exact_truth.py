"""How exact kreisel.exact is: `python -m validation.bench.exact_truth`, against truths that share no formula with it.

The tops of exact_cases by name and at random, by quadrature in 50 digits (exact_reference); some of them by heyoka in
128 bit, too, which checks the quadrature; and the k-th state of the Bobenko-Suris map against the map in 113 bits.
Errors are angles [rad]; of the momentum in units of the largest that the top's energy allows. --full: 20,000 tops.
"""

import argparse
import math
import multiprocessing
import shutil
import subprocess
import tempfile
from pathlib import Path
from textwrap import fill

import mpmath as mp
import numpy as np

from ..truth import exact_cases as cases
from ..truth.quadrature import DIGITS, Euler, Lagrange, attitude_error, dot

HERE = Path(__file__).parent
TIMES = (1.0, 1e3, 1e6)
TRUTH_TIMES = (7.0, 1e6)  # of the C tests


def reference(case):
    """The truth of a case, and the scale of its momentum."""
    if len(case) == 5:
        i1, i3, lever, q, m = case
        truth = Lagrange(i1, i3, lever, cases.unit(q), m)
        kinetic = np.dot(m, m) / (2 * min(i1, i3))
        return truth, math.sqrt(2 * max(i1, i3) * (kinetic + 2 * abs(lever)))
    inertia, q, m = case
    return Euler(inertia, cases.unit(q), m), float(np.linalg.norm(m))


def momentum_error(truth, m, scale):
    with mp.workdps(DIGITS):
        off = [a - mp.mpf(float(b)) for a, b in zip(truth, m)]
        return float(mp.sqrt(dot(off, off))) / scale


def errors(case, times):
    """(attitude error, momentum error) at each time, and k'^2, the distance from a separatrix."""
    import kreisel as kr

    truth, scale = reference(case)
    path = kr.exact(cases.scene(kr, case))(list(times))
    found = []
    for t, q, m in zip(times, path.q, path.m):
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


def named():
    print(
        f"named cases: attitude errors at t = {', '.join(f'{t:g}' for t in TIMES)}; the largest momentum error"
    )
    worst = 0.0
    for name, case in {**cases.LAGRANGE, **cases.EULER}.items():
        found, kp2 = errors(case, TIMES)
        worst = max(worst, *(attitude for attitude, _ in found))
        print(
            f"  {name:34} k'^2 {kp2:7.1e}  ",
            *(f"{attitude:.1e}" for attitude, _ in found),
            f"  {max(momentum for _, momentum in found):.1e}",
            flush=True,
        )
    print(f"  worst {worst:.1e}")


def by_heyoka():
    """The quadrature against heyoka in 128 bit."""
    from ..truth import reference as truth
    from ..truth.problems import Problem

    names = ("tilted", "upside down", "disc", "unstable sleep, leaning 1e-2", "free")
    print("quadrature against heyoka in 128 bit at t = 7:")
    for name in names:
        case = {**cases.LAGRANGE, **cases.EULER}[name]
        inertia, lever = (
            ((case[0], case[0], case[1]), case[2]) if len(case) == 5 else (case[0], 0.0)
        )
        q, m = cases.unit(case[-2]), tuple(map(float, case[-1]))
        problem = Problem(name, inertia, (0.0, 0.0, lever), q, m)
        stepped = truth.states(problem, [7.0])[0][:4]
        print(f"  {name:34} {truth.angle(reference(case)[0](7)[0], stepped):.1e}", flush=True)


class QuadMap:
    """exact_map.c: the Bobenko-Suris map in 113 bits, a case a line."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.program = Path(self.folder.name) / "exact_map"
        compiler = shutil.which("gcc") or exit("needs gcc, with libquadmath")
        subprocess.run(
            [compiler, "-O2", HERE / "exact_map.c", "-lquadmath", "-o", self.program], check=True
        )

    def __call__(self, jobs):
        """For (case, step, whole numbers k): the states there, 7 mpmath numbers each."""
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
    import kreisel as kr

    case, step, ks = job
    try:
        path = kr.exact(cases.scene(kr, case), map="bobenko_suris", step=step)(ks)
    except ValueError:
        return None  # next to a separatrix
    scale = reference_scale(case)
    return [
        (attitude_error(truth[:4], q), momentum_error(truth[4:], m, scale))
        for truth, q, m in zip(states, path.q, path.m)
    ]


def reference_scale(case):
    i1, i3, lever, _, m = case
    return math.sqrt(2 * max(i1, i3) * (np.dot(m, m) / (2 * min(i1, i3)) + 2 * abs(lever)))


def maps(tops, most):
    quad = QuadMap()
    ks = [k for k in (1, 10, 1000, 30000, 1000000) if k <= most]
    jobs = [(cases.LAGRANGE[name], step, ks) for name, step in cases.MAPS]
    print(
        f"the map, named cases: attitude errors at k = {', '.join(map(str, ks))}; the largest momentum error"
    )
    for (name, step), job, states in zip(cases.MAPS, jobs, quad(jobs)):
        found = map_errors(job, states)
        print(
            f"  {name:34} step {step:5g}  ",
            *(f"{attitude:.1e}" for attitude, _ in found),
            f"  {max(momentum for _, momentum in found):.1e}",
            flush=True,
        )
    jobs = [cases.random_map(np.random.default_rng((5, number)), number) for number in range(tops)]
    found = [map_errors(job, states) for job, states in zip(jobs, quad(jobs))]
    attitude = np.array([max(error for error, _ in rows) for rows in found if rows])
    print(
        f"the map, {tops} random tops, k = 1, 10, 1000 ({sum(rows is None for rows in found)} refused, next to a separatrix):"
    )
    print(
        f"  attitude  median {np.median(attitude):.1e}  99 % {np.quantile(attitude, 0.99):.1e}  worst {attitude.max():.1e}"
    )


def header():
    """Prints tests/core/exact_truth.h."""

    def row(numbers):
        return "{" + ", ".join(f"{float(x):.17g}" for x in numbers) + "}"

    lines = []
    for name, case in {**cases.LAGRANGE, **cases.EULER}.items():
        inertia, lever = (
            ((case[0], case[0], case[1]), case[2]) if len(case) == 5 else (case[0], 0.0)
        )
        truth, q = reference(case)[0], cases.unit(case[-2])
        for t in TRUTH_TIMES:
            attitude, momentum = truth(t)
            line = (
                f'{{"{name}", {row(inertia)}, {lever:.17g}, {row(q)}, {row(case[-1])}, {t:g}, '
                f"{{{row(attitude)}, {row(momentum)}}}}},"
            )
            lines.append(fill(line, 100, initial_indent=" " * 4, subsequent_indent=" " * 5))
    print(HEADER.replace("ROWS", "\n".join(lines)), end="")


HEADER = """/* Where tops are, by quadrature in 50 digits; `python -m validation.bench.exact_truth --header`
 * prints this file. */
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


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.bench.exact_truth", description=__doc__
    )
    parser.add_argument(
        "--full", action="store_true", help="20,000 tops, the map to k = 1e6; minutes"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--header", action="store_true", help="print tests/core/exact_truth.h")
    chosen = parser.parse_args(argv)
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
