"""Vectorized versions of the constructors of homogeneous bodies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from .._utils.validation import Array, as_bool
from . import shapes
from .body import Body
from .broadcasting import (
    BatchParameter,
    compute_common_parameter_shape,
    split_components,
    stack_components,
    validate_non_negative_parameter,
    validate_parameter,
    validate_positive_parameter,
)


class BodiesConstructors:
    """Constructors of arrays of homogeneous bodies."""

    @classmethod
    def _from_moments_about_com(
        cls,
        make: Callable[..., Body],
        words: Sequence[BatchParameter],
        mass: Array,
        moments: tuple[Array, Array, Array],
        height: Array,
        pivot: BatchParameter,
    ) -> Self:
        """Build bodies from their moments of inertia about the centre of mass.

        The centre of mass is on the third axis at `height`. Raises the same exception as the
        constructor `make` would for the first invalid member.
        """
        raise NotImplementedError

    @classmethod
    def _build_from_shape(
        cls,
        make: Callable[..., Body],
        shape: shapes.ShapeMoments[Array],
        words: Sequence[BatchParameter],
        pivot: ArrayLike,
        mass: ArrayLike | None,
        density: ArrayLike | None,
    ) -> Self:
        """Build homogeneous bodies of a given shape from their masses or densities."""
        shapes.check_mass_xor_density(shape.name, mass, density)
        at = validate_parameter("pivot", pivot, (3,))
        name, given = ("mass", mass) if density is None else ("density", density)
        weight = validate_positive_parameter(name, given)
        compute_common_parameter_shape(*words, at, weight)
        heavy = weight.values
        if density is not None:
            if not shape.volume.any():
                raise ValueError(shapes.density_without_volume_message(shape.name))
            with np.errstate(all="ignore"):
                heavy = weight.values * shape.volume
            validate_positive_parameter(f"mass of the {shape.name}", heavy)
        with np.errstate(all="ignore"):
            moments = shapes.compute_moments_about_com(shape, heavy)
        return cls._from_moments_about_com(
            make, [*words, at, weight], heavy, moments, shape.height, at
        )

    @classmethod
    def cuboid(
        cls,
        half: ArrayLike,
        pivot: ArrayLike,
        density: ArrayLike | None = None,
        *,
        mass: ArrayLike | None = None,
    ) -> Self:
        """Build an array of homogeneous cuboids (see Body.cuboid).

        The half-edge lengths `half` and the points `pivot` [L] have the shape (..., 3). Specify
        either `density` [M L^-3], by default 1, or `mass` [M].

        >>> import kreisel as kr
        >>> kr.Bodies.cuboid(half=[(1, 1, 2), (1, 2, 3)], pivot=(0, 0, -3)).mass
        array([16., 48.])
        """
        edges, at = validate_parameter("half", half, (3,)), validate_parameter("pivot", pivot, (3,))
        edges.raise_error_of_first_bad_value(
            ~(edges.values > 0.0).all(axis=-1), lambda _, x: Body.cuboid(x, (0, 0, 0))
        )
        if mass is not None and density is not None:
            raise ValueError("give mass or density of the cuboid, not both")
        a, b, c = split_components(edges.values)
        if mass is None:
            weight = validate_positive_parameter("density", 1.0 if density is None else density)
        else:
            weight = validate_positive_parameter("mass", mass)
        compute_common_parameter_shape(edges, at, weight)
        heavy = weight.values
        with np.errstate(all="ignore"):
            if mass is None:
                heavy = 8.0 * heavy * a * b * c
                validate_positive_parameter("mass of the cuboid", heavy)
            third = heavy / 3.0
            xx, yy, zz = third * a * a, third * b * b, third * c * c
            moments = yy + zz, zz + xx, xx + yy
        return cls._from_moments_about_com(
            Body.cuboid, [edges, at, weight], heavy, moments, np.zeros(()), at
        )

    @classmethod
    def cylinder(
        cls,
        radius: ArrayLike,
        height: ArrayLike,
        pivot: ArrayLike,
        *,
        mass: ArrayLike | None = None,
        density: ArrayLike | None = None,
    ) -> Self:
        """Build an array of solid cylinders (see Body.cylinder).

        `radius` and `height` are lengths [L], and `pivot` [L] has the shape (..., 3). Specify
        either `mass` [M] or `density` [M L^-3].
        """
        r, h = (
            validate_positive_parameter("radius", radius),
            validate_positive_parameter("height", height),
        )
        compute_common_parameter_shape(r, h)
        with np.errstate(all="ignore"):
            shape = shapes.cylinder(r.values, h.values)
        return cls._build_from_shape(Body.cylinder, shape, [r, h], pivot, mass, density)

    @classmethod
    def tube(
        cls,
        inner: ArrayLike,
        outer: ArrayLike,
        height: ArrayLike,
        pivot: ArrayLike,
        *,
        mass: ArrayLike | None = None,
        density: ArrayLike | None = None,
    ) -> Self:
        """Build an array of hollow cylinders (see Body.tube).

        `inner` and `outer` are the radii [L], `height` is a length [L], and `pivot` [L] has the
        shape (..., 3). Specify either `mass` [M] or `density` [M L^-3].
        """
        hole, r = validate_parameter("inner", inner), validate_positive_parameter("outer", outer)
        h = validate_non_negative_parameter("height", height)
        compute_common_parameter_shape(hole, r, h)
        both = BatchParameter("(inner, outer)", stack_components(hole.values, r.values), (2,))
        bad = ~((hole.values >= 0.0) & (hole.values <= r.values))
        both.raise_error_of_first_bad_value(
            bad, lambda _, pair: Body.tube(pair[0], pair[1], 1.0, (0, 0, 0), mass=1.0)
        )
        with np.errstate(all="ignore"):
            shape = shapes.tube(hole.values, r.values, h.values)
        return cls._build_from_shape(Body.tube, shape, [hole, r, h], pivot, mass, density)

    @classmethod
    def disk(cls, radius: ArrayLike, pivot: ArrayLike, *, mass: ArrayLike) -> Self:
        """Build an array of thin disks (see Body.disk).

        `radius` [L] and `mass` [M] are numbers or arrays, and `pivot` [L] has the shape (..., 3).
        """
        r = validate_positive_parameter("radius", radius)
        with np.errstate(all="ignore"):
            shape = shapes.disk(r.values)
        return cls._build_from_shape(Body.disk, shape, [r], pivot, mass, None)

    @classmethod
    def rod(cls, length: ArrayLike, pivot: ArrayLike, *, mass: ArrayLike) -> Self:
        """Build an array of thin rods (see Body.rod).

        `length` [L] and `mass` [M] are numbers or arrays, and `pivot` [L] has the shape (..., 3).
        Raises ValueError if a pivot lies on the axis of its rod, because the moment of inertia
        about this axis is zero.
        """
        whole = validate_positive_parameter("length", length)
        with np.errstate(all="ignore"):
            shape = shapes.rod(whole.values)
        return cls._build_from_shape(Body.rod, shape, [whole], pivot, mass, None)

    @classmethod
    def sphere(
        cls,
        radius: ArrayLike,
        pivot: ArrayLike,
        *,
        mass: ArrayLike | None = None,
        density: ArrayLike | None = None,
        shell: bool = False,
    ) -> Self:
        """Build an array of solid spheres or thin spherical shells (see Body.sphere).

        `radius` is a length [L], and `pivot` [L] has the shape (..., 3). Specify either `mass` [M]
        or `density` [M L^-3].
        """
        r, thin = validate_positive_parameter("radius", radius), as_bool("shell", shell)
        with np.errstate(all="ignore"):
            shape = shapes.sphere(r.values, thin)
        make = partial(Body.sphere, shell=thin)
        return cls._build_from_shape(make, shape, [r], pivot, mass, density)

    @classmethod
    def ellipsoid(
        cls,
        half: ArrayLike,
        pivot: ArrayLike,
        *,
        mass: ArrayLike | None = None,
        density: ArrayLike | None = None,
    ) -> Self:
        """Build an array of solid ellipsoids (see Body.ellipsoid).

        The semi-axes `half` and the points `pivot` [L] have the shape (..., 3). Specify either
        `mass` [M] or `density` [M L^-3].
        """
        axes = validate_parameter("half", half, (3,))
        bad = ~(axes.values > 0.0).all(axis=-1)
        axes.raise_error_of_first_bad_value(
            bad, lambda _, x: Body.ellipsoid(x, (0, 0, 0), mass=1.0)
        )
        a, b, c = split_components(axes.values)
        with np.errstate(all="ignore"):
            shape = shapes.ellipsoid(a, b, c)
        return cls._build_from_shape(Body.ellipsoid, shape, [axes], pivot, mass, density)

    @classmethod
    def cone(
        cls,
        radius: ArrayLike,
        height: ArrayLike,
        pivot: ArrayLike,
        *,
        mass: ArrayLike | None = None,
        density: ArrayLike | None = None,
    ) -> Self:
        """Build an array of solid cones that stand on their tips (see Body.cone).

        `radius` and `height` are lengths [L], and `pivot` [L] has the shape (..., 3). Specify
        either `mass` [M] or `density` [M L^-3].
        """
        r, h = (
            validate_positive_parameter("radius", radius),
            validate_positive_parameter("height", height),
        )
        compute_common_parameter_shape(r, h)
        with np.errstate(all="ignore"):
            shape = shapes.cone(r.values, h.values)
        return cls._build_from_shape(Body.cone, shape, [r, h], pivot, mass, density)
