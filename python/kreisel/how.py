"""How a scene is run: the method with what steers it, and what is wanted of the states; checked before anything runs."""
from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from . import _core, check, errors
from .methods import ELSE, Method, fitting
from .scene import Scene

# What a path can be asked for, and how many doubles a state it is; the first turn with the top about the vertical, the
# others do not.
TURNING = {"q": 4, "m": 3, "q_low": 4, "m_low": 3, "velocity": 3, "torque": 3, "frame": 9, "apex": 3}
LEVEL = dict.fromkeys(
    ("nutation", "kinetic", "potential", "energy", "vertical_momentum", "axial_momentum", "kowalewski", "goryachev_chaplygin"), 1
)
WIDTHS = {"t": 1, **TURNING, **LEVEL}

_FIRST_STEP = -0.1      # back in time, for a method that would choose its own: to the core a step of 0 means forward


class How(NamedTuple):
    """step, tol, digits and want as used: None where there is none, or the method's own."""

    scene: Scene
    method: Method
    step: float | None
    tol: float | None
    digits: int | None
    max_steps: int
    want: tuple[str, ...] | None
    asked: str = ""         # the method in the user's words

    @property
    def leave_heading(self) -> bool:
        """Whether the states may be left undetermined up to a turn about the vertical."""
        level = self.want is not None and TURNING.keys().isdisjoint(self.want)
        return level and self.method.headless and (self.digits or 0) <= 16

    @property
    def size(self) -> int:
        """Bytes of a state, its time apart."""
        return 64 if self.want is None else 8 * sum(map(WIDTHS.__getitem__, self.want))

    def signed(self, back: bool) -> float | None:
        return -self.step if back and self.step is not None else self.step

    def steering(self, back: bool) -> tuple[float, float, int, int]:
        """What the core takes."""
        own = _FIRST_STEP if back else 0.0
        step = self.signed(back)
        return own if step is None else step, self.tol or 0.0, self.digits or 0, self.max_steps


def how(
    scene: Any,
    method: Any,
    step: Any = None,
    tol: Any = None,
    digits: Any = None,
    max_steps: Any = 0,
    want: Any = None,
    asked: str = "",
) -> How:
    """Raises TypeError or ValueError for what cannot be."""
    check.kind("scene", scene, Scene)
    chosen = fitting(ELSE if method == "auto" and digits is not None else method, scene)
    steering = _step(chosen, step), _tol(chosen, tol), _digits(chosen, digits, tol)
    return How(scene, chosen, *steering, check.whole("max_steps", max_steps, 0), wanted(want), asked or method)


def wanted(want: Any) -> tuple[str, ...] | None:
    """Names of quantities, each once; None for all."""
    if want is None:
        return None
    if isinstance(want, str) or not isinstance(want, Iterable):
        raise TypeError(f"want must be names of quantities, as in want=('apex', 'energy'), not {want!r}")
    names = tuple(dict.fromkeys(want))
    for name in names:
        if not isinstance(name, str) or name not in WIDTHS:
            raise ValueError(errors.unknown("quantity in want:", str(name), WIDTHS))
    if not names:
        raise ValueError("want names no quantity; leave it out for all of them")
    return tuple(name for name in names if name != "t")


def _step(method: Method, step: Any) -> float | None:
    if step is not None:
        h = check.positive("step", step)
        return None if method.exact else h
    if not method.adaptive:
        raise ValueError(f"the method {method.name!r} has a fixed step: give step, as in step=0.01")
    return None


def _tol(method: Method, tol: Any) -> float | None:
    if tol is None:
        return None
    if not (method.adaptive or method.implicit):
        raise ValueError(f"the method {method.name!r} has no tolerance: its step alone decides, leave tol out")
    accuracy = check.positive("tol", tol)
    if method.adaptive and accuracy >= 1.0:
        raise ValueError(f"tol must be below 1: it is what a step may err by, of what it computes; not {tol!r}")
    return None if method.exact else accuracy


def _digits(method: Method, digits: Any, tol: Any) -> int | None:
    if digits is None:
        return None
    if not method.digits:
        raise ValueError(f"the method {method.name!r} has no digits to choose: that is for method='taylor'")
    if tol is not None:
        raise ValueError("digits and tol exclude each other: either says how accurate to be")
    number = check.whole("digits", digits, 1)
    if number > 30:
        raise ValueError(f"digits must be at most 30, not {digits!r}")
    return 16 if number <= 16 else 20 if number <= 20 else 30


def every(method: Method, number: Any) -> int | None:
    """Each so many steps, for a method that has such."""
    if number is None:
        return None
    if method.adaptive:
        steps = "has none" if method.exact else "chooses its steps"
        raise ValueError(f"every needs a method of fixed step; {method.name} {steps}: give t as a list")
    return check.whole("every", number, 1)


def progress(callback: Any) -> Any:
    """A function to be told the time reached, or none."""
    if callback is not None and not callable(callback):
        raise TypeError(f"progress must be a function that takes the time reached, not {callback!r}")
    return callback
