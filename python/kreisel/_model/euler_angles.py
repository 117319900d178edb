"""Euler angles and steady precession, for single tops and for ensembles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .._core import KIND_RTOL, cosine, sine, values
from .._utils.validation import (
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
from .broadcasting import BatchParameter
from .environment import PhysicalEnvironment

if TYPE_CHECKING:
    from .bodies import Bodies
    from .body import Body


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
    total, apart = 0.5 * precession + 0.5 * spin, 0.5 * precession - 0.5 * spin
    return c * cos(total), s * cos(apart), s * sin(apart), c * sin(total)


def attitude_from_euler(unturned: bytes, start: Array, angles: Vector) -> Quaternion:
    """Compute the attitude of a body from its Euler angles.

    The Euler angles describe a body-fixed frame whose third axis is the apex. `unturned` is the C
    struct of a scene with the unrotated body, and `start` is its initial state.
    """
    names = ("precession_angle", "nutation", "spin_angle")
    own = [float(values(name, unturned, start)[0]) for name in names]
    return multiply(
        quaternion_from_euler(angles), conjugate(quaternion_from_euler((own[0], own[1], own[2])))
    )


def velocity_from_euler(angles: tuple[R, R, R], rates: tuple[R, R, R]) -> tuple[R, R, R]:
    """Return the angular velocity in the space frame, given the Euler angles and their rates."""
    precession, nutation, _ = angles
    turning, nodding, spinning = rates
    c, s = cos(precession), sin(precession)
    across, up = spinning * sin(nutation), spinning * cos(nutation)
    return nodding * c + across * s, nodding * s - across * c, turning + up


def validate_tilt_angle(tilt: object, degrees: bool) -> float:
    """Validate the angle `tilt` to the vertical, and return it in radians.

    Raises ValueError if the angle is outside [0, pi].
    """
    given = as_float("tilt", tilt)
    angle = math.radians(given) if degrees else given
    if not 0.0 <= angle <= math.pi:
        most = "180" if degrees else "pi, or up to 180 with degrees=True"
        raise ValueError(f"tilt must lie between 0 and {most}, not {short_repr(tilt)}")
    return angle


def is_steady_precession_requested(
    steady: object, fast: object, precession: object, environment: PhysicalEnvironment
) -> bool:
    """Return True if a steady precession is requested.

    Raises TypeError or ValueError if another argument is incompatible with steady precession.
    """
    if as_bool("fast", fast) and not steady:
        raise ValueError("fast chooses between two steady precessions: also pass steady=True")
    if not as_bool("steady", steady):
        return False
    others = {"precession": precession is not None}
    for name, given in environment._asdict().items():
        if name != "gravity":
            values = given.values if isinstance(given, BatchParameter) else given
            others[name] = values is not None and bool(np.any(np.asarray(values)))
    if any(others.values()):
        said = " or ".join(name for name, is_given in others.items() if is_given)
        raise ValueError(f"steady=True cannot be combined with {said}")
    return True


def refuse_rotor_in_steady_precession(body: Body | Bodies) -> None:
    """Raise ValueError for a body with a rotor, because steady=True does not support rotors."""
    if np.any(body.rotor):
        raise ValueError("steady=True does not support bodies with rotors")


def find_symmetry_moments(body: Body) -> tuple[float, float]:
    """Return the transverse and axial moments of inertia of a symmetric body.

    Raises ValueError for a body that is not symmetric about its apex.
    """
    moments, com = body.moments, body.principal_com
    reach = max(map(abs, com))
    along = [abs(x) > KIND_RTOL * reach for x in com] if reach else [False, False, True]
    within = KIND_RTOL * max(moments)
    if max(moments) - min(moments) <= within:
        return moments[2], moments[2]
    if sum(along) == 1:
        k = along.index(True)
        i, j = moments[k - 1], moments[k - 2]
        if abs(i - j) <= within:
            return 0.5 * (i + j), moments[k]
    raise ValueError(
        "spinning needs a symmetric body whose centre of mass lies on its axis (without gravity: "
        f"whose axis is the third): moments {moments}, com {com} in principal axes are not"
    )


def compute_steady_precession_rate(
    across: float,
    along: float,
    torque: float,
    spin: float,
    tilt: float,
    fast: bool,
    degrees: bool,
) -> float:
    """Return the rate W of steady precession.

    W solves I1 cos(tilt) W^2 - I3 spin W + m g l = 0 (Goldstein, Classical Mechanics, 5.7). Here I1
    and I3 are the transverse and axial moments of inertia, and m g l is the largest torque of
    gravity. The larger root of this quadratic equation is computed without cancellation, and the
    smaller one from the product of the roots. Raises ValueError, with the least possible spin in
    the message, if no steady precession exists.
    """
    if abs(math.sin(tilt)) < 1e-15:
        return 0.0
    cosine = math.cos(tilt)
    a, b = across * cosine if abs(cosine) > 1e-15 else 0.0, along * spin
    root = 2.0 * math.sqrt(abs(a)) * math.sqrt(abs(torque))
    if a * torque <= 0.0:
        root = float(np.hypot(b, root))
    elif abs(b) < root * (1.0 - 1e-12):
        given, least = (math.degrees(x) if degrees else x for x in (spin, root / along))
        raise ValueError(
            f"there is no steady precession at this tilt with spin = {given!r}: the smallest "
            f"spin with one is {least!r}"
        )
    else:
        root = math.sqrt(max(abs(b) - root, 0.0)) * math.sqrt(abs(b) + root)
    larger = 0.5 * math.copysign(abs(b) + root, b)
    if fast and a == 0.0:
        raise ValueError("a horizontal axis has only one steady precession: leave out fast")
    if larger == 0.0 and torque != 0.0:
        raise ValueError("a horizontal axis without spin falls: there is no steady precession")
    if fast:
        return larger / a
    return torque / larger if larger else 0.0
