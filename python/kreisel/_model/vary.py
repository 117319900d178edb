"""Ensembles in which parameters of a scene vary."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._core import cosine, logarithm, sine, values
from .._utils.arguments import (
    Array,
    as_bool,
    as_finite_array,
    as_int,
    get_parameter_unit,
    short_repr,
    unknown_name_message,
    validate_type,
)
from ..quaternion import multiply
from .batch import broadcast_shapes, stack_components
from .body import Body
from .ensemble import (
    Ensemble,
    build_from_euler,
    build_spinning,
    compute_steady_precession,
    is_steady_precession_requested,
    read_tilts,
)
from .parameters import ENVIRONMENT, STARTS, BatchParameter, read_environment, read_parameter

_BODY = "mass", "inertia", "com", "rotor"
_PLAIN = (*STARTS, "attitude", "attitude_xyzw")
_SPINNING = "spin", "tilt", "precession"
_EULER = "angles", "rates"
_FLAGS = "steady", "fast", "degrees"
_KNOWN = ("body", *_BODY, *_PLAIN, *_SPINNING, *_EULER, *_FLAGS, *ENVIRONMENT)
_DRAWS = 8  # random numbers per member, whichever parameters are scattered
_ROWS = 1 << 12  # members whose numbers are drawn in one batch


class _EulerState(NamedTuple):
    """The Euler angles and rates of a scene, in radians."""

    angles: tuple[float, float, float]  # precession, nutation, spin
    precession: float  # rate of the precession angle
    nutation: float  # rate of the nutation angle
    spin: float  # angular velocity about the apex


def vary(scene: Any, words: Mapping[str, Any]) -> Ensemble:
    """Build an ensemble from a scene and from arrays of varied parameters."""
    for name in words:
        if name not in _KNOWN:
            raise TypeError(unknown_name_message("parameter", name, _KNOWN))
    changes = {name: value for name, value in words.items() if value is not None}
    kinds = [[n for n in names if n in changes] for names in (_PLAIN, _SPINNING, _EULER)]
    start_names = [names[0] for names in kinds if names]
    if len(start_names) > 1:
        raise ValueError(
            f"{start_names[0]} and {start_names[1]} both describe the start: give only one kind"
        )
    if as_bool("degrees", changes.get("degrees", False)):
        changes |= {
            name: read_parameter(name, value, degrees=True)
            for name, value in changes.items()
            if "rad" in get_parameter_unit(name, degrees=False)
        }
    in_degrees = any(getattr(value, "degrees", False) for value in changes.values())
    body = _vary_body(scene, changes)
    around = {name: changes.get(name) for name in ENVIRONMENT}
    for name, value in around.items():
        is_known = scene._optional_gravity is not None if name == "gravity" else name == "damping"
        if value is None and (is_known or np.any(getattr(scene, name))):
            around[name] = getattr(scene, name)
    given = read_environment(body, around)
    fast = changes.get("fast", False)
    is_steady = is_steady_precession_requested(
        changes.get("steady", False), fast, changes.get("precession"), given
    )
    if is_steady and (kinds[0] or kinds[2]):
        raise ValueError(f"steady=True requires spin and tilt instead of {start_names[0]}")
    if not (kinds[1] or kinds[2] or is_steady):
        plain = {name: changes[name] for name in kinds[0]}
        if not plain.keys() & set(STARTS):
            plain["momentum"] = scene.momentum
        if not plain.keys() & {"attitude", "attitude_xyzw"}:
            plain["attitude"] = scene.attitude
        return Ensemble(body, **{**given, **plain})
    state = _compute_initial_euler_state(scene)
    precession, tilt, spin_angle = state.angles
    varied = {
        name: read_tilts(changes[name], in_degrees)
        if name == "tilt"
        else read_parameter(name, changes[name])
        for name in (*_SPINNING, *_EULER)
        if name in changes
    }
    own: dict[str, Any] = {"spin": state.spin, "tilt": tilt, "precession": state.precession}
    own["angles"] = state.angles
    own["rates"] = state.precession, state.nutation, state.spin - state.precession * math.cos(tilt)
    known = {
        name: varied.get(name, BatchParameter(name, np.array(value), np.shape(value)))
        for name, value in own.items()
    }
    parameters = list(varied.values())
    radians = {name: one.radians for name, one in known.items()}
    broadcast_shapes({"body": body.shape, **{one.name: one.shape for one in parameters}})
    if kinds[2]:
        return build_from_euler(body, parameters, radians["angles"], radians["rates"], given)
    if is_steady:
        if in_degrees and "spin" not in varied:
            degrees = np.array(math.degrees(state.spin))
            known["spin"] = BatchParameter("spin", degrees, (), degrees=True)
        radians["precession"] = compute_steady_precession(
            body, known["spin"], known["tilt"], given["gravity"], fast
        )
    angles = precession, radians["tilt"], spin_angle
    nutation = 0.0 if is_steady else state.nutation
    return build_spinning(
        body, parameters, angles, radians["spin"], radians["precession"], given, nutation
    )


def _vary_body(scene: Any, changes: Mapping[str, Any]) -> Body:
    own: Body = scene.body
    body_changes = {name: changes[name] for name in _BODY if name in changes}
    if "body" in changes:
        if body_changes:
            raise ValueError(f"give either body or {next(iter(body_changes))}, not both")
        return validate_type("body", changes["body"], Body)
    if not body_changes:
        return own
    kept = {name: getattr(own, name) for name in (*_BODY, "inertia_rtol", "unphysical")}
    return Body(**{**kept, **body_changes})


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


def scatter(
    scene: Any,
    n: int,
    seed: int,
    momentum: ArrayLike | None,
    attitude: ArrayLike | None,
    gravity: float | None,
    begin: int = 0,
) -> Ensemble:
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
            turns = _validate_standard_deviation("attitude", attitude, 3) * normal[:, 3:6]
            x, y, z = turns.T
            size = np.sqrt(x * x + y * y + z * z)
            half = 0.5 * size
            factor = np.where(size > 0.0, sine(half) / size, 0.5)
            by = np.asarray(cosine(half)), factor * x, factor * y, factor * z
            words["attitude"] = stack_components(*multiply(scene.attitude, by))
        if gravity is not None:
            words["gravity"] = (
                scene.gravity + _validate_standard_deviation("gravity", gravity, 1) * normal[:, 6]
            )
    return Ensemble(**words)._forget_varying_parameters()


def _validate_standard_deviation(name: str, widths: ArrayLike, numbers: int) -> Array:
    """Parse a standard deviation, which is a single number or one number for each component."""
    values = as_finite_array(name, widths, "a number or 3 numbers")
    if values.shape not in ([(), (3,)] if numbers == 3 else [()]) or (values < 0.0).any():
        form, are = ("1 or 3 numbers", "are") if numbers == 3 else ("a number", "is")
        raise ValueError(
            f"{name} must be the width of its deviations, {form} that {are} not negative, "
            f"not {short_repr(widths)}"
        )
    return values


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
