"""Memory for the results of ensembles, and slices of work that fill it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from .._core import Work, Worker, alone, derivatives_of_tops, statuses, values_of_tops
from .._model.scene import Ensemble
from .._options.options import QUANTITIES, RECORDABLE, Options, get_quantity_derivative_shape
from .._options.plan import StepChoice
from .._utils.arguments import Array

Codes = npt.NDArray[np.int8]
Counts = npt.NDArray[np.int64]
Which = slice | npt.NDArray[np.integer | np.bool_]

STATUSES = list(statuses)  # names of the statuses; the code of a status is its index
_NOT_YET = -1  # the status of a top that has not run
INTERRUPTED = STATUSES.index("ERR_INTERRUPTED")


class EventColumns(NamedTuple):
    """Events of several tops, stored as columns of equal length.

    For each event, `top` contains the row of the top in the ensemble's arrays. The columns `states`
    and `low` contain the state at each event and the low-order part of this state. `which` contains
    the index of the event function, and `direction` the direction of its sign change.
    """

    top: Counts
    states: Array
    low: Array
    which: npt.NDArray[np.intc]
    direction: npt.NDArray[np.intc]

    def select_and_renumber_events(
        self, indices: npt.NDArray[np.intp], numbers: Counts
    ) -> EventColumns:
        states, low = self.states[indices], self.low[indices]
        return EventColumns(numbers, states, low, self.which[indices], self.direction[indices])


@dataclass
class EnsembleBuffers:
    """Buffers for the results of n tops at k times; unused buffers are None or empty.

    status, done   (n,) the code of the status, and the number of times with valid states
    counts         (n, 4) numbers of steps, rejected steps, evaluations and iterations
    reached        (n,) the time of the last valid state [T]
    states         (n, k, 8) states as in a path; q and m are NaN after the last valid state
    low            (n, k, 8) the low words of the states
    tangents       (n, k, 6, c) the tangents of the states
    tangents_low   (n, k, 6, c) their low words
    truncation     (n,) the truncation error of the tangents of each top
    columns        quantities stored instead of states, (n, k, ...) each
    reduced        (n, r) the reductions of each top's path, in the order of the options
    last           {row of a failed top: array (1, 8) with the last valid state}; if low words are
                   computed, the array is (2, 8) and its second row contains the low words
    chosen         {row: the method and step that method='geometric' chose}
    events         events of all tops, not sorted by top
    messages       {row: the message of a failure that no status describes}
    """

    status: Codes
    done: Counts
    counts: Counts
    reached: Array
    states: Array | None = None
    low: Array | None = None
    tangents: Array | None = None
    tangents_low: Array | None = None
    truncation: Array | None = None
    columns: dict[str, Array] = field(default_factory=dict)
    reduced: Array | None = None
    last: dict[int, Array] = field(default_factory=dict)
    messages: dict[int, str] = field(default_factory=dict)
    events: list[EventColumns] = field(default_factory=list)
    chosen: dict[int, StepChoice] = field(default_factory=dict)

    @classmethod
    def allocate_buffers(cls, n: int, k: int, options: Options, out: Array | None = None) -> Self:
        """Allocate buffers for n tops at k times; `out` is an optional array for the states."""
        buffers = cls(
            np.full(n, _NOT_YET, dtype=np.int8),
            np.zeros(n, dtype=np.int64),
            np.zeros((n, 4), dtype=np.int64),
            np.zeros(n),
        )
        if options.reductions:
            buffers.reduced = np.empty((n, len(options.reductions)))
        elif options.want is not None:
            for name in options.want:
                buffers.columns[name] = np.empty((n, k, *RECORDABLE[name].shape))
        else:
            buffers.states = np.empty((n, k, 8)) if out is None else out
            buffers.low = np.empty((n, k, 8)) if options.has_extended_precision else None
        if options.tangents:
            shape = n, k, 6, options.tangent_column_count
            buffers.tangents, buffers.truncation = np.empty(shape), np.full(n, np.nan)
            buffers.tangents_low = np.empty(shape) if options.has_extended_precision else None
        return buffers

    @property
    def size(self) -> int:
        """The number of tops."""
        return len(self.status)

    def get_allocated_arrays_by_name(self) -> dict[str, npt.NDArray[np.generic]]:
        names = ["status", "done", "counts", "reached", "states", "low", "reduced"]
        names += ["tangents", "tangents_low", "truncation"]
        arrays = {name: getattr(self, name) for name in names}
        return {name: array for name, array in arrays.items() if array is not None}

    def select_buffer_rows(self, selection: Which) -> EnsembleBuffers:
        """Return buffers of the selected rows; for a slice, their arrays are views."""
        arrays = {
            name: array[selection] for name, array in self.get_allocated_arrays_by_name().items()
        }
        columns = {name: array[selection] for name, array in self.columns.items()}
        part = EnsembleBuffers(**arrays, columns=columns)  # type: ignore[arg-type]
        if self.last or self.messages or self.chosen:
            numbers = list(enumerate(np.arange(self.size)[selection].tolist()))
            part.last = {j: self.last[i] for j, i in numbers if i in self.last}
            part.messages = {j: self.messages[i] for j, i in numbers if i in self.messages}
            part.chosen = {j: self.chosen[i] for j, i in numbers if i in self.chosen}
        part.events = self._select_events_of_rows(selection) if self.events else []
        return part

    def select_states(self, which: Which) -> EnsembleBuffers:
        """Return buffers of the selected times, without events.

        A top is done with all times up to the last selected one that it reached.
        """

        def select(array: Array | None) -> Any:
            return None if array is None else np.ascontiguousarray(array[:, which])

        k = next(a.shape[1] for a in (self.states, *self.columns.values()) if a is not None)
        is_reached = np.arange(k)[which] < self.done[:, None]
        done: Counts = (is_reached * np.arange(1, is_reached.shape[1] + 1)).max(axis=1, initial=0)
        return replace(
            self,
            done=done,
            states=select(self.states),
            low=select(self.low),
            tangents=select(self.tangents),
            tangents_low=select(self.tangents_low),
            columns={name: select(column) for name, column in self.columns.items()},
            events=[],
        )

    def _select_events_of_rows(self, selection: Which) -> list[EventColumns]:
        numbers = np.arange(self.size)[selection]
        event_parts = []
        for events in self.events:
            order = np.argsort(events.top, kind="stable")
            first = np.searchsorted(events.top, numbers, "left", order)
            count = np.searchsorted(events.top, numbers, "right", order) - first
            positions = np.repeat(first - np.cumsum(count) + count, count) + np.arange(count.sum())
            event_parts.append(
                events.select_and_renumber_events(
                    order[positions], np.repeat(np.arange(numbers.size), count)
                )
            )
        return event_parts

    def insert_part_at_row(self, begin: int, part: EnsembleBuffers) -> None:
        end = begin + part.size
        arrays, columns = self.get_allocated_arrays_by_name(), self.columns
        for name, array in part.get_allocated_arrays_by_name().items():
            arrays[name][begin:end] = array
        for name, array in part.columns.items():
            columns[name][begin:end] = array
        self.add_events_and_failures(begin, part)

    def add_events_and_failures(self, begin: int, part: EnsembleBuffers) -> None:
        """Add failures, chosen steps and events of `part`, and add `begin` to their top indices."""
        if part is self:
            return
        if part.last:
            self.last |= {begin + i: states for i, states in part.last.items()}
        if part.messages:
            self.messages |= {begin + i: text for i, text in part.messages.items()}
        if part.chosen:
            self.chosen |= {begin + i: choice for i, choice in part.chosen.items()}
        for events in part.events:
            self.events.append(events._replace(top=events.top + begin))

    def mark_unrun_tops_interrupted(self, t: Array) -> None:
        """Mark all tops that are still to be run as interrupted, and set their values to NaN."""
        waiting = np.flatnonzero(self.status == _NOT_YET)
        self.status[waiting] = INTERRUPTED
        values = self.states, self.reduced, self.low, self.tangents, self.tangents_low
        for array in (*values, *self.columns.values()):
            if array is not None:
                array[waiting] = np.nan
        if self.states is not None:
            self.states[waiting, :, 0] = t[waiting] if t.ndim == 2 else t


class Slice(NamedTuple):
    """Consecutive tops of an ensemble, whose results are to be computed with the same options.

    rows   the buffers for the results of these tops
    times  (k,), or (end - begin, k) if each top has its own times
    work   the object that counts finished tops and can stop the run; None in a worker process
    """

    rows: EnsembleBuffers
    options: Options
    tops: Ensemble
    begin: int
    end: int
    times: Array
    work: Work | None = None


class SliceRunner(NamedTuple):
    """A function that computes the results of a slice and writes them to its rows.

    `is_native` is True if the C library distributes the tops over threads.
    """

    run: Callable[[Slice], object]
    is_native: bool = False


def run_slice_in_lanes(part: Slice) -> None:
    """Compute the motions of a slice in SIMD lanes."""
    rows, options, tops, begin, end, t, work = part
    failures, last = Worker(*options.core_arguments, options.core_reductions, work).run(
        tops._core_scenes, begin, end, t,
        rows.status, rows.done, rows.counts, rows.reached, rows.states, rows.reduced, rows.columns,
    )  # fmt: skip
    rows.last = (
        {i: last[j : j + 1] for j, i in enumerate(failures.tolist())} if failures.size else {}
    )


def run_slice_sequentially(part: Slice) -> None:
    """Compute the motions of a slice one at a time, with their events and tangents."""
    rows, options, tops, begin, end, t, work = part
    last, low, failures, event_tops, (states, rest, which, direction) = alone(
        *options.core_arguments, options.core_events, work, tops._core_scenes, begin, end, t,
        rows.status, rows.done, rows.counts, rows.reached, rows.states, rows.low, rows.columns,
        options.tangent_bit_mask, rows.tangents, rows.tangents_low, rows.truncation,
    )  # fmt: skip
    rows.last = {i: np.array([last[j], low[j]]) for j, i in enumerate(failures.tolist())}
    if options.requests_events:
        rows.events = [EventColumns(event_tops, states, rest, which, direction)]


LANES = SliceRunner(run_slice_in_lanes, is_native=True)
SCALAR = SliceRunner(run_slice_sequentially)


def compute_quantity_values(name: str, tops: Ensemble, buffers: EnsembleBuffers) -> Array:
    """Return the values of a quantity for all states, as an array of shape (n, k, ...)."""
    assert buffers.states is not None
    n, k, _ = buffers.states.shape
    out = np.empty((n, k, *QUANTITIES[name].shape))
    values_of_tops(name, tops._core_scenes, buffers.states, buffers.done, out)
    return out


def compute_quantity_derivatives(
    name: str, tops: Ensemble, buffers: EnsembleBuffers, bits: int
) -> Array:
    """Return the derivatives of a quantity for all tops, as an array of shape (n, k, ..., c)."""
    assert buffers.states is not None and buffers.tangents is not None
    n, k, _, columns = buffers.tangents.shape
    out = np.empty((n, k, *get_quantity_derivative_shape(name), columns))
    states, done = buffers.states, buffers.done
    derivatives_of_tops(name, tops._core_scenes, states, done, bits, buffers.tangents, out)
    return out
