"""The specific force at a point of the body, which an accelerometer measures."""

from __future__ import annotations

import numpy as np

from .._options.quantities import Quantity
from .._utils.validation import Array

SPECIFIC_FORCE = Quantity(
    "specific_force",
    3,
    [f"specific_force_{axis}" for axis in "xyz"],
    False,
    "L T^-2",
    "acceleration of a point of the body minus that of gravity, seen from the frame of the body",
)


def specific_force(change: Array, rate: Array, up: Array, gravity: float, place: Array) -> Array:
    """Return W' x r + W x (W x r) + g V at the place r, from W', W and the vertical V (n, 3)."""
    made: Array = np.cross(change, place) + np.cross(rate, np.cross(rate, place)) + gravity * up
    return made
