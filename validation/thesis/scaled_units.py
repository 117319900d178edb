"""Conversion of Lagrange tops to the units of length and mass of Bobenko and Suris.

The scaled units are described in section 4.2.1 of the thesis (Bodack 2008).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import kreisel as kr
import numpy as np


@dataclass(frozen=True)
class Units:
    """The units of length [L] and mass [M] in the Bobenko-Suris form of the equations.

    The unit of time is the same in both systems of units.
    """

    length: float
    mass: float

    def into(self, scene: kr.Scene) -> kr.Scene:
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


def scaled_units(body: kr.Body) -> Units:
    """Return the units of length |com| and of mass I1 / |com|^2, in which |a| = 1 and I1 = 1.

    For the cuboid of the thesis, I1 = M (C_N^2 + 4 C_T^2) / 3. Therefore, alpha = 2 C_N^2 / (C_N^2
    + 4 C_T^2), and momenta are multiplied by 1 / I1. The mass is not 1 but 3 C_T^2 / (C_N^2 + 4
    C_T^2). In the thesis, the mass is omitted as a factor of p. Raises ValueError if the body is
    not a Lagrange top.
    """
    i1, _ = _lagrange_moments(body)
    length = hypot(*body.com)
    return Units(length, i1 / length**2)


def h_eps(path: kr.Path, step: float) -> np.ndarray:
    """Return the conserved quantity H_eps of the Bobenko-Suris method in scaled units [T^-2].

    In the notation of the thesis (6.1.4),

        H_eps = |m|^2 / 2 + <p, a> + step / 2 <a x m, p>

    The energy is I1 (|m|^2 / 2 + <p, a> + (1 / alpha - 1) <m, a>^2 / 2), whose last term is
    constant. The states of `path` may be given in any consistent units.
    """
    i1, i3 = _lagrange_moments(path.scene.body)
    value: np.ndarray = (
        path.modified_energy(step) / i1 - (i1 / i3 - 1.0) * (path.axial_momentum / i1) ** 2 / 2.0
    )
    return value


def _lagrange_moments(body: kr.Body) -> tuple[float, float]:
    """Return the moments of inertia I1 = I2 and I3 of a Lagrange top."""
    if body.kind != "lagrange":
        raise ValueError(
            f"the scaled units are for Lagrange tops, not for a body of kind {body.kind!r}"
        )
    moments = body.moments
    odd = int(np.argmax(np.abs(body.principal_com)))
    return moments[odd - 1], moments[odd]
