"""The best order of the Taylor method for ensembles that use SIMD instructions.

Conclusion: csrc/ensemble/lane_scheduler.c uses the fastest order that does not increase the error.

    python -m validation.studies.lane_orders [orders isas limits]

For each tolerance, the Taylor method is timed for every order, and its errors are compared with the
errors obtained when each top is integrated alone. The reference solutions are computed in 20-digit
arithmetic. All integrations are called from C and timed alternately on one thread of one process.
"""

import argparse
import ctypes
import tempfile
from pathlib import Path

import kreisel as kr
import numpy as np

from ..benchmarks.compiling import compile_core
from ..benchmarks.taylor_speed import median_times
from ..competitors import peak
from ..parts.calls import processor_time

SOURCE = Path(__file__).with_suffix(".c")
TOPS, ROUNDS = 200, 5
PRODUCTS = 12  # products of series in each term (csrc/ensemble/lane_state.h)
ORDERS, LESS = range(8, 28, 2), np.arange(-3.0, 12.0)


def draw_families():
    """Yield the name, the scenes and the final time of each family of tops."""
    rng = np.random.default_rng(1)
    unlike = kr.Body.cuboid((0.5, 0.8, 1.0), pivot=(0.0, 0.0, -1.0))
    skew = kr.Body.cuboid((0.5, 0.8, 1.0), pivot=(0.3, -0.5, -1.0))
    momenta = np.array([0.172, -1.862, 1.46]) + 0.3 * rng.normal(size=(TOPS, 3))
    yield "an unequal cuboid", [kr.Scene(unlike, m, gravity=1) for m in momenta], 100.0
    yield "off its axes", [kr.Scene(skew, m, gravity=1) for m in momenta], 100.0
    yield "fast", [kr.Scene(unlike, 10.0 * m, gravity=1) for m in momenta], 100.0
    bodies = [
        kr.Body.cuboid(rng.uniform(0.05, 2.05, 3), pivot=rng.normal(size=3)) for _ in range(TOPS)
    ]
    starts = 3.0 * rng.normal(size=(TOPS, 3))
    yield "all sorts", [kr.Scene(*top, gravity=1) for top in zip(bodies, starts, strict=True)], 30.0


class LaneRunner:
    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.library = compile_core(self.folder.name, SOURCE)
        self.library.kr_bench_lanes_isa.restype = ctypes.c_char_p

    def isas(self):
        names = []
        while name := self.library.kr_bench_lanes_isa(len(names)):
            names.append(name.decode())
        return names

    def run(self, scenes, t, log2_tol, order=0, isa=0, steps=None):
        """Return a function that integrates all scenes to time `t` and returns the final attitudes.

        The total number of steps is stored in `steps`.
        """
        states = np.empty((len(scenes), 8))
        steps = ctypes.c_int64() if steps is None else steps
        blocks = b"".join(scene._block for scene in scenes)

        def run():
            if self.library.kr_bench_lanes(
                *(ctypes.c_size_t(len(scenes)), ctypes.c_char_p(blocks), isa, order),
                *(ctypes.c_double(log2_tol), ctypes.c_double(t)),
                *(ctypes.c_void_p(states.ctypes.data), ctypes.byref(steps)),
            ):
                raise RuntimeError("the run failed")
            return states[:, 1:5]

        return run


def solve_states(scenes, t, **words):
    return np.array([kr.solve(scene, [t], "taylor", **words).q[0] for scene in scenes])


def error_quantiles(q, truth):
    """Return the median and the 90 % quantile of the attitude errors [rad]."""
    return np.quantile(kr.attitude_error(q, truth), (0.5, 0.9))


def fit_tolerance(lanes, scenes, t, truth, log2_tol, order, most):
    """Find the largest tolerance for which the errors are acceptable.

    Returns the base-2 logarithm of the factor by which the tolerance is reduced, a function that
    integrates the scenes with this tolerance, and the median and the 90 % quantile of its errors.
    Returns None if the errors are too large for every tolerance.
    """
    for less in LESS:
        run = lanes.run(scenes, t, log2_tol - less, order)
        errors = error_quantiles(run(), truth)
        if (errors <= most).all():
            return less, run, errors
    return None


def orders(lanes):
    for name, scenes, t in draw_families():
        truth = solve_states(scenes, t, digits=20)
        for log2_tol in (-12, -20, -27, -33, -40, -47, -52):
            single = error_quantiles(solve_states(scenes, t, tol=2.0**log2_tol), truth)
            most = single * (1.05, 1.15)
            trials = (fit_tolerance(lanes, scenes, t, truth, log2_tol, n, most) for n in ORDERS)
            rows = [(n, *row) for n, row in zip(ORDERS, trials, strict=True) if row]
            lane_run = lanes.run(scenes, t, log2_tol)
            ratios = error_quantiles(lane_run(), truth) / single
            *times, own = median_times([*(run for _, _, run, _ in rows), lane_run], ROUNDS)
            print(
                f"{name}, tol 2^{log2_tol}, single {single[0]:.1e} {single[1]:.1e}; used: "
                f"{own / TOPS * 1e6:.1f} us, {ratios[0]:.2f} {ratios[1]:.2f} times these"
            )
            for (order, less, _, error), time in zip(rows, times, strict=True):
                microseconds = time / TOPS * 1e6
                print(f"    order {order:2} less {less:4.1f} {microseconds:7.1f} us {error[0]:.1e}")


def isas(lanes):
    for name, scenes, t in draw_families():
        runs = [lanes.run(scenes, t, -52.0, 20, i) for i in range(len(lanes.isas()))]
        times = median_times(runs, ROUNDS)
        cells = (
            f"{isa} {time / TOPS * 1e6:.1f} us ({time / times[0]:.2f})"
            for isa, time in zip(lanes.isas(), times, strict=True)
        )
        print(f"{name}, order 20, tol 2^-52: " + ", ".join(cells))


def limits(lanes):
    """Print the rate of floating-point operations, relative to the peak rate of one core.

    A step of order p takes p (p + 1) operations for each of 12 products of Taylor series.
    """
    most = peak.measure_peak()
    for name, scenes, t in draw_families():
        cells = []
        for order, log2_tol in ((12, -14.5), (14, -24.5), (16, -32.5), (18, -46.0), (20, -54.5)):
            steps = ctypes.c_int64()
            run = lanes.run(scenes, t, log2_tol, order, steps=steps)
            seconds = min(processor_time(run) for _ in range(ROUNDS))
            rate = PRODUCTS * order * (order + 1) * steps.value / seconds
            share = "" if most is None else f", {rate / most:.0%}"
            cells.append(f"{order}: {1e-9 * rate:.0f}e9/s{share}")
        print(f"{name}, operations in products at order " + "; ".join(cells), flush=True)


def main(argv=None):
    parts = {"orders": orders, "isas": isas, "limits": limits}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", default=list(parts), metavar="|".join(parts))
    names = parser.parse_args(argv).parts
    if unknown := set(names) - set(parts):
        parser.error(f"no {', '.join(sorted(unknown))}")
    lanes = LaneRunner()
    for name in names:
        parts[name](lanes)


if __name__ == "__main__":
    main()
