"""Reading of the motions that other programs computed."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._fit.records import read_csv_table
from .._utils.arguments import (
    RADIANS_PER_DEGREE,
    Array,
    as_array,
    short_repr,
    split_column_head,
)

Results = str | os.PathLike[str] | Mapping[str, ArrayLike]

_PARTS = "t", "qw", "qx", "qy", "qz", "wx", "wy", "wz"
_TIMES = "t", "time", "times", "seconds", "timestamp"
_QUATERNION = re.compile(r"(?:q|quat|quaternion|rot|rotation|att|attitude|orientation)([wxyzs0-3])")
_VELOCITY = re.compile(r"(?:w|omega|angvel|angular(?:velocity|rate)|(?:body)?velocity)([xyz])")
_LETTERS = {"s": "w", "0": "w", "1": "x", "2": "y", "3": "z"}
_LEAST_NORM, _LARGEST_NORM = 0.5, 2.0  # of quaternions
_NORM_ERROR = 1e-3  # of quaternions that a program normalizes


class ComputedMotion(NamedTuple):
    """The states of a file up to the last one before a state that is not finite.

    t         (n,) times
    q         (n, 4) unit quaternions
    w         (n, 3) angular velocities, NaN if there are none
    problems  mistakes that the numbers alone tell
    is_whole  True if all states of the file are finite
    """

    name: str
    t: Array
    q: Array
    w: Array
    problems: list[str]
    is_whole: bool


def read_motion(results: object) -> ComputedMotion:
    """Read times, attitudes and angular velocities from a file or a mapping."""
    if isinstance(results, Mapping):
        name, columns = "results", _split_arrays(results)
    elif isinstance(results, str | os.PathLike):
        name, columns = os.fspath(results), read_csv_table(results, None, None)
    else:
        raise TypeError(f"results must be a file, a mapping or a list, not {short_repr(results)}")
    found: dict[str, Array] = {}
    for part, column in _name_columns(columns):
        if part in found:
            raise ValueError(f"{name}: several columns are {part}")
        found[part] = column
    for part in _PARTS[:5]:
        if part not in found:
            raise ValueError(f"{name}: there is no column {part}; there are {', '.join(columns)}")
    if {column.shape for column in found.values()} != {(found["t"].size,)}:
        raise ValueError(f"{name}: the columns must be lists of equal length")
    table = np.stack([found.get(part, np.nan * found["t"]) for part in _PARTS], axis=-1)
    is_finite = np.isfinite(table[:, :5]).all(axis=1)
    n = len(table) if is_finite.all() else int(np.argmin(is_finite))
    if not n:
        raise ValueError(f"{name}: there is no finite first state")
    t, q, w = np.split(table[:n], [1, 5], axis=1)
    t = t[:, 0]
    if t[0] < 0.0 or (np.diff(t) <= 0.0).any():
        raise ValueError(f"{name}: the times must ascend, from 0 or later")
    norms = np.sqrt((q * q).sum(axis=1))
    is_far = ~((norms > _LEAST_NORM) & (norms < _LARGEST_NORM))
    if is_far.any():
        i = int(np.argmax(is_far))
        raise ValueError(f"{name}: the quaternion at t = {t[i]:g} has the norm {norms[i]:.3g}")
    problems = [] if n == len(table) else [f"not finite after t = {t[-1]:g}"]
    if abs(norms - 1.0).max() > _NORM_ERROR:
        problems.append("quaternions not normalized")
    return ComputedMotion(name, t, q / norms[:, None], w, problems, n == len(table))


def _split_arrays(results: Mapping[str, ArrayLike]) -> dict[str, Array]:
    """Return the columns of a mapping, in which arrays (n, 3) and (n, 4) are several columns."""
    columns: dict[str, Array] = {}
    for head, values in results.items():
        array, name = as_array(f"results[{head!r}]", values, "numbers"), str(head)
        letters = {3: "xyz", 4: "xyzw" if name.endswith("xyzw") else "wxyz"}
        if array.ndim == 2 and array.shape[1] in letters:
            stem = name.removesuffix("xyzw")
            columns |= dict(zip([stem + x for x in letters[array.shape[1]]], array.T, strict=True))
        else:
            columns[name] = array
    return columns


def _name_columns(columns: Mapping[str, Array]) -> Iterator[tuple[str, Array]]:
    """Yield the columns that are known, by their names in files of the suite."""
    has_letters = {"w", "x", "y", "z"} <= {head.strip().lower() for head in columns}
    for head, column in columns.items():
        name, unit = split_column_head(head)
        compact = re.sub(r"[^a-z0-9]", "", name.lower())
        if compact in _TIMES:
            yield "t", column
        elif found := _QUATERNION.fullmatch("q" + compact if has_letters else compact):
            yield "q" + _LETTERS.get(found[1], found[1]), column
        elif found := _VELOCITY.fullmatch(compact):
            yield "w" + found[1], column * (RADIANS_PER_DEGREE if unit.startswith("deg") else 1.0)
