"""The parameters of a scene: gravity, damping, friction, and a support that turns and shakes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from .._utils.arguments import (
    Array,
    Vector,
    as_float,
    as_three_floats,
    convert_parameter_to_radians,
    short_repr,
)
from .batch import BatchParameter, validate_parameter
from .body import Bodies, Body

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


_STILL: Final = (0.0, 0.0, 0.0)
_SHAKING_FORM: Final = "three numbers (amplitude, rate, phase)"
# 2 pi to 75 decimal places
_TURN: Final = Fraction(
    "6.283185307179586476925286766559005768394338798750211641949889184615632812572"
)


class EnvironmentArguments(NamedTuple):
    """The environment parameters of a scene or an ensemble, before validation."""

    gravity: Any = None
    damping: ArrayLike | None = None
    turning: ArrayLike | None = None
    shaking: ArrayLike | None = None
    friction: ArrayLike | None = None

    def validate_single_top_environment(
        self, body: Body
    ) -> tuple[float, Vector, Vector, Vector, float]:
        """Validate the values for a single top; raise TypeError or ValueError if any is invalid."""
        return (
            validate_gravity(self.gravity, body),
            validate_damping(self.damping),
            validate_turning(self.turning),
            validate_shaking(self.shaking),
            validate_friction(self.friction),
        )

    def convert_from_degrees(self) -> EnvironmentArguments:
        """Return the arguments of one top with `turning` and `shaking` converted to radians."""
        vectors = {"turning": validate_turning, "shaking": validate_shaking}
        return self._replace(
            **{
                name: convert_parameter_to_radians(name, np.array(validate(value))).tolist()
                for name, validate in vectors.items()
                if (value := getattr(self, name)) is not None
            }
        )

    def mark_as_degrees(self) -> EnvironmentArguments:
        """Return the arguments of an ensemble with `turning` and `shaking` marked as degrees."""
        vectors: dict[str, Any] = {
            name: validate_parameter(name, value, (3,), degrees=True)
            for name in ("turning", "shaking")
            if (value := getattr(self, name)) is not None
        }
        return self._replace(**vectors)


def resolve_gravity(gravity: Any, body: Body | Bodies) -> Any:
    """Return `gravity`, or 0 if it is None and each centre of mass is exactly at the fixed point.

    There, gravity exerts no torque. Raises TypeError if `gravity` is None for other bodies.
    """
    if gravity is not None:
        return gravity
    if np.any(body.com):
        raise TypeError(
            "gravity is required unless the centre of mass is at the fixed point: 9.81 in SI "
            "units, 1 in units in which gravity is 1, 0 for a top without weight"
        )
    return 0.0


def validate_gravity(value: object, body: Body) -> float:
    known = resolve_gravity(value, body)
    try:
        return as_float("gravity", known)
    except TypeError as error:
        raise TypeError(f"{error}: it is the acceleration along -e3, positive is down") from None


def validate_damping(damping: ArrayLike | None) -> Vector:
    if damping is None:
        return _STILL
    components = (
        (as_float("damping", damping),) * 3
        if np.ndim(damping) == 0
        else as_three_floats("damping", damping)
    )
    if min(components) < 0.0:
        raise ValueError(
            f"damping must not be negative, not {short_repr(damping)}: it removes energy"
        )
    return components


def validate_turning(turning: ArrayLike | None) -> Vector:
    return _STILL if turning is None else as_three_floats("turning", turning)


def validate_shaking(shaking: ArrayLike | None) -> Vector:
    if shaking is None:
        return _STILL
    if np.ndim(shaking) == 0:
        raise TypeError(f"shaking must be {_SHAKING_FORM}, not {short_repr(shaking)}")
    amplitude, rate, phase = as_three_floats("shaking", shaking)
    if rate < 0.0 or (amplitude and not rate):
        raise ValueError(
            f"shaking needs a positive rate, not {short_repr(rate)}: shaking is "
            "(amplitude, rate, phase)"
        )
    return amplitude, rate, phase


def validate_friction(value: object) -> float:
    friction = 0.0 if value is None else as_float("friction", value)
    if friction < 0.0:
        raise ValueError(
            f"friction must not be negative, not {short_repr(value)}: it removes energy"
        )
    return friction


def advance_shaking_phase(shaking: Vector, t: float) -> Vector:
    """Return the `shaking` parameters with the phase advanced to the time `t`.

    The phase at `t` is computed in rational arithmetic and rounded once.
    """
    amplitude, rate, phase = shaking
    if not amplitude or not t:
        return shaking
    angle = Fraction(phase) + Fraction(rate) * Fraction(t)
    return amplitude, rate, float(angle - round(angle / _TURN) * _TURN)


def list_disturbances(tops: Any) -> list[str]:
    """List the disturbances of a scene or an ensemble, such as damping or a moving support."""
    shaking = tops.shaking
    amplitudes = shaking[0] if type(shaking) is tuple else np.asarray(shaking)[..., 0]
    disturbances = {
        "damping": _has_nonzero_element(tops.damping),
        "friction": _has_nonzero_element(tops.friction),
        "a shaken support": _has_nonzero_element(amplitudes),
        "a turning support": _has_nonzero_element(tops.turning),
    }
    return [name for name, is_there in disturbances.items() if is_there]


def _has_nonzero_element(values: Any) -> bool:
    """Return True if a number, tuple or array has a nonzero element."""
    if type(values) is tuple:
        return any(values)
    return values != 0.0 if type(values) is float else bool(np.any(values))


def has_equivalent_support_at_rest(tops: Any) -> bool:
    """Return True if the motion is that of tops on a support at rest, seen from a turning one.

    Each support turns about e3 or is at rest. There is neither damping nor friction, which depend
    on the motion relative to the support.
    """
    is_only_turning = list_disturbances(tops) == ["a turning support"]
    return is_only_turning and not np.any(np.asarray(tops.turning)[..., :2])


def refuse_disturbances(
    tops: Any, statement: str, exceptions: Iterable[str] = (), reason: str = ""
) -> None:
    """Raise ValueError if a scene or an ensemble has disturbances other than those in `exceptions`.

    The message consists of `statement`, the names of the disturbances that are not allowed, and
    `reason`. If the only disturbance is a support that turns about e3, `reason` is replaced by a
    hint that suggests the inertial frame.
    """
    disturbances = [name for name in list_disturbances(tops) if name not in exceptions]
    if not disturbances:
        return
    if has_equivalent_support_at_rest(tops):
        reason = "replace(turning=None) gives the same motion, seen from the inertial frame"
    raise ValueError(
        f"{statement} with {' and '.join(disturbances)}{': ' if reason else ''}{reason}"
    )


def validate_gravities(gravity: ArrayLike | None, body: Body | Bodies) -> BatchParameter:
    return validate_parameter("gravity", resolve_gravity(gravity, body))


def validate_ensemble_environment(
    environment: EnvironmentArguments, body: Body | Bodies
) -> tuple[list[BatchParameter], dict[str, Array]]:
    """Validate the environment parameters of an ensemble, and convert them to columns.

    If turning, shaking or friction is None, its column is zero, and the returned list omits it.
    """
    gravity, (drag, dampings) = (
        validate_gravities(environment.gravity, body),
        _validate_dampings(environment.damping),
    )
    parameters, columns = [gravity, drag], {"gravity": gravity.values, "damping": dampings}
    words: tuple[tuple[str, ArrayLike | None, Callable[[Any], object]], ...] = (
        ("turning", environment.turning, validate_turning),
        ("shaking", environment.shaking, validate_shaking),
        ("friction", environment.friction, validate_friction),
    )
    for name, value, check in words:
        shape = () if name == "friction" else (3,)
        if value is None:
            columns[name] = np.zeros(shape)
            continue
        parameter = validate_parameter(name, value, shape)
        _raise_if_parameter_invalid(parameter, check)
        parameters.append(parameter)
        columns[name] = parameter.radians
    return parameters, columns


def _raise_if_parameter_invalid(parameter: BatchParameter, check: Callable[[Any], object]) -> None:
    """Raise the exception that `check` raises for the first invalid value."""
    values = parameter.values
    bad = np.zeros(parameter.shape, dtype=np.bool_)
    if parameter.name == "friction":
        bad = values < 0.0
    elif parameter.name == "shaking":
        amplitude, rate = values[..., 0], values[..., 1]
        bad = (rate < 0.0) | (amplitude != 0.0) & (rate == 0.0)
    if np.any(bad):
        parameter.raise_error_of_first_bad_value(bad, lambda _, one: check(one))


def _validate_dampings(damping: ArrayLike | BatchParameter | None) -> tuple[BatchParameter, Array]:
    """Parse `damping`; return the parameter and the damping constants along the principal axes."""
    nothing = np.zeros(3)
    if damping is None:
        return BatchParameter("damping", nothing, (3,)), nothing
    if isinstance(damping, BatchParameter):
        parameter = damping
        components = np.broadcast_to(parameter.values, (*parameter.values.shape[:-1], 3))
    elif np.ndim(damping) == 0:
        parameter = validate_parameter("damping", damping)
        components = np.repeat(parameter.values, 3)
        parameter = BatchParameter("damping", parameter.values[None], (1,))
    else:
        width = np.shape(damping)[-1:]
        parameter = validate_parameter(
            "damping", damping, width if width == (1,) else (3,), "3 numbers, or 1"
        )
        components = np.broadcast_to(parameter.values, (*parameter.shape, 3))
    negative = (parameter.values < 0.0).any(axis=-1)
    if negative.any():
        parameter.raise_error_of_first_bad_value(
            negative, lambda _, one: validate_damping(one[0] if len(one) == 1 else one)
        )
    return parameter, components


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
