"""Angular momentum in space from any parameter that determines it.

For one top the components are floats; for an ensemble they are arrays.
"""

from __future__ import annotations

from .._utils.validation import R
from ..quaternion import multiply, turn, turn_back


def angular_momentum(
    name: str,
    moments: tuple[R, R, R],
    axes: tuple[R, R, R, R],
    q: tuple[R, R, R, R],
    v: tuple[R, R, R],
) -> tuple[R, R, R]:
    """Return the momentum in space for the value `v` of the parameter `name` at the attitude `q`.

    The body has the principal moments `moments` along the principal axes `axes`.
    """
    if name == "momentum":
        return v
    if name == "body_momentum":
        return turn(q, v)
    if name == "body_velocity":
        v = turn(q, v)
    principal = multiply(q, axes)
    x, y, z = turn_back(principal, v)
    i1, i2, i3 = moments
    return turn(principal, (i1 * x, i2 * y, i3 * z))
