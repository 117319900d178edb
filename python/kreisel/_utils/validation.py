"""Validation of arguments, and their conversion to numbers and arrays."""

from __future__ import annotations

import contextlib
import math
import reprlib
import sys
from collections.abc import Sequence
from numbers import Integral, Real
from typing import Protocol, TypeVar

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class SupportsArray(Protocol):
    """An object that NumPy can convert to an array."""

    def __array__(self) -> npt.NDArray[np.generic]: ...


Numbers = (
    float | SupportsArray | Sequence[float] | Sequence[SupportsArray]
)  # a number or a sequence of numbers, not a str

R = TypeVar("R", float, Array)  # a float, or an array of values

_PLAIN = {float, int, np.float64}
_T = TypeVar("_T")
_SHORT = reprlib.Repr()
_SHORT.maxlevel, _SHORT.maxstring, _SHORT.maxother = 2, 60, 80


def short_repr(value: object) -> str:
    """Return a short representation of a value for error messages."""
    if isinstance(value, np.ndarray) and value.size > 4:
        return f"an array of shape {value.shape}"
    try:
        return " ".join(_SHORT.repr(value).split())
    except ValueError:  # Python limits the digits of an int in a str
        return f"{type(value).__name__} with too many digits"


def validate_type(name: str, value: object, expected: type[_T]) -> _T:
    """Return `value` if it is an instance of `expected`; raise TypeError otherwise."""
    if not isinstance(value, expected):
        is_ensemble = getattr(type(value), "_one", None) is expected
        one = f": select one member by its index, as in {name}s[0]" if is_ensemble else ""
        raise TypeError(
            f"{name} must be a kreisel.{expected.__name__}, not {short_repr(value)}{one}"
        )
    return value


def has_unit_attribute(value: object) -> bool:
    return hasattr(value, "unit") or hasattr(value, "units")


def as_float(name: str, value: object) -> float:
    """Return `value` as a finite float."""
    if has_unit_attribute(value):
        raise TypeError(f"{name} must be a number without a unit, not {short_repr(value)}")
    scalar = value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if isinstance(scalar, bool) or not isinstance(scalar, Real):
        raise TypeError(f"{name} must be a number, not {short_repr(value)}")
    try:
        real = float(scalar)
    except OverflowError:
        real = math.inf
    if not math.isfinite(real):
        raise ValueError(f"{name} must be finite in double precision, not {short_repr(value)}")
    return real


def as_positive(name: str, value: object) -> float:
    """Return `value` as a finite, positive float."""
    real = as_float(name, value)
    if not real > 0.0:
        raise ValueError(f"{name} must be positive, not {short_repr(value)}")
    return real


def as_non_negative(name: str, value: object) -> float:
    """Return `value` as a finite, nonnegative float."""
    real = as_float(name, value)
    if not real >= 0.0:
        raise ValueError(f"{name} must not be negative, not {short_repr(value)}")
    return real


def as_int(name: str, value: object, least: int) -> int:
    """Return `value` as an integer n with least <= n < 2**63."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise TypeError(f"{name} must be a whole number, not {short_repr(value)}")
    n = int(value)
    if not least <= n < 2**63:
        raise ValueError(
            f"{name} must be at least {least} and less than 2**63, not {short_repr(value)}"
        )
    return n


def as_bool(name: str, value: object) -> bool:
    """Return `value` as a bool; raise TypeError if it is neither True nor False."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be True or False, not {short_repr(value)}")
    return bool(value)


def as_unit_name(name: str, value: object) -> str:
    """Return `value` as the name of a unit, which must be a nonempty, printable str."""
    if not isinstance(value, str):
        raise TypeError(f"{name} must be the name of a unit such as 's', not {short_repr(value)}")
    if not value.strip() or not value.isprintable():
        raise ValueError(f"{name} must be the name of a unit such as 's', not {short_repr(value)}")
    return value


def as_array(name: str, value: object, description: str) -> Array:
    """Convert `value` to a new array of doubles.

    Error messages describe the expected value by the text `description`.
    """
    # No array is masked unless numpy.ma is loaded; importing it only for this check is slow.
    if "numpy.ma" in sys.modules and np.ma.is_masked(value):
        raise TypeError(f"{name} must be {description} without masked values")
    kinds = set(map(type, value)) if isinstance(value, (list, tuple)) else set()
    if any(map(has_unit_attribute, (value, *kinds))):
        raise TypeError(
            f"{name} must be {description} without a unit: pass plain numbers in your units"
        )
    try:
        numbers = np.asarray(value)
    except ValueError:
        raise ValueError(f"{name} must be {description}, not {short_repr(value)}") from None
    if numbers.dtype.kind not in "iuf":
        raise TypeError(f"{name} must be {description}, not {short_repr(value)}")
    with np.errstate(over="ignore"):
        return numbers.astype(np.float64)


def as_finite_array(name: str, value: object, description: str) -> Array:
    """Convert `value` to a new array of finite doubles."""
    numbers = as_array(name, value, description)
    if not np.isfinite(numbers).all():
        if numbers.ndim == 0:
            raise ValueError(f"{name} must be finite, not {short_repr(value)}")
        index = tuple(map(int, np.argwhere(~np.isfinite(numbers))[0]))
        suffix = "".join(f"[{i}]" for i in index)
        raise ValueError(f"{name} must be finite, not {name}{suffix} = {numbers[index]}")
    return numbers


def as_float_list(name: str, value: object, n: int, description: str) -> list[float]:
    """Return `value` as a list of exactly `n` finite floats."""
    if (type(value) is tuple or type(value) is list) and _PLAIN.issuperset(map(type, value)):
        with contextlib.suppress(OverflowError):  # the common case: this is ten times as fast
            plain = [float(x) for x in value]
            if len(plain) == n and all(map(math.isfinite, plain)):
                return plain
    numbers = as_finite_array(name, value, description)
    if numbers.shape != (n,):
        raise ValueError(f"{name} must be {description}, not {short_repr(value)}")
    return [float(x) for x in numbers]


def as_three_floats(name: str, value: object) -> Vector:
    """Return `value` as three finite floats."""
    x, y, z = as_float_list(name, value, 3, "3 numbers")
    return x, y, z


def freeze_array(values: Array) -> Array:
    """Make the array `values` read-only, and return it."""
    values.flags.writeable = False
    return values


def freeze_arrays(value: object) -> None:
    """Make all arrays in `value` read-only, including those in tuples, lists and dictionaries."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    elif isinstance(value, (tuple, list)):
        for part in value:
            freeze_arrays(part)
    elif isinstance(value, dict):
        for part in value.values():
            freeze_arrays(part)


class ReadOnlyArrays:
    """Base class that keeps the arrays of copied and unpickled objects read-only."""

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        freeze_arrays(state)
