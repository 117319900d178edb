"""Wrong verdicts on chaos among random tops, by the length of the motion.

The truth is the verdict after 30000 turns. Each row has the number of doubtful tops, of regular
tops that are called chaotic without doubt, and of chaotic tops that are called regular without
doubt. Conclusion: with a threshold of 4 for MEGNO and doubt between 2.5 and 8, no regular top is
called chaotic. Few chaotic tops are called regular, and ever fewer in longer motions.

    python -m validation.studies.chaos_verdicts --seed 11
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import kreisel as kr
import numpy as np

TURNS, TRUTH = (100, 300, 1000), 30000  # turns of the slowest top
TOL = 1e-11
BOX = kr.Body.cuboid(half=(1.0, 0.7, 0.4), pivot=(0.0, 0.0, -0.4), mass=1.0)


def draw_tops(seed: int) -> Iterator[kr.Ensemble]:
    """Yield ensembles of one body each, 1600 tops in all."""
    rng = np.random.default_rng(seed)
    for gravity in (1.0, 2.0, 3.0, 4.0):
        yield kr.starts(BOX, energy=2.0, vertical=1.0, n=200, seed=seed, gravity=gravity)
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
    return kr.Ensemble(body, momentum=momentum, attitude=attitude)


def count_verdicts(seed: int) -> dict[int, np.ndarray]:
    """Return for each number of turns the counts (tops, chaotic, doubtful, wrong, wrong)."""
    counts = {turns: np.zeros(5, dtype=int) for turns in TURNS}
    for tops in draw_tops(seed):
        turn = 1.0 / np.min(kr.megno(tops, [1.0], tol=TOL).turns)
        truth = kr.megno(tops, [TRUTH * turn], tol=TOL).is_chaotic
        for turns in TURNS:
            found = kr.megno(tops, [1.0001 * turns * turn], tol=TOL)
            sure = ~found.is_doubtful
            wrong = (
                found.is_chaotic & sure & ~truth,
                ~found.is_chaotic & sure & truth,
            )
            counts[turns] += [tops.size, truth.sum(), (~sure).sum(), *(w.sum() for w in wrong)]
    return counts


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m validation.studies.chaos_verdicts",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seed", type=int, default=11)
    for turns, row in count_verdicts(parser.parse_args(argv).seed).items():
        tops, chaotic, doubtful, called_chaotic, called_regular = row
        print(
            f"{turns} turns: {tops} tops, {chaotic} chaotic, {doubtful} in doubt; "
            f"{called_chaotic} regular tops called chaotic, "
            f"{called_regular} chaotic tops called regular"
        )


if __name__ == "__main__":
    main()
