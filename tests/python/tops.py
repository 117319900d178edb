"""Tops and solver arguments shared by several test files."""

import kreisel as kr
import numpy as np
from kreisel import quaternion


def unit(q):
    return tuple((np.array(q) / np.linalg.norm(q)).tolist())


def matrix(q):
    """Return the rotation matrix of a quaternion."""
    return np.array([quaternion.turn(q, e) for e in np.eye(3).tolist()]).T


TILT = unit((0.8, 0.4, -0.2, 0.4))  # no torque acts on an upright top, which would hide errors
MOMENTUM = (0.172, -1.862, 1.46)
LAGRANGE = kr.Scene(
    kr.Body.cuboid(half=(0.8, 0.8, 1), pivot=(0, 0, -1)), momentum=MOMENTUM, gravity=1
)
CORNER = kr.Body.cuboid(half=(0.6, 0.8, 1), pivot=(0.1, -0.2, -1))  # no two moments are equal
GENERAL = kr.Scene(CORNER, momentum=MOMENTUM, attitude=TILT, gravity=1)
FREE = kr.scenes.dzhanibekov
WILD = kr.scenes.thesis.replace(attitude=TILT, momentum=(5, -10, 5))  # too fast for steps of 0.5


def scene_for(method):
    return next(s for s in (kr.scenes.thesis, FREE) if kr.methods[method].suits(s))


def words_for(method):
    return {} if kr.methods[method].adaptive else {"step": 0.0625}


def random_starts(n, seed):
    """Return `n` random attitudes and momenta."""
    rng = np.random.default_rng(seed)
    q = rng.standard_normal((n, 4))
    return q / np.linalg.norm(q, axis=1)[:, None], rng.standard_normal((n, 3))
