"""Conversion of Lagrange tops to the units of length and mass of Bobenko and Suris."""

from dataclasses import dataclass
from math import hypot

import kreisel as kr
import numpy as np


@dataclass(frozen=True)
class Units:
    """The units of length [L] and mass [M]; the unit of time does not change."""

    length: float
    mass: float

    def into(self, scene):
        """Convert a scene without rotor, damping, friction and moving support to these units."""
        body, moment = scene.body, self.mass * self.length**2
        scaled = kr.Body(
            body.mass / self.mass,
            np.array(body.inertia) / moment,
            np.array(body.com) / self.length,
            unphysical=body.unphysical,
        )
        return scene.replace(
            body=scaled,
            momentum=np.array(scene.momentum) / moment,
            gravity=scene.gravity / self.length,
        )


def scaled_units(body):
    """Return the units of length |com| and of mass I1 / |com|^2, in which |a| = 1 and I1 = 1."""
    i1, _ = lagrange_moments(body)
    length = hypot(*body.com)
    return Units(length, i1 / length**2)


def h_eps(path, step):
    """Return the conserved quantity H_eps of the Bobenko-Suris method in scaled units [T^-2].

    In the notation of the thesis (6.1.4),

        H_eps = |m|^2 / 2 + <p, a> + step / 2 <a x m, p>

    The energy is I1 (|m|^2 / 2 + <p, a> + (1 / alpha - 1) <m, a>^2 / 2). The states of `path` may
    be given in any consistent units.
    """
    i1, i3 = lagrange_moments(path.scene.body)
    axial = (path.axial_momentum / i1) ** 2 / 2.0
    return path.modified_energy(step) / i1 - (i1 / i3 - 1.0) * axial


def lagrange_moments(body):
    """Return the moments of inertia I1 = I2 and I3 of a Lagrange top."""
    if body.kind != "lagrange":
        raise ValueError(
            f"the scaled units are for Lagrange tops, not for a body of kind {body.kind!r}"
        )
    moments = body.moments
    odd = int(np.argmax(np.abs(body.principal_com)))
    return moments[odd - 1], moments[odd]
