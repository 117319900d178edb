"""Ensembles built from one scene, by varying parameters or adding random perturbations.

Euler's angles and the angular velocity w of a scene determine the rates of the angles:
    rate of the nutation    w_1 cos(precession) + w_2 sin(precession)
    rate of the precession  (w_3 sin(nutation) - u cos(nutation)) / sin(nutation)
with u = w_1 sin(precession) - w_2 cos(precession).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .._core import cosine, logarithm, sine, values
from .._utils.errors import unknown_name_message
from .._utils.validation import Array, as_bool, as_int, short_repr
from ..quaternion import multiply
from .bodies import Bodies
from .body import Body
from .broadcasting import BatchParameter, compute_vectors_in_blocks, validate_parameter
from .ensemble_constructors import (
    Components,
    EnsembleConstructors,
    compute_steady_precession_rates,
    convert_array_to_radians,
    split_vector_components,
    validate_tilts,
)
from .ensemble_data import ONE_OF, compute_common_top_shape
from .environment import PhysicalEnvironment
from .euler_angles import cos, is_steady_precession_requested

E = TypeVar("E", bound=EnsembleConstructors[Any])
Four = tuple[Array, Array, Array, Array]
_BODY = "mass", "inertia", "com", "rotor"
_PLAIN = (*ONE_OF, "attitude", "attitude_xyzw")
_SPINNING = "spin", "tilt", "precession"
_EULER = "angles", "rates"
_FLAGS = "steady", "fast", "degrees"
_AROUND = PhysicalEnvironment._fields
_KNOWN = ("body", *_BODY, *_PLAIN, *_SPINNING, *_EULER, *_FLAGS, *_AROUND)
_DRAWS = 8  # random numbers per member, whichever parameters are scattered
_ROWS = 1 << 12  # members whose numbers are drawn in one batch


class _EulerState(NamedTuple):
    """The Euler angles and rates of a scene, in radians."""

    angles: tuple[float, float, float]  # precession, nutation, spin
    precession: float  # rate of the precession angle
    nutation: float  # rate of the nutation angle
    spin: float  # angular velocity about the apex


def vary(many: type[E], scene: Any, words: Mapping[str, Any]) -> E:
    """Build an ensemble from a scene and from arrays of varied parameters."""
    for name in words:
        if name not in _KNOWN:
            raise TypeError(unknown_name_message("parameter", name, _KNOWN))
    given = {name: value for name, value in words.items() if value is not None}
    kinds = [list(filter(given.__contains__, names)) for names in (_PLAIN, _SPINNING, _EULER)]
    described = [names[0] for names in kinds if names]
    if len(described) > 1:
        raise ValueError(
            f"{described[0]} and {described[1]} both describe the start: give only one kind"
        )
    body = _vary_body(scene, given)
    around = _override_scene_environment(scene, given)
    in_degrees = as_bool("degrees", given.get("degrees", False))
    steady, fast = given.get("steady", False), given.get("fast", False)
    is_steady = False
    if steady is not False or fast is not False:
        is_steady = is_steady_precession_requested(steady, fast, given.get("precession"), around)
    if kinds[1] or (is_steady and not described):
        start = _compute_varied_spin_start(
            body, scene, given, around.gravity, in_degrees, (is_steady, fast)
        )
    elif is_steady:
        raise ValueError(f"steady=True requires spin and tilt instead of {described[0]}")
    elif kinds[2]:
        start = _compute_varied_euler_start(scene, given, in_degrees)
    else:
        plain = {name: given[name] for name in kinds[0]}
        if not plain.keys() & set(ONE_OF):
            plain["momentum"] = scene.momentum
        if not plain.keys() & {"attitude", "attitude_xyzw"}:
            plain["attitude"] = scene.attitude
        return many(body, **around._asdict(), **plain)
    return many._build_from_euler_angles(body, *start, around, _accept_any_arguments)


def _override_scene_environment(scene: Any, given: Mapping[str, Any]) -> PhysicalEnvironment:
    """Replace the given environment parameters of a scene by arrays, and return all of them."""
    words = {name: given.get(name) for name in _AROUND}
    for name, value in words.items():
        own = np.asarray(getattr(scene, name))
        if value is None and (name in ("gravity", "damping") or own.any()):
            words[name] = BatchParameter(name, own, own.shape)
    return PhysicalEnvironment(**words)


def _accept_any_arguments(_: object, **__: object) -> None:
    """Accept any arguments and do nothing."""


def _vary_body(scene: Any, given: Mapping[str, Any]) -> Body | Bodies:
    own: Body = scene.body
    changed = {name: given[name] for name in _BODY if name in given}
    if "body" in given:
        if changed:
            raise ValueError(f"give either body or {next(iter(changed))}, not both")
        body: Body | Bodies = given["body"]
        return body
    if not changed:
        return own
    kept = {"mass": own.mass, "inertia": own.inertia, "com": own.com, "rotor": own.rotor}
    return Bodies(**{**kept, **changed}, inertia_rtol=own.inertia_rtol, unphysical=own.unphysical)


def _compute_initial_euler_state(scene: Any) -> _EulerState:
    """Return the Euler angles and rates at t = 0; rates at rounding level are set to zero."""
    names = "precession_angle", "nutation", "spin_angle", "spin"
    phi, theta, psi, spin = [float(values(n, scene._block, scene._start_state)[0]) for n in names]
    x, y, z = values("velocity", scene._block, scene._start_state)[0].tolist()
    nodding = x * math.cos(phi) + y * math.sin(phi)
    across = x * math.sin(phi) - y * math.cos(phi)
    turning = z * math.sin(theta) - across * math.cos(theta)
    least = 8.0 * np.finfo(float).eps * math.hypot(x, y, z)
    is_upright = abs(math.sin(theta)) < 1e-15
    rate = 0.0 if is_upright or abs(turning) <= least else turning / math.sin(theta)
    return _EulerState((phi, theta, psi), rate, nodding if abs(nodding) > least else 0.0, spin)


_Start = tuple[list[BatchParameter], Components, Components]


def _compute_varied_spin_start(
    body: Body | Bodies,
    scene: Any,
    given: Mapping[str, Any],
    gravity: ArrayLike,
    degrees: bool,
    steady: tuple[bool, bool],
) -> _Start:
    """Compute the Euler angles and rates for varied values of spin, tilt or precession.

    Parameters that do not vary are taken from the scene. The first flag in `steady` requests steady
    precession, and the second selects the faster of its two rates.
    """
    now = _compute_initial_euler_state(scene)
    own = {"spin": now.spin, "tilt": now.angles[1], "precession": now.precession}
    parameters = {
        name: validate_tilts(given[name], degrees)
        if name == "tilt"
        else validate_parameter(name, given[name])
        for name in _SPINNING
        if name in given
    }
    rate, angle, turning = [
        convert_array_to_radians(parameters[name].values, degrees)
        if name in parameters
        else np.asarray(own[name])
        for name in _SPINNING
    ]
    compute_common_top_shape(body, list(parameters.values()))
    if steady[0]:
        as_given = [
            parameters.get(n, _make_angle_batch_parameter(n, own[n], degrees))
            for n in ("spin", "tilt")
        ]
        one = partial(type(scene).spinning, steady=True, fast=steady[1], degrees=degrees)
        down = validate_parameter("gravity", gravity)
        turning = compute_steady_precession_rates(body, [*as_given, down], degrees, steady[1], one)
    with np.errstate(all="ignore"):
        rates = turning, np.asarray(now.nutation), rate - turning * cos(angle)
    precession, _, spin = now.angles
    return list(parameters.values()), (np.asarray(precession), angle, np.asarray(spin)), rates


def _make_angle_batch_parameter(name: str, radian: float, degrees: bool) -> BatchParameter:
    return BatchParameter(name, np.asarray(math.degrees(radian) if degrees else radian), ())


def _compute_varied_euler_start(scene: Any, given: Mapping[str, Any], degrees: bool) -> _Start:
    """Return the varied parameters, and the Euler angles and rates computed from them.

    Parameters that do not vary are taken from the scene.
    """
    now = _compute_initial_euler_state(scene)
    spinning = now.spin - now.precession * math.cos(now.angles[1])
    own = {"angles": now.angles, "rates": (now.precession, now.nutation, spinning)}
    parameters = {
        name: validate_parameter(name, given[name], (3,)) for name in _EULER if name in given
    }
    angles, rates = (
        split_vector_components(
            convert_array_to_radians(parameters[name].values, degrees)
            if name in parameters
            else np.asarray(own[name])
        )
        for name in _EULER
    )
    return list(parameters.values()), angles, rates


def scatter(
    many: type[E],
    scene: Any,
    n: int,
    seed: int,
    momentum: ArrayLike | None,
    attitude: ArrayLike | None,
    gravity: float | None,
    begin: int = 0,
) -> E:
    """Build an ensemble of `n` variants of `scene` with normally distributed perturbations.

    `momentum`, `attitude` and `gravity` are standard deviations. The result contains the members
    `begin` to `begin` + `n` - 1 of any larger ensemble with the same seed.
    """
    count, key = as_int("n", n, 0), as_int("seed", seed, 0)
    if momentum is None and attitude is None and gravity is None:
        raise ValueError("give the width of at least one of momentum, attitude, gravity")
    normal = _draw_normal_numbers(key, begin, count)
    words = scene._list_constructor_arguments()
    with np.errstate(all="ignore"):
        if momentum is not None:
            off = _validate_standard_deviation("momentum", momentum, 3) * normal[:, :3]
            words["momentum"] = np.array(scene.momentum) + off
        if attitude is not None:
            turns, own = (
                _validate_standard_deviation("attitude", attitude, 3) * normal[:, 3:6],
                np.array(scene.attitude),
            )
            words["attitude"] = compute_vectors_in_blocks(
                _compose_with_rotation_vectors, (count,), 4, own, turns
            )
        if gravity is not None:
            words["gravity"] = (
                scene.gravity + _validate_standard_deviation("gravity", gravity, 1) * normal[:, 6]
            )
    return many(**words)._forget_varying_parameters()


def _validate_standard_deviation(name: str, given: ArrayLike, numbers: int) -> Array:
    """Parse a standard deviation, which is a single number or one number for each component."""
    made = validate_parameter(name, given, () if np.ndim(given) == 0 or numbers == 1 else (3,))
    if made.shape or (made.values < 0.0).any():
        many, are = ("1 or 3 numbers", "are") if numbers == 3 else ("a number", "is")
        raise ValueError(
            f"{name} must be the width of its deviations, {many} that {are} not negative, "
            f"not {short_repr(given)}"
        )
    return made.values


def _draw_normal_numbers(seed: int, first: int, n: int) -> Array:
    """Draw n rows of normally distributed numbers; row i depends only on `seed` and `first` + i.

    Each row uses 8 random 64-bit integers from the counter-based generator Philox. The Box-Muller
    transform converts these integers to normally distributed numbers.
    """
    drawn = np.empty((n, _DRAWS))
    philox = np.random.Philox(key=seed).advance(first * _DRAWS // 4)  # each count gives 4 words
    for begin in range(0, n, _ROWS):
        rows = drawn[begin : begin + _ROWS]
        raw = philox.random_raw(rows.size).reshape(len(rows), 2, _DRAWS // 2)
        even = (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53
        reach = np.sqrt(-2.0 * logarithm(even[:, 0] + 2.0**-53))
        angle = math.tau * even[:, 1]
        rows[:, : _DRAWS // 2] = reach * cosine(angle)
        rows[:, _DRAWS // 2 :] = reach * sine(angle)
    return drawn


def _compose_with_rotation_vectors(q: Four, r: Components) -> Four:
    """Return the attitudes of bodies rotated first by the rotation vectors `r`, then by `q`."""
    x, y, z = r
    size = np.sqrt(x * x + y * y + z * z)
    half = 0.5 * size
    per = np.where(size > 0.0, sine(half) / size, 0.5)
    return multiply(q, (np.asarray(cosine(half)), per * x, per * y, per * z))
