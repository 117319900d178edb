"""Random Kowalewski and Goryachev-Chaplygin tops for studies of their closed-form solutions.

The ratio of the principal moments is exactly 2 : 2 : 1 or 4 : 4 : 1, in any order. The initial
momenta are normally distributed, with scales from 0.1 to 10 in natural units. The centre of mass
lies in the plane of the two principal axes with equal moments of inertia; gravity may be positive
or negative.
"""

from itertools import permutations

import kreisel as kr
import numpy as np

ORDERS = tuple(permutations(range(3)))


def draw_top(rng, ratio):
    """Return a random scene with two equal principal moments, and its natural unit of time."""
    unit, order = 2.0 ** rng.integers(-3, 4), list(ORDERS[rng.integers(6)])
    inertia, com = np.empty(3), np.zeros(3)
    inertia[order] = ratio * unit, ratio * unit, unit
    direction = rng.normal(size=2) if rng.random() < 0.25 else np.eye(2)[rng.integers(2)]
    com[order[:2]] = direction * rng.choice([-1, 1]) * 2.0 ** rng.uniform(-2, 2)
    gravity = float(rng.choice([1.0, 9.81, -2.5]))
    reference = unit if ratio == 2 else ratio * unit
    tau = float(np.sqrt(reference / (abs(gravity) * np.linalg.norm(com))))
    attitude = rng.normal(size=4)
    momentum = rng.normal(size=3) * ratio * unit / tau * 10.0 ** rng.uniform(-1, 1)
    if ratio == 4:
        momentum[2] = 0.0
    body = kr.Body(1.0, tuple(inertia), tuple(com), unphysical=True)
    attitude /= np.linalg.norm(attitude)
    return kr.Scene(body, momentum=tuple(momentum), attitude=tuple(attitude), gravity=gravity), tau
