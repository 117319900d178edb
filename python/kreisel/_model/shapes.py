"""Homogeneous bodies of a shape, and their moments of inertia."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Self, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from .._core import INPUT_RTOL, TENSOR_LEAST
from .._utils.arguments import (
    Array,
    R,
    Vector,
    as_bool,
    as_finite_array,
    as_float,
    as_positive,
    as_three_floats,
    short_repr,
)
from .._utils.name_hints import HintingType

_TENSOR_FORM = "3 moments or a symmetric 3x3 matrix"


def validate_inertia_tensor(name: str, value: object) -> Array:
    """Return the 3x3 tensor of inertia described by three moments or a symmetric matrix."""
    tensor = as_finite_array(name, value, _TENSOR_FORM)
    if tensor.shape not in ((3,), (3, 3)):
        raise ValueError(f"{name} must be {_TENSOR_FORM}, not {short_repr(value)}")
    if tensor.ndim == 1:
        return np.diag(tensor)
    with np.errstate(over="ignore"):
        skew = np.abs(tensor - tensor.T).max()
    if skew > INPUT_RTOL * np.abs(tensor).max():
        raise ValueError(f"{name} must be {_TENSOR_FORM}, not {short_repr(value)}")
    return tensor


def convert_tensor_to_moments_or_rows(tensor: Array) -> Vector | tuple[Vector, Vector, Vector]:
    """Return the diagonal elements of a diagonal tensor, and the rows of any other tensor."""
    diagonal = tensor.diagonal()
    if (tensor == np.diag(diagonal)).all():
        i1, i2, i3 = diagonal.tolist()
        return i1, i2, i3
    (a, b, c), (d, e, f), (g, h, i) = tensor.tolist()
    return (a, b, c), (d, e, f), (g, h, i)


def principal_moments(tensor: Array) -> list[float]:
    """Return the principal moments of inertia, which are the eigenvalues of the tensor."""
    diagonal = (tensor == np.diag(tensor.diagonal())).all()
    moments: list[float] = (tensor.diagonal() if diagonal else np.linalg.eigvalsh(tensor)).tolist()
    return moments


def find_ill_conditioned_inertia_error(tensor: Array) -> ValueError | None:
    """Return a ValueError if the least moment of a non-diagonal tensor is too small, else None."""
    least, _, largest = sorted(principal_moments(tensor))
    diagonal = (tensor == np.diag(tensor.diagonal())).all()
    if diagonal or abs(least) >= TENSOR_LEAST * largest:
        return None
    return ValueError(
        f"the smallest principal moment, about {least:.1g}, is less than {TENSOR_LEAST} times the "
        f"largest, {largest:.6g}, so the matrix determines it to fewer than six digits: describe "
        "this body by three moments along its principal axes at the fixed point"
    )


def describe_triangle_violation(tensor: Array, inertia_rtol: float) -> str:
    """Return a description of the condition that the principal moments of inertia violate."""
    moments = principal_moments(tensor)
    least, middle, largest = sorted(moments)
    if not least > 0.0:
        return f"{least!r} is not positive in {moments}"
    excess = largest / (least + middle) - 1.0
    clause = f", with inertia_rtol={inertia_rtol!r}" if inertia_rtol else ""
    hint = (
        f"; inertia_rtol={1.1 * excess:.2g} would accept it" if INPUT_RTOL < excess < 0.01 else ""
    )
    return f"{largest!r} > {least!r} + {middle!r} in {moments}{clause}{hint}"


def describe_unphysical_inertia(mass: float, tensor: Array, com: Vector) -> str:
    """Return a message that explains why no mass distribution has the given inertia."""
    rest = add_point_mass_inertia(tensor, -mass, np.array(com))
    moments = principal_moments(rest) if np.isfinite(rest).all() else [-math.inf]
    return (
        f"no body has this inertia about the fixed point: about its centre of mass the moments "
        f"would be {', '.join(f'{moment:.4g}' for moment in moments)}. Give an inertia about the "
        "centre of mass as inertia_about_com. Pass unphysical=True if mass and com are only "
        "parameters of a model"
    )


def add_point_mass_inertia(tensor: Array, mass: float, lever: Array) -> Array:
    """Add the inertia of a point mass at a = `lever` to a tensor: mass * (|a|^2 1 - a a^t)."""
    with np.errstate(over="ignore", invalid="ignore"):
        products = mass * np.outer(lever, lever)
        xx, yy, zz = products.diagonal()
        np.fill_diagonal(products, 0.0)
        total: Array = tensor + (np.diag((yy + zz, zz + xx, xx + yy)) - products)
    return total


def compute_inertia_displacement_term(mass: float, com: Array, displacement: Array) -> Array:
    """Return the change of the inertia tensor when the body is displaced by `displacement`."""
    with np.errstate(over="ignore", invalid="ignore"):
        outer_product = np.outer(com, displacement)
        products = mass * (outer_product + outer_product.T + np.outer(displacement, displacement))
        term: Array = np.eye(3) * products.trace() - products
    return term


def inertia_at_fixed_point(
    mass: float, inertia: ArrayLike | None, inertia_about_com: ArrayLike | None, com: ArrayLike
) -> Array:
    """Return the tensor of inertia at the fixed point, computed from `inertia_about_com`.

    Raises ValueError if both `inertia` and `inertia_about_com` are given, or neither.
    """
    if (inertia is None) == (inertia_about_com is None):
        correction = "not none" if inertia_about_com is None else "not both"
        raise ValueError(f"give exactly one of inertia and inertia_about_com, {correction}")
    tensor = validate_inertia_tensor("inertia_about_com", inertia_about_com)
    return add_point_mass_inertia(
        tensor, as_positive("mass", mass), np.array(as_three_floats("com", com))
    )


def validate_inertia_tolerance(inertia_rtol: object) -> float:
    """Validate the relative tolerance of the triangle inequality for the principal moments.

    Raises ValueError unless the tolerance is at least 0 and less than 1.
    """
    tolerance = as_float("inertia_rtol", inertia_rtol)
    if not 0.0 <= tolerance < 1.0:
        raise ValueError(
            f"inertia_rtol must be at least 0 and less than 1, not {short_repr(inertia_rtol)}"
        )
    return tolerance


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


Number = TypeVar("Number")  # the type of a user's number: float, or ArrayLike for Bodies
Size = TypeVar("Size")  # the type of a validated number or vector

ShapeFunction = Callable[..., ShapeMoments[Any] | CuboidMoments[Any]]


class ShapeConstructors(Generic[Number, Size], metaclass=HintingType):
    """Constructors of homogeneous bodies, shared by Body and Bodies.

    For Body, lengths, masses and densities are numbers, and vectors have three components. For
    Bodies, lengths, masses and densities may also be arrays, and vectors have the shape (..., 3).
    """

    @classmethod
    def cuboid(
        cls,
        half: ArrayLike,
        pivot: ArrayLike,
        density: Number | None = None,
        *,
        mass: Number | None = None,
    ) -> Self:
        """Build a homogeneous cuboid from its half-edge lengths [L] and its density or mass.

        half     half the lengths of the edges along the three axes [L]
        pivot    the fixed point, relative to the centre [L]; it may lie outside the cuboid
        density  [M L^-3], 1 by default; alternatively, mass [M]

        >>> import kreisel as kr
        >>> kr.Bodies.cuboid(half=[(1, 1, 2), (1, 2, 3)], pivot=(0, 0, -3)).mass
        array([16., 48.])
        """
        edges = cls._validate_half_lengths(half)
        if mass is not None and density is not None:
            raise ValueError("give mass or density of the cuboid, not both")
        if mass is None and density is None:
            density = cast(Number, 1.0)
        return cls._build_from_shape(cuboid, (edges,), pivot, mass, density)

    @classmethod
    def cylinder(
        cls,
        radius: Number,
        height: Number,
        pivot: ArrayLike,
        *,
        mass: Number | None = None,
        density: Number | None = None,
    ) -> Self:
        """Build a solid cylinder whose symmetry axis is the third axis.

        `radius` and `height` are lengths [L]. Specify either `mass` [M] or `density` [M L^-3].

        pivot  the fixed point, relative to the centre [L]

        >>> import kreisel as kr
        >>> kr.Body.cylinder(radius=2, height=6, pivot=(0, 0, 0), mass=1).moments
        (4.0, 4.0, 2.0)
        """
        sizes = cls._validate_positive("radius", radius), cls._validate_positive("height", height)
        return cls._build_from_shape(cylinder, sizes, pivot, mass, density)

    @classmethod
    def tube(
        cls,
        inner: Number,
        outer: Number,
        height: Number,
        pivot: ArrayLike,
        *,
        mass: Number | None = None,
        density: Number | None = None,
    ) -> Self:
        """Build a hollow cylinder whose symmetry axis is the third axis.

        `inner` and `outer` are the radii [L], and `height` is a length [L]. Specify either `mass`
        [M] or `density` [M L^-3]. Equal radii give a thin-walled tube, a height of 0 gives a flat
        ring, and both together give a hoop. Bodies without volume require `mass` instead of
        `density`.

        pivot  the fixed point, relative to the centre [L]
        """
        radii = cls._validate_tube_radii(inner, outer)
        sizes = *radii, cls._validate_non_negative("height", height)
        return cls._build_from_shape(tube, sizes, pivot, mass, density)

    @classmethod
    def disk(cls, radius: Number, pivot: ArrayLike, *, mass: Number) -> Self:
        """Build a thin disk perpendicular to the third axis from its radius [L] and mass [M].

        pivot  the fixed point, relative to the centre [L]

        A gyroscope is a disk on an axle:

        >>> import kreisel as kr
        >>> at = (0, 0, -0.06)
        >>> top = kr.Body.disk(0.05, at, mass=0.5) + kr.Body.rod(0.12, at, mass=0.02)
        >>> top.kind, round(top.mass, 12)
        ('lagrange', 0.52)
        """
        sizes = (cls._validate_positive("radius", radius),)
        return cls._build_from_shape(disk, sizes, pivot, mass, None)

    @classmethod
    def rod(cls, length: Number, pivot: ArrayLike, *, mass: Number) -> Self:
        """Build a thin straight rod along the third axis from its length [L] and mass [M].

        pivot  the fixed point, relative to the middle of the rod [L]. A rod has no moment of
               inertia about its own line. If the pivot lies on this line, a Body can only be added
               to another body, and Bodies raises ValueError

        >>> import kreisel as kr
        >>> kr.Body.rod(length=6, pivot=(1, 0, 0), mass=1).moments
        (3.0, 4.0, 1.0)
        """
        sizes = (cls._validate_positive("length", length),)
        return cls._build_from_shape(rod, sizes, pivot, mass, None)

    @classmethod
    def sphere(
        cls,
        radius: Number,
        pivot: ArrayLike,
        *,
        mass: Number | None = None,
        density: Number | None = None,
        shell: bool = False,
    ) -> Self:
        """Build a solid sphere from its radius [L] and its mass [M] or density [M L^-3].

        pivot  the fixed point, relative to the centre [L]
        shell  True: build a thin spherical shell, which needs a mass
        """
        sizes = (cls._validate_positive("radius", radius),)
        is_shell = as_bool("shell", shell)
        return cls._build_from_shape(sphere, sizes, pivot, mass, density, shell=is_shell)

    @classmethod
    def ellipsoid(
        cls,
        half: ArrayLike,
        pivot: ArrayLike,
        *,
        mass: Number | None = None,
        density: Number | None = None,
    ) -> Self:
        """Build a solid ellipsoid from its semi-axes [L] and its mass [M] or density [M L^-3].

        half   the three semi-axes [L]
        pivot  the fixed point, relative to the centre [L]
        """
        axes = cls._validate_half_lengths(half)
        return cls._build_from_shape(ellipsoid, (axes,), pivot, mass, density)

    @classmethod
    def cone(
        cls,
        radius: Number,
        height: Number,
        pivot: ArrayLike,
        *,
        mass: Number | None = None,
        density: Number | None = None,
    ) -> Self:
        """Build a solid circular cone with its tip at the origin and its base at `height` [L].

        The symmetry axis is the third axis, and the centre of mass lies at three quarters of the
        height. Specify either `mass` [M] or `density` [M L^-3].

        pivot  the fixed point, relative to the tip [L]: (0, 0, 0) for a top that spins on its tip

        >>> import kreisel as kr
        >>> kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1).com
        (0.0, 0.0, 1.5)
        """
        sizes = cls._validate_positive("radius", radius), cls._validate_positive("height", height)
        return cls._build_from_shape(cone, sizes, pivot, mass, density)

    @classmethod
    def _validate_positive(cls, name: str, value: Number) -> Size:
        raise NotImplementedError

    @classmethod
    def _validate_non_negative(cls, name: str, value: Number) -> Size:
        raise NotImplementedError

    @classmethod
    def _validate_half_lengths(cls, half: ArrayLike) -> Size:
        """Validate three positive half-edge lengths or semi-axes."""
        raise NotImplementedError

    @classmethod
    def _validate_tube_radii(cls, inner: Number, outer: Number) -> tuple[Size, Size]:
        """Validate the radii of a tube, 0 <= inner <= outer."""
        raise NotImplementedError

    @classmethod
    def _build_from_shape(
        cls,
        compute_shape: ShapeFunction,
        sizes: Sequence[Size],
        pivot: ArrayLike,
        mass: Number | None,
        density: Number | None,
        **options: bool,
    ) -> Self:
        """Build homogeneous bodies with the shape compute_shape(*sizes, **options)."""
        raise NotImplementedError
