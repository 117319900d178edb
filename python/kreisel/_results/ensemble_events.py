"""Events that occurred while the motions of an ensemble were computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._utils.validation import Array, ReadOnlyArrays
from .ensemble_buffers import Counts, EventColumns


@dataclass(frozen=True, eq=False)
class EnsembleEvents(ReadOnlyArrays):
    """e events of an ensemble, sorted by top, and for each top in the order of occurrence.

    Arrays are read-only.

    top        (e,) the index of the top; (e, dimensions) unless the ensemble has one dimension
    states     (e, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]
    which      (e,) for each occurrence, the index of its event in the list passed to solve
    direction  (e,) 1: the event function increased with time, or had a minimum; -1: it decreased,
               or had a maximum
    count      (*shape) the number of events of each top
    """

    top: Counts
    states: Array
    which: npt.NDArray[np.intc]
    direction: npt.NDArray[np.intc]
    count: Counts

    def __len__(self) -> int:
        return len(self.which)

    @property
    def t(self) -> Array:
        """(e,) times [T]."""
        return self.states[:, 0]

    @property
    def q(self) -> Array:
        """(e, 4) attitudes as unit quaternions (w, x, y, z)."""
        return self.states[:, 1:5]

    @property
    def m(self) -> Array:
        """(e, 3) angular momentum about the fixed point [M L^2 T^-1]."""
        return self.states[:, 5:]


def concatenate_slice_events(parts: list[EventColumns]) -> EventColumns:
    """Return the events of several slices as one table, sorted by the index of the top."""
    if not parts:
        empty = np.empty(0, dtype=np.intc)
        return EventColumns(
            np.empty(0, dtype=np.int64), np.empty((0, 8)), np.empty((0, 8)), empty, empty
        )
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    order = np.argsort(columns[0], kind="stable")
    return EventColumns(*(column[order] for column in columns))


def convert_columns_to_ensemble_events(
    events: EventColumns, shape: tuple[int, ...]
) -> EnsembleEvents:
    """Build an EnsembleEvents object from the recorded events of an ensemble of the given shape."""
    n = int(np.prod(shape, dtype=np.int64))
    count = np.bincount(events.top, minlength=n).astype(np.int64).reshape(shape)
    top = events.top
    if len(shape) != 1:
        top = np.array(np.unravel_index(events.top, shape)).T.reshape(len(events.top), len(shape))
    for array in (top, events.states, events.which, events.direction, count):
        array.flags.writeable = False
    return EnsembleEvents(top, events.states, events.which, events.direction, count)
