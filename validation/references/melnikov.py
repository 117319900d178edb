"""The width of the chaotic layer near the separatrix of a slightly asymmetric top.

An upright Lagrange top that spins too slowly to be stable falls, swings and becomes upright again.
Let the moments of inertia be I1 / (1 - e), I1 / (1 + e) and I3. For these moments, the axial
momentum c changes at the rate dc/dt = 2 e M1 M2 / I1. To first order in e, the change of c in a
swing is
    e A sin(2 psi),    A = -Re int (M1 + i M2)^2 dt / I1
Here psi is the spin angle at the lowest point of the swing. The Melnikov integral is evaluated
along the separatrix motion for which this angle psi is zero. Near the upright position, the
nutation angle grows exponentially at the rate s, while the spin angle changes at the constant rate
w. By Chirikov's criterion, motions with |c - <m, e3>| < 2 w e A / s are chaotic.

Sources: Melnikov, Transactions of the Moscow Mathematical Society 12 (1963) 1; Holmes and Marsden,
Indiana University Mathematics Journal 32 (1983) 273; Chirikov, Physics Reports 52 (1979) 263.
"""

from functools import cache
from math import acos, cos, sin, sqrt

import kreisel as kr
import numpy as np

I1, I3, VERTICAL = 1.0, 0.5, 1.0  # mass * gravity * |com| is 1; the top sleeps for <m, e3> >= 2
ESCAPE = sqrt(1.0 / I1 - VERTICAL**2 / (4.0 * I1**2))  # s in the formulas above [T^-1]
TURN = abs(VERTICAL / (2.0 * I1) - VERTICAL / I3)  # w in the formulas above [T^-1]
# duration of the return, in units of 1 / ESCAPE; number of points
LONG, POINTS = 18.0, 6001
PUSH, PUSHES = 1e-5, 16  # magnitude and number of directions of the horizontal momentum


def make_body(e):
    return kr.Body(1.0, (I1 / (1.0 - e), I1 / (1.0 + e), I3), (0.0, 0.0, 1.0), unphysical=True)


def lowest_scene():
    """Return the top at the lowest point of its motion along the separatrix."""
    tilt = acos(VERTICAL**2 / (2.0 * I1) - 1.0)
    transverse = VERTICAL * sin(tilt) / (1.0 + cos(tilt))
    attitude = (cos(tilt / 2.0), sin(tilt / 2.0), 0.0, 0.0)
    return kr.Scene(
        make_body(0.0), body_momentum=(0.0, transverse, VERTICAL), attitude=attitude, gravity=1
    )


@cache
def melnikov_amplitude():
    """Return the Melnikov amplitude A, integrated numerically along one half of the separatrix."""
    t = np.linspace(0.0, LONG / ESCAPE, POINTS)
    transverse = kr.solve(lowest_scene(), t, digits=20).body_momentum @ (1.0, 1.0j, 0.0)
    return -2.0 * float(np.trapezoid((transverse**2).real, t)) / I1


def layer_half_width():
    """Return the half-width of the chaotic layer, divided by the perturbation e."""
    return 2.0 * TURN * melnikov_amplitude() / ESCAPE


def measure_swings(e, n):
    """Return spin angles at the lowest points of swings, and axial momenta at the highest points.

    Several tops are pushed from the upright position and make n swings each. The spin angles have
    the shape (tops, n), and the momenta have the shape (tops, n + 1).
    """
    angles = np.linspace(0.0, np.pi, PUSHES, endpoint=False)
    transverse = PUSH * np.cos(angles), PUSH * np.sin(angles), np.full(PUSHES, VERTICAL)
    tops = kr.Scene(make_body(e), body_momentum=np.stack(transverse, axis=1), gravity=1)
    section = kr.section(tops, kr.events.nutation(), n=2 * n + 3).check()
    spin, axial, tilt = (
        values.reshape(PUSHES, -1)
        for values in (section.spin_angle, section.axial_momentum, section.nutation)
    )
    first = (tilt[:, 0] > tilt[:, 1]).astype(int)  # index of the first highest point
    indices = first[:, None] + 2 * np.arange(n + 1)
    high = np.take_along_axis(axial, indices, axis=1)
    return np.take_along_axis(spin, indices[:, :-1] + 1, axis=1), high
