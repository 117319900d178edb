"""What a path holds: its states, or in their place the quantities that were wanted of them."""
from __future__ import annotations

import difflib
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .check import Array
from .how import WIDTHS
from .scene import Scene

if TYPE_CHECKING:
    from .events import Events
    from .plan import Choice

NO_STATES = np.empty((0, 8))
_PARTS = {"t": slice(0, 1), "q": slice(1, 5), "m": slice(5, 8)}


class Stats(NamedTuple):
    """What a run cost: steps, rejected ones, evaluations of the right-hand side or torque, iterations of a solver."""

    steps: int
    rejected: int
    evaluations: int
    iterations: int


@dataclass(frozen=True, eq=False, repr=False)
class States:
    """n states of a scene, or in their place what is wanted of them; the fields are those of Path."""

    scene: Scene
    states: Array               # (n, 8): t [T], q (w, x, y, z), m [M L^2 T^-1]; not there where _columns are
    method: str
    step: float | None
    tol: float | None
    stats: Stats
    _choice: Choice | None = None   # of method="geometric"
    digits: int | None = None
    _low: Array | None = None       # what the doubles of the states leave out
    want: tuple[str, ...] | None = None
    _columns: dict[str, Array] = field(default_factory=dict)    # in place of states: t, and what is wanted
    _asked: str = ""                # the method in the user's words
    events: Events | None = None

    def __post_init__(self) -> None:
        self.states.flags.writeable = False
        if self._low is not None:
            self._low.flags.writeable = False
        if self._columns:
            for name, values in self._columns.items():
                values.flags.writeable = False
                if name not in _PARTS:
                    vars(self)[name] = values
            del vars(self)["states"]

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        words = {"step": self.step, "tol": self.tol, "digits": self.digits}
        steering = "".join(f", {k}={v!r}" for k, v in words.items() if v is not None)
        span = f", t = {self.t[0]:g} .. {self.t[-1]:g}" if len(self) else ""
        return f"<kreisel.Path: {len(self)} states{span}; {self.method}{steering}, {self.stats.steps} steps>"

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(name)
        if self.want is not None and (name == "states" or hasattr(type(self), name)):
            more = f"add {name!r} to want" if name in WIDTHS else "solve without want"
            raise AttributeError(f"this path has no {name!r}: it keeps what want={self.want!r} asked for; {more}")
        known = [word for word in (*self.__dataclass_fields__, *dir(type(self))) if not word.startswith("_")]
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {near[0]!r}?" if near else "there are " + ", ".join(known)
        raise AttributeError(f"a path has no {name!r}; {hint}")

    def _part(self, name: str) -> Array:
        if name in self._columns:
            return self._columns[name]
        part = self.states[:, _PARTS[name]]
        return part[:, 0] if name == "t" else part

    @property
    def t(self) -> Array:
        """(n,) times [T]."""
        return self._part("t")

    @property
    def q(self) -> Array:
        """(n, 4) unit quaternions (w, x, y, z), scalar first, from the frame in which the body was described to space."""
        return self._part("q")

    @property
    def q_xyzw(self) -> Array:
        """(n, 4) attitudes with the scalar last."""
        return self.q[:, [1, 2, 3, 0]]

    @property
    def m(self) -> Array:
        """(n, 3) angular momentum about the fixed point [M L^2 T^-1]."""
        return self._part("m")

    @property
    def q_low(self) -> Array:
        """(n, 4) what the doubles of q leave out: q + q_low has as many digits as were asked for; zero up to 16 digits."""
        return self._columns["q_low"] if "q_low" in self._columns else self._rest[:, 1:5]

    @property
    def m_low(self) -> Array:
        """(n, 3) the same for m [M L^2 T^-1]."""
        return self._columns["m_low"] if "m_low" in self._columns else self._rest[:, 5:8]

    @cached_property
    def _rest(self) -> Array:
        return frozen(np.zeros_like(self.states)) if self._low is None else self._low

    def scene_at(self, i: int) -> Scene:
        """The scene that begins, at t = 0, with state i. IndexError if there is none."""
        _, *q = self.states[i, :5]
        return self.scene.replace(attitude=q, momentum=self.m[i])

    @property
    def end(self) -> Scene:
        """The scene that begins, at t = 0, with the last state."""
        return self.scene_at(-1)


def frozen(values: Array) -> Array:
    values.flags.writeable = False
    return values
