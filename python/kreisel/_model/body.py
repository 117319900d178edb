"""Bodies: one, and arrays of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import combinations
from struct import unpack
from typing import TYPE_CHECKING, Self, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from .._core import INPUT_RTOL, KIND_RTOL, body_from_tensor, body_kind
from .._core import bodies as bodies_of
from .._utils.arguments import (
    Array,
    Quaternion,
    Vector,
    as_array,
    as_bool,
    as_float,
    as_non_negative,
    as_positive,
    as_three_floats,
    freeze_array,
    make_exception_from_status,
    make_frozen_class_decorator,
    short_repr,
    warn_user,
)
from .._utils.name_hints import NoKeywords, has_unknown_keywords, refuse_unknown_keywords
from ..quaternion import turn, unit
from .batch import (
    BatchBase,
    BatchParameter,
    Column,
    Index,
    Shape,
    broadcast_column,
    broadcast_named_shapes,
    compute_common_parameter_shape,
    convert_to_python_numbers,
    name_varying_dimensions,
    split_components,
    stack_components,
    validate_non_negative_parameter,
    validate_parameter,
    validate_positive_parameter,
)
from .shapes import (
    ShapeConstructors,
    ShapeFunction,
    add_point_mass_inertia,
    check_mass_xor_density,
    compute_inertia_displacement_term,
    compute_shape_mass,
    convert_tensor_to_moments_or_rows,
    describe_triangle_violation,
    describe_unphysical_inertia,
    find_ill_conditioned_inertia_error,
    inertia_at_fixed_point,
    principal_moments,
    rod,
    validate_inertia_tensor,
    validate_inertia_tolerance,
)

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


_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


@make_frozen_class_decorator("construct new bodies with another {}")
class Bodies(ShapeConstructors[ArrayLike, BatchParameter], BatchBase[Body]):
    """An array of bodies whose parameters broadcast to a common shape.

    mass          [M], a number or an array
    inertia       inertia about the fixed point [M L^2]: (..., 3) moments or (..., 3, 3) matrices.
                  An array whose last two dimensions are both 3 is read as matrices, so three bodies
                  need three matrices. Alternatively, inertia_about_com
    com           (..., 3) position of the centre of mass relative to the fixed point [L]
    inertia_rtol  as in Body, a number or an array
    unphysical    as in Body, a bool or an array
    rotor         (..., 3) angular momentum of rotors relative to the body, as in Body [M L^2 T^-1]

    The class methods that construct a Body, such as Body.cone, also exist for arrays. Each member
    is bitwise equal to the kr.Body with the same parameters. `bodies[i]` is a Body; slices, index
    arrays and masks return Bodies. Raises the same exceptions as Body, with the index of the first
    invalid member in the message. Warns as Body does.

    >>> import kreisel as kr
    >>> tops = kr.Bodies.cone(radius=[1, 2, 3], height=2, pivot=(0, 0, 0), mass=1)
    >>> tops.shape, tops[2].com
    ((3,), (0.0, 0.0, 1.5))
    """

    def __init__(
        self,
        mass: ArrayLike,
        inertia: ArrayLike | None = None,
        com: ArrayLike | None = None,
        *,
        inertia_about_com: ArrayLike | None = None,
        inertia_rtol: ArrayLike = 0.0,
        unphysical: ArrayLike = False,
        rotor: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        if com is None:
            raise TypeError("com is missing: give the centre of mass relative to the fixed point")
        if (inertia is None) == (inertia_about_com is None):
            correction = "not none" if inertia is None else "not both"
            raise ValueError(f"give exactly one of inertia and inertia_about_com, {correction}")
        words = [validate_parameter("mass", mass), validate_parameter("com", com, (3,))]
        masses, lever = words[0].values, words[1].values
        if inertia_about_com is None:
            words.append(validate_inertia_tensors("inertia", inertia))
            compute_common_parameter_shape(*words)
            tensor = words[-1]
        else:
            words.append(validate_inertia_tensors("inertia_about_com", inertia_about_com))
            compute_common_parameter_shape(*words)
            tensor = add_inertia_of_point_masses(words[-1], masses, lever)
        self._store_parameters(Body, words, masses, tensor, lever, inertia_rtol, unphysical, rotor)

    def _store_parameters(
        self,
        make: Callable[..., Body],
        words: Sequence[BatchParameter],
        mass: Array,
        tensor: BatchParameter,
        com: Array,
        inertia_rtol: ArrayLike = 0.0,
        unphysical: ArrayLike = False,
        rotor: ArrayLike = (0.0, 0.0, 0.0),
    ) -> Self:
        """Validate all parameters and store them as columns.

        Raises the exception that the constructor `make` would raise for the first invalid body of
        the array.
        """
        slacks = validate_parameter("inertia_rtol", inertia_rtol)
        unphysical_flags = _validate_boolean_array("unphysical", unphysical)
        slacks.raise_error_of_first_bad_value(
            ~((slacks.values >= 0.0) & (slacks.values < 1.0)),
            lambda _, x: validate_inertia_tolerance(x),
        )
        rotors = _validate_rotors(rotor)
        parameters = [*words, *(each for each in (slacks, rotors) if np.any(each.values))]
        names, shapes = [each.name for each in parameters], [each.shape for each in parameters]
        shapes += [unphysical_flags.shape, rotors.shape]
        shape = broadcast_named_shapes([*names, "unphysical", "rotor"], shapes)
        columns: dict[str, Column] = {
            "mass": broadcast_column(mass, shape, 0),
            "inertia": broadcast_column(tensor.values, shape, len(tensor.value)),
            "com": broadcast_column(com, shape, 1),
            "inertia_rtol": broadcast_column(slacks.values, shape, 0),
            "rotor": broadcast_column(rotors.values, shape, 1),
        }
        self._set_shape_and_columns(shape, name_varying_dimensions(shape, parameters), columns, {})
        self.__dict__["_varied"] = {
            each.name: broadcast_column(each.values, shape, len(each.value))
            for each in parameters
            if each.shape
        }
        can_be = self._find_members_with_possible_inertia(make, parameters, tensor.value == (3, 3))
        if not (can_be | unphysical_flags).all():
            self._warn_about_unphysical_bodies(~(can_be | unphysical_flags))
        columns["unphysical"] = broadcast_column(unphysical_flags | ~can_be, shape, 0)
        return self

    def _find_members_with_possible_inertia(
        self, make: Callable[..., Body], parameters: Sequence[BatchParameter], matrices: bool
    ) -> Column:
        """Return a boolean array that marks the members with a physically possible inertia.

        If the inertia is given as matrices, the principal moments and axes are stored. Raises
        the exception of a single-body constructor for the first member that it would refuse.
        """
        columns = dict(self._columns)
        if matrices:
            flat = columns["inertia"]
            columns["inertia"] = flat.reshape(*self.shape, 9)
        status, index, can_be, blocks = bodies_of(self.shape, list(columns.values()), matrices)
        if status != "OK":
            raise self._make_invalid_body_error(
                make, parameters, tuple(map(int, np.unravel_index(index, self.shape)))
            )
        table: dict[str, Column] = self._columns  # type: ignore[assignment]
        if matrices:
            blocks = freeze_array(blocks).reshape(*self.shape, 15)
            table["moments"], table["principal_com"] = blocks[..., 1:4], blocks[..., 4:7]
            table["axes"], table["principal_rotor"] = blocks[..., 7:11], blocks[..., 12:]
        return can_be.reshape(self.shape)

    def _make_invalid_body_error(
        self, make: Callable[..., Body], parameters: Sequence[BatchParameter], index: Index
    ) -> Exception:
        """Return the exception that the single-body constructor raises for an invalid member."""
        arguments = {
            each.name: convert_to_python_numbers(each.broadcast_to(self.shape)[index])
            for each in parameters
        }
        try:
            make(**arguments)._block  # noqa: B018  raises the error of an invalid body
        except (TypeError, ValueError) as error:
            return type(error)(f"body{list(index)}: {error}" if index else str(error))
        return ValueError(f"body{list(index)}: not a body")

    def _warn_about_unphysical_bodies(self, odd: Column) -> None:
        index = tuple(map(int, np.unravel_index(int(odd.argmax()), odd.shape)))
        mass, tensor, com, _ = (
            convert_to_python_numbers(column[index]) for column in list(self._columns.values())[:4]
        )
        description = describe_unphysical_inertia(
            mass, validate_inertia_tensor("inertia", tensor), com
        )
        count = int(odd.sum())
        more = f" (and {count - 1} more)" if count > 1 else ""
        warn_user(f"body{list(index)}{more}: {description}" if index else description)

    def _select_member(self, index: Index) -> Body:
        names = "mass", "inertia", "com", "inertia_rtol", "unphysical", "rotor"
        mass, tensor, com, *rest = (
            convert_to_python_numbers(self._columns[name][index]) for name in names
        )
        words = dict(zip(names[3:], rest, strict=True))
        return Body(mass, tensor, com, **words)

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
        """Build an array of Lagrange tops (see Body.symmetric).

        The moments of inertia at the fixed point are i1, i1, i3 [M L^2]. The centre of mass is at
        (0, 0, height) [L].

        >>> import kreisel as kr
        >>> kr.Bodies.symmetric(1, i1=2, i3=[1, 2, 3], height=0.5)[0].kind
        'lagrange'
        """
        words = [
            validate_parameter("mass", mass),
            validate_parameter("i1", i1),
            validate_parameter("i3", i3),
            validate_parameter("height", height),
        ]
        compute_common_parameter_shape(*words)
        masses, moments_1, moments_3, heights = (each.values for each in words)
        com = stack_components(np.zeros_like(heights), np.zeros_like(heights), heights)
        tensor = BatchParameter("inertia", stack_components(moments_1, moments_1, moments_3), (3,))
        bodies = cls.__new__(cls)
        return bodies._store_parameters(
            Body.symmetric, words, masses, tensor, com, inertia_rtol, unphysical
        )

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
        """Build an array of bodies from their inertia about the centre of mass (see Body.from_com).

        The inertia [M L^2] is given in the same form as in Bodies. `com` and `pivot` are positions
        [L] with the shape (..., 3).
        """
        weight, tensor = (
            validate_parameter("mass", mass),
            validate_inertia_tensors("inertia_about_com", inertia_about_com),
        )
        centre, pivots = (
            validate_parameter("com", com, (3,)),
            validate_parameter("pivot", pivot, (3,)),
        )
        compute_common_parameter_shape(weight, tensor, centre, pivots)
        with np.errstate(all="ignore"):
            lever = centre.values - pivots.values
        pivot_tensor = add_inertia_of_point_masses(tensor, weight.values, lever)
        words = [weight, tensor, centre, pivots]
        bodies = cls.__new__(cls)
        return bodies._store_parameters(
            Body.from_com, words, weight.values, pivot_tensor, lever, inertia_rtol, unphysical
        )

    @classmethod
    def _validate_positive(cls, name: str, value: ArrayLike) -> BatchParameter:
        return validate_positive_parameter(name, value)

    @classmethod
    def _validate_non_negative(cls, name: str, value: ArrayLike) -> BatchParameter:
        return validate_non_negative_parameter(name, value)

    @classmethod
    def _validate_half_lengths(cls, half: ArrayLike) -> BatchParameter:
        lengths = validate_parameter("half", half, (3,))
        bad = ~(lengths.values > 0.0).all(axis=-1)
        lengths.raise_error_of_first_bad_value(bad, lambda _, x: Body._validate_half_lengths(x))
        return lengths

    @classmethod
    def _validate_tube_radii(
        cls, inner: ArrayLike, outer: ArrayLike
    ) -> tuple[BatchParameter, BatchParameter]:
        hole, r = validate_parameter("inner", inner), validate_positive_parameter("outer", outer)
        compute_common_parameter_shape(hole, r)
        radii = BatchParameter("(inner, outer)", stack_components(hole.values, r.values), (2,))
        bad = ~((hole.values >= 0.0) & (hole.values <= r.values))
        radii.raise_error_of_first_bad_value(bad, lambda _, x: Body._validate_tube_radii(*x))
        return hole, r

    @classmethod
    def _build_from_shape(
        cls,
        compute_shape: ShapeFunction,
        sizes: Sequence[BatchParameter],
        pivot: ArrayLike,
        mass: ArrayLike | None,
        density: ArrayLike | None,
        **options: bool,
    ) -> Self:
        compute_common_parameter_shape(*sizes)
        with np.errstate(all="ignore"):
            values = [split_components(x.values) if x.value else x.values for x in sizes]
            shape = compute_shape(*values, **options)
        check_mass_xor_density(shape, mass, density)
        pivots = validate_parameter("pivot", pivot, (3,))
        name, amount = ("mass", mass) if density is None else ("density", density)
        weight = validate_positive_parameter(name, amount)
        words = [*sizes, pivots, weight]
        compute_common_parameter_shape(*words)
        with np.errstate(all="ignore"):
            total = weight.values if density is None else shape.compute_mass(weight.values)
            if density is not None:
                validate_positive_parameter(f"mass of the {shape.name}", total)
            moments, zero = shape.compute_moments(total), np.zeros_like(shape.height)
            com = stack_components(zero, zero, shape.height) - pivots.values
            tensor = add_inertia_of_point_masses(
                BatchParameter("inertia", stack_components(*moments), (3,)), total, com
            )
        make = partial(getattr(Body, compute_shape.__name__), **options)
        return cls.__new__(cls)._store_parameters(make, words, total, tensor, com)

    @property
    def mass(self) -> Array:
        """(...,) masses [M]."""
        return self._columns["mass"]

    @property
    def inertia(self) -> Array:
        """(..., 3) moments or (..., 3, 3) matrices of inertia about the fixed point [M L^2]."""
        return self._columns["inertia"]

    @property
    def com(self) -> Array:
        """(..., 3) positions of the centres of mass relative to the fixed point [L]."""
        return self._columns["com"]

    @property
    def inertia_rtol(self) -> Array:
        """(...,) relative tolerances of the triangle inequality, as in Body."""
        return self._columns["inertia_rtol"]

    @property
    def unphysical(self) -> Column:
        """(...,) True if no distribution of mass has this inertia, or if the user passed True."""
        return self._columns["unphysical"]

    @property
    def rotor(self) -> Array:
        """(..., 3) angular momenta of the rotors relative to the bodies [M L^2 T^-1]."""
        return self._columns["rotor"]

    @property
    def moments(self) -> Array:
        """(..., 3) principal moments at the fixed point, along N, B, T [M L^2]."""
        return self._columns.get("moments", self._columns["inertia"])

    @property
    def principal_com(self) -> Array:
        """(..., 3) centres of mass, in components along N, B, T [L]."""
        return self._columns.get("principal_com", self._columns["com"])

    @property
    def principal_rotor(self) -> Array:
        """(..., 3) momenta of the rotors, in components along N, B, T [M L^2 T^-1]."""
        return self._columns.get("principal_rotor", self._columns["rotor"])

    @property
    def axes(self) -> Array:
        """(..., 4) rotations (w, x, y, z) from the principal axes to the frame of description."""
        return self._columns.get("axes", np.broadcast_to(_UPRIGHT, (*self.shape, 4)))

    @classmethod
    def _combine_bodies(cls, bodies: Sequence[Body], shape: Shape) -> Body | Self:
        """Build bodies from a list, or return the first body if all of them are equal."""
        first = bodies[0]
        if all(body is first or (body == first and body._block == first._block) for body in bodies):
            return first
        tensors = [validate_inertia_tensor("inertia", body.inertia) for body in bodies]
        batch = cls(
            np.reshape([body.mass for body in bodies], shape),
            np.reshape(tensors, (*shape, 3, 3)),
            np.reshape([body.com for body in bodies], (*shape, 3)),
            inertia_rtol=np.reshape([body.inertia_rtol for body in bodies], shape),
            unphysical=np.reshape([body.unphysical for body in bodies], shape),
            rotor=np.reshape([body.rotor for body in bodies], (*shape, 3)),
        )
        return batch._forget_varying_parameters()

    def _broadcast_to(self, shape: Shape) -> Bodies:
        """Return the bodies broadcast to `shape`."""
        front = len(shape) - len(self.shape)
        if not front and shape == self.shape:
            return self
        dims = len(self.shape)
        names = (None,) * front + self._names
        return self._apply_to_columns(
            lambda column: np.broadcast_to(column, shape + column.shape[dims:]), shape, names
        )


def validate_inertia_tensors(name: str, tensors: object) -> BatchParameter:
    """Validate inertias given as moments, or as matrices if the last two dimensions have length 3.

    Raises ValueError for the first matrix that is not symmetric.
    """
    description = "3 moments or a symmetric 3x3 matrix, or an array of them"
    if isinstance(tensors, BatchParameter):
        parameter = tensors
    else:
        values = (
            tensors if isinstance(tensors, np.ndarray) else as_array(name, tensors, description)
        )
        value = (3, 3) if values.shape[-2:] == (3, 3) else (3,)
        parameter = validate_parameter(name, values, value, description)
    if parameter.value == (3,):
        return parameter
    with np.errstate(over="ignore"):
        skew = np.abs(parameter.values - parameter.values.swapaxes(-1, -2)).max(axis=(-1, -2))
    parameter.raise_error_of_first_bad_value(
        skew > INPUT_RTOL * np.abs(parameter.values).max(axis=(-1, -2)), _check_inertia_matrix
    )
    return parameter


def _check_inertia_matrix(name: str, matrix: object) -> None:
    try:
        validate_inertia_tensor(name, matrix)
    except ValueError as error:
        hint = "; to give three bodies by their moments, pass three matrices made by np.diag"
        raise ValueError(f"{error}{hint}") from None


def add_inertia_of_point_masses(
    tensor: BatchParameter, mass: Array, lever: Array
) -> BatchParameter:
    """Add the inertia of point masses at the positions `lever` to inertia tensors.

    The result contains moments if `tensor` contains moments and all sums are diagonal, and matrices
    otherwise.
    """
    x, y, z = split_components(lever)
    with np.errstate(all="ignore"):
        xx, yy, zz = mass * (x * x), mass * (y * y), mass * (z * z)
        xy, yz, zx = (0.0 - mass * product for product in (x * y, y * z, z * x))
        terms = (yy + zz, xy, zx), (xy, zz + xx, yz), (zx, yz, xx + yy)
        if tensor.value == (3,):
            i1, i2, i3 = (
                moment + terms[k][k] for k, moment in enumerate(split_components(tensor.values))
            )
            if not (xy.any() or yz.any() or zx.any()):
                return BatchParameter(tensor.name, stack_components(i1, i2, i3), (3,))
            flat = stack_components(i1, xy, zx, xy, i2, yz, zx, yz, i3)
        else:
            places = [(i, j) for i in range(3) for j in range(3)]
            flat = stack_components(*(tensor.values[..., i, j] + terms[i][j] for i, j in places))
    return BatchParameter(tensor.name, flat.reshape(*flat.shape[:-1], 3, 3), (3, 3))


def _validate_rotors(value: object) -> BatchParameter:
    parameter = validate_parameter("rotor", value, (3,))
    return parameter._replace(values=parameter.values + 0.0)  # no negative zeros


def _validate_boolean_array(name: str, value: object) -> Column:
    flags = np.asarray(value)
    if flags.dtype != np.bool_:
        raise TypeError(
            f"{name} must be True or False, or an array of them, not {short_repr(value)}"
        )
    return flags
