"""The accuracy of the error estimate path.error.

Conclusion: the estimate differs from the true error by at most a factor of 3, unless rounding
errors dominate. With method='geometric', the true error never exceeds the requested error.

    python -m validation.studies.error_estimates [--scenes 100] [--seed 5]

The tops are drawn at random as in references/random_scenes.py. The equations of motion are solved
forward or backward over a random time of at most about 30 units. The error estimate of a path is
compared with the largest true error of all states. The reference solutions are computed by heyoka
in 60-digit arithmetic.
"""

import argparse
import math

import kreisel as kr
import numpy as np

from ..references.multiprecision import MultiprecisionIntegrator, path_attitudes, rotation_angles
from ..references.random_scenes import FAMILIES

LOOKS = 41
FACTOR = 3.0  # tolerated ratio of estimated to true error
# tolerated fraction of ratios beyond the factor, if the errors are due to rounding
LUCKY = {"taylor 30": 0.1}
ROUNDED = {16: 1e-15, 20: 1e-31, 30: 2e-32}  # true errors below this value are not compared [rad]
WAYS = {
    "auto": {},
    "strang": {"step": 0.01},
    "kahan_li8": {"step": 0.02},
    "extrap": {"tol": 1e-7},
    "geometric": {"error": 1e-6},
    "taylor": {},
    "taylor 20": {"digits": 20},
    "taylor 30": {"digits": 30},
}


def estimate_ratio(scene, times, truth, way):
    """Return the ratio of the estimated error of a path to the true error.

    Returns None if the scene is rejected, or if the true error is as small as the rounding errors.
    Raises ArithmeticError if the true error is larger than the requested error.
    """
    method, options = way.split()[0], WAYS[way]
    try:
        path = kr.solve(scene, times, method, **options)
    except (ValueError, kr.Error):
        return None
    true = rotation_angles(path_attitudes(path), truth).max()
    if true > options.get("error", math.inf):
        raise ArithmeticError(f"the error of {way} is {true:.2g}: {scene!r}, {times[-1]!r}")
    return path.error / true if true > ROUNDED[path.digits or 16] else None


def collect_ratios(scenes, seed):
    """Return the ratios of estimated to true errors, grouped by kind of top and method."""
    rng, exactly = np.random.default_rng(seed), MultiprecisionIntegrator()
    ratios = {(family.__name__, way): [] for family in FAMILIES for way in WAYS}
    for i in range(scenes):
        family = FAMILIES[i % len(FAMILIES)]
        t = float(10 ** rng.uniform(-1.0, 1.5)) * rng.choice([1.0, -1.0])
        scene, times = family(rng), np.linspace(0.0, t, LOOKS)
        truth = exactly(scene, times)
        for way in WAYS:
            ratio = estimate_ratio(scene, times, truth, way)
            ratios[family.__name__, way] += [] if ratio is None else [ratio]
    return ratios


def print_row(name, ratios):
    """Print the range and median of the ratios; return how many lie outside [1/FACTOR, FACTOR]."""
    count = sum(not 1.0 / FACTOR <= ratio <= FACTOR for ratio in ratios)
    least, middle, most = np.quantile(ratios or [math.nan], [0.0, 0.5, 1.0])
    print(f"  {name:30}{len(ratios):6}{least:9.3g}{middle:9.3g}{most:9.3g}{count:8}", flush=True)
    return count


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.studies.error_estimates", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--seed", type=int, default=5)
    options = parser.parse_args(argv)
    ratios_by_way = collect_ratios(options.scenes, options.seed)
    print(
        f"  {'path.error / true error':30}{'paths':>6}{'least':>9}{'median':>9}{'most':>9}  beyond"
    )
    for (family, way), ratios in ratios_by_way.items():
        print_row(f"{family}, {way}", ratios)
    is_good = True
    for way in WAYS:
        ratios = [r for (_, w), values in ratios_by_way.items() if w == way for r in values]
        is_good &= print_row(way, ratios) <= LUCKY.get(way, 0.0) * len(ratios)
    print(f"  beyond: not within a factor of {FACTOR:g}; errors at rounding level are left out")
    return int(not is_good)


if __name__ == "__main__":
    raise SystemExit(main())
