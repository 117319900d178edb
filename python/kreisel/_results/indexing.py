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


def normalize_path_index(n: int, key: StateIndex) -> ResolvedIndex:
    """Convert an index to a slice or an array of integers.

    An integer is converted to a slice of length 1. Raises TypeError or IndexError for an invalid
    index.
    """
    if isinstance(key, slice):
        return key
    numbers = np.asarray(key)
    kinds = "iub" if numbers.ndim else "iu"
    if numbers.ndim > 1 or (numbers.size and numbers.dtype.kind not in kinds):
        raise TypeError(
            "the states of a path are indexed by a whole number, a slice or a list of numbers, not "
            f"{short_repr(key)}; its quantities are attributes"
        )
    if numbers.ndim == 0:
        i = int(numbers)
        if not -n <= i < n:
            raise IndexError(f"a path of {n} states has no state of index {i}")
        return slice(i % n, i % n + 1)
    indices: npt.NDArray[np.intp] = np.arange(n)[numbers if numbers.size else []]
    return indices


def validate_times_within_path(path_times: Array, t: Numbers, begin: float) -> Array:
    """Return the times `t` as a one-dimensional array.

    Raises ValueError for times outside the time range of the path.

    `path_times` contains the times of the path, and `begin` is its initial time.
    """
    times = validate_time_list(t)
    low, high = float(path_times.min(initial=begin)), float(path_times.max(initial=begin))
    indices = np.flatnonzero((times < low) | (times > high))
    if indices.size:
        i = int(indices[0])
        label = f"t[{i}]" if times.ndim else "t"
        raise ValueError(
            f"{label} = {float(times.reshape(-1)[i])!r} lies outside the path, whose times go "
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
    element = np.arange(math.prod(shape)).reshape(shape)[key]
    return None if isinstance(element, np.ndarray) else int(element)
