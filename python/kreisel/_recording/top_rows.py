"""What is recorded of many tops: arrays with a row for each top, in C order, and the core's worker
that fills some of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from .._core import Work, Worker, alone, statuses, values_of_tops
from .._ground.arguments import Array
from .._model.scene import Ensemble
from .._request.many import Order
from .._request.plan import Choice
from .._request.quantities import QUANTITIES, WANTED

Codes = npt.NDArray[np.int8]
Counts = npt.NDArray[np.int64]
Which = slice | npt.NDArray[np.integer | np.bool_]

STATUSES = list(statuses)  # their names by code
_NOT_YET = -1  # the status of a top that nobody has moved
INTERRUPTED = STATUSES.index("ERR_INTERRUPTED")


class Met(NamedTuple):
    """Events that tops met: by row the top, the states (e, 8), what their doubles leave out, which
    of the events they are, and their directions."""

    top: Counts
    states: Array
    low: Array
    which: npt.NDArray[np.intc]
    direction: npt.NDArray[np.intc]

    def of(self, chosen: npt.NDArray[np.intp], numbers: Counts) -> Met:
        """Some of them, with other numbers of their tops."""
        states, low = self.states[chosen], self.low[chosen]
        return Met(numbers, states, low, self.which[chosen], self.direction[chosen])


@dataclass
class TopRows:
    """What is known of n tops at k times each; None and {} where it was not asked for.

    status, done   how it went, as a code, and how many of the times are good
    counts         (n, 4) steps, rejected ones, evaluations, iterations
    reached        the time of the last good state [T]
    states         (n, k, 8) as of a path; q and m are NaN where they are not good
    low            (n, k, 8) what the doubles of these leave out
    columns        what is wanted in place of states, (n, k, ...) each
    kept           (n, r) what is kept of each top's states, in the order of what was asked
    last           the last good state (1, 8) of those that failed, by row; with what its doubles
                   leave out (2, 8)
    chosen         what method="geometric" chose, by row
    met            events, in no order of the tops
    said           what is to be said of those that failed, by row, where it is no code that tells
    """

    status: Codes
    done: Counts
    counts: Counts
    reached: Array
    states: Array | None = None
    low: Array | None = None
    columns: dict[str, Array] = field(default_factory=dict)
    kept: Array | None = None
    last: dict[int, Array] = field(default_factory=dict)
    said: dict[int, str] = field(default_factory=dict)
    met: list[Met] = field(default_factory=list)
    chosen: dict[int, Choice] = field(default_factory=dict)

    @classmethod
    def empty(cls, n: int, k: int, order: Order, out: Array | None = None) -> Self:
        """Rows to be filled."""
        rows = cls(
            np.full(n, _NOT_YET, dtype=np.int8),
            np.zeros(n, dtype=np.int64),
            np.zeros((n, 4), dtype=np.int64),
            np.zeros(n),
        )
        if order.kept:
            rows.kept = np.empty((n, len(order.kept)))
        elif order.request.want is not None:
            rows.columns = {
                name: np.empty((n, k, *WANTED[name].shape)) for name in order.request.want
            }
        else:
            rows.states = np.empty((n, k, 8)) if out is None else out
            rows.low = np.empty((n, k, 8)) if order.request.low else None
        return rows

    def _arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        names = "status", "done", "counts", "reached", "states", "low", "kept"
        arrays = {name: getattr(self, name) for name in names}
        return {name: array for name, array in arrays.items() if array is not None}

    def at(self, which: Which) -> TopRows:
        """The rows there; of a slice they share memory with these."""
        arrays = {name: array[which] for name, array in self._arrays().items()}
        columns = {name: array[which] for name, array in self.columns.items()}
        part = TopRows(**arrays, columns=columns)  # type: ignore[arg-type]
        if self.last or self.said or self.chosen:
            numbers = list(enumerate(np.arange(len(self.status))[which].tolist()))
            part.last = {j: self.last[i] for j, i in numbers if i in self.last}
            part.said = {j: self.said[i] for j, i in numbers if i in self.said}
            part.chosen = {j: self.chosen[i] for j, i in numbers if i in self.chosen}
        part.met = self._met_at(which) if self.met else []
        return part

    def _met_at(self, which: Which) -> list[Met]:
        """The events of some rows."""
        numbers = np.arange(len(self.status))[which]
        found = []
        for met in self.met:
            order = np.argsort(met.top, kind="stable")
            first = np.searchsorted(met.top, numbers, "left", order)
            count = np.searchsorted(met.top, numbers, "right", order) - first
            behind = np.repeat(first - np.cumsum(count) + count, count) + np.arange(count.sum())
            found.append(met.of(order[behind], np.repeat(np.arange(numbers.size), count)))
        return found

    def put(self, begin: int, part: TopRows) -> None:
        """Takes in rows that were filled elsewhere."""
        end = begin + len(part.status)
        mine, columns = self._arrays(), self.columns
        for name, array in part._arrays().items():
            mine[name][begin:end] = array
        for name, array in part.columns.items():
            columns[name][begin:end] = array
        self.add(begin, part)

    def add(self, begin: int, part: TopRows) -> None:
        """Takes in what is told of the failures among rows that begin there."""
        self.last |= {begin + i: states for i, states in part.last.items()}
        self.said |= {begin + i: text for i, text in part.said.items()}
        self.chosen |= {begin + i: choice for i, choice in part.chosen.items()}
        self.met += [met._replace(top=met.top + begin) for met in part.met]

    def settle(self, t: Array) -> None:
        """Tells of tops that nobody has moved that this was interrupted."""
        waiting = np.flatnonzero(self.status == _NOT_YET)
        self.status[waiting] = INTERRUPTED
        for array in (self.states, self.kept, self.low, *self.columns.values()):
            if array is not None:
                array[waiting] = np.nan
        if self.states is not None:
            self.states[waiting, :, 0] = t[waiting] if t.ndim == 2 else t


def fill(
    rows: TopRows, order: Order, tops: Ensemble, begin: int, end: int, t: Array, work: Work | None
) -> TopRows:
    """The rows of the tops begin to end, which share memory with these, filled on any thread;
    `work` stops it, or says which of them this call is to fill."""
    part = rows.at(slice(begin, end))
    times = t[begin:end] if t.ndim == 2 else t
    told = part.status, part.done, part.counts, part.reached
    if order.alone:
        _fill_alone(part, order, tops, begin, end, times, work)
        return part
    failed, last = Worker(*order.core, order.reductions, work).run(
        tops._tops, begin, end, times, *told, part.states, part.kept, part.columns
    )
    part.last = {i: last[j : j + 1] for j, i in enumerate(failed.tolist())}
    return part


def _fill_alone(
    part: TopRows,
    order: Order,
    tops: Ensemble,
    begin: int,
    end: int,
    t: Array,
    work: Work | None,
) -> None:
    """The same, for what no worker of the core does: events, and what doubles leave out."""
    last, low, of, by, (states, rest, which, direction) = alone(
        *order.request.core,
        list(order.events or ()),
        work,
        tops._tops,
        begin,
        end,
        t,
        part.status,
        part.done,
        part.counts,
        part.reached,
        part.states,
        part.low,
        part.columns,
    )
    part.last = {i: np.array([last[j], low[j]]) for j, i in enumerate(of.tolist())}
    if order.events is not None:
        part.met = [Met(by, states, rest, which, direction)]


def values(name: str, tops: Ensemble, rows: TopRows) -> Array:
    """(n, k, ...) a quantity at the states of all tops."""
    assert rows.states is not None
    n, k, _ = rows.states.shape
    out = np.empty((n, k, *QUANTITIES[name].shape))
    values_of_tops(name, tops._tops, rows.states, rows.done, out)
    return out
