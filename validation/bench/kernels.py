"""Inside the Taylor method: python -m validation.bench.kernels [sets headless limits orders depth]

Kernels, orders, tolerances and numbers of terms that users cannot choose, from C, without Python's share. As in
taylor.py: one process, in turn, medians of ratios.
"""

import argparse
import ctypes
from statistics import median

import numpy as np

from ..peers import measure
from ..truth.problems import load
from .taylor import (
    EPS,
    SCENES,
    error,
    heyoka,
    horizon,
    line,
    medians,
    reaching,
    real128,
    truth_error,
)
from .taylor_kernels import Kernels


def block(name):
    return np.frombuffer(load(name).scene()._block)


def sets():
    """Each instruction set against heyoka, which always uses the machine's best."""
    kernels, plain = Kernels(), Kernels(plain=True)
    for name in ("thesis", "asymmetric"):
        scene = block(name)
        for target, order in ((1e-3, 12), (1e-6, 16), (0, 28)):
            t, kernel = horizon(name, target), kernels.orders.index(order)
            peer, f = reaching(heyoka, name, t, target, EPS)
            errors = [
                error(name, t, kernels.run(scene, 0, kernel, tol, t)()[0, 1:5])
                for tol in range(-10, -54, -1)
            ]
            tol = next((-10 - k for k in range(44) if max(errors[k:]) <= target), -53)
            runs = [kernels.run(scene, i, kernel, tol, t) for i in range(len(kernels.sets))]
            runs.append(plain.run(scene, 0, kernel, tol, t))
            errors = [error(name, t, run()[0, 1:5]) for run in runs]
            *own, b = medians([*runs, peer])
            for which, a, e in zip([*kernels.sets, "plain C"], own, errors):
                print(
                    f"{name} {target or 'tightest'} {which:7} heyoka/ours {b / a:5.2f}   {a * 1e6:7.1f} us, errors {f:.0e} / {e:.0e}"
                )


def headless():
    """What leaving the heading out saves, at equal tolerance; and what it would if the heading were added for itself."""
    kernels = Kernels()
    for name in ("asymmetric", "thesis"):
        scene, t = block(name), horizon(name, 0)
        for i, (order, tol) in enumerate(zip(kernels.orders, (-15, -22, -30, -40, -53))):
            n = len(kernels.orders)
            runs = [
                kernels.run(scene, 0, kernel, tol, t) for kernel in (i, n + 2 + i, 2 * n + 2 + i)
            ]
            a, b, c = medians(runs)
            line(
                f"{name} order {order}, tol 2^{tol}: whole/headless",
                a / b,
                1.1,
                1.3,
                f"{a * 1e6:.1f} / {b * 1e6:.1f} us; with the heading added {c * 1e6:.1f} us, {a / c:.2f}",
            )


def operations(order):
    """Of vectors, in a step of the widest kernel: of the pairs and middle terms of the sums; of the rest: 3 to join two sums,
    6 for the rates of q and P, 11 for those of W, 5 to turn W's lanes, 2 in the sum at the end."""
    pairs, middles = sum((n + 1) // 2 for n in range(order)), (order + 1) // 2
    return 7 * pairs + 5 * middles, 27 * order


def limits():
    """How near the widest kernel comes to what the machine could do, two operations in a cycle of its clock. What is missing it
    waits for: each coefficient for the one before, the sum at the end for the step."""
    kernels = Kernels()
    name, steps = "thesis", ctypes.c_int64()
    clock = kernels.library.kr_bench_cycle
    clock.restype = ctypes.c_double
    for i, order in enumerate(kernels.orders):
        run = kernels.run(block(name), 0, i, -40, 100.0, steps)
        run()
        times = [(measure.once(run), clock()) for _ in range(101)]
        cycles = median(a / b for a, b in times) / steps.value
        sums, rest = operations(order)
        print(
            f"order {order}: {cycles * median(b for _, b in times) * 1e9:.0f} ns, {cycles:.0f} cycles a step; {sums} operations in the "
            f"sums and {rest} beside them take {(sums + rest) / 2:.0f} at two a cycle: {(sums + rest) / 2 / cycles:.0%} of the peak"
        )


def orders():
    """What the choice of order by tolerance rests on: time and error of each order."""
    kernels = Kernels()
    for name in SCENES:
        scene, t = block(name), horizon(name, 0)
        for log2_tol in range(-13, -54, -4):
            runs = [
                kernels.run(scene, 0, kernel, log2_tol, t) for kernel in range(len(kernels.orders))
            ]
            cells = (
                f"{1e6 * a:6.1f} us {error(name, t, run()[0, 1:5]):.0e}"
                for a, run in zip(medians(runs, 9), runs)
            )
            print(
                f"{name} tol 2^{log2_tol}   order {', '.join(map(str, kernels.orders))}: "
                + "   ".join(cells),
                flush=True,
            )


def depth():
    """What head, order and tolerance for 20 and 30 digits rest on: time and error of others."""
    for head, last in ((6, 28), (7, 28), (8, 28), (10, 28), (8, 24), (8, 32)):
        look_at(
            Kernels((head, last, 20, 36)),
            0,
            f"20 digits: head {head} of {last}",
            (-66, -70, -74),
            2e4,
        )
    for head, last in (
        (16, 36),
        (18, 36),
        (20, 36),
        (22, 36),
        (26, 36),
        (20, 32),
        (20, 40),
        (24, 40),
        (20, 44),
    ):
        look_at(
            Kernels((8, 28, head, last)),
            1,
            f"30 digits: head {head} of {last}",
            (-96, -100, -104),
            100.0,
        )


def look_at(kernels, deep, what, tolerances, t):
    for log2_tol in tolerances:
        print(f"{what} tol 2^{log2_tol}", end="")
        for name in ("thesis", "asymmetric_regular"):
            run = kernels.run(block(name), 0, len(kernels.orders) + deep, log2_tol, t)
            true = real128(name, t, "1e-33")() if deep else None
            (high, low), seconds = run()[:, 1:5].copy(), min(measure.once(run) for _ in range(5))
            q = np.concatenate((high, low))
            print(
                f"   {name} {seconds * 1e3:.2f} ms {error(name, t, q) if true is None else truth_error(true, q):.1e}",
                end="",
            )
        print(flush=True)


def main():
    known = {f.__name__: f for f in (sets, headless, limits, orders, depth)}
    parser = argparse.ArgumentParser(prog="python -m validation.bench.kernels", description=__doc__)
    parser.add_argument(
        "what", nargs="*", choices=[*known, []], help="which figures; all but orders and depth"
    )
    for name in parser.parse_args().what or list(known)[:3]:
        known[name]()


if __name__ == "__main__":
    main()
