"""Ensembles in which parameters of a scene vary."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .._core import cosine, logarithm, sine, values
from .._utils.arguments import (
    Array,
    as_bool,
    as_int,
    get_parameter_unit,
    short_repr,
    unknown_name_message,
)
from ..quaternion import multiply
from .batch import BatchParameter, compute_vectors_in_blocks, validate_parameter
from .body import Bodies, Body
from .ensemble import (
    ONE_OF,
    Components,
    EnsembleConstructors,
    compute_common_top_shape,
    compute_steady_precession_rates,
    split_vector_components,
    validate_tilts,
)
from .euler_angles import cos, is_steady_precession_requested
from .parameters import EnvironmentArguments, validate_gravities

E = TypeVar("E", bound=EnsembleConstructors[Any])
Four = tuple[Array, Array, Array, Array]
_BODY = "mass", "inertia", "com", "rotor"
_PLAIN = (*ONE_OF, "attitude", "attitude_xyzw")
_SPINNING = "spin", "tilt", "precession"
_EULER = "angles", "rates"
_FLAGS = "steady", "fast", "degrees"
_AROUND = EnvironmentArguments._fields
_KNOWN = ("body", *_BODY, *_PLAIN, *_SPINNING, *_EULER, *_FLAGS, *_AROUND)
_DRAWS = 8  # random numbers per member, whichever parameters are scattered
_ROWS = 1 << 12  # members whose numbers are drawn in one batch


class _EulerState(NamedTuple):
    """The Euler angles and rates of a scene, in radians."""

    angles: tuple[float, float, float]  # precession, nutation, spin
    precession: float  # rate of the precession angle
    nutation: float  # rate of the nutation angle
    spin: float  # angular velocity about the apex


def vary(ensemble_class: type[E], scene: Any, words: Mapping[str, Any]) -> E:
    """Build an ensemble from a scene and from arrays of varied parameters."""
    for name in words:
        if name not in _KNOWN:
            raise TypeError(unknown_name_message("parameter", name, _KNOWN))
    changes = {name: value for name, value in words.items() if value is not None}
    kinds = [list(filter(changes.__contains__, names)) for names in (_PLAIN, _SPINNING, _EULER)]
    start_names = [names[0] for names in kinds if names]
    if len(start_names) > 1:
        raise ValueError(
            f"{start_names[0]} and {start_names[1]} both describe the start: give only one kind"
        )
    if as_bool("degrees", changes.get("degrees", False)):
        changes |= _mark_as_degrees(changes)
    in_degrees = any(getattr(value, "degrees", False) for value in changes.values())
    body = _vary_body(scene, changes)
    environment = _override_scene_environment(scene, changes)
    steady, fast = changes.get("steady", False), changes.get("fast", False)
    is_steady = False
    if steady is not False or fast is not False:
        is_steady = is_steady_precession_requested(
            steady, fast, changes.get("precession"), environment
        )
    if kinds[1] or (is_steady and not start_names):
        start = _compute_varied_spin_start(
            body, scene, changes, environment.gravity, in_degrees, (is_steady, fast)
        )
    elif is_steady:
        raise ValueError(f"steady=True requires spin and tilt instead of {start_names[0]}")
    elif kinds[2]:
        start = _compute_varied_euler_start(scene, changes)
    else:
        plain = {name: changes[name] for name in kinds[0]}
        if not plain.keys() & set(ONE_OF):
            plain["momentum"] = scene.momentum
        if not plain.keys() & {"attitude", "attitude_xyzw"}:
            plain["attitude"] = scene.attitude
        return ensemble_class(body, **environment._asdict(), **plain)
    return ensemble_class._build_from_euler_angles(body, *start, environment, _accept_any_arguments)


def _mark_as_degrees(changes: Mapping[str, Any]) -> dict[str, BatchParameter]:
    """Return the angles and rates in `changes` as parameters in degrees."""
    return {
        name: validate_parameter(name, value, () if name in _SPINNING else (3,), degrees=True)
        for name, value in changes.items()
        if "rad" in get_parameter_unit(name, degrees=False)
    }


def _override_scene_environment(scene: Any, changes: Mapping[str, Any]) -> EnvironmentArguments:
    """Return the environment of a scene, with the parameters given in `changes` replaced."""
    words = {name: changes.get(name) for name in _AROUND}
    for name, value in words.items():
        scene_value = np.asarray(getattr(scene, name))
        is_known = scene._optional_gravity is not None if name == "gravity" else name == "damping"
        if value is None and (is_known or scene_value.any()):
            words[name] = BatchParameter(name, scene_value, scene_value.shape)
    return EnvironmentArguments(**words)


def _accept_any_arguments(_: object, **__: object) -> None:
    """Accept any arguments and do nothing."""


def _vary_body(scene: Any, changes: Mapping[str, Any]) -> Body | Bodies:
    scene_body: Body = scene.body
    body_changes = {name: changes[name] for name in _BODY if name in changes}
    if "body" in changes:
        if body_changes:
            raise ValueError(f"give either body or {next(iter(body_changes))}, not both")
        body: Body | Bodies = changes["body"]
        return body
    if not body_changes:
        return scene_body
    parameters = {
        "mass": scene_body.mass,
        "inertia": scene_body.inertia,
        "com": scene_body.com,
        "rotor": scene_body.rotor,
    }
    return Bodies(
        **{**parameters, **body_changes},
        inertia_rtol=scene_body.inertia_rtol,
        unphysical=scene_body.unphysical,
    )


def _compute_initial_euler_state(scene: Any) -> _EulerState:
    """Return the initial Euler angles and their rates; rates within rounding error are set to 0."""
    names = "precession_angle", "nutation", "spin_angle", "spin"
    phi, theta, psi, spin = [float(values(n, scene._block, scene._start_state)[0]) for n in names]
    x, y, z = values("velocity", scene._block, scene._start_state)[0].tolist()
    nodding = x * math.cos(phi) + y * math.sin(phi)
    horizontal_rate = x * math.sin(phi) - y * math.cos(phi)
    turning = z * math.sin(theta) - horizontal_rate * math.cos(theta)
    least = 8.0 * np.finfo(float).eps * math.hypot(x, y, z)
    is_upright = abs(math.sin(theta)) < 1e-15
    rate = 0.0 if is_upright or abs(turning) <= least else turning / math.sin(theta)
    return _EulerState((phi, theta, psi), rate, nodding if abs(nodding) > least else 0.0, spin)


_Start = tuple[list[BatchParameter], Components, Components]


def _compute_varied_spin_start(
    body: Body | Bodies,
    scene: Any,
    changes: Mapping[str, Any],
    gravity: ArrayLike,
    degrees: bool,
    steady: tuple[bool, bool],
) -> _Start:
    """Compute the Euler angles and rates for varied values of spin, tilt or precession.

    Parameters for which no varied values are given are taken from the scene. The first flag in
    `steady` requests steady precession, without nutation, and the second selects the faster of its
    two rates.
    """
    state = _compute_initial_euler_state(scene)
    defaults = {"spin": state.spin, "tilt": state.angles[1], "precession": state.precession}
    parameters = {
        name: validate_tilts(changes[name], degrees)
        if name == "tilt"
        else validate_parameter(name, changes[name])
        for name in _SPINNING
        if name in changes
    }
    rate, angle, turning = [
        parameters[name].radians if name in parameters else np.asarray(defaults[name])
        for name in _SPINNING
    ]
    compute_common_top_shape(body, list(parameters.values()))
    if steady[0]:
        spin_and_tilt = [
            parameters.get(n, _make_angle_batch_parameter(n, defaults[n], degrees))
            for n in ("spin", "tilt")
        ]
        one = partial(type(scene).spinning, steady=True, fast=steady[1], degrees=degrees)
        gravity_parameter = validate_gravities(gravity, body)
        turning = compute_steady_precession_rates(
            body, [*spin_and_tilt, gravity_parameter], steady[1], one
        )
    with np.errstate(all="ignore"):
        nutation = np.asarray(0.0 if steady[0] else state.nutation)
        rates = turning, nutation, rate - turning * cos(angle)
    precession, _, spin = state.angles
    return list(parameters.values()), (np.asarray(precession), angle, np.asarray(spin)), rates


def _make_angle_batch_parameter(name: str, radian: float, degrees: bool) -> BatchParameter:
    value = math.degrees(radian) if degrees else radian
    return BatchParameter(name, np.asarray(value), (), degrees)


def _compute_varied_euler_start(scene: Any, changes: Mapping[str, Any]) -> _Start:
    """Return the varied parameters, and the Euler angles and rates computed from them.

    Parameters that do not vary are taken from the scene.
    """
    state = _compute_initial_euler_state(scene)
    spinning = state.spin - state.precession * math.cos(state.angles[1])
    defaults = {"angles": state.angles, "rates": (state.precession, state.nutation, spinning)}
    parameters = {
        name: validate_parameter(name, changes[name], (3,)) for name in _EULER if name in changes
    }
    angles, rates = (
        split_vector_components(
            parameters[name].radians if name in parameters else np.asarray(defaults[name])
        )
        for name in _EULER
    )
    return list(parameters.values()), angles, rates


def scatter(
    ensemble_class: type[E],
    scene: Any,
    n: int,
    seed: int,
    momentum: ArrayLike | None,
    attitude: ArrayLike | None,
    gravity: float | None,
    begin: int = 0,
) -> E:
    """Build an ensemble of `n` variants of `scene` with normally distributed perturbations.

    `momentum`, `attitude` and `gravity` are standard deviations. The result consists of the members
    `begin` to `begin` + `n` - 1 of an unlimited sequence of members determined by the seed.
    """
    count, key = as_int("n", n, 0), as_int("seed", seed, 0)
    if momentum is None and attitude is None and gravity is None:
        raise ValueError("give the width of at least one of momentum, attitude, gravity")
    normal = _draw_normal_numbers(key, begin, count)
    words = scene._list_constructor_arguments()
    with np.errstate(all="ignore"):
        if momentum is not None:
            deviations = _validate_standard_deviation("momentum", momentum, 3) * normal[:, :3]
            words["momentum"] = np.array(scene.momentum) + deviations
        if attitude is not None:
            turns, centre = (
                _validate_standard_deviation("attitude", attitude, 3) * normal[:, 3:6],
                np.array(scene.attitude),
            )
            words["attitude"] = compute_vectors_in_blocks(
                _compose_with_rotation_vectors, (count,), 4, centre, turns
            )
        if gravity is not None:
            words["gravity"] = (
                scene.gravity + _validate_standard_deviation("gravity", gravity, 1) * normal[:, 6]
            )
    return ensemble_class(**words)._forget_varying_parameters()


def _validate_standard_deviation(name: str, widths: ArrayLike, numbers: int) -> Array:
    """Parse a standard deviation, which is a single number or one number for each component."""
    parameter = validate_parameter(
        name, widths, () if np.ndim(widths) == 0 or numbers == 1 else (3,)
    )
    if parameter.shape or (parameter.values < 0.0).any():
        form, are = ("1 or 3 numbers", "are") if numbers == 3 else ("a number", "is")
        raise ValueError(
            f"{name} must be the width of its deviations, {form} that {are} not negative, "
            f"not {short_repr(widths)}"
        )
    return parameter.values


def _draw_normal_numbers(seed: int, first: int, n: int) -> Array:
    """Draw n rows of normally distributed numbers; row i depends only on `seed` and `first` + i.

    Each row uses 8 random 64-bit integers from the counter-based generator Philox. The Box-Muller
    transform converts the random integers to normally distributed numbers.
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


def _compose_with_rotation_vectors(q: Four, r: Components) -> Four:
    """Return the attitudes of bodies rotated first by the rotation vectors `r`, then by `q`."""
    x, y, z = r
    size = np.sqrt(x * x + y * y + z * z)
    half = 0.5 * size
    factor = np.where(size > 0.0, sine(half) / size, 0.5)
    return multiply(q, (np.asarray(cosine(half)), factor * x, factor * y, factor * z))
