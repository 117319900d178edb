"""Recording: the core is called, and what it gave becomes a path, or a failure with the path so
far.

What is wanted in place of the states is computed piece by piece, and the states are dropped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from .._core import record_events
from .._ground.arguments import Array
from .._model.scene import Scene
from .._request.request import Progress, Request
from .._request.times import PIECE
from .path import Events, Path, good, kept, path_of, stopped, way
from .rows import rows, rows_at_once
from .states import NO_STATES

LookedFor = list[
    tuple[list[tuple[float, int, int]], list[tuple[float, int, int]], bool, int, int, bool]
]


def recorded(scene: Scene, done: Request, times: Array, progress: Progress | None) -> Path:
    """The path of a request at these times, which need no check."""
    return told(good(scene, done, rows(scene, done, times, progress)), progress)


def told(path: Path, progress: Progress | None) -> Path:
    """The path, once its progress has been told the end."""
    if progress is not None and len(path):
        progress(float(path.t[-1]))
    return path


def recorded_at_once(
    scene: Scene, done: Request, t: object, progress: Progress | None
) -> Path | None:
    """The path of a request at times as a user gave them; None where they need a second look."""
    came = rows_at_once(scene, done, t, progress)
    return came and told(good(scene, done, came), progress)


def recorded_with_events(
    scene: Scene,
    done: Request,
    times: Array,
    looked_for: LookedFor,
    progress: Progress | None,
) -> Path:
    """The path of a request at these times, with the events that it met."""
    end = float(times[-1]) if times.size else 0.0
    status, states, low, counts, met = record_events(
        scene._block, *done.core[:5], times, looked_for, progress
    )
    path = path_of(scene, done, (status, states, low, counts, end))
    at_events = path_of(scene, done, (status, met[0], met[1], counts, end))
    path = replace(path, events=Events(at_events, met[2], met[3]))
    path = kept(path, done.want, end)
    if status != "OK":
        raise stopped(status, path, way(path, end))
    return told(path, progress)


class Columns:
    """What is wanted of n states, filled in piece by piece."""

    def __init__(self, want: tuple[str, ...], n: int) -> None:
        self._want, self._n, self._done = want, n, 0
        self._arrays: dict[str, Array] = {}

    def add(self, part: Path) -> None:
        """The next states."""
        for name in ("t", *self._want):
            column = getattr(part, name)
            if name not in self._arrays:
                self._arrays[name] = np.empty((self._n, *column.shape[1:]))
            self._arrays[name][self._done : self._done + len(part)] = column
        self._done += len(part)

    def path(self, last: Path) -> Path:
        """The path, with all that is no state from its last piece."""
        columns = {name: column[: self._done] for name, column in self._arrays.items()}
        return replace(last, states=NO_STATES, _low=None, want=self._want, _columns=columns)


def in_pieces(
    times: Array, want: tuple[str, ...], record: Callable[[Array], tuple[str, Path]]
) -> tuple[str, Path]:
    """The status and the path of what is wanted, of which no more than a piece is ever states.
    Ctrl-C between two pieces ends it as one within a piece does."""
    columns = Columns(want, times.size)
    status, part = record(times[:0])
    columns.add(part)
    try:
        for piece in _pieces(times):
            status, part = record(piece)
            columns.add(part)
            if status != "OK":
                break
    except KeyboardInterrupt:
        status = "ERR_INTERRUPTED"
    return status, columns.path(part)


def _pieces(times: Array) -> Iterator[Array]:
    return (times[first : first + PIECE] for first in range(0, max(times.size, 1), PIECE))
