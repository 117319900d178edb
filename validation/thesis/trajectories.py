"""Computation of trajectories for the experiments in the thesis."""

from dataclasses import dataclass, replace

import kreisel as kr
import numpy as np

# The half sides of the cuboid, and the centre of its lower face.
HALF, PIVOT = (0.8, 0.8, 1.0), (0.0, 0.0, -1.0)
SCENE = kr.Scene(kr.Body.cuboid(HALF, PIVOT), momentum=(0.172, -1.862, 1.46), gravity=1.0)  # 6.1.1
FAILING = SCENE.replace(momentum=(5.0, 0.0, 0.0), gravity=10.0)  # section 6.1.5
TOL, FIRST = 1e-5, 0.1  # tolerance and first step of Extrap (5.8.1)
# Methods added to the plots of the thesis, if this build has them.
IMPROVED = [
    name for name in ("bobenko_suris", "bobenko_suris4", "takahashi_imada4") if name in kr.methods
]


@dataclass(frozen=True)
class Trajectory:
    """The states of a top at several times, in the notation of the thesis."""

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
        """The angular momentum <m, a> about the symmetry axis."""
        return self.path.axial_momentum

    @property
    def vertical_momentum(self):
        """The vertical angular momentum <m, e3>, which is <m, p> / gravity in the thesis."""
        return self.path.vertical_momentum

    @property
    def axial_error(self):
        return self.axial_momentum - self.axial_momentum[0]


def solve_truth(scene, times):
    """Compute a trajectory from a closed form if one exists, or else with the tolerance 1e-13."""
    return Trajectory(kr.solve(scene, times, tol=1e-13), 0)


def solve_fixed_step(scene, method, step, end, every=1):
    """Integrate with a fixed step size, and record the state once per `every` steps."""
    path = kr.solve(scene, end, method=method, step=step, every=every)
    return Trajectory(path, path.stats.evaluations, path.stats.steps)


def solve_theorem42(scene, step, end, every=1):
    """Compute a trajectory with the Bobenko-Suris method as described in the thesis.

    The map rotates the top about its axis by 2 atan(h c / 2 I3) - 2 atan(h c / 2 I1) per step.
    kreisel replaces the first term by h c / I3, which makes this rotation exact.
    """
    course = solve_fixed_step(scene, "bobenko_suris", step, end, every)
    path = course.path
    rate = step * course.axial_momentum[0] / scene.body.moments[2]
    half = 0.5 * (2.0 * np.arctan(0.5 * rate) - rate) * every * np.arange(len(path))
    twist = np.cos(half), 0.0, 0.0, np.sin(half)
    states = path.states.copy()
    states[:, 1:5] = np.stack(kr.quaternion.multiply(path.q.T, twist), axis=-1)
    return replace(course, path=replace(path, states=states))


def solve_with_restarts(scene, interval, end, tol=TOL, first=FIRST, every=1):
    """Integrate by the method extrap, and restart it after each interval as in the thesis.

    After each restart, the initial step size is used again. `every` is the number of intervals
    between two recorded states.
    """
    n = round(end / interval)
    run = kr.start(scene, method="extrap", tol=tol, step=first)
    start, cost = run.to([0.0]), (0, 0, 0)
    states = [start.states[0]]
    for k in range(1, n + 1):
        path = run.to([k * interval])
        stats, state = path.stats, path.states[-1]
        cost = cost[0] + stats.evaluations, cost[1] + stats.steps, cost[2] + stats.rejected
        run.reset(momentum=state[5:], attitude=state[1:5])
        if k % every == 0:
            states.append(state)
    return Trajectory(replace(start, states=np.array(states)), *cost)


def compute_frame_error(one, other):
    """Return half the angle [rad] between two attitudes, which the thesis denotes by L."""
    if not np.allclose(one.t, other.t, rtol=1e-9, atol=1e-9):
        raise ValueError("the two trajectories are given at different times")
    return 0.5 * kr.attitude_error(one.path.q, other.path.q)


def largest_until(t, values, end):
    """Return the largest of `values` up to the time `end`."""
    return float(values[t <= end * (1 + 1e-9)].max())


def fit_exponent(t, values, begin):
    """Fit a power law t^p to the running maximum after the time `begin`, and return p."""
    later = t >= begin
    return float(np.polyfit(np.log(t[later]), np.log(np.maximum.accumulate(values)[later]), 1)[0])
