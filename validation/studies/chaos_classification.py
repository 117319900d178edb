"""The reliability of MEGNO as an indicator of chaos, for several durations.

The reference is the classification after 30000 turns. If the value of MEGNO is near the threshold,
the top is counted as doubtful. Among the other tops, the wrong classifications as chaotic and as
regular are counted. Conclusion: if the threshold is 4, and values from 2.5 to 8 are regarded
as doubtful, no regular top is classified as chaotic. Few chaotic tops are classified as regular,
and their number decreases as the integration time increases.

    python -m validation.studies.chaos_classification --families 15
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import islice

import kreisel as kr
import numpy as np
from kreisel._results.indicators import NEAR, THRESHOLD

TURNS = (30, 100, 300, 1000, 30000)  # of the median top of a family; the last one is the truth
TOL = 1e-11
SEEDS = 8, 11
BOX = kr.Body.cuboid(half=(1.0, 0.7, 0.4), pivot=(0.0, 0.0, -0.4), mass=1.0)


def draw_families() -> Iterator[kr.Ensemble]:
    """Yield ensembles of tops with the same body, 1600 tops in total."""
    for gravity in (1.0, 2.0, 3.0, 4.0):
        yield kr.starts(BOX, energy=2.0, vertical=1.0, n=200, seed=SEEDS[0], gravity=gravity)
    rng = np.random.default_rng(SEEDS[1])
    yield draw_starts(kr.scenes.asymmetric.body, 200, 2.0, rng)
    for _ in range(10):
        half, pivot = rng.uniform(0.3, 1.0, 3), rng.uniform(-1.0, 1.0, 3)
        body = kr.Body.cuboid(half=half, pivot=pivot, mass=1.0)
        yield draw_starts(body, 60, float(rng.uniform(0.3, 3.0)), rng)


def draw_starts(body: kr.Body, n: int, size: float, rng: np.random.Generator) -> kr.Ensemble:
    """Return tops with random attitudes and momenta."""
    q = rng.standard_normal((n, 4))
    momentum = size * rng.standard_normal((n, 3))
    attitude = q / np.linalg.norm(q, axis=1, keepdims=True)
    return kr.Ensemble(body, momentum=momentum, attitude=attitude, gravity=1)


def compute_curves(families: int) -> np.ndarray:
    """Return the values of MEGNO after several numbers of turns, with shape (tops, turns)."""
    curves = []
    for tops in islice(draw_families(), families):
        turn = float(np.median(1.0 / kr.megno(tops, [1.0], tol=TOL).turns))
        curves.append(kr.megno(tops, turn * np.array(TURNS), tol=TOL).curve)
    return np.concatenate(curves)


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m validation.studies.chaos_classification",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--families", type=int, default=15, help="number of families, at most 15")
    curves = compute_curves(parser.parse_args(argv).families)
    chaotic = curves[:, -1] > THRESHOLD
    print(f"{len(curves)} tops, {chaotic.sum()} of them chaotic")
    low, high = NEAR
    for turns, megno in zip(TURNS[:-1], curves.T[:-1], strict=True):
        sure_chaos, sure_order = megno >= high, megno <= low
        print(
            f"{turns} turns: {(~sure_chaos & ~sure_order).sum()} in doubt; of {sure_chaos.sum()} "
            f"tops called chaotic {(sure_chaos & ~chaotic).sum()} are regular, of "
            f"{sure_order.sum()} called regular {(sure_order & chaotic).sum()} are chaotic"
        )


if __name__ == "__main__":
    main()
