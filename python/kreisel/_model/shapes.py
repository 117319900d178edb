"""Homogeneous shapes of the textbooks: volume, second moments, centre of mass.

With s = <x^2>, <y^2>, <z^2> about the centre of mass, the moments of inertia are mass (s_y + s_z)
and so on (Goldstein, Classical Mechanics, ch. 5).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._ground.arguments import Array, Vector, boolean, number, positive, vector


class Shape(NamedTuple):
    """A shape with its axis along the third."""

    name: str
    volume: float  # [L^3]; 0 for what is thin
    squares: Vector  # <x^2>, <y^2>, <z^2> about the centre of mass [L^2]
    com: Vector = (0.0, 0.0, 0.0)  # seen from the point from which the pivot is seen [L]

    def mass(self, mass: float | None, density: float | None) -> float:
        """Its mass, of exactly one of mass and density."""
        if (mass is None) == (density is None):
            both = "not both" if mass is not None else "not none"
            raise ValueError(f"give exactly one of mass and density of the {self.name}, {both}")
        if density is None:
            return positive("mass", mass)
        if not self.volume:
            raise ValueError(f"the {self.name} is thin and has no volume: give its mass")
        return positive(f"mass of the {self.name}", positive("density", density) * self.volume)

    def inertia(self, mass: float) -> Array:
        """About its centre of mass."""
        xx, yy, zz = (mass * s for s in self.squares)
        return np.diag((yy + zz, zz + xx, xx + yy))


def cylinder(radius: object, height: object) -> Shape:
    """Solid, round, its axis along the third."""
    r, h = positive("radius", radius), positive("height", height)
    side = r * r / 4.0
    return Shape("cylinder", math.pi * r * r * h, (side, side, h * h / 12.0))


def tube(inner: object, outer: object, height: object) -> Shape:
    """A cylinder with a round hole along its axis."""
    hole, r, h = number("inner", inner), positive("outer", outer), positive("height", height)
    if not 0.0 <= hole <= r:
        raise ValueError(f"inner must lie between 0 and outer = {r!r}, not {hole!r}")
    side = (r * r + hole * hole) / 4.0
    return Shape("tube", math.pi * (r - hole) * (r + hole) * h, (side, side, h * h / 12.0))


def disk(radius: object) -> Shape:
    """Round and thin, across the third axis."""
    r = positive("radius", radius)
    side = r * r / 4.0
    return Shape("disk", 0.0, (side, side, 0.0))


def rod(length: object) -> Shape:
    """Straight and thin, along the third axis."""
    whole = positive("length", length)
    return Shape("rod", 0.0, (0.0, 0.0, whole * whole / 12.0))


def sphere(radius: object, shell: object) -> Shape:
    """A ball, or a thin shell."""
    r = positive("radius", radius)
    thin = boolean("shell", shell)
    side = r * r / (3.0 if thin else 5.0)
    volume = 0.0 if thin else 4.0 / 3.0 * math.pi * r * r * r
    return Shape("shell" if thin else "sphere", volume, (side, side, side))


def ellipsoid(half: object) -> Shape:
    """Solid, of these half axes."""
    a, b, c = (positive("half", x) for x in vector("half", half))
    volume = 4.0 / 3.0 * math.pi * a * b * c
    return Shape("ellipsoid", volume, (a * a / 5.0, b * b / 5.0, c * c / 5.0))


def cone(radius: object, height: object) -> Shape:
    """Solid, round, from its tip up to its base."""
    r, h = positive("radius", radius), positive("height", height)
    side, along = 0.15 * r * r, 0.0375 * h * h
    volume = math.pi / 3.0 * r * r * h
    return Shape("cone", volume, (side, side, along), (0.0, 0.0, 0.75 * h))
