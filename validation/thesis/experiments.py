"""The experiments in chapter 6 of the thesis."""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import product

import kreisel as kr
import numpy as np

from ..competitors import timing
from .trajectories import (
    FAILING,
    IMPROVED,
    SCENE,
    Trajectory,
    compute_frame_error,
    largest_until,
    solve_fixed_step,
    solve_theorem42,
    solve_truth,
    solve_with_restarts,
)

PERIOD, SUBSTEPS, FINE_TOL, FINE_FIRST = 5.0, 166, 2e-8, 1.5  # section 6.2.1
RK4_STEPS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)  # section 6.3


def time_grid(step, end):
    return np.arange(round(end / step) + 1) * step


class Comparison:
    """Trajectories that are compared with a reference; L holds their frame errors by name."""

    @property
    def t(self):
        return self.true.t

    @property
    def tops(self):
        """The four tops of the pictures; without a yellow one, the reference takes its place."""
        yellow = getattr(self, "yellow", self.true)
        return {"red": self.red, "blue": self.blue, "yellow": yellow, "green": self.green}

    def until(self, name, t):
        """Return the largest frame error of a trajectory up to the time `t`."""
        return largest_until(self.t, self.L[name], t)

    def find_errors(self, **courses):
        return {name: compute_frame_error(own, self.true) for name, own in courses.items()}


@dataclass(frozen=True)
class FourTops(Comparison):
    """The four tops of section 6.1.1: Bobenko-Suris (red, blue) and Extrap (yellow, green).

    The step size is eps1 for red and yellow, and eps2 for blue and green.
    """

    scene: kr.Scene
    eps1: float
    eps2: float
    red: Trajectory
    blue: Trajectory
    yellow: Trajectory
    green: Trajectory
    true: Trajectory
    improved: dict = field(default_factory=dict)

    @cached_property
    def L(self):
        return self.find_errors(BS=self.blue, Ext=self.green) | {
            "BS text": compute_frame_error(self.blue, self.red),
            "Ext text": compute_frame_error(self.green, self.yellow),
        }

    @cached_property
    def term(self):
        """The energy error of Bobenko-Suris by section 6.1.4, -I1 eps2/2 <a x m, p>, changed."""
        path = self.blue.path
        term = 0.5 * self.eps2 * (path.torque * path.m).sum(-1) / self.scene.body.moments[0]
        return -(term - term[0])


def run_four_tops(scene=SCENE, end=600.0, eps1=0.01, eps2=0.2):
    """Run experiment 6.1, by default with the parameters used in the thesis."""
    ratio = round(eps2 / eps1)
    return FourTops(
        scene,
        eps1,
        eps2,
        red=solve_theorem42(scene, eps1, end, ratio),
        blue=solve_theorem42(scene, eps2, end),
        yellow=solve_with_restarts(scene, eps1, end, every=ratio),
        green=solve_with_restarts(scene, eps2, end),
        true=solve_truth(scene, time_grid(eps2, end)),
        improved={name: solve_fixed_step(scene, name, eps2, end) for name in IMPROVED},
    )


def measure_loose_tolerances(tolerances=(1e-4, 1e-3), end=600.0):
    """Return the largest error of the method extrap in experiment 6.1 for several tolerances."""
    true = solve_truth(SCENE, time_grid(0.2, end))
    runs = {tol: solve_with_restarts(SCENE, 0.2, end, tol) for tol in tolerances}
    return {tol: float(compute_frame_error(run, true).max()) for tol, run in runs.items()}


def run_failing():
    """Run the failing experiment of section 6.1.5, with g = 10 and m = (5, 0, 0)."""
    return run_four_tops(FAILING, 20.0)


def measure_growth(end=20.0, eps=0.2):
    """Return the errors of the Bobenko-Suris method for several values of gravity and momentum.

    A row has the gravity, the factor of the momentum, and the largest errors of energy and frame.
    """
    rows = []
    for gravity, factor in product((0.5, 1.0, 2.0, 5.0, 10.0), (0.5, 1.0, 2.0, 4.0)):
        scene = SCENE.replace(gravity=gravity, momentum=factor * np.array(SCENE.momentum))
        blue, true = solve_theorem42(scene, eps, end), solve_truth(scene, time_grid(eps, end))
        errors = blue.energy_error, compute_frame_error(blue, true)
        rows.append((gravity, factor, *(np.abs(error).max() for error in errors)))
    return np.array(rows)


@dataclass(frozen=True)
class EqualTime(Comparison):
    """Experiment 6.2, in which states are compared after every five units of time."""

    red: Trajectory
    blue: Trajectory
    green: Trajectory
    equal: Trajectory
    true: Trajectory
    # run times per five units of time [s]: Bobenko-Suris with 166 sub-steps, Extrap
    seconds: dict
    substeps: int  # sub-steps that Bobenko-Suris makes in Extrap's run time on this machine
    improved: dict = field(default_factory=dict)

    @cached_property
    def L(self):
        errors = self.find_errors(BS=self.blue, Ext=self.green, equal=self.equal, **self.improved)
        return errors | self.find_errors(**{"BS 0.01": self.red})


def solve_in_periods(substeps, end, method=None):
    """Integrate experiment 6.2 by a method of kreisel, or by the map of theorem 4.2 by default."""
    step = PERIOD / substeps
    if method:
        return solve_fixed_step(SCENE, method, step, end, substeps)
    return solve_theorem42(SCENE, step, end, substeps)


def time_period(green, rounds=9, count=40):
    """Return the run times [s] of bobenko_suris and extrap over five units of time."""
    indices = np.linspace(0, len(green.path) - 2, count).astype(int)
    starts = [green.path.scene_at(i) for i in indices]
    bs = {"method": "bobenko_suris", "step": PERIOD / SUBSTEPS}
    ext = {"method": "extrap", "tol": FINE_TOL, "step": FINE_FIRST}

    def of_all(t, words):
        return lambda: [kr.solve(scene, [t], **words) for scene in starts]

    calls = [of_all(t, words) for words in (bs, ext) for t in (PERIOD, 0.0)]
    best = [seconds / count for seconds in timing.best_times(calls, rounds)]
    return {"BS": best[0] - best[1], "Ext": best[2] - best[3]}


def run_equal_time(end=3200.0):
    green = solve_with_restarts(SCENE, PERIOD, end, FINE_TOL, FINE_FIRST)
    seconds = time_period(green)
    substeps = max(1, round(SUBSTEPS * seconds["Ext"] / seconds["BS"]))
    return EqualTime(
        red=solve_in_periods(round(PERIOD / 0.01), end),
        blue=solve_in_periods(SUBSTEPS, end),
        green=green,
        equal=solve_in_periods(substeps, end),
        true=solve_truth(SCENE, time_grid(PERIOD, end)),
        seconds=seconds,
        substeps=substeps,
        improved={name: solve_in_periods(SUBSTEPS, end, name) for name in IMPROVED},
    )


def find_crossings(equal_time, tolerances=(2e-8, 1e-7, 2e-7, 5e-7, 1e-6)):
    """Return when the method extrap becomes less accurate than Bobenko-Suris.

    A row has the tolerance of extrap, the time or None, and the final error of extrap.
    """
    end, rows = equal_time.t[-1], []
    for tol in tolerances:
        green = equal_time.green
        if tol != FINE_TOL:
            green = solve_with_restarts(SCENE, PERIOD, end, tol, FINE_FIRST)
        error = compute_frame_error(green, equal_time.true)
        indices = np.flatnonzero(error > equal_time.L["BS"])
        crossing = float(equal_time.t[indices[0]]) if indices.size else None
        rows.append((tol, crossing, float(error[-1])))
    return rows


@dataclass(frozen=True)
class EqualEvaluations(Comparison):
    """Experiment 6.3, in which two methods evaluate the torque equally often."""

    rk4: Trajectory
    bs: Trajectory
    true: Trajectory

    @cached_property
    def L(self):
        return self.find_errors(rk4=self.rk4, BS=self.bs)


def run_equal_evaluations(end=30.0):
    """Run experiment 6.3 of the thesis for several step sizes."""
    return {
        h: EqualEvaluations(
            solve_fixed_step(SCENE, "rk4", h, end),
            solve_theorem42(SCENE, h / 4, end, 4),
            solve_truth(SCENE, time_grid(h, end)),
        )
        for h in RK4_STEPS
    }


def measure_first_steps(equal_time, first=(0.15, 0.5, 1.5, 5.0), end=1000.0):
    """Return the largest error of extrap in thesis experiment 6.2 for each initial step size."""
    true = solve_truth(SCENE, equal_time.t[equal_time.t <= end])
    runs = {h: solve_with_restarts(SCENE, PERIOD, end, FINE_TOL, h) for h in first}
    return {h: float(compute_frame_error(run, true).max()) for h, run in runs.items()}
