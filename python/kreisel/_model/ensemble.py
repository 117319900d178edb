"""Ensembles: arrays of scenes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .._core import INPUT_RTOL, statuses, values
from .._core import Tops as CoreTops
from .._utils.arguments import Array, R, as_bool, short_repr, validate_type
from ..quaternion import conjugate, multiply, turn, turn_back, unit
from .batch import (
    BatchBase,
    BatchParameter,
    ColumnMap,
    Index,
    Shape,
    broadcast_named_columns,
    broadcast_named_shapes,
    compute_vectors_in_blocks,
    convert_to_python_numbers,
    name_varying_dimensions,
    split_components,
    stack_components,
    validate_parameter,
)
from .body import Bodies, Body
from .euler_angles import (
    cos,
    find_symmetry_moments,
    find_symmetry_moments_of_body,
    is_steady_precession_requested,
    quaternion_from_euler,
    refuse_rotor_in_steady_precession,
    solve_steady_precession,
    validate_tilt_angle,
    velocity_from_euler,
)
from .parameters import EnvironmentArguments, validate_ensemble_environment, validate_gravities

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


def compute_angular_momentum(
    name: str,
    moments: tuple[R, R, R],
    axes: tuple[R, R, R, R],
    q: tuple[R, R, R, R],
    v: tuple[R, R, R],
    rotor: tuple[R, R, R] | None = None,
    turning: tuple[R, R, R] | None = None,
) -> tuple[R, R, R]:
    """Compute the angular momentum in the space frame from one of the four initial conditions.

    `name` is the name of the given initial condition, and `v` is its value. `q` is the attitude,
    `moments` are the principal moments of inertia, and `axes` is the rotation from the principal
    axes to the body frame. `rotor` has components along the principal axes. If the support rotates
    with the angular velocity `turning` in space, velocities are relative to the support. Zero
    components of `rotor` and `turning` must be -0.0, because adding -0.0 leaves every
    floating-point number unchanged.
    """
    if name == "momentum":
        return v
    if name == "body_momentum":
        return turn(q, v)
    if name == "body_velocity":
        v = turn(q, v)
    if turning is not None:
        v = v[0] + turning[0], v[1] + turning[1], v[2] + turning[2]
    principal = multiply(q, axes)
    x, y, z = turn_back(principal, v)
    i1, i2, i3 = moments
    components = i1 * x, i2 * y, i3 * z
    if rotor is not None:
        components = components[0] + rotor[0], components[1] + rotor[1], components[2] + rotor[2]
    return turn(principal, components)


S = TypeVar("S")
ONE_OF = "momentum", "velocity", "body_momentum", "body_velocity"
_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


class EnsembleBase(BatchBase[S]):
    """The data of kr.Ensemble: bodies, and columns of initial states and environments."""

    _one: ClassVar[Any]  # the class of one top
    _bodies: Body | Bodies

    def __init__(
        self,
        body: Body | Bodies,
        momentum: ArrayLike | None = None,
        attitude: ArrayLike | Rotation | None = None,
        gravity: ArrayLike | None = None,
        *,
        velocity: ArrayLike | None = None,
        body_momentum: ArrayLike | None = None,
        body_velocity: ArrayLike | None = None,
        attitude_xyzw: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        turning: ArrayLike | None = None,
        shaking: ArrayLike | None = None,
        friction: ArrayLike | None = None,
    ) -> None:
        arguments = dict(
            zip(ONE_OF, (momentum, velocity, body_momentum, body_velocity), strict=True)
        )
        bodies, start = validate_body_type(body), select_momentum_parameter(arguments)
        attitude_parameter, q = validate_attitudes(attitude, attitude_xyzw)
        environment = EnvironmentArguments(gravity, damping, turning, shaking, friction)
        environment_parameters, columns = validate_ensemble_environment(environment, bodies)
        parameters = [start, attitude_parameter, *environment_parameters]
        compute_common_top_shape(bodies, parameters)
        momenta = compute_start_momenta(bodies, start, q, columns["turning"])
        self._store_ensemble_columns(
            bodies, parameters, {"momentum": momenta, "attitude": q, **columns}, self._one
        )

    def _store_ensemble_columns(
        self,
        body: Body | Bodies,
        parameters: Sequence[BatchParameter],
        columns: Mapping[str, Array],
        one: Callable[..., S],
    ) -> Self:
        """Validate the parameter arrays of the ensemble, and store them as columns.

        Raises the exception that the constructor `one` would raise for the first invalid member of
        the ensemble.
        """
        shape = compute_common_top_shape(body, parameters)
        for name, column in columns.items():
            shape = np.broadcast_shapes(
                shape, column.shape[: column.ndim - _count_value_dimensions(name)]
            )
        words = [each for each in parameters if each.values.ndim > len(each.value)]
        bodies = body
        if isinstance(body, Bodies):
            words, bodies = body._list_varying_parameters() + words, body._broadcast_to(shape)
        self.__dict__["_bodies"] = bodies
        in_degrees = any(each.degrees for each in words)
        states = [(name, column, _count_value_dimensions(name)) for name, column in columns.items()]
        varied = [(each.name, each.values, len(each.value)) for each in words]
        names = name_varying_dimensions(shape, words)
        self._set_shape_and_columns(
            shape,
            names,
            broadcast_named_columns(states, shape),
            broadcast_named_columns(varied, shape),
            in_degrees,
        )
        status, index = self._core_scenes.check()
        if status != "OK":
            place = tuple(map(int, np.unravel_index(index, shape)))
            raise make_invalid_member_error(
                body, parameters, one, shape, place, statuses[status][1]
            )
        return self

    @classmethod
    def of(cls, scenes: Sequence[Any]) -> Self:
        """Build an ensemble from a list of scenes; each level of nested lists adds a dimension.

        >>> import kreisel as kr
        >>> kr.Ensemble.of([[kr.scenes.thesis], [kr.scenes.cusps]]).shape
        (2, 1)
        """
        shape: Shape = ()
        members: list[Any] = [scenes]
        while members and isinstance(members[0], (list, tuple)):
            if any(not isinstance(s, (list, tuple)) or len(s) != len(members[0]) for s in members):
                raise ValueError("lists of scenes must all have the same length")
            if len(shape) == 32:
                raise ValueError("lists of scenes must not contain themselves")
            shape, members = (*shape, len(members[0])), [scene for row in members for scene in row]
        if not members:
            raise ValueError(
                "a list of scenes must not be empty; an empty ensemble needs a body, as in "
                "kr.Ensemble(body, momentum=numpy.empty((0, 3)))"
            )
        for k, scene in enumerate(members):
            index = "".join(f"[{i}]" for i in np.unravel_index(k, shape)) if shape else ""
            validate_type(f"scenes{index}", scene, cls._one)
        rows = np.frombuffer(b"".join(scene._block for scene in members)).reshape(*shape, 34)
        columns = {
            "momentum": rows[..., 21:24],
            "attitude": rows[..., 17:21],
            "gravity": rows[..., 15],
            "damping": rows[..., 24:27],
            "turning": rows[..., 27:30],
            "shaking": rows[..., 30:33],
            "friction": rows[..., 33],
        }
        body = Bodies._combine_bodies([scene.body for scene in members], shape)
        return cls.__new__(cls)._store_ensemble_columns(body, (), columns, cls._one)

    def _apply_to_columns(
        self, change: ColumnMap, shape: Shape, names: tuple[str | None, ...]
    ) -> Self:
        ensemble = super()._apply_to_columns(change, shape, names)
        body = self._bodies
        bodies = body._apply_to_columns(change, shape, names) if isinstance(body, Bodies) else body
        ensemble.__dict__["_bodies"] = bodies
        return ensemble

    def _select_body_of_top(self, index: Index) -> Body:
        body = self._bodies
        return body._select_member(index) if isinstance(body, Bodies) else body

    def _select_member(self, index: Index) -> S:
        words = {
            name: convert_to_python_numbers(column[index]) for name, column in self._columns.items()
        }
        scene: S = self._one(self._select_body_of_top(index), **words)
        return scene

    @cached_property
    def _core_scenes(self) -> CoreTops:
        """The scenes as an array in the memory layout that the C library requires."""
        shape, columns = self.shape, self._columns
        body, nothing = self._bodies, np.broadcast_to(np.zeros(()), self.shape)
        if isinstance(body, Bodies):
            parts = [body.mass, body.moments, body.principal_com, body.axes, body.inertia_rtol]
            parts += [body.principal_rotor]
        else:
            row = np.frombuffer(body._block)
            fields = row[0], row[1:4], row[4:7], row[7:11], row[11], row[12:]
            parts = [np.broadcast_to(field, shape + field.shape) for field in fields]
        start = [columns["gravity"], nothing, columns["attitude"], columns["momentum"]]
        environment = [columns[name] for name in ("damping", "turning", "shaking", "friction")]
        return CoreTops(shape, [*parts, *start, *environment])

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of the dimensions of the ensemble.

        A dimension is named after the only parameter that varies along it, if this parameter is a
        scalar and varies along no other dimension. All other dimensions are named 'dim_k', where k
        is the index, or 'top' if the ensemble has only one dimension.
        """
        return self._dimension_names

    @property
    def body(self) -> Body | Bodies:
        """The body shared by all members, or an array of bodies with the shape of the ensemble."""
        return self._bodies

    @property
    def momentum(self) -> Array:
        """(*shape, 3) angular momentum about the fixed point, in space [M L^2 T^-1]."""
        return self._columns["momentum"]

    @property
    def attitude(self) -> Array:
        """(*shape, 4) unit quaternion (w, x, y, z) from the body into space."""
        return self._columns["attitude"]

    @property
    def gravity(self) -> Array:
        """(*shape,) acceleration along -e3 [L T^-2]."""
        return self._columns["gravity"]

    @property
    def damping(self) -> Array:
        """(*shape, 3) linear drag along the principal axes [M L^2 T^-1]."""
        return self._columns["damping"]

    @property
    def turning(self) -> Array:
        """(*shape, 3) angular velocity of the support, in space [rad/T]."""
        return self._columns["turning"]

    @property
    def shaking(self) -> Array:
        """(*shape, 3) amplitude [L], rate [rad/T] and phase [rad] of the support."""
        return self._columns["shaking"]

    @property
    def friction(self) -> Array:
        """(*shape,) dry friction about the apex [M L^2 T^-2]."""
        return self._columns["friction"]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, EnsembleBase):
            return NotImplemented
        return super().__eq__(other) and bool(self._bodies == other._bodies)

    __hash__ = None

    def __getstate__(self) -> dict[str, Any]:
        return {**super().__getstate__(), "body": self._bodies}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__["_bodies"] = state["body"]
        super().__setstate__(state)


def _count_value_dimensions(name: str) -> int:
    """Return the number of dimensions of one value of the parameter `name`: 0 or 1."""
    return int(name not in ("gravity", "friction"))


def validate_body_type(body: object) -> Body | Bodies:
    """Return `body` if it is a Body or Bodies; raise TypeError otherwise."""
    if isinstance(body, Body | Bodies):
        return body
    raise TypeError(f"body must be a kreisel.Body or kreisel.Bodies, not {short_repr(body)}")


def compute_common_top_shape(body: Body | Bodies, parameters: Sequence[BatchParameter]) -> Shape:
    """Return the shape to which the bodies and parameters broadcast.

    Raises ValueError if the shapes do not broadcast.
    """
    body_shape = body.shape if isinstance(body, Bodies) else ()
    shapes = [each.values.shape[: each.values.ndim - len(each.value)] for each in parameters]
    try:
        return np.broadcast_shapes(body_shape, *shapes)
    except ValueError:
        return broadcast_named_shapes(
            ["body", *[each.name for each in parameters]], [body_shape, *shapes]
        )


def make_invalid_member_error(
    body: Body | Bodies,
    parameters: Sequence[BatchParameter],
    one: Callable[..., object],
    shape: Shape,
    index: Index,
    text: str = "not a top",
) -> Exception:
    """Return the exception that the constructor `one` of a single top raises for an invalid top.

    If no exception is raised, a ValueError with the message `text` is returned.
    """
    words = {
        each.name: convert_to_python_numbers(each.broadcast_to(shape)[index]) for each in parameters
    }
    member_body = (
        body._broadcast_to(shape)._select_member(index) if isinstance(body, Bodies) else body
    )
    place = f"top{list(index)}: " if index else ""
    try:
        one(member_body, **words)
    except (TypeError, ValueError) as error:
        return type(error)(f"{place}{error}")
    return ValueError(f"{place}{text}")


def select_momentum_parameter(arguments: Mapping[str, ArrayLike | None]) -> BatchParameter:
    """Return the one given parameter that determines the initial angular momentum.

    Raises ValueError unless exactly one of momentum, velocity, body_momentum and body_velocity is
    given.
    """
    names = [name for name, value in arguments.items() if value is not None]
    if len(names) != 1:
        raise ValueError(
            f"give exactly one of {', '.join(ONE_OF)}, not " + (" and ".join(names) or "none")
        )
    return validate_parameter(names[0], arguments[names[0]], (3,))


def validate_attitudes(attitude: Any, xyzw: Any) -> tuple[BatchParameter, Array]:
    """Validate the argument `attitude` or `attitude_xyzw`, and return the quaternions (w, x, y, z).

    Raises ValueError if both `attitude` and `attitude_xyzw` are given, or if a quaternion is not of
    unit length.
    """
    if attitude is not None and xyzw is not None:
        raise ValueError("give either attitude or attitude_xyzw, not both")
    if xyzw is None and hasattr(attitude, "as_quat"):
        last = np.asarray(attitude.as_quat())
        attitude = np.roll(last, 1, axis=-1)
    name, value = ("attitude", attitude) if xyzw is None else ("attitude_xyzw", xyzw)
    if value is None:
        return BatchParameter(name, _UPRIGHT, (4,)), _UPRIGHT
    parameter = validate_parameter(name, value, (4,))
    q = parameter.values
    deviation = np.abs(q[..., 0] ** 2 + q[..., 1] ** 2 + q[..., 2] ** 2 + q[..., 3] ** 2 - 1.0)
    bad = deviation > INPUT_RTOL
    dtype = q.dtype if value is parameter else np.asarray(value).dtype
    if np.any(bad) and dtype.kind == "f" and dtype.itemsize < 8:
        norm = np.sqrt((q * q).sum(axis=-1))
        single = bad & (np.abs(norm - 1.0) <= 4.0 * np.finfo(dtype).eps)
        parameter = parameter._replace(values=np.where(single[..., None], q / norm[..., None], q))
        bad &= ~single
    parameter.raise_error_of_first_bad_value(
        bad, lambda _, one: unit(name, one, last=xyzw is not None)
    )
    return parameter, parameter.values if xyzw is None else np.roll(parameter.values, 1, axis=-1)


def compute_start_momenta(
    body: Body | Bodies, start: BatchParameter, q: Array, turning: Array
) -> Array:
    """Compute angular momenta in the space frame from velocities or momenta.

    The quaternions `q` are the attitudes, and `turning` contains the angular velocities of the
    supports.
    """
    if start.name == "momentum":
        return start.values
    moments, axes = np.asarray(body.moments), np.asarray(body.axes)
    arrays = [moments, axes, q, start.radians]
    if np.any(body.rotor) or np.any(turning):
        for vectors in (np.asarray(body.principal_rotor), turning):
            arrays.append(np.where(vectors == 0.0, -0.0, vectors))
    shape = np.broadcast_shapes(*[values.shape[:-1] for values in arrays])

    def compute_momentum_components(*components: Any) -> tuple[Array, ...]:
        return compute_angular_momentum(start.name, *components)

    return compute_vectors_in_blocks(compute_momentum_components, shape, 3, *arrays)


Components = tuple[Array, Array, Array]


class EnsembleConstructors(EnsembleBase[S]):
    """Constructors of kr.Ensemble from Euler angles and rates."""

    @classmethod
    def from_euler(
        cls,
        body: Body | Bodies,
        angles: ArrayLike,
        rates: ArrayLike = (0.0, 0.0, 0.0),
        *,
        degrees: bool = False,
        gravity: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        turning: ArrayLike | None = None,
        shaking: ArrayLike | None = None,
        friction: ArrayLike | None = None,
    ) -> Self:
        """Build an array of tops from z-x-z Euler angles and their rates (see Scene.from_euler).

        `angles` [rad] and `rates` [rad/T] have the shape (..., 3): precession, nutation and spin.
        `degrees` applies to all tops. The arguments from `gravity` to `friction` have the same
        meaning as in the constructor of Ensemble.

        >>> import kreisel as kr
        >>> body = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> kr.Ensemble.from_euler(body, [(0, 1, 0), (0, 2, 0)], rates=(0, 0, 5), gravity=1).shape
        (2,)
        """
        bodies, in_degrees = validate_body_type(body), as_bool("degrees", degrees)
        parameters = [
            validate_parameter("angles", angles, (3,), degrees=in_degrees),
            validate_parameter("rates", rates, (3,), degrees=in_degrees),
        ]
        angle_components, rate_components = (
            split_vector_components(each.radians) for each in parameters
        )
        environment = EnvironmentArguments(gravity, damping, turning, shaking, friction)
        return cls._build_from_euler_angles(
            bodies,
            parameters,
            angle_components,
            rate_components,
            environment.mark_as_degrees() if in_degrees else environment,
            partial(cls._one.from_euler, degrees=in_degrees),
        )

    @classmethod
    def _build_from_euler_angles(
        cls,
        body: Body | Bodies,
        parameters: list[BatchParameter],
        angles: Components,
        rates: Components,
        environment: EnvironmentArguments,
        one: Callable[..., S],
    ) -> Self:
        """Build tops whose Euler angles and rates have already been computed.

        Raises the same exception as the constructor `one` would for the first invalid member.
        """
        environment_parameters, columns = validate_ensemble_environment(environment, body)
        compute_common_top_shape(body, [*parameters, *environment_parameters])
        attitudes, frame_attitudes = (
            stack_components(*quaternion_from_euler(angles)),
            cls._compute_euler_frame_attitudes(body),
        )
        shape = np.broadcast_shapes(attitudes.shape[:-1], frame_attitudes.shape[:-1])
        q = compute_vectors_in_blocks(
            lambda a, b: multiply(a, conjugate(b)), shape, 4, attitudes, frame_attitudes
        )
        with np.errstate(all="ignore"):
            start = BatchParameter(
                "velocity", stack_components(*velocity_from_euler(angles, rates)), (3,)
            )
        columns["momentum"] = compute_start_momenta(body, start, q, columns["turning"])
        columns["attitude"] = q
        return cls.__new__(cls)._store_ensemble_columns(
            body, [*parameters, *environment_parameters], columns, one
        )

    @classmethod
    def _compute_euler_frame_attitudes(cls, body: Body | Bodies) -> Array:
        """Return the quaternions for the Euler angles of bodies aligned with the space frame."""
        names = "precession_angle", "nutation", "spin_angle"
        if isinstance(body, Body):
            one = cls._one(body, momentum=(0.0, 0.0, 0.0), gravity=0.0)
            angles = [values(name, one._block, one._start_state)[0] for name in names]
        else:
            ensemble = cls(body, momentum=(0.0, 0.0, 0.0), gravity=0.0)
            angles = [ensemble._core_scenes.values(name).reshape(ensemble.shape) for name in names]
        return stack_components(*quaternion_from_euler((angles[0], angles[1], angles[2])))

    @classmethod
    def spinning(
        cls,
        body: Body | Bodies,
        spin: ArrayLike,
        tilt: ArrayLike = 0.0,
        precession: ArrayLike | None = None,
        *,
        steady: bool = False,
        fast: bool = False,
        degrees: bool = False,
        gravity: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        turning: ArrayLike | None = None,
        shaking: ArrayLike | None = None,
        friction: ArrayLike | None = None,
    ) -> Self:
        """Build an array of symmetric tops that spin about their axes (see Scene.spinning).

        `spin`, `tilt` and `precession` are numbers or arrays. The arguments `gravity` to `friction`
        have the same meaning as in Ensemble. `steady`, `fast` and `degrees` apply to all tops.

        >>> import kreisel as kr
        >>> body = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> tops = kr.Ensemble.spinning(body, spin=[[20], [40]], tilt=[0.1, 0.2], gravity=1)
        >>> tops.shape, tops.axes
        ((2, 2), ('spin', 'tilt'))
        """
        bodies, in_degrees = validate_body_type(body), as_bool("degrees", degrees)
        one: Any = partial(cls._one.spinning, degrees=in_degrees)
        parameters = [
            validate_parameter("spin", spin, degrees=in_degrees),
            validate_tilts(tilt, in_degrees),
        ]
        rate, angle = (each.radians for each in parameters)
        find_symmetry_moments_of_bodies(bodies)
        environment = EnvironmentArguments(gravity, damping, turning, shaking, friction)
        environment = environment.mark_as_degrees() if in_degrees else environment
        if is_steady_precession_requested(steady, fast, precession, environment):
            one = partial(one, steady=True, fast=fast)
            precession_rate = compute_steady_precession_rates(
                bodies, [*parameters, validate_gravities(gravity, bodies)], fast, one
            )
        else:
            initial = 0.0 if precession is None else precession
            parameters.append(validate_parameter("precession", initial, degrees=in_degrees))
            precession_rate = parameters[-1].radians
        compute_common_top_shape(bodies, parameters)
        nothing = np.zeros(())
        with np.errstate(all="ignore"):
            rates = precession_rate, nothing, rate - precession_rate * cos(angle)
        return cls._build_from_euler_angles(
            bodies, parameters, (nothing, angle, nothing), rates, environment, one
        )


def split_vector_components(vector: Array) -> Components:
    """Split vectors into their three components."""
    x, y, z = split_components(vector)
    return x, y, z


def validate_tilts(tilts: ArrayLike, degrees: bool) -> BatchParameter:
    """Validate the parameter `tilt`; raise ValueError for angles outside [0, pi]."""
    parameter = validate_parameter("tilt", tilts, degrees=degrees)
    angle = parameter.radians
    bad = ~((angle >= 0.0) & (angle <= math.pi))
    if bad.any():
        parameter.raise_error_of_first_bad_value(
            bad, lambda _, one: validate_tilt_angle(one, parameter.degrees)
        )
    return parameter


def find_symmetry_moments_of_bodies(body: Body | Bodies) -> tuple[Array, Array]:
    """Return the transverse and axial moments of inertia of symmetric bodies.

    Raises ValueError with the index of the first body that is not symmetric about its apex.
    """
    i1, i3, is_symmetric = find_symmetry_moments(
        np.asarray(body.moments), np.asarray(body.principal_com)
    )
    if not is_symmetric.all():
        index = tuple(map(int, np.unravel_index(int(is_symmetric.argmin()), is_symmetric.shape)))
        try:
            find_symmetry_moments_of_body(body if isinstance(body, Body) else body[index])
        except ValueError as error:
            raise ValueError(f"body{list(index)}: {error}" if index else str(error)) from None
    return i1, i3


def compute_steady_precession_rates(
    body: Body | Bodies,
    parameters: Sequence[BatchParameter],
    fast: bool,
    one: Callable[..., object],
) -> Array:
    """Compute the rates of steady precession of several tops.

    Raises ValueError with the index of the first member for which no steady precession exists.
    """
    refuse_rotor_in_steady_precession(body)
    shape = compute_common_top_shape(body, parameters)
    rate, angle, gravity = (each.radians for each in parameters)
    i1, i3 = find_symmetry_moments_of_bodies(body)
    x, y, z = split_components(np.asarray(body.com))
    with np.errstate(all="ignore"):
        lever = np.hypot(np.hypot(x, y), z) if isinstance(body, Bodies) else math.hypot(x, y, z)
        torque = np.asarray(body.mass) * gravity * lever
    rates, exists = solve_steady_precession(i1, i3, torque, rate, angle, fast)
    exists = np.broadcast_to(exists, shape)
    if not exists.all():
        index = tuple(map(int, np.unravel_index(int(exists.argmin()), shape)))
        raise make_invalid_member_error(body, parameters, one, shape, index)
    return rates
