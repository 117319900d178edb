"""Scenes: a body, gravity, and the state at the start, t = 0."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from .._core import KIND_RTOL, scene_check
from .._ground.arguments import Array, Quaternion, Vector, number, row, vector
from .._ground.refusals import refusal
from ..quaternion import from_xyzw, multiply, turn, turn_back
from .body import Body, body_of
from .toml import lines, made, read, tables


@dataclass(frozen=True, init=False)
class Scene:
    """A body, gravity, and the state at t = 0.

    momentum  angular momentum about the fixed point, in space [M L^2 T^-1]. In its place, exactly
              one of: velocity (angular velocity in space [T^-1]), or body_momentum, body_velocity
              (seen from the frame in which the body was described)
    attitude  unit quaternion (w, x, y, z), scalar first, from that frame into space; or
              attitude_xyzw, scalar last
    gravity   acceleration along -e3, of either sign [L T^-2]

    It keeps momentum and attitude, whatever it was made from. Raises TypeError for what is not a
    number, ValueError for what is not finite, of the wrong shape, or no unit quaternion (its
    squared norm may be off by 1e-12).
    """

    body: Body
    momentum: Vector
    attitude: Quaternion
    gravity: float
    # kr_scene: body, gravity, t, q, m
    _block: tuple[float, ...] = field(init=False, repr=False, compare=False)

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
    ) -> None:
        if not isinstance(body, Body):
            raise TypeError(f"body must be a kreisel.Body, not {body!r}")
        g = number("gravity", gravity)
        q = _attitude(attitude, attitude_xyzw)
        if not abs(sum(c * c for c in q) - 1.0) <= KIND_RTOL:
            norm = math.hypot(*q)
            raise ValueError(
                f"the attitude must be a unit quaternion; the norm of {q} is {norm!r}: divide by it"
            )
        in_space = {"momentum": momentum, "velocity": velocity}
        in_body = {"body_momentum": body_momentum, "body_velocity": body_velocity}
        m = _momentum(
            body,
            q,
            {word: value for word, value in (in_space | in_body).items() if value is not None},
        )
        block = (*body._block, g, 0.0, *q, *m)
        status = scene_check(block)
        if status != "OK":
            raise refusal(status, f"momentum {m}, attitude {q}, gravity {g!r}")
        kept = self.__dict__
        kept["body"], kept["momentum"], kept["attitude"], kept["gravity"] = body, m, q, g
        kept["_block"] = block

    @cached_property
    def _fastest(self) -> float:
        """About how fast the top can turn: by its momentum, or as a pendulum [T^-1]."""
        largest = max(self.body.moments)
        torque = self.body.mass * abs(self.gravity) * math.hypot(*self.body.com)
        return max(math.hypot(*self.momentum) / largest, math.sqrt(torque / largest))

    @cached_property
    def _start(self) -> Array:
        """(1, 8) the state at t = 0: t, q, m."""
        return np.array([(0.0, *self.attitude, *self.momentum)])

    @property
    def attitude_xyzw(self) -> Quaternion:
        """The attitude with the scalar last."""
        w, x, y, z = self.attitude
        return x, y, z, w

    def replace(self, **changes: object) -> Self:
        """This scene but for what is named, in the words of the constructor."""
        words: dict[str, object] = {
            "body": self.body,
            "momentum": self.momentum,
            "attitude": self.attitude,
            "gravity": self.gravity,
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
        start = {"momentum": self.momentum, "attitude": self.attitude, "gravity": self.gravity}
        text = lines(start) + "\n[body]\n"
        text += lines({"mass": body.mass, "inertia": body.inertia, "com": body.com})
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text


def parse(text: str) -> Scene:
    """The scene in a text of TOML."""
    table = tables(text)
    if "body" not in table:
        raise ValueError("the table [body] is missing")
    return made(Scene, "a scene", {**table, "body": body_of(table["body"])})


def _attitude(wxyz: ArrayLike | None, xyzw: ArrayLike | None) -> Quaternion:
    if xyzw is None:
        given = (1.0, 0.0, 0.0, 0.0) if wxyz is None else wxyz
        w, x, y, z = row("attitude", given, 4, "4 numbers (w, x, y, z)")
        return w, x, y, z
    if wxyz is not None:
        raise ValueError("give either attitude or attitude_xyzw, not both")
    return from_xyzw("attitude_xyzw", xyzw)


def _momentum(body: Body, q: Quaternion, given: dict[str, ArrayLike]) -> Vector:
    """The momentum in space, of the one thing that was given."""
    if len(given) != 1:
        raise ValueError(
            "give exactly one of momentum, velocity, body_momentum, body_velocity, not "
            + (" and ".join(given) or "none")
        )
    ((name, value),) = given.items()
    v = vector(name, value)
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
