"""The search for the step of a method with a wanted error."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .._core import Work, values
from .._model.parameters import refuse_disturbances
from .._model.scene import Scene
from .._options.methods import methods
from .._options.options import Options, check_resolvable_horizon, get_member_by_flat_index
from .._options.plan import StepChoice
from .._results.buffers import STATUSES, EnsembleBuffers, Slice, SliceRunner
from .._results.error import (
    CLOSED_FORM,
    LONGER_SERIES,
    ROUNDING,
    ROUNDINGS,
    SERIES,
    compute_states_at_times,
    estimate_rounding_growth,
    has_cheap_exact_form,
)
from .._results.path import (
    Error,
    Interrupted,
    Path,
    build_path_from_core_result,
    build_path_or_raise,
    make_stop_exception,
)
from .._results.quantities import Stats
from .._results.requests import report_final_time
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


class StepSearch:
    """A search for the cheapest method that meets an error tolerance, and for its step size."""

    def __init__(
        self,
        scene: Scene,
        times: Array,
        target: float,
        max_steps: int,
        progress: Listener,
    ) -> None:
        hint = "use method='taylor', which needs no step"
        refuse_disturbances(scene, "method='geometric' does not support tops", reason=hint)
        self.scene, self.times, self.target = scene, times, target
        self.max_steps, self.progress = max_steps, progress
        self.end = float(times[-1])
        self.spent, self.cost = Stats(0, 0, 0, 0), 0  # cost of all runs; of the last run
        self.rate, self.weight = _compute_top_rate_and_error_weight(scene)
        self.angle = self.rate * abs(self.end)
        self.sampled_times = times[:: max(1, -(-times.size // _MAX_CHECKS))]
        _, steps = self.choose_cheapest_method(1.0)
        times_checked = self.error_check_times(math.ceil(steps))
        result, growth = estimate_rounding_growth(
            scene, times_checked, max_steps=max_steps, progress=progress
        )
        build_path_or_raise(scene, replace(SERIES, max_steps=max_steps), result)
        self.conditioning = ROUNDING * growth
        self.reference_options = self.choose_reference_options()
        more = growth / (_REGULAR * (1.0 + self.angle))  # growth relative to a regular motion
        self.method, steps = self.choose_cheapest_method(min(max(1.0, more), 1.0 / ROUNDING))
        self.order, self.first = methods[self.method].order, math.ceil(steps)
        self.budget = _BUDGET * max(self.first, _MIN_CHECKS, math.ceil(self.angle))

    def choose_cheapest_method(self, growth: float) -> tuple[MethodName, float]:
        """Return the cheapest method and the number of steps that it requires.

        `growth` is the growth of small perturbations, divided by their growth in a regular motion.
        """
        prices, t = {}, abs(self.end)
        constants = _SYMMETRIC if _is_drift_exact(self.scene) else _GENERAL
        for name, (c, price) in constants.items():
            part = self.weight * t * growth / self.target
            steps = _SHORTER * c * self.rate * t * part ** (1.0 / methods[name].order)
            prices[name] = price * max(1.0, steps), steps
        method = min(prices, key=lambda name: prices[name][0])
        return method, max(1.0, prices[method][1])

    def error_check_times(self, steps: int) -> Array:
        """Return the times at which the error of a run is evaluated.

        The result includes up to 2**13 of the requested times, and the end times of some steps. If
        the run has only a few steps, times between the ends of these steps are added.
        """
        check_count = min(max(_MIN_CHECKS, _CHECKS_PER_RADIAN * self.angle), _MAX_CHECKS)
        each = max(1, math.ceil(steps / check_count))
        ends = np.append(np.arange(each, steps, each), steps)
        parts = min(3, math.ceil(_FEW / steps))
        stages = [ends - part / parts for part in range(parts)]
        return self.merge_sorted_times(
            self.end * np.concatenate(stages) / steps, self.sampled_times
        )

    def merge_sorted_times(self, a: Array, b: Array) -> Array:
        """Return the union of two arrays of times, ordered from the start to the end of the run."""
        return math.copysign(1.0, self.end) * np.unique(np.abs(np.concatenate([a, b])))

    def choose_reference_options(self) -> Options:
        """Return the options for computing the reference solution.

        The reference is the closed-form solution, if it exists and its rounding errors are far
        below the tolerance. Otherwise, the reference is a Taylor series that is computed with 20
        digits.
        """
        is_precise = ROUNDINGS * self.conditioning <= self.target
        return CLOSED_FORM if is_precise and has_cheap_exact_form(self.scene) else LONGER_SERIES

    def integrate_and_measure_error(self, steps: int) -> tuple[Array, float] | None:
        """Integrate with the given number of steps, and return the states and their error.

        The error is the largest angle [rad] between the attitude and the reference solution. If the
        step size is too large for the method, the result is None.
        """
        error_check_times = self.error_check_times(steps)
        all_times = self.merge_sorted_times(error_check_times, self.times)
        evaluations = self.spent.evaluations
        states = self.compute_states(Options(self.method, abs(self.end / steps)), all_times)
        self.cost = self.spent.evaluations - evaluations
        if states is None:
            return None
        truth = self.compute_states(self.reference_options, error_check_times)
        assert truth is not None
        check_indices, requested_indices = (
            np.searchsorted(np.abs(all_times), np.abs(t)) for t in (error_check_times, self.times)
        )
        return states[requested_indices], float(
            attitude_error(states[check_indices, 1:5], truth[:, 1:5]).max()
        )

    def compute_states(self, options: Options, times: Array) -> Array | None:
        """Return the states at `times`, or None if the step size is too large for the method."""
        run_options = replace(options, max_steps=self.max_steps)
        result = compute_states_at_times(self.scene, run_options, times, self.progress)
        status, states, _, counts, _ = result
        self.spent = Stats(*(a + b for a, b in zip(self.spent, counts, strict=True)))
        if status in _TOO_LARGE:
            return None
        if status != "OK":
            path = replace(
                build_path_from_core_result(self.scene, run_options, result), stats=self.spent
            )
            text = f"{options.method} reached t = {states[-1, 0]:g} of {self.end:g}"
            raise make_stop_exception(status, path, text)
        return states

    def predict_needed_step_count(self, steps: int, error: float) -> int:
        """Return a number of steps for which the predicted error is sufficiently small.

        `error` is the measured error of a run that takes `steps` steps.
        """
        more = (error / (_AIM * self.target)) ** (1.0 / self.order)
        more = min(4.0, max(1.1, more)) if error < _UNLIKE else 4.0
        return math.ceil(steps * more)

    def make_unmet_error_exception(self, reason: str) -> ValueError:
        return ValueError(
            f"error = {self.target!r} cannot be met at t = {self.end!r}: {reason}; a rounding "
            "error (2**-53) of the state, in internal units, changes the attitude by about "
            f"{self.conditioning:.1e} rad. Request a larger error or a shorter time"
        )


def solve_with_step_search(
    scene: Scene, options: Options, times: Array, progress: Progress | None
) -> Path:
    """Solve a single scene with method='geometric', and return its path."""
    path = report_final_time(_find_path_by_step_search(scene, options, times, progress), progress)
    return path if options.want is None else path.only(options.want)


def _find_path_by_step_search(
    scene: Scene, options: Options, times: Array, progress: Listener
) -> Path:
    """Solve a single scene with method='geometric', recording all states."""
    if not times.any():  # only the initial state is requested
        start_options = Options("strang", 1.0, requested_method="strang").with_heading(scene)
        return build_path_or_raise(
            scene, start_options, compute_states_at_times(scene, start_options, times)
        )
    assert options.error is not None
    check_resolvable_horizon(scene, float(times[-1]), None)
    return search_path_within_error(scene, times, options.error, options.max_steps, progress)


def search_path_within_error(
    scene: Scene,
    times: Array,
    target: float,
    max_steps: int,
    progress: Listener = None,
) -> Path:
    """Return a path whose attitude error stays below `target`.

    Raises ValueError if no run is sufficiently accurate.
    """
    search = StepSearch(scene, times, target, max_steps, progress)
    if search.conditioning > target:
        raise search.make_unmet_error_exception("the rounding of the scene alone exceeds it")
    steps, step_count, least, stalls = search.first, 0, math.inf, 0
    while stalls < _STALLS:
        step_count += steps
        if step_count > search.budget:
            raise search.make_unmet_error_exception(
                f"the search is limited to {search.budget} steps, which did not suffice"
            )
        run = search.integrate_and_measure_error(steps)
        if run and run[1] <= _ENOUGH * target:
            states, error = run
            choice = StepChoice(
                method=search.method,
                step=search.end / steps,
                order=search.order,
                target=target,
                error=error,
                conditioning=search.conditioning,
                run=search.cost,
                trials=search.spent.evaluations - search.cost,
                budget=search.budget,
            )
            options, is_back = Options(search.method, abs(choice.step)), choice.step < 0.0
            return Path(scene, states, search.spent, options, is_back, _choice=choice)
        error = run[1] if run else math.inf
        is_stalled = 0.5 * least < error < _UNLIKE
        stalls += is_stalled
        least, steps = (
            min(least, error),
            2 * steps if is_stalled else search.predict_needed_step_count(steps, error),
        )
    raise search.make_unmet_error_exception(
        f"rounding errors reach {least:.1e} rad, and finer steps add more"
    )


def _is_drift_exact(scene: Scene) -> bool:
    """Return True if the drift (free motion) of a body is computed exactly."""
    body = scene.body
    return body.is_symmetric and (not any(body.rotor) or body.kind != "general")


def _compute_top_rate_and_error_weight(scene: Scene) -> tuple[float, float]:
    """Return the rate r of the top [T^-1], and the weight w of a method's error [T^-1]."""
    body = scene.body
    lever = body.mass * abs(scene.gravity) * math.hypot(*body.com)
    kinetic, potential = (
        float(values(name, scene._block, scene._start_state)[0])
        for name in ("kinetic", "potential")
    )
    is_exact = _is_drift_exact(scene)
    moment = sorted(body.moments)[1 if is_exact else 2]
    # The potential energy above its minimum, which rounding can make negative for a hanging top.
    energy = max(0.0, potential + lever)
    if is_exact:  # drifts are exact, so the error is proportional to the torque
        rate = math.sqrt((math.hypot(*scene.momentum) / moment) ** 2 + 2.0 * energy / moment)
        return rate, lever / moment / rate if rate else 0.0
    rate = math.sqrt(2.0 * (kinetic + energy) / moment) + math.hypot(*body.rotor) / moment
    return rate, rate


_UNMET = STATUSES.index("ERR_CONVERGENCE")  # status of a top for which no step meets the error


def solve_slice_with_step_search(part: Slice) -> None:
    """Solve a slice of an ensemble with the cheapest method that meets the error tolerance."""
    rows, options, tops, begin, end, t, work = part
    for i in range(end - begin):
        if work is not None and work.stopped:
            break
        scene = get_member_by_flat_index(tops, begin + i)
        try:
            _solve_top_into_buffers(rows, i, options, scene, t[i] if t.ndim == 2 else t, work)
        except Interrupted:  # only a trial run was interrupted, whose states are not a result
            if work is None:
                raise
            work.stop()
            break
        if work is not None:
            work.did(1)


def _solve_top_into_buffers(
    part: EnsembleBuffers,
    i: int,
    options: Options,
    scene: Scene,
    times: Array,
    work: Work | None,
) -> None:
    """Compute the motion of a single top, and write its path or an error message to the buffers."""
    path, status = None, 0
    try:
        path = _find_path_by_step_search(scene, options, times, work)
    except Error as error:
        path, status, part.messages[i] = error.path, STATUSES.index(error.status), str(error)
    except ValueError as error:
        status, part.messages[i] = _UNMET, str(error)
    part.status[i] = status
    _write_path_to_buffers(part, i, path, times, bool(status))


def _write_path_to_buffers(
    part: EnsembleBuffers, i: int, path: Path | None, times: Array, has_failed: bool
) -> None:
    """Write a path to the buffers, with NaN for all times that the path did not reach."""
    indices, count = np.empty(0, dtype=np.intp), 0
    if path is not None:
        indices, count = _find_indices_of_times(path, times)
        part.counts[i] = path.stats
        part.reached[i] = path.t[-1] if len(path) else 0.0
        if has_failed and len(path):
            part.last[i] = np.array([path.states[-1], np.zeros(8)])
        if path._choice is not None:
            part.chosen[i] = path._choice
    part.done[i] = count
    if part.states is not None:
        part.states[i] = np.nan
        part.states[i, :, 0] = times
        if path is not None:
            part.states[i, :count] = path.states[indices]
    for name, column in part.columns.items():
        column[i] = np.nan
        if path is not None:
            column[i, :count] = getattr(path, name)[indices]


def _find_indices_of_times(path: Path, times: Array) -> tuple[npt.NDArray[np.intp], int]:
    """Return the indices of the states of a path at the given times, and their number.

    Times after the end of the path are omitted. The path may also contain states at times that were
    not requested.
    """
    if not len(path):
        return np.empty(0, dtype=np.intp), 0
    indices = np.minimum(np.searchsorted(np.abs(path.t), np.abs(times)), len(path) - 1)
    mismatches = np.flatnonzero(path.t[indices] != times)
    count = int(mismatches[0]) if mismatches.size else times.size
    return indices[:count], count


STEP_SEARCH = SliceRunner(solve_slice_with_step_search)
