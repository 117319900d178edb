"""Paths: the states at the times asked for, and what can be computed from them, when it is asked
for."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from .._core import modified_energy, modified_energy4, statuses, values
from .._ground.arguments import Array, frozen, number
from .._model.scene import Scene
from .._request.methods import EXACT, methods
from .._request.plan import Choice, Plan, plan_of
from .._request.quantities import QUANTITIES, WANTED, Quantity
from .._request.request import Request, wanted
from .._request.times import listed
from .reference import (
    CLOSED_FORM,
    LONGER_SERIES,
    LONGEST_SERIES,
    ROUNDING,
    ROUNDINGS,
    SERIES,
    apart,
    closed_form_holds,
    roundings,
)
from .rows import Rows, refused, rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from scipy.spatial.transform import Rotation

NO_STATES = np.empty((0, 8))
_PARTS = {"t": slice(0, 1), "q": slice(1, 5), "m": slice(5, 8)}


class Stats(NamedTuple):
    """What a run cost: steps, rejected ones, evaluations of the right-hand side or torque,
    iterations of a solver."""

    steps: int
    rejected: int
    evaluations: int
    iterations: int


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Path:
    """n states of a scene in motion. Arrays are read-only; t, q and m are views of `states`, all
    else is computed when it is first asked for. Vectors are seen from space unless said otherwise.

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
    method: str
    step: float | None
    tol: float | None
    stats: Stats
    digits: int | None = None
    want: tuple[str, ...] | None = None
    events: Events | None = None
    _low: Array | None = None  # what the doubles of the states leave out
    _columns: dict[str, Array] | None = None  # in place of states: t, and what is wanted
    _asked: str = ""  # the method in the user's words
    _choice: Choice | None = None  # of method="geometric"

    def __init__(
        self,
        scene: Scene,
        states: Array,
        method: str,
        step: float | None,
        tol: float | None,
        stats: Stats,
        digits: int | None = None,
        want: tuple[str, ...] | None = None,
        events: Events | None = None,
        _low: Array | None = None,
        _columns: dict[str, Array] | None = None,
        _asked: str = "",
        _choice: Choice | None = None,
    ) -> None:
        kept = self.__dict__  # past the guard of a frozen value, and in no time
        kept["scene"], kept["method"], kept["stats"] = scene, method, stats
        kept["step"], kept["tol"], kept["digits"] = step, tol, digits
        kept["want"], kept["events"], kept["_low"] = want, events, _low
        kept["_columns"], kept["_asked"], kept["_choice"] = _columns, _asked, _choice
        if _low is not None:
            _low.flags.writeable = False
        if _columns is None:
            states.flags.writeable = False
            kept["states"] = states
            return
        for name, column in _columns.items():
            column.flags.writeable = False
            if name not in _PARTS:
                kept[name] = column

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        for array in (*state.values(), *(self._columns or {}).values()):
            if isinstance(array, np.ndarray):
                frozen(array)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        words = {"step": self.step, "tol": self.tol, "digits": self.digits}
        steering = "".join(f", {k}={v!r}" for k, v in words.items() if v is not None)
        span = f", t = {self.t[0]:g} .. {self.t[-1]:g}" if len(self) else ""
        ran = f"{self.method}{steering}, {self.stats.steps} steps"
        return f"<kreisel.Path: {len(self)} states{span}; {ran}>"

    def __getattr__(self, name: str) -> Array:
        """The quantities are attributes, set below; for any other name a hint, as
        AttributeError."""
        if name.startswith("__"):
            raise AttributeError(name)
        if self.want is not None and (name == "states" or hasattr(type(self), name)):
            more = f"add {name!r} to want" if name in WANTED else "solve without want"
            raise AttributeError(
                f"this path has no {name!r}: it keeps what want={self.want!r} asked for; {more}"
            )
        known = [word for word in ("states", *dir(type(self))) if not word.startswith("_")]
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {near[0]!r}?" if near else "there are " + ", ".join(known)
        raise AttributeError(f"a path has no {name!r}; {hint}")

    def _part(self, name: str) -> Array:
        if self._columns is not None and name in self._columns:
            return self._columns[name]
        part = self.states[:, _PARTS[name]]
        return part[:, 0] if name == "t" else part

    @property
    def t(self) -> Array:
        """(n,) times [T]."""
        return self._part("t")

    @property
    def q(self) -> Array:
        """(n, 4) unit quaternions (w, x, y, z), scalar first, from the frame in which the body was
        described to space."""
        return self._part("q")

    @property
    def q_xyzw(self) -> Array:
        """(n, 4) attitudes with the scalar last."""
        return self.q[:, [1, 2, 3, 0]]

    @property
    def m(self) -> Array:
        """(n, 3) angular momentum about the fixed point [M L^2 T^-1]."""
        return self._part("m")

    @cached_property
    def q_low(self) -> Array:
        """(n, 4) what the doubles of q leave out: q + q_low has as many digits as were asked for;
        zero up to 16 digits."""
        return self._rest[:, 1:5]

    @cached_property
    def m_low(self) -> Array:
        """(n, 3) what the doubles of m leave out [M L^2 T^-1]; zero up to 16 digits."""
        return self._rest[:, 5:8]

    @cached_property
    def _rest(self) -> Array:
        return frozen(np.zeros_like(self.states)) if self._low is None else self._low

    @property
    def rotation(self) -> Rotation:
        """The attitudes as one scipy.spatial.transform.Rotation; ImportError without SciPy."""
        from scipy.spatial.transform import Rotation

        return Rotation.from_quat(self.q_xyzw)

    def modified_energy(self, step: float) -> Array:
        """(n,) the energy that bobenko_suris keeps at this step, E + step <torque, m> / (2 I1)
        [M L^2 T^-2].

        NaN unless the body is a Lagrange top. A step back in time is negative, as `path.step` is.
        """
        return modified_energy(self.scene._block, self.states, number("step", step))

    def modified_energy4(self, step: float) -> Array:
        """(n,) the energy that bobenko_suris4 keeps at this step, E up to a constant and step^4
        [M L^2 T^-2]; NaN unless the body is a Lagrange top, and where the step is too large for the
        method."""
        return modified_energy4(self.scene._block, self.states, number("step", step))

    @cached_property
    def energy_error(self) -> float:
        """max |E - E0| / max (T + M |g| |com|) over the states, E0 at t = 0; zero for a path
        without states, nan for a damped top, which loses energy."""
        if self.scene._is_damped:
            return np.nan
        if not len(self):
            return 0.0
        scene = self.scene
        kinetic, potential = (
            float(values(name, scene._block, scene._start)[0]) for name in ("kinetic", "potential")
        )
        lever = float(np.linalg.norm(scene.body.com))
        size = max(kinetic, self.kinetic.max()) + scene.body.mass * abs(scene.gravity) * lever
        change = np.abs(self.energy - (kinetic + potential)).max()
        return float(change / size) if change else 0.0

    @cached_property
    def error(self) -> float:
        """The largest attitude error of the states [rad]: as solve estimated it where it was given
        an error; else as a second run tells, computed when first asked for: the closed form where
        it holds to the bit and is far nearer than that, or the Taylor series with 20 digits (30 for
        a path of 20). Of a path of 30 it is a guess: how far 20 go astray, less as much as their
        tolerance is wider, or what the roundings of 30 digits come to where this is more."""
        if self._choice or not len(self):
            return self._choice.error if self._choice else 0.0
        times = listed(self.t, None, None)
        if not self.digits and self.method != EXACT and closed_form_holds(self.scene):
            error = self._apart(CLOSED_FORM, times)
            known = roundings(self.scene, CLOSED_FORM, times)
            if error >= ROUNDINGS * known:
                return error
        error = self._apart(LONGEST_SERIES if self.digits == 20 else LONGER_SERIES, times)
        if self.digits != 30:
            return error
        return max(error * 2.0**-34, 2.0 * ROUNDING * roundings(self.scene, SERIES, times))

    def _apart(self, second: Request, times: Array) -> float:
        """The largest angle to the attitudes of a second run, low words included: their difference
        loses no digit."""
        other = good(self.scene, second, rows(self.scene, second, times))
        return apart((self.q, self.q_low), (other.q, other.q_low))

    @cached_property
    def plan(self) -> Plan:
        """What was used for this path, and what was left out, and why."""
        step = None if self.step is None else abs(self.step)
        words = step, self.tol, self.digits, 0, self.want, self._asked
        done = Request(methods[self.method], *words)
        return plan_of(self.scene, done, len(self), self._choice)

    def scene_at(self, i: int) -> Scene:
        """The scene that begins, at t = 0, with state i. IndexError if there is none."""
        _, *q = self.states[i, :5]
        return self.scene.replace(attitude=q, momentum=self.m[i])

    @property
    def end(self) -> Scene:
        """The scene that begins, at t = 0, with the last state."""
        return self.scene_at(-1)

    def only(self, want: Iterable[str]) -> Path:
        """The path with no more than t and these quantities, as if solve had been asked for
        them."""
        names = wanted(want) or ()
        columns = {name: np.ascontiguousarray(getattr(self, name)) for name in ("t", *names)}
        return replace(self, states=NO_STATES, _low=None, want=names, _columns=columns)

    def plot(self, axes: Iterable[Axes] | None = None) -> Iterable[Axes]:
        """The trace of the axis and its height over the time, with matplotlib, in two axes or in
        new ones; the axes. ImportError without matplotlib."""
        from .._ground.drawing import trace

        title = f"{self.method}: energy error {self.energy_error:.0e}"
        return trace(self.t, self.apex, title, axes)


def _quantity(quantity: Quantity) -> cached_property[Array]:
    """The attribute of Path for a quantity: computed once, and read-only."""

    def of(path: Path) -> Array:
        return frozen(values(quantity.name, path.scene._block, path.states))

    shape = ", ".join(map(str, ("n", *quantity.shape))) + ("," if not quantity.shape else "")
    unit = f" [{quantity.dimension}]" if quantity.dimension else ""
    of.__doc__ = f"({shape}) {quantity.text}{unit}."
    attribute = cached_property(of)
    attribute.__set_name__(Path, quantity.name)
    return attribute


for _name in [name for name in QUANTITIES if name not in vars(Path)]:
    setattr(Path, _name, _quantity(QUANTITIES[_name]))


@dataclass(frozen=True, eq=False)
class Events:
    """k events in the order in which a path met them.

    path       the states at the events, with all that a path can tell; its t is (k,), in the path's
               order [T]
    which      (k,) the index of each in the list that solve was given
    direction  (k,) 1: the function grew with time, or was smallest; -1: it fell, or was largest
    """

    path: Path
    which: npt.NDArray[np.intc]
    direction: npt.NDArray[np.intc]

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


class _Stopped(BaseException):
    """A run that ended before its time.

    status  its name, as in kreisel.h without the prefix: 'ERR_LIMIT', 'ERR_NOT_FINITE', ...
    path    the states asked for that were reached, and the last good state where that is later
    """

    def __init__(self, message: str, status: str, path: Path) -> None:
        super().__init__(message)
        self.status = status
        self.path = path

    def __reduce__(self) -> tuple[type[_Stopped], tuple[str, str, Path]]:
        return type(self), (str(self), self.status, self.path)


class Error(_Stopped, RuntimeError):
    """A run failed. `.path` holds what was reached, `.status` the reason's name."""

    __module__ = "kreisel"  # a traceback names what users catch


class Interrupted(_Stopped, KeyboardInterrupt):
    """Ctrl-C during a run. `.path` holds what was reached."""

    __module__ = "kreisel"


def stopped(status: str, path: Path, where: str) -> BaseException:
    """What the status of a run stands for: a failure with its path, or bad input."""
    kinds: dict[str, type[_Stopped]] = {"FAILURE": Error, "INTERRUPT": Interrupted}
    what, text = statuses[status]
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


def kept(path: Path, want: tuple[str, ...] | None, end: float) -> Path:
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
