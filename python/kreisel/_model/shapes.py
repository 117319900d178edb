"""Volume, second moments and centre of mass of homogeneous shapes.

Let s_x, s_y, s_z be the means of x^2, y^2, z^2 over the volume, about the centre of mass. The
moments of inertia about the centre of mass are then mass * (s_y + s_z) and its cyclic permutations
(Goldstein, Classical Mechanics, ch. 5).
"""

from __future__ import annotations

import math
from typing import Generic, NamedTuple

import numpy as np

from .._utils.validation import Array, R, as_positive


class ShapeMoments(NamedTuple, Generic[R]):
    """Volume, second moments and centre of mass of a shape."""

    name: str
    volume: R  # [L^3]; 0 for a thin shape
    squares: tuple[R, R, R]  # means of x^2, y^2, z^2 about the centre of mass [L^2]
    height: R  # height of the centre of mass above the origin of the pivot's coordinates [L]


def compute_moments_about_com(shape: ShapeMoments[R], mass: R) -> tuple[R, R, R]:
    """Return the three moments of inertia about the centre of mass."""
    x, y, z = shape.squares
    xx, yy, zz = mass * x, mass * y, mass * z
    return yy + zz, zz + xx, xx + yy


def compute_shape_mass(
    shape: ShapeMoments[float], mass: float | None, density: float | None
) -> float:
    """Return the mass of a shape from exactly one of `mass` and `density`."""
    check_mass_xor_density(shape.name, mass, density)
    if density is None:
        return as_positive("mass", mass)
    if not shape.volume:
        raise ValueError(density_without_volume_message(shape.name))
    return as_positive(f"mass of the {shape.name}", as_positive("density", density) * shape.volume)


def check_mass_xor_density(name: str, mass: object, density: object) -> None:
    """Raise ValueError unless exactly one of `mass` and `density` is given."""
    if (mass is None) == (density is None):
        both = "not both" if mass is not None else "not none"
        raise ValueError(f"give exactly one of mass and density of the {name}, {both}")


def density_without_volume_message(name: str) -> str:
    """Return the error message for specifying the density of a shape without volume."""
    return f"the {name} is thin and has no volume: give its mass"


def compute_central_inertia(shape: ShapeMoments[float], mass: float) -> Array:
    """Return the tensor of inertia about the centre of mass."""
    return np.diag(compute_moments_about_com(shape, mass))


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


def tube_radii_error_message(inner: float, outer: float) -> str:
    """Return the error message for invalid radii of a tube."""
    return f"inner must lie between 0 and outer = {outer!r}, not {inner!r}"


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


def ellipsoid(a: R, b: R, c: R) -> ShapeMoments[R]:
    """Return the shape of a solid ellipsoid with the semi-axes a, b, c."""
    volume = 4.0 / 3.0 * math.pi * a * b * c
    return ShapeMoments("ellipsoid", volume, (a * a / 5.0, b * b / 5.0, c * c / 5.0), 0.0 * c)


def cone(radius: R, height: R) -> ShapeMoments[R]:
    """Return the shape of a solid circular cone that stands on its tip at the origin."""
    r, h = radius, height
    side, along = 0.15 * r * r, 0.0375 * h * h
    return ShapeMoments("cone", math.pi / 3.0 * r * r * h, (side, side, along), 0.75 * h)
