"""Unit quaternions (w, x, y, z) that rotate vectors from the body frame to the space frame.

If v contains the components of a vector along the axes of the body, then v_space = q v q* contains
the components of the same vector along the axes of space.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ._core import INPUT_RTOL
from ._core import attitude_error as error_of_rows
from ._utils.arguments import Array, Quaternion, R, as_finite_array, as_float_list, short_repr

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = [
    "attitude_error",
    "conjugate",
    "conventions",
    "from_rotation",
    "multiply",
    "turn",
    "turn_back",
]


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)


def multiply(a: tuple[R, R, R, R], b: tuple[R, R, R, R]) -> tuple[R, R, R, R]:
    """Return the product of two quaternions, that is, the rotation b followed by the rotation a."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def conjugate(q: tuple[R, R, R, R]) -> tuple[R, R, R, R]:
    """Return the conjugate quaternion, which represents the inverse rotation."""
    w, x, y, z = q
    return w, -x, -y, -z


def _cross(a: tuple[R, R, R], b: tuple[R, R, R]) -> tuple[R, R, R]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def turn(q: tuple[R, R, R, R], v: tuple[R, R, R]) -> tuple[R, R, R]:
    """Return q v q*, the space-frame components of the vector with body-frame components `v`."""
    w, ux, uy, uz = q
    x, y, z = v
    c = _cross((ux, uy, uz), (x, y, z))
    d = _cross((ux, uy, uz), c)
    return (
        x + 2.0 * (w * c[0] + d[0]),
        y + 2.0 * (w * c[1] + d[1]),
        z + 2.0 * (w * c[2] + d[2]),
    )


def turn_back(q: tuple[R, R, R, R], v: tuple[R, R, R]) -> tuple[R, R, R]:
    """Return q* v q, the body-frame components of the vector with space-frame components `v`."""
    return turn(conjugate(q), v)


def from_xyzw(name: str, value: object) -> Quaternion:
    """Return a quaternion (w, x, y, z), given four numbers in the order x, y, z, w."""
    x, y, z, w = as_float_list(name, value, 4, "4 numbers (x, y, z, w)")
    return w, x, y, z


def from_rotation(rotation: Rotation) -> Quaternion:
    """Return the attitude (w, x, y, z) of a single scipy.spatial.transform.Rotation.

    Raises TypeError for an object that lacks the method as_quat, and ValueError for an object with
    several rotations.
    """
    if not hasattr(rotation, "as_quat"):
        raise TypeError("rotation must be a scipy.spatial.transform.Rotation, which has as_quat")
    numbers = rotation.as_quat()
    if np.ndim(numbers) != 1:
        raise ValueError(
            f"rotation must be a single rotation, not an array of shape {numbers.shape[:-1]}"
        )
    return from_xyzw("rotation", numbers)


def unit(name: str, given: object, last: bool = False) -> Quaternion:
    """Return a unit quaternion (w, x, y, z), given four numbers or a single SciPy Rotation.

    If `last` is True, the given numbers have the order (x, y, z, w). The squared norm of the
    quaternion may deviate from 1 by at most 1e-12. A single-precision quaternion is normalized,
    because it deviates from unit norm by rounding errors. Raises TypeError or ValueError if the
    input is invalid.
    """
    if hasattr(given, "as_quat") and not last:
        return from_rotation(given)
    if last:
        q = from_xyzw(name, given)
    else:
        is_matrix = getattr(given, "shape", None) == (3, 3) or (
            isinstance(given, list) and len(given) == 3 and isinstance(given[0], list)
        )
        advice = ": SciPy's Rotation.from_matrix(...) is accepted" if is_matrix else ""
        w, x, y, z = as_float_list(name, given, 4, f"4 numbers (w, x, y, z){advice}")
        q = w, x, y, z
    norm = math.hypot(*q)
    if abs(sum(c * c for c in q) - 1.0) <= INPUT_RTOL:
        return q
    dtype = np.asarray(given).dtype
    if dtype.kind == "f" and dtype.itemsize < 8 and abs(norm - 1.0) <= 4.0 * np.finfo(dtype).eps:
        return q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm
    hint = "divide by it" if norm else "upright is (1, 0, 0, 0)"
    raise ValueError(
        f"the {name} must be a unit quaternion; the norm of {short_repr(given)} is {norm!r}: {hint}"
    )


class HasAttitudes(Protocol):
    """A path."""

    @property
    def q(self) -> Array: ...


def attitude_error(a: ArrayLike | HasAttitudes, b: ArrayLike | HasAttitudes) -> Array:
    """Return the angle [rad], between 0 and pi, of the rotation between two attitudes.

    `a` and `b` are a kreisel.Path, or quaternions of the shape (..., 4), scalar first, and are
    broadcast against each other. The shape of the result is the broadcast shape of `a` and `b`
    without its last dimension. The formula 2 atan2(|v|, |w|) for the quaternion a* b = (w, v) is
    accurate even for small angles.
    The angle between q and -q is 0, because both represent the same attitude.

        >>> import kreisel as kr
        >>> round(float(kr.attitude_error((1, 0, 0, 0), (0.6, 0, 0.8, 0))), 12)
        1.854590436003
    """
    p, q = (
        as_finite_array(name, getattr(value, "q", value), "of shape (..., 4)")
        for name, value in (("a", a), ("b", b))
    )
    if p.shape[-1:] != (4,) or q.shape[-1:] != (4,):
        raise ValueError(f"attitudes must be of shape (..., 4), not {p.shape} and {q.shape}")
    shape = np.broadcast_shapes(p.shape, q.shape)
    flat_p, flat_q = (np.broadcast_to(x, shape).reshape(-1, 4) for x in (p, q))
    return error_of_rows(flat_p, flat_q).reshape(shape[:-1])[()]


def conventions() -> str:
    """Return a text that explains the conventions for frames, components and units."""
    quarter = (0.5**0.5, 0.0, 0.0, 0.5**0.5)
    vector = tuple(round(c, 12) + 0.0 for c in turn(quarter, (1.0, 0.0, 0.0)))
    return (
        "attitude  q = (w, x, y, z), scalar first, unit; from the frame in which the body was "
        "described into space:\n"
        "          v_space = q v q*, so that (0.7071, 0, 0, 0.7071) turns (1, 0, 0) into "
        f"{vector}\n"
        "momentum  angular momentum about the fixed point, seen from space\n"
        "velocity  angular velocity, seen from space: dq/dt = velocity q / 2\n"
        "gravity   along -e3 where positive\n"
        "units     any consistent set; angles in radians"
    )
