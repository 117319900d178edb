"""Scenes: a body, gravity, and the state at the start, t = 0."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from .._core import KIND_RTOL, scene
from .._ground.arguments import Array, Quaternion, Vector, instance, number, row, vector
from .._ground.files import write
from .._ground.refusals import refusal
from ..quaternion import from_xyzw, multiply, turn, turn_back
from .body import Body, body_of
from .toml import lines, made, read, tables

_COUNTABLE = 2.0**53  # whole radians are told apart up to here


class _Changes(TypedDict, total=False):
    """The words of Scene."""

    body: Body
    momentum: ArrayLike
    velocity: ArrayLike
    body_momentum: ArrayLike
    body_velocity: ArrayLike
    attitude: ArrayLike
    attitude_xyzw: ArrayLike
    gravity: float
    damping: ArrayLike | None


@dataclass(frozen=True, init=False)
class Scene:
    """A body, gravity, what damps it, and the state at t = 0.

    momentum  angular momentum about the fixed point, in space [M L^2 T^-1]. In its place, exactly
              one of: velocity (angular velocity in space [T^-1]), or body_momentum, body_velocity
              (seen from the frame in which the body was described)
    attitude  unit quaternion (w, x, y, z), scalar first, from that frame into space; or
              attitude_xyzw, scalar last
    gravity   acceleration along -e3, of either sign [L T^-2]
    damping   of a linear drag: the torque is -damping times the angular velocity, axis by axis
              along the principal axes, or one number for all three [M L^2 T^-1]

    It keeps momentum and attitude, whatever it was made from. Raises TypeError for what is not a
    number, ValueError for what is not finite, of the wrong shape, or no unit quaternion (its
    squared norm may be off by 1e-12).
    """

    body: Body
    momentum: Vector
    attitude: Quaternion
    gravity: float
    damping: Vector
    # kr_scene: body, gravity, t, q, m, damping
    _block: bytes = field(init=False, repr=False, compare=False)

    def __init__(
        self,
        body: Body,
        momentum: ArrayLike | None = None,
        attitude: ArrayLike | None = None,
        gravity: float = 1.0,
        *,
        velocity: ArrayLike | None = None,
        body_momentum: ArrayLike | None = None,
        body_velocity: ArrayLike | None = None,
        attitude_xyzw: ArrayLike | None = None,
        damping: ArrayLike | None = None,
    ) -> None:
        instance("body", body, Body)
        words = {
            "momentum": momentum,
            "velocity": velocity,
            "body_momentum": body_momentum,
            "body_velocity": body_velocity,
        }
        given = {word: value for word, value in words.items() if value is not None}
        made = None if attitude_xyzw is not None else _made(body, given, attitude, gravity, damping)
        if made is None:
            made = _looked_at(body, given, attitude, attitude_xyzw, gravity, damping)
        kept = self.__dict__
        kept["body"] = body
        kept["momentum"], kept["attitude"], kept["gravity"], kept["damping"], kept["_block"] = made

    @property
    def _is_damped(self) -> bool:
        return any(self.damping)

    @cached_property
    def _fastest(self) -> float:
        """About how fast the top can turn: by its momentum, or as a pendulum [T^-1]."""
        largest = max(self.body.moments)
        torque = self.body.mass * abs(self.gravity) * math.hypot(*self.body.com)
        return max(math.hypot(*self.momentum) / largest, math.sqrt(torque / largest))

    @cached_property
    def _within(self) -> float:
        """Before this time the top certainly turns less often than a double can tell [T]."""
        return 0.5 * _COUNTABLE / self._fastest if self._fastest > 0.0 else math.inf

    @cached_property
    def _start(self) -> Array:
        """(1, 8) the state at t = 0: t, q, m."""
        return np.array([(0.0, *self.attitude, *self.momentum)])

    @property
    def attitude_xyzw(self) -> Quaternion:
        """The attitude with the scalar last."""
        w, x, y, z = self.attitude
        return x, y, z, w

    def replace(self, **changes: Unpack[_Changes]) -> Self:
        """This scene but for what is named, in the words of the constructor."""
        words: dict[str, object] = {
            "body": self.body,
            "momentum": self.momentum,
            "attitude": self.attitude,
            "gravity": self.gravity,
            "damping": self.damping,
        }
        if changes.keys() & {"velocity", "body_momentum", "body_velocity"}:
            del words["momentum"]
        if "attitude_xyzw" in changes:
            del words["attitude"]
        make: Callable[..., Self] = type(self)  # which checks what the words are
        return make(**{**words, **changes})

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Scene:
        """The scene in a TOML file, whose keys are the words of the constructors; ValueError for
        other keys."""
        return read(path, parse)

    def to_toml(self, path: str | os.PathLike[str] | None = None) -> str:
        """The scene as TOML, written to a file if one is named. Reading it gives equal doubles."""
        body = self.body
        start: dict[str, object] = {
            "momentum": self.momentum,
            "attitude": self.attitude,
            "gravity": self.gravity,
        }
        if self._is_damped:
            start["damping"] = self.damping
        text = lines(start) + "\n[body]\n"
        text += lines({"mass": body.mass, "inertia": body.inertia, "com": body.com})
        if path is not None:
            write(path, text.encode())
        return text


def parse(text: str) -> Scene:
    """The scene in a text of TOML."""
    table = tables(text)
    if "body" not in table:
        raise ValueError("the table [body] is missing")
    return made(Scene, "a scene", {**table, "body": body_of(table["body"])})


# momentum, attitude, gravity, damping, and the block
_Made = tuple[Vector, Quaternion, float, Vector, bytes]


def _made(
    body: Body,
    given: dict[str, ArrayLike],
    attitude: ArrayLike | None,
    gravity: float,
    damping: ArrayLike | None,
) -> _Made | None:
    """What a scene keeps beside its body; None where the words are other than plain numbers or have
    to be refused."""
    if len(given) != 1:
        return None
    ((name, value),) = given.items()
    made = scene(body._block, value, attitude, gravity, damping)
    if isinstance(made, tuple) and name != "momentum":
        v, q, g, d, _ = made
        made = scene(body._block, _momentum(body, q, name, v), q, g, d)
    return made if isinstance(made, tuple) else None


def _looked_at(
    body: Body,
    given: dict[str, ArrayLike],
    attitude: ArrayLike | None,
    attitude_xyzw: ArrayLike | None,
    gravity: float,
    damping: ArrayLike | None,
) -> _Made:
    """What a scene keeps beside its body, of words that are looked at one by one."""
    g = number("gravity", gravity)
    q = _attitude(attitude, attitude_xyzw)
    if not abs(sum(c * c for c in q) - 1.0) <= KIND_RTOL:
        norm = math.hypot(*q)
        raise ValueError(
            f"the attitude must be a unit quaternion; the norm of {q} is {norm!r}: divide by it"
        )
    if len(given) != 1:
        raise ValueError(
            "give exactly one of momentum, velocity, body_momentum, body_velocity, not "
            + (" and ".join(given) or "none")
        )
    ((name, value),) = given.items()
    m, d = _momentum(body, q, name, vector(name, value)), _damping(damping)
    made = scene(body._block, m, q, g, d)
    if not isinstance(made, tuple):
        raise refusal(made or "ERR_ARGUMENT", f"momentum {m}, attitude {q}, gravity {g!r}")
    return made


def _damping(given: ArrayLike | None) -> Vector:
    if given is None:
        return 0.0, 0.0, 0.0
    along = (number("damping", given),) * 3 if np.ndim(given) == 0 else vector("damping", given)
    if min(along) < 0.0:
        raise ValueError(f"damping must not be negative, not {given!r}: it takes energy out")
    return along


def _attitude(wxyz: ArrayLike | None, xyzw: ArrayLike | None) -> Quaternion:
    if xyzw is None:
        given = (1.0, 0.0, 0.0, 0.0) if wxyz is None else wxyz
        w, x, y, z = row("attitude", given, 4, "4 numbers (w, x, y, z)")
        return w, x, y, z
    if wxyz is not None:
        raise ValueError("give either attitude or attitude_xyzw, not both")
    return from_xyzw("attitude_xyzw", xyzw)


def _momentum(body: Body, q: Quaternion, name: str, v: Vector) -> Vector:
    """The momentum in space, of the word in which it was given."""
    if name == "momentum":
        return v
    if name == "body_momentum":
        return turn(q, v)
    if name == "body_velocity":
        v = turn(q, v)
    principal = multiply(q, body.axes)
    x, y, z = turn_back(principal, v)
    i1, i2, i3 = body.moments
    return turn(principal, (i1 * x, i2 * y, i3 * z))
