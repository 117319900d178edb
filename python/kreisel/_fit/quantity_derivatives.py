"""Quantities of states and their derivatives by the state and by parameters of the body.

All vectors of the body are seen from the principal axes. A change of the state is (theta, dm): a
rotation vector theta, seen from the principal axes, and a change dm of the momentum in space.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .._options.quantities import QUANTITIES
from .._utils.validation import Array
from .rotations import cross_matrix, rotation_matrix, tilt_to

_POLE = 1e-9  # least distance from a pole at which an angle about the vertical has a derivative


class Derivatives(NamedTuple):
    """The values (n, k) of a quantity and their derivatives; None is zero.

    state    (n, k, 6) by (theta, dm)
    moments  (n, k, 3) by the principal moments, at constant momentum
    com      (n, k, 3) by the centre of mass, seen from the principal axes
    weight   (n, k) by mass times gravity
    axes     (n, k, 3) by a rotation of the principal axes in the frame of description
    """

    values: Array
    state: Array
    moments: Array | None = None
    com: Array | None = None
    weight: Array | None = None
    axes: Array | None = None


@dataclass(frozen=True, eq=False)
class States:
    """The states q (n, 4) from the principal axes to space and m (n, 3), and the body."""

    q: Array
    m: Array
    moments: Array
    com: Array
    weight: float
    damping: Array
    axes: Array  # (3, 3), from the principal axes to the frame of description
    rotor: Array  # the momentum of the rotor, seen from the principal axes

    @cached_property
    def rotation(self) -> Array:
        return rotation_matrix(self.q)

    @cached_property
    def inverse_rotation(self) -> Array:
        return np.ascontiguousarray(np.swapaxes(self.rotation, -1, -2))

    @cached_property
    def momentum(self) -> Array:
        """The momentum (n, 3), seen from the principal axes."""
        made: Array = (self.inverse_rotation @ self.m[:, :, None])[:, :, 0]
        return made

    @cached_property
    def rate(self) -> Array:
        """The angular velocity (n, 3), seen from the principal axes."""
        made: Array = (self.momentum - self.rotor) / self.moments
        return made

    @cached_property
    def vertical(self) -> Array:
        return self.rotation[:, 2, :]

    @cached_property
    def momentum_by_state(self) -> Array:
        return np.concatenate((cross_matrix(self.momentum), self.inverse_rotation), axis=-1)

    @cached_property
    def rate_by_state(self) -> Array:
        return self.momentum_by_state / self.moments[:, None]

    @cached_property
    def axis(self) -> Array:
        """The apex (3,), seen from the principal axes; along T if there is no lever."""
        length = float(np.linalg.norm(self.com))
        return self.com / length if length > 0.0 else np.array([0.0, 0.0, 1.0])

    @cached_property
    def axis_by_com(self) -> Array:
        length = float(np.linalg.norm(self.com))
        if not length > 0.0:
            return np.zeros((3, 3))
        made: Array = (np.eye(3) - np.outer(self.axis, self.axis)) / length
        return made

    @cached_property
    def apex(self) -> Array:
        made: Array = self.rotation @ self.axis
        return made

    def flow(self) -> Array:
        """Return the rates of change (n, 6) of (theta, m)."""
        lever = self.rotation @ self.com
        torque = self.weight * np.stack((-lever[:, 1], lever[:, 0], np.zeros(len(lever))), axis=-1)
        drag = (self.rotation @ (self.damping * self.rate)[:, :, None])[:, :, 0]
        return np.concatenate((self.rate, torque - drag), axis=-1)


def _pad(by_theta: Array) -> Array:
    """Return derivatives by (theta, dm) of quantities that do not depend on the momentum."""
    return np.concatenate((by_theta, np.zeros_like(by_theta)), axis=-1)


def _row(values: Array, state: Array, *others: Array | None) -> Derivatives:
    """Return the derivatives of a scalar quantity with values (n,)."""
    rest = (d if d is None else d[:, None] for d in others)
    return Derivatives(values[:, None], state[:, None], *rest)


def _attitude(s: States) -> Derivatives:
    raise ValueError("attitudes are compared as rotations, not component by component")


def _momentum(s: States) -> Derivatives:
    identity = np.broadcast_to(np.eye(3), s.rotation.shape)
    return Derivatives(s.m, np.concatenate((np.zeros_like(s.rotation), identity), axis=-1))


def _velocity(s: States) -> Derivatives:
    by_body = s.rate_by_state.copy()
    by_body[:, :, :3] -= cross_matrix(s.rate)
    moments = -s.rotation * (s.rate / s.moments)[:, None, :]
    values = (s.rotation @ s.rate[:, :, None])[:, :, 0]
    return Derivatives(values, s.rotation @ by_body, moments)


def _torque(s: States) -> Derivatives:
    up = cross_matrix(np.array([0.0, 0.0, 1.0]))
    per_weight = (s.rotation @ s.com) @ up.T
    by_com = s.weight * (up @ s.rotation)
    state = _pad(-by_com @ cross_matrix(s.com))
    return Derivatives(s.weight * per_weight, state, None, by_com, per_weight)


def _frame(s: States) -> Derivatives:
    blocks = np.zeros((len(s.q), 3, 3, 3))
    for i, unit in enumerate(np.eye(3)):
        blocks[:, i] = -s.rotation @ cross_matrix(unit)
    return Derivatives(s.inverse_rotation.reshape(-1, 9), _pad(blocks.reshape(-1, 9, 3)))


def _apex(s: States) -> Derivatives:
    state = _pad(-s.rotation @ cross_matrix(s.axis))
    return Derivatives(s.apex, state, None, s.rotation @ s.axis_by_com)


def _body_velocity(s: States) -> Derivatives:
    moments = np.zeros_like(s.rotation)
    moments[:, range(3), range(3)] = -s.rate / s.moments
    return Derivatives(s.rate, s.rate_by_state, moments)


def _body_momentum(s: States) -> Derivatives:
    return Derivatives(s.momentum, s.momentum_by_state)


def _body_vertical(s: States) -> Derivatives:
    return Derivatives(s.vertical, _pad(cross_matrix(s.vertical)))


def _spin(s: States) -> Derivatives:
    moments = -s.rate / s.moments * s.axis
    return _row(s.rate @ s.axis, s.axis @ s.rate_by_state, moments, s.rate @ s.axis_by_com)


def _along_apex(s: States, values: Array, gradient: Array) -> Derivatives:
    """Return the derivatives of a function of the apex, from its gradient (n, 3)."""
    apex = _apex(s)
    assert apex.com is not None
    by_apex = gradient[:, None, :]
    return Derivatives(values[:, None], by_apex @ apex.state, None, by_apex @ apex.com)


def _precession_angle(s: States) -> Derivatives:
    x, y, _ = s.apex.T
    square = np.maximum(x * x + y * y, _POLE**2)
    gradient = np.stack((-y / square, x / square, np.zeros_like(x)), axis=-1)
    return _along_apex(s, np.arctan2(x, -y), gradient)


def _nutation(s: States) -> Derivatives:
    x, y, z = s.apex.T
    across = np.hypot(x, y)
    safe = np.maximum(across, _POLE)
    gradient = np.stack((x * z / safe, y * z / safe, -across), axis=-1)
    return _along_apex(s, np.arctan2(across, z), gradient)


def _spin_angle(s: States) -> Derivatives:
    """Return the angle of the vertical about the apex, in the frame whose third axis is the apex.

    This frame depends on the direction n of the apex in the frame of description. If n changes by
    dn, the frame rotates by n x dn - n <e3, n x dn> / (1 + n_z), because it is the frame of the
    shortest rotation from e3 to n.
    """
    n = s.axes @ s.axis
    tilt = rotation_matrix(tilt_to(n))
    x, y, _ = (s.vertical @ s.axes.T @ tilt).T
    square = np.maximum(x * x + y * y, _POLE**2)
    gradient = np.stack((y / square, -x / square, np.zeros_like(x)), axis=-1) @ tilt.T
    vertical = s.vertical @ s.axes.T
    about_n = np.array([-n[1], n[0], 0.0]) / (1.0 + n[2]) if n[2] > -1.0 else np.zeros(3)
    by_n = np.cross(gradient, vertical) @ (cross_matrix(n) - np.outer(n, about_n))
    by_vertical = gradient @ s.axes
    state = _pad((by_vertical[:, None, :] @ cross_matrix(s.vertical))[:, 0])
    axes = -(by_vertical[:, None, :] @ cross_matrix(s.vertical))[:, 0]
    axes -= by_n @ s.axes @ cross_matrix(s.axis)
    return _row(np.arctan2(x, y), state, None, by_n @ s.axes @ s.axis_by_com, None, axes)


def _kinetic(s: States) -> Derivatives:
    values = 0.5 * (s.moments * s.rate**2).sum(axis=-1)
    state = (s.rate[:, None, :] @ s.momentum_by_state)[:, 0]
    return _row(values, state, -0.5 * s.rate**2)


def _potential(s: States) -> Derivatives:
    height = s.vertical @ s.com
    state = s.weight * np.cross(s.com, s.vertical)
    return _row(s.weight * height, _pad(state), None, s.weight * s.vertical, height)


def _energy(s: States) -> Derivatives:
    a, b = _kinetic(s), _potential(s)
    return Derivatives(a.values + b.values, a.state + b.state, a.moments, b.com, b.weight)


def _vertical_momentum(s: States) -> Derivatives:
    state = np.zeros((len(s.m), 6))
    state[:, 5] = 1.0
    return _row(s.m[:, 2], state)


def _axial_momentum(s: States) -> Derivatives:
    state = s.axis @ s.momentum_by_state
    return _row(s.momentum @ s.axis, state, None, s.momentum @ s.axis_by_com)


Evaluation = Callable[[States], Derivatives]
EVALUATIONS: dict[str, Evaluation] = {
    "q": _attitude,
    "m": _momentum,
    "velocity": _velocity,
    "torque": _torque,
    "frame": _frame,
    "apex": _apex,
    "body_velocity": _body_velocity,
    "body_momentum": _body_momentum,
    "body_vertical": _body_vertical,
    "spin": _spin,
    "precession_angle": _precession_angle,
    "nutation": _nutation,
    "spin_angle": _spin_angle,
    "kinetic": _kinetic,
    "potential": _potential,
    "energy": _energy,
    "vertical_momentum": _vertical_momentum,
    "axial_momentum": _axial_momentum,
}
# Vectors that an instrument on the body sees in its own frame.
SEEN_FROM_BODY = frozenset(name for name in QUANTITIES if name.startswith("body_"))
