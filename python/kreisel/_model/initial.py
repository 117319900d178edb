"""Starts of tops from velocities, angles and random numbers, for one top or for many."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._core import INPUT_RTOL, KIND_RTOL, cosine, logarithm, sine
from .._core import Tops as CoreTops
from .._utils.arguments import Array, as_bool, as_finite_array, short_repr
from ..quaternion import turn_back, unit
from .batch import broadcast_shapes, stack_components
from .body import Body
from .parameters import (
    STARTS,
    BatchParameter,
    Shape,
    collapse_broadcast_axes,
    get_member,
    read_parameter,
    refuse_first,
)

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
_ROUNDING = 1e-13  # relative, of the terms of f
_LEAST_ANGLE = 1e-8  # rounding error of an angle near 0 from its cosine
_HALVINGS = 64  # of the interval of an angle
_DRAWS = 8  # random numbers per member, whichever parameters are scattered
_ROWS = 1 << 12  # members whose numbers are drawn in one batch


def make_core_tops(body: Body, shape: Shape, columns: Mapping[str, Array]) -> CoreTops:
    """Return tops as the core reads them; missing columns are zero, or upright."""
    start: dict[str, Any] = {"gravity": 0.0, "t": 0.0, "attitude": UPRIGHT}
    start |= dict.fromkeys(("momentum", "damping", "turning", "shaking"), np.zeros(3))
    start |= {"friction": 0.0, **columns}
    names = "mass", "moments", "principal_com", "axes", "inertia_rtol", "principal_rotor"
    own = [body._columns[name] if body.shape else getattr(body, name) for name in names]
    gradient = start.pop("gradient", 0.0)
    parts = [*own, *_list_given(body), *start.values(), _turn_wheels(body), gradient]
    return CoreTops(shape, [np.asarray(values, dtype=np.float64) for values in parts])


def _list_given(body: Body) -> list[Array]:
    """Return inertia, com and rotor as given by matrices that are not diagonal, or zeros."""
    names = "inertia", "com", "rotor"
    given = [np.asarray(body._columns[n] if body.shape else getattr(body, n)) for n in names]
    if given[0].ndim < len(body.shape) + 2:
        return [np.zeros(width) for width in (9, 3, 3)]
    given[0] = given[0].reshape(*given[0].shape[:-2], 9)
    return given


def _turn_wheels(body: Body) -> Array:
    """Return the wheels of bodies as the core reads them, with axes along the principal axes."""
    if not body._has_wheels:
        return np.zeros(12)
    rows = np.asarray(body._columns["wheels"] if body.shape else body.wheels)
    axes = np.asarray(body._columns["axes"] if body.shape else body.axes)
    w, x, y, z = np.moveaxis(axes[..., None, :], -1, 0)
    along = turn_back((w, x, y, z), tuple(np.moveaxis(rows[..., :3], -1, 0)))
    wheels = stack_components(*along, rows[..., 3])
    return wheels.reshape(*wheels.shape[:-2], 12)


def start_wheels(body: Body, momenta: Array, q: Array) -> Body:
    """Return the bodies of tops whose wheels are free from the start on, as gyrostats.

    The rotors of `body` include the momenta of its wheels relative to it, and the inertia their
    moments about the axles. A symmetric body in which only the wheel turns about the axle keeps its
    moment, as its angular velocity about the axle is constant.
    """
    rows = np.array(body.wheels)
    if not rows[..., 4].any():
        return body
    shape = np.broadcast_shapes(body.shape, momenta.shape[:-1], q.shape[:-1])
    tops = make_core_tops(body, shape, {"attitude": q, "momentum": momenta})
    velocity = tops.values("inertial_velocity").reshape(*shape, 3)
    tensor, rotor = body._tensors, np.asarray(body.rotor)
    rows = np.broadcast_to(rows, (*shape, *rows.shape[-2:])).copy()
    for wheel in np.moveaxis(rows, -2, 0):
        axis, inertia = wheel[..., :3], wheel[..., 4].copy()
        about = np.where(inertia > 0.0, (axis * velocity).sum(axis=-1), 0.0)
        moment = np.einsum("...i,...ij,...j->...", axis, tensor, axis)
        is_alone = (inertia > 0.0) & (np.abs(moment - inertia) <= INPUT_RTOL * moment)
        if is_alone.any():
            _refuse_bare_frames(body, tensor, rotor, axis, is_alone)
        left = np.where(is_alone, 0.0, inertia)
        tensor = tensor - np.einsum("...,...i,...j->...ij", left, axis, axis)
        rotor = rotor + (left * about)[..., None] * axis
        wheel[..., :3] = np.where(is_alone[..., None], 0.0, axis)
        wheel[..., 3] += np.where(is_alone, 0.0, about)
        wheel[..., 4] = 0.0
    words = {"com": body.com, "inertia_rtol": body.inertia_rtol, "unphysical": body.unphysical}
    try:
        started = Body(body.mass, tensor, **words, rotor=rotor, wheels=rows)
    except ValueError as error:
        raise ValueError(f"no body contains this wheel: without its moment, {error}") from None
    return started._note_varying_parameters(body._list_varying_parameters())


def _refuse_bare_frames(
    body: Body, tensor: Array, rotor: Array, axis: Array, is_alone: Array
) -> None:
    """Raise ValueError for a body without symmetry about the axle of a wheel that is `is_alone`."""
    upright = np.where(is_alone[..., None], axis, (0.0, 0.0, 1.0))
    words = {"com": body.com, "rotor": upright, "unphysical": True}
    kinds = np.asarray(Body(body.mass, tensor, **words).kind)
    across = np.abs(np.cross(rotor, axis)).max(axis=-1)
    has_no_axis = np.isin(kinds, ("general", "gyrostat"))
    is_lopsided = has_no_axis | (across > KIND_RTOL * np.abs(rotor).max(axis=-1))
    bad = is_alone & is_lopsided
    if bad.any():
        index = list(map(int, np.unravel_index(int(bad.argmax()), bad.shape)))
        raise ValueError(
            f"{f'top{index}: ' if index else ''}nothing but a wheel turns about its axle, and the "
            "body is not symmetric about it: give the frame a moment about the axle"
        )


def call_core(
    compute: Callable[..., Array],
    body: Body,
    q: Array,
    given: Mapping[str, BatchParameter],
    *vectors: Array,
) -> Array:
    """Return rows that the core computes from the vectors, once for tops that share them."""
    turning = given["turning"].radians if "turning" in given else np.zeros(3)
    columns = {"attitude": q, "turning": turning}
    small = [collapse_broadcast_axes(x, x.ndim - 1) for x in (*columns.values(), *vectors)]
    shape = np.broadcast_shapes(body.shape, *[x.shape[:-1] for x in small])
    tops = make_core_tops(body, shape, dict(zip(columns, small, strict=False)))
    rows = [np.broadcast_to(x, (*shape, 3)).reshape(-1, 3) for x in small[2:]]
    result: Array = compute(tops, *rows)
    return result.reshape(*shape, result.shape[-1])


def compute_momenta(
    name: str, body: Body, q: Array, given: Mapping[str, BatchParameter], vectors: Array
) -> Array:
    """Return the momenta in space for velocities or momenta, which `name`, one of STARTS, says."""
    kind = STARTS.index(name)
    return call_core(lambda tops, rows: tops.momenta(kind, rows), body, q, given, vectors)


class EulerState(NamedTuple):
    """The Euler angles and rates of tops, in radians."""

    angles: tuple[Array, Array, Array]  # precession, nutation, spin
    precession: Array  # rate of the precession angle
    nutation: Array  # rate of the nutation angle
    spin: Array  # angular velocity about the apex


def compute_euler_state(tops: CoreTops, shape: Shape) -> EulerState:
    """Return the Euler angles at the start and their rates; rates within rounding error are 0."""
    names = "precession_angle", "nutation", "spin_angle", "spin"
    phi, theta, psi, spin = (tops.values(name).reshape(shape) for name in names)
    x, y, z = (tops.values("velocity")[:, k].reshape(shape) for k in range(3))
    nodding = x * cosine(phi) + y * sine(phi)
    horizontal_rate = x * sine(phi) - y * cosine(phi)
    turning = z * sine(theta) - horizontal_rate * cosine(theta)
    least = 8.0 * np.finfo(float).eps * np.hypot(np.hypot(x, y), z)
    is_upright = np.abs(sine(theta)) < 1e-15
    with np.errstate(invalid="ignore", divide="ignore"):
        rate = np.where(is_upright | (np.abs(turning) <= least), 0.0, turning / sine(theta))
    return EulerState(
        (phi, theta, psi), rate, np.where(np.abs(nodding) > least, nodding, 0.0), spin
    )


def read_tilts(tilts: ArrayLike | BatchParameter, degrees: bool) -> BatchParameter:
    """Return the parameter `tilt`; raise ValueError for angles outside [0, pi]."""
    parameter = read_parameter("tilt", tilts, degrees=degrees)
    bad = ~((parameter.radians >= 0.0) & (parameter.radians <= math.pi))
    if bad.any():
        most = "180" if degrees else "pi, or up to 180 with degrees=True"
        refuse_first("tilt", tilts, bad, f"must lie between 0 and {most}")
    return parameter


def compute_symmetric_moments(body: Body) -> tuple[Array, Array]:
    """Return the moments of inertia of bodies across and along their axis of symmetry.

    Raises ValueError for the first body that is not symmetric about its apex.
    """
    moments = make_core_tops(body, body.shape, {}).symmetric().reshape((*body.shape, 2))
    bad = np.isnan(moments[..., 0])
    if bad.any():
        index = tuple(map(int, np.unravel_index(int(bad.argmax()), body.shape)))
        one = body._select_member(index)
        place = f"body{list(index)}: " if index else ""
        raise ValueError(
            f"{place}this start needs a symmetric body: its axis must be the line from the fixed "
            "point to the centre of mass, or the third axis if these points coincide; this body "
            f"has moments {one.moments} and com {one.principal_com} in principal axes"
        )
    return moments[..., 0], moments[..., 1]


def is_steady_precession_requested(
    steady: object,
    fast: object,
    spin: object,
    precession: object,
    given: Mapping[str, BatchParameter],
) -> bool:
    """Return True if a steady precession is requested; refuse arguments that exclude it."""
    if as_bool("fast", fast) and not steady:
        raise ValueError("fast chooses between two steady precessions: also pass steady=True")
    if not as_bool("steady", steady):
        return False
    if precession is not None and (spin is not None or fast):
        other = "spin" if spin is not None else "fast"
        raise ValueError(f"steady=True takes precession instead of {other}, not both")
    others = [name for name, one in given.items() if name != "gravity" and one.values.any()]
    if others:
        raise ValueError(f"steady=True cannot be combined with {' or '.join(others)}")
    return True


class SymmetricBody(NamedTuple):
    """The numbers of bodies, symmetric about their apex, that determine its nutation."""

    across: Array  # moment of inertia about the axes normal to the apex [M L^2]
    along: Array  # moment of inertia about the apex
    moment: Array  # mass |com| [M L]
    rotor: Array  # momentum of the rotor along the apex [M L^2 T^-1]


def read_symmetric_body(body: Body, name: str) -> SymmetricBody:
    """Return the numbers of symmetric bodies; refuse a rotor that is not along the apex."""
    across, along = compute_symmetric_moments(body)
    com, rotor = np.asarray(body.principal_com), np.asarray(body.principal_rotor)
    length = np.linalg.norm(com, axis=-1)
    with np.errstate(invalid="ignore"):
        apex = np.where(length[..., None] > 0.0, com / length[..., None], np.eye(3)[2])
    of_apex = (rotor * apex).sum(axis=-1)
    if (np.abs(rotor - of_apex[..., None] * apex) > INPUT_RTOL * np.abs(of_apex)[..., None]).any():
        raise ValueError(f"{name} needs a body whose rotor lies along its apex")
    return SymmetricBody(across, along, np.asarray(body.mass) * length, of_apex)


@np.errstate(all="ignore")
def find_turning_point(
    body: Body, given: Mapping[str, BatchParameter], lower: bool
) -> tuple[Array, Array]:
    """Return the tilt at a turning point of the apex, and the angular velocity (..., 3).

    With the energy E, a = <m, e3>, b = <m, apex>, the moments I1 across and I3 along the apex, the
    spin w = (b - rotor) / I3, and x, y the velocities of the apex along and across its meridian,

        (I1 x)^2 = f = A - B cos theta - (I1 y)^2,   I1 y = (a - b cos theta) / sin theta

    with A = 2 I1 (E - I3 w^2 / 2) and B = 2 I1 mass gravity |com|. f sin^2 theta has one maximum as
    a function of cos theta, and f one zero on each side of it, unless a = b or a = -b, when the
    apex may pass the pole. Raises ValueError for the first top for which f is always negative.
    """
    for name in "turning", "shaking", "gradient":
        if name in given and given[name].values.any():
            raise ValueError(f"energy, vertical and axial do not describe a start with {name}")
    if np.asarray(body.wheels)[..., 4].any():
        raise ValueError("energy, vertical and axial do not describe a start with wheels")
    top = read_symmetric_body(body, "a start by energy, vertical and axial")
    names = "energy", "vertical", "axial", "gravity"
    energy, a, b, gravity = np.broadcast_arrays(*(given[name].values for name in names))
    spin = (b - top.rotor) / top.along
    # The lower turning point is the upper one for the opposite direction of the vertical.
    sign = -1.0 if lower else 1.0
    weight, b = sign * 2.0 * top.across * top.moment * gravity, sign * b
    level = 2.0 * top.across * (energy - 0.5 * top.along * spin * spin)
    is_pole = [np.abs(a - side) <= 4.0 * np.finfo(float).eps * np.abs(a) for side in (b, -b)]
    a = np.select(is_pole, (b, -b), a)
    # the root of the derivative of f sin^2 theta by cos theta at which it has its maximum
    half, rest = level + b * b, 2.0 * a * b - weight
    root = half + np.sqrt(np.maximum(half * half - 3.0 * weight * rest, 0.0))
    inside = np.arccos(np.clip(np.where(root != 0.0, rest / root, np.sign(rest)), -1.0, 1.0))
    inside = np.maximum(inside, np.where(is_pole[0], 0.0, _LEAST_ANGLE))
    inside = np.minimum(inside, math.pi - np.where(is_pole[1], 0.0, _LEAST_ANGLE))

    def compute_squares(theta: Array) -> tuple[Array, Array]:
        """Return f and I1 y = ((a - b) cot(theta / 2) + (a + b) tan(theta / 2)) / 2."""
        s, c = np.asarray(sine(0.5 * theta)), np.asarray(cosine(0.5 * theta))
        near, far = (np.where(k != 0.0, k * x, 0.0) for k, x in ((a - b, c / s), (a + b, s / c)))
        across = 0.5 * (near + far)
        return level - weight * (c - s) * (c + s) - across * across, across

    size = 4.0 * top.across * np.abs(energy) + np.abs(level) + np.abs(weight) + a * a
    bad = ~((compute_squares(inside)[0] >= -_ROUNDING * size) & np.isfinite(size))
    if bad.any():
        i = tuple(map(int, np.unravel_index(int(bad.argmax()), bad.shape)))
        place, numbers = f"top{list(i)}: " if i else "", (energy[i], a[i], sign * b[i])
        text = "no motion has energy = {!r} with vertical = {!r} and axial = {!r}"
        raise ValueError(place + text.format(*map(float, numbers)))
    is_passing = is_pole[0] & (level > weight)
    # With t = tan(theta / 2) <= 1, f = 0 requires |a - b| / 2 t <= |I1 y| + |a + b| / 2.
    largest = np.sqrt(np.abs(level) + np.abs(weight))
    outside = np.fmin(0.5 * np.abs(a - b) / (largest + np.abs(a + b)), np.fmin(1.0, inside))
    for _ in range(_HALVINGS):
        middle = np.where(outside > 0.0, np.sqrt(inside * outside), 0.5 * inside)
        is_inside = compute_squares(middle)[0] > 0.0
        inside, outside = np.where(is_inside, middle, inside), np.where(is_inside, outside, middle)
    theta = np.where(is_passing & (inside < 1e-15), 0.0, inside)
    square, across = compute_squares(theta)
    x = np.where(is_passing & (theta == 0.0), np.sqrt(np.maximum(square, 0.0)), 0.0) / top.across
    y, s, c = across / top.across, sine(theta), sign * cosine(theta)
    velocity = stack_components(x, y * c - spin * s, y * s + spin * c)
    return math.pi - theta if lower else theta, velocity


def compute_steady_motion(
    body: Body,
    spin: BatchParameter | None,
    tilt: BatchParameter,
    precession: BatchParameter | None,
    gravity: BatchParameter,
    fast: bool,
) -> tuple[Array, Array]:
    """Compute the spins and the rates of steady precessions, one of which is given."""
    if np.any(body.rotor) or body._has_wheels:
        raise ValueError("steady=True does not support bodies with rotors")
    if spin is not None:
        return spin.radians, compute_steady_precession(body, spin, tilt, gravity, fast)
    assert precession is not None
    return compute_steady_spin(body, precession, tilt, gravity), precession.radians


def compute_steady_spin(
    body: Body, precession: BatchParameter, tilt: BatchParameter, gravity: BatchParameter
) -> Array:
    """Compute the spins with I3 spin = mass gravity |com| / rate + I1 rate cos(tilt)."""
    top = read_symmetric_body(body, "steady=True")
    broadcast_shapes((precession, tilt, gravity), body=body.shape)
    is_upright = np.abs(sine(tilt.radians)) < 1e-15
    hint = ": a steady precession without it does not determine the spin"
    for one, bad, text in (
        (precession, precession.values == 0.0, "must not be 0"),
        (tilt, is_upright, "must not be vertical"),
    ):
        if np.any(bad):
            refuse_first(one.name, one.values, bad, text, hint)
    rate, weight = precession.radians, top.moment * gravity.values
    spins: Array = (weight / rate + top.across * rate * cosine(tilt.radians)) / top.along
    return spins


def compute_steady_precession(
    body: Body, spin: BatchParameter, tilt: BatchParameter, gravity: BatchParameter, fast: bool
) -> Array:
    """Compute the rates of steady precession, and refuse the first top that has none."""
    compute_symmetric_moments(body)
    shape = broadcast_shapes((spin, tilt, gravity), body=body.shape)
    rows = [np.broadcast_to(one.radians, shape).reshape(-1) for one in (spin, tilt)]
    tops = make_core_tops(body, shape, {"gravity": gravity.values})
    rates, least = np.moveaxis(tops.steady(rows[0], rows[1], fast), -1, 0)
    if not np.isnan(rates).any():
        found: Array = rates.reshape(shape)
        return found
    i = int(np.isnan(rates).argmax())
    place = tuple(map(int, np.unravel_index(i, shape)))
    text = "a horizontal axis without spin falls: there is no steady precession"
    if least[i] > 0.0:
        own = float(np.broadcast_to(spin.values, shape)[place])
        other = math.degrees(least[i]) if spin.degrees else float(least[i])
        text = (
            f"there is no steady precession at this tilt with spin = {own!r}: the smallest spin "
            f"with one is {other!r}"
        )
    elif fast and abs(math.cos(rows[1][i])) <= 1e-15:
        text = "a horizontal axis has only one steady precession: leave out fast"
    raise ValueError(f"top{list(place)}: {text}" if place else text)


def read_attitudes(attitude: Any, xyzw: Any) -> tuple[BatchParameter, Array]:
    """Return the argument `attitude` or `attitude_xyzw`, and the unit quaternions (w, x, y, z)."""
    if attitude is not None and xyzw is not None:
        raise ValueError("give either attitude or attitude_xyzw, not both")
    if xyzw is None and hasattr(attitude, "as_quat"):
        attitude = np.roll(np.asarray(attitude.as_quat()), 1, axis=-1)
    name, value = ("attitude", attitude) if xyzw is None else ("attitude_xyzw", xyzw)
    if value is None:
        return BatchParameter(name, UPRIGHT, (4,)), UPRIGHT
    parameter = read_parameter(name, value)
    q = parameter.values
    bad = (
        np.abs(q[..., 0] ** 2 + q[..., 1] ** 2 + q[..., 2] ** 2 + q[..., 3] ** 2 - 1.0) > INPUT_RTOL
    )
    dtype = q.dtype if value is parameter else np.asarray(value).dtype
    if np.any(bad) and dtype.kind == "f" and dtype.itemsize < 8:
        norm = np.sqrt((q * q).sum(axis=-1))
        single = bad & (np.abs(norm - 1.0) <= 4.0 * np.finfo(dtype).eps)
        parameter = parameter._replace(values=np.where(single[..., None], q / norm[..., None], q))
        bad &= ~single
    if np.any(bad):
        place = tuple(map(int, np.unravel_index(int(np.argmax(bad)), bad.shape)))
        one = get_member(q if value is parameter else value, place)
        try:
            unit(name, one, last=xyzw is not None)
        except ValueError as error:
            raise ValueError(f"{name}{list(place)}: {error}" if place else str(error)) from None
    return parameter, parameter.values if xyzw is None else np.roll(parameter.values, 1, axis=-1)


def validate_standard_deviation(name: str, widths: ArrayLike, numbers: int) -> Array:
    """Parse a standard deviation, which is a single number or one number for each component."""
    values = as_finite_array(name, widths, "a number or 3 numbers")
    if values.shape not in ([(), (3,)] if numbers == 3 else [()]) or (values < 0.0).any():
        form, are = ("1 or 3 numbers", "are") if numbers == 3 else ("a number", "is")
        raise ValueError(
            f"{name} must be the width of its deviations, {form} that {are} not negative, "
            f"not {short_repr(widths)}"
        )
    return values


def draw_normal_numbers(seed: int, first: int, n: int) -> Array:
    """Draw n rows of normally distributed numbers; row i depends only on `seed` and `first` + i.

    The Box-Muller transform converts 8 numbers of the counter-based generator Philox.
    """
    samples = np.empty((n, _DRAWS))
    philox = np.random.Philox(key=seed).advance(first * _DRAWS // 4)  # each count gives 4 words
    for begin in range(0, n, _ROWS):
        rows = samples[begin : begin + _ROWS]
        raw = philox.random_raw(rows.size).reshape(len(rows), 2, _DRAWS // 2)
        uniform = (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53
        reach = np.sqrt(-2.0 * logarithm(uniform[:, 0] + 2.0**-53))
        angle = math.tau * uniform[:, 1]
        rows[:, : _DRAWS // 2] = reach * cosine(angle)
        rows[:, _DRAWS // 2 :] = reach * sine(angle)
    return samples
