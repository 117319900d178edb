"""Recording of the path of a single scene.

If only some quantities are requested, they are computed from one chunk of states at a time, and the
states are then discarded.
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
from .core_calls import compute_states_at_times
from .path import Events, Path, build_path_or_raise
from .state_quantities import NO_STATES

CoreEvents = tuple[Array, Array, npt.NDArray[np.intc], npt.NDArray[np.intc]]


def record_path(
    scene: Scene, options: SolveOptions, times: Array, progress: Progress | None
) -> Path:
    """Return the path of a scene at times that have already been validated."""
    result = compute_states_at_times(scene, options, times, progress)
    return report_final_time(build_path_or_raise(scene, options, result), progress)


def report_final_time(path: Path, progress: Progress | None) -> Path:
    """Report the final time of a path to the callback `progress`, and return the path."""
    if progress is not None and len(path):
        progress(float(path.t[-1]))
    return path


def add_events_to_path(path: Path, core_events: CoreEvents) -> Path:
    """Return a copy of a path to which the recorded events are added.

    For each event, `core_events` contains the state, its low-order part, and the index and
    direction of the event.
    """
    states, low, which, direction = core_events
    event_path = replace(path, states=states, _low=low)
    return replace(path, _events=Events(event_path, which, direction))


def _join_path_events(event_parts: list[Events]) -> Events:
    """Concatenate the events of consecutive paths, and return the result."""
    states = np.concatenate([one.states for one in event_parts])
    low = np.concatenate([low for one in event_parts if (low := one.path._low) is not None])
    path = replace(event_parts[-1].path, states=states, _low=low)
    which, direction = (
        [getattr(one, name) for one in event_parts] for name in ("which", "direction")
    )
    return Events(path, np.concatenate(which), np.concatenate(direction))


class ColumnRecorder:
    """A buffer for quantities and events that are recorded in chunks."""

    def __init__(self, want: tuple[QuantityName, ...], n: int) -> None:
        self._want, self._n, self._done = want, n, 0
        self._arrays: dict[str, Array] = {}
        self._events: list[Events] = []

    def append_path_part(self, part: Path) -> None:
        """Append the recorded quantities and events of the path `part`."""
        for name in ("t", *self._want):
            column = getattr(part, name)
            if name not in self._arrays:
                self._arrays[name] = np.empty((self._n, *column.shape[1:]))
            self._arrays[name][self._done : self._done + len(part)] = column
        self._done += len(part)
        if part._events is not None:
            self._events.append(part._events)

    def build_recorded_path(self, last: Path) -> Path:
        """Build a path from the recorded quantities and events."""
        columns = {name: column[: self._done] for name, column in self._arrays.items()}
        events = _join_path_events(self._events) if self._events else None
        options = replace(last._options, want=self._want)
        return replace(
            last, states=NO_STATES, _options=options, _low=None, _events=events, _columns=columns
        )


def record_quantities_in_chunks(
    times: Array,
    want: tuple[QuantityName, ...],
    record: Callable[[Array], tuple[str, Path]],
    has_ended: Callable[[], bool],
) -> tuple[str, Path]:
    """Record selected quantities in chunks, and return the status and the path of the run.

    The first chunk is a single state, so that Ctrl-C leaves a path that is not empty.
    """
    columns = ColumnRecorder(want, times.size)
    status, part = record(times[:1])
    columns.append_path_part(part)
    try:
        for first in range(1, times.size, CHUNK_SIZE):
            if status != "OK" or has_ended():
                break
            status, part = record(times[first : first + CHUNK_SIZE])
            columns.append_path_part(part)
    except KeyboardInterrupt:
        status = "ERR_INTERRUPTED"
    return status, columns.build_recorded_path(part)
