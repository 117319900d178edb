"""The search for the step of a method with a wanted error."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from .._core import Work, values
from .._model.parameters import refuse_disturbances
from .._model.scene import Scene
from .._options.methods import methods
from .._options.options import Options, check_resolvable_horizon, get_member_by_flat_index
from .._options.plan import StepChoice
from .._results import calls
from .._results import path as paths
from .._results.calls import ROUNDING, SERIES, STATUSES, Stats, compute_states_at_times
from .._results.path import Path
from .._results.requests import report_final_time
from .._results.results import Error, Interrupted
from .._utils.arguments import Array
from .._utils.processes import Progress
from .._utils.quantity_attributes import MethodName
from ..quaternion import attitude_error

Listener = Progress | Work | None  # a function that receives progress, or a Work to stop a run
# For each method: the constant c, and the cost of a step relative to that of a kick and a drift.
_Constants = dict[MethodName, tuple[float, float]]
_SYMMETRIC: _Constants = {
    "takahashi_imada4": (0.165, 1.25),
    "blanes_moan6": (0.04, 15.0),
    "kahan_li8": (0.122, 17.0),
}
_GENERAL: _Constants = {"takahashi_imada4": (0.10, 3.2), "kahan_li8": (0.10, 17.0)}

_SHORTER = 1.05  # safety factor of the number of steps: shorter steps cost less than another run
_AIM = 0.4  # the number of steps is chosen for an error of this fraction of the target
_ENOUGH = 0.8  # accepted fraction of the target: between the checked times the error can be larger
_TOO_LARGE = {"ERR_STEP_SIZE", "ERR_CONVERGENCE"}  # statuses that mean that the step is too large
_UNLIKE = 0.1  # an error above this does not predict the error with shorter steps [rad]
_MIN_CHECKS = 128  # the minimal number of times at which the error is computed
_CHECKS_PER_RADIAN = 4  # the number of these times per radian that the top turns
_MAX_CHECKS = 1 << 13  # the maximal number of these times, and of requested times added to them
_FEW = 32  # with fewer steps, the error is also computed inside the steps, where it can be larger
_REGULAR = 30.0  # bound on a change's growth in a regular motion, per radian that the top turns
_BUDGET = 64  # limit of the steps of all runs, as a multiple of the first guess or of a minimum
# The search fails after this number of runs that did not halve the error. After each such run the
# step is halved, because this changes the rounding errors.
_STALLS = 3


class _StepSearch:
    """A search for the cheapest method that meets an error tolerance, and for its step size."""

    def __init__(
        self, scene: Scene, times: Array, target: float, max_steps: int, progress: Listener
    ) -> None:
        hint = "use method='taylor', which needs no step"
        refuse_disturbances(scene, "method='geometric' does not support tops", reason=hint)
        self.scene, self.times, self.target = scene, times, target
        self.max_steps, self.progress = max_steps, progress
        self.end = float(times[-1])
        self.spent, self.cost = Stats(0, 0, 0, 0), 0  # cost of all runs; of the last run
        body = scene.body
        has_axial_rotor = body.kind not in ("general", "gyrostat")
        self.is_drift_exact = body.is_symmetric and (not any(body.rotor) or has_axial_rotor)
        self.rate, self.weight = self._compute_rate_and_error_weight()
        self.angle = self.rate * abs(self.end)
        _, steps = self._choose_cheapest_method(1.0)
        checks, series = self._choose_times_of_checks(steps), replace(SERIES, max_steps=max_steps)
        result, growth = calls.estimate_rounding_growth(
            scene, checks, max_steps=max_steps, progress=progress
        )
        paths.build_path_or_raise(scene, series, result)
        self.conditioning = ROUNDING * growth
        # The closed form is the reference if its rounding errors are far below the tolerance.
        is_precise = calls.ROUNDINGS * self.conditioning <= target
        has_form = is_precise and calls.has_cheap_exact_form(scene)
        self.reference = calls.CLOSED_FORM if has_form else calls.LONGER_SERIES
        more = growth / (_REGULAR * (1.0 + self.angle))  # growth relative to a regular motion
        self.method, self.first = self._choose_cheapest_method(min(max(1.0, more), 1.0 / ROUNDING))
        self.order = methods[self.method].order
        self.budget = _BUDGET * max(self.first, _MIN_CHECKS, math.ceil(self.angle))

    def _compute_rate_and_error_weight(self) -> tuple[float, float]:
        """Return the rate r of the top [T^-1], and the weight w of a method's error [T^-1]."""
        scene, body = self.scene, self.scene.body
        lever = body.mass * abs(scene.gravity) * math.hypot(*body.com)
        kinetic, potential = (
            float(values(name, scene._block, scene._start_state)[0])
            for name in ("kinetic", "potential")
        )
        moment = sorted(body.moments)[1 if self.is_drift_exact else 2]
        # The potential energy above its minimum, which rounding can make negative for a hanging top
        energy = max(0.0, potential + lever)
        if self.is_drift_exact:  # the error is proportional to the torque
            rate = math.sqrt((math.hypot(*scene.momentum) / moment) ** 2 + 2.0 * energy / moment)
            return rate, lever / moment / rate if rate else 0.0
        rate = math.sqrt(2.0 * (kinetic + energy) / moment) + math.hypot(*body.rotor) / moment
        return rate, rate

    def _choose_cheapest_method(self, growth: float) -> tuple[MethodName, int]:
        """Return the cheapest method and the number of steps that it requires.

        `growth` is the growth of small perturbations, divided by their growth in a regular motion.
        """
        prices, t = {}, abs(self.end)
        for name, (c, price) in (_SYMMETRIC if self.is_drift_exact else _GENERAL).items():
            part = self.weight * t * growth / self.target
            steps = _SHORTER * c * self.rate * t * part ** (1.0 / methods[name].order)
            prices[name] = price * max(1.0, steps), steps
        method = min(prices, key=lambda name: prices[name][0])
        return method, math.ceil(max(1.0, prices[method][1]))

    def _choose_times_of_checks(self, steps: int) -> Array:
        """Return the times at which the error of a run is evaluated.

        The result includes up to 2**13 of the requested times, and the end times of some steps. If
        the run has only a few steps, times between the ends of these steps are added.
        """
        count = min(max(_MIN_CHECKS, _CHECKS_PER_RADIAN * self.angle), _MAX_CHECKS)
        each = max(1, math.ceil(steps / count))
        ends = np.append(np.arange(each, steps, each), steps)
        parts = min(3, math.ceil(_FEW / steps))
        stages = np.concatenate([ends - part / parts for part in range(parts)])
        requested = self.times[:: max(1, -(-self.times.size // _MAX_CHECKS))]
        return self._merge_times(self.end * stages / steps, requested)

    def _merge_times(self, *times: Array) -> Array:
        return math.copysign(1.0, self.end) * np.unique(np.abs(np.concatenate(times)))

    def _measure_error(self, steps: int) -> tuple[Array, float] | None:
        """Integrate with the given number of steps, and return the states and their error.

        The error is the largest angle [rad] between the attitude and the reference solution. If the
        step size is too large for the method, the result is None.
        """
        checks = self._choose_times_of_checks(steps)
        every, evaluations = self._merge_times(checks, self.times), self.spent.evaluations
        states = self._compute_states(Options(self.method, abs(self.end / steps)), every)
        self.cost = self.spent.evaluations - evaluations
        if states is None:
            return None
        truth = self._compute_states(self.reference, checks)
        assert truth is not None
        rows, requested = (
            states[np.searchsorted(np.abs(every), np.abs(t))] for t in (checks, self.times)
        )
        return requested, float(attitude_error(rows[:, 1:5], truth[:, 1:5]).max())

    def _compute_states(self, options: Options, times: Array) -> Array | None:
        """Return the states at `times`, or None if the step size is too large for the method."""
        options = replace(options, max_steps=self.max_steps)
        result = compute_states_at_times(self.scene, options, times, self.progress)
        status, states, _, counts, _ = result
        self.spent = Stats(*(a + b for a, b in zip(self.spent, counts, strict=True)))
        if status in _TOO_LARGE:
            return None
        if status != "OK":
            path = paths.build_path_from_core_result(self.scene, options, result)
            text = f"{options.method} reached t = {states[-1, 0]:g} of {self.end:g}"
            raise paths.make_stop_exception(status, replace(path, stats=self.spent), text)
        return states

    def find_path(self) -> Path:
        """Return a path with a small error. Raises ValueError if no run is accurate enough."""
        reason = "the rounding of the scene alone exceeds it"
        steps, step_count, least, stalls = self.first, 0, math.inf, 0
        is_possible = self.conditioning <= self.target
        while is_possible and stalls < _STALLS:
            step_count += steps
            if step_count > self.budget:
                reason = f"the search is limited to {self.budget} steps, which did not suffice"
                break
            run = self._measure_error(steps)
            if run and run[1] <= _ENOUGH * self.target:
                choice = StepChoice(
                    method=self.method,
                    step=self.end / steps,
                    order=self.order,
                    target=self.target,
                    error=run[1],
                    conditioning=self.conditioning,
                    run=self.cost,
                    trials=self.spent.evaluations - self.cost,
                    budget=self.budget,
                )
                options, is_back = Options(self.method, abs(choice.step)), choice.step < 0.0
                return Path(self.scene, run[0], self.spent, options, is_back, _choice=choice)
            error = run[1] if run else math.inf
            is_stalled = 0.5 * least < error < _UNLIKE
            stalls, least = stalls + is_stalled, min(least, error)
            more = 4.0
            if is_stalled:
                more = 2.0
            elif error < _UNLIKE:  # the error of a run with more steps can be predicted
                more = (error / (_AIM * self.target)) ** (1.0 / self.order)
                more = min(4.0, max(1.1, more))
            steps = math.ceil(steps * more)
            reason = f"rounding errors reach {least:.1e} rad, and finer steps add more"
        raise ValueError(
            f"error = {self.target!r} cannot be met at t = {self.end!r}: {reason}; a rounding "
            "error (2**-53) of the state, in internal units, changes the attitude by about "
            f"{self.conditioning:.1e} rad. Request a larger error or a shorter time"
        )


def solve_with_step_search(
    scene: Scene, options: Options, times: Array, progress: Progress | None
) -> Path:
    """Solve a single scene with method='geometric', and return its path."""
    path = report_final_time(_find_path(scene, options, times, progress), progress)
    return path if options.want is None else path.only(options.want)


def _find_path(scene: Scene, options: Options, times: Array, progress: Listener) -> Path:
    """Solve a single scene with method='geometric', recording all states."""
    if not times.any():  # only the initial state is requested
        start = Options("strang", 1.0, requested_method="strang").with_heading(scene)
        result = compute_states_at_times(scene, start, times)
        return paths.build_path_or_raise(scene, start, result)
    assert options.error is not None
    check_resolvable_horizon(scene, float(times[-1]), None)
    return _StepSearch(scene, times, options.error, options.max_steps, progress).find_path()


def _search_steps_of_slice(part: calls.Slice) -> None:
    rows, options, tops, begin, end, t, work = part
    for i in range(end - begin):
        if work is not None and work.stopped:
            break
        scene, times = get_member_by_flat_index(tops, begin + i), t[i] if t.ndim == 2 else t
        path, name = None, "OK"
        try:
            path = _find_path(scene, options, times, work)
        except Interrupted:  # only a trial run was interrupted, whose states are not a result
            if work is None:
                raise
            work.stop()
            break
        except Error as error:
            path, name, rows.messages[i] = error.path, error.status, str(error)
        except ValueError as error:  # no step meets the error
            name, rows.messages[i] = "ERR_CONVERGENCE", str(error)
        _store_path(rows, i, path, times, name)
        if work is not None:
            work.did(1)


def _store_path(
    rows: calls.EnsembleBuffers, i: int, path: Path | None, times: Array, status: str
) -> None:
    """Store the path of the i-th top in its buffers, with NaN for all times that it lacks.

    The path of a failed search may have other times, and end with another state.
    """
    indices = np.empty(0, dtype=np.intp)
    if path is not None and len(path):
        indices = np.minimum(np.searchsorted(np.abs(path.t), np.abs(times)), len(path) - 1)
        indices = indices[np.logical_and.accumulate(path.t[indices] == times)]
    count = indices.size
    rows.status[i], rows.done[i] = STATUSES.index(status), count
    recorded = dict(rows.columns)
    if rows.states is not None:
        recorded["states"] = rows.states
    for name, column in recorded.items():
        column[i] = np.nan
        if path is not None:
            column[i, :count] = getattr(path, name)[indices]
    if rows.states is not None:
        rows.states[i, :, 0] = times
    if path is None:
        return
    rows.counts[i], rows.reached[i] = path.stats, path.reached
    if status != "OK" and len(path):
        rows.last[i] = np.array([path.states[-1], np.zeros(8)])
    if path._choice is not None:
        rows.chosen[i] = path._choice


STEP_SEARCH = calls.SliceRunner(_search_steps_of_slice)
