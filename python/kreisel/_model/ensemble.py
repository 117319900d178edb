"""Ensembles: arrays of scenes, and starts that the core computes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from .._core import INPUT_RTOL, cosine, euler, spinning
from .._core import Tops as CoreTops
from .._utils.arguments import (
    Array,
    as_bool,
    make_exception_from_status,
    make_frozen_class_decorator,
    validate_type,
)
from ..quaternion import unit
from .batch import BatchBase, broadcast_shapes, stack_components
from .body import Body
from .parameters import (
    ENVIRONMENT,
    PARAMETERS,
    STARTS,
    BatchParameter,
    Column,
    Index,
    Shape,
    collapse_broadcast_axes,
    get_member,
    read_environment,
    read_parameter,
    refuse_first,
)

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_NUMBERS = "momentum", "attitude", *ENVIRONMENT
_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


class VaryKwargs(TypedDict, total=False):
    """Keyword arguments of Scene.vary."""

    body: Body
    mass: ArrayLike
    inertia: ArrayLike
    com: ArrayLike
    rotor: ArrayLike
    momentum: ArrayLike
    velocity: ArrayLike
    body_momentum: ArrayLike
    body_velocity: ArrayLike
    attitude: ArrayLike | Rotation
    attitude_xyzw: ArrayLike
    spin: ArrayLike
    tilt: ArrayLike
    precession: ArrayLike
    angles: ArrayLike
    rates: ArrayLike
    steady: bool
    fast: bool
    degrees: bool
    gravity: ArrayLike
    damping: ArrayLike
    turning: ArrayLike
    shaking: ArrayLike
    friction: ArrayLike


class SceneKwargs(TypedDict, total=False):
    """Keyword arguments of Scene.replace, which are those of the constructor of Scene."""

    body: Body
    momentum: ArrayLike
    velocity: ArrayLike
    body_momentum: ArrayLike
    body_velocity: ArrayLike
    attitude: ArrayLike | Rotation
    attitude_xyzw: ArrayLike
    gravity: float | None
    damping: ArrayLike | None
    turning: ArrayLike | None
    shaking: ArrayLike | None
    friction: float | None


class SceneConstructors:
    """Constructors of Scene and Ensemble from Euler angles and rates."""

    @classmethod
    def from_euler(
        cls,
        body: Body,
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
        """Build a scene from z-x-z Euler angles (precession, nutation, spin) and their rates.

        The angles are path.precession_angle, .nutation and .spin_angle at t = 0 [rad], and the
        rates are their time derivatives [rad/T]. Precession, nutation and spin are rotations about
        e3, the line of nodes and the apex (the direction of the centre of mass), respectively. If
        the apex is the third axis of the frame of description, the attitude is

            Rz(precession) Rx(nutation) Rz(spin).

        If the apex is not the third axis, the angles describe a body-fixed frame whose third axis
        is the apex.

        degrees  True: angles and rates are in degrees, also turning and the rate and phase of
                 shaking; the arguments gravity to friction are otherwise as in Scene

        For an Ensemble, angles and rates may be arrays of the shape (..., 3), and the other
        arguments arrays as in Ensemble.

        >>> import kreisel as kr
        >>> top = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> scene = kr.Scene.from_euler(top, (30, 60, 0), (0, 0, 720), degrees=True, gravity=1)
        >>> round(float(kr.solve(scene, [0.0]).nutation[0]), 12)
        1.047197551197
        """
        in_degrees = as_bool("degrees", degrees)
        around = gravity, damping, turning, shaking, friction
        if not validate_type("body", body, Body).shape and cls is not Ensemble:
            numbers = euler(body._block, angles, rates, in_degrees, around)
            if numbers is not None:
                return cls._from_numbers(body, numbers, damping)
        given = read_environment(body, dict(zip(ENVIRONMENT, around, strict=True)), in_degrees)
        words = [
            read_parameter("angles", angles, degrees=in_degrees),
            read_parameter("rates", rates, degrees=in_degrees),
        ]
        tops = build_from_euler(body, words, words[0].radians, words[1].radians, given)
        return cls._from_tops(tops, damping)

    @classmethod
    def spinning(
        cls,
        body: Body,
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
        """Build a symmetric top that spins about its symmetry axis, tilted from the vertical.

        spin        component of the angular velocity along the axis, from the fixed point towards
                    the centre of mass, as path.spin [rad/T]. Without damping, friction and turning,
                    the spin is constant
        tilt        angle between the axis and the vertical, 0 .. pi; the axis is tilted about e1
        precession  initial rate of the axis about the vertical [rad/T]. The default is 0: the axis
                    is released from rest
        steady      True: the top precesses without nutation, slowly or, with fast=True, fast. At
                    tilt 0 or pi it stands or hangs vertically, without precession
        degrees     True: angles and rates are in degrees, also turning and the rate and phase of
                    shaking; the arguments gravity to friction are otherwise as in Scene

        Raises ValueError for a body that is not symmetric about its apex, and for steady=True with
        `precession`, a rotor, damping, friction or a moving support. Also raises ValueError if no
        steady precession exists. If the spin is too small, the message states the least possible
        spin.

        For an Ensemble, spin, tilt and precession may be arrays, and the other arguments arrays as
        in Ensemble. Messages give the index of the first top that is refused.

        >>> import kreisel as kr
        >>> top = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1)
        >>> scene = kr.Scene.spinning(top, spin=50, tilt=1.0, steady=True, gravity=1)
        >>> path = kr.solve(scene, 10)
        >>> bool(abs(path.nutation - 1.0).max() < 1e-12)
        True
        >>> tops = kr.Ensemble.spinning(top, spin=[[20], [40]], tilt=[0.1, 0.2], gravity=1)
        >>> tops.shape, tops.axes
        ((2, 2), ('spin', 'tilt'))
        """
        in_degrees = as_bool("degrees", degrees)
        is_steady, is_fast = as_bool("steady", steady), as_bool("fast", fast)
        around = gravity, damping, turning, shaking, friction
        if not validate_type("body", body, Body).shape and cls is not Ensemble:
            flags = is_steady, is_fast, in_degrees
            numbers = spinning(body._block, spin, tilt, precession, *flags, around)
            if numbers is not None:
                return cls._from_numbers(body, numbers, damping)
        words = [
            read_parameter("spin", spin, degrees=in_degrees),
            read_tilts(tilt, in_degrees),
        ]
        check_symmetry(body)
        given = read_environment(body, dict(zip(ENVIRONMENT, around, strict=True)), in_degrees)
        if is_steady_precession_requested(steady, fast, precession, given):
            rate = compute_steady_precession(body, words[0], words[1], given["gravity"], is_fast)
        else:
            initial = 0.0 if precession is None else precession
            words.append(read_parameter("precession", initial, degrees=in_degrees))
            rate = words[2].radians
        broadcast_shapes({"body": body.shape, **{one.name: one.shape for one in words}})
        tops = build_spinning(
            body, words, (0.0, words[1].radians, 0.0), words[0].radians, rate, given
        )
        return cls._from_tops(tops, damping)

    @classmethod
    def _from_numbers(cls, body: Body, numbers: tuple[Any, ...], damping: object) -> Self:
        raise NotImplementedError

    @classmethod
    def _from_tops(cls, tops: Ensemble, damping: object) -> Self:
        raise NotImplementedError


@make_frozen_class_decorator("kreisel.Ensemble(..., {}=...) constructs a new ensemble")
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Ensemble(SceneConstructors, BatchBase[Any]):
    """An array of scenes, whose parameters broadcast to a common shape.

    Each parameter of kr.Scene may be a single value or an array of values. All parameters broadcast
    to one shape, such as (n,), (500, 500) or ().

    body      a kr.Body, of one body for all tops or of many
    momentum  (..., 3) in space [M L^2 T^-1]. Alternatively, velocity, body_momentum or
              body_velocity (..., 3)
    attitude  (..., 4) unit quaternions (w, x, y, z), or an array of scipy Rotations. Alternatively,
              attitude_xyzw (..., 4)
    gravity   (...,) acceleration along -e3 [L T^-2]; required unless each centre of mass is exactly
              at the fixed point
    damping   one number for all tops, or (..., 3) along the principal axes, or (..., 1) if the
              three axes of a top have the same damping [M L^2 T^-1]
    turning   (..., 3) angular velocities of the supports [rad/T]
    shaking   (..., 3) amplitudes [L], rates [rad/T] and phases [rad]
    friction  (...,) dry friction about the apex [M L^2 T^-2]

    `tops[i, j]` is a kr.Scene; slices, index arrays and masks return ensembles. Iteration yields
    scenes or, if there are several dimensions, ensembles. Each member is bitwise equal to the
    kr.Scene with the same parameters. A single value that is given for all members is stored only
    once. Two ensembles are equal if all their parameters are equal.

    The parameters are attributes with the shapes (*shape, 3), (*shape, 4) or (*shape,). `tops.body`
    is one body for all tops, or an array of bodies with the shape of the ensemble.

    Raises the same exceptions as Scene, with the index of the first invalid value in the message.

    >>> import kreisel as kr
    >>> body = kr.scenes.thesis.body
    >>> tops = kr.Ensemble(body, momentum=[(0, 0, 1), (0, 0, 2)], gravity=[[1], [2], [3]])
    >>> tops.shape, tops[2, 0].gravity, tops[:, 1].momentum.shape
    ((3, 2), 3.0, (3, 3))
    """

    _one: ClassVar[Any]  # the class of one top
    body: Body
    momentum: Array
    attitude: Array
    gravity: Array
    damping: Array
    turning: Array
    shaking: Array
    friction: Array

    def __init__(
        self,
        body: Body,
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
        validate_type("body", body, Body)
        values = momentum, velocity, body_momentum, body_velocity
        starts = {n: x for n, x in zip(STARTS, values, strict=True) if x is not None}
        if len(starts) != 1:
            raise ValueError(
                f"give exactly one of {', '.join(STARTS)}, not {' and '.join(starts) or 'none'}"
            )
        ((name, value),) = starts.items()
        start = read_parameter(name, value)
        attitudes, q = _read_attitudes(attitude, attitude_xyzw)
        around = gravity, damping, turning, shaking, friction
        given = read_environment(body, dict(zip(ENVIRONMENT, around, strict=True)))
        words = [start, attitudes, *given.values()]
        broadcast_shapes({"body": body.shape, **{one.name: one.shape for one in words}})
        momenta = start.values
        if name != "momentum":
            kind = STARTS.index(name)
            momenta = _call_core(
                lambda tops, vectors: tops.momenta(kind, vectors),
                body,
                q,
                given.get("turning"),
                start.radians,
            )
        self._store_starts(body, words, momenta, q, given)

    def _store_starts(
        self,
        body: Body,
        words: list[BatchParameter],
        momenta: Array,
        q: Array,
        given: Mapping[str, BatchParameter],
    ) -> Self:
        """Store the columns of the ensemble. `words` are the parameters that the user gave."""
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
            numbers = [get_member(getattr(self, name), place) for name in _NUMBERS[:3]]
            text = "momentum {}, attitude {}, gravity {!r}".format(*numbers)
            error = make_exception_from_status(status, text)
            raise type(error)(f"top{list(place)}: {error}" if place else str(error))
        return self

    @classmethod
    def _from_tops(cls, tops: Any, damping: object) -> Self:
        made: Self = tops
        return made

    def _get_numbers_of_one(self) -> tuple[Any, ...]:
        """Return the numbers of the only top; raise ValueError if there are many."""
        if self.shape:
            name = "body" if self.body.shape else next(iter(self._varied), "body")
            form, why = PARAMETERS[name][3:] if name in PARAMETERS else ("one body", "")
            raise (ValueError if name in PARAMETERS and PARAMETERS[name].endings else TypeError)(
                f"{name} must be {form}, not an array of them: {why}{'; ' if why else ''}a Scene "
                "is one top, and kreisel.Ensemble makes many"
            )
        numbers = [get_member(getattr(self, name), ()) for name in _NUMBERS]
        return (*numbers, self._core_scenes.block(0))

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
        body = Body._combine_bodies([scene.body for scene in members], shape)
        places: tuple[Any, ...] = 15, slice(24, 27), slice(27, 30), slice(30, 33), 33
        around = {
            name: BatchParameter(name, rows[..., place], PARAMETERS[name].shapes[0])
            for name, place in zip(ENVIRONMENT, places, strict=True)
        }
        tops = cls.__new__(cls)
        return tops._store_starts(body, [], rows[..., 21:24], rows[..., 17:21], around)

    def _with(
        self, shape: Shape, names: tuple[str | None, ...], change: Callable[[Column], Column]
    ) -> Self:
        tops, body = super()._with(shape, names, change), self.body
        tops.__dict__["body"] = body._with(shape, names, change) if body.shape else body
        return tops

    def _select_member(self, index: Index) -> Any:
        body = self.body._select_member(index) if self.body.shape else self.body
        return self._one(
            body, **{name: get_member(getattr(self, name), index) for name in _NUMBERS}
        )

    @cached_property
    def _core_scenes(self) -> CoreTops:
        """The scenes as an array in the memory layout that the C library requires."""
        return _make_core_tops(self.body, self.shape, self._columns)

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of the dimensions of the ensemble.

        A dimension is named after the only parameter that varies along it, if this parameter is a
        scalar and varies along no other dimension. All other dimensions are named 'dim_k', where k
        is the index, or 'top' if the ensemble has only one dimension.
        """
        unnamed = "top" if len(self.shape) == 1 else "dim_{}"
        return tuple(name or unnamed.format(k) for k, name in enumerate(self._names))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Ensemble):
            return NotImplemented
        return (
            self.shape == other.shape
            and self.body == other.body
            and all(np.array_equal(getattr(self, n), getattr(other, n)) for n in _NUMBERS)
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return self._describe()

    def __getstate__(self) -> dict[str, Any]:
        return {name: x for name, x in self.__dict__.items() if name != "_core_scenes"}


def _make_core_tops(body: Body, shape: Shape, columns: Mapping[str, Array]) -> CoreTops:
    """Return tops as the core reads them; missing columns are zero, or upright."""
    start: dict[str, Any] = {"gravity": 0.0, "t": 0.0, "attitude": _UPRIGHT}
    start |= dict.fromkeys(("momentum", "damping", "turning", "shaking"), np.zeros(3))
    start |= {"friction": 0.0, **columns}
    names = "mass", "moments", "principal_com", "axes", "inertia_rtol", "principal_rotor"
    own = [body._columns[name] if body.shape else getattr(body, name) for name in names]
    parts = [*own, *start.values()]
    return CoreTops(shape, [np.asarray(values, dtype=np.float64) for values in parts])


def _call_core(
    compute: Callable[..., Array],
    body: Body,
    q: Array,
    turning: BatchParameter | None,
    *vectors: Array,
) -> Array:
    """Return rows that the core computes from the vectors, once for tops that share them."""
    columns = {"attitude": q, "turning": np.zeros(3) if turning is None else turning.radians}
    small = [collapse_broadcast_axes(x, x.ndim - 1) for x in (*columns.values(), *vectors)]
    shape = np.broadcast_shapes(body.shape, *[x.shape[:-1] for x in small])
    tops = _make_core_tops(body, shape, dict(zip(columns, small, strict=False)))
    rows = [np.broadcast_to(x, (*shape, 3)).reshape(-1, 3) for x in small[2:]]
    result: Array = compute(tops, *rows)
    return result.reshape(*shape, result.shape[-1])


def build_from_euler(
    body: Body,
    words: list[BatchParameter],
    angles: Array,
    rates: Array,
    given: Mapping[str, BatchParameter],
) -> Ensemble:
    """Build tops from Euler angles [rad] and their rates, and the parameters of the user."""
    words = [*words, *given.values()]
    broadcast_shapes({"body": body.shape, **{one.name: one.shape for one in words}})
    rows = _call_core(
        lambda tops, *vectors: tops.euler(*vectors),
        body,
        _UPRIGHT,
        given.get("turning"),
        angles,
        rates,
    )
    return Ensemble.__new__(Ensemble)._store_starts(
        body, words, rows[..., 4:], rows[..., :4], given
    )


def build_spinning(
    body: Body,
    words: list[BatchParameter],
    angles: tuple[Any, Any, Any],
    spin: Any,
    precession: Any,
    given: Mapping[str, BatchParameter],
    nutation: Any = 0.0,
) -> Ensemble:
    """Build tops from Euler angles [rad], the spin about the apex and the rates of two angles."""
    with np.errstate(all="ignore"):
        rates = precession, nutation, spin - precession * cosine(np.asarray(angles[1]))
    return build_from_euler(
        body,
        words,
        stack_components(*map(np.asarray, angles)),
        stack_components(*map(np.asarray, rates)),
        given,
    )


def read_tilts(tilts: ArrayLike | BatchParameter, degrees: bool) -> BatchParameter:
    """Return the parameter `tilt`; raise ValueError for angles outside [0, pi]."""
    parameter = read_parameter("tilt", tilts, degrees=degrees)
    bad = ~((parameter.radians >= 0.0) & (parameter.radians <= math.pi))
    if bad.any():
        most = "180" if degrees else "pi, or up to 180 with degrees=True"
        refuse_first("tilt", tilts, bad, f"must lie between 0 and {most}")
    return parameter


def check_symmetry(body: Body) -> None:
    """Raise ValueError for the first body that is not symmetric about its apex."""
    is_symmetric = _make_core_tops(body, body.shape, {}).symmetric().reshape(body.shape)
    if not is_symmetric.all():
        index = tuple(map(int, np.unravel_index(int(is_symmetric.argmin()), body.shape)))
        one = body._select_member(index)
        place = f"body{list(index)}: " if index else ""
        raise ValueError(
            f"{place}spinning needs a symmetric body: its axis must be the line from the fixed "
            "point to the centre of mass, or the third axis if these points coincide; this body "
            f"has moments {one.moments} and com {one.principal_com} in principal axes"
        )


def is_steady_precession_requested(
    steady: object, fast: object, precession: object, given: Mapping[str, BatchParameter]
) -> bool:
    """Return True if a steady precession is requested.

    Raises TypeError if `steady` or `fast` is not a bool, and ValueError for incompatible arguments.
    """
    if as_bool("fast", fast) and not steady:
        raise ValueError("fast chooses between two steady precessions: also pass steady=True")
    if not as_bool("steady", steady):
        return False
    others = ["precession"] if precession is not None else []
    others += [name for name, one in given.items() if name != "gravity" and one.values.any()]
    if others:
        raise ValueError(f"steady=True cannot be combined with {' or '.join(others)}")
    return True


def compute_steady_precession(
    body: Body, spin: BatchParameter, tilt: BatchParameter, gravity: BatchParameter, fast: bool
) -> Array:
    """Compute the rates of steady precession of tops.

    Raises ValueError with the index of the first top for which no steady precession exists. If its
    spin is too small, the message states the least possible spin.
    """
    if np.any(body.rotor):
        raise ValueError("steady=True does not support bodies with rotors")
    check_symmetry(body)
    words = {one.name: one.shape for one in (spin, tilt, gravity)}
    shape = broadcast_shapes({"body": body.shape, **words})
    rows = [np.broadcast_to(one.radians, shape).reshape(-1) for one in (spin, tilt)]
    tops = _make_core_tops(body, shape, {"gravity": gravity.values})
    rates, least = np.moveaxis(tops.steady(rows[0], rows[1], fast), -1, 0)
    if not np.isnan(rates).any():
        found: Array = rates.reshape(shape)
        return found
    i = int(np.isnan(rates).argmax())
    place = tuple(map(int, np.unravel_index(i, shape)))
    text = "a horizontal axis without spin falls: there is no steady precession"
    if least[i] > 0.0:
        own = float(np.broadcast_to(spin.values, shape)[place])
        other = math.degrees(least[i]) if spin.degrees else float(least[i])
        text = (
            f"there is no steady precession at this tilt with spin = {own!r}: the smallest spin "
            f"with one is {other!r}"
        )
    elif fast and abs(math.cos(rows[1][i])) <= 1e-15:
        text = "a horizontal axis has only one steady precession: leave out fast"
    raise ValueError(f"top{list(place)}: {text}" if place else text)


def _read_attitudes(attitude: Any, xyzw: Any) -> tuple[BatchParameter, Array]:
    """Return the argument `attitude` or `attitude_xyzw`, and the quaternions (w, x, y, z).

    Raises ValueError if both are given, or if a quaternion is not of unit length.
    """
    if attitude is not None and xyzw is not None:
        raise ValueError("give either attitude or attitude_xyzw, not both")
    if xyzw is None and hasattr(attitude, "as_quat"):
        attitude = np.roll(np.asarray(attitude.as_quat()), 1, axis=-1)
    name, value = ("attitude", attitude) if xyzw is None else ("attitude_xyzw", xyzw)
    if value is None:
        return BatchParameter(name, _UPRIGHT, (4,)), _UPRIGHT
    parameter = read_parameter(name, value)
    q = parameter.values
    bad = (
        np.abs(q[..., 0] ** 2 + q[..., 1] ** 2 + q[..., 2] ** 2 + q[..., 3] ** 2 - 1.0) > INPUT_RTOL
    )
    dtype = q.dtype if value is parameter else np.asarray(value).dtype
    if np.any(bad) and dtype.kind == "f" and dtype.itemsize < 8:
        norm = np.sqrt((q * q).sum(axis=-1))
        single = bad & (np.abs(norm - 1.0) <= 4.0 * np.finfo(dtype).eps)
        parameter = parameter._replace(values=np.where(single[..., None], q / norm[..., None], q))
        bad &= ~single
    if np.any(bad):
        place = tuple(map(int, np.unravel_index(int(np.argmax(bad)), bad.shape)))
        one = get_member(q if value is parameter else value, place)
        try:
            unit(name, one, last=xyzw is not None)
        except ValueError as error:
            raise ValueError(f"{name}{list(place)}: {error}" if place else str(error)) from None
    return parameter, parameter.values if xyzw is None else np.roll(parameter.values, 1, axis=-1)
