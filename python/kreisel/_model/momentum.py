"""Conversion of velocities and momenta to the angular momentum in the space frame.

The components are floats for a single top, and arrays for an ensemble.
"""

from __future__ import annotations

from .._utils.validation import R
from ..quaternion import multiply, turn, turn_back


def compute_angular_momentum(
    name: str,
    moments: tuple[R, R, R],
    axes: tuple[R, R, R, R],
    q: tuple[R, R, R, R],
    v: tuple[R, R, R],
    rotor: tuple[R, R, R] | None = None,
    turning: tuple[R, R, R] | None = None,
) -> tuple[R, R, R]:
    """Compute the angular momentum in the space frame from one of the four initial conditions.

    `name` is the name of the given initial condition, and `v` is its value. `q` is the attitude,
    `moments` are the principal moments of inertia, and `axes` is the rotation from the principal
    axes to the body frame. `rotor` has components along the principal axes. If the support rotates
    with the angular velocity `turning` in space, velocities are relative to the support. Zero
    components of `rotor` and `turning` must be -0.0, because adding -0.0 leaves every
    floating-point number unchanged.
    """
    if name == "momentum":
        return v
    if name == "body_momentum":
        return turn(q, v)
    if name == "body_velocity":
        v = turn(q, v)
    if turning is not None:
        v = v[0] + turning[0], v[1] + turning[1], v[2] + turning[2]
    principal = multiply(q, axes)
    x, y, z = turn_back(principal, v)
    i1, i2, i3 = moments
    components = i1 * x, i2 * y, i3 * z
    if rotor is not None:
        components = components[0] + rotor[0], components[1] + rotor[1], components[2] + rotor[2]
    return turn(principal, components)
