"""Euler angles and steady precession, for single tops and for ensembles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .._core import KIND_RTOL, cosine, sine, values
from .._utils.arguments import (
    Array,
    Quaternion,
    R,
    Vector,
    as_bool,
    as_float,
    as_three_floats,
    short_repr,
)
from ..quaternion import conjugate, multiply
from .batch import BatchParameter
from .parameters import EnvironmentArguments

BoolArray = npt.NDArray[np.bool_]

if TYPE_CHECKING:
    from .body import Bodies, Body


def convert_vector_to_radians(name: str, value: object, degrees: bool) -> Vector:
    """Convert three angles or rates from degrees to radians if `degrees` is True."""
    x, y, z = as_three_floats(name, value)
    return (math.radians(x), math.radians(y), math.radians(z)) if degrees else (x, y, z)


def cos(x: R) -> R:
    """Return the cosine of a float or an array, with bitwise equal results for both types."""
    return math.cos(x) if isinstance(x, float) else np.asarray(cosine(x))


def sin(x: R) -> R:
    """Return the sine of a float or an array, with bitwise equal results for both types."""
    return math.sin(x) if isinstance(x, float) else np.asarray(sine(x))


def quaternion_from_euler(angles: tuple[R, R, R]) -> tuple[R, R, R, R]:
    """Return the quaternion for the z-x-z Euler angles precession, nutation and spin."""
    precession, nutation, spin = angles
    c, s = cos(0.5 * nutation), sin(0.5 * nutation)
    half_sum, half_difference = 0.5 * precession + 0.5 * spin, 0.5 * precession - 0.5 * spin
    return c * cos(half_sum), s * cos(half_difference), s * sin(half_difference), c * sin(half_sum)


def attitude_from_euler(block: bytes, start: Array, angles: Vector) -> Quaternion:
    """Compute the attitude of a body from its Euler angles.

    The Euler angles describe a body-fixed frame whose third axis is the apex. `block` is the C
    struct of a scene in which the attitude of the body is the identity, and `start` is the initial
    state of this scene.
    """
    names = ("precession_angle", "nutation", "spin_angle")
    frame_angles = [float(values(name, block, start)[0]) for name in names]
    return multiply(
        quaternion_from_euler(angles),
        conjugate(quaternion_from_euler((frame_angles[0], frame_angles[1], frame_angles[2]))),
    )


def velocity_from_euler(angles: tuple[R, R, R], rates: tuple[R, R, R]) -> tuple[R, R, R]:
    """Return the angular velocity in the space frame, given the Euler angles and their rates."""
    precession, nutation, _ = angles
    turning, nodding, spinning = rates
    c, s = cos(precession), sin(precession)
    horizontal, vertical = spinning * sin(nutation), spinning * cos(nutation)
    return nodding * c + horizontal * s, nodding * s - horizontal * c, turning + vertical


def validate_tilt_angle(tilt: object, degrees: bool) -> float:
    """Validate the angle `tilt` to the vertical, and return it in radians.

    Raises ValueError if the angle is outside [0, pi].
    """
    number = as_float("tilt", tilt)
    angle = math.radians(number) if degrees else number
    if not 0.0 <= angle <= math.pi:
        most = "180" if degrees else "pi, or up to 180 with degrees=True"
        raise ValueError(f"tilt must lie between 0 and {most}, not {short_repr(tilt)}")
    return angle


def is_steady_precession_requested(
    steady: object, fast: object, precession: object, environment: EnvironmentArguments
) -> bool:
    """Return True if a steady precession is requested.

    Raises TypeError if `steady` or `fast` is not a bool, and ValueError for incompatible arguments.
    """
    if as_bool("fast", fast) and not steady:
        raise ValueError("fast chooses between two steady precessions: also pass steady=True")
    if not as_bool("steady", steady):
        return False
    others = {"precession": precession is not None}
    for name, value in environment._asdict().items():
        if name != "gravity":
            values = value.values if isinstance(value, BatchParameter) else value
            others[name] = values is not None and bool(np.any(np.asarray(values)))
    if any(others.values()):
        listing = " or ".join(name for name, is_given in others.items() if is_given)
        raise ValueError(f"steady=True cannot be combined with {listing}")
    return True


def refuse_rotor_in_steady_precession(body: Body | Bodies) -> None:
    """Raise ValueError for a body with a rotor, because steady=True does not support rotors."""
    if np.any(body.rotor):
        raise ValueError("steady=True does not support bodies with rotors")


def find_symmetry_moments(moments: Array, com: Array) -> tuple[Array, Array, BoolArray]:
    """Return the transverse and axial moments of inertia of bodies, and a mask of symmetric bodies.

    `moments` and `com` have the shape (..., 3), along the principal axes. The third result marks
    bodies that are symmetric about the line from the fixed point to the centre of mass, or about
    the third axis if these points coincide.
    """
    distances = np.abs(com)
    reach, largest = distances.max(axis=-1), moments.max(axis=-1)
    tolerance = KIND_RTOL * largest
    is_along = np.where(
        reach[..., None] > 0.0, distances > KIND_RTOL * reach[..., None], [False, False, True]
    )
    k = is_along.argmax(axis=-1)[..., None]
    i, j, axial = (np.take_along_axis(moments, (k + d) % 3, -1)[..., 0] for d in (2, 1, 0))
    is_round = largest - moments.min(axis=-1) <= tolerance
    is_symmetric = is_round | ((is_along.sum(axis=-1) == 1) & (np.abs(i - j) <= tolerance))
    third = moments[..., 2]
    i1, i3 = np.where(is_round, third, 0.5 * (i + j)), np.where(is_round, third, axial)
    return i1, i3, is_symmetric


def find_symmetry_moments_of_body(body: Body) -> tuple[float, float]:
    """Return the transverse and axial moments of inertia of a symmetric body.

    Raises ValueError for a body that is not symmetric about its apex.
    """
    i1, i3, is_symmetric = find_symmetry_moments(
        np.array(body.moments), np.array(body.principal_com)
    )
    if not is_symmetric:
        raise ValueError(
            "spinning needs a symmetric body: its axis must be the line from the fixed point to "
            "the centre of mass, or the third axis if these points coincide; this body has moments "
            f"{body.moments} and com {body.principal_com} in principal axes"
        )
    return float(i1), float(i3)


def solve_steady_precession(
    i1: Array, i3: Array, torque: Array, spin: Array, tilt: Array, fast: bool
) -> tuple[Array, BoolArray]:
    """Return the rates W of steady precession, and a mask of the tops for which such a rate exists.

    W solves I1 cos(tilt) W^2 - I3 spin W + m g l = 0 (Goldstein, Classical Mechanics, 5.7). Here I1
    and I3 are the transverse and axial moments of inertia, and m g l is the largest torque of
    gravity. The larger root of this quadratic equation is computed without cancellation, and the
    smaller one from the product of the roots. All arguments except `fast` are arrays that
    broadcast.
    """
    a, b, root = _compute_precession_coefficients(i1, i3, torque, spin, tilt)
    with np.errstate(all="ignore"):
        is_hanging, size = a * torque <= 0.0, np.abs(b)
        root_of_difference = np.sqrt(np.maximum(size - root, 0.0)) * np.sqrt(size + root)
        larger = 0.5 * np.copysign(
            size + np.where(is_hanging, np.hypot(b, root), root_of_difference), b
        )
        rates = larger / a if fast else np.where(larger != 0.0, torque / larger, 0.0)
    is_too_slow = ~is_hanging & _is_spin_too_slow(b, root)
    is_missing = is_too_slow | (larger == 0.0) & (torque != 0.0)
    is_at_pole = np.abs(sin(tilt)) < 1e-15
    exists = is_at_pole | ~(is_missing | (a == 0.0) if fast else is_missing)
    return np.where(is_at_pole, 0.0, rates), exists


def _compute_precession_coefficients(
    i1: Array, i3: Array, torque: Array, spin: Array, tilt: Array
) -> tuple[Array, Array, Array]:
    """Return I1 cos(tilt), I3 spin, and the |I3 spin| at which both precession rates are equal."""
    cosine = cos(tilt)
    with np.errstate(all="ignore"):
        a = np.where(np.abs(cosine) > 1e-15, i1 * cosine, 0.0)
        return a, i3 * spin, 2.0 * np.sqrt(np.abs(a)) * np.sqrt(np.abs(torque))


def _is_spin_too_slow(axial_momentum: Array, least: Array) -> BoolArray:
    is_slow: BoolArray = np.abs(axial_momentum) < least * (1.0 - 1e-12)
    return is_slow


def compute_steady_precession_rate(
    transverse_moment: float,
    axial_moment: float,
    torque: float,
    spin: float,
    tilt: float,
    fast: bool,
    degrees: bool,
) -> float:
    """Return the rate of steady precession of one top.

    Raises ValueError if no steady precession exists. If the spin is too small, the message states
    the least possible spin.
    """
    i1, i3, pull, rate, angle = (
        np.asarray(x) for x in (transverse_moment, axial_moment, torque, spin, tilt)
    )
    precession, exists = solve_steady_precession(i1, i3, pull, rate, angle, fast)
    if exists:
        return float(precession)
    a, b, root = _compute_precession_coefficients(i1, i3, pull, rate, angle)
    if a * torque > 0.0 and _is_spin_too_slow(b, root):
        user_spin, least = (
            math.degrees(x) if degrees else x for x in (spin, float(root) / axial_moment)
        )
        raise ValueError(
            f"there is no steady precession at this tilt with spin = {user_spin!r}: the smallest "
            f"spin with one is {least!r}"
        )
    if fast and a == 0.0:
        raise ValueError("a horizontal axis has only one steady precession: leave out fast")
    raise ValueError("a horizontal axis without spin falls: there is no steady precession")
