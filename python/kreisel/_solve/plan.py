"""kreisel.plan: the method, the options and the cost of a solve, without solving."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from .._core import Worker, unsuited
from .._model.scene import Scene
from .._options.methods import FALLBACK
from .._options.options import (
    GEOMETRIC,
    Options,
    ReductionSpec,
    get_member_by_flat_index,
    make_options,
    validate_thread_count,
    validate_times,
)
from .._options.plan import Plan, make_solve_plan
from .._results.calls import LANES, SCALAR, EnsembleBuffers, Slice
from .._utils.arguments import Array, Numbers, validate_type
from .._utils.quantity_attributes import MethodName, QuantityName
from .solve import refuse_ensemble_arguments

_SAMPLES = 16  # maximal number of tops that are run to estimate the run time
_MAX_STATES, _MAX_STEPS = 1 << 11, 1 << 11  # limits of each of these runs
_ROW = 49  # bytes per top for status, number of states, step counts and time reached


def plan(
    scene: Scene,
    t: Numbers | None = None,
    want: Iterable[QuantityName] | None = None,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    threads: int | None = None,
    reduce: ReductionSpec | None = None,
) -> Plan:
    """Return a plan, which describes how kreisel.solve would compute a motion.

    For an ensemble with times `t`, a few tops are integrated for a limited number of steps to
    estimate the run time.

    t       the times as in kreisel.solve; if given, the plan includes the number of states
    reduce  for an ensemble: the reductions of kreisel.reduce, instead of states

        >>> import kreisel as kr
        >>> plan = kr.plan(kr.scenes.asymmetric, want=("nutation", "energy"))
        >>> print(str(plan).splitlines()[0])
        method     taylor: no closed form is known for this body of kind 'general' under gravity
        >>> tops = kr.scenes.asymmetric.vary(gravity=[0.0, 0.5, 1.0])
        >>> print(str(kr.plan(tops, 10, threads=2)).splitlines()[0])
        tops       (3,): 1 by closed form, 2 in lanes; by 2 threads

    Raises the same exceptions for invalid arguments as kreisel.solve. Raises ValueError for
    method='geometric', which chooses an integration method and its step by trial runs.
    """
    if isinstance(method, str) and method == GEOMETRIC:
        raise ValueError("method='geometric' chooses by trial runs: call solve, and see path.plan")
    options = make_options(
        method, step=step, tol=tol, digits=digits, every=every, want=want, reduce=reduce
    )
    if validate_type("scene", scene, Scene).shape:
        options = options.for_tops(scene)
        return _plan_ensemble(scene, t, options, validate_thread_count(threads))
    refuse_ensemble_arguments(scene, threads=threads, reduce=reduce)
    options = options.for_tops(scene, t)
    times = None if t is None else validate_times(scene, t, options)
    return make_solve_plan(scene, options, None if times is None else times.size, times=times)


def _plan_ensemble(tops: Scene, t: Numbers | None, options: Options, threads: int) -> Plan:
    exact_count, lanes = _count_exact_and_lane_tops(tops, options)
    states, seconds, sample_count, size = None, None, 0, None
    if t is not None:
        times = validate_times(tops, t, options)
        states = times.shape[-1]
        row = 8 * len(options.reductions) or states * options.bytes_per_state
        size = tops.size * (_ROW + row)
        seconds, sample_count = _estimate_run_time(tops, times, options, threads)
    plan = Plan(options.method, "", None, 0, "", "", (), 0, (), ())
    if tops.size:
        plan = _plan_first_top(tops, options, states)
    return replace(
        plan,
        method=plan.method if tops.size else "",
        bytes=8 * len(options.reductions) or plan.bytes,
        columns=tuple(options.reduce) or plan.columns,
        shape=tops.shape,
        closed_form=exact_count,
        lanes=lanes,
        alone=tops.size - exact_count - lanes,
        threads=threads,
        states=states,
        size=size,
        seconds=seconds,
        measured=sample_count,
    )


def _count_exact_and_lane_tops(tops: Scene, options: Options) -> tuple[int, int]:
    """Return the numbers of tops evaluated in closed form and of tops integrated in SIMD lanes."""
    if options.integrator.exact:
        return tops.size, 0
    if options.uses_one_run_per_top or options.integrator.name != FALLBACK:
        return 0, 0
    is_damped, is_turning = tops.damping.any(axis=-1), tops.turning.any(axis=-1)
    is_shaken = tops.shaking[..., 0] != 0.0
    is_alone = is_damped | is_turning | is_shaken | (tops.friction > 0.0)
    alone_count = int(np.count_nonzero(is_alone))
    # Some tops on a turning support have a closed form.
    if options.is_auto and is_turning.any():
        selection = tops[is_alone] if tops.shape else tops.reshape(1)
        alone_count = unsuited(selection._core_scenes, "auto")[1]
    exact_count = tops.size - unsuited(tops._core_scenes, "auto")[1] if options.is_auto else 0
    return exact_count, tops.size - exact_count - alone_count


def _plan_first_top(tops: Scene, options: Options, states: int | None) -> Plan:
    scene = get_member_by_flat_index(tops, 0)
    plan = make_solve_plan(scene, options.for_member(scene), states)
    kernel, order = Worker(*options.core_arguments, []).kernel
    is_alone = scene._has_disturbances
    if plan.method != FALLBACK or options.uses_one_run_per_top or not kernel or is_alone:
        return plan
    level = options.can_skip_heading_angle
    form = "(P, W): vertical and angular velocity seen from the body"
    form += "; without the heading" if level else ", and from these the heading"
    return replace(plan, order=order, kernel=f"{kernel}, in lanes", form=form)


def _estimate_run_time(tops: Scene, t: Array, options: Options, threads: int) -> tuple[float, int]:
    """Return an estimate of the run time [s], and the number of tops used for the estimate.

    A few tops are integrated for a limited number of steps, and the run time is extrapolated.
    """
    if not tops.size or not t.shape[-1]:
        return 0.0, 0
    indices = np.unique(np.linspace(0, tops.size - 1, _SAMPLES).astype(np.int64))
    sample = tops[np.unravel_index(indices, tops.shape)] if tops.shape else tops.reshape(1)
    all_times = t[indices] if t.ndim == 2 else t
    times = all_times[..., :_MAX_STATES]
    most = min(options.max_steps or _MAX_STEPS, _MAX_STEPS)
    run_options = replace(options, max_steps=most)
    buffers = EnsembleBuffers.allocate_buffers(indices.size, times.shape[-1], run_options)
    runner = SCALAR if run_options.uses_one_run_per_top else LANES
    start_time = time.perf_counter()
    runner.run(Slice(buffers, run_options, sample, 0, indices.size, times))
    duration = time.perf_counter() - start_time
    is_complete = buffers.done == times.shape[-1]
    part = np.where(is_complete, buffers.done / all_times.shape[-1], np.inf)
    end = np.abs(np.broadcast_to(all_times[..., -1], part.shape))
    with np.errstate(invalid="ignore", divide="ignore"):
        time_share = np.where(end > 0.0, np.abs(buffers.reached) / end, np.inf)
    done = float(np.maximum(np.minimum(part, time_share), 1e-9).mean())
    return duration / done * tops.size / indices.size / threads, int(indices.size)
