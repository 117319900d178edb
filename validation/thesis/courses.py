"""Tops of the thesis, and the courses of them that its experiments are made of."""

from dataclasses import dataclass, replace

import kreisel as kr
import numpy as np

# Quader coordinates, and the middle of the lower face.
HALF, PIVOT = (0.8, 0.8, 1.0), (0.0, 0.0, -1.0)
SCENE = kr.Scene(kr.Body.cuboid(HALF, PIVOT), momentum=(0.172, -1.862, 1.46), gravity=1.0)  # 6.1.1
FAILING = SCENE.replace(momentum=(5.0, 0.0, 0.0), gravity=10.0)  # 6.1.5
TOL, FIRST = 1e-5, 0.1  # of Extrap (5.8.1)
# What the thesis could have had in its plots; each where this build has it.
IMPROVED = [
    name for name in ("bobenko_suris", "bobenko_suris4", "takahashi_imada4") if name in kr.methods
]


@dataclass(frozen=True)
class Course:
    """The states of one top at times, by the thesis' names for them, and what they cost."""

    path: kr.Path
    evaluations: int
    steps: int = 0
    rejected: int = 0

    @property
    def t(self):
        return self.path.t

    @property
    def energy_error(self):
        return self.path.energy - self.path.energy[0]

    @property
    def axial_momentum(self):
        """Gives <m, a>."""
        return self.path.axial_momentum

    @property
    def vertical_momentum(self):
        """Gives <m, e3>; the thesis has <m, p>, which is this times gravity."""
        return self.path.vertical_momentum

    @property
    def axial_error(self):
        return self.axial_momentum - self.axial_momentum[0]


def truth(scene, times):
    """Gives what is trusted: the closed form where there is one, else the tightest tolerance."""
    return Course(kr.solve(scene, times, tol=1e-13), 0)


def fixed(scene, method, step, end, every=1):
    """Keeps each so many steps of a method of fixed step."""
    path = kr.solve(scene, end, method=method, step=step, every=every)
    return Course(path, path.stats.evaluations, path.stats.steps)


def theorem42(scene, step, end, every=1):
    """Gives the Bobenko-Suris discretization as the thesis has it, for a cuboid described in its
    principal axes.

    Its a and m are those of kreisel's bobenko_suris. Its turn about the axis is
    2 atan(h c / 2 I3) - 2 atan(h c / 2 I1) a step, where kreisel has h c / I3 for the first term,
    which makes the twist exact.
    """
    course = fixed(scene, "bobenko_suris", step, end, every)
    path = course.path
    rate = step * course.axial_momentum[0] / scene.body.moments[2]
    half = 0.5 * (2.0 * np.arctan(0.5 * rate) - rate) * every * np.arange(len(path))
    twist = np.cos(half), 0.0, 0.0, np.sin(half)
    states = path.states.copy()
    states[:, 1:5] = np.stack(kr.quaternion.multiply(path.q.T, twist), axis=-1)
    return replace(course, path=replace(path, states=states))


def restarted(scene, interval, end, tol=TOL, first=FIRST, every=1):
    """Gives Extrap as the program uses it: begun anew, with its first step, at each interval, which
    is the time between two pictures and not a step. Every so many ends are kept."""
    n = round(end / interval)
    states, cost, now = [kr.solve(scene, [0.0]).states[0]], np.zeros(3, int), scene
    for k in range(1, n + 1):
        path = kr.solve(now, interval, method="extrap", tol=tol, step=first)
        cost += path.stats.evaluations, path.stats.steps, path.stats.rejected
        now = path.end
        if k % every == 0:
            states.append(np.array([k * interval, *path.states[-1, 1:]]))
    whole = replace(path, scene=scene, states=np.array(states))
    return Course(whole, *cost.tolist())


def frame_error(one, other):
    """Gives the thesis' L (6.1.3) at the times that both have: half the angle between the
    attitudes, 0 .. pi / 2 [rad]."""
    if not np.allclose(one.t, other.t, rtol=1e-9, atol=1e-9):
        raise ValueError("the two courses are not known at one set of times")
    return 0.5 * kr.attitude_error(one.path.q, other.path.q)


def largest(t, values, until):
    """Gives the largest value up to a time."""
    return float(values[t <= until * (1 + 1e-9)].max())


def exponent(t, values, begin):
    """Gives p of the power law t^p that the running maximum follows from `begin` on."""
    later = t >= begin
    return float(np.polyfit(np.log(t[later]), np.log(np.maximum.accumulate(values)[later]), 1)[0])
