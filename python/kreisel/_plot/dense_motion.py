"""The motion between the states of a path, evaluated densely enough to be joined by lines."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._core import body_symmetry
from .._model.scene import Scene
from .._utils.arguments import Array

_FEWEST_PER_TURN = 16  # states per turn from which lines between them show the motion
POINTS_PER_TURN = 48
MOST_POINTS = 30_000  # a line of more points would show a filled band
_AGREE = 1e-6  # distance of two apex directions that is not visible


class DrawnMotion(NamedTuple):
    """The states that a line joins, and whether the states of the path are to be marked.

    line   the path itself, or the same motion at more times; None if no line shows the motion
    """

    line: Any
    has_marks: bool


def compute_duration_of_turn(scene: Scene, *, is_seen_from_body: bool = False) -> float:
    """Estimate the time of a turn about the fastest axis [T], or inf if nothing moves.

    The apex of a symmetric top does not feel its spin, which quantities seen from the body do.
    """
    moments = np.array(scene.body.moments)
    symmetry = body_symmetry(scene.body._block)
    moment = symmetry[0] if symmetry and not is_seen_from_body else moments.min()
    rate = scene._rotation_rate * float(moments.max() / moment)
    return 2.0 * np.pi / rate if rate > 0.0 else np.inf


def subdivide_times(t: Array, turn: float) -> Array | None:
    """Return the distinct times `t` in increasing order, with enough times between them.

    Times whose distances are short enough are returned as they are. Returns None if more than
    MOST_POINTS times would be needed.
    """
    times = np.unique(t)
    gaps = np.diff(times)
    if (gaps * _FEWEST_PER_TURN <= turn).all():
        return times
    needed = np.maximum(np.ceil(gaps * POINTS_PER_TURN / turn), 1.0)
    if needed.sum() >= MOST_POINTS:
        return None
    counts = needed.astype(int)
    ends = np.cumsum(counts)
    place = np.arange(ends[-1]) - np.repeat(ends - counts, counts)
    inner = np.repeat(times[:-1], counts) + place * np.repeat(gaps / counts, counts)
    return np.append(inner, times[-1])


def evaluate_densely(path: Any) -> DrawnMotion:
    """Return the motion of a path for a line, from the first state to the last.

    The motion is evaluated between the states if they are too far apart. No line is drawn if the
    path cannot be evaluated, if its states are not those of a single motion of its scene, or if the
    motion has too many turns for a picture.
    """
    times = subdivide_times(path.t, compute_duration_of_turn(path.scene))
    if times is None:
        return DrawnMotion(None, True)
    if path.t[-1] < path.t[0]:
        times = times[::-1]
    if np.array_equal(times, path.t):
        return DrawnMotion(path, len(path) == 1)
    try:
        motion = path(times)
    except (ValueError, RuntimeError):  # a map has no states between its steps
        return DrawnMotion(None, True)
    order = np.argsort(times)
    states = order[np.searchsorted(times, path.t, sorter=order)]
    if not (np.abs(motion.apex[states] - path.apex) < _AGREE).all():
        return DrawnMotion(None, True)
    return DrawnMotion(motion, True)


def insert_gaps(t: Array, values: Array, is_jump: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
    """Insert a NaN into each interval where `is_jump`, so that drawn curves are interrupted."""
    gaps = np.flatnonzero(is_jump) + 1
    return np.insert(t, gaps, np.nan), np.insert(values, gaps, np.nan, axis=0)
