"""Scenes with one perturbed parameter, for finite differences in 30-digit arithmetic."""

from decimal import Decimal, localcontext

import numpy as np
from kreisel._core import record

# The indices of the numbers of a parameter among the 34 doubles of a scene in the core.
PLACES = {
    "moments": (1, 2, 3),
    "com": (4, 5, 6),
    "gravity": (15,),
    "mass": (0,),
    "damping": (24, 25, 26),
}
ATTITUDE, MOMENTUM = slice(17, 21), slice(21, 24)


def list_columns():
    """Return the name and component index of every tangent."""
    start = [("start", i) for i in range(6)]
    return start + [(name, i) for name, places in PLACES.items() for i in range(len(places))]


def change_number(scene, name, component, change):
    numbers = np.frombuffer(scene._block, dtype=float).copy()
    low = np.zeros(8)
    if name != "start":
        numbers[PLACES[name][component]] += change
    elif component >= 3:
        numbers[MOMENTUM][component - 3] += change
    else:
        numbers[ATTITUDE], low[1:5] = turn_attitude(numbers[ATTITUDE], component, change)
    return numbers.tobytes(), low


def turn_attitude(q, axis, angle):
    """Rotate the attitude `q` about a body axis, and return the high and low parts of the result.

    The actual rotation angle differs from `angle` only by terms of third order in `angle`.
    """
    with localcontext() as context:
        context.prec = 50
        half = [Decimal(0)] * 3
        half[axis] = Decimal(angle) / 2
        w, *v = (Decimal(float(x)) for x in q)
        x, y, z = half
        product = [
            w - v[0] * x - v[1] * y - v[2] * z,
            v[0] + w * x + v[1] * z - v[2] * y,
            v[1] + w * y + v[2] * x - v[0] * z,
            v[2] + w * z + v[0] * y - v[1] * x,
        ]
        length = sum(c * c for c in product).sqrt()
        high = [float(c / length) for c in product]
        low = [float(c / length - Decimal(h)) for c, h in zip(product, high, strict=True)]
    return high, low


def states_of(block, low, times):
    """Return the high and low parts of the states at `times`, computed in 30-digit arithmetic."""
    status, states, rest, *_ = record(
        block, "taylor", 0.0, 0.0, 30, 0, False, np.array(times), low=low if low.any() else None
    )
    assert status == "OK"
    return states[-len(times) :], rest[-len(times) :]
