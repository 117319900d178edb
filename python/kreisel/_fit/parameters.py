"""Free parameters of a fit, and rotations that change attitudes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from .._model.body import Body
from .._model.parameters import advance_shaking_phase
from .._model.scene import Scene
from .._results.quantities import SPECIFIC_FORCE
from .._utils.arguments import PARAMETER_UNITS, Array, Vector, short_repr, unknown_name_message
from .records import MEASURABLE, Record

_SMALL = 1e-4  # smaller angles use the limit of the series [rad]


def cross_matrix(v: Array) -> Array:
    """Return the matrices, of shape (..., 3, 3), that map a vector w to v x w."""
    matrix = np.zeros((*v.shape, 3))
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -z, y, -x
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = z, -y, x
    return matrix


def multiply_quaternions(a: Array, b: Array) -> Array:
    """Return the products a b of two arrays of quaternions."""
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = aw * bw - ax * bx - ay * by - az * bz
    product[..., 1] = aw * bx + ax * bw + ay * bz - az * by
    product[..., 2] = aw * by - ax * bz + ay * bw + az * bx
    product[..., 3] = aw * bz + ax * by - ay * bx + az * bw
    return product


def conjugate_quaternions(q: Array) -> Array:
    """Return the conjugates of an array of quaternions."""
    conjugate: Array = q * np.array([1.0, -1.0, -1.0, -1.0])
    return conjugate


def normalize_quaternion(q: Array) -> Array:
    unit: Array = q / np.linalg.norm(q)
    return unit


def compute_rotation_quaternions(v: Array) -> Array:
    """Return the unit quaternions that correspond to rotation vectors [rad]."""
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
    """Return the rotation matrices that correspond to unit quaternions."""
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

_AXES = "xyz"
_INERTIA_RTOL = 1e-9  # moments of plates exceed the sum of the others by rounding
_VECTORS = {  # {block: attribute of FitPoint that changes by the step}
    "velocity": "rate",
    "com": "com",
    "rotor": "rotor",
    "turning": "turning",
    "shaking": "shaking",
}
_JUMPING = ("body_acceleration", SPECIFIC_FORCE.name)
_EQUAL = 1e-12  # relative difference of equal moments and of equal dampings
_THINNEST = 1e-4  # least moment of a search, relative to the largest, if the guess is no needle
_NO_FRICTION = 1e-12  # friction that replaces 0, relative to the energy of the scene
_SHAKING = ("amplitude", "rate", "phase")
_ROTATIONS = "attitude", "axes", "mounting"  # reported as rotation vectors
_UNITS = {**PARAMETER_UNITS, **dict.fromkeys(_ROTATIONS, "rad"), "delay": "T", "scale": ""}
_MOMENTS_BY_DENSITY = np.ones((3, 3)) - np.eye(3)


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
        """True if the support turns."""
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
        """The angular momentum, with components along the principal axes."""
        total: Array = self.moments * self.inertial_velocity + self.rotor
        return total

    def relative_angular_velocity(self, q: Array, m: Array) -> Array:
        """Return the angular velocity relative to the support for attitude q and momentum m."""
        rotation = rotation_matrix(q)
        velocity: Array = (m @ rotation - self.rotor) / self.moments - self.turning @ rotation
        return velocity

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
    """Return the parameters of a scene."""
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
    """Return the parameters of shaking with the phase in (-pi, pi]."""
    return np.array((*shaking[:2], -wrap_angle(-shaking[2])))


def _is_physical(point: FitPoint) -> bool:
    """Return True if some mass distribution has the given moments, mass and centre of mass."""
    second = np.diag(point.densities) - point.mass * np.outer(point.com, point.com)
    return bool(np.linalg.eigvalsh(second)[0] >= 0.0)


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


def _build_equal_group_matrix(values: Array) -> Array:
    """Return a matrix of zeros and ones in which each column marks one group of equal values."""
    columns: list[Array] = []
    indices = [0, 1, 2]
    while indices:
        group = [
            k for k in indices if abs(values[k] - values[indices[0]]) <= _EQUAL * abs(values).max()
        ]
        columns.append(np.isin(np.arange(3), group).astype(float))
        indices = [k for k in indices if k not in group]
    return np.stack(columns, axis=-1)


def _build_damping_group_matrix(scene: Scene, damping: Array, moments: Array) -> Array:
    """Return one column for all axes if the damping is one number, and otherwise one for each axis.

    Axes with equal moments, marked by a column of `moments`, and equal dampings are arbitrary, and
    have a common column.
    """
    if scene._has_common_damping:
        return np.ones((3, 1))
    groups = moments[:, :, None] * _build_equal_group_matrix(damping)[:, None]
    columns = groups.reshape(3, -1)[:, groups.any(axis=0).ravel()]
    ordered: Array = columns[:, np.argsort(columns.argmax(axis=0))]
    return ordered


class FreeParameters:
    """Free parameters of a scene and of the instruments that recorded its motion.

    slices   {key: slice}: the columns of each block
    size     the number of free parameters
    moments  (3, groups): the moments that are equal in the scene stay equal, and have one column
    damping  (3, groups): the same for the dampings, see _build_damping_group_matrix
    """

    def __init__(self, scene: Scene, free: tuple[str, ...], records: Sequence[Record]) -> None:
        self.scene, self.free, self.records = scene, free, tuple(records)
        self.start = convert_scene_to_fit_point(scene)
        self.moments = _build_equal_group_matrix(self.start.moments)
        self.damping = _build_damping_group_matrix(scene, self.start.damping, self.moments)
        if "axes" in free and ("rotor" in free or self.start.rotor.any()):
            raise ValueError("axes cannot be free for a body with a rotor, whose axis is given")
        moments = self.start.moments
        self._thinnest = min(_THINNEST, 0.1 * float(moments.min() / moments.max()))
        length = float(np.linalg.norm(self.start.com))
        if "lever" in free and not length > 0.0:
            raise ValueError("lever is free, but com is the fixed point: use com instead")
        self._check_differentiability(length)
        self.lever = self.start.com / length if length > 0.0 else self.start.com
        self.slices: dict[Key, slice] = {}
        self.size = 0
        for name in free:
            self._reserve_parameter_slice((name, -1, ""), self._count_free_components(name))
        instruments: dict[Key, Array] = {}
        for i, record in enumerate(records):
            for name in record.free:
                instruments |= self._add_instrument_parameters(name, i, record)
        densities = self.start.densities
        if self.can_vary("moments"):
            densities = np.maximum(densities, 0.0)
        self.start = replace(self.start, instruments=instruments, densities=densities)
        if self.can_vary("shaking"):
            self.start = replace(self.start, shaking=_wrap_shaking_phase(self.start.shaking))

    def _check_differentiability(self, length: float) -> None:
        """Raise ValueError if shaking or friction makes a required derivative undefined."""
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

    def _reserve_parameter_slice(self, key: Key, count: int) -> None:
        self.slices[key] = slice(self.size, self.size + count)
        self.size += count

    def _count_free_components(self, name: str) -> int:
        """Return the number of free components of a parameter."""
        if name in ("moments", "damping"):
            return int((self.moments if name == "moments" else self.damping).shape[1])
        return 1 if name in ("lever", "gravity", "mass", "friction") else 3

    def _add_instrument_parameters(self, name: str, i: int, record: Record) -> dict[Key, Array]:
        """Add parameters of an instrument to the fit, and return their initial values."""
        if name in ("mounting", "delay"):
            key = (name, i, "")
            self._reserve_parameter_slice(key, 3 if name == "mounting" else 1)
            return {key: np.array([1.0, 0.0, 0.0, 0.0]) if name == "mounting" else np.zeros(1)}
        instruments: dict[Key, Array] = {}
        for series in record.series:
            if not series.is_attitude:
                key = (name, i, series.name)
                self._reserve_parameter_slice(key, series.residuals_per_row)
                instruments[key] = np.full(
                    series.residuals_per_row, 1.0 if name == "scale" else 0.0
                )
        return instruments

    def can_vary(self, name: str) -> bool:
        return (name, -1, "") in self.slices

    def get_parameter_slice(self, name: str) -> slice:
        return self.slices[name, -1, ""]

    def add_step_within_bounds(self, point: FitPoint, step: Array) -> FitPoint:
        """Move the point by `step`, an array of shape (size,), and clip it to the bounds."""
        steps = {name: step[part] for (name, i, _), part in self.slices.items() if i < 0}
        changes: dict[str, Array | float] = {}
        for name, delta in steps.items():
            if name == "attitude":
                quaternion = multiply_quaternions(
                    point.attitude, compute_rotation_quaternions(delta)
                )
                changes["attitude"] = normalize_quaternion(quaternion)
            elif name in _VECTORS:
                changes[_VECTORS[name]] = getattr(point, _VECTORS[name]) + delta
            elif name == "moments":
                densities = np.maximum(point.densities + self.moments @ delta, 0.0)
                changes["densities"] = np.maximum(
                    densities, self._compute_least_densities(densities)
                )
            elif name == "damping":
                changes["damping"] = np.maximum(point.damping + self.damping @ delta, 0.0)
            elif name == "lever":
                changes["com"] = point.com + self.lever * delta
            elif name == "axes":
                quaternion = multiply_quaternions(point.axes, compute_rotation_quaternions(delta))
                changes["axes"] = normalize_quaternion(quaternion)
            else:
                changes[name] = float(getattr(point, name) + delta[0])
        if "mass" in changes:
            changes["mass"] = max(float(changes["mass"]), 1e-3 * point.mass)
        if "friction" in changes:
            changes["friction"] = max(float(changes["friction"]), 0.0)
        if "shaking" in changes:
            changes["shaking"] = self._make_shaking_rate_positive(
                np.array(changes["shaking"]), point
            )
        instruments = (
            self._add_step_to_instrument_parameters(point, step) if point.instruments else {}
        )
        return replace(point, instruments=instruments, **changes)  # type: ignore[arg-type]

    def _make_shaking_rate_positive(self, shaking: Array, point: FitPoint) -> Array:
        """Make the shaking rate positive, and keep a nonnegative amplitude from changing sign."""
        shaking[1] = max(shaking[1], 1e-3 * point.shaking[1])
        if shaking[0] < 0.0 <= self.start.shaking[0]:
            shaking[0] = -shaking[0]
            shaking[2] += np.pi
        return _wrap_shaking_phase(shaking)

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
        others = self.moments[np.arange(3) != k]
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

    def _add_step_to_instrument_parameters(self, point: FitPoint, step: Array) -> dict[Key, Array]:
        instruments = {}
        for key, value in point.instruments.items():
            delta = step[self.slices[key]]
            if key[0] == "mounting":
                quaternion = multiply_quaternions(value, compute_rotation_quaternions(delta))
                instruments[key] = normalize_quaternion(quaternion)
            else:
                instruments[key] = value + delta
        return instruments

    def compute_distances_to_lower_bounds(self, point: FitPoint) -> Array:
        """Return the distance of each parameter from its lower bound."""
        distances = np.full(self.size, np.inf)
        densities = point.densities - self._compute_least_densities(point.densities)
        for name, columns, values in (
            ("moments", self.moments, densities),
            ("damping", self.damping, point.damping),
        ):
            if self.can_vary(name):
                distances[self.get_parameter_slice(name)] = columns.T @ values / columns.sum(axis=0)
        if self.can_vary("friction"):
            distances[self.get_parameter_slice("friction")] = point.friction
        return distances

    def _compute_least_densities(self, densities: Array) -> Array:
        """Return lower bounds of the densities, which are zero except for needles.

        A needle with a rotor turns so fast about its axis that its path takes very many steps.
        """
        largest, total = float(densities.max()), float(densities.sum())
        is_needle = total - largest <= (1.0 + _EQUAL) * self._thinnest * total
        return np.where(is_needle & (densities < largest), 0.5 * self._thinnest * total, 0.0)

    def compute_moments_jacobian(self) -> Array:
        """Return the derivatives of the principal moments with respect to their free parameters."""
        jacobian: Array = _MOMENTS_BY_DENSITY @ self.moments
        return jacobian

    def estimate_parameter_scales(self, point: FitPoint, span: float) -> Array:
        """Return the typical magnitude of each parameter, the unit of its changes in the search.

        span  the length of the records [T]
        """
        scales = np.ones(self.size)
        sizes = self._estimate_parameter_scales_by_name(point, span)
        for (name, i, label), part in self.slices.items():
            if name in sizes:
                scales[part] = sizes[name]
            elif name == "bias":
                scales[part] = next(
                    s.typical_value_scale for s in self.records[i].series if s.name == label
                )
        return scales

    def _estimate_parameter_scales_by_name(
        self, point: FitPoint, span: float
    ) -> dict[str, float | Array]:
        rate = float(np.linalg.norm(point.rate)) or 1.0 / span
        moments, lever = point.moments, float(np.linalg.norm(point.com)) or 1.0
        density = self.moments.T @ point.densities / self.moments.sum(axis=0)
        largest = float(moments.max())
        slowest = 0.01 * largest / span
        scales = {
            "velocity": rate,
            "moments": np.minimum(largest, np.maximum(100.0 * density, 1e-3 * moments.min())),
            "com": lever,
            "lever": lever,
            "gravity": abs(point.gravity) or 1.0,
            "mass": point.mass,
            "damping": max(float(point.damping.max()), slowest),
            "friction": max(point.friction, slowest * rate),
            "rotor": max(float(np.linalg.norm(point.rotor)), largest * rate),
            "delay": 1.0 / rate,
        }
        if self.can_vary("turning"):
            scales["turning"] = max(float(np.linalg.norm(point.turning)), rate)
        if self.can_vary("shaking"):
            amplitude, pace, _ = np.abs(point.shaking)
            scales["shaking"] = np.array((amplitude or lever * (rate / pace) ** 2, 1.0 / span, 1.0))
        return scales

    def build_differentiable_scene(self, point: FitPoint, origin: float = 0.0) -> Scene:
        """Return the scene in principal axes, with positive friction if friction is to be fitted.

        The friction must be positive, because derivatives with respect to it do not exist at zero
        friction.
        """
        if self.can_vary("friction") and not point.friction:
            point = replace(point, friction=self._small_friction_instead_of_zero)
        return point.to_scene(origin)

    @cached_property
    def _small_friction_instead_of_zero(self) -> float:
        start = self.start
        moving = float(start.moments.max()) * float(start.rate @ start.rate)
        energy = moving + abs(start.gravity_force) * float(np.linalg.norm(start.com))
        return _NO_FRICTION * (energy or float(start.moments.max()))

    def to_scene(self, point: FitPoint, origin: float = 0.0) -> Scene:
        """Return the scene with the parameter values `point`, described in the user's body frame.

        origin  the start time of the scene, which the phase of the shaking takes into account
        """
        old = self.scene.body
        rotation = rotation_matrix(point.axes)
        is_kept = not (self.can_vary("moments") or self.can_vary("axes"))
        is_diagonal = abs(point.axes[0]) == 1.0
        moments = point.moments
        inertia = (
            old.inertia
            if is_kept
            else moments
            if is_diagonal
            else rotation @ np.diag(moments) @ rotation.T
        )
        com = point.com if is_diagonal else rotation @ point.com
        body = Body(
            point.mass,
            inertia if is_kept or is_diagonal else 0.5 * (inertia + np.transpose(inertia)),
            com
            if self.can_vary("com") or self.can_vary("lever") or self.can_vary("axes")
            else old.com,
            inertia_rtol=old.inertia_rtol if is_kept else _INERTIA_RTOL,
            rotor=rotation @ point.rotor if self.can_vary("rotor") else old.rotor,
            unphysical=old.unphysical or not _is_physical(point),
        )
        attitude = multiply_quaternions(point.attitude, conjugate_quaternions(point.axes))
        momentum = rotation_matrix(point.attitude) @ point.momentum
        # The principal axes of the new body may be in another order.
        order = (rotation_matrix(np.array(body.axes)).T @ rotation) ** 2
        return Scene(
            body,
            momentum=momentum,
            attitude=normalize_quaternion(attitude),
            gravity=point.gravity,
            damping=float(point.damping[0])
            if self.scene._has_common_damping
            else point.damping
            if is_diagonal
            else order @ point.damping,
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
        for key, part in self.slices.items():
            name, i, label = key
            words = self._name_parameter_components(key, part.stop - part.start)
            names += words
            unit = self._find_series_unit(i, label) if name == "bias" else _UNITS[name]
            units += [unit] * len(words) if isinstance(unit, str) else unit
            if i >= 0:
                value = point.instruments[key]
                values[part] = compute_rotation_vectors(value) if name == "mounting" else value
            else:
                values[part] = self._compute_group_values_and_jacobian(name, point, jacobian[part])
        return names, units, values, jacobian

    def _find_series_unit(self, i: int, label: str) -> str:
        quantity = next(s.quantity for s in self.records[i].series if s.name == label)
        return MEASURABLE[quantity].dimension

    def _name_parameter_components(self, key: Key, count: int) -> list[str]:
        name, i, label = key
        if name in ("moments", "damping"):
            columns = self.moments if name == "moments" else self.damping
            head = "I" if name == "moments" else "damping_"
            groups = [np.flatnonzero(columns[:, k]) + 1 for k in range(count)]
            return [" = ".join(f"{head}{j}" for j in group) for group in groups]
        head = f"{name}[{i}]" if i >= 0 else "body_velocity" if name == "velocity" else name
        if label:
            head += f".{label}"
        if name == "shaking":
            return [f"{head}_{part}" for part in _SHAKING]
        if count == 1:
            return [head]
        return [f"{head}_{_AXES[k] if count == 3 else k}" for k in range(count)]

    def _compute_group_values_and_jacobian(self, name: str, point: FitPoint, rows: Array) -> Array:
        """Return the components of the parameter `name`, and write their derivatives to `rows`."""
        rotation = rotation_matrix(point.axes)
        part = self.get_parameter_slice(name)
        if name == "attitude":
            rows[:, part] = rotation
            if self.can_vary("axes"):  # the axes turn in the body, and not the body in space
                rows[:, self.get_parameter_slice("axes")] = -rotation
            inverse = conjugate_quaternions(point.axes)
            return compute_rotation_vectors(multiply_quaternions(point.attitude, inverse))
        if name in ("turning", "shaking"):
            parameter: Array = getattr(point, name)
            return parameter
        if name in _VECTORS:
            vector = getattr(point, _VECTORS[name])
            rows[:, part] = rotation
            if self.can_vary("axes"):
                rows[:, self.get_parameter_slice("axes")] = -rotation @ cross_matrix(vector)
            components: Array = rotation @ vector
            return components
        if name == "axes":
            return compute_rotation_vectors(point.axes)
        if name in ("moments", "damping"):
            columns = self.moments if name == "moments" else self.damping
            first = columns.argmax(axis=0)
            if name == "moments":
                rows[:, part] = self.compute_moments_jacobian()[first]
            group_values: Array = (point.moments if name == "moments" else point.damping)[first]
            return group_values
        if name == "lever":
            return np.array([float(point.com @ self.lever)])
        return np.array([float(getattr(point, name))])
