"""Arrays of bodies, with vectorized constructors. All bodies of an array are validated at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from .._core import INPUT_RTOL
from .._core import bodies as bodies_of
from .._utils.errors import make_frozen_class_decorator, warn_user
from .._utils.validation import Array, as_array, freeze_array, short_repr
from .batch import BatchBase
from .body import Body
from .broadcasting import (
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
from .inertia import (
    describe_unphysical_inertia,
    validate_inertia_tensor,
    validate_inertia_tolerance,
)
from .shape_constructors import ShapeConstructors, ShapeFunction
from .shapes import check_mass_xor_density

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
