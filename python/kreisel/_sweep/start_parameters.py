"""The component names of parameters that can vary in a sweep."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .._model.broadcasting import BatchParameter, Shape
from .._utils.errors import unknown_name_message
from .._utils.validation import as_finite_array

_AXES, _TURNS = "xyz", "012"
_ENDINGS: dict[str, Sequence[str]] = {  # {parameter: the endings of the names of its components}
    **dict.fromkeys(["mass", "gravity", "friction", "spin", "tilt", "precession"], ""),
    **dict.fromkeys(
        ["com", "rotor", "turning", "momentum", "velocity", "body_momentum", "body_velocity"], _AXES
    ),
    **dict.fromkeys(["inertia", "angles", "rates", "damping"], _TURNS),
    "shaking": ("amplitude", "rate", "phase"),
    "attitude": "wxyz",
    "attitude_xyzw": "xyzw",
}
FLAGS = "steady", "fast", "degrees"
PARAMETERS = tuple(_ENDINGS)


def validate_sweep_parameter(name: str, numbers: object) -> BatchParameter:
    """Validate the values of the parameter `name`, and return them as an array.

    Raises ValueError for an unknown name, and TypeError or ValueError for invalid values.
    """
    if name not in _ENDINGS:
        raise ValueError(unknown_name_message("parameter", name, [*PARAMETERS, *FLAGS]))
    n = len(_ENDINGS[name])
    description = f"{n} numbers, or rows of {n} numbers" if n else "a number, or a list of numbers"
    values = as_finite_array(name, numbers, description)
    shape = values.shape
    if name == "inertia" and shape[-2:] == (3, 3):
        return BatchParameter(name, values, (3, 3))
    if name == "damping" and not shape:
        return BatchParameter(name, values.repeat(3), (3,))
    if name == "damping" and shape[-1:] == (1,):
        return BatchParameter(name, values, (1,))
    value_shape = (n,) if n else ()
    if value_shape and shape[-1:] != value_shape:
        raise ValueError(f"{name} must be {description}, not of the shape {shape}")
    return BatchParameter(name, values, value_shape)


def list_component_groups(name: str) -> list[tuple[str, list[str]]]:
    """Return the parameters that have a component `name`, with the names of all their components.

    A parameter occurs several times if its value can have several shapes.
    """
    groups = []
    for parameter, endings in _ENDINGS.items():
        shapes: list[Shape] = [(len(endings),)] if endings else []
        shapes += [(3, 3)] if parameter == "inertia" else []
        for shape in shapes:
            names = list_parameter_component_names(parameter, shape)
            if name in names:
                groups.append((parameter, names))
    return groups


def list_parameter_component_names(name: str, value: Shape) -> list[str]:
    """Return the names of the components of a parameter, such as momentum_x.

    The argument `value` is the shape of the parameter's value for a single top, such as (3,) for a
    vector.
    """
    if not value:
        return [name]
    n, endings = math.prod(value), _ENDINGS.get(name, "")
    return [f"{name}_{endings[i] if len(endings) == n else i}" for i in range(n)]
