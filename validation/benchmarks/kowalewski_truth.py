"""Reference states for tests/c/test_torus_forms.c, computed by heyoka in 128-bit arithmetic.

    python -m validation.benchmarks.kowalewski_truth > tests/c/kowalewski_truth.h

The computation of these reference states takes a few minutes.
"""

import argparse
import sys
from textwrap import fill
from typing import NamedTuple

import heyoka as hy
import mpmath as mp
import numpy as np

from ..references.equations import (
    COEFFICIENTS,
    CYCLE,
    build_general_system,
    compute_coefficients,
    product,
    round_to,
    start_state,
)

TOPS, SEED = 52, 36
LATE = {40: 1000.0, 41: -1000.0, 42: 1500.0, 43: -500.0, 44: 3000.0}


class Top(NamedTuple):
    inertia: tuple
    com: tuple
    gravity: float
    attitude: tuple
    momentum: tuple
    time: float

    @property
    def lever(self):
        """The product mass * gravity * com as mpmath numbers, without rounding."""
        return [mp.mpf(self.gravity) * mp.mpf(x) for x in self.com]


def draw_body(ratio, number, rng):
    """Return a random body with two equal principal moments, a gravity, and a random attitude."""
    unit, odd = 2.0 ** rng.integers(-3, 4), CYCLE[number % 3]
    direction = rng.normal(size=2) if number % 4 == 3 else np.eye(2)[rng.integers(2)]
    com = np.zeros(3)
    com[list(odd[:2])] = direction * rng.choice([-1, 1]) * 2.0 ** rng.uniform(-2, 2)
    inertia = np.empty(3)
    inertia[list(odd)] = ratio * unit, ratio * unit, unit
    gravity = float((1.0, 9.81, -2.5)[number % 5 % 3])
    attitude = rng.normal(size=4)
    attitude /= np.linalg.norm(attitude)
    return inertia, unit, com, gravity, attitude


def draw(number, rng):
    """Draw a random Kowalewski top.

    The tops differ in the order of the axes, the sign of gravity and the direction of time. The
    centre of mass lies in the plane of the two principal axes with equal moments of inertia.
    """
    inertia, unit, com, gravity, attitude = draw_body(2, number, rng)
    rate = np.sqrt(abs(gravity) * np.linalg.norm(com) / unit)
    momentum = rng.normal(size=3) * 2 * unit * rate * 10.0 ** rng.uniform(-1, 1)
    if number >= 45:  # <m, e3> is zero or small for these tops, and m is zero for the last two
        momentum[2] = (0.0, 1e-3, -1e-6, 1e-10, 1e-17, 0.0, 0.0)[number - 45]
        momentum *= number < 50
    time = LATE.get(number, 10.0 ** rng.uniform(0, 2.3) * rng.choice([-1, 1]))
    return make_top(inertia, com, gravity, attitude, momentum, time / rate)


def make_top(inertia, com, gravity, attitude, momentum, time):
    """Return a top with its final time rounded to a multiple of 2^-20."""
    return Top(
        *(tuple(map(float, x)) for x in (inertia, com)),
        gravity,
        tuple(map(float, attitude)),
        tuple(map(float, momentum)),
        round(time * 2**20) / 2**20,
    )


def format_row(numbers):
    return "{" + ", ".join(f"{float(x):.17g}" for x in numbers) + "}"


def format_top(top, attitude, momentum):
    """Format a top and its final state as lines of C source code."""
    rows = [format_row(x) for x in (top.inertia, top.com, top.attitude, top.momentum)]
    line = (
        f"{{{rows[0]}, {rows[1]}, {top.gravity:.17g}, {rows[2]}, {rows[3]}, {top.time:.17g}, "
        f"{format_row(attitude)}, {format_row(momentum)}}},"
    )
    return fill(line, 100, initial_indent=" " * 4, subsequent_indent=" " * 5)


def integrator():
    """Compile a heyoka integrator that can be used for all tops."""
    fp = hy.real128
    return hy.taylor_adaptive(
        build_general_system(fp),
        [fp(0)] * 7,
        fp_type=fp,
        pars=[fp(0)] * COEFFICIENTS,
        compact_mode=True,
    )


def follow(move, top):
    """Integrate the equations of motion of a top, and return the final attitude and momentum."""
    fp = hy.real128
    move.pars[:] = round_to(compute_coefficients(top), fp)
    move.state[:] = round_to(start_state(top), fp)
    move.time = fp(0)
    outcome = move.propagate_until(fp(top.time))[0]
    if outcome != hy.taylor_outcome.time_limit:
        raise ArithmeticError(f"heyoka stopped before t = {top.time}: {outcome}")
    q, w = np.split(np.array([mp.mpf(str(x)) for x in move.state]), [4])
    back = [q[0], -q[1], -q[2], -q[3]]
    momentum = [mp.mpf(i) * x for i, x in zip(top.inertia, w, strict=True)]
    return q, product(product(q, [0, *momentum]), back)[1:]


def main(words=None):
    argparse.ArgumentParser(
        prog="python -m validation.benchmarks.kowalewski_truth", description=__doc__.splitlines()[0]
    ).parse_args(words)
    mp.mp.dps = 40
    print(HEADER.replace("ROWS", "\n".join(compute_rows(draw, TOPS, SEED))), end="")


def compute_rows(draw, count, seed):
    """Draw random tops, integrate them, and format the results as lines of C source code."""
    rng, move, rows = np.random.default_rng(seed), integrator(), []
    for number in range(count):
        top = draw(number, rng)
        rows.append(format_top(top, *follow(move, top)))
        print(number, file=sys.stderr, flush=True)
    return rows


HEADER = """/* States of Kowalewski tops, computed by heyoka in quadruple precision;
 * `python -m validation.benchmarks.kowalewski_truth` prints this file. */
/* clang-format off */
#ifndef KR_KOWALEWSKI_TRUTH_H
#define KR_KOWALEWSKI_TRUTH_H
#include "torus_tops.h"

static const torus_truth kowalewski_truths[] = {
ROWS
};
#endif
"""

if __name__ == "__main__":
    main()
