"""Rigid bodies with one fixed point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from struct import unpack
from typing import TYPE_CHECKING, Self, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from .._core import INPUT_RTOL, KIND_RTOL, body_from_tensor, body_kind
from .._utils.errors import make_exception_from_status, make_frozen_class_decorator, warn_user
from .._utils.name_hints import NoKeywords, has_unknown_keywords, refuse_unknown_keywords
from .._utils.validation import (
    Array,
    Quaternion,
    Vector,
    as_bool,
    as_float,
    as_non_negative,
    as_positive,
    as_three_floats,
)
from ..quaternion import turn, unit
from .inertia import (
    add_point_mass_inertia,
    compute_inertia_displacement_term,
    convert_tensor_to_moments_or_rows,
    describe_triangle_violation,
    describe_unphysical_inertia,
    find_ill_conditioned_inertia_error,
    inertia_at_fixed_point,
    principal_moments,
    validate_inertia_tensor,
    validate_inertia_tolerance,
)
from .shape_constructors import ShapeConstructors, ShapeFunction
from .shapes import compute_shape_mass, rod

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


@make_frozen_class_decorator("dataclasses.replace(body, {}=...) returns a new body")
@dataclass(frozen=True, init=False)
class Body(ShapeConstructors[float, float | Vector]):
    """A rigid body that rotates about the origin of the frame in which it is described.

    mass          [M], positive
    inertia       inertia about the fixed point [M L^2]: three moments along the axes of the frame,
                  or a symmetric 3x3 matrix. Alternatively, inertia_about_com: the inertia about the
                  centre of mass
    com           position of the centre of mass relative to the fixed point [L]
    inertia_rtol  relative amount by which the largest principal moment may exceed the sum of the
                  other two, 0 <= inertia_rtol < 1, for rounded values from the literature. The
                  moments are used as given
    unphysical    True to allow an inertia that no distribution of mass has, as in models where only
                  mass * gravity * |com| matters
    rotor         constant angular momentum of rotors relative to the body (a gyrostat), in the
                  frame of the body [M L^2 T^-1]. The total angular momentum is J w + rotor. The
                  inertia includes the rotors, as if they were at rest

    The principal moments must be positive, and none may exceed the sum of the other two. The
    condition on the principal moments is checked to a relative tolerance of 1e-12, so plates and
    rods are accepted. If the inertia is a non-diagonal matrix, its least principal moment must
    exceed 2e-10 times the largest one, because rounding would leave a smaller moment with at most
    six correct digits.

    Raises TypeError if an argument is not numeric, and ValueError if the values do not describe a
    rigid body. Warns (UserWarning) if no mass distribution has the given inertia about the fixed
    point, unless `unphysical` is True. The attribute `unphysical` is True whenever no mass
    distribution has the inertia of the body.

    >>> import kreisel as kr
    >>> kr.Body(mass=0.5, inertia_about_com=(2e-4, 2e-4, 1e-4), com=(0, 0, 0.1)).kind
    'lagrange'
    """

    # The core has some of the same constructors, with results that are equal to the last bit. But
    # the core stores only principal moments and axes, while a Body also stores the inertia as
    # given.

    mass: float
    inertia: Vector | tuple[Vector, Vector, Vector]
    com: Vector
    inertia_rtol: float = 0.0
    unphysical: bool = field(default=False, compare=False)
    rotor: Vector = (0.0, 0.0, 0.0)
    # bytes of a kr_body: mass, moments, com, axes, inertia_rtol, which kr_body calls `rounded`, and
    # the rotor along the principal axes
    _block: bytes = field(init=False, compare=False)

    @has_unknown_keywords("Body")
    def __init__(
        self,
        mass: float,
        inertia: ArrayLike | None = None,
        com: ArrayLike | None = None,
        *,
        inertia_about_com: ArrayLike | None = None,
        inertia_rtol: float = 0.0,
        unphysical: bool = False,
        rotor: ArrayLike = (0.0, 0.0, 0.0),
        **unknown: Unpack[NoKeywords],
    ) -> None:
        if unknown:
            refuse_unknown_keywords(Body.__init__, unknown)
        if com is None:
            raise TypeError("com is missing: give the centre of mass relative to the fixed point")
        if inertia is None or inertia_about_com is not None:
            tensor = inertia_at_fixed_point(mass, inertia, inertia_about_com, com)
        else:
            tensor = validate_inertia_tensor("inertia", inertia)
        fields = self.__dict__
        fields["mass"], fields["inertia"] = (
            as_positive("mass", mass),
            convert_tensor_to_moments_or_rows(tensor),
        )
        fields["com"], fields["inertia_rtol"] = (
            as_three_floats("com", com),
            validate_inertia_tolerance(inertia_rtol) if inertia_rtol else 0.0,
        )
        fields["rotor"] = _validate_rotor(rotor)
        status, fields["_block"], can_be = body_from_tensor(
            fields["mass"], tensor, fields["com"], fields["inertia_rtol"], fields["rotor"]
        )
        if status != "OK":
            raise find_ill_conditioned_inertia_error(tensor) or make_exception_from_status(
                status, describe_triangle_violation(tensor, fields["inertia_rtol"])
            )
        if unphysical is not False:
            as_bool("unphysical", unphysical)
        elif not can_be:
            warn_user(describe_unphysical_inertia(self.mass, tensor, self.com))
        fields["unphysical"] = unphysical or not can_be

    @classmethod
    def symmetric(
        cls,
        mass: float,
        i1: float,
        i3: float,
        height: float,
        *,
        inertia_rtol: float = 0.0,
        unphysical: bool = False,
    ) -> Self:
        """Build a Lagrange top from its moments of inertia i1, i1, i3 at the fixed point [M L^2].

        The centre of mass is at (0, 0, height) [L]. The other arguments are described in Body.
        """
        moment_1, moment_3 = as_float("i1", i1), as_float("i3", i3)
        com = (0.0, 0.0, as_float("height", height))
        return cls(
            mass,
            (moment_1, moment_1, moment_3),
            com,
            inertia_rtol=inertia_rtol,
            unphysical=unphysical,
        )

    @classmethod
    def from_com(
        cls,
        mass: float,
        inertia_about_com: ArrayLike,
        com: ArrayLike,
        pivot: ArrayLike,
        *,
        inertia_rtol: float = 0.0,
        unphysical: bool = False,
    ) -> Self:
        """Build a body from its inertia about the centre of mass [M L^2].

        `com` and `pivot` are the positions of the centre of mass and of the fixed point [L],
        relative to a common origin. The other arguments are described in Body. Steiner's theorem
        (Bodack 2008, 2.14) says J = J_com + mass * (|a|^2 1 - a a^t) with a = com - pivot.
        """
        tensor = validate_inertia_tensor("inertia_about_com", inertia_about_com)
        a = np.subtract(as_three_floats("com", com), as_three_floats("pivot", pivot))
        pivot_tensor = add_point_mass_inertia(tensor, as_positive("mass", mass), a)
        return cls(mass, pivot_tensor, a, inertia_rtol=inertia_rtol, unphysical=unphysical)

    @classmethod
    def _validate_positive(cls, name: str, value: float) -> float:
        return as_positive(name, value)

    @classmethod
    def _validate_non_negative(cls, name: str, value: float) -> float:
        return as_non_negative(name, value)

    @classmethod
    def _validate_half_lengths(cls, half: ArrayLike) -> Vector:
        a, b, c = (as_positive("half", x) for x in as_three_floats("half", half))
        return a, b, c

    @classmethod
    def _validate_tube_radii(cls, inner: float, outer: float) -> tuple[float, float]:
        hole, r = as_float("inner", inner), as_positive("outer", outer)
        if not 0.0 <= hole <= r:
            raise ValueError(f"inner must lie between 0 and outer = {r!r}, not {hole!r}")
        return hole, r

    @classmethod
    def _build_from_shape(
        cls,
        compute_shape: ShapeFunction,
        sizes: Sequence[float | Vector],
        pivot: ArrayLike,
        mass: float | None,
        density: float | None,
        **options: bool,
    ) -> Self:
        shape = compute_shape(*sizes, **options)
        total = compute_shape_mass(shape, mass, density)
        moments, com = shape.compute_moments(total), (0.0, 0.0, shape.height)
        if compute_shape is not rod:
            return cls.from_com(total, moments, com, pivot)
        lever = np.subtract(com, as_three_floats("pivot", pivot))
        tensor = add_point_mass_inertia(np.diag(moments), total, lever)
        return cast(Self, _build_body_from_parts(total, tensor, lever, np.zeros(3)))

    def __add__(self, other: Body) -> Body:
        """Join two bodies that are described in the same frame and share the fixed point."""
        if not isinstance(other, Body):
            return NotImplemented
        mass = self.mass + other.mass
        com = self.mass * np.array(self.com) + other.mass * np.array(other.com)
        tensor = validate_inertia_tensor("inertia", self.inertia) + validate_inertia_tensor(
            "inertia", other.inertia
        )
        rotor = np.add(self.rotor, other.rotor)
        return _build_body_from_parts(mass, tensor, com / mass, rotor, self, other)

    def shift(self, by: ArrayLike) -> Body:
        """Return the body shifted by the vector `by` [L] relative to the fixed point.

        >>> import kreisel as kr
        >>> kr.Body.sphere(5, (0, 0, 0), mass=1).shift((0, 0, 3)).moments
        (19.0, 19.0, 10.0)
        """
        displacement, com = np.array(as_three_floats("by", by)), np.array(self.com)
        tensor = validate_inertia_tensor(
            "inertia", self.inertia
        ) + compute_inertia_displacement_term(self.mass, com, displacement)
        return _build_body_from_parts(
            self.mass, tensor, com + displacement, np.array(self.rotor), self
        )

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
        tensor = axes.T @ validate_inertia_tensor("inertia", self.inertia) @ axes
        com, rotor = np.array(self.com) @ axes, np.array(self.rotor) @ axes
        return _build_body_from_parts(self.mass, 0.5 * (tensor + tensor.T), com, rotor, self)

    def with_rotor(self, *, spin: float, inertia: float, axis: ArrayLike) -> Body:
        """Return a copy of the body with an additional rotor.

        spin     angular velocity of the rotor relative to the body, about `axis` [rad/T]. A motor
                 keeps it constant
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
        size = as_float("spin * inertia", as_float("spin", spin) * as_positive("inertia", inertia))
        direction = np.array(as_three_floats("axis", axis))
        longest = np.abs(direction).max()
        if longest == 0.0:
            raise ValueError("axis must not be zero: it is the direction of the rotor's axis")
        unit_axis = direction / longest / np.linalg.norm(direction / longest)
        return replace(self, rotor=np.array(self.rotor) + size * unit_axis)

    def __repr__(self) -> str:
        words = f"mass={self.mass!r}, inertia={self.inertia!r}, com={self.com!r}"
        words += f", inertia_rtol={self.inertia_rtol!r}" if self.inertia_rtol else ""
        words += f", rotor={self.rotor!r}" if any(self.rotor) else ""
        return f"{type(self).__name__}({words}{', unphysical=True' if self.unphysical else ''})"

    @property
    def moments(self) -> Vector:
        """The principal moments of inertia at the fixed point [M L^2], along N, B, T."""
        _, i1, i2, i3, *_ = unpack("15d", self._block)
        return i1, i2, i3

    @property
    def axes(self) -> Quaternion:
        """The rotation (w, x, y, z) from the principal axes N, B, T to the frame of description.

        If the inertia tensor is diagonal, the principal axes are the axes of description. For
        a non-diagonal inertia matrix, the principal axes are right-handed and as close as possible
        to the axes of the frame of description. For a Lagrange top, the principal axis T is the
        symmetry axis.
        """
        *_, w, x, y, z, _, _, _, _ = unpack("15d", self._block)
        return w, x, y, z

    @property
    def principal_com(self) -> Vector:
        """The components of the centre of mass along the principal axes N, B, T [L]."""
        _, _, _, _, x, y, z, *_ = unpack("15d", self._block)
        return x, y, z

    @property
    def principal_rotor(self) -> Vector:
        """The momentum of the rotors along N, B, T [M L^2 T^-1]."""
        *_, x, y, z = unpack("15d", self._block)
        return x, y, z

    @cached_property
    def kind(self) -> str:
        """'euler', 'lagrange', 'kowalewski', 'goryachev_chaplygin' or 'general'.

        The conditions for each kind of body are checked to a relative tolerance of 7e-15, which
        allows for rounding errors. A body with a rotor is of kind 'general', except for 'euler' and
        'lagrange' bodies whose rotor lies along the symmetry axis.
        """
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
    def is_symmetric(self) -> bool:
        """True if two of the principal moments are equal within a relative tolerance of 7e-15."""
        return any(abs(a - b) <= KIND_RTOL * max(a, b) for a, b in combinations(self.moments, 2))


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
        rotor: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        fields = self.__dict__
        fields["mass"], fields["inertia"] = (
            mass,
            convert_tensor_to_moments_or_rows(validate_inertia_tensor("inertia", inertia)),
        )
        fields["com"], fields["inertia_rtol"], fields["unphysical"] = (
            as_three_floats("com", com),
            inertia_rtol,
            unphysical,
        )
        fields["rotor"] = _validate_rotor(rotor)

    def __getattr__(self, name: str) -> bytes:
        if name != "_block":
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise ValueError(
            "a thin rod whose fixed point lies on its own line has no moment about that line and "
            "cannot move alone: add it to another body, or use a cylinder"
        )


def _validate_rotor(rotor: ArrayLike) -> Vector:
    h1, h2, h3 = as_three_floats("rotor", rotor)
    return h1 + 0.0, h2 + 0.0, h3 + 0.0  # no negative zeros


def _build_body_from_parts(
    mass: float, tensor: Array, com: Array, rotor: Array, *parts: Body
) -> Body:
    """Build the body formed by the given parts, or ThinRods if all parts are rods on one line."""
    unphysical = any(part.unphysical for part in parts)
    if np.isfinite(tensor).all() and all(isinstance(part, ThinRods) for part in parts):
        least, _, largest = sorted(principal_moments(tensor))
        if least <= INPUT_RTOL * largest:
            return ThinRods(mass, tensor, com, unphysical=unphysical, rotor=rotor)
    inertia_rtol = max((part.inertia_rtol for part in parts), default=0.0)
    return Body(mass, tensor, com, inertia_rtol=inertia_rtol, unphysical=unphysical, rotor=rotor)
