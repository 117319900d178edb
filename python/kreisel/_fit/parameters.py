"""Free parameters of a fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from .._core import tangents as TANGENTS
from .._model.body import Body
from .._model.parameters import advance_shaking_phase
from .._model.scene import Scene
from .._results.results import SPECIFIC_FORCE
from .._utils.arguments import Array, short_repr, spell, unknown_name_message
from . import rotations
from .records import MEASURABLE, Record

FreeName = Literal[
    "start",
    "attitude",
    "velocity",
    "moments",
    "com",
    "lever",
    "gravity",
    "mass",
    "damping",
    "friction",
    "rotor",
    "turning",
    "shaking",
    "gradient",
    "axes",
]
FREE: tuple[FreeName, ...] = get_args(FreeName)
START = ("attitude", "velocity")
Places = dict[str, slice]  # {block: its columns of derivatives}
Key = tuple[str, int, str]  # block, record or piece or -1 for the motion, series or _PIECE or empty
_PIECE = "piece"


class Block(NamedTuple):
    """A block of free parameters: how it enters a motion, and how it is reported.

    field    the attribute of FitPoint that a step changes, by the columns of FreeParameters
    unit     of all its numbers, or of each; None for that of the measured quantity
    kind     "rotation": a step turns a quaternion, which is reported as a rotation vector.
             "vector": principal-axis components, reported in the frame of description. Else numbers
    tangent  the tangent of the core by the field; "" if the field changes no number but the start
    head     the beginning of the reported names
    parts    the ends of the reported names
    """

    field: str
    unit: str | tuple[str, ...] | None
    kind: str = ""
    tangent: str = ""
    head: str = ""
    parts: Sequence[str] = ("_x", "_y", "_z")


BLOCKS = {
    "attitude": Block("attitude", "rad", "rotation"),
    "velocity": Block("rate", "rad/T", "vector", head="body_velocity"),
    "moments": Block("densities", "M L^2", "", "moments", "I"),
    "com": Block("com", "L", "vector", "com"),
    "lever": Block("com", "L", "", "com"),
    "gravity": Block("gravity", "L T^-2", "", "gravity"),
    "mass": Block("mass", "M", "", "mass"),
    "damping": Block("damping", "M L^2 T^-1", "", "damping", "damping_"),
    "friction": Block("friction", "M L^2 T^-2", "", "friction"),
    "rotor": Block("rotor", "M L^2 T^-1", "vector", "rotor"),
    "turning": Block("turning", "rad/T", "", "turning"),
    "shaking": Block(
        "shaking", ("L", "rad/T", "rad"), "", "shaking", parts=("_amplitude", "_rate", "_phase")
    ),
    "gradient": Block("gradient", "T^-2", "", "gradient"),
    "axes": Block("axes", "rad", "rotation"),
    "mounting": Block("", "rad", "rotation"),
    "delay": Block("", "T"),
    "bias": Block("", None),
    "scale": Block("", ""),
}
_INERTIA_RTOL = 1e-9  # moments of plates exceed the sum of the others by rounding
_JUMPING = ("body_acceleration", "pivot_force", SPECIFIC_FORCE.name)
_EQUAL = 1e-12  # relative difference of equal moments and of equal dampings
_THINNEST = 1e-4  # least moment of a search, relative to the largest, if the guess is no needle
_NO_FRICTION = 1e-12  # friction that replaces 0, relative to the energy of the scene
MOMENTS_BY_DENSITY = np.ones((3, 3)) - np.eye(3)


@dataclass(frozen=True, eq=False)
class FitPoint:
    """Values of all parameters, whether free or fixed; vectors are in principal-axis components.

    attitude   quaternion from the principal axes to space
    rate       angular velocity relative to the support
    densities  (a, b, c) of the moments
    axes       quaternion from the principal axes to the frame of description
    turning    angular velocity of the support, in space
    shaking    amplitude, rate, and phase at the start of the motion
    extra      the properties of instruments, and the starts of further pieces of the motion
    """

    attitude: Array
    rate: Array
    densities: Array
    com: Array
    gravity: float
    mass: float
    damping: Array
    axes: Array
    rotor: Array
    turning: Array
    shaking: Array
    friction: float
    gradient: float
    extra: dict[Key, Array]

    @cached_property
    def moments(self) -> Array:
        """The principal moments of inertia, each at least 1e-12 times the sum of the densities."""
        moments: Array = self.densities.sum() - self.densities
        safe: Array = np.maximum(moments, 1e-12 * self.densities.sum())
        return safe

    @cached_property
    def inertial_velocity(self) -> Array:
        """The angular velocity in the inertial frame, with components along the principal axes."""
        velocity: Array = self.rate + self.turning @ rotations.to_matrix(self.attitude)
        return velocity

    @property
    def momentum(self) -> Array:
        total: Array = self.moments * self.inertial_velocity + self.rotor
        return total

    @property
    def gravity_force(self) -> float:
        return self.mass * self.gravity

    @property
    def torque(self) -> float:
        """The largest torque of gravity, with the sign of gravity."""
        return self.gravity_force * float(np.linalg.norm(self.com))

    def relative_angular_velocity(self, q: Array, m: Array) -> Array:
        """Return the angular velocity relative to the support for attitude q and momentum m."""
        rotation = rotations.to_matrix(q)
        velocity: Array = (m @ rotation - self.rotor) / self.moments - self.turning @ rotation
        return velocity

    def start_at(self, attitude: Array, rate: Array) -> FitPoint:
        return replace(self, attitude=attitude, rate=rate)

    def at_piece(self, k: int) -> FitPoint:
        """Return the point with the start of piece k of the motion."""
        starts = [self.extra.get((name, k, _PIECE)) for name in START]
        return self if starts[0] is None else self.start_at(*starts)  # type: ignore[arg-type]

    def with_pieces(self, states: Iterable[tuple[Array, Array] | None]) -> FitPoint:
        """Return the point with the attitude and rate of each piece; None for that at the start."""
        extra = dict(self.extra)
        for k, state in enumerate(states):
            if state is not None:
                extra |= {(n, k, _PIECE): x for n, x in zip(START, state, strict=True)}
        return replace(self, extra=extra)

    def subtract_delays(self, times: Sequence[Array]) -> list[Array]:
        """Return the times of the motion at which clocks, one for each record, show `times`."""
        delays = [self.extra.get(("delay", i, "")) for i in range(len(times))]
        return [t if d is None else t - d[0] for t, d in zip(times, delays, strict=True)]

    def differentiate_momentum(self) -> dict[str, Array]:
        """Return the derivatives of the momentum in space by the fields of blocks."""
        rotation = rotations.to_matrix(self.attitude)
        inertia = rotation * self.moments
        support = rotations.cross(self.turning @ rotation)
        return {
            "attitude": inertia @ support - rotation @ rotations.cross(self.momentum),
            "velocity": inertia,
            "moments": (rotation * self.inertial_velocity) @ MOMENTS_BY_DENSITY,
            "rotor": rotation,
            "turning": inertia @ rotation.T,
        }

    def to_scene(
        self, origin: float = 0.0, body: Body | None = None, damping: Array | float | None = None
    ) -> Scene:
        """Build a scene that starts at time `origin`, described in the frame of `body`.

        By default, this is the frame of the principal axes.
        """
        attitude = self.attitude
        if body is not None:
            attitude = rotations.multiply(attitude, rotations.conjugate(self.axes))
        words: dict[str, Any] = {"inertia_rtol": _INERTIA_RTOL, "rotor": self.rotor}
        shaking = None
        if self.shaking.any():  # with the phase at the origin
            amplitude, rate, phase = self.shaking.tolist()
            shaking = advance_shaking_phase((amplitude, rate, phase), origin)
        return Scene(
            body or Body(self.mass, self.moments, self.com, unphysical=True, **words),
            momentum=rotations.to_matrix(self.attitude) @ self.momentum,
            attitude=rotations.normalize(attitude),
            gravity=self.gravity,
            damping=self.damping if damping is None else damping,
            turning=self.turning,
            shaking=shaking,
            friction=self.friction,
            gradient=self.gradient,
        )

    def compute_effective_gravity(self, t: Array) -> Array:
        """Return the acceleration along -e3 at times t due to gravity and shaking."""
        amplitude, rate, phase = self.shaking
        gravity: Array = self.gravity - amplitude * rate**2 * np.cos(rate * t + phase)
        return gravity


def convert_scene_to_fit_point(scene: Scene) -> FitPoint:
    body = scene.body
    moments = np.array(body.moments)
    axes = np.array(body.axes)
    point = FitPoint(
        attitude=rotations.multiply(np.array(scene.attitude), axes),
        rate=np.zeros(3),
        densities=0.5 * moments.sum() - moments,  # negative for an unphysical body
        com=np.array(body.principal_com),
        gravity=scene.gravity,
        mass=body.mass,
        damping=np.array(scene.damping, dtype=float),
        axes=axes,
        rotor=np.array(body.principal_rotor),
        turning=np.array(scene.turning, dtype=float),
        shaking=np.array(scene.shaking, dtype=float),
        friction=scene.friction,
        gradient=scene.gradient,
        extra={},
    )
    point.__dict__["moments"] = moments  # without the rounding error of the densities
    rate = point.relative_angular_velocity(point.attitude, np.array(scene.momentum))
    return replace(point, rate=rate)


def _wrap_shaking_phase(shaking: Array) -> Array:
    return np.array((*shaking[:2], -rotations.wrap(-shaking[2])))


def expand_free_names(free: FreeName | Iterable[FreeName]) -> tuple[str, ...]:
    """Return the names of parameters in a fixed order; "start" means attitude and velocity."""
    items = [free] if isinstance(free, str) else free
    if not isinstance(items, Iterable):
        raise TypeError(f"{spell('free')} must be names such as 'start', not {short_repr(free)}")
    names: set[str] = set()
    for name in items:
        if name not in FREE:
            raise ValueError(unknown_name_message(f"name in {spell('free')}:", str(name), FREE))
        names |= set(START) if name == "start" else {name}
    if not names:
        raise ValueError(f"{spell('free')} is empty; known are {', '.join(FREE)}")
    if {"com", "lever"} <= names:
        raise ValueError(f"{spell('free')} has com and lever, the length of com: leave out one")
    return tuple(name for name in FREE if name in names)


def _group_axes_with_equal(*values: Array) -> Array:
    """Return a matrix whose columns mark the groups of axes on which all given values are equal."""
    is_equal = np.ones((3, 3), dtype=bool)
    for v in values:
        is_equal &= np.abs(v[:, None] - v) <= _EQUAL * np.abs(v).max()
    first = is_equal.argmax(axis=0)
    groups: Array = (first[:, None] == np.unique(first)).astype(float)
    return groups


class FreeParameters:
    """Free parameters of a scene and of the instruments that recorded its motion.

    places   {block: slice} of the parameters of the motion
    slices   {key: slice} of all parameters
    size     the number of free parameters
    width    the same with the starts of further pieces of the motion, which follow
    columns  {block: derivatives of its field by its parameters}. Moments that are equal in the
             scene stay equal, and have one column; so have equal dampings about such axes, and
             a damping given as one number
    """

    def __init__(self, scene: Scene, free: tuple[str, ...], records: Sequence[Record]) -> None:
        self.scene, self.free, self.records = scene, free, tuple(records)
        self.series = {(i, one.name): one for i, r in enumerate(records) for one in r.series}
        start = convert_scene_to_fit_point(scene)
        self._thinnest = min(_THINNEST, 0.1 * float(start.moments.min() / start.moments.max()))
        self._refuse_indeterminate_parameters(start)
        length = float(np.linalg.norm(start.com)) or 1.0
        damping = _group_axes_with_equal(start.moments, start.damping)
        self.columns = {name: np.eye(3) for name in BLOCKS} | {
            "lever": start.com[:, None] / length,
            "moments": _group_axes_with_equal(start.moments),
            "damping": np.ones((3, 1)) if scene._has_common_damping else damping,
            **dict.fromkeys(("gravity", "mass", "friction", "gradient"), np.ones((1, 1))),
        }
        extra: dict[Key, Array] = {}
        for i, record in enumerate(records):
            whole = {"mounting": rotations.UNTURNED, "delay": np.zeros(1)}
            for name in record.free:
                if name in whole:
                    extra[name, i, ""] = whole[name]
                    continue
                for series in record.series:
                    if not series.is_attitude:
                        value = np.full(series.residuals_per_row, float(name == "scale"))
                        extra[name, i, series.name] = value
        counts = {(name, -1, ""): self.columns[name].shape[1] for name in free}
        counts |= {key: 3 if key[0] == "mounting" else len(x) for key, x in extra.items()}
        self.slices: dict[Key, slice] = {}
        self.size = 0
        for key, count in counts.items():
            self.slices[key] = slice(self.size, self.size + count)
            self.size += count
        self.width = self.size
        self.places: Places = {name: self.slices[name, -1, ""] for name in free}
        densities, shaking = start.densities, start.shaking
        if "moments" in free:
            densities = np.maximum(densities, 0.0)
        if "shaking" in free:
            shaking = _wrap_shaking_phase(shaking)
        self.start = replace(start, extra=extra, densities=densities, shaking=shaking)

    def _refuse_indeterminate_parameters(self, start: FitPoint) -> None:
        """Raise ValueError for parameters by which the residuals have no derivatives."""
        free, has_lever = self.free, bool(start.com.any())
        if "axes" in free and ("rotor" in free or start.rotor.any()):
            raise ValueError("axes cannot be free for a body with a rotor, whose axis is given")
        if "lever" in free and not has_lever:
            raise ValueError("lever is free, but com is the fixed point: use com instead")
        if "shaking" in free and not start.shaking[1]:
            raise ValueError(
                "shaking is free, but its rate is 0: give a first guess (amplitude, rate, phase)"
            )
        if not ("friction" in free or start.friction):
            return
        is_turned = abs(start.axes[0]) != 1.0
        for name in ("com", "axes", *(["moments"] if is_turned else [])):
            if name in free and not has_lever:
                raise ValueError(
                    f"{name} cannot be free for a top with friction and com = 0: friction then "
                    "acts about the third principal axis, which would change"
                )
        for series in self.series.values():
            if series.quantity in _JUMPING:
                raise ValueError(
                    f"{series.name} cannot be fitted for a top with friction, because it jumps "
                    "where the spin stops: leave it out"
                )

    def with_piece_starts(self, pieces: Iterable[int]) -> FreeParameters:
        """Return parameters that include the starts of further pieces of the motion."""
        wide = copy(self)
        wide.slices = dict(self.slices)
        for k in pieces:
            for name in START:
                wide.slices[name, k, _PIECE] = slice(wide.width, wide.width + 3)
                wide.width += 3
        return wide

    def places_of_piece(self, k: int) -> Places:
        own = {name: self.slices.get((name, k, _PIECE)) for name in START}
        return self.places | {name: part for name, part in own.items() if part}

    def add_step_within_bounds(self, point: FitPoint, step: Array) -> FitPoint:
        """Move the point by `step`, an array of shape (width,), and clip it to the bounds."""
        changes: dict[str, Array] = {}
        extra: dict[Key, Array] = {}
        for key, part in self.slices.items():
            name, i, _ = key
            block, delta = BLOCKS[name], step[part]
            old = point.extra[key] if i >= 0 else getattr(point, block.field)
            if block.kind == "rotation":
                new = rotations.turn(old, delta)
            else:
                new = old + delta if i >= 0 else old + self.columns[name] @ delta
            if i >= 0:
                extra[key] = new
            else:
                changes[block.field] = new
        if "densities" in changes:
            densities = np.maximum(changes["densities"], 0.0)
            changes["densities"] = np.maximum(densities, self._compute_least_densities(densities))
        for name, least in ("damping", 0.0), ("friction", 0.0), ("mass", 1e-3 * point.mass):
            if name in changes:
                changes[name] = np.maximum(changes[name], least)
        if "shaking" in changes:
            shaking = changes["shaking"]
            shaking[1] = max(shaking[1], 1e-3 * point.shaking[1])
            if shaking[0] < 0.0 <= self.start.shaking[0]:
                shaking[0] = -shaking[0]
                shaking[2] += np.pi
            changes["shaking"] = _wrap_shaking_phase(shaking)
        scalars = {name: float(x[0]) for name, x in changes.items() if x.shape == (1,)}
        fields: dict[str, Any] = changes | scalars
        return replace(point, extra=extra, **fields)

    def turn_body_by_half_turn(self, point: FitPoint, k: int) -> FitPoint | None:
        """Return the point with the body turned by pi about principal axis k.

        Returns None if the point then leaves the free parameters, or if the axis is the symmetry
        axis of a body whose spin angle is arbitrary.
        """
        signs = np.where(np.arange(3) == k, 1.0, -1.0)
        com, rotor = signs * point.com, signs * point.rotor
        is_same = {"com": (com == point.com).all(), "rotor": (rotor == point.rotor).all()}
        is_reachable = all(same or name in self.places for name, same in is_same.items())
        one, other = self.columns["moments"][np.arange(3) != k]
        if not is_reachable or ((one == other).all() and is_same["com"]):
            return None
        attitude = rotations.multiply(point.attitude, np.append(0.0, (signs + 1.0) / 2.0))
        return replace(point, attitude=attitude, com=com, rotor=rotor, rate=signs * point.rate)

    def measure_distance_from_start(self, point: FitPoint) -> float:
        """Return how far attitude, velocity and body are from the scene, in natural sizes."""
        turn = rotations.difference(self.start.attitude, point.attitude)
        distance = float(turn @ turn)
        for name in ("rate", "densities", "com", "rotor"):
            old, new = getattr(self.start, name), getattr(point, name)
            size = float(old @ old) + float(new @ new)
            distance += float(((new - old) ** 2).sum()) / size if size else 0.0
        return distance

    def compute_distances_to_lower_bounds(self, point: FitPoint) -> Array:
        distances = np.full(self.width, np.inf)
        densities = point.densities - self._compute_least_densities(point.densities)
        for name, values in (
            ("moments", densities),
            ("damping", point.damping),
            ("friction", point.friction),
        ):
            if name in self.places:
                distances[self.places[name]] = self.average_tied(name, values)
        return distances

    def average_tied(self, name: str, values: Array | float) -> Array:
        """Return the mean of the values that each parameter of a block ties together."""
        columns = self.columns[name]
        mean: Array = columns.T @ np.atleast_1d(values) / columns.sum(axis=0)
        return mean

    def _compute_least_densities(self, densities: Array) -> Array:
        """Return lower bounds of the densities, which are zero except for needles.

        A needle with a rotor turns so fast about its axis that its path takes very many steps.
        """
        largest, total = float(densities.max()), float(densities.sum())
        is_needle = total - largest <= (1.0 + _EQUAL) * self._thinnest * total
        return np.where(is_needle & (densities < largest), 0.5 * self._thinnest * total, 0.0)

    def estimate_parameter_scales(self, point: FitPoint, span: float) -> Array:
        """Return the typical magnitude of each parameter, the unit of its changes in the search.

        span  the length of the records [T]
        """
        rate = float(np.linalg.norm(point.rate)) or 1.0 / span
        moments, lever = point.moments, float(np.linalg.norm(point.com)) or 1.0
        density = self.average_tied("moments", point.densities)
        largest = float(moments.max())
        slowest = 0.01 * largest / span
        amplitude, pace, _ = np.abs(point.shaking)
        shaking = amplitude or (lever * (rate / pace) ** 2 if pace else 1.0), 1.0 / span, 1.0
        sizes: dict[str, float | Array] = {
            "velocity": rate,
            "moments": np.minimum(largest, np.maximum(100.0 * density, 1e-3 * moments.min())),
            "com": lever,
            "lever": lever,
            "gravity": abs(point.gravity) or 1.0,
            "mass": point.mass,
            "damping": max(float(point.damping.max()), slowest),
            "friction": max(point.friction, slowest * rate),
            "rotor": max(float(np.linalg.norm(point.rotor)), largest * rate),
            "turning": max(float(np.linalg.norm(point.turning)), rate),
            "gradient": abs(point.gradient) or rate * rate,
            "shaking": np.array(shaking),
            "delay": 1.0 / rate,
        }
        scales = np.ones(self.width)
        for (name, i, label), part in self.slices.items():
            scales[part] = sizes.get(name, 1.0)
            if name == "bias":
                scales[part] = self.series[i, label].typical_value_scale
        return scales

    def differentiate_scene(
        self, point: FitPoint, tangents: Sequence[str], origin: float, places: Places
    ) -> Array:
        """Return the derivatives of the numbers of the core's tangents by the free parameters.

        The scene starts at the time `origin` of the motion.
        """
        rows, count = {}, 0
        for name in tangents:
            rows[name] = slice(count, count + TANGENTS[name][1])
            count = rows[name].stop
        transform = np.zeros((count, self.width))
        momentum = point.differentiate_momentum()
        for name, part in places.items():
            tangent, columns = BLOCKS[name].tangent, self.columns[name]
            if name == "attitude":
                transform[:3, part] = columns
            if name in momentum:
                transform[3:6, part] = momentum[name] @ columns
            if tangent:
                transform[rows[tangent], part] = (
                    MOMENTS_BY_DENSITY @ columns if name == "moments" else columns
                )
        if "shaking" in places:  # the phase at the origin depends on the rate
            transform[rows["shaking"].stop - 1, places["shaking"].start + 1] = origin
        return transform

    def build_differentiable_scene(self, point: FitPoint, origin: float = 0.0) -> Scene:
        """Return the scene in principal axes, with positive friction if friction is to be fitted.

        Derivatives by friction do not exist at zero friction.
        """
        if "friction" in self.places and not point.friction:
            start, moment = self.start, float(self.start.moments.max())
            energy = moment * float(start.rate @ start.rate) + abs(start.torque)
            point = replace(point, friction=_NO_FRICTION * (energy or moment))
        return point.to_scene(origin)

    def to_scene(self, point: FitPoint, origin: float = 0.0) -> Scene:
        """Return the scene with the parameter values `point`, described in the user's body frame.

        origin  the start time of the scene, which the phase of the shaking takes into account
        """
        old, rotation, free = self.scene.body, rotations.to_matrix(point.axes), self.places.keys()
        is_kept = free.isdisjoint(("moments", "axes"))
        inertia, com, is_diagonal = point.moments, point.com, abs(point.axes[0]) == 1.0
        if not is_diagonal:
            matrix = rotation @ np.diag(point.moments) @ rotation.T
            inertia, com = 0.5 * (matrix + matrix.T), rotation @ point.com
        second = np.diag(point.densities) - point.mass * np.outer(point.com, point.com)
        body = Body(
            point.mass,
            old.inertia if is_kept else inertia,
            old.com if free.isdisjoint(("com", "lever", "axes")) else com,
            inertia_rtol=old.inertia_rtol if is_kept else _INERTIA_RTOL,
            rotor=rotation @ point.rotor if "rotor" in free else old.rotor,
            unphysical=old.unphysical or not np.linalg.eigvalsh(second)[0] >= 0.0,
        )
        damping: Array | float = point.damping
        if self.scene._has_common_damping:
            damping = float(point.damping[0])
        elif not is_diagonal:  # the principal axes of the new body may be in another order
            turn = rotations.to_matrix(np.array(body.axes)).T @ rotation
            damping = turn**2 @ point.damping
        return point.to_scene(origin, body, damping)

    def list_user_parameters_and_jacobian(
        self, point: FitPoint
    ) -> tuple[list[str], list[str], Array, Array]:
        """Return the names, units and values of the free parameters as they are reported to users.

        The last item returned is the Jacobian matrix, of shape (size, size), of the reported values
        with respect to the components of a step.
        """
        names: list[str] = []
        units: list[str] = []
        values, jacobian = np.zeros(self.size), np.eye(self.size)
        rotation, inverse = rotations.to_matrix(point.axes), rotations.conjugate(point.axes)
        for key, part in self.slices.items():
            (name, i, label), block, count = key, BLOCKS[key[0]], part.stop - part.start
            head = f"{name}[{i}]" if i >= 0 else block.head or name
            head += f".{label}" if label else ""
            if name in ("moments", "damping"):
                groups = [np.flatnonzero(column) + 1 for column in self.columns[name].T]
                names += [" = ".join(f"{head}{j}" for j in group) for group in groups]
            elif count == 1:
                names.append(head)
            else:
                names += [
                    f"{head}{block.parts[k] if count == 3 else f'_{k}'}" for k in range(count)
                ]
            unit = block.unit
            if unit is None:
                unit = MEASURABLE[self.series[i, label].quantity].dimension
            units += [unit] * count if isinstance(unit, str) else unit
            value = getattr(point, block.field) if i < 0 else point.extra[key]
            turned_back: Array | None = None  # the axes turn in the body, and not the body in space
            if name == "attitude":
                value, turned_back = rotations.multiply(value, inverse), rotation
            elif block.kind == "vector":
                turned_back, value = rotation @ rotations.cross(value), rotation @ value
            elif name in ("moments", "damping"):
                first = self.columns[name].argmax(axis=0)
                value = getattr(point, name)[first]
                if name == "moments":
                    jacobian[part, part] = (MOMENTS_BY_DENSITY @ self.columns[name])[first]
            elif name == "lever":
                value = point.com @ self.columns[name]
            values[part] = rotations.to_vector(value) if block.kind == "rotation" else value
            if turned_back is not None:
                jacobian[part, part] = rotation
                if "axes" in self.places:
                    jacobian[part, self.places["axes"]] = -turned_back
        return names, units, values, jacobian
