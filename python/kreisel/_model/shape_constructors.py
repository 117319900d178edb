"""Constructors of homogeneous bodies from their dimensions, with an arbitrary fixed point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Generic, Self, TypeVar, cast

from numpy.typing import ArrayLike

from .._utils.name_hints import HintingType
from .._utils.validation import as_bool
from . import shapes

Number = TypeVar("Number")  # the type of a user's number: float, or ArrayLike for Bodies
Size = TypeVar("Size")  # the type of a validated number or vector

ShapeFunction = Callable[..., shapes.ShapeMoments[Any] | shapes.CuboidMoments[Any]]


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
        return cls._build_from_shape(shapes.cuboid, (edges,), pivot, mass, density)

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
        return cls._build_from_shape(shapes.cylinder, sizes, pivot, mass, density)

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
        return cls._build_from_shape(shapes.tube, sizes, pivot, mass, density)

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
        return cls._build_from_shape(shapes.disk, sizes, pivot, mass, None)

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
        return cls._build_from_shape(shapes.rod, sizes, pivot, mass, None)

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
        return cls._build_from_shape(shapes.sphere, sizes, pivot, mass, density, shell=is_shell)

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
        return cls._build_from_shape(shapes.ellipsoid, (axes,), pivot, mass, density)

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
        return cls._build_from_shape(shapes.cone, sizes, pivot, mass, density)

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
