"""Compositions of order 8 with other coefficients, and with the closed form as drift.

Conclusion: kahan_li8 needs fewer kicks than the composition with 15 stages by Suzuki and Umeno. An
exact free flow costs more than the kicks that it saves. Therefore the library contains neither the
composition by Suzuki and Umeno nor an exact drift.

    python -m validation.studies.composition_study
"""

import argparse
from itertools import count
from statistics import median
from time import perf_counter

import kreisel as kr
import numpy as np

from ..references.orders import tilt_scene
from ..references.problems import rotate_to_space

# Halves of palindromes: Suzuki and Umeno 1993; Kahan and Li 1997 (Hairer, Lubich, Wanner, V.3.2)
SUZUKI_UMENO8 = (
    0.74167036435061295345,
    -0.40910082580003159400,
    0.19075471029623837995,
    -0.57386247111608226666,
    0.29906418130365592384,
    0.33462491824529818378,
    0.31529309239676659663,
)
KAHAN_LI8 = (
    0.13020248308889008088,
    0.56116298177510838456,
    -0.38947496264484728641,
    0.15884190655515560090,
    -0.39590389413323757734,
    0.18453964097831570709,
    0.25837438768632204729,
    0.29501172360931029887,
)


def make_drift(scene, method):
    """Return a function (q, m, t) -> q for motion without torque, by one step of the method."""
    free, steps = scene.replace(gravity=0.0), not kr.methods[method].exact

    def drift_attitude(q, m, t):
        words = {"step": abs(t)} if steps else {}
        return kr.solve(free.replace(attitude=q, momentum=m), [t], method=method, **words).q[-1]

    return drift_attitude


def run_composition(scene, half, end, steps, flow):
    """Return q at the end of a composition of kicks and drifts.

    `half` contains the coefficients up to the middle one.
    """
    parts = np.array([*half, 1.0 - 2.0 * sum(half), *half[::-1]]) * end / steps
    lever = np.array(scene.body.com) * scene.body.mass * scene.gravity
    q, m = np.array(scene.attitude), np.array(scene.momentum)

    def kick(part):
        return m + part * np.cross([0.0, 0.0, 1.0], rotate_to_space(q, lever))

    m = kick(0.5 * parts[0])
    for _ in range(steps):
        for now, then in zip(parts, [*parts[1:], parts[0]], strict=True):
            q = flow(q, m, now)
            m = kick(0.5 * (now + then))
    return q


def count_kicks(scene, half, end, flow, target):
    """Return approximately the smallest number of kicks whose final error meets the target."""
    truth = kr.solve(scene, end, method="taylor", tol=1e-15).q[-1]
    for steps in (round(4 * 1.08**i) for i in count()):
        if kr.attitude_error(run_composition(scene, half, end, steps, flow), truth) <= target:
            return (2 * len(half) + 1) * steps


def compare_suzuki_umeno():
    """Yield tops and the ratio of kicks of Suzuki-Umeno to kahan_li8, for an error of 1e-8."""
    for body in ("lagrange", "kowalewski", "asymmetric"):
        scene = tilt_scene(body)
        one, two = (
            count_kicks(scene, half, 3.0, make_drift(scene, "strang"), 1e-8)
            for half in (SUZUKI_UMENO8, KAHAN_LI8)
        )
        yield body, one / two


def closed_form_price():
    """Return the time to set up and evaluate a closed form, in units of a general top's step."""
    scene = tilt_scene("asymmetric", gravity=0.0)
    times = {}
    for _ in range(15):
        for name, n in (("exact", 1), ("strang", 1), ("strang", 2001)):
            words = {} if name == "exact" else {"step": 0.01}
            begin = perf_counter()
            for _ in range(20):
                kr.solve(scene, 0.01 * n, method=name, **words)
            times.setdefault((name, n), []).append((perf_counter() - begin) / 20)
    cost = {key: median(value) for key, value in times.items()}
    step = (cost["strang", 2001] - cost["strang", 1]) / 2000
    return (cost["exact", 1] - cost["strang", 1] + step) / step


def compare_free_flow():
    """Yield relative spins of a general top, and the factor by which an exact drift saves kicks."""
    for spin in (1, 8, 32):
        scene = tilt_scene("asymmetric", momentum=spin * np.array((0.172, -1.862, 1.46)))
        one, two = (
            count_kicks(scene, KAHAN_LI8, 3.0 / spin, make_drift(scene, name), 1e-8)
            for name in ("strang", "exact")
        )
        yield spin, one / two


def main(argv=None):
    """Print both comparisons."""
    argparse.ArgumentParser(
        prog="python -m validation.studies.composition_study", description=__doc__.splitlines()[0]
    ).parse_args(argv)
    for body, more in compare_suzuki_umeno():
        print(f"{body}: kicks of Suzuki and Umeno's 15 stages over kahan_li8's {more:.3g}")
    price = closed_form_price()
    for spin, fewer in compare_free_flow():
        print(
            f"asymmetric, spin x {spin}: kicks with approximate over those with exact free flow "
            f"{fewer:.3g}; the exact flow pays above {price:.3g}"
        )


if __name__ == "__main__":
    main()
