"""Free parameters of a fit, and rotations that change attitudes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from .._core import tangents as TANGENTS
from .._model.body import Body
from .._model.parameters import advance_shaking_phase
from .._model.scene import Scene
from .._results.results import SPECIFIC_FORCE
from .._utils.arguments import Array, Vector, short_repr, unknown_name_message
from ..quaternion import multiply
from .records import MEASURABLE, Record, Series

_SMALL = 1e-4  # smaller angles use the limit of the series [rad]
UNTURNED = np.array([1.0, 0.0, 0.0, 0.0])


def cross_matrix(v: Array) -> Array:
    """Return the matrices, of shape (..., 3, 3), that map a vector w to v x w."""
    matrix = np.zeros((*v.shape, 3))
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -z, y, -x
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = z, -y, x
    return matrix


def multiply_quaternions(a: Array, b: Array) -> Array:
    """Return the products a b of two arrays of quaternions, of shape (..., 4)."""
    first, second = (tuple(np.moveaxis(q, -1, 0)) for q in (a, b))
    product: Array = np.stack(multiply(first, second), axis=-1)
    return product


def conjugate_quaternions(q: Array) -> Array:
    conjugate: Array = q * np.array([1.0, -1.0, -1.0, -1.0])
    return conjugate


def normalize_quaternion(q: Array) -> Array:
    unit: Array = q / np.linalg.norm(q)
    return unit


def turn_quaternion(q: Array, v: Array) -> Array:
    """Return a unit quaternion, turned in its own frame by the rotation vector v [rad]."""
    return normalize_quaternion(multiply_quaternions(q, compute_rotation_quaternions(v)))


def compute_rotation_quaternions(v: Array) -> Array:
    angle = np.sqrt((v * v).sum(axis=-1, keepdims=True))
    return np.concatenate((np.cos(0.5 * angle), 0.5 * np.sinc(angle / (2.0 * np.pi)) * v), axis=-1)


def compute_rotation_vectors(q: Array) -> Array:
    """Return the rotation vectors, of length 0 to pi [rad], that correspond to unit quaternions."""
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.sqrt((q[..., 1:] ** 2).sum(axis=-1, keepdims=True))
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    factor: Array = np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)
    return factor * q[..., 1:]


def rotation_matrix(q: Array) -> Array:
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    matrix = np.empty((*q.shape[:-1], 3, 3))
    matrix[..., 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    matrix[..., 1, 1] = 1.0 - 2.0 * (z * z + x * x)
    matrix[..., 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    matrix[..., 0, 1], matrix[..., 1, 0] = 2.0 * (x * y - w * z), 2.0 * (x * y + w * z)
    matrix[..., 0, 2], matrix[..., 2, 0] = 2.0 * (x * z + w * y), 2.0 * (x * z - w * y)
    matrix[..., 1, 2], matrix[..., 2, 1] = 2.0 * (y * z - w * x), 2.0 * (y * z + w * x)
    return matrix


def convert_matrix_to_quaternion(matrix: Array) -> Array:
    """Return the unit quaternion of a rotation matrix.

    The quaternion is an eigenvector of a symmetric matrix; this method is accurate for all rotation
    angles. Source: Bar-Itzhack, Journal of Guidance, Control, and Dynamics 23 (2000) 1085.
    """
    m, k = matrix, np.zeros((4, 4))
    k[0, 0] = np.trace(m)
    k[0, 1:] = k[1:, 0] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    k[1:, 1:] = m + m.T - np.trace(m) * np.eye(3)
    quaternion: Array = np.linalg.eigh(k)[1][:, -1]
    return quaternion if quaternion[0] >= 0.0 else -quaternion


def compute_rotations_from_vertical(direction: Array) -> Array:
    """Return the quaternions of the smallest rotations that take e3 to the given unit vectors."""
    x, y, z = direction[..., 0], direction[..., 1], direction[..., 2]
    sine = np.hypot(x, y)
    is_vertical = sine == 0.0
    factor = np.arctan2(sine, z) / np.where(is_vertical, 1.0, sine)
    rotations = compute_rotation_quaternions(
        np.stack((-y * factor, x * factor, np.zeros_like(x)), axis=-1)
    )
    rotations[is_vertical & (z < 0.0)] = [0.0, 1.0, 0.0, 0.0]
    return rotations


def inverse_left_jacobian(v: Array) -> Array:
    """Return the matrices L that satisfy log(exp(d) exp(v)) = v + L d for small vectors d."""
    angle = np.sqrt((v * v).sum(axis=-1))[..., None, None]
    k = cross_matrix(v)
    safe = np.maximum(angle, _SMALL)
    factor = 1.0 / safe**2 - 0.5 / (safe * np.tan(0.5 * safe))
    inverse: Array = np.eye(3) - 0.5 * k + np.where(angle > _SMALL, factor, 1.0 / 12.0) * (k @ k)
    return inverse


def wrap_angle(angle: Array) -> Array:
    """Return angles reduced to [-pi, pi) [rad]."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


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
    "axes",
]
FREE: tuple[FreeName, ...] = get_args(FreeName)
Key = tuple[str, int, str]  # block, record or -1 for the motion, series or empty


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
    "axes": Block("axes", "rad", "rotation"),
    "mounting": Block("", "rad", "rotation"),
    "delay": Block("", "T"),
    "bias": Block("", None),
    "scale": Block("", ""),
}
_INERTIA_RTOL = 1e-9  # moments of plates exceed the sum of the others by rounding
_JUMPING = ("body_acceleration", SPECIFIC_FORCE.name)
_EQUAL = 1e-12  # relative difference of equal moments and of equal dampings
_THINNEST = 1e-4  # least moment of a search, relative to the largest, if the guess is no needle
_NO_FRICTION = 1e-12  # friction that replaces 0, relative to the energy of the scene
MOMENTS_BY_DENSITY = np.ones((3, 3)) - np.eye(3)


@dataclass(frozen=True, eq=False)
class FitPoint:
    """Values of all parameters, whether free or fixed; vectors are in principal-axis components.

    attitude     quaternion from the principal axes to space
    rate         angular velocity relative to the support
    densities    (a, b, c) of the moments
    axes         quaternion from the principal axes to the frame of description
    rotor        momentum of the rotor
    turning      angular velocity of the support, in space
    shaking      amplitude, rate, and phase at the start of the motion
    friction     dry friction about the apex
    instruments  the values of the properties of instruments
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
    instruments: dict[Key, Array]

    @cached_property
    def moments(self) -> Array:
        """The principal moments of inertia, each at least 1e-12 times the sum of the densities."""
        moments: Array = self.densities.sum() - self.densities
        safe: Array = np.maximum(moments, 1e-12 * self.densities.sum())
        return safe

    @cached_property
    def is_support_turning(self) -> bool:
        return bool(self.turning.any())

    @cached_property
    def inertial_velocity(self) -> Array:
        """The angular velocity in the inertial frame, with components along the principal axes."""
        if not self.is_support_turning:
            return self.rate
        velocity: Array = self.rate + self.turning @ rotation_matrix(self.attitude)
        return velocity

    @cached_property
    def momentum(self) -> Array:
        total: Array = self.moments * self.inertial_velocity + self.rotor
        return total

    def relative_angular_velocity(self, q: Array, m: Array) -> Array:
        """Return the angular velocity relative to the support for attitude q and momentum m."""
        rotation = rotation_matrix(q)
        velocity: Array = (m @ rotation - self.rotor) / self.moments - self.turning @ rotation
        return velocity

    def differentiate_momentum(self) -> dict[str, Array]:
        """Return the derivatives of the momentum in space by the fields of blocks."""
        rotation = rotation_matrix(self.attitude)
        inertia = rotation * self.moments
        support = cross_matrix(self.turning @ rotation)
        return {
            "attitude": inertia @ support - rotation @ cross_matrix(self.momentum),
            "velocity": inertia,
            "moments": (rotation * self.inertial_velocity) @ MOMENTS_BY_DENSITY,
            "rotor": rotation,
            "turning": inertia @ rotation.T,
        }

    @property
    def gravity_force(self) -> float:
        return self.mass * self.gravity

    def to_scene(self, origin: float = 0.0) -> Scene:
        """Build a scene that starts at time `origin`, described in the principal-axis frame."""
        body = Body(
            self.mass,
            self.moments,
            self.com,
            inertia_rtol=_INERTIA_RTOL,
            rotor=self.rotor,
            unphysical=True,
        )
        return Scene(
            body,
            attitude=normalize_quaternion(self.attitude),
            body_momentum=self.momentum,
            gravity=self.gravity,
            damping=self.damping,
            turning=self.turning if self.is_support_turning else None,
            shaking=self.shift_shaking_phase(origin),
            friction=self.friction,
        )

    def shift_shaking_phase(self, t: float) -> Vector | None:
        """Return the shaking parameters, with the phase at time t as the initial phase."""
        if not self.shaking.any():
            return None
        amplitude, rate, phase = self.shaking.tolist()
        return advance_shaking_phase((amplitude, rate, phase), t)

    def compute_effective_gravity(self, t: Array) -> Array:
        """Return the acceleration along -e3 at times t due to gravity and shaking."""
        amplitude, rate, phase = self.shaking
        gravity: Array = self.gravity - amplitude * rate**2 * np.cos(rate * t + phase)
        return gravity


def convert_scene_to_fit_point(scene: Scene) -> FitPoint:
    body = scene.body
    moments = np.array(body.moments)
    densities = 0.5 * moments.sum() - moments  # negative for an unphysical body
    axes = np.array(body.axes)
    attitude = multiply_quaternions(np.array(scene.attitude), axes)
    point = FitPoint(
        attitude,
        np.zeros(3),
        densities,
        np.array(body.principal_com),
        scene.gravity,
        body.mass,
        np.array(scene.damping, dtype=float),
        axes,
        np.array(body.principal_rotor),
        np.array(scene.turning, dtype=float),
        np.array(scene.shaking, dtype=float),
        scene.friction,
        {},
    )
    point.__dict__["moments"] = moments  # without the rounding error of the densities
    return replace(point, rate=point.relative_angular_velocity(attitude, np.array(scene.momentum)))


def _wrap_shaking_phase(shaking: Array) -> Array:
    return np.array((*shaking[:2], -wrap_angle(-shaking[2])))


def expand_free_names(free: FreeName | Iterable[FreeName]) -> tuple[str, ...]:
    """Return the names of parameters in a fixed order; "start" means attitude and velocity."""
    items = [free] if isinstance(free, str) else free
    if not isinstance(items, Iterable):
        raise TypeError(f"free must be names such as ('start', 'moments'), not {short_repr(free)}")
    names: set[str] = set()
    for name in items:
        if name not in FREE:
            raise ValueError(unknown_name_message("name in free:", str(name), FREE))
        names |= {"attitude", "velocity"} if name == "start" else {name}
    if not names:
        raise ValueError(f"free is empty; known are {', '.join(FREE)}")
    if {"com", "lever"} <= names:
        raise ValueError("free has both com and lever, the length of com: leave out one")
    return tuple(name for name in FREE if name in names)


def _group_axes_with_equal(*values: Array) -> Array:
    """Return a matrix whose columns mark the groups of axes on which all given values are equal."""
    columns: list[Array] = []
    indices = [0, 1, 2]
    while indices:
        first, group = indices[0], []
        for k in indices:
            if all(abs(v[k] - v[first]) <= _EQUAL * abs(v).max() for v in values):
                group.append(k)
        columns.append(np.isin(np.arange(3), group).astype(float))
        indices = [k for k in indices if k not in group]
    return np.stack(columns, axis=-1)


class FreeParameters:
    """Free parameters of a scene and of the instruments that recorded its motion.

    slices   {key: slice}: the places of each block
    size     the number of free parameters
    columns  {block: derivatives of its field by its parameters}. Moments that are equal in the
             scene stay equal, and have one column; so have equal dampings about such axes, and
             a damping given as one number
    """

    def __init__(self, scene: Scene, free: tuple[str, ...], records: Sequence[Record]) -> None:
        self.scene, self.free, self.records = scene, free, tuple(records)
        self.start = start = convert_scene_to_fit_point(scene)
        if "axes" in free and ("rotor" in free or start.rotor.any()):
            raise ValueError("axes cannot be free for a body with a rotor, whose axis is given")
        self._thinnest = min(_THINNEST, 0.1 * float(start.moments.min() / start.moments.max()))
        length = float(np.linalg.norm(start.com))
        if "lever" in free and not length > 0.0:
            raise ValueError("lever is free, but com is the fixed point: use com instead")
        self._check_differentiability(length)
        damping = _group_axes_with_equal(start.moments, start.damping)
        self.columns = {name: np.eye(3) for name in BLOCKS} | {
            "lever": start.com / length if length > 0.0 else start.com,
            "moments": _group_axes_with_equal(start.moments),
            "damping": np.ones((3, 1)) if scene._has_common_damping else damping,
            **dict.fromkeys(("gravity", "mass", "friction"), np.ones((1, 1))),
        }
        self.columns["lever"] = self.columns["lever"][:, None]
        keys = [(name, -1, "") for name in free]
        instruments: dict[Key, Array] = {}
        for i, record in enumerate(records):
            for name in record.free:
                if name == "mounting":
                    instruments[name, i, ""] = UNTURNED
                elif name == "delay":
                    instruments[name, i, ""] = np.zeros(1)
                else:
                    for series in record.series:
                        if not series.is_attitude:
                            value = np.full(series.residuals_per_row, float(name == "scale"))
                            instruments[name, i, series.name] = value
        self.slices: dict[Key, slice] = {}
        self.size = 0
        for key in (*keys, *instruments):
            count = len(instruments[key]) if key in instruments else self.columns[key[0]].shape[1]
            count = 3 if key[0] == "mounting" else count
            self.slices[key] = slice(self.size, self.size + count)
            self.size += count
        densities, shaking = start.densities, start.shaking
        if "moments" in free:
            densities = np.maximum(densities, 0.0)
        if "shaking" in free:
            shaking = _wrap_shaking_phase(shaking)
        self.start = replace(start, instruments=instruments, densities=densities, shaking=shaking)

    def _check_differentiability(self, length: float) -> None:
        start, free = self.start, self.free
        if "shaking" in free and not start.shaking[1]:
            raise ValueError(
                "shaking is free, but its rate is 0: give a first guess (amplitude, rate, phase)"
            )
        if not ("friction" in free or start.friction):
            return
        is_turned = abs(start.axes[0]) != 1.0
        for name in ("com", "axes", *(["moments"] if is_turned else [])):
            if name in free and not length > 0.0:
                raise ValueError(
                    f"{name} cannot be free for a top with friction and com = 0: friction then "
                    "acts about the third principal axis, which would change"
                )
        for record in self.records:
            for series in record.series:
                if series.quantity in _JUMPING:
                    raise ValueError(
                        f"{series.name} cannot be fitted for a top with friction, because it jumps "
                        "where the spin stops: leave it out"
                    )

    def can_vary(self, name: str) -> bool:
        return (name, -1, "") in self.slices

    def get_parameter_slice(self, name: str) -> slice:
        return self.slices[name, -1, ""]

    def add_step_within_bounds(self, point: FitPoint, step: Array) -> FitPoint:
        """Move the point by `step`, an array of shape (size,), and clip it to the bounds."""
        changes: dict[str, Array] = {}
        instruments: dict[Key, Array] = {}
        for key, part in self.slices.items():
            name, i, _ = key
            block, delta = BLOCKS[name], step[part]
            if i >= 0:
                old = point.instruments[key]
                is_turned = block.kind == "rotation"
                instruments[key] = turn_quaternion(old, delta) if is_turned else old + delta
            elif block.kind == "rotation":
                changes[block.field] = turn_quaternion(getattr(point, block.field), delta)
            else:
                changes[block.field] = getattr(point, block.field) + self.columns[name] @ delta
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
        return replace(point, instruments=instruments, **fields)

    def turn_body_by_half_turn(self, point: FitPoint, k: int) -> FitPoint | None:
        """Return the point with the body turned by pi about principal axis k.

        Returns None if the point then leaves the free parameters, or if the axis is the symmetry
        axis of a body whose spin angle is arbitrary.
        """
        signs = np.where(np.arange(3) == k, 1.0, -1.0)
        com, rotor = signs * point.com, signs * point.rotor
        is_reachable = (self.can_vary("com") or (com == point.com).all()) and (
            self.can_vary("rotor") or (rotor == point.rotor).all()
        )
        others = self.columns["moments"][np.arange(3) != k]
        if not is_reachable or ((others[0] == others[1]).all() and (com == point.com).all()):
            return None
        turn = np.concatenate(([0.0], (signs + 1.0) / 2.0))
        attitude = multiply_quaternions(point.attitude, turn)
        return replace(point, attitude=attitude, com=com, rotor=rotor, rate=signs * point.rate)

    def measure_distance_from_start(self, point: FitPoint) -> float:
        """Return how far attitude, velocity and body are from the scene, in natural sizes."""
        start = self.start
        turn = multiply_quaternions(conjugate_quaternions(start.attitude), point.attitude)
        distance = float((compute_rotation_vectors(turn) ** 2).sum())
        for name in ("rate", "densities", "com", "rotor"):
            old, new = getattr(start, name), getattr(point, name)
            size = float(old @ old) + float(new @ new)
            distance += float(((new - old) ** 2).sum()) / size if size else 0.0
        return distance

    def compute_distances_to_lower_bounds(self, point: FitPoint) -> Array:
        distances = np.full(self.size, np.inf)
        densities = point.densities - self._compute_least_densities(point.densities)
        for name, values in (
            ("moments", densities),
            ("damping", point.damping),
            ("friction", point.friction),
        ):
            if self.can_vary(name):
                distances[self.get_parameter_slice(name)] = self.average_tied(name, values)
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
            "shaking": np.array(shaking),
            "delay": 1.0 / rate,
        }
        scales = np.ones(self.size)
        for (name, i, label), part in self.slices.items():
            scales[part] = sizes.get(name, 1.0)
            if name == "bias":
                scales[part] = self._find_series(i, label).typical_value_scale
        return scales

    def differentiate_scene(self, point: FitPoint, tangents: Sequence[str], origin: float) -> Array:
        """Return the derivatives of the numbers of the core's tangents by the free parameters."""
        ends = np.cumsum([TANGENTS[name][1] for name in tangents])
        places = {
            name: slice(end - TANGENTS[name][1], end)
            for name, end in zip(tangents, ends, strict=True)
        }
        transform = np.zeros((int(ends[-1]), self.size))
        momentum = point.differentiate_momentum()
        for name in self.free:
            tangent, part = BLOCKS[name].tangent, self.get_parameter_slice(name)
            columns = self.columns[name]
            if name == "attitude":
                transform[:3, part] = columns
            if name in momentum:
                transform[3:6, part] = momentum[name] @ columns
            if tangent:
                transform[places[tangent], part] = (
                    MOMENTS_BY_DENSITY @ columns if name == "moments" else columns
                )
        if self.can_vary("shaking"):  # the phase at the origin depends on the rate
            part = self.get_parameter_slice("shaking")
            transform[places["shaking"].stop - 1, part.start + 1] = origin
        return transform

    def build_differentiable_scene(self, point: FitPoint, origin: float = 0.0) -> Scene:
        """Return the scene in principal axes, with positive friction if friction is to be fitted.

        The friction must be positive, because derivatives with respect to it do not exist at zero
        friction.
        """
        if self.can_vary("friction") and not point.friction:
            start = self.start
            moment = float(start.moments.max())
            energy = moment * float(start.rate @ start.rate)
            energy += abs(start.gravity_force) * float(np.linalg.norm(start.com))
            point = replace(point, friction=_NO_FRICTION * (energy or moment))
        return point.to_scene(origin)

    def to_scene(self, point: FitPoint, origin: float = 0.0) -> Scene:
        """Return the scene with the parameter values `point`, described in the user's body frame.

        origin  the start time of the scene, which the phase of the shaking takes into account
        """
        old, rotation = self.scene.body, rotation_matrix(point.axes)
        is_kept = not (self.can_vary("moments") or self.can_vary("axes"))
        has_old_com = not any(self.can_vary(name) for name in ("com", "lever", "axes"))
        inertia, com, is_diagonal = point.moments, point.com, abs(point.axes[0]) == 1.0
        if not is_diagonal:
            matrix = rotation @ np.diag(point.moments) @ rotation.T
            inertia, com = 0.5 * (matrix + matrix.T), rotation @ point.com
        second = np.diag(point.densities) - point.mass * np.outer(point.com, point.com)
        body = Body(
            point.mass,
            old.inertia if is_kept else inertia,
            old.com if has_old_com else com,
            inertia_rtol=old.inertia_rtol if is_kept else _INERTIA_RTOL,
            rotor=rotation @ point.rotor if self.can_vary("rotor") else old.rotor,
            unphysical=old.unphysical or not np.linalg.eigvalsh(second)[0] >= 0.0,
        )
        attitude = multiply_quaternions(point.attitude, conjugate_quaternions(point.axes))
        damping: Array | float = point.damping
        if self.scene._has_common_damping:
            damping = float(point.damping[0])
        elif not is_diagonal:  # the principal axes of the new body may be in another order
            damping = (rotation_matrix(np.array(body.axes)).T @ rotation) ** 2 @ point.damping
        return Scene(
            body,
            momentum=rotation_matrix(point.attitude) @ point.momentum,
            attitude=normalize_quaternion(attitude),
            gravity=point.gravity,
            damping=damping,
            turning=point.turning,
            shaking=point.shift_shaking_phase(origin),
            friction=point.friction,
        )

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
        rotation, inverse = rotation_matrix(point.axes), conjugate_quaternions(point.axes)
        axes = self.get_parameter_slice("axes") if self.can_vary("axes") else slice(0)
        for key, part in self.slices.items():
            (name, i, label), block, count = key, BLOCKS[key[0]], part.stop - part.start
            names += self._name_parameter_components(key, count)
            unit = block.unit
            if unit is None:
                unit = MEASURABLE[self._find_series(i, label).quantity].dimension
            units += [unit] * count if isinstance(unit, str) else unit
            value = getattr(point, block.field) if i < 0 else point.instruments[key]
            turned_back: Array | None = None  # the axes turn in the body, and not the body in space
            if name == "attitude":
                value, turned_back = multiply_quaternions(value, inverse), rotation
            elif block.kind == "vector":
                turned_back, value = rotation @ cross_matrix(value), rotation @ value
            elif name in ("moments", "damping"):
                first = self.columns[name].argmax(axis=0)
                value = getattr(point, name)[first]
                if name == "moments":
                    jacobian[part, part] = (MOMENTS_BY_DENSITY @ self.columns[name])[first]
            elif name == "lever":
                value = point.com @ self.columns[name]
            values[part] = compute_rotation_vectors(value) if block.kind == "rotation" else value
            if turned_back is not None:
                jacobian[part, part] = rotation
                if self.can_vary("axes"):
                    jacobian[part, axes] = -turned_back
        return names, units, values, jacobian

    def _find_series(self, i: int, label: str) -> Series:
        return next(series for series in self.records[i].series if series.name == label)

    def _name_parameter_components(self, key: Key, count: int) -> list[str]:
        name, i, label = key
        block = BLOCKS[name]
        if name in ("moments", "damping"):
            groups = [np.flatnonzero(column) + 1 for column in self.columns[name].T]
            return [" = ".join(f"{block.head}{j}" for j in group) for group in groups]
        head = f"{name}[{i}]" if i >= 0 else block.head or name
        head += f".{label}" if label else ""
        if count == 1:
            return [head]
        return [f"{head}{block.parts[k] if count == 3 else f'_{k}'}" for k in range(count)]
