"""Constructors of homogeneous bodies from their dimensions, with an arbitrary fixed point."""

from __future__ import annotations

from typing import Self

from numpy.typing import ArrayLike

from .._utils.validation import as_bool, as_float, as_non_negative, as_positive, as_three_floats
from . import shapes


class BodyConstructors:
    """Constructors of homogeneous bodies."""

    @classmethod
    def from_com(
        cls, mass: float, inertia_about_com: ArrayLike, com: ArrayLike, pivot: ArrayLike
    ) -> Self:
        """Build a body from its inertia about the centre of mass (see Body.from_com)."""
        raise NotImplementedError

    @classmethod
    def cylinder(
        cls,
        radius: float,
        height: float,
        pivot: ArrayLike,
        *,
        mass: float | None = None,
        density: float | None = None,
    ) -> Self:
        """Build a solid cylinder whose symmetry axis is the third axis.

        `radius` and `height` are lengths [L]. Specify either `mass` [M] or `density` [M L^-3].

        pivot  the fixed point, relative to the centre [L]

        >>> import kreisel as kr
        >>> kr.Body.cylinder(radius=2, height=6, pivot=(0, 0, 0), mass=1).moments
        (4.0, 4.0, 2.0)
        """
        return cls._build_from_shape(
            shapes.cylinder(as_positive("radius", radius), as_positive("height", height)),
            pivot,
            mass,
            density,
        )

    @classmethod
    def tube(
        cls,
        inner: float,
        outer: float,
        height: float,
        pivot: ArrayLike,
        *,
        mass: float | None = None,
        density: float | None = None,
    ) -> Self:
        """Build a hollow cylinder whose symmetry axis is the third axis.

        `inner` and `outer` are the radii [L], and `height` is a length [L]. Specify either `mass`
        [M] or `density` [M L^-3]. Equal radii give a thin-walled tube, a height of 0 gives a flat
        ring, and both together give a hoop. Bodies without volume require `mass` instead of
        `density`.

        pivot  the fixed point, relative to the centre [L]
        """
        hole, r = as_float("inner", inner), as_positive("outer", outer)
        if not 0.0 <= hole <= r:
            raise ValueError(shapes.tube_radii_error_message(hole, r))
        return cls._build_from_shape(
            shapes.tube(hole, r, as_non_negative("height", height)), pivot, mass, density
        )

    @classmethod
    def disk(cls, radius: float, pivot: ArrayLike, *, mass: float) -> Self:
        """Build a thin disk perpendicular to the third axis from its radius [L] and mass [M].

        pivot  the fixed point, relative to the centre [L]

        A gyroscope is a disk on an axle:

        >>> import kreisel as kr
        >>> at = (0, 0, -0.06)
        >>> top = kr.Body.disk(0.05, at, mass=0.5) + kr.Body.rod(0.12, at, mass=0.02)
        >>> top.kind, round(top.mass, 12)
        ('lagrange', 0.52)
        """
        return cls._build_from_shape(shapes.disk(as_positive("radius", radius)), pivot, mass, None)

    @classmethod
    def sphere(
        cls,
        radius: float,
        pivot: ArrayLike,
        *,
        mass: float | None = None,
        density: float | None = None,
        shell: bool = False,
    ) -> Self:
        """Build a solid sphere from its radius [L] and its mass [M] or density [M L^-3].

        pivot  the fixed point, relative to the centre [L]
        shell  True: build a thin spherical shell, which needs a mass
        """
        r = as_positive("radius", radius)
        return cls._build_from_shape(
            shapes.sphere(r, as_bool("shell", shell)), pivot, mass, density
        )

    @classmethod
    def ellipsoid(
        cls,
        half: ArrayLike,
        pivot: ArrayLike,
        *,
        mass: float | None = None,
        density: float | None = None,
    ) -> Self:
        """Build a solid ellipsoid from its semi-axes [L] and its mass [M] or density [M L^-3].

        pivot  the fixed point, relative to the centre [L]
        """
        a, b, c = (as_positive("half", x) for x in as_three_floats("half", half))
        return cls._build_from_shape(shapes.ellipsoid(a, b, c), pivot, mass, density)

    @classmethod
    def cone(
        cls,
        radius: float,
        height: float,
        pivot: ArrayLike,
        *,
        mass: float | None = None,
        density: float | None = None,
    ) -> Self:
        """Build a solid circular cone with its tip at the origin and its base at `height` [L].

        The symmetry axis is the third axis, and the centre of mass lies at three quarters of the
        height. Specify either `mass` [M] or `density` [M L^-3].

        pivot  the fixed point, relative to the tip [L]: (0, 0, 0) for a top that spins on its tip

        >>> import kreisel as kr
        >>> kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1).com
        (0.0, 0.0, 1.5)
        """
        return cls._build_from_shape(
            shapes.cone(as_positive("radius", radius), as_positive("height", height)),
            pivot,
            mass,
            density,
        )

    @classmethod
    def _build_from_shape(
        cls,
        shape: shapes.ShapeMoments[float],
        pivot: ArrayLike,
        mass: float | None,
        density: float | None,
    ) -> Self:
        heavy = shapes.compute_shape_mass(shape, mass, density)
        com = (0.0, 0.0, shape.height)
        return cls.from_com(heavy, shapes.compute_central_inertia(shape, heavy), com, pivot)
