"""Validation of indices and times."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, SupportsIndex

import numpy as np
import numpy.typing as npt

from .._options.times import validate_time_list
from .._utils.validation import Array, Numbers, short_repr

StateIndex = SupportsIndex | slice | Sequence[int] | npt.NDArray[np.integer | np.bool_]
ResolvedIndex = slice | npt.NDArray[np.intp]


def normalize_path_index(n: int, which: StateIndex) -> ResolvedIndex:
    """Convert an index to a slice or an array of integers.

    An integer is converted to a slice of length 1. Raises TypeError or IndexError for an invalid
    index.
    """
    if isinstance(which, slice):
        return which
    given = np.asarray(which)
    kinds = "iub" if given.ndim else "iu"
    if given.ndim > 1 or (given.size and given.dtype.kind not in kinds):
        raise TypeError(
            "the states of a path are indexed by a whole number, a slice or a list of numbers, not "
            f"{short_repr(which)}; its quantities are attributes"
        )
    if given.ndim == 0:
        i = int(given)
        if not -n <= i < n:
            raise IndexError(f"a path of {n} states has no state of index {i}")
        return slice(i % n, i % n + 1)
    at: npt.NDArray[np.intp] = np.arange(n)[given if given.size else []]
    return at


def validate_times_within_path(reached: Array, t: Numbers, begin: float) -> Array:
    """Return the times `t` as a one-dimensional array.

    Raises ValueError for times outside the path.

    `reached` contains the times of the path, and `begin` is its initial time.
    """
    times = validate_time_list(t)
    low, high = float(reached.min(initial=begin)), float(reached.max(initial=begin))
    outside = np.flatnonzero((times < low) | (times > high))
    if outside.size:
        i = int(outside[0])
        here = f"t[{i}]" if times.ndim else "t"
        raise ValueError(
            f"{here} = {float(times.reshape(-1)[i])!r} lies outside the path, whose times go "
            f"from {low!r} to {high!r}: solve for a longer time"
        )
    return times.reshape(-1)


def list_flat_indices(shape: tuple[int, ...], key: Any) -> npt.NDArray[np.intp]:
    """Return the flat indices, in C order, of the elements that `key` selects from `shape`."""
    every: npt.NDArray[np.intp] = np.arange(math.prod(shape)).reshape(shape)
    return np.asarray(every[key])


def find_flat_index(shape: tuple[int, ...], key: Any) -> int | None:
    """Return the flat index of the member that `key` selects, or None if it selects several.

    `shape` is the shape of the ensemble.
    """
    if type(key) is int and len(shape) == 1 and -shape[0] <= key < shape[0]:
        return key % shape[0]
    found = np.arange(math.prod(shape)).reshape(shape)[key]
    return None if isinstance(found, np.ndarray) else int(found)
