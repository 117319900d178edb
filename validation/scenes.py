"""The scenes of problems.json, down to the last bit: every method and every truth starts from the same doubles."""
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

PROBLEMS = Path(__file__).with_name("problems.json")
HORIZONS = {"thesis": 100.0, "kowalewski": 100.0, "asymmetric": 30.0}   # the report's scenes and where they end
SHORT = 10.0                                                            # the end of quick runs and of the tests


@dataclass(frozen=True)
class Problem:
    """A top in its principal axes."""
    name: str
    inertia: tuple      # moments at the fixed point [M L^2]
    lever: tuple        # mass * gravity * centre of mass seen from the fixed point [M L^2 T^-2]
    attitude: tuple     # principal axes -> space, scalar first; a unit quaternion up to rounding
    momentum: tuple     # about the fixed point, seen from space [M L^2 T^-1]

    def scene(self):
        """As kreisel takes it; mass and gravity are 1, so the centre of mass is the lever."""
        import kreisel as kr
        body = kr.Body(mass=1.0, inertia=self.inertia, com=self.lever)
        return kr.Scene(body, momentum=self.momentum, attitude=self.attitude, gravity=1.0)

    def energies(self, q, m):
        """Kinetic and potential energy of states in rows, in extended precision: what is reported as an energy error
        is the state's own, not that of evaluating it."""
        q, m = np.asarray(q, np.longdouble), np.asarray(m, np.longdouble)
        q = q / np.sqrt((q * q).sum(-1, keepdims=True))
        kinetic = (turn_back(q, m) ** 2 / np.array(self.inertia, np.longdouble)).sum(-1) / 2
        up = turn_back(q, np.array([0, 0, 1], np.longdouble))
        return kinetic, (up * np.array(self.lever, np.longdouble)).sum(-1)

    def energy_error(self, q, m):
        """max |E - E0| / max (T + mass gravity |com|) over the states; the first of them is the start."""
        kinetic, potential = self.energies(q, m)
        energy = kinetic + potential
        scale = kinetic.max() + np.sqrt((np.array(self.lever, np.longdouble) ** 2).sum())
        return float(abs(energy - energy[0]).max() / scale)


def turn_back(q, v):
    """q* v q: a vector of space, seen from the body."""
    w, u = q[..., :1], q[..., 1:]
    t = 2 * np.cross(v, u)
    return v + w * t + np.cross(t, u)


def turn(q, v):
    """q v q*: a vector of the body, seen from space."""
    return turn_back(q * np.array([1, -1, -1, -1]), v)


def attitude_error(q, truth):
    """Angle of the rotation between two attitudes, 0 .. pi [rad]; 2 acos |w| would lose half the digits."""
    (a, *u), (b, *v) = np.array(q, np.longdouble), np.array(truth, np.longdouble)
    u, v = np.array(u), np.array(v)
    vec = a * v - b * u - np.cross(u, v)
    return float(2 * np.arctan2(np.sqrt(vec @ vec), abs(a * b + u @ v)))


def load(name):
    entry = json.loads(PROBLEMS.read_text())["scenes"][name]
    own = {key: tuple(map(float.fromhex, values)) for key, values in entry["principal"].items()}
    return Problem(name, own["inertia"], own["mass_g_com"], own["q0"], tuple(entry["momentum"]))
