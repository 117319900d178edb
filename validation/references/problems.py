"""Test problems: the scenes of the report, and scenes of users."""

import math
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

import kreisel as kr
import numpy as np

TABLES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
# The scenes of the report and their final times.
HORIZONS = {name: scene["end"] for name, scene in TABLES["scenes"].items()}
SHORT = 10.0  # final time of quick runs and of the tests
BRIEF = ("kowalewski", "asymmetric")  # scenes of quick runs


@dataclass(frozen=True)
class Problem:
    """A top whose moments of inertia and lever arm are given along its principal axes."""

    name: str
    inertia: tuple  # moments at the fixed point [M L^2]
    lever: tuple  # mass * gravity * (centre of mass relative to the fixed point) [M L^2 T^-2]
    attitude: tuple  # principal axes -> space, scalar first, a unit quaternion up to rounding
    momentum: tuple  # about the fixed point, in the space frame [M L^2 T^-1]
    # the torque is -damping * w along the principal axes [M L^2 T^-1]
    damping: tuple = (0.0, 0.0, 0.0)
    user: kr.Scene | None = None  # the scene from which the problem was made, if any

    def to_scene(self):
        """Convert the problem to a scene of unit mass and gravity, where com is the lever."""
        if self.user:
            return self.user
        return kr.Scene(
            kr.Body(1.0, self.inertia, self.lever, unphysical=True),
            momentum=self.momentum,
            attitude=self.attitude,
            damping=self.damping,
            gravity=1,
        )

    def to_principal_axes(self, q):
        """Convert attitudes of the body to attitudes of its principal axes."""
        if not self.user:
            return q
        return np.stack(kr.quaternion.multiply(np.asarray(q).T, self.user.body.axes), -1)

    @property
    def symmetric(self):
        """True if the body is a Lagrange top, without any tolerance for rounding errors."""
        return self.inertia[0] == self.inertia[1] and self.lever[0] == self.lever[1] == 0

    @property
    def is_damped(self):
        return any(self.damping)

    @property
    def fastest_rate(self):
        """The larger of the angular velocity `rate` and the fastest damping rate [T^-1]."""
        return max(self.rate, *(d / j for d, j in zip(self.damping, self.inertia, strict=True)))

    @property
    def rate(self):
        """The larger of the initial angular velocity and the pendulum frequency [T^-1]."""
        spin = self.highest_rate(np.array(self.attitude), np.array(self.momentum))
        return max(spin, math.sqrt(math.hypot(*self.lever) / max(self.inertia)))

    def highest_rate(self, q, m):
        """Return the largest angular velocity [T^-1] among the given states."""
        return float(np.max(np.linalg.norm(rotate_to_body(q, m) / self.inertia, axis=-1)))

    def energies(self, q, m):
        """Return the kinetic and potential energies, computed in extended precision."""
        q, m = np.asarray(q, np.longdouble), np.asarray(m, np.longdouble)
        q = q / np.sqrt((q * q).sum(-1, keepdims=True))
        kinetic = (rotate_to_body(q, m) ** 2 / np.array(self.inertia, np.longdouble)).sum(-1) / 2
        up = rotate_to_body(q, np.array([0, 0, 1], np.longdouble))
        return kinetic, (up * np.array(self.lever, np.longdouble)).sum(-1)

    def energy_errors(self, q, m):
        """Return the changes of the energy since the start, relative to max(T + |lever|)."""
        kinetic, potential = self.energies(q, m)
        energy = kinetic + potential
        scale = kinetic.max() + np.sqrt((np.array(self.lever, np.longdouble) ** 2).sum())
        change = energy - energy[0]
        change = np.maximum(change, 0) if self.is_damped else abs(change)
        return np.array(change / scale if scale else change, float)

    def energy_error(self, q, m):
        return float(self.energy_errors(q, m).max())

    def scale_to_internal_units(self):
        """Convert to units in which all moments of inertia and the rotation rate are at most 1.

        Returns the problem in these units, and the units of moment and rate, powers of two.
        """
        sizes = max(self.inertia), self.rate
        moment, rate = (2.0 ** math.frexp(x)[1] if x else 1.0 for x in sizes)

        def by(unit, numbers):
            return tuple(x / unit for x in numbers)

        scaled = replace(
            self,
            user=None,
            inertia=by(moment, self.inertia),
            lever=by(rate, by(moment * rate, self.lever)),
            momentum=by(moment * rate, self.momentum),
            damping=by(moment * rate, self.damping),
        )
        return scaled, moment, rate


def rotate_to_body(q, v):
    """Rotate vectors from the space frame to the body frame by q* v q."""
    w, u = q[..., :1], q[..., 1:]
    t = 2 * np.cross(v, u)
    return v + w * t + np.cross(t, u)


def rotate_to_space(q, v):
    """Rotate vectors from the body frame to the space frame by q v q*."""
    return rotate_to_body(q * np.array([1, -1, -1, -1]), v)


def attitude_errors(q, truth):
    """Return the angles [rad] between pairs of attitudes, from 0 to pi, also if they are small."""
    q, truth = np.asarray(q, np.longdouble), np.asarray(truth, np.longdouble)
    (a, u), (b, v) = (q[..., :1], q[..., 1:]), (truth[..., :1], truth[..., 1:])
    vec = a * v - b * u - np.cross(u, v)
    same = a[..., 0] * b[..., 0] + (u * v).sum(-1)
    return np.asarray(2 * np.arctan2(np.sqrt((vec * vec).sum(-1)), abs(same)), float)


def attitude_error(q, truth):
    return float(attitude_errors(q, truth))


def load_problem(name):
    """Return a scene of the report as a problem."""
    return replace(problem_of_scene(name, getattr(kr.scenes, name)), user=None)


def problem_of_scene(name, scene):
    """Convert a scene to principal axes.

    Raises ValueError if the top has a rotor, friction or a moving support.
    """
    effects = {
        "a rotor": scene.body.rotor,
        "friction": (scene.friction,),
        "a turning support": scene.turning,
        "a shaken support": scene.shaking[:1],  # the amplitude
    }
    if any(map(any, effects.values())):
        raise ValueError(
            f"this top has {', '.join(name for name, numbers in effects.items() if any(numbers))}, "
            "but the reference solutions are only for tops on a support at rest, without rotors "
            "and friction"
        )
    body = scene.body
    lever = tuple(body.mass * scene.gravity * x for x in body.principal_com)
    attitude = tuple(map(float, kr.quaternion.multiply(scene.attitude, body.axes)))
    return Problem(name, body.moments, lever, attitude, scene.momentum, scene.damping, scene)
