"""Tops of every kind that are not upright at the start."""

import kreisel as kr
import numpy as np

BODIES = {
    "lagrange": kr.Body.cuboid(half=(0.8, 0.8, 1), pivot=(0, 0, -1)),
    "kowalewski": kr.Body.cuboid(half=(3**0.5, 1, 0.5), pivot=(0, 0, -0.5)),
    "goryachev_chaplygin": kr.Body.cuboid(half=(7**0.5, 1, 0.5), pivot=(0, 0, -0.5)),
    "asymmetric": kr.Body.cuboid(half=(0.6, 0.8, 1), pivot=(0.1, -0.2, -1)),
    "free": kr.Body.cuboid(half=(0.6, 0.8, 1), pivot=(0, 0, 0)),
}
TILT = np.array([0.8, 0.4, -0.2, 0.4]) / np.linalg.norm([0.8, 0.4, -0.2, 0.4])


def tilt_scene(body, momentum=(0.172, -1.862, 1.46), gravity=1.0):
    """Return a scene in which the top is not upright.

    With an upright top, first-order errors would not be noticed, because no torque acts at the
    start.
    """
    return kr.Scene(BODIES[body], momentum=momentum, attitude=TILT, gravity=gravity)
