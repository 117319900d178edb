"""Method and step chosen for each top of an ensemble: one after the other in each thread."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._core import Work
from .._ground.arguments import Array
from .._model.scene import Ensemble, Scene
from .._recording.path import Error, Interrupted, Path
from .._recording.recording import recorded
from .._recording.top_rows import STATUSES, TopRows
from .._request.many import Order, member
from .._request.request import request
from .._request.times import refuse_endless
from .geometric import best

_UNMET = STATUSES.index("ERR_CONVERGENCE")  # the status of a top whose error no step meets


def fill_best(
    rows: TopRows, order: Order, tops: Ensemble, begin: int, end: int, t: Array, work: Work | None
) -> TopRows:
    """The rows of the tops begin to end, each by the cheapest method that keeps the error which the
    order's request has for its tolerance."""
    part = rows.at(slice(begin, end))

    for i in range(end - begin):
        if work is not None and work.stopped:
            break
        times = t[begin + i] if t.ndim == 2 else t
        try:
            _fill_one(part, i, order, member(tops, begin + i), times, work)
        except Interrupted:  # a trial's states are none of a path
            if work is None:
                raise
            work.stop()
            break
        if work is not None:
            work.did(1)
    return part


def _fill_one(
    part: TopRows, i: int, order: Order, scene: Scene, times: Array, work: Work | None
) -> None:
    """One row: the path that was chosen, or what is to be said of a top that has none."""
    target = order.request.tol
    assert target is not None
    path, status = None, 0
    try:
        path = _chosen(scene, times, target, order.request.max_steps, work)
    except Error as error:
        path, status, part.said[i] = error.path, STATUSES.index(error.status), str(error)
    except ValueError as error:
        status, part.said[i] = _UNMET, str(error)
    part.status[i] = status
    _put(part, i, path, times, bool(status))


def _chosen(scene: Scene, times: Array, target: float, most: int, work: Work | None) -> Path:
    if not times.any():
        return recorded(scene, request(scene, "strang", step=1.0), times, None)  # nothing moves
    refuse_endless(scene, float(times[-1]), None)
    return best(scene, times, target, most, work)


def _put(part: TopRows, i: int, path: Path | None, times: Array, failed: bool) -> None:
    """A path as a row, with NaN behind what it reached."""
    at, reached = np.empty(0, dtype=np.intp), 0
    if path is not None:
        at, reached = _of_times(path, times)
        part.counts[i] = path.stats
        part.reached[i] = path.t[-1] if len(path) else 0.0
        if failed and len(path):
            part.last[i] = np.array([path.states[-1], np.zeros(8)])
        if path._choice is not None:
            part.chosen[i] = path._choice
    part.done[i] = reached
    if part.states is not None:
        part.states[i] = np.nan
        part.states[i, :, 0] = times
        if path is not None:
            part.states[i, :reached] = path.states[at]
    for name, column in part.columns.items():
        column[i] = np.nan
        if path is not None:
            column[i, :reached] = getattr(path, name)[at]


def _of_times(path: Path, times: Array) -> tuple[npt.NDArray[np.intp], int]:
    """Which states of a path are those at the first of these times, and how many: one that failed
    may be of a trial, which has others between them."""
    if not len(path):
        return np.empty(0, dtype=np.intp), 0
    at = np.minimum(np.searchsorted(np.abs(path.t), np.abs(times)), len(path) - 1)
    missing = np.flatnonzero(path.t[at] != times)
    reached = int(missing[0]) if missing.size else times.size
    return at[:reached], reached
