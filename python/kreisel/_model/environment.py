"""The environment of a top: gravity, damping, the motion of the support, and friction.

The environment consists of all parameters of a scene other than the body and the initial state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._utils.validation import Array, Vector, as_float, as_three_floats, short_repr
from .broadcasting import BatchParameter, validate_parameter

_STILL: Final = (0.0, 0.0, 0.0)
_SHAKING_FORM: Final = "three numbers (amplitude, rate, phase)"
# 2 pi to 75 decimal places
_TURN: Final = Fraction(
    "6.283185307179586476925286766559005768394338798750211641949889184615632812572"
)


class PhysicalEnvironment(NamedTuple):
    """Environmental parameters as passed by the user."""

    gravity: Any = 1.0
    damping: ArrayLike | None = None
    turning: ArrayLike | None = None
    shaking: ArrayLike | None = None
    friction: ArrayLike | None = None

    def validate_single_top_environment(self) -> tuple[float, Vector, Vector, Vector, float]:
        """Validate the values for a single top; raise TypeError or ValueError if any is invalid."""
        return (
            validate_gravity(self.gravity),
            validate_damping(self.damping),
            validate_turning(self.turning),
            validate_shaking(self.shaking),
            validate_friction(self.friction),
        )


def validate_gravity(value: object) -> float:
    try:
        return as_float("gravity", value)
    except TypeError as error:
        raise TypeError(f"{error}: it is the acceleration along -e3, positive is down") from None


def validate_damping(given: ArrayLike | None) -> Vector:
    if given is None:
        return _STILL
    along = (
        (as_float("damping", given),) * 3
        if np.ndim(given) == 0
        else as_three_floats("damping", given)
    )
    if min(along) < 0.0:
        raise ValueError(
            f"damping must not be negative, not {short_repr(given)}: it removes energy"
        )
    return along


def validate_turning(given: ArrayLike | None) -> Vector:
    return _STILL if given is None else as_three_floats("turning", given)


def validate_shaking(given: ArrayLike | None) -> Vector:
    if given is None:
        return _STILL
    if np.ndim(given) == 0:
        raise TypeError(f"shaking must be {_SHAKING_FORM}, not {short_repr(given)}")
    amplitude, rate, phase = as_three_floats("shaking", given)
    if rate < 0.0 or (amplitude and not rate):
        raise ValueError(
            f"shaking needs a positive rate, not {short_repr(rate)}: shaking is "
            "(amplitude, rate, phase)"
        )
    return amplitude, rate, phase


def validate_friction(given: object) -> float:
    friction = 0.0 if given is None else as_float("friction", given)
    if friction < 0.0:
        raise ValueError(
            f"friction must not be negative, not {short_repr(given)}: it removes energy"
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
    present = {
        "damping": _has_nonzero_element(tops.damping),
        "friction": _has_nonzero_element(tops.friction),
        "a shaken support": _has_nonzero_element(amplitudes),
        "a turning support": _has_nonzero_element(tops.turning),
    }
    return [name for name, is_there in present.items() if is_there]


def _has_nonzero_element(values: Any) -> bool:
    """Return True if a number, tuple or array has a nonzero element."""
    if type(values) is tuple:
        return any(values)
    return values != 0.0 if type(values) is float else bool(np.any(values))


def refuse_disturbances(
    tops: Any, what: str, allowed: Iterable[str] = (), reason: str = ""
) -> None:
    """Raise ValueError if a scene or an ensemble has disturbances other than those in `allowed`.

    The message consists of `what`, the names of the disturbances that are not allowed, and
    `reason`. If the only disturbance is a rotation of the support about e3, a hint to use the
    inertial frame replaces `reason`.
    """
    found = [name for name in list_disturbances(tops) if name not in allowed]
    if not found:
        return
    is_upright = found == ["a turning support"] and not np.any(np.asarray(tops.turning)[..., :2])
    if is_upright:
        reason = "replace(turning=None) gives the same motion, seen from the inertial frame"
    raise ValueError(f"{what} with {' and '.join(found)}{': ' if reason else ''}{reason}")


def validate_ensemble_environment(
    given: PhysicalEnvironment,
) -> tuple[list[BatchParameter], dict[str, Array]]:
    """Parse the environment parameters of an ensemble, and convert them to columns.

    Optional parameters that are None are omitted.
    """
    down, (drag, along) = (
        validate_parameter("gravity", given.gravity),
        _validate_dampings(given.damping),
    )
    told, columns = [down, drag], {"gravity": down.values, "damping": along}
    words: tuple[tuple[str, ArrayLike | None, Callable[[Any], object]], ...] = (
        ("turning", given.turning, validate_turning),
        ("shaking", given.shaking, validate_shaking),
        ("friction", given.friction, validate_friction),
    )
    for name, value, check in words:
        own = () if name == "friction" else (3,)
        if value is None:
            columns[name] = np.zeros(own)
            continue
        made = validate_parameter(name, value, own)
        _raise_if_parameter_invalid(made, check)
        told.append(made)
        columns[name] = made.values
    return told, columns


def _raise_if_parameter_invalid(made: BatchParameter, check: Callable[[Any], object]) -> None:
    """Raise the exception that `check` raises for the first invalid value."""
    values = made.values
    bad = np.zeros(made.shape, dtype=np.bool_)
    if made.name == "friction":
        bad = values < 0.0
    elif made.name == "shaking":
        amplitude, rate = values[..., 0], values[..., 1]
        bad = (rate < 0.0) | (amplitude != 0.0) & (rate == 0.0)
    if np.any(bad):
        made.raise_error_of_first_bad_value(bad, lambda _, one: check(one))


def _validate_dampings(given: ArrayLike | BatchParameter | None) -> tuple[BatchParameter, Array]:
    """Parse `damping`; return the parameter and the damping constants along the principal axes."""
    nothing = np.zeros(3)
    if given is None:
        return BatchParameter("damping", nothing, (3,)), nothing
    if isinstance(given, BatchParameter):
        made = given
        along = np.broadcast_to(made.values, (*made.values.shape[:-1], 3))
    elif np.ndim(given) == 0:
        made = validate_parameter("damping", given)
        along = np.repeat(made.values, 3)
        made = BatchParameter("damping", along, (3,))
    else:
        width = np.shape(given)[-1:]
        made = validate_parameter(
            "damping", given, width if width == (1,) else (3,), "3 numbers, or 1"
        )
        along = np.broadcast_to(made.values, (*made.shape, 3))
    negative = (made.values < 0.0).any(axis=-1)
    if negative.any():
        made.raise_error_of_first_bad_value(negative, lambda _, one: validate_damping(one))
    return made, along
