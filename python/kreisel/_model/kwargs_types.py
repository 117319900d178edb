"""Static types of the keyword arguments of Scene.replace and Scene.vary."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

from numpy.typing import ArrayLike

from .bodies import Bodies
from .body import Body

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


class VaryKwargs(TypedDict, total=False):
    """Keyword arguments of Scene.vary."""

    body: Body | Bodies
    mass: ArrayLike
    inertia: ArrayLike
    com: ArrayLike
    rotor: ArrayLike
    momentum: ArrayLike
    velocity: ArrayLike
    body_momentum: ArrayLike
    body_velocity: ArrayLike
    attitude: ArrayLike | Rotation
    attitude_xyzw: ArrayLike
    spin: ArrayLike
    tilt: ArrayLike
    precession: ArrayLike
    angles: ArrayLike
    rates: ArrayLike
    steady: bool
    fast: bool
    degrees: bool
    gravity: ArrayLike
    damping: ArrayLike
    turning: ArrayLike
    shaking: ArrayLike
    friction: ArrayLike


class SceneKwargs(TypedDict, total=False):
    """Keyword arguments of Scene.replace, which are those of the constructor of Scene."""

    body: Body
    momentum: ArrayLike
    velocity: ArrayLike
    body_momentum: ArrayLike
    body_velocity: ArrayLike
    attitude: ArrayLike | Rotation
    attitude_xyzw: ArrayLike
    gravity: float | None
    damping: ArrayLike | None
    turning: ArrayLike | None
    shaking: ArrayLike | None
    friction: float | None
