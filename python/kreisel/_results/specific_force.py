"""Readings of body-mounted gyroscopes and accelerometers.

Let U be the angular velocity relative to the support, and O the angular velocity of the support,
both in the body frame. Then W = U + O is the angular velocity in the inertial frame. Since O is
constant in the turning space, O' = O x U and W' = U' + O x U.
"""

from __future__ import annotations

import numpy as np

from .._options.quantities import QuantityDescription
from .._utils.validation import Array

SPECIFIC_FORCE = QuantityDescription(
    "specific_force",
    3,
    [f"specific_force_{axis}" for axis in "xyz"],
    False,
    "L T^-2",
    "acceleration of a point of the body minus that of gravity, seen from the frame of the body",
)


def specific_force(
    change: Array, rate: Array, vertical: Array, weight: float | Array, place: Array
) -> Array:
    """Return the specific force W' x r + W x (W x r) + g V at the position r in the body frame.

    weight  g, the acceleration by gravity and by the shaking of the support, a number or (n,)
    """
    support_force = np.asarray(weight)[..., None] * vertical
    force: Array = np.cross(change, place) + np.cross(rate, np.cross(rate, place)) + support_force
    return force
