"""Times and attitude errors of runs of the Taylor method, for the studies of its kernels.

All calls run alternately in one process, and times are medians. Errors are attitude errors at the
end. The reference is the series with 30 digits, or heyoka in 128-bit arithmetic.
"""

import functools
from statistics import median

import heyoka as hy
import kreisel as kr
import mpmath as mp
import numpy as np

from ..competitors import timing
from ..references import equations, reference
from ..references.problems import load_problem

SCENES = ("thesis", "kowalewski", "asymmetric", "fast", "strong_gravity")


def horizon(name, target):
    return 30.0 if name == "asymmetric" and target < 1e-7 else 100.0


@functools.cache
def solve_truth(name, t):
    return kr.solve(load_problem(name).to_scene(), t, digits=30)


def attitude_error(name, t, q):
    """Return the error of an attitude in doubles, with or without low words."""
    true = solve_truth(name, t)
    high, low = (q, np.zeros(4)) if len(q) == 4 else (q[:4], q[4:])
    want, rest = true.q[-1], true.q_low[-1]
    sign = -1.0 if high @ want < 0.0 else 1.0
    d = (sign * want - high) + (sign * rest - low)
    vec = high[0] * d[1:] - d[0] * high[1:] - np.cross(high[1:], d[1:])
    return float(2 * np.arctan2(np.linalg.norm(vec), abs(high @ want)))


def make_real128_run(name, t, tol):
    system, start = equations.build_system(load_problem(name), hy.real128)
    top = hy.taylor_adaptive(system, start, tol=hy.real128(tol), fp_type=hy.real128)

    def run():
        top.time = hy.real128(0)
        top.state[:] = start
        top.propagate_until(hy.real128(t))
        with mp.workdps(reference.DIGITS):
            q = [mp.mpf(str(x)) for x in top.state[:4]]
            high = [float(x) for x in q]
            return np.array(high + [float(x - y) for x, y in zip(q, high, strict=True)])

    return run


def median_times(calls, rounds=41):
    """Return the median time of the first call, and estimates of the times of the other calls.

    The estimate is the first time multiplied by the median ratio of both times over the rounds, in
    which all calls are interleaved.
    """
    about = [min(timing.time_once(call) for _ in range(2)) for call in calls]
    (first, *others), _ = timing.time_in_turn(calls, about, rounds)
    ratios = (median(b / a for a, b in zip(first, other, strict=True)) for other in others)
    return [median(first), *(median(first) * ratio for ratio in ratios)]


def attitude_error_with_low_words(want, q):
    """Return the angle between two attitudes given as doubles with low words."""

    def sums(q):
        high, low = q[:4].tolist(), q[4:].tolist()
        return [mp.mpf(x) + mp.mpf(y) for x, y in zip(high, low, strict=True)]

    with mp.workdps(reference.DIGITS):
        return reference.rotation_angle(sums(want), sums(q))
