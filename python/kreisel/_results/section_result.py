"""Sections: the states of each top of an ensemble at the occurrences of an event."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
import numpy.typing as npt

from .._core import Work, Worker
from .._model.scene import Ensemble
from .._options.ensemble_options import EnsembleOptions
from .._utils.errors import suggest
from .._utils.quantity_attributes import QuantityAttributes
from .._utils.validation import Array, read_only, short_repr
from .ensemble_buffers import STATUSES, Counts, EnsembleBuffers, SliceRunner, values
from .ensemble_result import EnsembleResult
from .indexing import flat_index
from .path import Path, stop_exception
from .state_quantities import STATE_COLUMNS, add_quantities


class Section(EnsembleResult, QuantityAttributes):
    """The states of each top of an ensemble at the occurrences of an event, from kreisel.section.

    The arrays have one row for each of the e states, sorted by top, and by time within a top.
    Arrays are read-only; quantities other than t, q and m are computed on first access.

    tops        the ensemble
    section[i]  a kreisel.Path with the states of one top; slices, lists and masks give the
                kreisel.Section of several tops
    """

    def __repr__(self) -> str:
        found = f"{len(self.states)} states of {self.size} tops"
        return f"<kreisel.Section of shape {self.shape}, {found}: {self._summary()}>"

    @property
    def n(self) -> int:
        """The number of states requested for each top."""
        return int(self._t.shape[1])

    @property
    def count(self) -> Counts:
        """(*shape) the number of states found for each top."""
        return self.state_counts

    @property
    def max_wait(self) -> Array:
        """(*shape) the longest allowed time from the start, or an event, to the next event [T].

        The times are negative if the section goes back in time.
        """
        return self._reshape(self._t[:, 0].copy())

    @cached_property
    def _is_state(self) -> npt.NDArray[np.bool_]:
        """(tops, n) True if the top has a state with this index."""
        return np.arange(self.n) < self._buffers.done[:, None]

    def _select_states(self, rows: Array) -> Array:
        """Return the rows of `rows` (tops, n, ...) that contain states, as an array (e, ...)."""
        whole = bool(self._is_state.all())
        return read_only(rows.reshape(-1, *rows.shape[2:]) if whole else rows[self._is_state])

    @cached_property
    def top(self) -> Counts:
        """(e,) the index of the top of each state.

        The shape is (e, dimensions) unless the ensemble has exactly one dimension.
        """
        row: Counts = np.nonzero(self._is_state)[0].astype(np.int64)
        index = np.array(np.unravel_index(row, self.shape), dtype=np.int64)
        top: Counts = row if self.ndim == 1 else index.T.reshape(len(row), self.ndim)
        top.flags.writeable = False
        return top

    @cached_property
    def states(self) -> Array:
        """(e, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]."""
        assert self._buffers.states is not None
        return self._select_states(self._buffers.states)

    @property
    def t(self) -> Array:
        """(e,) times [T]."""
        return self.states[:, 0]

    @property
    def q(self) -> Array:
        """(e, 4) unit quaternions (w, x, y, z), from the frame of description to space."""
        return self.states[:, STATE_COLUMNS["q"]]

    @property
    def m(self) -> Array:
        """(e, 3) angular momentum about the fixed point [M L^2 T^-1]."""
        return self.states[:, STATE_COLUMNS["m"]]

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> NoReturn:
            """Raise AttributeError, with a hint for misspelled names."""
            if name.startswith("_"):
                raise AttributeError(name)
            known = [word for word in sorted(dir(type(self))) if word[0] != "_"]
            raise AttributeError(f"a section has no {short_repr(name)}; {suggest(name, known)}")

    def _member(self, i: int) -> Path:
        assert self._buffers.states is not None
        return self._path(i, self._buffers.states[i, : int(self._buffers.done[i])], None)

    def _failure_exception(self, i: int) -> BaseException:
        done, reached = int(self._buffers.done[i]), float(self._buffers.reached[i])
        waited = f", after waiting for {abs(float(self._t[i, 0])):g}"
        came = f"{done} of {self.n} events found by t = {reached:g}"
        name = STATUSES[self._buffers.status[i]]
        text = came + waited if name == "ERR_EVENT" else came
        return stop_exception(name, self._member(i), text)

    def __getitem__(self, key: Any) -> Any:
        """Return the path of one top, or the section of several tops, with NumPy's indexing.

        >>> import kreisel as kr
        >>> tops = kr.starts(kr.scenes.asymmetric.body, energy=2, vertical=1, n=5)
        >>> kr.section(tops, n=20)[2:4]
        <kreisel.Section of shape (2,), 40 states of 2 tops: taylor, none failed>
        """
        i = flat_index(self.shape, key)
        return self._select_tops(key) if i is None else self._member(i)

    def __array__(self, dtype: object = None, copy: object = None) -> NoReturn:
        """Raise TypeError, because a section consists of several arrays."""
        raise TypeError("a section is not an array: use one of its arrays, as section.q")


def _column(section: Section, name: str) -> Array:
    return section._select_states(values(name, section.tops, section._buffers))


add_quantities(Section, ("e",), _column)


def run_section(
    buffers: EnsembleBuffers,
    options: EnsembleOptions,
    tops: Ensemble,
    begin: int,
    end: int,
    t: Array,
    work: Work | None,
) -> EnsembleBuffers:
    """Search for the section states of the tops begin..end, and return the rows of these tops.

    Row i of `t` contains the longest time that top i waits for an event, repeated n times.
    """
    part = buffers.select(slice(begin, end))
    assert part.states is not None and options.core_events is not None
    wait = np.ascontiguousarray(t[begin:end, 0])
    Worker(*options.core, (), work).section(
        tops._core_scenes, begin, end, options.core_events, part.states.shape[1], wait,
        part.status, part.done, part.counts, part.reached, part.states,
    )  # fmt: skip
    return part


SECTION = SliceRunner(run_section, is_native=True)


def slowest_turns(tops: Ensemble) -> Array:
    """Estimate how long each top takes for one turn about the axis of its largest moment [T].

    The times are an array (n,), computed as 2 pi / rate. The rate is the larger of (|m| + |h|) / I
    and sqrt(mass |gravity| |com| / I), with the largest moment I and the momentum h of the rotor.
    The first value is the rate of a rotation, the second the angular frequency of a pendulum. The
    time is 1 for a top at rest without torque.
    """
    body = tops.body
    largest = np.max(body.moments, axis=-1)
    momentum = np.linalg.norm(tops.momentum, axis=-1) + np.linalg.norm(body.rotor, axis=-1)
    rate = momentum / largest
    torque = body.mass * np.abs(tops.gravity) * np.linalg.norm(body.com, axis=-1)
    rate = np.broadcast_to(np.maximum(rate, np.sqrt(torque / largest)), tops.shape).reshape(-1)
    turns: Array = np.divide(2.0 * np.pi, rate, out=np.ones(tops.size), where=rate > 0.0)
    return turns
