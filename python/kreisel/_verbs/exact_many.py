"""The closed forms of many tops."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import (
    Work,
    courses,
    exact_rates,
    exact_turnings,
    horizons,
    statuses,
    unsuited,
)
from .._ground.arguments import Array, Numbers, array, frozen, instance
from .._model.scene import Ensemble, Scene
from .._model.turning import Turnings, no_turning, turnings
from .._recording.crew import Crew
from .._recording.moving import move
from .._recording.paths import Paths
from .._request.many import index_of, member, order, place, threads_of
from .._request.methods import EXACT, methods, no_closed_form
from .._request.times import refuse_endless


@dataclass(frozen=True, eq=False, repr=False)
class ExactEnsemble:
    """The motions of many tops in closed form; call it with a time for the states of all, an array
    (*shape, 8) with rows t, q (w, x, y, z), m as in kreisel.Path; with k times for an array
    (*shape, k, 8), and so with an array (*shape, k) of times of each. `shape` is that of the
    ensemble, (n,) of a list.

    period, precession, spin and what is told of turning points are arrays of that shape, each as of
    one scene alone; so are the states, bit for bit. All are computed when they are first asked for.
    ValueError, asked for turning points, where one scene has none.

    A map over spin and tilt, of how far each top falls that is let go [degrees]:

        >>> import numpy as np
        >>> import kreisel as kr
        >>> top = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> spins, tilts = np.linspace(10, 30, 3), np.linspace(0, 1, 2)
        >>> tops = kr.Ensemble.spinning(top, spin=spins[:, None], tilt=tilts)
        >>> np.degrees(kr.exact(tops).greatest_nutation).round(1)
        array([[  0. , 104.7],
               [  0. ,  69.2],
               [  0. ,  62.2]])
    """

    tops: Ensemble
    _word: str = "top"  # what a member is called in refusals

    def __repr__(self) -> str:
        shape = self.tops.shape
        count = f"{len(self)} scenes" if len(shape) == 1 else f"scenes of shape {shape}"
        return f"<kreisel.ExactEnsemble: {count}>"

    def __len__(self) -> int:
        return len(self.tops)

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """The scenes, in C order."""
        return tuple(member(self.tops, i) for i in range(self.tops.size))

    def __call__(self, t: Numbers) -> Array:
        n, shape = self.tops.size, self.tops.shape
        times = array("t", t, "a number, a list of times, or an array of times of each top")
        if times.ndim > 1:
            if times.shape[:-1] != shape:
                raise ValueError(
                    "t must be a number, a list of times for all tops, or an array of shape "
                    f"{(*shape, 'k')} with k times of each, not an array of shape {times.shape}"
                )
            times = times.reshape(n, times.shape[-1])
        self._refuse_endless(times)
        states = states_in_any_order(self.tops, np.atleast_1d(times))
        return states.reshape(*shape, *times.shape[-1:], 8)

    def _refuse_endless(self, times: Array) -> None:
        """Times by which some top turns more often than a double can tell."""
        ends = np.abs(times).max(axis=-1, initial=0.0) if times.ndim else np.abs(times)
        most = np.empty(self.tops.size)
        horizons(self.tops._tops, most)
        late = np.flatnonzero(ends >= most)
        if late.size:
            i = int(late[0])
            end = float(np.broadcast_to(ends, most.shape)[i])
            try:
                refuse_endless(member(self.tops, i), end, None)
            except ValueError as error:
                raise ValueError(f"{self._named(i)}{error}") from None

    def _named(self, i: int) -> str:
        return f"{self._word}{place(index_of(i, self.tops.shape))}: "

    def _in_slices(self, function: Callable[..., tuple[str, int]], *out: Any) -> tuple[str, int]:
        """What a function of the core writes for all tops; the first that it refuses, and why."""
        found: list[tuple[int, str]] = []

        def job(begin: int, end: int) -> tuple[Callable[..., tuple[str, int]], tuple[Any, ...]]:
            return function, (self.tops._tops, begin, end, *(array[begin:end] for array in out))

        def take(_: int, came: tuple[str, int]) -> None:
            if came[0] != "OK":
                found.append((came[1], came[0]))

        Crew(threads_of(None, None)).do(self.tops.size, job, take, Work(), None)
        first, status = min(found, default=(self.tops.size, "OK"))
        return status, first

    @cached_property
    def _rates(self) -> Array:
        rates = np.empty((self.tops.size, 3))
        status, first = self._in_slices(exact_rates, rates)
        if status != "OK":
            raise no_form(status, member(self.tops, first), self._named(first))
        return rates

    @cached_property
    def _turning(self) -> Turnings:
        rows = np.empty((self.tops.size, 10))
        numbers = np.zeros(self.tops.size, dtype=np.int8)
        status, first = self._in_slices(exact_turnings, rows, numbers)
        if status != "OK":
            raise ValueError(self._named(first) + no_turning(status, member(self.tops, first)))
        return turnings(rows, np.array(courses)[numbers])

    def _shaped(self, row: Array) -> Array:
        return frozen(row.reshape(self.tops.shape))

    @property
    def period(self) -> Array:
        """(*shape) as in Exact [T]."""
        return self._shaped(self._rates[:, 0])

    @property
    def precession(self) -> Array:
        """(*shape) as in Exact [T^-1]."""
        return self._shaped(self._rates[:, 1])

    @property
    def spin(self) -> Array:
        """(*shape) as in Exact [T^-1]."""
        return self._shaped(self._rates[:, 2])

    @property
    def least_nutation(self) -> Array:
        """(*shape) as in Exact [rad]."""
        return self._shaped(self._turning.least)

    @property
    def greatest_nutation(self) -> Array:
        """(*shape) as in Exact [rad]."""
        return self._shaped(self._turning.greatest)

    @property
    def t_least(self) -> Array:
        """(*shape) as in Exact [T]."""
        return self._shaped(self._turning.t_least)

    @property
    def t_greatest(self) -> Array:
        """(*shape) as in Exact [T]."""
        return self._shaped(self._turning.t_greatest)

    @property
    def course(self) -> npt.NDArray[np.str_]:
        """(*shape) as in Exact."""
        course = self._turning.course.reshape(self.tops.shape)
        course.flags.writeable = False
        return course

    @property
    def critical_spin(self) -> Array:
        """(*shape) as in Exact [T^-1]."""
        return self._shaped(self._turning.critical_spin)


def states_in_any_order(tops: Ensemble, t: Array) -> Array:
    """(n, k, 8) the states at times (k,) or (n, k) on either side of 0, in any order: the crew
    moves the tops to them in order, once each way."""
    asked, crew = order(tops, EXACT), Crew(threads_of(None, None))
    signed = np.where(t[..., -1:] < 0.0, -t, t)
    if (np.diff(signed, axis=-1, prepend=0.0) >= 0.0).all():
        return move(Paths, tops, t, asked, crew).states.reshape(tops.size, t.shape[-1], 8)
    away = np.argsort(np.abs(t), axis=-1, kind="stable")
    sorted_t = np.take_along_axis(t, away, axis=-1)
    states = np.empty((tops.size, t.shape[-1], 8))
    for back in (False, True):
        side = sorted_t < 0.0 if back else sorted_t >= 0.0
        if not side.any():
            continue
        here = np.where(side, sorted_t, 0.0)
        rank = np.argsort(side, axis=-1, kind="stable")  # those of the other side first, at 0
        came = move(Paths, tops, np.take_along_axis(here, rank, axis=-1), asked, crew)
        rows = came.states.reshape(states.shape)
        at = np.broadcast_to(np.take_along_axis(away, rank, axis=-1), states.shape[:2])
        good = np.broadcast_to(np.take_along_axis(side, rank, axis=-1), states.shape[:2])
        top = np.broadcast_to(np.arange(tops.size)[:, None], at.shape)
        states[top[good], at[good]] = rows[good]
    return states


def form_of(tops: Ensemble, word: str = "top") -> ExactEnsemble:
    """The closed forms of an ensemble; ValueError, which names it, for the first without one."""
    first, count = unsuited(tops._tops, EXACT)
    if count:
        more = f", the first of {count} such" if count > 1 else ""
        where = f"{word}{place(index_of(first, tops.shape))}{more}: "
        raise no_form("ERR_METHOD", member(tops, first), where)
    return ExactEnsemble(tops, word)


def ensemble_of(scenes: Sequence[Scene]) -> ExactEnsemble:
    """The closed forms of a list of scenes."""
    for i, scene in enumerate(scenes):
        instance(f"scene[{i}]", scene, Scene)
    if not scenes:
        raise ValueError("a list of scenes must not be empty")
    return form_of(Ensemble.of(scenes), "scene")


def no_form(status: str, scene: Scene, where: str = "") -> ValueError:
    """The refusal of a scene without closed form."""
    if status != "ERR_METHOD":
        return ValueError(f"{where}{statuses[status][1]}: {scene!r}")
    return ValueError(f"{where}{no_closed_form(scene)}: it is for {methods[EXACT].tops}")


def row_of(t: Numbers) -> Array:
    """A time or a list of times."""
    times = array("t", t, "a number or a list of times")
    if times.ndim > 1:
        raise ValueError(
            f"t must be a number or a list of times, not an array of shape {times.shape}"
        )
    return times
