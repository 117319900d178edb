"""Homogeneous bodies of a shape."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from .._utils.arguments import Array, as_bool
from .batch import BatchBase, broadcast_shapes, stack_components
from .parameters import NON_NEGATIVE, POSITIVE, BatchParameter, read_parameter, refuse_first


class ShapeMoments(NamedTuple):
    """Volume, second moments and centre of mass of a shape."""

    volume: Array  # [L^3]; 0 for a thin shape
    squares: tuple[Array, Array, Array]  # means of x^2, y^2, z^2 about the centre of mass [L^2]
    height: Any = 0.0  # of the centre of mass above the origin of the pivot's coordinates [L]


def _cuboid(half: Array) -> ShapeMoments:
    a, b, c = np.moveaxis(half, -1, 0)
    return ShapeMoments(8.0 * a * b * c, (a, b, c))


def _ellipsoid(half: Array) -> ShapeMoments:
    a, b, c = np.moveaxis(half, -1, 0)
    return ShapeMoments(4.0 / 3.0 * math.pi * a * b * c, (a * a / 5.0, b * b / 5.0, c * c / 5.0))


def _cylinder(r: Array, h: Array) -> ShapeMoments:
    side = r * r / 4.0
    return ShapeMoments(math.pi * r * r * h, (side, side, h * h / 12.0))


def _tube(hole: Array, r: Array, h: Array) -> ShapeMoments:
    side = (r * r + hole * hole) / 4.0
    return ShapeMoments(math.pi * (r - hole) * (r + hole) * h, (side, side, h * h / 12.0))


def _disk(r: Array) -> ShapeMoments:
    side = r * r / 4.0
    return ShapeMoments(0.0 * r, (side, side, 0.0 * r))


def _rod(length: Array) -> ShapeMoments:
    nothing = 0.0 * length
    return ShapeMoments(nothing, (nothing, nothing, length * length / 12.0))


def _sphere(r: Array) -> ShapeMoments:
    return ShapeMoments(4.0 / 3.0 * math.pi * r * r * r, (r * r / 5.0,) * 3)


def _shell(r: Array) -> ShapeMoments:
    return ShapeMoments(0.0 * r, (r * r / 3.0,) * 3)


def _cone(r: Array, h: Array) -> ShapeMoments:
    side, axial = 0.15 * r * r, 0.0375 * h * h
    return ShapeMoments(math.pi / 3.0 * r * r * h, (side, side, axial), 0.75 * h)


def add_point_masses(tensor: BatchParameter, mass: Array, lever: Array) -> BatchParameter:
    """Add the inertia of point masses at the positions a = `lever`: mass * (|a|^2 1 - a a^t).

    The result contains moments if `tensor` contains moments and all sums are diagonal, and matrices
    otherwise.
    """
    x, y, z = np.moveaxis(np.asarray(lever), -1, 0)
    with np.errstate(all="ignore"):
        xx, yy, zz = mass * (x * x), mass * (y * y), mass * (z * z)
        xy, yz, zx = (0.0 - mass * product for product in (x * y, y * z, z * x))
        terms = (yy + zz, xy, zx), (xy, zz + xx, yz), (zx, yz, xx + yy)
        if tensor.value == (3,):
            i1, i2, i3 = (tensor.values[..., k] + terms[k][k] for k in range(3))
            if not (xy.any() or yz.any() or zx.any()):
                return BatchParameter("inertia", stack_components(i1, i2, i3), (3,))
            flat = stack_components(i1, xy, zx, xy, i2, yz, zx, yz, i3)
        else:
            places = [(i, j) for i in range(3) for j in range(3)]
            flat = stack_components(*(tensor.values[..., i, j] + terms[i][j] for i, j in places))
    return BatchParameter("inertia", flat.reshape(*flat.shape[:-1], 3, 3), (3, 3))


class ShapeConstructors(BatchBase):
    """Constructors of homogeneous bodies.

    Lengths, masses and densities are numbers or arrays. Vectors have the shape (..., 3).
    """

    @classmethod
    def cuboid(
        cls,
        half: ArrayLike,
        pivot: ArrayLike,
        density: ArrayLike | None = None,
        *,
        mass: ArrayLike | None = None,
    ) -> Self:
        """Build a homogeneous cuboid from its half-edge lengths [L] and its density or mass.

        half     half the lengths of the edges along the three axes [L]
        pivot    the fixed point, relative to the centre [L]; it may lie outside the cuboid
        density  [M L^-3], 1 by default; alternatively, mass [M]

        >>> import kreisel as kr
        >>> kr.Body.cuboid(half=[(1, 1, 2), (1, 2, 3)], pivot=(0, 0, -3)).mass
        array([16., 48.])
        """
        if mass is None and density is None:
            density = 1.0
        sizes = [read_parameter("half", half)]
        return cls._build_from_shape("cuboid", _cuboid, sizes, pivot, mass, density)

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
        """Build a solid cylinder whose symmetry axis is the third axis.

        `radius` and `height` are lengths [L]. Specify either `mass` [M] or `density` [M L^-3].

        pivot  the fixed point, relative to the centre [L]

        >>> import kreisel as kr
        >>> kr.Body.cylinder(radius=2, height=6, pivot=(0, 0, 0), mass=1).moments
        (4.0, 4.0, 2.0)
        """
        sizes = [
            read_parameter("radius", radius),
            read_parameter("height", height, check=POSITIVE),
        ]
        return cls._build_from_shape("cylinder", _cylinder, sizes, pivot, mass, density)

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
        """Build a hollow cylinder whose symmetry axis is the third axis.

        `inner` and `outer` are the radii [L], and `height` is a length [L]. Specify either `mass`
        [M] or `density` [M L^-3]. Equal radii give a thin-walled tube, a height of 0 gives a flat
        ring, and both together give a hoop. Bodies without volume require `mass` instead of
        `density`.

        pivot  the fixed point, relative to the centre [L]
        """
        sizes = [
            read_parameter("inner", inner),
            read_parameter("outer", outer),
            read_parameter("height", height, check=NON_NEGATIVE),
        ]
        broadcast_shapes({one.name: one.shape for one in sizes})
        hole, r = np.broadcast_arrays(sizes[0].values, sizes[1].values)
        bad = ~((hole >= 0.0) & (hole <= r))
        if bad.any():
            radii = (inner, outer) if not bad.ndim else np.stack((hole, r), axis=-1)
            refuse_first("(inner, outer)", radii, bad, "must have 0 <= inner <= outer")
        return cls._build_from_shape("tube", _tube, sizes, pivot, mass, density)

    @classmethod
    def disk(cls, radius: ArrayLike, pivot: ArrayLike, *, mass: ArrayLike) -> Self:
        """Build a thin disk perpendicular to the third axis from its radius [L] and mass [M].

        pivot  the fixed point, relative to the centre [L]

        A gyroscope is a disk on an axle:

        >>> import kreisel as kr
        >>> at = (0, 0, -0.06)
        >>> top = kr.Body.disk(0.05, at, mass=0.5) + kr.Body.rod(0.12, at, mass=0.02)
        >>> top.kind, round(top.mass, 12)
        ('lagrange', 0.52)
        """
        sizes = [read_parameter("radius", radius)]
        return cls._build_from_shape("disk", _disk, sizes, pivot, mass, None)

    @classmethod
    def rod(cls, length: ArrayLike, pivot: ArrayLike, *, mass: ArrayLike) -> Self:
        """Build a thin straight rod along the third axis from its length [L] and mass [M].

        pivot  the fixed point, relative to the middle of the rod [L]. A rod has no moment of
               inertia about its own line. If the pivot lies on this line, the rod can only be
               added to another body, and an array of such rods raises ValueError

        >>> import kreisel as kr
        >>> kr.Body.rod(length=6, pivot=(1, 0, 0), mass=1).moments
        (3.0, 4.0, 1.0)
        """
        sizes = [read_parameter("length", length)]
        return cls._build_from_shape("rod", _rod, sizes, pivot, mass, None)

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
        """Build a solid sphere from its radius [L] and its mass [M] or density [M L^-3].

        pivot  the fixed point, relative to the centre [L]
        shell  True: build a thin spherical shell, which needs a mass
        """
        sizes = [read_parameter("radius", radius)]
        name, compute = ("shell", _shell) if as_bool("shell", shell) else ("sphere", _sphere)
        return cls._build_from_shape(name, compute, sizes, pivot, mass, density)

    @classmethod
    def ellipsoid(
        cls,
        half: ArrayLike,
        pivot: ArrayLike,
        *,
        mass: ArrayLike | None = None,
        density: ArrayLike | None = None,
    ) -> Self:
        """Build a solid ellipsoid from its semi-axes [L] and its mass [M] or density [M L^-3].

        half   the three semi-axes [L]
        pivot  the fixed point, relative to the centre [L]
        """
        sizes = [read_parameter("half", half)]
        return cls._build_from_shape("ellipsoid", _ellipsoid, sizes, pivot, mass, density)

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
        """Build a solid circular cone with its tip at the origin and its base at `height` [L].

        The symmetry axis is the third axis, and the centre of mass lies at three quarters of the
        height. Specify either `mass` [M] or `density` [M L^-3].

        pivot  the fixed point, relative to the tip [L]: (0, 0, 0) for a top that spins on its tip

        >>> import kreisel as kr
        >>> kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1).com
        (0.0, 0.0, 1.5)
        """
        sizes = [
            read_parameter("radius", radius),
            read_parameter("height", height, check=POSITIVE),
        ]
        return cls._build_from_shape("cone", _cone, sizes, pivot, mass, density)

    @classmethod
    def _build_from_shape(
        cls,
        name: str,
        compute_shape: Callable[..., ShapeMoments],
        sizes: list[BatchParameter],
        pivot: ArrayLike,
        mass: ArrayLike | None,
        density: ArrayLike | None,
    ) -> Self:
        """Build homogeneous bodies of the shape compute_shape(*sizes)."""
        if (mass is None) == (density is None):
            correction = "not both" if mass is not None else "not none"
            raise ValueError(f"give exactly one of mass and density of the {name}, {correction}")
        given = {"mass": mass} if density is None else {"density": density}
        ((amount, value),) = given.items()
        words = [*sizes, read_parameter("pivot", pivot), read_parameter(amount, value)]
        broadcast_shapes({one.name: one.shape for one in words})
        pivots, total = words[-2].values, words[-1].values
        with np.errstate(all="ignore"):
            shape = compute_shape(*[one.values for one in sizes])
            if density is not None and name != "cuboid" and not np.any(shape.volume):
                raise ValueError(f"the {name} is thin and has no volume: give its mass")
            x, y, z = shape.squares
            if name == "cuboid":  # with the operations of the core
                total = 8.0 * total * x * y * z if density is not None else total
                third = total / 3.0
                xx, yy, zz = third * x * x, third * y * y, third * z * z
            else:
                total = total * shape.volume if density is not None else total
                xx, yy, zz = total * x, total * y, total * z
            bad = ~((total > 0.0) & np.isfinite(total))
            if bad.any():
                refuse_first(f"mass of the {name}", total, bad, "must be positive and finite")
            com = stack_components(
                0.0 - pivots[..., 0], 0.0 - pivots[..., 1], shape.height - pivots[..., 2]
            )
            moments = BatchParameter("inertia", stack_components(yy + zz, zz + xx, xx + yy), (3,))
        tensor = add_point_masses(moments, total, com)
        return cls._from_parts(words, total, tensor, com, is_rod=name == "rod")

    @classmethod
    def _from_parts(
        cls,
        words: list[BatchParameter],
        mass: Array,
        tensor: BatchParameter,
        com: Array,
        *,
        is_rod: bool = False,
    ) -> Self:
        raise NotImplementedError
