"""The closed forms of many tops."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import (
    Work,
    courses,
    exact_rates,
    exact_states_of_tops,
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
from .._recording.top_rows import Codes
from .._request.many import index_of, member, order, place, threads_of
from .._request.methods import EXACT, methods, no_closed_form
from .._request.times import refuse_endless


@dataclass(frozen=True, eq=False)
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
        at = np.atleast_1d(times)
        return self._states(at).reshape(*shape, *times.shape[-1:], 8)

    def _states(self, t: Array) -> Array:
        """(n, k, 8) the states at times (k,) or (n, k). A worker has the same states, and sooner,
        where times lead away from 0; but at 0 it has the start itself."""
        forward = np.where(t[..., -1:] < 0.0, -t, t)
        if t.all() and (np.diff(forward, axis=-1, prepend=0.0) > 0.0).all():
            crew = Crew(threads_of(None, None))
            came = move(Paths, self.tops, t, order(self.tops, EXACT), crew)
            return came.check().states.reshape(self.tops.size, t.shape[-1], 8)
        states = np.empty((self.tops.size, t.shape[-1], 8))
        if t.ndim == 2:
            self._each(exact_states_of_tops, states, t)
        else:
            self._each(partial(exact_states_of_tops, t=t), states)
        return states

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

    def _each(self, function: Callable[..., tuple[str, int]], *rows: Array | Codes) -> None:
        """Calls a function of the core for slices of the tops, with these rows of each. ValueError
        for the first top that it refuses."""
        found: list[tuple[int, str]] = []

        def job(begin: int, end: int) -> tuple[Callable[..., tuple[str, int]], tuple[Any, ...]]:
            return function, (self.tops._tops, begin, end, *(each[begin:end] for each in rows))

        def take(_: int, came: tuple[str, int]) -> None:
            if came[0] != "OK":
                found.append((came[1], came[0]))

        Crew(threads_of(None, None)).do(self.tops.size, job, take, Work(), None)
        if found:
            first, status = min(found)
            refused = _no_turning if function is exact_turnings else no_form
            raise refused(status, member(self.tops, first), self._named(first))

    @cached_property
    def _rates(self) -> Array:
        rates = np.empty((self.tops.size, 3))
        self._each(exact_rates, rates)
        return rates

    @cached_property
    def _turning(self) -> Turnings:
        rows, numbers = np.empty((self.tops.size, 10)), np.zeros(self.tops.size, dtype=np.int8)
        self._each(exact_turnings, rows, numbers)
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


def _no_turning(status: str, scene: Scene, where: str) -> ValueError:
    return ValueError(where + no_turning(status, scene))


def form_of(tops: Ensemble, word: str = "top") -> ExactEnsemble:
    """The closed forms of an ensemble; ValueError, which names it, for the first without one."""
    first, count = unsuited(tops._tops, "auto")
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
