"""What became of many tops: for each how it went, how far it came, and what that cost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Self, TypeVar, cast

import numpy as np
import numpy.typing as npt

from .._core import statuses
from .._ground.arguments import Array, ReadOnlyArrays, frozen, shown
from .._ground.names import QuantityName
from .._ground.refusals import unchangeable
from .._model.scene import Ensemble
from .._request.many import Order, index_of, member, place
from .._request.methods import methods
from .._request.request import Request
from .path import Error, Interrupted, Path, path_of, stopped, way
from .places import number_of, numbers_of
from .states import NO_STATES, Stats
from .top_rows import INTERRUPTED, STATUSES, Codes, Counts, TopRows

_T = TypeVar("_T", bound=np.generic)


@unchangeable("solve again, for another result")
@dataclass(frozen=True, eq=False, repr=False)
class Outcomes(ReadOnlyArrays):
    """What kreisel.solve tells of each top of an ensemble. Arrays are read-only, and begin with the
    shape of the ensemble.

    tops  the ensemble
    """

    tops: Ensemble
    _t: Array  # (k,), or (n, k) where each top has its own
    _order: Order
    _rows: TopRows

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the ensemble."""
        return self.tops.shape

    @property
    def ndim(self) -> int:
        """The number of its dimensions."""
        return len(self.tops.shape)

    @property
    def size(self) -> int:
        """How many tops there are."""
        return self.tops.size

    def __len__(self) -> int:
        return len(self.tops)

    @property
    def method(self) -> str:
        """Its name in the words of solve: 'auto' is exact for the tops that have a closed form, and
        taylor for all others."""
        return self._order.request.asked

    @property
    def step(self) -> float | None:
        """As used, positive; None where there is none, or it was left to the method [T]."""
        return self._order.request.step

    @property
    def tol(self) -> float | None:
        """As used; None where there is none, or it was left to the method."""
        return None if self._order.chooses else self._order.request.tol

    @property
    def digits(self) -> int | None:
        """As used; None where none were asked for."""
        return self._order.request.digits

    def _shaped(self, rows: npt.NDArray[_T]) -> npt.NDArray[_T]:
        """Rows over the shape of the ensemble."""
        over = rows.reshape(self.shape + rows.shape[1:])
        over.flags.writeable = False
        return over

    @property
    def t(self) -> Array:
        """(k,) times of all tops, or (*shape, k) where each has its own [T]."""
        return frozen(self._t[:]) if self._t.ndim == 1 else self._shaped(self._t)

    @property
    def status(self) -> Codes:
        """(*shape) 0 for a top of which all went well, else the code of what did not;
        `status_names` and `why` tell it in words."""
        return self._shaped(self._rows.status)

    @property
    def status_names(self) -> npt.NDArray[np.str_]:
        """(*shape) 'OK', 'ERR_LIMIT', 'ERR_NOT_FINITE', ...: as in kreisel.h without the prefix."""
        return self._shaped(np.array(STATUSES)[self._rows.status])

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """(f,) the numbers of the tops that were not brought to their last time; (f, dimensions) of
        an ensemble with several dimensions or none."""
        found = np.argwhere(self.status)
        return found[:, 0] if self.ndim == 1 else found

    @property
    def reached(self) -> Array:
        """(*shape) the time of the last good state [T]."""
        return self._shaped(self._rows.reached)

    @property
    def done(self) -> Counts:
        """(*shape) how many of the times were reached."""
        return self._shaped(self._rows.done)

    @property
    def steps(self) -> Counts:
        """(*shape) steps of the method."""
        return self._shaped(self._rows.counts[:, 0])

    @property
    def rejected(self) -> Counts:
        """(*shape) steps that were too long, and made again."""
        return self._shaped(self._rows.counts[:, 1])

    @property
    def evaluations(self) -> Counts:
        """(*shape) evaluations of the right-hand side or torque."""
        return self._shaped(self._rows.counts[:, 2])

    @property
    def iterations(self) -> Counts:
        """(*shape) iterations of a solver."""
        return self._shaped(self._rows.counts[:, 3])

    def why(self, index: int | tuple[int, ...]) -> str:
        """What is to be said of a top by its index: how it failed, or 'success'."""
        i = number_of(self.shape, index)
        if i is None:
            raise IndexError(
                f"{shown(index)} is not the index of one top, of the shape {self.shape}"
            )
        return statuses["OK"][1] if self._rows.status[i] == 0 else str(self._failure(i))

    def check(self) -> Self:
        """The same, where all tops were brought to their last times. Raises kreisel.Error for the
        first that was not, which names it and tells how many there are: its `.path` is that top's,
        its `.paths` are these."""
        failed = np.flatnonzero(self._rows.status)
        if failed.size:
            raise self._stopped(int(failed[0]), failed.size)
        return self

    def _failure(self, i: int) -> BaseException:
        """The exception that a run of this top alone would have ended in."""
        if i in self._rows.said:
            return ValueError(self._rows.said[i])
        path = self._member(i)
        times = self._times(i)
        end = float(times[-1]) if times.size else 0.0
        return stopped(STATUSES[self._rows.status[i]], path, way(path, end))

    def _stopped(self, i: int, count: int) -> Error | Interrupted:
        """What is raised for tops that were not brought to their ends, of which this is the
        first."""
        interrupted = bool(self._rows.status[i] == INTERRUPTED)
        first = f", the first of {count} of {self.size}" if count > 1 else ""
        said = f"top{place(index_of(i, self.shape))}{first}: {self._failure(i)}"
        kind = Interrupted if interrupted else Error
        return kind(said, STATUSES[self._rows.status[i]], self._member(i), self)

    def _times(self, i: int) -> Array:
        return self._t if self._t.ndim == 1 else self._t[i]

    def _request_of(self, i: int) -> Request:
        """The request of this top alone, for all its states."""
        if self._order.chooses:
            return replace(self._order.request, tol=None, want=None)
        return replace(self._order.of(member(self.tops, i)), want=None)

    def _member(self, i: int) -> Path:
        """The path of the i-th top in C order, with the last good state of one that failed."""
        rows, done = self._rows, int(self._rows.done[i])
        states, low = NO_STATES, None
        if rows.states is not None:
            states = rows.states[i, :done]
            low = None if rows.low is None else rows.low[i, :done]
        path = self._path(i, states, low)
        if rows.columns:
            columns = {name: column[i, :done] for name, column in rows.columns.items()}
            path = with_columns(path, {"t": self._times(i)[:done].copy()} | columns)
        return self._with_last(i, path) if i in rows.last or rows.status[i] else path

    def _path(self, i: int, states: Array, low: Array | None) -> Path:
        times = self._times(i)
        end = float(times[-1]) if times.size else 0.0
        steps, rejected, evaluations, iterations = self._rows.counts[i].tolist()
        counts = steps, rejected, evaluations, iterations
        choice = self._rows.chosen.get(i)
        if choice is not None:
            scene, name = member(self.tops, i), methods[choice.method].name
            return Path(scene, states, name, choice.step, None, Stats(*counts), _choice=choice)
        return path_of(member(self.tops, i), self._request_of(i), ("OK", states, low, counts, end))

    def _with_last(self, i: int, path: Path) -> Path:
        """The path with the last good state, where that is none of those that were asked for."""
        last = self._rows.last.get(i)
        state = member(self.tops, i)._start if last is None else last[:1]
        if len(path) == len(self._times(i)) or (len(path) and path.t[-1] == state[0, 0]):
            return path
        low = None
        if path._low is not None:
            low = np.vstack([path._low, np.zeros((1, 8)) if last is None else last[1:]])
        if path._columns is None:
            return self._path(i, np.vstack([path.states, state]), low)
        more = self._path(i, state, None).only(path.want or ())
        return with_columns(
            path,
            {
                name: np.concatenate([column, getattr(more, name)])
                for name, column in path._columns.items()
            },
        )

    def _part(self, key: Any) -> Self:
        """The same of some of the tops."""
        at = numbers_of(self.shape, key)
        which = key if isinstance(key, slice) and self.ndim == 1 else at.reshape(-1)
        t = self._t if self._t.ndim == 1 else self._t[which]
        return type(self)(self.tops[key], t, self._order, self._rows.at(which))

    def __iter__(self) -> Iterator[Any]:
        """What stands along the first dimension."""
        return (self[i] for i in range(len(self)))

    def __getitem__(self, key: Any) -> Any:
        """Of one top or of some, as of an array."""
        raise NotImplementedError

    def _summary(self) -> str:
        """Shape, method, and how many failed, for a line that tells what this is."""
        words = {"step": self.step, "tol": self.tol, "digits": self.digits}
        steering = "".join(f", {k}={v!r}" for k, v in words.items() if v is not None)
        count = int(np.count_nonzero(self._rows.status))
        told = f"{count} failed" if count else "none failed"
        return f"{self.method}{steering}, {told}"


def with_columns(path: Path, columns: dict[str, Array]) -> Path:
    """The path with these columns in place of its states."""
    want = cast(tuple[QuantityName, ...], tuple(name for name in columns if name != "t"))
    return replace(path, states=NO_STATES, _low=None, want=want, _columns=columns)
