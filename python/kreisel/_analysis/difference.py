"""The angle between the attitudes along two paths, as a function of time."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from .._results.error_estimate import compute_angles_between_attitudes
from .._results.path import Path
from .._utils.validation import Array

if TYPE_CHECKING:
    from .._plot.charts import AngleBetweenPaths


def compute_angle_between_paths(a: Path, b: Path) -> AngleBetweenPaths:
    """Return the angle between the attitudes along two paths at common times.

    If one of the paths does not store its attitude, the angle between the apex directions of the
    two tops is returned. If the paths have different times, they are compared in the time interval
    common to both. One of the paths is recomputed at the times of the other.
    """
    from .._plot.charts import AngleBetweenPaths

    a, b = _restrict_paths_to_common_times(a, b)
    if all(path.want is None or "q" in path.want for path in (a, b)):
        return AngleBetweenPaths(
            a.t,
            compute_angles_between_attitudes(
                _get_attitudes_with_low_words(a), _get_attitudes_with_low_words(b)
            ),
            "attitudes",
        )
    sines = np.linalg.norm(np.cross(a.apex, b.apex), axis=1)
    return AngleBetweenPaths(a.t, np.arctan2(sines, (a.apex * b.apex).sum(axis=1)), "apexes")


def _restrict_paths_to_common_times(a: Path, b: Path) -> tuple[Path, Path]:
    """Return both paths at common times, or empty paths if their time intervals are disjoint."""
    if np.array_equal(a.t, b.t):
        return a, b
    low, high = max(a.t.min(), b.t.min()), min(a.t.max(), b.t.max())
    part_a, part_b = (path[(path.t >= low) & (path.t <= high)] for path in (a, b))
    alternatives: list[Callable[[], tuple[Path, Path]]] = [
        lambda: (part_a, b(part_a.t)),
        lambda: (a(part_b.t), part_b),
    ]
    for restrict in alternatives if len(part_a) >= len(part_b) else reversed(alternatives):
        with suppress(ValueError):  # a closed form of a map has no states between its steps
            return restrict()
    _, i, j = np.intersect1d(a.t, b.t, return_indices=True)
    return a[i], b[j]


def _get_attitudes_with_low_words(path: Path) -> tuple[Array, Array]:
    """Return the attitudes along a path, and their low-order parts (beyond double precision)."""
    has_low = path.want is None or "q_low" in path.want
    return path.q, path.q_low if has_low else np.zeros_like(path.q)
