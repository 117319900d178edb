"""The attitudes of a path as SciPy rotations."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from .._utils.arguments import Array, optional_dependency

with optional_dependency("scipy"):
    from scipy.spatial.transform import Rotation


class Attitudes(Rotation):
    """SciPy rotations that also accept read-only arrays, such as the arrays of a kreisel.Path.

    The class Rotation of SciPy 1.17 raises an exception for read-only arrays. Inverses, products
    and subsets of Attitudes are Attitudes as well.
    """

    def apply(self, vectors: ArrayLike, inverse: bool = False) -> Array:
        result: Array = super().apply(np.array(vectors, dtype=np.float64), inverse)
        return result

    def inv(self) -> Attitudes:
        return Attitudes(super().inv().as_quat(), normalize=False)

    def __getitem__(self, which: object) -> Attitudes:
        return Attitudes(super().__getitem__(which).as_quat(), normalize=False)

    def __iter__(self) -> Iterator[Attitudes]:
        return (self[i] for i in range(len(self)))

    def __mul__(self, other: Rotation) -> Attitudes:
        return Attitudes(super().__mul__(other).as_quat(), normalize=False)
