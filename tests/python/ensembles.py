"""Ensembles of tops, and functions that compare results, shared by several test files."""

import kreisel as kr
import numpy as np
from tops import FREE, GENERAL, LAGRANGE

DAMPED = kr.scenes.asymmetric.replace(damping=(0.01, 0.02, 0.03))
SCENES = [kr.scenes.asymmetric, LAGRANGE, GENERAL, FREE, kr.scenes.cusps, DAMPED]
MIXED = kr.Scene.stack(SCENES)
UNDAMPED = MIXED[:5]
TIMES = [0.0, 0.5, 2.0, 5.0]
FIELDS = ("states", "status", "state_counts", "reached", "stats")


def random_ensemble(n, seed=1):
    """Return `n` tops with random momenta. Every third top is a Lagrange top."""
    momenta = np.random.default_rng(seed).normal(size=(n, 3))
    bodies = [kr.scenes.cusps.body if i % 3 == 0 else kr.scenes.asymmetric.body for i in range(n)]
    return kr.Scene.stack(
        [kr.Scene(body, m, gravity=1) for body, m in zip(bodies, momenta, strict=True)]
    )


def same_bits(one, other):
    """Return True if two arrays are equal in every bit, so that 0.0 differs from -0.0.

    The sign and the payload of NaN are ignored.
    """
    arrays = [np.asarray(one), np.asarray(other)]
    bits = [
        (array if array.dtype.kind == "U" else np.where(np.isnan(array), np.nan, array)).tobytes()
        for array in arrays
    ]
    return len({(array.dtype, array.shape) for array in arrays}) == 1 and bits[0] == bits[1]


def same(one, other):
    """Return True if all fields of two results are bitwise equal."""
    return all(same_bits(getattr(one, f), getattr(other, f)) for f in FIELDS)
