"""Paths: the states at the times asked for, and what can be computed from them, when it is asked
for."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from operator import index
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
import numpy.typing as npt

from .._core import statuses
from .._ground.arguments import Array, Numbers, frozen
from .._ground.files import write
from .._ground.names import MethodName, QuantityName
from .._model.scene import Scene
from .._request.methods import EXACT, methods
from .._request.plan import Choice, Plan, plan_of
from .._request.request import Request, wanted
from .carried import Carried
from .places import Which, inside, places
from .reference import ROUNDING, SERIES, apart, grown_roundings, told_error
from .rows import Rows, refused, rows_in_any_order
from .saved import saved
from .states import NO_STATES, PARTS
from .states import Stats as Stats
from .tables import Tables

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .._drawing.charts import Picture
    from .._drawing.film import Film


@dataclass(frozen=True, eq=False, init=False)
class Path(Tables):
    """n states of a scene in motion. Arrays are read-only (.copy() gives one to write to); t, q and
    m are views of `states`, all else is computed when it is first asked for. Vectors are seen from
    space unless said otherwise.

    states  (n, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]
    method  its name; step (negative: back in time), tol and digits as used, None where it has none
            or chose its own
    stats   what the run cost, trial runs included
    events  those that were met, where solve was asked for events; else None
    want    what solve was asked to keep beside t, and all that there is then; None: the states, and
            with them everything
    """

    scene: Scene
    states: Array  # not there where _columns are
    method: MethodName
    step: float | None
    tol: float | None
    stats: Stats
    digits: int | None = None
    want: tuple[QuantityName, ...] | None = None
    events: Events | None = None
    _low: Array | None = None  # what the doubles of the states leave out
    _columns: dict[str, Array] | None = None  # in place of states: t, and what is wanted
    _asked: str = ""  # the method in the user's words
    _choice: Choice | None = None  # of method="geometric"
    _carried: Carried | None = None  # the tangents

    def __init__(
        self,
        scene: Scene,
        states: Array,
        method: MethodName,
        step: float | None,
        tol: float | None,
        stats: Stats,
        digits: int | None = None,
        want: tuple[QuantityName, ...] | None = None,
        events: Events | None = None,
        _low: Array | None = None,
        _columns: dict[str, Array] | None = None,
        _asked: str = "",
        _choice: Choice | None = None,
        _carried: Carried | None = None,
    ) -> None:
        kept = self.__dict__  # past the guard of a frozen value, and in no time
        kept["scene"], kept["method"], kept["stats"] = scene, method, stats
        kept["step"], kept["tol"], kept["digits"] = step, tol, digits
        kept["want"], kept["events"], kept["_low"] = want, events, _low
        kept["_columns"], kept["_asked"], kept["_choice"] = _columns, _asked, _choice
        kept["_carried"] = _carried
        if _low is not None:
            _low.flags.writeable = False
        if _columns is None:
            states.flags.writeable = False
            kept["states"] = states
            return
        for name, column in _columns.items():
            column.flags.writeable = False
            if name not in PARTS:
                kept[name] = column

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        for array in (*state.values(), *(self._columns or {}).values()):
            if isinstance(array, np.ndarray):
                frozen(array)

    def __repr__(self) -> str:
        words = {"step": self.step, "tol": self.tol, "digits": self.digits}
        steering = "".join(f", {k}={v!r}" for k, v in words.items() if v is not None)
        span = f", t = {self.t[0]:g} .. {self.t[-1]:g}" if len(self) else ""
        ran = f"{self.method}{steering}, {self.stats.steps} steps"
        return f"<kreisel.Path: {len(self)} states{span}; {ran}>"

    @cached_property
    def error(self) -> float:
        """The largest attitude error of the states [rad], as a second run tells: the closed form
        where it holds to the bit and is far nearer, or the Taylor series with 20 digits (30 for a
        path of 20, and for a closed form that is far from that of 20). Of 30 digits it is a guess,
        by three runs of shorter steps and what roundings grow to. It is pi where nothing is known
        of an attitude.
        Without the attitude it is the largest on all of the way, where solve was given an error."""
        if not len(self):
            return 0.0
        if self._choice and self._columns is not None and "q" not in self._columns:
            return self._choice.error
        return told_error(self.scene, self.method, self.digits, self._apart, self._grown)

    def _grown(self) -> float:
        came, most = grown_roundings(self.scene, self.t, self.digits or 16)
        good(self.scene, SERIES, came)
        return most

    def _apart(self, second: Request) -> float:
        """The largest angle to the attitudes of a second run, low words included: their difference
        loses no digit."""
        other = good(self.scene, second, rows_in_any_order(self.scene, second, self.t))
        return apart((self.q, self.q_low), (other.q, other.q_low))

    @cached_property
    def plan(self) -> Plan:
        """What was used for this path, and what was left out, and why."""
        return plan_of(self.scene, self._request, len(self), self._choice)

    @property
    def _request(self) -> Request:
        step = None if self.step is None else abs(self.step)
        watched = self.events is not None
        words = step, self.tol, self.digits, 0, self.want, self._asked, watched
        return Request(methods[self.method], *words)

    def __call__(self, t: Numbers) -> Path:
        """The states of the same run at other times, as a path: bit for bit those that solve gives
        in the same words.

        t  a number, for the path of one state, or a list in any order, between 0 and where the
           path ends [T]

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.asymmetric, 10)
            >>> path([2.5, 1.0]).t.tolist()
            [2.5, 1.0]

        Raises ValueError for other times, and for a path of kreisel.exact's map, which has states
        at its steps only; kreisel.Error and kreisel.Interrupted as solve does. The run is made
        again, from the start to the last of these times; by the closed form at once. It keeps what
        `want` names, no events and no tangents.
        """
        if self._asked == EXACT != self.method:
            raise ValueError(
                f"this path is of the closed form of {self.method}'s map, which has no states "
                "between its steps: call what kreisel.exact gave, with the numbers of the steps"
            )
        done = self._request
        path = good(self.scene, done, rows_in_any_order(self.scene, done, inside(self.t, t)))
        states = NO_STATES if path._columns else path.states
        return replace(path, states=states, step=self.step, _choice=self._choice)

    def __getitem__(self, which: Which) -> Path:
        """Some of the states, as a path that keeps all but the events: a number gives one state, a
        slice, a list of numbers or of True and False several, as of an array.

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.thesis, [0.0, 1.0, 2.0, 3.0])
            >>> len(path[-1]), path[::2].t.tolist(), path[path.t > 1.5].t.tolist()
            (1, [0.0, 2.0], [2.0, 3.0])
        """
        at = places(len(self), which)
        if self._columns is not None:
            columns = {name: column[at] for name, column in self._columns.items()}
            return replace(self, states=NO_STATES, _columns=columns, events=None)
        low = None if self._low is None else self._low[at]
        carried = self._carried and self._carried.at(at)
        return replace(self, states=self.states[at], _low=low, events=None, _carried=carried)

    def __iter__(self) -> Iterator[Path]:
        """The states one by one, each a path."""
        return (self[i] for i in range(len(self)))

    def __array__(self, dtype: object = None, copy: object = None) -> NoReturn:
        """A path is many arrays, and no one of them is meant."""
        raise TypeError("a path is no array: take one of its own, as path.q or path.states")

    def scene_at(self, i: int) -> Scene:
        """The scene that begins, at t = 0, with state i. IndexError if there is none."""
        (state,) = self.states[places(len(self), index(i))]
        return self.scene.replace(attitude=state[1:5], momentum=state[5:])

    @property
    def end(self) -> Scene:
        """The scene that begins, at t = 0, with the last state. IndexError if there is none."""
        return self.scene_at(-1)

    def only(self, want: Iterable[QuantityName]) -> Path:
        """The path with no more than t and these quantities, as if solve had been asked for
        them."""
        names = wanted(want) or ()
        words: tuple[str, ...] = ("t", *names)
        columns = {name: np.ascontiguousarray(getattr(self, name)) for name in words}
        return replace(
            self, states=NO_STATES, _low=None, want=names, _columns=columns, _carried=None
        )

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the path, for kreisel.load; a file of that name is replaced once all is on the
        disk, never left half done. OSError where it cannot be written.

        The file is an archive that numpy.load reads: t, q, m (and q_low, m_low), or t and what
        `want` names; `scene`, in TOML; `head`, in JSON: method, step, tol, digits, want, stats and
        what method="geometric" chose; and of events events_t, events_q, events_m, events_which and
        events_direction; of tangents tangents and tangents_low.
        """
        met = self.events
        write(file, saved(self, None if met is None else (met.path, met.which, met.direction)))

    def plot(self, axes: Iterable[Axes] | None = None, *, degrees: bool = False) -> Picture:
        """The picture that kreisel.plot draws, of this path alone."""
        from .._drawing.charts import plotted

        return plotted([(self, self.events.path if self.events else None)], axes, degrees)

    def animate(
        self,
        file: str | os.PathLike[str] | None = None,
        *,
        speed: float | None = None,
        fps: int = 25,
        size: int = 480,
    ) -> Film:
        """The body in motion with the trace of its apex, drawn with matplotlib: a film that a
        notebook shows, and that goes to a file. A body symmetric about its apex is drawn as a
        turned top, any other as a cuboid, in the proportions of its moments.

        file   its name, .gif, .mp4 (where ffmpeg is) or .html; it is there whole or not at all
        speed  of the path's time that passes in a second [T]; left out: all of it in 8 seconds
        fps    frames in a second; of a GIF, hundredths of a second
        size   of a frame, high and wide [pixels]

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.cusps, 2)
            >>> path.animate(fps=5, size=120)
            <Film: 41 frames, 5 a second, t = 0 .. 2>

        Frames are evenly spaced in time, whatever the path's times are: their states are those of
        `path(t)`, which raises what it cannot give. ValueError for a path within no time, and for
        more than 2**28 pixels in all; OSError for a file that cannot be written.
        """
        from .._drawing.film import film_of

        return film_of(self, file, speed, fps, size)


@dataclass(frozen=True, eq=False)
class Events:
    """k events in the order in which a path met them. Arrays are read-only.

    path       the states at the events, with all that a path can tell; its t is (k,), in the path's
               order [T]
    which      (k,) the index of each in the list that solve was given
    direction  (k,) 1: the function grew with time, or was smallest; -1: it fell, or was largest
    """

    path: Path
    which: npt.NDArray[np.intc]
    direction: npt.NDArray[np.intc]

    def __post_init__(self) -> None:
        self.which.flags.writeable = self.direction.flags.writeable = False

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.__post_init__()

    def __len__(self) -> int:
        return len(self.path)

    @property
    def t(self) -> Array:
        """(k,) times [T]."""
        return self.path.t

    @property
    def states(self) -> Array:
        """(k, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]."""
        return self.path.states


class Stopped(BaseException):
    """A run that ended before its time.

    status  its name, as in kreisel.h without the prefix: 'ERR_LIMIT', 'ERR_NOT_FINITE', ...
    path    the states asked for that were reached, and the last good state where that is later
    paths   of many tops what is known of all, a kreisel.Paths or kreisel.Reduced; `path` is then
            that of the first that failed, or was not done
    """

    def __init__(self, message: str, status: str, path: Path, paths: Any = None) -> None:
        super().__init__(message)
        self.status = status
        self.path = path
        self.paths = paths

    def __reduce__(self) -> tuple[type[Stopped], tuple[str, str, Path, object]]:
        return type(self), (str(self), self.status, self.path, self.paths)


class Error(Stopped, RuntimeError):
    """A run failed. `.path` holds what was reached, `.status` the reason's name."""

    __module__ = "kreisel"  # a traceback names what users catch


class Interrupted(Stopped, KeyboardInterrupt):
    """Ctrl-C during a run. `.path` holds what was reached."""

    __module__ = "kreisel"


def stopped(status: str, path: Path, where: str) -> BaseException:
    """What the status of a run stands for: a failure with its path, or bad input."""
    kinds: dict[str, type[Stopped]] = {"FAILURE": Error, "INTERRUPT": Interrupted}
    what, text = statuses[status]
    if path.tol is not None and status in ("ERR_STEP", "ERR_CONVERGENCE"):
        below = ", which is below the rounding of doubles" if path.tol < ROUNDING else ""
        text += f" at tol = {path.tol!r}{below}"
    if what in kinds:
        return kinds[what](f"{text}: {where}", status, path)
    return refused(status, path.scene, path.method, path.step, path.tol)


def path_of(scene: Scene, done: Request, came: Rows) -> Path:
    """The path of what the core has recorded, with all its states."""
    _, states, low, counts, end = came
    step = done.step if end >= 0.0 else done.signed(True)
    name, stats, asked = done.method.name, Stats(*counts), done.asked
    return Path(scene, states, name, step, done.tol, stats, done.digits, _low=low, _asked=asked)


def good(scene: Scene, done: Request, came: Rows) -> Path:
    """The path of what the core has recorded, kept to what is wanted; raises what its status stands
    for."""
    path = path_of(scene, done, came)
    path = kept(path, done.want, came[-1])
    if came[0] != "OK":
        raise stopped(came[0], path, way(path, came[-1]))
    return path


def kept(path: Path, want: tuple[QuantityName, ...] | None, end: float) -> Path:
    """The path with no more than what is wanted; Ctrl-C while that is computed loses nothing."""
    if want is None:
        return path
    try:
        return path.only(want)
    except KeyboardInterrupt:
        part = path.only(want)
        raise stopped("ERR_INTERRUPTED", part, way(part, end)) from None


def way(path: Path, end: float) -> str:
    """How far a path has come, in words."""
    last = path.t[-1] if len(path) else 0.0
    return f"{path.method} got to t = {last:g} of {end:g} in {path.stats.steps} steps"
