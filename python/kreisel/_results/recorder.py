"""Recording of the path of a single scene from results of the core.

If only some quantities are requested, they are computed chunk by chunk, and the states are
discarded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .._model.scene import Scene
from .._options.solve_options import Progress, SolveOptions
from .._options.times import CHUNK_SIZE
from .._utils.quantity_attributes import QuantityName
from .._utils.validation import Array
from .core_calls import record_states
from .path import Events, Path, build_path_or_raise
from .state_quantities import NO_STATES

CoreEvents = tuple[Array, Array, npt.NDArray[np.intc], npt.NDArray[np.intc]]


def record_path(
    scene: Scene, options: SolveOptions, times: Array, progress: Progress | None
) -> Path:
    """Return the path of a scene at times that have already been validated."""
    result = record_states(scene, options, times, progress)
    return report_end(build_path_or_raise(scene, options, result), progress)


def report_end(path: Path, progress: Progress | None) -> Path:
    """Call the callback `progress` with the last time of `path`, and return `path`."""
    if progress is not None and len(path):
        progress(float(path.t[-1]))
    return path


def add_events(path: Path, met: CoreEvents) -> Path:
    """Return a copy of `path` that contains the recorded events `met`.

    `met` consists of the states at the events, their low-order words, and the indices and
    directions of the events.
    """
    states, low, which, direction = met
    at_events = replace(path, states=states, _low=low)
    return replace(path, _events=Events(at_events, which, direction))


def _join_events(met: list[Events]) -> Events:
    """Concatenate the events of consecutive paths, and return the result."""
    states = np.concatenate([one.states for one in met])
    low = np.concatenate([low for one in met if (low := one.path._low) is not None])
    path = replace(met[-1].path, states=states, _low=low)
    which, direction = ([getattr(one, name) for one in met] for name in ("which", "direction"))
    return Events(path, np.concatenate(which), np.concatenate(direction))


class ColumnRecorder:
    """A recorder for the quantities and events of n states, which is filled chunk by chunk."""

    def __init__(self, want: tuple[QuantityName, ...], n: int) -> None:
        self._want, self._n, self._done = want, n, 0
        self._arrays: dict[str, Array] = {}
        self._events: list[Events] = []

    def append_states(self, part: Path) -> None:
        """Append the quantities and events of `part`, a path that contains the next states."""
        for name in ("t", *self._want):
            column = getattr(part, name)
            if name not in self._arrays:
                self._arrays[name] = np.empty((self._n, *column.shape[1:]))
            self._arrays[name][self._done : self._done + len(part)] = column
        self._done += len(part)
        if part._events is not None:
            self._events.append(part._events)

    def build_path(self, last: Path) -> Path:
        """Return a path with the recorded columns and events; the other data are from `last`."""
        columns = {name: column[: self._done] for name, column in self._arrays.items()}
        events = _join_events(self._events) if self._events else None
        options = replace(last._options, want=self._want)
        return replace(
            last, states=NO_STATES, _options=options, _low=None, _events=events, _columns=columns
        )


def record_chunks(
    times: Array,
    want: tuple[QuantityName, ...],
    record: Callable[[Array], tuple[str, Path]],
    has_ended: Callable[[], bool],
) -> tuple[str, Path]:
    """Record the quantities in `want` chunk by chunk, and return the status and path of the run.

    The first state is recorded as a separate chunk, so that a path exists if Ctrl-C interrupts the
    run between two chunks.
    """
    columns = ColumnRecorder(want, times.size)
    status, part = record(times[:1])
    columns.append_states(part)
    try:
        for first in range(1, times.size, CHUNK_SIZE):
            if status != "OK" or has_ended():
                break
            status, part = record(times[first : first + CHUNK_SIZE])
            columns.append_states(part)
    except KeyboardInterrupt:
        status = "ERR_INTERRUPTED"
    return status, columns.build_path(part)
