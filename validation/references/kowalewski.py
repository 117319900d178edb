"""The motions of a Kowalewski top with given energy and vertical momentum.

Motions are classified by the critical values of the integral K, at which the invariant tori change
their topology.

Let the moments be 2, 2 and 1, and let mass * gravity * |com| = 1. Let h be the energy, and let g =
<m, e3> / sqrt(2). The critical values are
    K = 0                                 where h > g^2
    K = (h - g^2)^2                       where g^2/2 - 1 <= h <= g^2 + 1/(2 g^2)
    K = 1 + t g + t^4/4                   where h = t^2/2 - g/t, t < 0 or t > g
if K attains them. K is never negative. If h < g^2, K is at least (h - g^2)^2. Within each of ten
regions of the (g, h) plane, the order of the critical values by size does not change.

Sources: Kharlamov, Topological analysis of integrable problems of rigid body dynamics, 1988;
Bolsinov, Richter and Fomenko, Sbornik: Mathematics 191 (2000) 151. The ten energies and vertical
momenta are taken from Dullin, Juhnke and Richter, International Journal of Bifurcation and Chaos 4
(1994) 1535.
"""

import kreisel as kr
import numpy as np

BODY = kr.Body(1.0, (2.0, 2.0, 1.0), (1.0, 0.0, 0.0), unphysical=True)
REGIONS = (  # a point (g, h) in each of the ten regions
    (0.9, 0.2),
    (0.57, 0.67),
    (0.12, 0.72),
    (0.28, 1.74),
    (1.0, 3.0),
    (1.228, 1.736),
    (1.27, 1.862),
    (1.289, 1.82),
    (1.404, 2.04),
    (2.23, 4.09),
)


def vertical_momentum(g):
    """Return the vertical momentum <m, e3>, computed from g = <m, e3> / sqrt(2)."""
    return np.sqrt(2.0) * g


def critical_values(g, h):
    """Return the critical values of the integral K that motions attain, in ascending order.

    Each critical value is paired with the number (1 to 3) of the formula from which it is computed.
    """
    parabola = (h - g * g) ** 2
    values = [(0.0, 1)] if h > g * g else []
    if g * g / 2.0 - 1.0 <= h and 2.0 * g * g * (h - g * g) <= 1.0:
        values.append((parabola, 2))
    for t in np.roots((0.5, 0.0, -h, -g)):
        if abs(t.imag) < 1e-9 and (t.real < 0.0 or t.real > g):
            values.append((float(1.0 + t.real * g + t.real**4 / 4.0), 3))
    least = 0.0 if h > g * g else parabola
    return sorted(value for value in values if value[0] >= least)


def region_borders(greatest):
    """Return the curves that divide the plane of g and h into regions, up to g = `greatest`."""
    g = np.linspace(1e-3, greatest, 400)
    t = np.linspace(0.3, np.sqrt(2.0), 200)
    is_outside = g**2 > 1e-2
    curves = [
        (g, g**2 / 2.0 - 1.0),
        (g, g**2 / 2.0 + 1.0),
        (g, g**2),
        (g[is_outside], g[is_outside] ** 2 + 1.0 / (2.0 * g[is_outside] ** 2)),
        (g[g < 0.75**-0.75], 1.5 * g[g < 0.75**-0.75] ** (2.0 / 3.0)),
        ((1.0 + t**4 / 4.0) / t, 0.75 * t**2 + 1.0 / t**2),
    ]
    return [(g, np.where(g <= greatest, h, np.nan)) for g, h in curves]
