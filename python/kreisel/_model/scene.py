"""Scenes: a body, its environment and its start, for one top or for many."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import chain
from typing import TYPE_CHECKING, Any, Self, TypedDict, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike

from .._core import Tops as CoreTops
from .._core import cosine, euler, scene, scene_horizon, sine, spinning
from .._utils import arguments
from .._utils.arguments import Array, NoKeywords, validate_type
from .._utils.files import atomic_write
from ..quaternion import multiply
from . import initial, parameters, toml
from .batch import BatchBase, broadcast_shapes, stack_components, store_columns
from .body import Body
from .parameters import (
    BODIES,
    BODY,
    ENVIRONMENT,
    FLAGS,
    PARAMETERS,
    SCENE,
    SCENES,
    STARTS,
    WHEEL,
    BatchParameter,
    Column,
    Scalars,
    Shape,
    has_nonzero_element,
)

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_NUMBERS = "momentum", "attitude", *ENVIRONMENT
_BODY = "mass", "inertia", "com", "rotor"
_PLAIN, _EULER, _SPINNING, _INTEGRALS = (
    [word for word in chain(*words) if word not in (*FLAGS, "lower", *ENVIRONMENT)]
    for words in (SCENE, *SCENES.values())
)
_STARTS = *_PLAIN, *_SPINNING, *_EULER, *_INTEGRALS
VARIED = ("body", *_BODY, *_STARTS, *FLAGS, "lower", *ENVIRONMENT)


class SceneKwargs(TypedDict, total=False):
    """Keyword arguments of Scene.replace, which are those of the constructor of Scene."""

    body: Body
    momentum: ArrayLike
    velocity: ArrayLike
    body_momentum: ArrayLike
    body_velocity: ArrayLike
    attitude: ArrayLike | Rotation
    attitude_xyzw: ArrayLike
    gravity: Scalars | None
    damping: ArrayLike | None
    turning: ArrayLike | None
    shaking: ArrayLike | None
    friction: Scalars | None
    gradient: Scalars | None


class VaryKwargs(SceneKwargs, total=False):
    """Keyword arguments of Scene.vary."""

    mass: ArrayLike
    inertia: ArrayLike
    com: ArrayLike
    rotor: ArrayLike
    spin: ArrayLike
    tilt: ArrayLike
    precession: ArrayLike
    angles: ArrayLike
    rates: ArrayLike
    energy: ArrayLike
    vertical: ArrayLike
    axial: ArrayLike
    lower: bool
    steady: bool
    fast: bool
    degrees: bool


@store_columns
@arguments.make_frozen_class_decorator("scene.replace({}=...) returns a new scene")
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Scene(BatchBase):
    """A rigid body in its environment and its state at t = 0, for one top or for many.

    Each parameter may be an array of values, which gives many tops. All parameters broadcast to the
    shape `scene.shape`, such as (n,) or (500, 500); it is () for one top.

    body      a kr.Body, of one body for all tops or of many
    momentum  (..., 3) angular momentum about the fixed point, in space [M L^2 T^-1]. Alternatively,
              exactly one of: velocity (angular velocity in space [rad/T]), or body_momentum,
              body_velocity (components in the frame in which the body is described)
    attitude  (..., 4) unit quaternion (w, x, y, z), scalar first, from the frame of the body into
              space, or a scipy Rotation. Alternatively, attitude_xyzw, scalar last
    gravity   (...,) acceleration along -e3, of either sign [L T^-2]; required unless the centre of
              mass is exactly at the fixed point
    damping   linear drag [M L^2 T^-1], one number for all tops, or (..., 3) numbers for the
              principal axes, or (..., 1) if the three axes of a top have the same damping: the
              torque about an axis is -damping times the angular velocity about it. kr.fit
              estimates one number or three, as given
    turning   (..., 3) constant angular velocity of the support, as of a turntable, along e1, e2, e3
              [rad/T]. The axes e1, e2, e3 turn with the support, and attitudes and velocities are
              relative to it. Momenta are those in the inertial frame, with components along these
              axes
    shaking   (..., 3) (amplitude [L], rate [rad/T], phase [rad]): the fixed point moves along e3 by
              amplitude * cos(rate * t + phase), and t = 0 is the start of the scene
    friction  (...,) dry friction [M L^2 T^-2]: a torque of this size about the apex, against the
              spin
    gradient  (...,) gravity gradient k [T^-2], which adds the torque k e3 x J e3, with the inertia
              J about the fixed point. For a satellite that is fixed at its centre of mass at the
              distance R from that of the Earth, it is 3 mu / R^3, and e3 is the local vertical. On
              a circular orbit with the mean motion n, k = 3 n^2, and turning=(0, n, 0) turns e3
              with the satellite, which moves along e1. The gradient excludes a shaken support and
              wheels on free axles

    A scene always stores momentum and attitude, whichever parameters were passed to the
    constructor. For a needle-like body, rounding the momentum changes the axial angular velocity by
    a relative amount of about I1 / I3 times the unit roundoff.

    For one top, the attributes are numbers and tuples. For many, they are arrays of the shapes
    (*shape, 3), (*shape, 4) or (*shape,), and `scene.body` is one body for all tops or an array of
    bodies of this shape. `scene[i, j]` is then the scene of one top, bitwise equal to that with the
    same parameters; slices, index arrays and masks return scenes of several. A single value that is
    given for all tops is stored only once. Two scenes are equal if all their parameters are equal.

    Raises TypeError for arguments that are not numbers. Raises ValueError for values that are not
    finite or have the wrong shape, and for attitudes that are not unit quaternions. For many tops,
    the message has the index of the first invalid value. The squared norm of a quaternion may
    differ from 1 by at most 1e-12. A single-precision quaternion is normalized in double precision.

    >>> import kreisel as kr
    >>> body = kr.scenes.thesis.body
    >>> tops = kr.Scene(body, momentum=[(0, 0, 1), (0, 0, 2)], gravity=[[1], [2], [3]])
    >>> tops.shape, tops[2, 0].gravity, tops[:, 1].momentum.shape
    ((3, 2), 3.0, (3, 3))
    """

    body: Body
    momentum: Any
    attitude: Any
    gravity: Any
    damping: Any
    turning: Any
    shaking: Any
    friction: Any
    gradient: Any
    # bytes of the kr_scene of one top
    _block: bytes = field(init=False)

    _compared = _compared_of_many = "body", *_NUMBERS
    _stored = _NUMBERS
    _has_common_damping = False  # True if the damping of one top was given as one number

    @arguments.has_unknown_keywords("Scene")
    def __init__(
        self,
        body: Body,
        momentum: ArrayLike | None = None,
        attitude: ArrayLike | Rotation | None = None,
        gravity: Scalars | None = None,
        *,
        velocity: ArrayLike | None = None,
        body_momentum: ArrayLike | None = None,
        body_velocity: ArrayLike | None = None,
        attitude_xyzw: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        turning: ArrayLike | None = None,
        shaking: ArrayLike | None = None,
        friction: Scalars | None = None,
        gradient: Scalars | None = None,
        **unknown: Unpack[NoKeywords],
    ) -> None:
        if unknown:
            arguments.refuse_unknown_keywords(Scene.__init__, unknown)
        if not isinstance(body, Body):
            validate_type("body", body, Body)
        values = momentum, velocity, body_momentum, body_velocity
        around = gravity, damping, turning, shaking, friction, gradient
        if attitude_xyzw is None and "_block" in body.__dict__ and not body._has_wheels:
            numbers = scene(body._block, values, attitude, around)
            if numbers is not None:
                self._store_numbers(body, numbers, damping)
                return
        starts = {n: x for n, x in zip(STARTS, values, strict=True) if x is not None}
        if len(starts) != 1:
            raise ValueError(
                f"give exactly one of {', '.join(STARTS)}, not {' and '.join(starts) or 'none'}"
            )
        ((name, value),) = starts.items()
        start = parameters.read_parameter(name, value)
        attitudes, q = initial.read_attitudes(attitude, attitude_xyzw)
        given = parameters.read_environment(body, around)
        words = [start, attitudes, *given.values()]
        broadcast_shapes(words, body=body.shape)
        momenta = start.values
        if name != "momentum":
            momenta = initial.compute_momenta(name, body, q, given, start.radians)
        self._store_starts(body, words, momenta, q, given)

    def _store_numbers(self, body: Body, numbers: tuple[Any, ...], damping: object) -> Self:
        """Store the numbers of one top, as scene() of the core returns them."""
        fields = self.__dict__
        fields["body"] = body
        m, q, g, d, u, s, f, k, block = numbers
        fields["gradient"] = k
        fields["momentum"], fields["attitude"], fields["gravity"], fields["damping"] = m, q, g, d
        fields["turning"], fields["shaking"], fields["friction"], fields["_block"] = u, s, f, block
        fields["_has_common_damping"] = damping is None or np.ndim(damping) == 0 or not any(d)  # type: ignore[arg-type]
        return self

    def _store_starts(
        self,
        body: Body,
        words: list[BatchParameter],
        momenta: Array,
        q: Array,
        given: Mapping[str, BatchParameter],
    ) -> Self:
        """Store tops of any shape. `words` are the parameters that the user gave."""
        body = initial.start_wheels(body, momenta, q) if body._has_wheels else body
        columns: dict[str, tuple[Column, int]] = {"momentum": (momenta, 1), "attitude": (q, 1)}
        for name in ENVIRONMENT:
            width = len(PARAMETERS[name].shapes[0])
            values = given[name].radians if name in given else np.zeros((3,) * width)
            if name == "damping":
                values = np.broadcast_to(values, (*values.shape[:-1], 3))
            columns[name] = values, width
        leads = [values.shape[: values.ndim - width] for values, width in columns.values()]
        words = [*body._list_varying_parameters(), *words]
        shape = np.broadcast_shapes(body.shape, *leads, *[one.shape for one in words])
        self._store(shape, columns, words)
        self.__dict__["body"] = body._broadcast_to(shape) if body.shape else body
        status, index = self._core_scenes.check()
        if status != "OK":
            place = tuple(map(int, np.unravel_index(index, shape)))
            numbers = [parameters.get_member(getattr(self, name), place) for name in _NUMBERS[:3]]
            text = "momentum {}, attitude {}, gravity {!r}".format(*numbers)
            error = arguments.make_exception_from_status(status, text)
            raise type(error)(f"top{list(place)}: {error}" if place else str(error))
        if not shape:
            numbers = [parameters.get_member(getattr(self, name), ()) for name in _NUMBERS]
            block = self._core_scenes.block(0)
            is_common = "damping" not in given or given["damping"].value == (1,)
            self.__dict__.clear()
            self._store_numbers(body, (*numbers, block), None if is_common else numbers[3])
        return self

    @classmethod
    def from_euler(
        cls,
        body: Body,
        angles: ArrayLike,
        rates: ArrayLike = (0.0, 0.0, 0.0),
        *,
        degrees: bool = False,
        gravity: Scalars | None = None,
        damping: ArrayLike | None = None,
        turning: ArrayLike | None = None,
        shaking: ArrayLike | None = None,
        friction: Scalars | None = None,
        gradient: Scalars | None = None,
    ) -> Self:
        """Build a scene from z-x-z Euler angles (precession, nutation, spin) and their rates.

        The angles are path.precession_angle, .nutation and .spin_angle at t = 0 [rad], and the
        rates are their time derivatives [rad/T]. Precession, nutation and spin are rotations about
        e3, the line of nodes and the apex (the direction of the centre of mass), respectively. If
        the apex is the third axis of the frame of description, the attitude is

            Rz(precession) Rx(nutation) Rz(spin).

        If the apex is not the third axis, the angles describe a body-fixed frame whose third axis
        is the apex.

        degrees  True: angles and rates are in degrees, also turning and the rate and phase of
                 shaking; the arguments gravity to gradient are otherwise as in Scene

        Angles and rates may be arrays of the shape (..., 3), and the other arguments arrays as in
        Scene.

        >>> import kreisel as kr
        >>> top = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> scene = kr.Scene.from_euler(top, (30, 60, 0), (0, 0, 720), degrees=True, gravity=1)
        >>> round(float(kr.solve(scene, [0.0]).nutation[0]), 12)
        1.047197551197
        """
        in_degrees = arguments.as_bool("degrees", degrees)
        around = gravity, damping, turning, shaking, friction, gradient
        if not (validate_type("body", body, Body).shape or body._has_wheels):
            numbers = euler(body._block, angles, rates, in_degrees, around)
            if numbers is not None:
                return cls.__new__(cls)._store_numbers(body, numbers, damping)
        given = parameters.read_environment(body, around, in_degrees)
        words = [
            parameters.read_parameter("angles", angles, degrees=in_degrees),
            parameters.read_parameter("rates", rates, degrees=in_degrees),
        ]
        return cls._build_from_euler(body, words, words[0].radians, words[1].radians, given)

    @classmethod
    def spinning(
        cls,
        body: Body,
        spin: ArrayLike | None = None,
        tilt: ArrayLike = 0.0,
        precession: ArrayLike | None = None,
        *,
        steady: bool = False,
        fast: bool = False,
        degrees: bool = False,
        gravity: Scalars | None = None,
        damping: ArrayLike | None = None,
        turning: ArrayLike | None = None,
        shaking: ArrayLike | None = None,
        friction: Scalars | None = None,
        gradient: Scalars | None = None,
    ) -> Self:
        """Build a symmetric top that spins about its symmetry axis, tilted from the vertical.

        spin        component of the angular velocity along the axis, from the fixed point towards
                    the centre of mass, as path.spin [rad/T]. Without damping, friction and turning,
                    the spin is constant
        tilt        angle between the axis and the vertical, 0 .. pi; the axis is tilted about e1
        precession  initial rate of the axis about the vertical [rad/T]. The default is 0: the axis
                    is released from rest
        steady      True: the top precesses without nutation, slowly or, with fast=True, fast. At
                    tilt 0 or pi it stands or hangs vertically, without precession. If `precession`
                    is given instead of `spin`, the top has the spin with this steady precession
        degrees     True: angles and rates are in degrees, also turning and the rate and phase of
                    shaking; the arguments gravity to gradient are otherwise as in Scene

        Raises ValueError for a body that is not symmetric about its apex, and for steady=True with
        both `spin` and `precession`, a rotor, damping, friction or a moving support. Also raises
        ValueError if no steady precession exists. If the spin is too small, the message states the
        least possible spin.

        All arguments but the flags may be arrays, as in Scene. Messages give the index of the first
        top that is refused.

        >>> import kreisel as kr
        >>> top = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> scene = kr.Scene.spinning(top, spin=50, tilt=1.0, steady=True, gravity=1)
        >>> path = kr.solve(scene, 10)
        >>> bool(abs(path.nutation - 1.0).max() < 1e-12)
        True
        >>> scene = kr.Scene.spinning(top, tilt=1.0, precession=0.5, steady=True, gravity=1)
        >>> round(float(kr.solve(scene, [0.0]).spin[0]), 9)
        12.2962848
        >>> tops = kr.Scene.spinning(top, spin=[[20], [40]], tilt=[0.1, 0.2], gravity=1)
        >>> tops.shape, tops.axes
        ((2, 2), ('spin', 'tilt'))
        """
        in_degrees = arguments.as_bool("degrees", degrees)
        is_steady, is_fast = arguments.as_bool("steady", steady), arguments.as_bool("fast", fast)
        around = gravity, damping, turning, shaking, friction, gradient
        if not (validate_type("body", body, Body).shape or body._has_wheels):
            flags = is_steady, is_fast, in_degrees
            numbers = spinning(body._block, spin, tilt, precession, *flags, around)
            if numbers is not None:
                return cls.__new__(cls)._store_numbers(body, numbers, damping)
        if spin is None and not (is_steady and precession is not None):
            raise TypeError("spin is missing; only steady=True with precession determines it")
        rates = {
            name: parameters.read_parameter(name, value, degrees=in_degrees)
            for name, value in {"spin": spin, "precession": precession}.items()
            if value is not None
        }
        tilts = initial.read_tilts(tilt, in_degrees)
        initial.compute_symmetric_moments(body)
        given = parameters.read_environment(body, around, in_degrees)
        first, second = rates.get("spin"), rates.get("precession")
        if initial.is_steady_precession_requested(steady, fast, spin, precession, given):
            gravities = given["gravity"]
            spins, rate = initial.compute_steady_motion(
                body, first, tilts, second, gravities, is_fast
            )
        else:
            spins, rate = rates["spin"].radians, second.radians if second else np.zeros(())
        words = [one for one in (first, tilts, second) if one]
        return cls._build_spinning(body, words, (0.0, tilts.radians, 0.0), spins, rate, given)

    @classmethod
    def from_integrals(
        cls,
        body: Body,
        energy: ArrayLike,
        vertical: ArrayLike,
        axial: ArrayLike,
        *,
        lower: bool = False,
        gravity: Scalars | None = None,
        damping: ArrayLike | None = None,
        friction: Scalars | None = None,
    ) -> Self:
        """Build a symmetric top from its integrals of motion, released at a turning point.

        The integrals determine the motion up to the time, the heading and the angle of the spin.
        The axis is tilted about e1.

        energy    kinetic plus potential energy, as path.energy [M L^2 T^-2]
        vertical  vertical momentum <m, e3>, as path.vertical_momentum [M L^2 T^-1]
        axial     axial momentum <m, apex>, as path.axial_momentum [M L^2 T^-1]
        lower     True: start at the lowest point of the axis instead of the highest one

        An axis that passes through the vertical starts there. The body may have a rotor along its
        axis. The other arguments are those of Scene; all but `lower` may be arrays.

        Raises ValueError for a body that is not symmetric about its apex, and for an energy that is
        too small for the momenta.

        >>> import kreisel as kr
        >>> top = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> scene = kr.Scene.from_integrals(top, energy=12, vertical=1.5, axial=2, gravity=1)
        >>> path = kr.solve(scene, [0.0])
        >>> [round(float(x[0]), 12) for x in (path.energy, path.vertical_momentum)]
        [12.0, 1.5]
        """
        is_lower = arguments.as_bool("lower", lower)
        validate_type("body", body, Body)
        given = parameters.read_environment(body, (gravity, damping, None, None, friction, None))
        integrals = zip(_INTEGRALS, (energy, vertical, axial), strict=True)
        words = [parameters.read_parameter(name, value) for name, value in integrals]
        known = {**given, **{one.name: one for one in words}}
        return cls._build_from_integrals(body, [*words, *given.values()], known, given, is_lower)

    @classmethod
    def _build_from_integrals(
        cls,
        body: Body,
        words: list[BatchParameter],
        known: Mapping[str, BatchParameter],
        given: Mapping[str, BatchParameter],
        lower: bool,
    ) -> Self:
        """Build tops at turning points, from all integrals and the environment."""
        broadcast_shapes([*known.values()], body=body.shape)
        tilt, velocity = initial.find_turning_point(body, known, lower)
        angles = stack_components(np.zeros_like(tilt), tilt, np.zeros_like(tilt))
        rows = initial.call_core(
            CoreTops.euler, body, initial.UPRIGHT, given, angles, np.zeros_like(angles)
        )
        q = rows[..., :4]
        momenta = initial.compute_momenta("velocity", body, q, given, velocity)
        return cls.__new__(cls)._store_starts(body, words, momenta, q, given)

    @classmethod
    def _build_from_euler(
        cls,
        body: Body,
        words: list[BatchParameter],
        angles: Array,
        rates: Array,
        given: Mapping[str, BatchParameter],
    ) -> Self:
        """Build tops from Euler angles [rad] and their rates, and the parameters of the user."""
        words = [*words, *given.values()]
        broadcast_shapes(words, body=body.shape)
        rows = initial.call_core(CoreTops.euler, body, initial.UPRIGHT, given, angles, rates)
        return cls.__new__(cls)._store_starts(body, words, rows[..., 4:], rows[..., :4], given)

    @classmethod
    def _build_spinning(
        cls,
        body: Body,
        words: list[BatchParameter],
        angles: tuple[Any, Any, Any],
        spin: Any,
        precession: Any,
        given: Mapping[str, BatchParameter],
        nutation: Any = 0.0,
    ) -> Self:
        """Build tops from Euler angles [rad], the spin about the apex and two rates."""
        broadcast_shapes(words, body=body.shape)
        with np.errstate(all="ignore"):
            rates = precession, nutation, spin - precession * cosine(np.asarray(angles[1]))
        at, turning = (stack_components(*map(np.asarray, three)) for three in (angles, rates))
        return cls._build_from_euler(body, words, at, turning, given)

    @classmethod
    def stack(cls, scenes: Sequence[Any]) -> Scenes:
        """Join a list of scenes of one shape; each level of nested lists adds a dimension in front.

        >>> import kreisel as kr
        >>> kr.Scene.stack([[kr.scenes.thesis], [kr.scenes.cusps]]).shape
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
                "a list of scenes must not be empty; a scene of no tops needs a body, as in "
                "kr.Scene(body, momentum=numpy.empty((0, 3)))"
            )
        for k, one in enumerate(members):
            index = "".join(f"[{i}]" for i in np.unravel_index(k, shape)) if shape else ""
            if validate_type(f"scenes{index}", one, cls).shape != members[0].shape:
                raise ValueError(
                    f"scenes must have the same shape, not {members[0].shape} and {one.shape}"
                )
        shape = (*shape, *members[0].shape)
        tops = [top for one in members for top in one.ravel()] if members[0].shape else members
        rows = np.frombuffer(b"".join(top._block for top in tops)).reshape(*shape, -1)
        body = Body._combine_bodies([top.body for top in tops], shape)
        places: tuple[Any, ...] = 30, slice(39, 42), slice(42, 45), slice(45, 48), 48, 61
        around = {
            name: BatchParameter(name, rows[..., place], PARAMETERS[name].shapes[0])
            for name, place in zip(ENVIRONMENT, places, strict=True)
        }
        joined = cls.__new__(cls)._store_starts(
            body, [], rows[..., 36:39], rows[..., 32:36], around
        )
        return cast(Scenes, joined)

    def _with(
        self, shape: Shape, names: tuple[str | None, ...], change: Callable[[Column], Column]
    ) -> Self:
        tops, body = super()._with(shape, names, change), self.body
        tops.__dict__["body"] = body._with(shape, names, change) if body.shape else body
        return tops if shape else tops._select_member(())

    def _select_member(self, index: parameters.Index) -> Self:
        if "_block" in self.__dict__:
            return self
        body = self.body._select_member(index) if self.body.shape else self.body
        return type(self)(
            body, **{name: parameters.get_member(getattr(self, name), index) for name in _NUMBERS}
        )

    @cached_property
    def _core_scenes(self) -> CoreTops:
        """The tops as an array in the memory layout that the C library requires."""
        return initial.make_core_tops(self.body, self.shape, self._columns)

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of the dimensions.

        A dimension is named after the only parameter that varies along it, if this parameter is a
        scalar and varies along no other dimension. All other dimensions are named 'dim_k', where k
        is the index, or 'top' if there is only one dimension.
        """
        unnamed = "top" if len(self.shape) == 1 else "dim_{}"
        return tuple(name or unnamed.format(k) for k, name in enumerate(self._names))

    def __repr__(self) -> str:
        """Return the constructor call of one top as text, without a support at rest or friction."""
        if self.shape:
            return self._describe()
        words: dict[str, object] = dict(self._list_constructor_arguments())
        if self._optional_gravity is None:
            del words["gravity"]
        for name in ("turning", "shaking", "friction", "gradient"):
            if not has_nonzero_element(words[name]):
                del words[name]
        return f"Scene({', '.join([f'{name}={value!r}' for name, value in words.items()])})"

    def __getstate__(self) -> dict[str, Any]:
        return {name: x for name, x in self.__dict__.items() if name != "_core_scenes"}

    def _list_displayed_parameters(self) -> Mapping[str, Any]:
        words = {"momentum": self.momentum, "attitude": self.attitude}
        if self._optional_gravity is not None:
            words["gravity"] = self.gravity
        others = {name: getattr(self, name) for name in ENVIRONMENT[1:]}
        return words | {name: x for name, x in others.items() if has_nonzero_element(x)}

    def _list_parameter_rows(self) -> list[tuple[str, str, str]]:
        """Return the rows of the body and of the scene; both may name what varies."""
        rows = *self.body._list_parameter_rows(), *super()._list_parameter_rows()
        return [*{row[0]: row for row in rows}.values()]

    def _list_constructor_arguments(self) -> SceneKwargs:
        """Return constructor arguments that reproduce the scene."""
        is_one = self._has_common_damping and self._has_damping
        return {
            "body": self.body,
            "momentum": self.momentum,
            "attitude": self.attitude,
            "gravity": self._optional_gravity,
            "damping": self.damping[0] if is_one else self.damping,  # one number stays one
            "turning": self.turning,
            "shaking": self.shaking,
            "friction": self.friction,
            "gradient": self.gradient,
        }

    @property
    def _optional_gravity(self) -> Any:
        """The gravity, or None if tops without weight need not have been given any."""
        is_needed = has_nonzero_element(self.gravity) or has_nonzero_element(self.body.com)
        return self.gravity if is_needed else None

    @property
    def _has_damping(self) -> bool:
        return has_nonzero_element(self.damping)

    @property
    def _is_shaken(self) -> bool:
        return bool(self.shaking[0])

    @cached_property
    def _has_disturbances(self) -> bool:
        """True if the top has damping, friction, a gravity gradient, or a moving support."""
        is_moved = self._is_shaken or any(self.turning) or self.gradient != 0.0
        return self._is_losing_energy or is_moved

    @property
    def _is_losing_energy(self) -> bool:
        return any(self.damping) or self.friction > 0.0

    @cached_property
    def _rotation_rate(self) -> float:
        """Estimated rate of motion [T^-1], from momentum, torque and the motion of the support."""
        largest, momentum = max(self.body.moments), math.hypot(*self.momentum)
        amplitude, rate, _ = self.shaking
        weight = self.body.mass * (abs(self.gravity) + abs(amplitude) * rate * rate)
        torque = weight * math.hypot(*self.body.com)
        moving = momentum + math.hypot(*self.body.rotor)
        bound = max(moving / largest, math.sqrt(torque / largest))
        bound = max(bound, math.sqrt(abs(self.gradient)))
        return float(max(bound + math.hypot(*self.turning), rate if amplitude else 0.0))

    @cached_property
    def _resolvable_horizon(self) -> float:
        """The time [T] beyond which double precision cannot resolve the attitude."""
        return scene_horizon(self._block)

    @cached_property
    def _start_state(self) -> Array:
        """The state (t, q, m) at t = 0, as an array of shape (1, 8)."""
        return np.array([(0.0, *self.attitude, *self.momentum)])

    @property
    def attitude_xyzw(self) -> Any:
        """The attitude as a quaternion (x, y, z, w), scalar last, for one top or for many."""
        if self.shape:
            return np.roll(self.attitude, -1, axis=-1)
        w, x, y, z = self.attitude
        return x, y, z, w

    def replace(self, **changes: Unpack[SceneKwargs]) -> Self:
        """Return a copy of the scene with some constructor parameters changed.

        Arrays of values broadcast with the parameters of the scene, as in the constructor.
        """
        words: dict[str, object] = dict(self._list_constructor_arguments())
        if not changes.keys().isdisjoint(STARTS):
            del words["momentum"]
        if "attitude_xyzw" in changes:
            del words["attitude"]
        make: Callable[..., Self] = type(self)  # the constructor validates the parameters
        made = make(**{**words, **changes})
        return self._keep_varying_parameters(made, changes) if self.shape else made

    def _replace_one(self, **changes: Unpack[SceneKwargs]) -> Self:
        """Return a copy of the scene of one top; raise TypeError for arrays of values."""
        made = self.replace(**changes)
        if made.shape:
            name = next((one for one in changes if one in made._varied), "body")
            raise TypeError(f"{name} must be one value, not an array of them: this is one top")
        return made

    def _keep_varying_parameters(self, made: Self, changes: Mapping[str, object]) -> Self:
        """Return the scene that is made by changes, with the parameters that vary in it.

        What this scene was varied in still varies if only the environment was changed.
        """
        is_same_start = changes.keys() <= {*ENVIRONMENT, *FLAGS}
        kept = [
            one
            for one in self._list_varying_parameters()
            if one.name not in changes and (is_same_start or one.name in ENVIRONMENT)
        ]
        names = {*changes, *made.body._varied} - {one.name for one in kept}
        new = [one for one in made._list_varying_parameters() if one.name in names]
        return made._note_varying_parameters([*kept, *new])

    def vary(self, **words: Unpack[VaryKwargs]) -> Scenes:
        """Return scenes of the tops of this scene in which the given parameters vary.

        Parameters are broadcast as in kr.Scene, and with those of this scene. They may be the
        parameters of

        - Scene: gravity, damping, turning, shaking, friction, gradient, body, attitude
          or attitude_xyzw, and one of momentum, velocity, body_momentum, body_velocity. If none of
          these four is given, the space-frame momentum of this scene is kept.

        - Body: mass, inertia, com, rotor. Every top keeps the attitude and the space-frame momentum
          of this scene.

        - Scene.spinning: spin, tilt, precession, steady, fast. The body need not be symmetric
          unless steady=True. Omitted values are taken from the scene, as are the other Euler angles
          and rates; but steady=True sets the nutation rate to zero.

        - Scene.from_euler: angles, rates. An omitted argument is taken from the scene.

        - Scene.from_integrals: energy, vertical, axial, lower. An omitted integral is that of the
          scene.

        With degrees=True, all given angles and rates are in degrees, also turning and the rate and
        phase of shaking. If the only parameter that varies along a dimension is a scalar and varies
        along no other dimension, the dimension is named after it; see tops.axes and tops.coords.

        >>> import kreisel as kr, numpy as np
        >>> top = kr.scenes.sleeping
        >>> tops = top.vary(spin=np.linspace(0, 20, 5)[:, None], tilt=np.linspace(0, 1, 3))
        >>> tops.shape, tops.axes
        ((5, 3), ('spin', 'tilt'))
        """
        for name in words:
            if name not in VARIED:
                raise TypeError(arguments.unknown_name_message("parameter", name, VARIED))
        changes: dict[str, Any] = {n: value for n, value in words.items() if value is not None}
        made = self._vary(changes)
        return cast(Scenes, self._keep_varying_parameters(made, changes) if self.shape else made)

    def _vary(self, changes: dict[str, Any]) -> Self:
        kinds = [
            [n for n in names if n in changes] for names in (_PLAIN, _SPINNING, _EULER, _INTEGRALS)
        ]
        start_names = [names[0] for names in kinds if names]
        if len(start_names) > 1:
            raise ValueError(
                f"{start_names[0]} and {start_names[1]} both describe the start: give only one kind"
            )
        if arguments.as_bool("degrees", changes.get("degrees", False)):
            changes |= {
                name: parameters.read_parameter(name, value, degrees=True)
                for name, value in changes.items()
                if "rad" in parameters.get_parameter_unit(name, degrees=False)
            }
        in_degrees = any(getattr(value, "degrees", False) for value in changes.values())
        body = self._vary_body(changes)
        around = {name: changes.get(name) for name in ENVIRONMENT}
        for name, value in around.items():
            is_known = (
                self._optional_gravity is not None if name == "gravity" else name == "damping"
            )
            if value is None and (is_known or np.any(getattr(self, name))):
                around[name] = getattr(self, name)
        given = parameters.read_environment(body, tuple(around.values()))
        fast = changes.get("fast", False)
        is_steady = initial.is_steady_precession_requested(
            changes.get("steady", False),
            fast,
            changes.get("spin"),
            changes.get("precession"),
            given,
        )
        if is_steady and (kinds[0] or kinds[2] or kinds[3]):
            raise ValueError(f"steady=True requires spin and tilt instead of {start_names[0]}")
        lower = arguments.as_bool("lower", changes.get("lower", False))
        if lower and not kinds[3]:
            raise ValueError("lower is the end of a start by energy, vertical and axial: give one")
        if kinds[3]:
            quantities = "energy", "vertical_momentum", "axial_momentum"
            integrals = {
                name: parameters.read_parameter(name, changes[name])
                if name in changes
                else BatchParameter(name, self._core_scenes.values(key).reshape(self.shape), ())
                for name, key in zip(_INTEGRALS, quantities, strict=True)
            }
            words = [*(integrals[name] for name in kinds[3]), *given.values()]
            return self._build_from_integrals(body, words, {**given, **integrals}, given, lower)
        if not (kinds[1] or kinds[2] or is_steady):
            plain = {name: changes[name] for name in kinds[0]}
            if not plain.keys() & set(STARTS):
                plain["momentum"] = self.momentum
            if not plain.keys() & {"attitude", "attitude_xyzw"}:
                plain["attitude"] = self.attitude
            return type(self)(body, **{**given, **plain})
        state = initial.compute_euler_state(self._core_scenes, self.shape)
        precession, tilt, spin_angle = state.angles
        varied = {
            name: initial.read_tilts(changes[name], in_degrees)
            if name == "tilt"
            else parameters.read_parameter(name, changes[name])
            for name in (*_SPINNING, *_EULER)
            if name in changes
        }
        rate = state.spin - state.precession * cosine(tilt)
        own = {"spin": state.spin, "tilt": tilt, "precession": state.precession}
        own["angles"] = stack_components(*state.angles)
        own["rates"] = stack_components(state.precession, state.nutation, np.asarray(rate))
        known = {
            name: varied.get(name, BatchParameter(name, value, PARAMETERS[name].shapes[0]))
            for name, value in own.items()
        }
        words = list(varied.values())
        radians = {name: one.radians for name, one in known.items()}
        broadcast_shapes(words, body=body.shape, scene=self.shape)
        if kinds[2]:
            return self._build_from_euler(body, words, radians["angles"], radians["rates"], given)
        if is_steady:
            if in_degrees and "spin" not in varied:
                degrees = np.degrees(state.spin)
                known["spin"] = BatchParameter("spin", degrees, (), degrees=True)
            is_wanted = "precession" in varied
            radians["spin"], radians["precession"] = initial.compute_steady_motion(
                body,
                None if is_wanted else known["spin"],
                known["tilt"],
                known["precession"],
                given["gravity"],
                fast,
            )
        angles = precession, radians["tilt"], spin_angle
        nutation = 0.0 if is_steady else state.nutation
        return self._build_spinning(
            body, words, angles, radians["spin"], radians["precession"], given, nutation
        )

    def _vary_body(self, changes: Mapping[str, Any]) -> Body:
        body_changes = {name: changes[name] for name in _BODY if name in changes}
        if "body" in changes:
            if body_changes:
                raise ValueError(f"give either body or {next(iter(body_changes))}, not both")
            return validate_type("body", changes["body"], Body)
        if not body_changes:
            return self.body
        others = "inertia_rtol", "unphysical", "wheels"
        kept = {name: getattr(self.body, name) for name in (*_BODY, *others)}
        if "rotor" in body_changes and self.body._has_wheels:
            raise ValueError(
                "the rotor includes the momentum of a wheel: vary body, with rates of with_wheel"
            )
        return Body(**{**kept, **body_changes})

    def scatter(
        self,
        n: int,
        *,
        seed: int = 0,
        momentum: ArrayLike | None = None,
        attitude: ArrayLike | None = None,
        gravity: float | None = None,
    ) -> Scenes:
        """Return `n` copies of this scene with normally distributed perturbations.

        The result has the shape (n, *shape), and each of its tops has its own perturbation.

        momentum  standard deviation of the momentum in space [M L^2 T^-1]: one number for all
                  components, or 3
        attitude  standard deviation of a rotation vector in the frame of the body [rad]: one number
                  for all components, or 3. The body is rotated by this vector before the attitude
                  of the scene is applied; the momentum in space stays the same
        gravity   standard deviation of gravity [L T^-2]

        Copy i depends only on `seed` and i, not on `n`. Changing the standard deviation of one
        parameter does not change the random perturbations of the others.

        >>> import kreisel as kr
        >>> tops = kr.scenes.thesis.scatter(1000, seed=7, attitude=0.01)
        >>> tops[3] == kr.scenes.thesis.scatter(10, seed=7, attitude=0.01)[3]
        True
        """
        return cast(Scenes, self._scatter(n, seed, momentum, attitude, gravity))

    def _scatter(
        self,
        n: int,
        seed: int,
        momentum: ArrayLike | None,
        attitude: ArrayLike | None,
        gravity: float | None,
        begin: int = 0,
    ) -> Self:
        """Return the copies `begin` to `begin` + `n` - 1 of the unlimited sequence of a seed."""
        count, key = arguments.as_int("n", n, 0), arguments.as_int("seed", seed, 0)
        if momentum is None and attitude is None and gravity is None:
            raise ValueError("give the width of at least one of momentum, attitude, gravity")
        normal = initial.draw_normal_numbers(key, begin * self.size, count * self.size)
        normal = normal.reshape(count, *self.shape, normal.shape[-1])
        words: dict[str, Any] = dict(self._list_constructor_arguments())
        with np.errstate(all="ignore"):
            if momentum is not None:
                deviations = (
                    initial.validate_standard_deviation("momentum", momentum, 3) * normal[..., :3]
                )
                words["momentum"] = np.array(self.momentum) + deviations
            if attitude is not None:
                turns = (
                    initial.validate_standard_deviation("attitude", attitude, 3) * normal[..., 3:6]
                )
                x, y, z = np.moveaxis(turns, -1, 0)
                size = np.sqrt(x * x + y * y + z * z)
                half = 0.5 * size
                factor = np.where(size > 0.0, sine(half) / size, 0.5)
                by = np.asarray(cosine(half)), factor * x, factor * y, factor * z
                w, i, j, k = np.moveaxis(np.asarray(self.attitude), -1, 0)
                words["attitude"] = stack_components(*multiply((w, i, j, k), by))
            if gravity is not None:
                width = initial.validate_standard_deviation("gravity", gravity, 1)
                words["gravity"] = self.gravity + width * normal[..., 6]
        return type(self)(**words)._note_varying_parameters([])

    @classmethod
    def from_toml(cls, source: str | os.PathLike[str]) -> Scene:
        r"""Read a scene from a TOML file, or from TOML text.

        A str of several lines is parsed as TOML text; any other argument is a file name. The
        top-level keys are the parameters of Scene, and the keys of the table [body] are those of
        Body. Instead of the momentum and the attitude, the text may contain a table [from_euler] or
        [spinning] with the parameters of the constructor of that name; those from gravity to
        gradient may also be top-level keys. Instead of the keys of Body, a table such as
        [body.cuboid] may give the parameters of the constructor of that name. Values for many tops
        are arrays. Raises ValueError for unknown keys.

        >>> import kreisel as kr
        >>> text = "momentum = [0, 0, 3]\ngravity = 9.81\n[body.cone]\nradius = 1\nheight = 2\n"
        >>> kr.Scene.from_toml(text + "pivot = [0, 0, 0]\nmass = 1").body.com
        (0.0, 0.0, 1.5)
        """
        return toml.parse_toml_text_or_file(source, parse_scene_toml)

    def to_toml(self, path: str | os.PathLike[str] | None = None) -> str:
        """Return the scene as TOML text; if `path` is given, also write the text to this file.

        Passing this text to Scene.from_toml gives an equal scene. Raises ValueError for no tops.
        """
        if 0 in self.shape:
            raise ValueError("a scene of no tops cannot be written as TOML")
        start: dict[str, object] = dict(self._list_constructor_arguments())
        del start["body"]
        for name in ENVIRONMENT[1:]:
            if not has_nonzero_element(start[name]):
                del start[name]
        start = {name: value for name, value in start.items() if value is not None}
        text = toml.format_toml_entries(start) + "\n[body]\n"
        words = {name: getattr(self.body, name) for name in ("mass", "inertia", "com")}
        if self.body.shape and words["inertia"].shape[-2:] == (3, 3):
            words["inertia"] = self.body._tensors  # moments of three bodies would be one matrix
        for name in ("inertia_rtol", "rotor", "unphysical"):
            if has_nonzero_element(getattr(self.body, name)):
                words[name] = getattr(self.body, name)
        if self.body._has_wheels:
            words["wheels"] = self.body._used_wheels
        text += toml.format_toml_entries(words)
        if path is not None:
            atomic_write(path, text.encode())
        return text


if TYPE_CHECKING:  # Type checkers tell a scene of many tops from that of one where they can.

    class Scenes(Scene): ...

else:
    Scenes = Scene


def validate_one_top(name: str, scene: object) -> Scene:
    """Return `scene`; raise TypeError unless it is the scene of one top."""
    one = validate_type(name, scene, Scene)
    if one.shape:
        raise TypeError(
            f"{name} must be the scene of one top, not of the shape {one.shape}: select one by its "
            f"index, as in {name}[0]"
        )
    return one


_ABOVE = dict.fromkeys([*chain(*SCENE), *SCENES], "above [body]")
_BELOW = dict.fromkeys([*chain(*BODY), *BODIES, "wheel"], "below [body]")


def list_scene_file_keys() -> dict[str, list[str]]:
    """List the keys of each table of a scene file; those of the file itself are under ''."""
    tables = {"": SCENE} | {f"[{name}]": words for name, words in SCENES.items()}
    tables |= {"[body]": BODY, "[body.wheel]": WHEEL} | {
        f"[body.{name}]": words for name, words in BODIES.items()
    }
    return {table: [*chain(*words)] for table, words in tables.items()}


def parse_scene_toml(text: str) -> Scene:
    """Return the scene described by a TOML text."""
    return build_scene_from_table(toml.parse_toml_tables(text))


def build_scene_from_table(table: dict[str, object]) -> Scene:
    """Build the scene described by a TOML table. The key "body" is removed from the table."""
    if "body" not in table:
        raise ValueError("the table [body] is missing")
    body = toml.build_body_from_table(table.pop("body"), _ABOVE)
    names = [name for name in SCENES if name in table]
    if not names:
        return toml.call_constructor_with_table(
            partial(Scene, body), "a scene", table, SCENE, _BELOW, SCENES
        )
    name, *others = [*names, *(word for word in table if word not in names)]
    words = dict(toml.require_toml_table(name, table[name]))
    for word in others:
        if word in words:
            raise ValueError(f"{word} is given twice: above [body] and in [{name}]")
        if word in ENVIRONMENT:
            words[word] = table[word]
        elif word in chain(*SCENES[name]):
            raise ValueError(f"{word} belongs in [{name}]")
        else:
            raise ValueError(f"a scene must be described in one way, not by {', '.join(table)}")
    make: Callable[..., Scene] = partial(getattr(Scene, name), body)
    return toml.call_constructor_with_table(make, f"[{name}]", words, SCENES[name], _BELOW)
