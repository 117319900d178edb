"""Recording: the core is called, and what it gave becomes a path, or a failure with the path so
far.

What is wanted in place of the states is computed piece by piece, and the states are dropped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .._ground.arguments import Array
from .._ground.names import QuantityName
from .._model.scene import Scene
from .._request.request import Progress, Request
from .._request.times import PIECE
from .path import Events, Path, good
from .rows import rows, rows_at_once
from .states import NO_STATES

Met = tuple[Array, Array, npt.NDArray[np.intc], npt.NDArray[np.intc]]


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


def with_events(path: Path, met: Met) -> Path:
    """The path with the events that it met: their states, what doubles leave out of these, which
    events they are, and their directions."""
    states, low, which, direction = met
    return replace(path, events=Events(replace(path, states=states, _low=low), which, direction))


def _joined(met: list[Events]) -> Events:
    """The events of pieces of a path, as one."""
    states = np.concatenate([one.states for one in met])
    low = np.concatenate([low for one in met if (low := one.path._low) is not None])
    path = replace(met[-1].path, states=states, _low=low)
    which, direction = ([getattr(one, name) for one in met] for name in ("which", "direction"))
    return Events(path, np.concatenate(which), np.concatenate(direction))


class Columns:
    """What is wanted of n states, filled in piece by piece, and the events that were met."""

    def __init__(self, want: tuple[QuantityName, ...], n: int) -> None:
        self._want, self._n, self._done = want, n, 0
        self._arrays: dict[str, Array] = {}
        self._met: list[Events] = []

    def add(self, part: Path) -> None:
        """The next states."""
        for name in ("t", *self._want):
            column = getattr(part, name)
            if name not in self._arrays:
                self._arrays[name] = np.empty((self._n, *column.shape[1:]))
            self._arrays[name][self._done : self._done + len(part)] = column
        self._done += len(part)
        if part.events is not None:
            self._met.append(part.events)

    def path(self, last: Path) -> Path:
        """The path, with all that is no state from its last piece."""
        columns = {name: column[: self._done] for name, column in self._arrays.items()}
        met = _joined(self._met) if self._met else None
        return replace(
            last, states=NO_STATES, _low=None, want=self._want, events=met, _columns=columns
        )


def in_pieces(
    times: Array,
    want: tuple[QuantityName, ...],
    record: Callable[[Array], tuple[str, Path]],
    ended: Callable[[], bool],
) -> tuple[str, Path]:
    """The status and the path of what is wanted, of which no more than a piece is ever states,
    until all is recorded or has ended. The first state is a piece of its own: from then on, Ctrl-C
    between two pieces ends it as one within a piece does."""
    columns = Columns(want, times.size)
    status, part = record(times[:1])
    columns.add(part)
    try:
        for piece in _pieces(times[1:]):
            if status != "OK" or ended():
                break
            status, part = record(piece)
            columns.add(part)
    except KeyboardInterrupt:
        status = "ERR_INTERRUPTED"
    return status, columns.path(part)


def _pieces(times: Array) -> Iterator[Array]:
    return (times[first : first + PIECE] for first in range(0, times.size, PIECE))
