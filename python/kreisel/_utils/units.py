"""Units of angles and their rates, and of the parameters of scenes and bodies.

An angle is in rad, an angular velocity in rad/T and an angular acceleration in rad/T^2, or with deg
in place of rad. The units of all other numbers are dimensions in terms of M, L and T. The units of
quantities are in csrc/quantities.def.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping

import numpy as np

from .validation import Array, as_bool

RADIANS_PER_DEGREE = math.pi / 180.0
PARAMETER_UNITS: Mapping[str, str | tuple[str, ...]] = {
    **dict.fromkeys(["radius", "height", "half", "length", "inner", "outer", "pivot"], "L"),
    **dict.fromkeys(["i1", "i3", "inertia_about_com", "inertia", "moments"], "M L^2"),
    **dict.fromkeys(["com", "lever"], "L"),
    **dict.fromkeys(["rotor", "momentum", "body_momentum", "damping"], "M L^2 T^-1"),
    **dict.fromkeys(["velocity", "body_velocity", "turning"], "rad/T"),
    **dict.fromkeys(["spin", "precession", "rates"], "rad/T"),
    **dict.fromkeys(["tilt", "angles"], "rad"),
    "density": "M L^-3",
    "mass": "M",
    "gravity": "L T^-2",
    "shaking": ("L", "rad/T", "rad"),
    "friction": "M L^2 T^-2",
}
_ANGULAR = re.compile(r"(rad|deg|°)(?:ians?|rees?)?\s*(.*)")  # the unit of an angle, and the rest
_HEAD = re.compile(r"(.*\S)\s*\[([^\[\]]*)\]")  # the name and the unit in the head of a column


def is_angular(unit: str) -> bool:
    """Return True if `unit` is that of an angle, or of its derivative by time."""
    return unit.startswith("rad")


def get_angular_unit(unit: str, degrees: bool) -> str:
    """Return `unit` with deg in place of rad if `degrees` is True."""
    return unit.replace("rad", "deg") if degrees else unit


def get_parameter_unit(name: str, degrees: bool, component: int | None = None) -> str:
    """Return the unit of a parameter, in which deg replaces rad if `degrees` is True.

    The three components of `shaking` have different units; without `component`, all three are
    listed.
    """
    unit = PARAMETER_UNITS.get(name, "")
    if not isinstance(unit, str):
        unit = ", ".join(unit) if component is None else unit[component]
    return get_angular_unit(unit, degrees)


def convert_parameter_to_radians(name: str, values: Array) -> Array:
    """Convert the angles and rates of a parameter from degrees, with the rounding of math.radians.

    The values of parameters that are not angular are returned unchanged.
    """
    unit = PARAMETER_UNITS.get(name, "")
    units = [unit] if isinstance(unit, str) else unit
    if not any(map(is_angular, units)):
        return values
    factors = np.array([RADIANS_PER_DEGREE if is_angular(one) else 1.0 for one in units])
    product: Array = values * (factors[0] if len(factors) == 1 else factors)
    return product


def _find_order(unit: str) -> int | None:
    """Return the order of the derivative of an angle that has this unit, or None for others."""
    match = _ANGULAR.fullmatch(unit)
    if match is None:
        return None
    return 0 if not match[2] else 2 if re.search("[2²]", match[2]) else 1


def find_unit_of_angles(columns: Iterable[tuple[str, str, str]], degrees: bool | None) -> bool:
    """Return True if the angles and rates of a table are in degrees.

    `columns` has the name of each column, the unit that its head states, and the unit of the
    quantity that it contains. If no head states a unit, `degrees` decides. Raises ValueError if
    heads contradict each other, `degrees` or a quantity.
    """
    if degrees is not None:
        as_bool("degrees", degrees)
    stated: dict[bool, str] = {}
    for name, unit, expected in columns:
        match = _ANGULAR.fullmatch(unit)
        if match is None and (not is_angular(expected) or len(unit) < 2):
            continue  # as body_velocity [x]
        if match is None or _find_order(unit) != _find_order(expected):
            right = f"{expected} or {get_angular_unit(expected, True)}" if expected else "no unit"
            raise ValueError(f"the column {name!r} is in {unit}, but it must be in {right}")
        stated[match[1] != "rad"] = name
    if len(stated) == 2:
        raise ValueError(
            f"the column {stated[False]!r} is in radians, but {stated[True]!r} is in degrees"
        )
    if stated and degrees not in (None, *stated):
        given = "degrees" if degrees else "radians"
        raise ValueError(
            f"degrees={degrees} contradicts the column {stated[not degrees]!r}, whose head says "
            f"that it is not in {given}"
        )
    return bool(degrees) if not stated else True in stated


def format_column_head(name: str, unit: str) -> str:
    """Return the head of a column, as 'spin [deg/T]', or the name alone if there is no unit."""
    return f"{name} [{unit}]" if unit else name


def split_column_head(head: str) -> tuple[str, str]:
    """Return the name and the unit in the head of a column, or an empty string without a unit."""
    match = _HEAD.fullmatch(head.strip())
    return (match[1], match[2].strip()) if match else (head.strip(), "")
