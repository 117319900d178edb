"""Scenes: a body, gravity, and the state at the start, t = 0."""
from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

from . import _core, check, errors, quaternion
from .body import Body
from .check import Quaternion, Vector, VectorLike


@dataclass(frozen=True, init=False)
class Scene:
    """A body, gravity, and the state at t = 0.

    momentum  angular momentum about the fixed point, in space [M L^2 T^-1]. In its place, exactly one of: velocity
              (angular velocity in space [T^-1]), body_momentum, body_velocity (the same seen from the frame in which
              the body was described)
    attitude  unit quaternion (w, x, y, z), scalar first, from that frame into space; or attitude_xyzw, scalar last
    gravity   acceleration along -e3, of either sign [L T^-2]

    Kept as momentum and attitude, whatever it was made from. Raises TypeError for what is not a number, ValueError for
    what is not finite, of the wrong shape, or no unit quaternion (its squared norm may be off by 1e-12).
    """

    body: Body
    momentum: Vector
    attitude: Quaternion
    gravity: float
    _block: tuple[float, ...] = field(init=False, repr=False, compare=False)    # kr_scene: body, gravity, t, q, m

    def __init__(
        self,
        body: Body,
        momentum: VectorLike | None = None,
        attitude: VectorLike | None = None,
        gravity: float = 1.0,
        *,
        velocity: VectorLike | None = None,
        body_momentum: VectorLike | None = None,
        body_velocity: VectorLike | None = None,
        attitude_xyzw: VectorLike | None = None,
    ) -> None:
        if not isinstance(body, Body):
            raise TypeError(f"body must be a kreisel.Body, not {body!r}")
        g = check.number("gravity", gravity)
        q = _attitude(attitude, attitude_xyzw)
        if not abs(sum(c * c for c in q) - 1.0) <= _core.KIND_RTOL:
            norm = math.hypot(*q)
            raise ValueError(f"the attitude must be a unit quaternion; the norm of {q} is {norm!r}: divide by it")
        in_space = {"momentum": momentum, "velocity": velocity}
        in_body = {"body_momentum": body_momentum, "body_velocity": body_velocity}
        m = _momentum(body, q, {word: value for word, value in (in_space | in_body).items() if value is not None})
        block = (*body._block, g, 0.0, *q, *m)
        status = _core.scene_check(block)
        if status != "OK":
            raise errors.refusal(status, f"momentum {m}, attitude {q}, gravity {g!r}")
        for name, value in {"body": body, "momentum": m, "attitude": q, "gravity": g, "_block": block}.items():
            object.__setattr__(self, name, value)

    @cached_property
    def _fastest(self) -> float:
        """About how fast the top can turn: by its momentum, or as a pendulum [T^-1]."""
        largest = max(self.body.moments)
        torque = self.body.mass * abs(self.gravity) * math.hypot(*self.body.com)
        return max(math.hypot(*self.momentum) / largest, math.sqrt(torque / largest))

    @property
    def attitude_xyzw(self) -> Quaternion:
        """The attitude with the scalar last."""
        w, x, y, z = self.attitude
        return x, y, z, w

    def replace(self, **changes: Any) -> Self:
        """The same scene but for what is named, in the words of the constructor."""
        words = {"body": self.body, "momentum": self.momentum, "attitude": self.attitude, "gravity": self.gravity}
        if changes.keys() & {"velocity", "body_momentum", "body_velocity"}:
            del words["momentum"]
        if "attitude_xyzw" in changes:
            del words["attitude"]
        return type(self)(**{**words, **changes})

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Scene:
        """The scene in a TOML file, whose keys are the words of the constructors; ValueError for other keys."""
        from . import toml

        return toml.read(path)

    def to_toml(self, path: str | os.PathLike[str] | None = None) -> str:
        """The scene as TOML, written to a file if one is named. Reading it gives the same doubles."""
        from . import toml

        return toml.write(self, path)


def _attitude(wxyz: VectorLike | None, xyzw: VectorLike | None) -> Quaternion:
    if xyzw is None:
        w, x, y, z = check.row("attitude", (1.0, 0.0, 0.0, 0.0) if wxyz is None else wxyz, 4, "4 numbers (w, x, y, z)")
        return w, x, y, z
    if wxyz is not None:
        raise ValueError("give either attitude or attitude_xyzw, not both")
    return quaternion.from_xyzw("attitude_xyzw", xyzw)


def _momentum(body: Body, q: Quaternion, given: dict[str, VectorLike]) -> Vector:
    """The momentum in space, of the one thing that was given."""
    if len(given) != 1:
        raise ValueError(
            "give exactly one of momentum, velocity, body_momentum, body_velocity, not " + (" and ".join(given) or "none")
        )
    (name, value), = given.items()
    v = check.vector(name, value)
    if name == "momentum":
        return v
    if name == "body_momentum":
        return quaternion.turn(q, v)
    if name == "body_velocity":
        v = quaternion.turn(q, v)
    principal = quaternion.multiply(q, body.axes)
    x, y, z = quaternion.turn_back(principal, v)
    i1, i2, i3 = body.moments
    return quaternion.turn(principal, (i1 * x, i2 * y, i3 * z))
