"""Ordinary and degenerate motions of Lagrange tops and free bodies, to test closed forms."""

import math

import numpy as np

# The cuboid of the thesis, with lever = mass * gravity * com.
I1, I3, LEVER = 5.12 / 3 * 4.64, 5.12 / 3 * 1.28, 5.12
UPRIGHT, HANGING = (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)
CRITICAL = 2 * math.sqrt(LEVER * I1)  # critical axial momentum: with less, an upright top falls


def tilt_attitude(angle, axis=(0.0, 1.0, 0.0)):
    return (math.cos(angle / 2), *(math.sin(angle / 2) * x for x in axis))


def axis_of(q):
    w, x, y, z = q
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), w * w + z * z - x * x - y * y])


def precession_momentum(angle, axial, sign):
    """Return the angular momentum of a regular precession.

    The precession rate p is a root of I1 p^2 cos(angle) - axial p + lever = 0.
    """
    root = math.sqrt(axial**2 - 4 * I1 * LEVER * math.cos(angle))
    rate = (axial + sign * root) / (2 * I1 * math.cos(angle))
    a = axis_of(tilt_attitude(angle))
    return I1 * rate * (np.array([0, 0, 1]) - math.cos(angle) * a) + axial * a


def spin_momentum(q, axial, more=(0.0, 0.0, 0.0)):
    return axial * axis_of(q) + np.array(more)


LEANING = tilt_attitude(1.1)
ODD = (0.8, 0.4, -0.2, 0.4)
LAGRANGE = {  # I1, I3, lever, attitude, momentum
    "the thesis' top": (I1, I3, LEVER, UPRIGHT, (0.172, -1.862, 1.46)),
    "tilted": (I1, I3, LEVER, ODD, (0.172, -1.862, 14.6)),
    "no axial momentum": (I1, I3, LEVER, LEANING, np.cross(axis_of(LEANING), (0.3, 2.0, 0.5))),
    "from rest": (I1, I3, LEVER, LEANING, (0.0, 0.0, 0.0)),
    "planar, swinging": (I1, I3, LEVER, LEANING, (0.0, 1.5, 0.0)),
    "planar, over both poles": (I1, I3, LEVER, LEANING, (0.0, 40.0, 0.0)),
    "planar, separatrix": (
        I1,
        I3,
        LEVER,
        LEANING,
        (0.0, math.sqrt(2 * I1 * LEVER * (1 - math.cos(1.1))), 0.0),
    ),
    "through the upper pole": (I1, I3, LEVER, UPRIGHT, (3.0, -2.0, 5.0)),
    "through the lower pole": (I1, I3, LEVER, HANGING, (3.0, -2.0, 5.0)),
    "1e-9 from the upper pole": (I1, I3, LEVER, tilt_attitude(1e-9), (0.3, 0.2, 4.0)),
    "1e-9 from the lower pole": (I1, I3, LEVER, tilt_attitude(math.pi - 1e-9), (3.0, -2.0, 5.0)),
    "regular precession, slow": (
        I1,
        I3,
        LEVER,
        tilt_attitude(0.7),
        precession_momentum(0.7, 20.0, -1),
    ),
    "regular precession, fast": (
        I1,
        I3,
        LEVER,
        tilt_attitude(0.7),
        precession_momentum(0.7, 20.0, 1),
    ),
    "stable sleep, kicked": (I1, I3, LEVER, UPRIGHT, (1e-9, 0.0, 1.5 * CRITICAL)),
    "critical sleep, leaning 1e-5": (
        I1,
        I3,
        LEVER,
        tilt_attitude(1e-5),
        spin_momentum(tilt_attitude(1e-5), CRITICAL),
    ),
    "unstable sleep, leaning 1e-2": (
        I1,
        I3,
        LEVER,
        tilt_attitude(1e-2),
        spin_momentum(tilt_attitude(1e-2), 0.5 * CRITICAL),
    ),
    "unstable sleep, leaning 1e-5": (
        I1,
        I3,
        LEVER,
        tilt_attitude(1e-5),
        spin_momentum(tilt_attitude(1e-5), 0.5 * CRITICAL),
    ),
    "unstable sleep, leaning 1e-9": (
        I1,
        I3,
        LEVER,
        tilt_attitude(1e-9),
        spin_momentum(tilt_attitude(1e-9), 0.5 * CRITICAL),
    ),
    "unstable sleep, kicked 1e-9": (I1, I3, LEVER, UPRIGHT, (1e-9, 0.0, 0.5 * CRITICAL)),
    "hanging, leaning 1e-5": (
        I1,
        I3,
        LEVER,
        tilt_attitude(math.pi - 1e-5),
        spin_momentum(tilt_attitude(math.pi - 1e-5), 3.0),
    ),
    "spherical": (I1, I1, LEVER, ODD, (0.172, -1.862, 14.6)),
    "upside down": (I1, I3, -LEVER, ODD, (0.4, -2.0, 5.0)),
    "hardly any gravity": (I1, I3, 1e-9, ODD, (0.3, 0.7, 1.1)),
    "needle": (I1, 1e-6 * I1, LEVER, ODD, spin_momentum(ODD, 1e-6 * I1, (0.5, -1.0, 0.3))),
    "disc": (I1, 2 * I1, LEVER, ODD, (4.0, -2.0, 15.0)),
    "spin 1e4": (I1, I3, LEVER, LEANING, spin_momentum(LEANING, 1e4 * I3)),
    "tumbling 1e4": (I1, I3, LEVER, LEANING, (1e4 * I1, 2e4, 3e4)),
    "1e-9 m": (5e-33, 2e-33, 3e-24, ODD, (1e-28, -4e-29, 2e-28)),
    "1e12 kg": (3e12, 1e12, 2e13, ODD, (4e12, -3e12, 9e12)),
}
EULER = {  # moments, attitude, momentum
    "free": ((1.0, 2.0, 2.5), ODD, (0.3, 0.7, 1.1)),
    "free, about the middle axis 1e-2": ((1.0, 2.0, 2.5), UPRIGHT, (0.01, 2.0, 0.02)),
    "free, about the middle axis 1e-9": ((1.0, 2.0, 2.5), UPRIGHT, (1e-9, 2.0, 2e-9)),
    "free, about the middle axis 1e-20": ((1.0, 2.0, 2.5), UPRIGHT, (1e-20, 2.0, 0.0)),
    "free, about the middle axis 1e-30": ((2.5, 1.0, 2.0), UPRIGHT, (0.0, -1e-30, -2.0)),
    "free, about the middle axis 1e-74": ((2.0, 2.5, 1.0), UPRIGHT, (2.0, 1e-74, -2e-74)),
    "free, nearly symmetric": ((1.0, 1.0 + 1e-10, 1.5), ODD, (0.3, 0.7, 1.1)),
    "free, nearly spherical": ((1.0, 1.0 + 1e-8, 1.0 + 3e-8), ODD, (0.3, 0.7, 1.1)),
    "free, a plate": ((1.0, 2.0, 3.0), ODD, (30.0, -70.0, 11.0)),
}
TRANSITS = {  # times at which a body that starts near its middle axis leaves this axis
    "free, about the middle axis 1e-20": (-106.0, 106.0),
    "free, about the middle axis 1e-30": (-156.5, 156.5),
    "free, about the middle axis 1e-74": (-382.0, 382.0),
}


def normalize(q):
    return tuple(float(x) for x in np.asarray(q, float) / np.linalg.norm(q))


def digits(case):
    """Return the number of digits needed to compute the reference solution."""
    least = min(abs(x) for x in case[-1] if x) / max(map(abs, case[-1]))
    return 50 if least > 1e-12 else 50 - int(5 * math.log10(least))


def is_lagrange(case):
    """Return True for a Lagrange top and False for a free rigid body."""
    return len(case) == 5


def inertia_and_lever(case):
    if is_lagrange(case):
        i1, i3, lever, *_ = case
        return (i1, i1, i3), lever
    return case[0], 0.0
