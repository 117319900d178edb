"""Bodies: one, or an array of them."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING, Any, NoReturn, Self, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from .._core import INPUT_RTOL, KIND_RTOL, TENSOR_LEAST, bodies, body, body_kind, shapes
from .._utils import arguments
from .._utils.arguments import Array, NoKeywords, short_repr
from ..quaternion import turn, unit
from . import parameters
from .batch import (
    BatchBase,
    broadcast_shapes,
    read_parameters,
    shrink_column,
    stack_components,
    store_columns,
)
from .parameters import PARAMETERS, BatchParameter, Column, Index, Shape, get_member, read_parameter
from .solids import Solid, integrate_mesh, integrate_profile, read_mesh, read_model

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_NOTHING = (0.0, 0.0, 0.0)
_GIVEN = "mass", "inertia", "com", "inertia_rtol", "rotor"
_PRINCIPAL = "moments", "principal_com", "axes", "principal_rotor"
_STORED = (*_GIVEN, "unphysical", "wheels", *_PRINCIPAL)
_MOST_WHEELS = 3
NO_WHEELS = ((0.0,) * 5,) * _MOST_WHEELS
# The shapes of the core, of which most are tubes, and the places of their sizes among the given
# ones, which are followed by zeros.
_TUBE, _SHAPES = 2, {"cuboid": 0, "ellipsoid": 1, "sphere": 1, "shell": 3, "cone": 4}
_PLACES = {"sphere": (0, 0, 0), "cylinder": (3, 0, 1), "disk": (3, 0, 3), "rod": (3, 3, 0)}


def _add_point_masses(tensor: BatchParameter, mass: Array, lever: Array) -> BatchParameter:
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


@store_columns
@arguments.make_frozen_class_decorator("dataclasses.replace(body, {}=...) returns a new body")
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Body(BatchBase):
    """A rigid body that rotates about the origin of the frame in which it is described.

    Each parameter may be an array of values, which gives many bodies. They broadcast to the shape
    `body.shape`, which is () for one body. Vectors then have the shape (..., 3), and `body[i]` is
    one of the bodies; slices, index arrays and masks select several.

    mass          [M], positive
    inertia       inertia about the fixed point [M L^2]: three moments along the axes of the frame,
                  or a symmetric 3x3 matrix. An array whose last two dimensions are both 3 is read
                  as matrices, so three bodies need three matrices. Alternatively,
                  inertia_about_com: the inertia about the centre of mass
    com           position of the centre of mass relative to the fixed point [L]
    inertia_rtol  relative amount by which the largest principal moment may exceed the sum of the
                  other two, 0 <= inertia_rtol < 1, for rounded values from the literature. The
                  moments are used as given
    unphysical    True to allow an inertia that no distribution of mass has, as in models where only
                  mass * gravity * |com| matters
    rotor         constant angular momentum of rotors relative to the body (a gyrostat), in the
                  frame of the body [M L^2 T^-1]. The total angular momentum is J w + rotor. The
                  inertia includes the rotors, as if they were at rest. Motors keep their rates
                  relative to the body; see with_wheel for a wheel without a motor
    wheels        up to three wheels on free axles, as with_wheel adds them: rows of the axis (3),
                  the rate and the moment. In scene.body, their moments about the axles are no
                  longer part of the inertia, their rates are relative to space, and the last
                  number is 0

    Further attributes describe the body along its principal axes N, B, T at the fixed point:

    moments          the principal moments of inertia [M L^2]
    axes             the rotation (w, x, y, z) from N, B, T to the frame of description
    principal_com    the components of com along N, B, T [L]
    principal_rotor  the components of rotor along N, B, T [M L^2 T^-1]

    If the inertia tensor is diagonal, the principal axes are the axes of description. For a
    non-diagonal inertia matrix, the principal axes are right-handed and as close as possible to the
    axes of the frame of description. For a Lagrange top, the principal axis T is the symmetry axis.

    The principal moments must be positive, and none may exceed the sum of the other two. The
    condition on the principal moments is checked to a relative tolerance of 1e-12, so plates and
    rods are accepted. If the inertia is a non-diagonal matrix, its least principal moment must
    exceed 2e-10 times the largest one, because rounding would leave a smaller moment with at most
    six correct digits.

    Raises TypeError if an argument is not numeric, and ValueError if the values do not describe a
    rigid body. Warns (UserWarning) if no mass distribution has the given inertia about the fixed
    point, unless `unphysical` is True. The attribute `unphysical` is True whenever no mass
    distribution has the inertia of the body. Messages about many bodies give the index of the first
    one that is refused.

    >>> import kreisel as kr
    >>> kr.Body(mass=0.5, inertia_about_com=(2e-4, 2e-4, 1e-4), com=(0, 0, 0.1)).kind
    'lagrange'
    >>> tops = kr.Body.cone(radius=[1, 2, 3], height=2, pivot=(0, 0, 0), mass=1)
    >>> tops.shape, tops[2].com
    ((3,), (0.0, 0.0, 1.5))
    """

    # The core has the same constructors, with results that are equal to the last bit. But the core
    # stores only principal moments and axes, while a Body also stores the inertia as given.

    mass: Any
    inertia: Any
    com: Any
    inertia_rtol: Any
    unphysical: Any
    rotor: Any
    wheels: Any
    moments: Any = field(init=False)
    axes: Any = field(init=False)
    principal_com: Any = field(init=False)
    principal_rotor: Any = field(init=False)
    # bytes of the kr_body of one body: mass, moments, com, axes, inertia_rtol, which kr_body calls
    # `rounded`, and the rotor along the principal axes
    _block: bytes = field(init=False)

    _compared = *_GIVEN, "wheels"
    _compared_of_many = "mass", "_tensors", "com", "inertia_rtol", "rotor", "wheels"
    _stored = _STORED

    @arguments.has_unknown_keywords("Body")
    def __init__(
        self,
        mass: ArrayLike,
        inertia: ArrayLike | None = None,
        com: ArrayLike | None = None,
        *,
        inertia_about_com: ArrayLike | None = None,
        inertia_rtol: ArrayLike = 0.0,
        unphysical: ArrayLike = False,
        rotor: ArrayLike = _NOTHING,
        wheels: ArrayLike = NO_WHEELS,
        **unknown: Unpack[NoKeywords],
    ) -> None:
        if unknown:
            arguments.refuse_unknown_keywords(Body.__init__, unknown)
        if com is None:
            raise TypeError("com is missing: give the centre of mass relative to the fixed point")
        if (inertia is None) == (inertia_about_com is None):
            correction = "not none" if inertia is None else "not both"
            raise ValueError(f"give exactly one of inertia and inertia_about_com, {correction}")
        if inertia is not None and wheels is NO_WHEELS:
            numbers = body(mass, inertia, com, inertia_rtol, rotor, False)
            if numbers is not None and isinstance(unphysical, bool):
                self._store_numbers(numbers, unphysical)
                return
        name = "inertia" if inertia_about_com is None else "inertia_about_com"
        tensor = read_parameter(name, inertia if inertia_about_com is None else inertia_about_com)
        words = read_parameters({"mass": mass, "com": com, name: tensor})
        masses, lever, _ = (one.values for one in words)
        if inertia_about_com is not None:
            tensor = _add_point_masses(tensor, masses, lever)
        self._store_parts(words, masses, tensor, lever, inertia_rtol, unphysical, rotor, wheels)

    def _store_numbers(self, numbers: tuple[Any, ...], unphysical: bool) -> Self:
        """Store the numbers of one body, as body() of the core returns them."""
        *values, block, is_physical = numbers
        fields = self.__dict__
        fields.update(zip((*_GIVEN, *_PRINCIPAL), values, strict=True))
        fields["_block"], fields["unphysical"] = block, unphysical or not is_physical
        fields["wheels"] = NO_WHEELS
        if not (is_physical or unphysical):
            arguments.warn_user(
                _describe_unphysical_inertia(self.mass, self._tensors, np.array(self.com))
            )
        return self

    def _store_parts(
        self,
        words: list[BatchParameter],
        mass: Array,
        tensor: BatchParameter,
        com: Array,
        inertia_rtol: Any = 0.0,
        unphysical: Any = False,
        rotor: Any = _NOTHING,
        wheels: Any = NO_WHEELS,
    ) -> Self:
        """Store bodies of any shape. `words` are the parameters that the user gave."""
        slacks = read_parameter("inertia_rtol", inertia_rtol)
        rotors = read_parameter("rotor", rotor)
        wheel = read_parameter("wheels", wheels)
        if wheel.value != PARAMETERS["wheels"].shapes[0]:
            wheel = wheel._replace(values=_combine_wheels(wheel.values), value=(_MOST_WHEELS, 5))
        tensor, flags = read_parameter("inertia", tensor), np.asarray(unphysical)
        if flags.dtype != np.bool_:
            text = f"must be True or False, or an array of them, not {short_repr(unphysical)}"
            raise TypeError(f"unphysical {text}")
        words = [*words, *(one for one in (slacks, rotors) if np.any(one.values))]
        lead = np.broadcast_shapes(np.shape(mass), np.shape(com)[:-1], tensor.shape)
        shape = broadcast_shapes((*words, rotors, wheel), unphysical=flags.shape, body=lead)
        rotor_values = rotors.values + 0.0  # no negative zeros
        if not shape:
            flat = [np.ascontiguousarray(x) for x in (tensor.values, com, rotor_values)]
            numbers = body(float(mass), flat[0], flat[1], float(slacks.values), flat[2], False)
            if numbers is not None:
                self._store_numbers(numbers, bool(flags))
                self.__dict__["wheels"] = tuple(map(tuple, wheel.values.tolist()))
                return self
        matrices = tensor.value == (3, 3)
        columns = {
            "mass": (mass, 0),
            "inertia": (tensor.values, len(tensor.value)),
            "com": (com, 1),
            "inertia_rtol": (slacks.values, 0),
            "rotor": (rotor_values, 1),
            "unphysical": (flags, 0),
            "wheels": (wheel.values, 2),
        }
        self._store(shape, columns, words)
        own, dims = self._columns, len(shape)
        given = [own[name] for name in _GIVEN]
        if matrices:
            given[1] = given[1].reshape(*given[1].shape[:-2], 9)
        status, at, can_be, rows = bodies(shape, given, matrices)
        if status != "OK":
            self._refuse_member(status, tuple(map(int, np.unravel_index(at, shape))))
        is_possible = can_be.reshape(shape)
        odd = ~(is_possible | flags)
        if odd.any():
            i = tuple(map(int, np.unravel_index(int(odd.argmax()), odd.shape)))
            text = _describe_unphysical_inertia(self.mass[i], self._tensors[i], self.com[i])
            more = f" (and {odd.sum() - 1} more)" if odd.sum() > 1 else ""
            arguments.warn_user(f"body{list(i)}{more}: {text}" if i else text)
        principal = own["inertia"], own["com"], np.array([1.0, 0.0, 0.0, 0.0]), own["rotor"]
        if matrices:
            rows = rows.reshape(*shape, 15)
            principal = rows[..., 1:4], rows[..., 4:7], rows[..., 7:11], rows[..., 12:]
        self.__dict__["_columns"] = {
            **own,
            **{n: shrink_column(x, dims, 1) for n, x in zip(_PRINCIPAL, principal, strict=True)},
            "unphysical": shrink_column(flags | ~is_possible, dims, 0),
        }
        return self

    def _refuse_member(self, status: str, index: Index) -> NoReturn:
        """Raise an exception for a body that the core refuses because of its moments."""
        tensor, inertia_rtol = self._tensors[index], float(self.inertia_rtol[index])
        moments = _principal_moments(tensor)
        least, middle, largest = sorted(moments)
        is_diagonal = (tensor == np.diag(tensor.diagonal())).all()
        clause = f", with inertia_rtol={inertia_rtol!r}" if inertia_rtol else ""
        text = f"{largest!r} > {least!r} + {middle!r} in {moments}{clause}"
        if not least > 0.0:
            text = f"{least!r} is not positive in {moments}"
        elif INPUT_RTOL < (excess := largest / (least + middle) - 1.0) < 0.01:
            text += f"; inertia_rtol={1.1 * excess:.2g} would accept it"
        error = arguments.make_exception_from_status(status, text)
        if not is_diagonal and abs(least) < TENSOR_LEAST * largest:
            error = ValueError(
                f"the smallest principal moment, about {least:.1g}, is less than {TENSOR_LEAST} "
                f"times the largest, {largest:.6g}, so the matrix determines it to fewer than six "
                "digits: describe this body by three moments along its principal axes at the fixed "
                "point"
            )
        raise type(error)(f"body{list(index)}: {error}" if index else str(error))

    @property
    def _tensors(self) -> Array:
        """(..., 3, 3) inertia about the fixed point."""
        return _as_matrices(np.asarray(self.inertia), len(self.shape))

    def _select_member(self, index: Index) -> Body:
        if "_block" in self.__dict__:
            return self
        words = {name: get_member(getattr(self, name), index) for name in _GIVEN}
        if self._has_wheels:
            words["wheels"] = self.wheels[index]
        return Body(**words, unphysical=bool(self.unphysical[index]))

    @property
    def _used_wheels(self) -> Any:
        """The rows of `wheels`, for one body without those of no wheel."""
        return self.wheels if self.shape else tuple(row for row in self.wheels if any(row))

    @property
    def _has_wheels(self) -> bool:
        if self.shape:
            return bool(self._columns["wheels"].any())
        return self.wheels is not NO_WHEELS and bool(np.any(self.wheels))

    def _with(
        self, shape: Shape, names: tuple[str | None, ...], change: Callable[[Column], Column]
    ) -> Self:
        many = super()._with(shape, names, change)
        return many if shape else cast(Self, many._select_member(()))

    @classmethod
    def symmetric(
        cls,
        mass: ArrayLike,
        i1: ArrayLike,
        i3: ArrayLike,
        height: ArrayLike,
        *,
        inertia_rtol: ArrayLike = 0.0,
        unphysical: ArrayLike = False,
    ) -> Self:
        """Build a Lagrange top from its moments of inertia i1, i1, i3 at the fixed point [M L^2].

        The centre of mass is at (0, 0, height) [L]. The other arguments are described in Body.

        >>> import kreisel as kr
        >>> kr.Body.symmetric(1, i1=2, i3=[1, 2, 3], height=0.5)[0].kind
        'lagrange'
        """
        given = {"mass": mass, "i1": i1, "i3": i3, "height": height}
        words = read_parameters(given)
        masses, across, along, heights = (one.values for one in words)
        tensor = BatchParameter("inertia", stack_components(across, across, along), (3,))
        nothing = np.zeros_like(heights)
        com = stack_components(nothing, nothing, heights)
        return cls.__new__(cls)._store_parts(words, masses, tensor, com, inertia_rtol, unphysical)

    @classmethod
    def from_com(
        cls,
        mass: ArrayLike,
        inertia_about_com: ArrayLike,
        com: ArrayLike,
        pivot: ArrayLike,
        *,
        inertia_rtol: ArrayLike = 0.0,
        unphysical: ArrayLike = False,
    ) -> Self:
        """Build a body from its inertia about the centre of mass [M L^2].

        `com` and `pivot` are the positions of the centre of mass and of the fixed point [L],
        relative to a common origin. The other arguments are described in Body. Steiner's theorem
        (Bodack 2008, 2.14) says J = J_com + mass * (|a|^2 1 - a a^t) with a = com - pivot.
        """
        given = {"mass": mass, "inertia_about_com": inertia_about_com, "com": com, "pivot": pivot}
        words = read_parameters(given)
        masses, _, centres, pivots = (one.values for one in words)
        with np.errstate(all="ignore"):
            lever = centres - pivots
        tensor = _add_point_masses(words[1], masses, lever)
        return cls.__new__(cls)._store_parts(words, masses, tensor, lever, inertia_rtol, unphysical)

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
        return cls._build("cuboid", pivot, mass, density, half=half)

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
        return cls._build("cylinder", pivot, mass, density, radius=radius, height=height)

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
        return cls._build("tube", pivot, mass, density, inner=inner, outer=outer, height=height)

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
        return cls._build("disk", pivot, mass, radius=radius)

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
        return cls._build("rod", pivot, mass, length=length)

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
        name = "shell" if arguments.as_bool("shell", shell) else "sphere"
        return cls._build(name, pivot, mass, density, radius=radius)

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
        return cls._build("ellipsoid", pivot, mass, density, half=half)

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
        return cls._build("cone", pivot, mass, density, radius=radius, height=height)

    @classmethod
    def _build(
        cls,
        name: str,
        pivot: ArrayLike,
        mass: ArrayLike | None,
        density: ArrayLike | None = None,
        **sizes: ArrayLike,
    ) -> Self:
        """Build homogeneous bodies of the shape with this name."""
        least = {"height": parameters.NON_NEGATIVE if name == "tube" else parameters.POSITIVE}
        words = [read_parameter(key, x, check=least.get(key)) for key, x in sizes.items()]
        words += [read_parameter("pivot", pivot), _read_amount(name, mass, density)]
        is_one = not broadcast_shapes(words)
        *given, pivots, total = [one.values for one in words]
        if name == "tube":
            hole, r = np.broadcast_arrays(*given[:2])
            bad = ~((hole >= 0.0) & (hole <= r))
            if bad.any():
                radii = np.stack((hole, r), axis=-1) if bad.ndim else tuple(sizes.values())[:2]
                parameters.refuse_first(
                    "(inner, outer)", radii, bad, "must have 0 <= inner <= outer"
                )
        kind, places = _SHAPES.get(name, _TUBE), _PLACES.get(name, (0, 1, 2))
        padded = *(np.moveaxis(given[0], -1, 0) if "half" in sizes else given), *[np.zeros(())] * 3
        columns = [*[padded[place] for place in places], total]
        shape = () if is_one else np.broadcast_shapes(*[column.shape for column in columns])
        rows = shapes(kind, shape, columns, density is not None)
        if density is not None:
            total = rows[..., 0].copy()
            if name != "cuboid" and not total.any():
                raise ValueError(f"the {name} is thin and has no volume: give its mass")
        with np.errstate(over="ignore"):
            lever = (rows[..., 4:] if name == "cone" else 0.0) - pivots
        if is_one:
            parts = rows[1:4].tolist(), lever.tolist(), 0.0, _NOTHING
            numbers = body(float(total), *parts, True)
            if numbers is not None:
                made = cls.__new__(cls)._store_numbers(numbers, False)
                if name != "rod" or min(made.moments) > INPUT_RTOL * max(made.moments):
                    return made
        bad = ~((total > 0.0) & np.isfinite(total))
        if bad.any():
            text = "must be positive and finite"
            parameters.refuse_first(f"mass of the {name}", total, bad, text)
        tensor = _add_point_masses(BatchParameter("inertia", rows[..., 1:4], (3,)), total, lever)
        if name == "rod" and is_one:
            return cast(Self, _join(total, _as_matrices(tensor.values, 0), lever, np.zeros(3)))
        return cls.__new__(cls)._store_parts(words, total, tensor, lever)

    @classmethod
    def from_profile(
        cls,
        profile: ArrayLike,
        pivot: ArrayLike,
        *,
        mass: ArrayLike | None = None,
        density: ArrayLike | None = None,
    ) -> Self:
        """Build a solid of revolution about the third axis, as a lathe makes it.

        Specify either `mass` [M] or `density` [M L^-3].

        profile  (n, 2) corners (radius, z) of the section [L], in order. The last corner is joined
                 to the first one: begin and end on the axis, at radius 0, for a solid, or go round
                 the section of a ring
        pivot    the fixed point in the same frame [L]

        Raises ValueError if a radius is negative, or if the section crosses itself or has no area.

        >>> import kreisel as kr
        >>> top = kr.Body.from_profile([(0, 0), (3, 4), (0, 5)], pivot=(0, 0, 0), density=1)
        >>> top.kind, round(top.mass, 9), round(top.com[2], 9)
        ('lagrange', 47.123889804, 3.25)
        """
        return cls._build_solid("profile", integrate_profile(profile), pivot, mass, density)

    @classmethod
    def from_mesh(
        cls,
        mesh: str | os.PathLike[str] | ArrayLike,
        pivot: ArrayLike,
        *,
        mass: ArrayLike | None = None,
        density: ArrayLike | None = None,
        scale: float = 1.0,
    ) -> Self:
        """Build the homogeneous solid that a closed surface of triangles bounds.

        Specify either `mass` [M] or `density` [M L^-3]. The frame of the body is that of the mesh.

        mesh   an STL file, a file of another kind that trimesh reads, if it is installed, or the
               corners (n, 3, 3) of triangles. They all have their outside, or all their inside, on
               the side from which they are passed anticlockwise
        pivot  the fixed point in the frame of the mesh [L]
        scale  the unit of length of the mesh [L]: 0.001 for millimetres in SI units

        The integrals are those of the polyhedron, so a round part is as round as its triangles are
        small; `from_profile` has no such error. Raises ValueError if the surface has a hole or
        encloses no volume. It is not checked that the surface does not pass through itself.

        >>> import kreisel as kr
        >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        >>> faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
        >>> mesh = [[corners[i] for i in face] for face in faces]
        >>> round(kr.Body.from_mesh(mesh, pivot=(0, 0, 0), density=6).mass, 12)
        1.0
        """
        return cls._build_solid(
            "mesh", integrate_mesh(read_mesh(mesh, scale)), pivot, mass, density
        )

    @classmethod
    def _build_solid(
        cls,
        name: str,
        solid: Solid,
        pivot: ArrayLike,
        mass: ArrayLike | None,
        density: ArrayLike | None,
    ) -> Self:
        words = [read_parameter("pivot", pivot), _read_amount(name, mass, density)]
        pivots, total = (
            words[0].values,
            words[1].values * (1.0 if density is None else solid.volume),
        )
        shape = solid.inertia.shape
        inertia = total.reshape(total.shape + (1,) * len(shape)) * solid.inertia
        lever = solid.com - pivots
        tensor = _add_point_masses(BatchParameter("inertia", inertia, shape), total, lever)
        return cls.__new__(cls)._store_parts(words, total, tensor, lever)

    @classmethod
    def from_model(
        cls,
        path: str | os.PathLike[str],
        name: str | None = None,
        *,
        pivot: ArrayLike = (0.0, 0.0, 0.0),
    ) -> Self:
        """Build the body of a link of a URDF file, or of a body of a MuJoCo model (MJCF).

        The frame of the body is that of the link. Lengths and masses are those of the file.

        name   the name of the link or body; not needed if only one of them has inertial data
        pivot  the fixed point in the frame of the link, as the place of a joint

        Raises ValueError if the file has no such body, or the body has no <inertial> element, whose
        orientation in an MJCF must be a quat.
        """
        link = read_model(path, name)
        body = cls.from_com(link.mass, link.inertia, _NOTHING, _NOTHING)
        lever = link.com - arguments.as_three_floats("pivot", pivot)
        return cast(Self, body.turn(link.attitude).shift(lever))

    def __add__(self, other: Body) -> Body:
        """Join bodies that are described in the same frame and share the fixed point."""
        if not isinstance(other, Body):
            return NotImplemented
        first, second = (np.asarray(part.mass)[..., None] for part in (self, other))
        com = first * np.asarray(self.com) + second * np.asarray(other.com)
        tensor = self._tensors + other._tensors
        rotor = np.add(self.rotor, other.rotor)
        return _join(self.mass + other.mass, tensor, com / (first + second), rotor, self, other)

    def shift(self, by: ArrayLike) -> Body:
        """Return the body shifted by the vector `by` [L] relative to the fixed point.

        >>> import kreisel as kr
        >>> kr.Body.sphere(5, (0, 0, 0), mass=1).shift((0, 0, 3)).moments
        (19.0, 19.0, 10.0)
        """
        displacement, com = np.array(arguments.as_three_floats("by", by)), np.asarray(self.com)
        with np.errstate(over="ignore", invalid="ignore"):
            outer = com[..., :, None] * displacement
            both = outer + outer.swapaxes(-1, -2) + np.outer(displacement, displacement)
            products = np.asarray(self.mass)[..., None, None] * both
            trace = products.trace(axis1=-2, axis2=-1)[..., None, None]
            tensor = self._tensors + (np.eye(3) * trace - products)
        return _join(self.mass, tensor, com + displacement, np.asarray(self.rotor), self)

    def turn(self, by: ArrayLike | Rotation) -> Body:
        """Return the body rotated about the fixed point within the frame of description.

        by  a unit quaternion (w, x, y, z) or a single scipy Rotation

        >>> import kreisel as kr
        >>> upright = kr.Body.cylinder(radius=2, height=6, pivot=(0, 0, -3), mass=1)
        >>> [round(x, 9) + 0.0 for x in upright.turn((0.5**0.5, 0.5**0.5, 0, 0)).com]
        [0.0, -3.0, 0.0]
        """
        q = unit("by", by)
        axes = np.array([turn(q, (x, y, z)) for x, y, z in np.eye(3).tolist()])
        tensor = axes.T @ self._tensors @ axes
        com, rotor = np.asarray(self.com) @ axes, np.asarray(self.rotor) @ axes
        wheels = np.array(self.wheels)
        wheels[..., :3] = wheels[..., :3] @ axes
        tensor = 0.5 * (tensor + tensor.swapaxes(-1, -2))
        return _join(self.mass, tensor, com, rotor, self, wheels=wheels)

    def with_rotor(self, *, spin: float, inertia: float, axis: ArrayLike) -> Body:
        """Return a copy of the body with an additional rotor.

        spin     angular velocity of the rotor relative to the body, about `axis` [rad/T]. A motor
                 keeps it constant; see with_wheel for a wheel on a free axle
        inertia  moment of the rotor about its axis [M L^2]. The body's own inertia and mass already
                 include the rotor
        axis     direction of the rotor's axis in the frame of the body, of any length

        The angular momentum of the rotor, spin * inertia, is added to `body.rotor`. Raises
        ValueError if the axis is zero or the inertia is not positive.

        >>> import kreisel as kr
        >>> top = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> top.with_rotor(spin=50, inertia=0.1, axis=(0, 0, 2)).rotor
        (0.0, 0.0, 5.0)
        """
        size = arguments.as_float(
            "spin * inertia",
            arguments.as_float("spin", spin) * arguments.as_positive("inertia", inertia),
        )
        rotor = np.asarray(self.rotor) + size * _read_axes(arguments.as_three_floats("axis", axis))
        return _join(self.mass, self._tensors, np.asarray(self.com), rotor, self)

    def with_wheel(self, *, inertia: ArrayLike, axis: ArrayLike, rate: ArrayLike) -> Body:
        """Return a copy of the body with an additional wheel on a free axle.

        inertia  moment of the wheel about its axle [M L^2]. As in with_rotor, the body's own
                 inertia and mass already include the wheel
        axis     direction of the axle in the frame of the body, of any length
        rate     angular velocity of the wheel relative to the body, about `axis`, at the start of
                 the scene [rad/T]. It changes with time: see path.wheel_rate

        Nothing but the bearing acts about the axle, which has no friction. The momentum of the
        wheel about the axle, inertia * (rate + <axis, w>) with the angular velocity w of the body
        in the inertial frame, is therefore constant; a motor (with_rotor) keeps the rate instead.
        kr.Scene computes this momentum from the start. In scene.body it is part of `rotor`, and the
        moment of the wheel about the axle is not part of `inertia`. The methods `replace` and
        `vary` of a scene keep the momentum unless they are given a body with another wheel. kr.fit
        treats the body as that gyrostat: its result has no wheel.

        The arguments may be arrays, which broadcast with the bodies. A body has at most three
        wheels; the rates of the others are path.second_wheel_rate and path.third_wheel_rate. The
        frame may be without mass if the body is symmetric about the axle; the rate is then
        constant, and scenes with damping or friction are refused. Raises ValueError if the axis is
        zero, the inertia not positive, or the wheel heavier about its axle than the body.

        >>> import kreisel as kr
        >>> disk, axle = kr.Body.disk(0.05, (0, 0, -0.06), mass=0.5), (0, 0, 1)
        >>> gyroscope = disk.with_wheel(inertia=disk.inertia[2], axis=axle, rate=300)
        >>> scene = kr.Scene.spinning(gyroscope, spin=0.5, tilt=1.0, gravity=9.81)
        >>> path = kr.solve(scene, [0.0, 1.0])
        >>> [round(float(rate), 6) for rate in path.wheel_rate]
        [300.0, 300.0]
        """
        moment, rates = (
            arguments.as_finite_array(name, given, "a number")
            for name, given in (("inertia", inertia), ("rate", rate))
        )
        if (moment <= 0.0).any():
            parameters.refuse_first("inertia", inertia, moment <= 0.0, "must be positive")
        direction = _read_axes(arguments.as_finite_array("axis", axis, "3 numbers"))
        own = np.einsum("...i,...ij,...j->...", direction, self._tensors, direction)
        is_heavy = np.asarray(moment > own * (1.0 + INPUT_RTOL))
        if is_heavy.any():
            most = float(np.broadcast_to(own, is_heavy.shape)[is_heavy][0])
            given = np.broadcast_to(moment, is_heavy.shape) if is_heavy.shape else inertia
            text = f"must not exceed {most!r}, the moment of the whole body about the axle"
            parameters.refuse_first("inertia", given, is_heavy, text)
        rotor = np.asarray(self.rotor) + (moment * rates)[..., None] * direction
        row = np.stack(np.broadcast_arrays(*np.moveaxis(direction, -1, 0), rates, moment), axis=-1)
        wheels = _combine_wheels(np.asarray(self.wheels), row[..., None, :])
        return _join(self.mass, self._tensors, np.asarray(self.com), rotor, self, wheels=wheels)

    def __repr__(self) -> str:
        if self.shape:
            return self._describe()
        words = f"mass={self.mass!r}, inertia={self.inertia!r}, com={self.com!r}"
        words += f", inertia_rtol={self.inertia_rtol!r}" if self.inertia_rtol else ""
        words += f", rotor={self.rotor!r}" if any(self.rotor) else ""
        words += f", wheels={self._used_wheels!r}" if self._has_wheels else ""
        return f"{type(self).__name__}({words}{', unphysical=True' if self.unphysical else ''})"

    def _list_displayed_parameters(self) -> Mapping[str, Any]:
        words = {name: getattr(self, name) for name in ("mass", "inertia", "com")}
        if np.any(self.rotor):
            words["rotor"] = self.rotor
        if self._has_wheels:
            words["wheels"] = self._used_wheels
        return words

    @cached_property
    def kind(self) -> Any:
        """The integrable case, or 'general'; an array for many.

        The cases are 'euler', 'lagrange', 'kowalewski', 'goryachev_chaplygin' and 'gyrostat'.

        The conditions for each kind of body are checked to a relative tolerance of 7e-15, which
        allows for rounding errors. A body with a rotor is of kind 'general', except for 'euler' and
        'lagrange' bodies whose rotor lies along the symmetry axis, and for bodies supported at the
        centre of mass with any other rotor, which are of kind 'gyrostat'.
        """
        if self.shape:
            return np.array([one.kind for one in self.ravel()], dtype=np.str_).reshape(self.shape)
        return body_kind(self._block, KIND_RTOL)

    @cached_property
    def _nearby_integrable_case_message(self) -> str:
        """A note that the body meets the conditions of another kind of top within 1e-8, or ''."""
        tolerance, own_kind = KIND_RTOL, self.kind
        while tolerance < 1e-8:
            tolerance *= 2.0
            kind = body_kind(self._block, tolerance)
            if kind != own_kind:
                return f"{kind!r} only up to {tolerance:.1g} relative"
        return ""

    @property
    def is_symmetric(self) -> Any:
        """True if two of the principal moments are equal within a relative tolerance of 7e-15."""
        moments = np.moveaxis(np.asarray(self.moments), -1, 0)
        is_equal = [abs(a - b) <= KIND_RTOL * np.maximum(a, b) for a, b in combinations(moments, 2)]
        return np.any(is_equal, axis=0) if self.shape else any(is_equal)

    @classmethod
    def _combine_bodies(cls, given: Sequence[Body], shape: Shape) -> Body:
        """Join a list of bodies to an array, or return the first body if all of them are equal."""
        first = given[0]
        if all(one is first or (one == first and one._block == first._block) for one in given):
            return first
        words = {
            name: np.array([getattr(one, name) for one in given])
            for name in ("mass", "com", "inertia_rtol", "unphysical", "rotor", "wheels")
        }
        words["inertia"] = np.array([one._tensors for one in given])
        rows = {name: x.reshape(*shape, *x.shape[1:]) for name, x in words.items()}
        return cls(**rows)._note_varying_parameters([])

    def _broadcast_to(self, shape: Shape) -> Body:
        """Return an array of bodies broadcast to `shape`."""
        if shape == self.shape:
            return self
        front = len(shape) - len(self.shape)
        return self._with(
            shape,
            (None,) * front + self._names,
            lambda column: column.reshape((1,) * front + column.shape),
        )


class ThinRods(Body):
    """Thin rods that lie on one line through the fixed point and must be joined to another body.

    The moment of inertia about the line of the rods is zero.
    """

    def __init__(
        self,
        mass: float,
        inertia: ArrayLike,
        com: ArrayLike,
        *,
        inertia_rtol: float = 0.0,
        unphysical: bool = False,
        rotor: ArrayLike = _NOTHING,
    ) -> None:
        tensor = _as_matrices(read_parameter("inertia", inertia).values, 0)
        is_diagonal = (tensor == np.diag(tensor.diagonal())).all()
        self.__dict__.update(
            mass=mass,
            inertia=tuple(
                tensor.diagonal().tolist() if is_diagonal else map(tuple, tensor.tolist())
            ),
            com=arguments.as_three_floats("com", com),
            rotor=tuple(x + 0.0 for x in arguments.as_three_floats("rotor", rotor)),
            inertia_rtol=inertia_rtol,
            unphysical=unphysical,
            wheels=NO_WHEELS,
        )

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            if name not in {"_block", *_PRINCIPAL}:
                raise AttributeError(f"'ThinRods' object has no attribute {name!r}")
            raise ValueError(
                "a thin rod whose fixed point lies on its own line has no moment about that line "
                "and cannot move alone: add it to another body, or use a cylinder"
            )


def _read_amount(name: str, mass: ArrayLike | None, density: ArrayLike | None) -> BatchParameter:
    """Return the parameter `mass` or `density`, of which one must be given."""
    if (mass is None) == (density is None):
        correction = "not both" if mass is not None else "not none"
        raise ValueError(f"give exactly one of mass and density of the {name}, {correction}")
    if mass is None:
        return read_parameter("density", density)
    return read_parameter("mass", mass)


def _join(
    mass: Any, tensor: Array, com: Array, rotor: Array, *parts: Body, wheels: Any = None
) -> Body:
    """Build the body formed by the given parts, or ThinRods if all parts are rods on one line."""
    if wheels is None and any(part._has_wheels for part in parts):
        wheels = _combine_wheels(*(np.asarray(part.wheels) for part in parts))
    unphysical: Any = False
    inertia_rtol: Any = 0.0
    for part in parts:
        unphysical = np.logical_or(unphysical, part.unphysical)
        inertia_rtol = np.maximum(inertia_rtol, part.inertia_rtol)
    is_finite_one = tensor.ndim == 2 and np.isfinite(tensor).all()
    if is_finite_one and all(isinstance(part, ThinRods) for part in parts):
        least, _, largest = sorted(_principal_moments(tensor))
        if least <= INPUT_RTOL * largest:
            flag, own = bool(unphysical), rotor.tolist()
            return ThinRods(float(mass), tensor, com.tolist(), unphysical=flag, rotor=own)
    inertia = BatchParameter("inertia", tensor, (3, 3))
    words = [one for part in parts for one in part._list_varying_parameters()]
    rows = NO_WHEELS if wheels is None else wheels
    return Body.__new__(Body)._store_parts(
        words, np.asarray(mass), inertia, com, inertia_rtol, unphysical, rotor, rows
    )


def _read_axes(given: ArrayLike) -> Array:
    """Return unit vectors along the axes of rotors."""
    axes = np.asarray(given)
    if axes.shape[-1:] != (3,):
        raise ValueError(f"axis must be 3 numbers, not {short_repr(given)}")
    longest = np.abs(axes).max(axis=-1, keepdims=True)
    if (longest == 0.0).any():
        raise ValueError("axis must not be zero: it is the direction of the rotor's axis")
    scaled = axes / longest
    unit_axes: Array = scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)
    return unit_axes


def _combine_wheels(*given: Array) -> Array:
    """Return the wheels of several parts as rows, in their order."""
    lead = np.broadcast_shapes(*(rows.shape[:-2] for rows in given))
    parts = [np.broadcast_to(rows, (*lead, *rows.shape[-2:])) for rows in given]
    rows = np.concatenate([*parts, np.zeros((*lead, _MOST_WHEELS, 5))], axis=-2)
    is_used = rows.any(axis=(*range(len(lead)), -1))
    if is_used.sum() > _MOST_WHEELS:
        raise ValueError(f"a body has at most {_MOST_WHEELS} wheels on free axles")
    order = np.argsort(~is_used, kind="stable")[:_MOST_WHEELS]
    return np.asarray(rows[..., order, :])


def _as_matrices(tensors: Array, dims: int) -> Array:
    """Return inertia tensors with `dims` leading dimensions as matrices."""
    if tensors.ndim == dims + 2:
        return tensors
    matrices = np.zeros((*tensors.shape, 3))
    matrices[..., range(3), range(3)] = tensors
    return matrices


def _principal_moments(tensor: Array) -> list[float]:
    diagonal = (tensor == np.diag(tensor.diagonal())).all()
    moments: list[float] = (tensor.diagonal() if diagonal else np.linalg.eigvalsh(tensor)).tolist()
    return moments


def _describe_unphysical_inertia(mass: Array, tensor: Array, com: Array) -> str:
    rest = _add_point_masses(BatchParameter("inertia", tensor, (3, 3)), -mass, com).values
    moments = _principal_moments(rest) if np.isfinite(rest).all() else [-math.inf]
    return (
        f"no body has this inertia about the fixed point: about its centre of mass the moments "
        f"would be {', '.join(f'{moment:.4g}' for moment in moments)}. Give an inertia about the "
        "centre of mass as inertia_about_com. Pass unphysical=True if mass and com are only "
        "parameters of a model"
    )
