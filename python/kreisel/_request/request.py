"""The request: a scene, the method with what steers it, and what is wanted; checked before anything
runs."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache

from .._ground.arguments import instance, positive, shown, whole
from .._ground.names import QuantityName
from .._ground.refusals import unknown
from .._model.scene import Scene
from .methods import ELSE, Method, fitting
from .quantities import TURNING, WANTED, doubles
from .times import COUNTABLE, PIECE

Progress = Callable[[float], object]


@dataclass(frozen=True)
class Request:
    """The checked words of a solve, whatever the scene: step, tol, digits and want as used, None
    where there is none or the method has its own; `asked` is the method in the user's words;
    `watched` says that events are looked for, which may need what is not wanted."""

    method: Method
    step: float | None = None
    tol: float | None = None
    digits: int | None = None
    max_steps: int = 0
    want: tuple[QuantityName, ...] | None = None
    asked: str = ""
    watched: bool = False

    @cached_property
    def core(self) -> tuple[str, float, float, int, int, bool]:
        """Name, step, tol, digits, max_steps, and whether the states may be left undetermined up to
        a turn about the vertical, as the core takes them."""
        level = self.want is not None and TURNING.isdisjoint(self.want)
        leave_heading = level and not self.watched and self.method.headless and not self.low
        own = self.step or 0.0, self.tol or 0.0, self.digits or 0
        return self.method.name, *own, self.max_steps, leave_heading

    @property
    def leave_heading(self) -> bool:
        """Whether the states may be left undetermined up to a turn about the vertical."""
        return self.core[-1]

    @cached_property
    def within(self) -> float:
        """Times below this are certainly of fewer steps than a double can count [T]."""
        return math.inf if self.step is None else 0.5 * COUNTABLE * self.step

    @cached_property
    def limit(self) -> int:
        """How many states are recorded at once: of what is wanted in their place a piece."""
        return sys.maxsize if self.want is None else PIECE

    @property
    def size(self) -> int:
        """Bytes of a state, without those of its time."""
        return 64 if self.want is None else 8 * sum(map(doubles, self.want))

    @property
    def low(self) -> bool:
        """Whether what the doubles of the states leave out is recorded too."""
        return (self.digits or 0) > 16

    def signed(self, back: bool) -> float | None:
        """The step, negative back in time."""
        return -self.step if back and self.step is not None else self.step


def request(
    scene: object,
    method: object,
    step: object = None,
    tol: object = None,
    digits: object = None,
    max_steps: object = 0,
    want: object = None,
    asked: object = None,
) -> Request:
    """The request in these words, for this scene; `asked` is the method in the user's, where that
    is another.

    Raises TypeError or ValueError for what cannot be.
    """
    top = instance("scene", scene, Scene)
    chosen = fitting(ELSE if method == "auto" and digits is not None else method, top)
    words = chosen, step, tol, digits, max_steps, method if asked is None else asked
    if want is None or type(want) is tuple:
        try:
            return _known(*words, want)
        except TypeError:  # a word without a hash, or one that is refused below
            pass
    return steered(*words, want)


def steered(
    method: Method,
    step: object,
    tol: object,
    digits: object,
    max_steps: object,
    asked: object,
    want: object,
) -> Request:
    """The request of a method in these words, whatever the scene."""
    steering = checked_step(method, step), checked_tol(method, tol)
    number, most = checked_digits(method, digits, tol), whole("max_steps", max_steps, 0)
    return Request(method, *steering, number, most, wanted(want), str(asked))


_known = lru_cache(maxsize=256, typed=True)(steered)


def wanted(want: object) -> tuple[QuantityName, ...] | None:
    """Names of quantities, each once; None for all."""
    if want is None:
        return None
    if isinstance(want, str) or not isinstance(want, Iterable):
        raise TypeError(
            f"want must be names of quantities, as in want=('apex', 'energy'), not {shown(want)}"
        )
    given = list(want)
    for name in given:
        if not isinstance(name, str) or (name not in WANTED and name != "t"):
            raise ValueError(unknown("quantity in want:", str(name), ["t", *WANTED]))
    kept = tuple(name for name in dict.fromkeys(given) if name != "t")
    if not kept:
        raise ValueError("want names no quantity beside t; leave it out for all of them")
    return kept


def checked_step(method: Method, step: object) -> float | None:
    """The step, where the method has one."""
    if step is not None:
        h = positive("step", step)
        return None if method.exact else h
    if not method.adaptive:
        raise ValueError(f"the method {method.name!r} has a fixed step: give step, as in step=0.01")
    return None


def checked_tol(method: Method, tol: object) -> float | None:
    """The tolerance, where the method has one."""
    if tol is None:
        return None
    if not (method.adaptive or method.implicit):
        raise ValueError(
            f"the method {method.name!r} has no tolerance: its step alone decides, leave tol out"
        )
    accuracy = positive("tol", tol)
    if accuracy >= 1.0:
        raise ValueError(
            f"tol must be below 1: it is what a step may err by, of what it computes; not {tol!r}"
        )
    return None if method.exact else accuracy


def checked_digits(method: Method, digits: object, tol: object) -> int | None:
    """The digits, rounded up to 16, 20 or 30."""
    if digits is None:
        return None
    if not method.digits:
        raise ValueError(
            f"the method {method.name!r} has no digits to choose: that is for method='taylor'"
        )
    if tol is not None:
        raise ValueError("digits and tol exclude each other: either says how accurate to be")
    asked = whole("digits", digits, 1)
    if asked > 30:
        raise ValueError(f"digits must be at most 30, not {digits!r}")
    return 16 if asked <= 16 else 20 if asked <= 20 else 30


def checked_every(method: Method, every: object) -> int | None:
    """Each so many steps, for a method that has such."""
    if every is None:
        return None
    if method.adaptive:
        steps = "has none" if method.exact else "chooses its steps"
        raise ValueError(
            f"every needs a method of fixed step; {method.name} {steps}: give t as a list"
        )
    return whole("every", every, 1)


def checked_progress(progress: Progress | None) -> Progress | None:
    """A function to be told the time reached, or none."""
    if progress is not None and not callable(progress):
        raise TypeError(
            f"progress must be a function that takes the time reached, not {shown(progress)}"
        )
    return progress
