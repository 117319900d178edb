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
    BatchParameter,
    Shape,
    collapse_broadcast_axes,
    get_member,
    read_parameter,
    refuse_first,
)

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
_DRAWS = 8  # random numbers per member, whichever parameters are scattered
_ROWS = 1 << 12  # members whose numbers are drawn in one batch


def make_core_tops(body: Body, shape: Shape, columns: Mapping[str, Array]) -> CoreTops:
    """Return tops as the core reads them; missing columns are zero, or upright."""
    start: dict[str, Any] = {"gravity": 0.0, "t": 0.0, "attitude": UPRIGHT}
    start |= dict.fromkeys(("momentum", "damping", "turning", "shaking"), np.zeros(3))
    start |= {"friction": 0.0, **columns}
    names = "mass", "moments", "principal_com", "axes", "inertia_rtol", "principal_rotor"
    own = [body._columns[name] if body.shape else getattr(body, name) for name in names]
    parts = [*own, *start.values(), _turn_wheels(body)]
    return CoreTops(shape, [np.asarray(values, dtype=np.float64) for values in parts])


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
    is_lopsided = (kinds == "general") | (across > KIND_RTOL * np.abs(rotor).max(axis=-1))
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


def check_symmetry(body: Body) -> None:
    """Raise ValueError for the first body that is not symmetric about its apex."""
    is_symmetric = make_core_tops(body, body.shape, {}).symmetric().reshape(body.shape)
    if not is_symmetric.all():
        index = tuple(map(int, np.unravel_index(int(is_symmetric.argmin()), body.shape)))
        one = body._select_member(index)
        place = f"body{list(index)}: " if index else ""
        raise ValueError(
            f"{place}spinning needs a symmetric body: its axis must be the line from the fixed "
            "point to the centre of mass, or the third axis if these points coincide; this body "
            f"has moments {one.moments} and com {one.principal_com} in principal axes"
        )


def is_steady_precession_requested(
    steady: object, fast: object, precession: object, given: Mapping[str, BatchParameter]
) -> bool:
    """Return True if a steady precession is requested; refuse arguments that exclude it."""
    if as_bool("fast", fast) and not steady:
        raise ValueError("fast chooses between two steady precessions: also pass steady=True")
    if not as_bool("steady", steady):
        return False
    others = ["precession"] if precession is not None else []
    others += [name for name, one in given.items() if name != "gravity" and one.values.any()]
    if others:
        raise ValueError(f"steady=True cannot be combined with {' or '.join(others)}")
    return True


def compute_steady_precession(
    body: Body, spin: BatchParameter, tilt: BatchParameter, gravity: BatchParameter, fast: bool
) -> Array:
    """Compute the rates of steady precession, and refuse the first top that has none."""
    if np.any(body.rotor) or body._has_wheels:
        raise ValueError("steady=True does not support bodies with rotors")
    check_symmetry(body)
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
