"""Volume, second moments and centre of mass of homogeneous shapes.

Let s_x, s_y, s_z be the means of x^2, y^2, z^2 over the volume, about the centre of mass. The
moments of inertia about the centre of mass are then mass * (s_y + s_z) and its cyclic permutations
(Goldstein, Classical Mechanics, ch. 5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Generic

import numpy as np

from .._utils.validation import R, as_positive


@dataclass(frozen=True)
class ShapeMoments(Generic[R]):
    """Volume, second moments and centre of mass of a shape."""

    name: str
    volume: R  # [L^3]; 0 for a thin shape
    squares: tuple[R, R, R]  # means of x^2, y^2, z^2 about the centre of mass [L^2]
    height: R  # height of the centre of mass above the origin of the pivot's coordinates [L]

    @property
    def has_volume(self) -> bool:
        """True if the shape, or at least one shape of an array, has a volume."""
        return bool(np.any(self.volume))

    def compute_mass(self, density: R) -> R:
        """Return the mass of the shape with the given density."""
        return density * self.volume

    def compute_moments(self, mass: R) -> tuple[R, R, R]:
        """Return the three moments of inertia about the centre of mass."""
        x, y, z = self.squares
        xx, yy, zz = mass * x, mass * y, mass * z
        return yy + zz, zz + xx, xx + yy


@dataclass(frozen=True)
class CuboidMoments(Generic[R]):
    """Volume and second moments of a cuboid, computed by the same operations as in the C code."""

    half: tuple[R, R, R]  # half the lengths of the edges [L]

    @property
    def name(self) -> str:
        """The name of the shape in error messages."""
        return "cuboid"

    @property
    def has_volume(self) -> bool:
        """True, because a cuboid has edges of positive length and therefore a positive volume."""
        return True

    @property
    def height(self) -> R:
        """The height of the centre of mass above the origin of the pivot's coordinates, zero."""
        return 0.0 * self.half[2]

    def compute_mass(self, density: R) -> R:
        """Return the mass of the cuboid with the given density."""
        a, b, c = self.half
        return 8.0 * density * a * b * c

    def compute_moments(self, mass: R) -> tuple[R, R, R]:
        """Return the three moments of inertia about the centre of mass."""
        a, b, c = self.half
        third = mass / 3.0
        xx, yy, zz = third * a * a, third * b * b, third * c * c
        return yy + zz, zz + xx, xx + yy


def compute_shape_mass(
    shape: ShapeMoments[float] | CuboidMoments[float], mass: float | None, density: float | None
) -> float:
    """Return the mass of a shape from exactly one of `mass` and `density`."""
    check_mass_xor_density(shape, mass, density)
    if density is None:
        return as_positive("mass", mass)
    total_mass = shape.compute_mass(as_positive("density", density))
    return as_positive(f"mass of the {shape.name}", total_mass)


def check_mass_xor_density(
    shape: ShapeMoments[R] | CuboidMoments[R], mass: object, density: object
) -> None:
    """Raise ValueError unless a shape has a mass or, if it has a volume, a density."""
    if (mass is None) == (density is None):
        correction = "not both" if mass is not None else "not none"
        raise ValueError(f"give exactly one of mass and density of the {shape.name}, {correction}")
    if density is not None and not shape.has_volume:
        raise ValueError(f"the {shape.name} is thin and has no volume: give its mass")


def cuboid(half: tuple[R, R, R]) -> CuboidMoments[R]:
    """Return the shape of a solid cuboid with the half-edge lengths `half`."""
    return CuboidMoments(half)


def cylinder(radius: R, height: R) -> ShapeMoments[R]:
    """Return the shape of a solid cylinder whose axis is the third axis."""
    r, h = radius, height
    side = r * r / 4.0
    return ShapeMoments("cylinder", math.pi * r * r * h, (side, side, h * h / 12.0), 0.0 * h)


def tube(inner: R, outer: R, height: R) -> ShapeMoments[R]:
    """Return the shape of a cylinder with a round hole along its axis, 0 <= inner <= outer."""
    hole, r, h = inner, outer, height
    side = (r * r + hole * hole) / 4.0
    volume = math.pi * (r - hole) * (r + hole) * h
    return ShapeMoments("tube", volume, (side, side, h * h / 12.0), 0.0 * h)


def disk(radius: R) -> ShapeMoments[R]:
    """Return the shape of a thin round disk perpendicular to the third axis."""
    side = radius * radius / 4.0
    return ShapeMoments("disk", 0.0 * radius, (side, side, 0.0 * radius), 0.0 * radius)


def rod(length: R) -> ShapeMoments[R]:
    """Return the shape of a thin straight rod along the third axis."""
    nothing = 0.0 * length
    return ShapeMoments("rod", nothing, (nothing, nothing, length * length / 12.0), nothing)


def sphere(radius: R, shell: bool) -> ShapeMoments[R]:
    """Return the shape of a solid sphere, or of a thin spherical shell."""
    r = radius
    side = r * r / (3.0 if shell else 5.0)
    volume = 0.0 * r if shell else 4.0 / 3.0 * math.pi * r * r * r
    return ShapeMoments("shell" if shell else "sphere", volume, (side, side, side), 0.0 * r)


def ellipsoid(half: tuple[R, R, R]) -> ShapeMoments[R]:
    """Return the shape of a solid ellipsoid with the semi-axes `half`."""
    a, b, c = half
    volume = 4.0 / 3.0 * math.pi * a * b * c
    return ShapeMoments("ellipsoid", volume, (a * a / 5.0, b * b / 5.0, c * c / 5.0), 0.0 * c)


def cone(radius: R, height: R) -> ShapeMoments[R]:
    """Return the shape of a solid circular cone that stands on its tip at the origin."""
    r, h = radius, height
    side, axial = 0.15 * r * r, 0.0375 * h * h
    return ShapeMoments("cone", math.pi / 3.0 * r * r * h, (side, side, axial), 0.75 * h)
