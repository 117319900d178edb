"""The words of the starts in a sweep: of how many numbers a value is, what its components are
called in a table, and what unit they have."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._utils.errors import unknown_name_message
from .._utils.validation import Array, as_finite_array

Shape = tuple[int, ...]
_AXES, _TURNS = "xyz", "012"
_ENDINGS = {  # of components, by the word
    **dict.fromkeys(["mass", "gravity", "spin", "tilt", "precession"], ""),
    **dict.fromkeys(["com", "momentum", "velocity", "body_momentum", "body_velocity"], _AXES),
    **dict.fromkeys(["inertia", "angles", "rates", "damping"], _TURNS),
    "attitude": "wxyz",
    "attitude_xyzw": "xyzw",
}
_UNITS = {  # of the words of bodies, too
    **dict.fromkeys(["radius", "height", "half", "length", "inner", "outer", "pivot"], "L"),
    **dict.fromkeys(["i1", "i3", "inertia_about_com"], "M L^2"),
    "density": "M L^-3",
    "mass": "M",
    "inertia": "M L^2",
    "com": "L",
    "momentum": "M L^2 T^-1",
    "velocity": "T^-1",
    "body_momentum": "M L^2 T^-1",
    "body_velocity": "T^-1",
    "spin": "rad T^-1",
    "tilt": "rad",
    "precession": "rad T^-1",
    "angles": "rad",
    "rates": "rad T^-1",
    "gravity": "L T^-2",
    "damping": "M L^2 T^-1",
}
FLAGS = "steady", "fast", "degrees"
WORDS = tuple(_ENDINGS)


class ParameterValues(NamedTuple):
    """The values of a word, (..., *value)."""

    values: Array
    value: Shape

    @property
    def lead(self) -> Shape:
        """The dimensions before the shape of one value."""
        return self.values.shape[: self.values.ndim - len(self.value)]


def given(name: str, numbers: object) -> ParameterValues:
    """The values of a word, looked at for finite numbers in rows of the right length."""
    if name not in _ENDINGS:
        raise ValueError(unknown_name_message("word", name, [*WORDS, *FLAGS]))
    values = as_finite_array(name, numbers, _what(name))
    shape = values.shape
    if name == "inertia" and shape[-2:] == (3, 3):
        return ParameterValues(values, (3, 3))
    if name == "damping" and not shape:
        return ParameterValues(np.repeat(values, 3), (3,))
    if name == "damping" and shape[-1:] == (1,):
        return ParameterValues(values, (1,))
    own = () if not _ENDINGS[name] else (len(_ENDINGS[name]),)
    if own and shape[-1:] != own:
        raise ValueError(f"{name} must be {_what(name)}, not of the shape {shape}")
    return ParameterValues(values, own)


def _what(name: str) -> str:
    n = len(_ENDINGS[name])
    return f"{n} numbers, or rows of {n} numbers" if n else "a number, or a list of numbers"


def components(name: str, value: Shape) -> list[str]:
    """Return the names of the numbers of a value: spin, or momentum_x, momentum_y, ..."""
    n = int(np.prod(value, dtype=np.int64))
    endings = _ENDINGS.get(name, "")
    if not value:
        return [name]
    return [f"{name}_{endings[i] if len(endings) == n else i}" for i in range(n)]


def unit(name: str, degrees: bool) -> str:
    """The dimension [M L T] of a word; angles have theirs in its place."""
    known = _UNITS.get(name, "")
    return known.replace("rad", "deg") if degrees else known
