"""Speed and accuracy of the Taylor method for various orders and tolerances.

Conclusion: the order of the Taylor method should be 12, 16, 18, 22 or 28, depending on the
tolerance. For 20 digits, the first 8 of 28 coefficients are computed in double-double arithmetic,
and the tolerance is 2^-70. For 30 digits, the first 20 of 36 coefficients are computed in
double-double arithmetic, and the tolerance is 2^-100.

    python -m validation.studies.taylor_kernel_study [limits orders depth]

All variants of the code run alternately in one process, and medians of the ratios of their run
times are used.
"""

import argparse
import ctypes
import functools
from statistics import median

import kreisel as kr
import mpmath as mp

from ..benchmarks.taylor_speed import median_times
from ..competitors import compiled_core, timing
from ..references import reference
from ..references.problems import load_problem
from .taylor_kernels import TaylorKernels

SCENES = ("thesis", "kowalewski", "asymmetric", "fast", "strong_gravity")


def problem_bytes(name):
    return compiled_core.scene_bytes(load_problem(name).to_scene())


def join_words(high, low):
    with mp.workdps(reference.DIGITS):
        return [mp.mpf(x) + mp.mpf(y) for x, y in zip(high.tolist(), low.tolist(), strict=True)]


@functools.cache
def solve_truth(name, t, deep=False):
    """Return the attitude at time `t`, computed in 30-digit arithmetic or by heyoka."""
    problem = load_problem(name)
    if deep:
        return reference.integrate_states(problem, [t])[0][:4]
    path = kr.solve(problem.to_scene(), [t], digits=30)
    return join_words(path.q[0], path.q_low[0])


def attitude_error(truth, states):
    """Return the attitude error of a state given in double-double precision."""
    return reference.rotation_angle(truth, join_words(*states[:, 1:5]))


def count_operations(order):
    """Return how many vector operations of a step belong to sums of products, and how many do not.

    In a sum of products, each pair of products takes 7 vector operations, and an unpaired product
    takes 5. Each Taylor coefficient requires 27 other operations: 3 additions, 17 for the
    derivatives of q, P and W, 5 permutations, and 2 for the evaluation of the series.
    """
    pairs, middles = sum((n + 1) // 2 for n in range(order)), (order + 1) // 2
    return 7 * pairs + 5 * middles, 27 * order


def limits():
    """Compare the speed of the Taylor method with the peak speed of the processor.

    The peak speed of the processor is taken to be two vector operations per clock cycle. The Taylor
    method does not reach the peak speed, because the computation of each coefficient must wait for
    the previous one.
    """
    kernels = TaylorKernels()
    name, steps = "thesis", ctypes.c_int64()
    clock = kernels.library.kr_bench_cycle
    clock.restype = ctypes.c_double
    for i, order in enumerate(kernels.orders):
        run = kernels.run(problem_bytes(name), 0, i, -40, 100.0, steps)
        run()
        times = [(timing.time_once(run), clock()) for _ in range(101)]
        cycles = median(a / b for a, b in times) / steps.value
        nanoseconds = cycles * median(b for _, b in times) * 1e9
        sums, rest = count_operations(order)
        least = (sums + rest) / 2
        print(
            f"order {order}: {nanoseconds:.0f} ns, {cycles:.0f} cycles a step; {sums} operations "
            f"in the sums and {rest} beside them take {least:.0f} at two a cycle: "
            f"{least / cycles:.0%} of the peak"
        )


def orders():
    """Print the run time and the error for each order and tolerance."""
    kernels = TaylorKernels()
    for name in SCENES:
        scene, t = problem_bytes(name), 30.0 if name == "asymmetric" else 100.0
        for log2_tol in range(-13, -54, -4):
            runs = [
                kernels.run(scene, 0, kernel, log2_tol, t) for kernel in range(len(kernels.orders))
            ]
            cells = (
                f"{1e6 * a:6.1f} us {attitude_error(solve_truth(name, t), run()):.0e}"
                for a, run in zip(median_times(runs, 9), runs, strict=True)
            )
            print(
                f"{name} tol 2^{log2_tol}   order {', '.join(map(str, kernels.orders))}: "
                + "   ".join(cells),
                flush=True,
            )


DEPTHS_20 = ((6, 28), (7, 28), (8, 28), (10, 28), (8, 24), (8, 32))
DEPTHS_30 = (
    *((16, 36), (18, 36), (20, 36), (22, 36), (26, 36)),
    *((20, 32), (20, 40), (24, 40), (20, 44)),
)


def depth():
    """Print the run times and errors of 20-digit and 30-digit computations."""
    for head, last in DEPTHS_20:
        kernels, title = TaylorKernels((head, last, 20, 36)), f"20 digits: head {head} of {last}"
        print_depth(kernels, 0, title, (-66, -70, -74), 2e4)
    for head, last in DEPTHS_30:
        kernels, title = TaylorKernels((8, 28, head, last)), f"30 digits: head {head} of {last}"
        print_depth(kernels, 1, title, (-96, -100, -104), 100.0)


def print_depth(kernels, deep, title, tolerances, t):
    for log2_tol in tolerances:
        print(f"{title} tol 2^{log2_tol}", end="")
        for name in ("thesis", "asymmetric_regular"):
            run = kernels.run(problem_bytes(name), 0, len(kernels.orders) + deep, log2_tol, t)
            error = attitude_error(solve_truth(name, t, bool(deep)), run())
            seconds = min(timing.time_once(run) for _ in range(5))
            print(f"   {name} {seconds * 1e3:.2f} ms {error:.1e}", end="")
        print(flush=True)


PARTS = {f.__name__: f for f in (limits, orders, depth)}


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m validation.studies.taylor_kernel_study", description=__doc__.splitlines()[0]
    )
    parser.add_argument(
        "what",
        nargs="*",
        choices=[*PARTS, []],
        help="figures to print (default: limits)",
    )
    for name in parser.parse_args(argv).what or ["limits"]:
        PARTS[name]()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
