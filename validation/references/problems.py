"""Test problems from problems.json and from user-defined scenes.

All parameters are double-precision numbers and are taken as exact.
"""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import kreisel as kr
import numpy as np

PROBLEMS = Path(__file__).with_name("problems.json")
# The scenes of the report and their final times.
HORIZONS = {
    "thesis": 100.0,
    "kowalewski": 100.0,
    "goryachev_chaplygin": 100.0,
    "asymmetric": 30.0,
    "asymmetric_regular": 100.0,
    "fast": 100.0,
    "strong_gravity": 100.0,
}
SHORT = 10.0  # final time of quick runs and of the tests


@dataclass(frozen=True)
class Problem:
    """A top whose moments of inertia and lever arm are given along its principal axes.

    The top has neither a rotor nor friction, and its support is at rest.
    """

    name: str
    inertia: tuple  # moments at the fixed point [M L^2]
    lever: tuple  # mass * gravity * (centre of mass relative to the fixed point) [M L^2 T^-2]
    attitude: tuple  # principal axes -> space, scalar first, a unit quaternion up to rounding
    momentum: tuple  # about the fixed point, in the space frame [M L^2 T^-1]
    # the torque is -damping * w along the principal axes [M L^2 T^-1]
    damping: tuple = (0.0, 0.0, 0.0)
    user: kr.Scene | None = None  # the scene from which the problem was made, if any

    def to_scene(self):
        """Convert the problem to a scene.

        With unit mass and unit gravity, the lever vector (mass times gravity times centre of mass)
        equals the centre of mass.
        """
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
        return (
            np.stack(kr.quaternion.multiply(np.asarray(q).T, self.user.body.axes), -1)
            if self.user
            else q
        )

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
        """Return the kinetic and potential energies, computed in extended precision.

        Extended precision makes the rounding errors of the energy negligible.
        """
        q, m = np.asarray(q, np.longdouble), np.asarray(m, np.longdouble)
        q = q / np.sqrt((q * q).sum(-1, keepdims=True))
        kinetic = (rotate_to_body(q, m) ** 2 / np.array(self.inertia, np.longdouble)).sum(-1) / 2
        up = rotate_to_body(q, np.array([0, 0, 1], np.longdouble))
        return kinetic, (up * np.array(self.lever, np.longdouble)).sum(-1)

    def energy_errors(self, q, m):
        """Return the error of the energy relative to max(T + mass * gravity * |com|).

        The first rows of `q` and `m` must contain the initial state. For a damped top, only an
        increase of the energy counts as an error.
        """
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

        Returns the problem in these units, and the units of moment of inertia and angular velocity.
        The units are powers of two, so that the conversion is exact.
        """
        moment, rate = (
            2.0 ** math.frexp(x)[1] if x else 1.0 for x in (max(self.inertia), self.rate)
        )

        def by(unit, numbers):
            return tuple(x / unit for x in numbers)

        return (
            replace(
                self,
                user=None,
                inertia=by(moment, self.inertia),
                lever=by(rate, by(moment * rate, self.lever)),
                momentum=by(moment * rate, self.momentum),
                damping=by(moment * rate, self.damping),
            ),
            moment,
            rate,
        )


def rotate_to_body(q, v):
    """Rotate vectors from the space frame to the body frame by q* v q."""
    w, u = q[..., :1], q[..., 1:]
    t = 2 * np.cross(v, u)
    return v + w * t + np.cross(t, u)


def rotate_to_space(q, v):
    """Rotate vectors from the body frame to the space frame by q v q*."""
    return rotate_to_body(q * np.array([1, -1, -1, -1]), v)


def attitude_errors(q, truth):
    """Return the angles [rad] between pairs of attitudes, from 0 to pi.

    The arc tangent is used because 2 acos(|w|) would lose half of the digits for small angles.
    """
    q, truth = np.asarray(q, np.longdouble), np.asarray(truth, np.longdouble)
    (a, u), (b, v) = (q[..., :1], q[..., 1:]), (truth[..., :1], truth[..., 1:])
    vec = a * v - b * u - np.cross(u, v)
    same = a[..., 0] * b[..., 0] + (u * v).sum(-1)
    return np.asarray(2 * np.arctan2(np.sqrt((vec * vec).sum(-1)), abs(same)), float)


def attitude_error(q, truth):
    return float(attitude_errors(q, truth))


def load_problem(name):
    entry = json.loads(PROBLEMS.read_text())["scenes"][name]
    own = {key: tuple(map(float.fromhex, values)) for key, values in entry["principal"].items()}
    return Problem(name, own["inertia"], own["mass_g_com"], own["q0"], tuple(entry["momentum"]))


def list_omissions(scene):
    """Return the names of those parts of a scene that a problem does not contain."""
    parts = {
        "a rotor": scene.body.rotor,
        "friction": (scene.friction,),
        "a turning support": scene.turning,
        "a shaken support": scene.shaking[:1],  # the amplitude
    }
    return [name for name, numbers in parts.items() if any(numbers)]


def problem_of_scene(name, scene):
    """Convert a scene to principal axes.

    Raises ValueError if the top has a rotor, friction or a moving support. The equations of the
    reference solutions have no terms for them.
    """
    omissions = list_omissions(scene)
    if omissions:
        raise ValueError(
            f"this top has {', '.join(omissions)}, but the reference solutions are only for tops "
            "on a support at rest, without rotors and friction"
        )
    body = scene.body
    lever = tuple(body.mass * scene.gravity * x for x in body.principal_com)
    attitude = tuple(map(float, kr.quaternion.multiply(scene.attitude, body.axes)))
    return Problem(name, body.moments, lever, attitude, scene.momentum, scene.damping, scene)
