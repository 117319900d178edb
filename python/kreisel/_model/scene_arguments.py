"""Validation of the arguments of a scene.

Plain numbers are validated by the core. All other arguments are checked one by one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .._core import scene
from .._utils.errors import status_to_exception
from .._utils.validation import Quaternion, Vector, as_float, as_vector, short_repr
from ..quaternion import unit
from .body import Body
from .momentum import angular_momentum

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

# momentum, attitude, gravity, damping, and the bytes of a kr_scene
SceneData = tuple[Vector, Quaternion, float, Vector, bytes]


def parse_fast(
    body: Body,
    given: dict[str, ArrayLike],
    attitude: ArrayLike | Rotation | None,
    gravity: float,
    damping: ArrayLike | None,
) -> SceneData | None:
    """Return the data of a scene, or None if an argument is not a plain number or is invalid."""
    if len(given) != 1:
        return None
    ((name, value),) = given.items()
    made = scene(body._block, value, attitude, gravity, damping)
    if isinstance(made, tuple) and name != "momentum":
        v, q, g, d, _ = made
        made = scene(body._block, _momentum(body, name, q, v), q, g, d)
    return made if isinstance(made, tuple) else None


def parse_checked(
    body: Body,
    given: dict[str, ArrayLike],
    attitude: ArrayLike | Rotation | None,
    attitude_xyzw: ArrayLike | None,
    gravity: float,
    damping: ArrayLike | None,
) -> SceneData:
    """Check the arguments of a scene one by one and return the data of the scene."""
    g = check_gravity(gravity)
    if attitude_xyzw is not None:
        if attitude is not None:
            raise ValueError("give either attitude or attitude_xyzw, not both")
        q = unit("attitude_xyzw", attitude_xyzw, last=True)
    else:
        q = (1.0, 0.0, 0.0, 0.0) if attitude is None else unit("attitude", attitude)
    if len(given) != 1:
        raise ValueError(
            "give exactly one of momentum, velocity, body_momentum, body_velocity, not "
            + (" and ".join(given) or "none")
        )
    ((name, value),) = given.items()
    m, d = _momentum(body, name, q, as_vector(name, value)), check_damping(damping)
    made = scene(body._block, m, q, g, d)
    if not isinstance(made, tuple):
        raise status_to_exception(
            made or "ERR_ARGUMENT", f"momentum {m}, attitude {q}, gravity {g!r}"
        )
    return made


def _momentum(body: Body, name: str, q: Quaternion, value: Vector) -> Vector:
    rotor = None
    if any(body.rotor):
        h1, h2, h3 = body.principal_rotor
        rotor = h1 or -0.0, h2 or -0.0, h3 or -0.0
    return angular_momentum(name, body.moments, body.axes, q, value, rotor)


def check_damping(given: ArrayLike | None) -> Vector:
    if given is None:
        return 0.0, 0.0, 0.0
    along = (
        (as_float("damping", given),) * 3 if np.ndim(given) == 0 else as_vector("damping", given)
    )
    if min(along) < 0.0:
        raise ValueError(
            f"damping must not be negative, not {short_repr(given)}: it removes energy"
        )
    return along


def check_gravity(value: object) -> float:
    try:
        return as_float("gravity", value)
    except TypeError as error:
        raise TypeError(f"{error}: it is the acceleration along -e3, positive is down") from None
