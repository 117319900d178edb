"""The accuracy of kreisel.exact, compared with references that share no formula with it.

    python -m validation.benchmarks.closed_form_accuracy [--full] [--header]

The reference states of the tops in exact_cases are computed by quadrature in 50 digits. Some tops
are also computed by heyoka in 128-bit arithmetic, to check the quadrature. The k-th state of the
Bobenko-Suris map is compared with the map in 113-bit arithmetic. Attitude errors are angles [rad].
Momentum errors are relative to the largest momentum that the energy of the top allows. With --full,
20,000 tops are run.
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

from ..references import exact_cases as cases
from ..references import reference
from ..references.quadrature import DIGITS, Euler, Lagrange, attitude_error, dot

HERE = Path(__file__).parent
TIMES = (1.0, 1e3, 1e6)
TRUTH_TIMES = (7.0, 1e6)  # the times of the C tests


def reference_solution(case):
    """Return the reference solution of a case, and the scale for momentum errors."""
    if cases.is_lagrange(case):
        i1, i3, lever, q, m = case
        kinetic = np.dot(m, m) / (2 * min(i1, i3))
        scale = math.sqrt(2 * max(i1, i3) * (kinetic + 2 * abs(lever)))
        return Lagrange(i1, i3, lever, cases.normalize(q), m), scale
    inertia, q, m = case
    return Euler(inertia, cases.normalize(q), m, cases.digits(case)), float(np.linalg.norm(m))


def momentum_error(truth, m, scale):
    with mp.workdps(DIGITS):
        off = [a - mp.mpf(float(b)) for a, b in zip(truth, m, strict=True)]
        return float(mp.sqrt(dot(off, off))) / scale


def compute_errors(case, times):
    """Return the attitude and momentum errors at each time, and k'^2.

    k'^2, the complementary parameter, measures the distance from a separatrix.
    """
    truth, scale = reference_solution(case)
    path = kr.exact(cases.case_scene(case))(list(times))
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
    ((attitude, momentum),) = compute_errors(case, [t])[0]
    return attitude, momentum, number, t


def print_summary(title, found):
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


def print_row(name, text, found):
    errors = " ".join(f"{attitude:.1e}" for attitude, _ in found)
    largest = max(momentum for _, momentum in found)
    print(f"  {name:34} {text}   {errors}   {largest:.1e}", flush=True)


def print_cases():
    times = ", ".join(f"{t:g}" for t in TIMES)
    print(f"named cases: attitude errors at t = {times}; the largest momentum error")
    worst = 0.0
    for name, case in {**cases.LAGRANGE, **cases.EULER}.items():
        found, kp2 = compute_errors(case, TIMES)
        worst = max(worst, *(attitude for attitude, _ in found))
        print_row(name, f"k'^2 {kp2:7.1e}", found)
    print(f"  worst {worst:.1e}")


def check_quadrature():
    """Compare the quadrature with heyoka in 128-bit arithmetic."""
    names = ("tilted", "upside down", "disc", "unstable sleep, leaning 1e-2", "free")
    print("quadrature against heyoka in 128 bit at t = 7:")
    for name in names:
        case = {**cases.LAGRANGE, **cases.EULER}[name]
        stepped = reference.integrate_states(cases.case_problem(name, case), [7.0])[0][:4]
        solution, _ = reference_solution(case)
        print(
            f"  {name:34} {reference.rotation_angle(solution(7)[0], stepped):.1e}",
            flush=True,
        )


class QuadMap:
    """The Bobenko-Suris map in 113-bit arithmetic, computed by exact_map.c."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.program = Path(self.folder.name) / "exact_map"
        compiler = shutil.which("gcc") or exit("needs gcc, with libquadmath")
        subprocess.run(
            [compiler, "-O2", HERE / "exact_map.c", "-lquadmath", "-o", self.program], check=True
        )

    def __call__(self, jobs):
        """Return the states after k steps, for jobs (case, step, list of k).

        A state has 7 mpmath numbers.
        """
        lines = []
        for (i1, i3, lever, q, m), step, ks in jobs:
            numbers = (i1, i3, lever, step, *cases.normalize(q), *m)
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
        path = kr.exact(cases.case_scene(case), map="bobenko_suris", step=step)(ks)
    except ValueError:
        return None  # too close to a separatrix
    _, scale = reference_solution(case)
    return [
        (attitude_error(truth[:4], q), momentum_error(truth[4:], m, scale))
        for truth, q, m in zip(states, path.q, path.m, strict=True)
    ]


def print_maps(tops, most):
    quad = QuadMap()
    ks = [k for k in (1, 10, 1000, 30000, 1000000) if k <= most]
    jobs = [(cases.LAGRANGE[name], step, ks) for name, step in cases.MAPS]
    at = ", ".join(map(str, ks))
    print(
        f"Bobenko-Suris map, named cases: attitude errors at k = {at}; the largest momentum error"
    )
    for (name, step), job, states in zip(cases.MAPS, jobs, quad(jobs), strict=True):
        print_row(name, f"step {step:5g}", map_errors(job, states))
    print_random_maps(quad, tops)


def print_random_maps(quad, tops):
    jobs = [cases.random_map(np.random.default_rng((5, number)), number) for number in range(tops)]
    found = [map_errors(job, states) for job, states in zip(jobs, quad(jobs), strict=True)]
    refused = sum(rows is None for rows in found)
    attitude = np.array([max(error for error, _ in rows) for rows in found if rows])
    print(f"Bobenko-Suris map, {tops} random tops, k = 1, 10, 1000")
    print(f"  ({refused} refused near a separatrix):")
    print(
        f"  attitude  median {np.median(attitude):.1e}  99 % {np.quantile(attitude, 0.99):.1e}  "
        f"worst {attitude.max():.1e}"
    )


def print_header():
    """Print the contents of tests/c/exact_truth.h."""

    def row(numbers):
        return "{" + ", ".join(f"{float(x):.17g}" for x in numbers) + "}"

    lines = []
    for name, case in {**cases.LAGRANGE, **cases.EULER}.items():
        inertia, lever = cases.inertia_and_lever(case)
        truth, q = reference_solution(case)[0], cases.normalize(case[-2])
        for t in (*TRUTH_TIMES, *cases.TRANSITS.get(name, ())):
            attitude, momentum = truth(t)
            line = (
                f'{{"{name}", {row(inertia)}, {lever:.17g}, {row(q)}, {row(case[-1])}, {t:g}, '
                f"{{{row(attitude)}, {row(momentum)}}}}},"
            )
            lines.append(fill(line, 100, initial_indent=" " * 4, subsequent_indent=" " * 5))
    print(HEADER.replace("ROWS", "\n".join(lines)), end="")


HEADER = """/* States of tops by quadrature in 50 digits or more. This file is printed by
 * `python -m validation.benchmarks.closed_form_accuracy --header`. */
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


def parse_options(argv):
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.closed_form_accuracy",
        description=__doc__.splitlines()[0],
    )
    parser.add_argument(
        "--full", action="store_true", help="20,000 tops, and k up to 1e6; takes minutes"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--header", action="store_true", help="print tests/c/exact_truth.h")
    return parser.parse_args(argv)


def main(argv=None):
    chosen = parse_options(argv)
    if chosen.header:
        print_header()
        return 0
    print_cases()
    check_quadrature()
    print_maps(4000 if chosen.full else 100, 1000000 if chosen.full else 30000)
    with multiprocessing.Pool() as pool:
        for title, tops, euler in (
            ("Lagrange tops", 20000 if chosen.full else 300, False),
            ("free bodies", 4000 if chosen.full else 100, True),
        ):
            jobs = ((chosen.seed, number, euler) for number in range(tops))
            print_summary(title, list(pool.imap_unordered(random_error, jobs, chunksize=20)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
