"""Computation of the Poincare sections shown in the report."""

import kreisel as kr
import numpy as np

from ..references import kowalewski

ENERGY, VERTICAL = 1.6, 0.6
MANY = 60  # number of random candidates for each start
BODIES = {  # bodies, in order of their deviation from a Lagrange top
    "a Lagrange top": ((1.0, 1.0, 0.6), 0.0),
    "moments 2 % apart": ((1.0, 1.02, 0.6), 0.0),
    "8 %": ((1.0, 1.08, 0.6), 0.0),
    "20 %": ((1.0, 1.2, 0.6), 0.0),
    "40 %": ((1.0, 1.4, 0.6), 0.0),
    "59 %, the centre of mass aside": ((1.0, 1.59, 0.6), 0.3),
}


def make_body(name):
    moments, offset = BODIES[name]
    return kr.Body(1.0, moments, (offset, 0.0, 1.0), unphysical=True)


def compute_section(name, orbits, crossings):
    """Return the Poincare section of random orbits with equal energy and vertical momentum."""
    tops = kr.starts(make_body(name), energy=ENERGY, vertical=VERTICAL, n=orbits, seed=2, gravity=1)
    return kr.section(tops, n=crossings).check()


def compute_kowalewski_section(region, orbits, crossings):
    """Return the Poincare section of orbits with nearly evenly spaced values of K^(1/4)."""
    g, h = kowalewski.REGIONS[region]
    tops = kr.starts(
        kowalewski.BODY,
        energy=h,
        vertical=kowalewski.vertical_momentum(g),
        n=MANY * orbits,
        seed=1,
        gravity=1,
    )
    K = kr.solve(tops, [0.0], want=["kowalewski"]).kowalewski[:, 0] ** 0.25
    levels = np.linspace(K.min(), K.max(), orbits)
    indices = np.abs(K[:, None] - levels).argmin(axis=0)
    return kr.section(tops[indices], n=crossings).check()


def average_by_orbit(section, values):
    """Replace all values on an orbit by their mean."""
    rows = values.reshape(len(section), -1)
    return np.repeat(rows.mean(axis=1), rows.shape[1])


def panel_data(section, colour):
    """Return the coordinates and the colours of the points in one panel."""
    return section.spin_angle, section.axial_momentum, colour
