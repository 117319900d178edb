"""Integrations of one top with all methods of kreisel and with other integrators.

All integrators have the same interface. The method `solve()` integrates the equations of motion and
returns the final attitude. `attitude()` returns the final attitude with respect to the principal
axes. `record(times)` returns the attitudes and momenta at `times`. `steps` is the number of steps.
`evaluations` counts evaluations of the right-hand side or of the torque. `setup` is the preparation
time in seconds, or None. If a method does not count its steps or evaluations, the corresponding
attribute is None.
"""

import math
import time
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import cache, partial

import heyoka as hy
import kreisel as kr
import numpy as np
from scipy.integrate import solve_ivp

from ..references import equations
from ..references.problems import rotate_to_space
from .machine import is_of_gsl

EPS = np.finfo(float).eps
DOP853_STAGES = 12


@dataclass(frozen=True)
class Setting:
    """The accuracy setting of a run: a step size, a tolerance, or neither for a closed form."""

    step: float = None
    tol: float = None

    @property
    def keywords(self):
        """The step size or tolerance as keyword arguments of kr.solve."""
        return {word: value for word, value in vars(self).items() if value is not None}

    def __str__(self):
        if self.step:
            return f"step {self.step:.3g}"
        return f"tol {self.tol:.0e}" if self.tol else "closed form"


class KreiselRun:
    setup = None

    def __init__(self, method, problem, end, setting):
        self.problem, self.scene, self.end = problem, problem.to_scene(), end
        self.words = {"method": method} | setting.keywords

    def solve(self):
        path = kr.solve(self.scene, t=self.end, **self.words)
        self.steps, self.evaluations = path.stats.steps, path.stats.evaluations
        return path.q[-1]

    def attitude(self):
        return self.problem.to_principal_axes(self.solve())

    def record(self, times):
        path = kr.solve(self.scene, t=times, **self.words)
        return self.problem.to_principal_axes(path.q), path.m


class HeyokaRun:
    """An integration by heyoka, with the parameters of the body compiled as constants."""

    evaluations = None

    def __init__(self, problem, end, setting, **options):
        # measured set-up times must include the compilation
        hy.llvm_state.set_diskcache_enabled(False)
        hy.llvm_state.clear_memcache()
        begin = time.perf_counter()
        system, self.start = equations.build_system(problem)
        self.top = hy.taylor_adaptive(system, self.start, tol=setting.tol, **options)
        self.setup = time.perf_counter() - begin
        self.inertia, self.end = np.array(problem.inertia), end

    def restart(self, problem):
        """Return a run that reuses the compiled integrator for another initial state."""
        run = copy(self)
        run.start = equations.round_to(equations.start_state(problem), float)
        return run

    def rewind(self):
        self.top.time = 0.0
        self.top.state[:] = self.start

    def solve(self):
        self.rewind()
        outcome, _, _, self.steps, *_ = self.top.propagate_until(self.end)
        if outcome != hy.taylor_outcome.time_limit:
            raise ArithmeticError(f"heyoka stopped: {outcome}")
        return self.top.state[:4]

    attitude = solve

    def record(self, times):
        self.rewind()
        states = self.top.propagate_grid(times)[5]
        return states[:, :4], rotate_to_space(states[:, :4], states[:, 4:] * self.inertia)


class ScipyRun:
    """An integration by SciPy's DOP853, with the equations of motion written in Python."""

    setup = None

    def __init__(self, problem, end, setting):
        self.start = np.array([float(x) for x in equations.start_state(problem)])
        self.inertia, self.end, self.tol = np.array(problem.inertia), end, setting.tol
        (self.J1, self.J2, self.J3), (self.l1, self.l2, self.l3) = problem.inertia, problem.lever
        self.decay = np.array(problem.damping) / self.inertia
        self.system = self.rates_with_damping if problem.is_damped else self.rates

    def rates(self, t, state):
        w, x, y, z, a, b, c = state.tolist()
        J1, J2, J3, l1, l2, l3 = self.J1, self.J2, self.J3, self.l1, self.l2, self.l3
        u1, u2, u3 = 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z
        return [
            (-x * a - y * b - z * c) / 2,
            (w * a + y * c - z * b) / 2,
            (w * b + z * a - x * c) / 2,
            (w * c + x * b - y * a) / 2,
            ((J2 - J3) * b * c + u2 * l3 - u3 * l2) / J1,
            ((J3 - J1) * c * a + u3 * l1 - u1 * l3) / J2,
            ((J1 - J2) * a * b + u1 * l2 - u2 * l1) / J3,
        ]

    def rates_with_damping(self, t, state):
        rates = np.array(self.rates(t, state))
        rates[4:] -= self.decay * state[4:]
        return rates

    def integrate(self, times):
        words = {"rtol": self.tol, "atol": self.tol}
        run = solve_ivp(self.system, (0.0, self.end), self.start, "DOP853", times, **words)
        if not run.success:
            raise ArithmeticError(run.message)
        self.steps, self.evaluations = None, run.nfev
        return run.y.T

    def solve(self):
        return self.integrate([self.end])[-1, :4]

    attitude = solve

    def record(self, times):
        states = self.integrate(times)
        return states[:, :4], rotate_to_space(states[:, :4], states[:, 4:] * self.inertia)


@cache
def compile_general_heyoka(tol, coefficients):
    """Compile a heyoka integrator for all tops, which is slower than one for a single top."""
    system = equations.build_general_system(float, coefficients)
    words = {"pars": np.zeros(coefficients), "tol": tol, "compact_mode": True}
    return hy.taylor_adaptive(system, np.zeros(7), **words)


def series_order(tol):
    """Return the order of heyoka's Taylor series for a given tolerance."""
    return math.ceil(1 - math.log(tol) / 2)


def record_with_heyoka(problem, times, tol):
    coefficients = equations.round_to(equations.compute_coefficients(problem), float)
    top = compile_general_heyoka(tol, len(coefficients))
    top.pars[:] = coefficients
    top.state[:] = equations.round_to(equations.start_state(problem), float)
    top.time = 0.0
    outcome, _, _, steps, _, states = top.propagate_grid(times)
    if outcome != hy.taylor_outcome.time_limit or not np.isfinite(states).all():
        raise ArithmeticError(f"heyoka stopped: {outcome}")
    momenta = rotate_to_space(states[:, :4], states[:, 4:] * np.array(problem.inertia))
    return states[:, :4], momenta, steps, steps * series_order(tol)


def record_with_scipy(problem, times, tol):
    run = ScipyRun(problem, times[-1], Setting(tol=tol))
    q, m = run.record(times)
    return q, m, run.evaluations // DOP853_STAGES, run.evaluations


# (problem, times, tol) -> attitudes, momenta, steps, evaluations; for many tops, without timing
RECORDERS = {"heyoka": record_with_heyoka, "scipy_dop853": record_with_scipy}


@dataclass(frozen=True)
class Contender:
    name: str
    text: str
    steered: str  # control: "step", "tol" or ""
    make: Callable  # (problem, end, setting) -> run
    tightest: float = None  # tightest tolerance
    order: object = "varies"
    peer: bool = False  # for comparison only, including GSL within kreisel
    cost: float = 1.0  # duration of an evaluation, relative to one in C


def control_of(method):
    """Return what controls the accuracy of a method: "step", "tol", or "" for a closed form."""
    return "" if method.exact else "tol" if method.adaptive else "step"


def choose_setting(method, step, tol):
    """Return the setting that a method needs: a step size, a tolerance, or neither."""
    return {"step": Setting(step=step), "tol": Setting(tol=tol)}.get(control_of(method), Setting())


def list_contenders(problem):
    """Yield all methods of kreisel that support a given top."""
    scene = problem.to_scene()
    for name, method in kr.methods.items():
        if method.suits(scene):
            factory = partial(KreiselRun, name)
            yield Contender(name, method.text, control_of(method), factory, peer=is_of_gsl(name))


SERIES = "Taylor series, compiled for each top; double precision"
RUNGE_KUTTA = "Runge-Kutta of order 8 in Python, as most begin"
PEERS = (
    Contender("heyoka", SERIES, "tol", HeyokaRun, EPS, peer=True),
    Contender("scipy_dop853", RUNGE_KUTTA, "tol", ScipyRun, 3e-14, 8, peer=True, cost=64.0),
)
