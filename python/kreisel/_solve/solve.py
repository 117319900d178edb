"""kreisel.solve: the motion of a scene or of an ensemble."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Executor
from typing import Literal, Unpack, cast, overload

from .._model.scene import Ensemble, Scene
from .._options.plan import GEOMETRIC
from .._options.solve_options import (
    Progress,
    SolveOptions,
    validate_progress_callback,
    validate_solve_options,
)
from .._options.times import check_resolvable_horizon, time_array
from .._results.ensemble_paths import Paths
from .._results.path import Path
from .._results.recorder import record_path
from .._results.requests import try_to_solve_in_core
from .._utils.name_hints import has_unknown_keywords, refuse_unknown_keywords
from .._utils.quantity_attributes import MethodName, QuantityName
from .._utils.validation import Array, Numbers, validate_type
from .exact import record_exact_path_with_tangents
from .keywords import PoolKeywords, SolveKeywords
from .run import EventSpec, Run, validate_run_options
from .solve_ensemble import SolveArguments, refuse_ensemble_arguments, solve_ensemble
from .step_search import (
    make_error_tolerance_refusal,
    solve_with_step_search,
    validate_geometric_method_options,
)
from .variational import TangentSpec, record_path_with_tangents, validate_tangent_options


class _EnsembleKeywords(SolveKeywords, PoolKeywords, total=False):
    out: Array | None
    tangents: TangentSpec | None


_NO_TIMES = cast(Numbers, None)  # refused like None, but after unknown keywords


@overload
def solve(
    scene: Scene,
    t: Numbers,
    method: MethodName | Literal["geometric"] = "auto",
    *,
    tangents: TangentSpec | None = None,
    **controls: Unpack[SolveKeywords],
) -> Path: ...
@overload
def solve(
    scene: Ensemble,
    t: Numbers,
    method: MethodName | Literal["geometric"] = "auto",
    **controls: Unpack[_EnsembleKeywords],
) -> Paths: ...
@has_unknown_keywords("solve", required="t")
def solve(
    scene: Scene | Ensemble,
    t: Numbers = _NO_TIMES,
    method: MethodName | Literal["geometric"] = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    error: float | None = None,
    want: Iterable[QuantityName] | None = None,
    progress: Progress | None = None,
    events: EventSpec | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    out: Array | None = None,
    tangents: TangentSpec | None = None,
    **unknown: object,
) -> Path | Paths:
    """Compute the motion of a top, or of every top in an ensemble, starting at t = 0.

    t          a list: record the states at these times, which must be monotonic and on one side of
               0; (0, 10) is a list of two times. A number: record the start and the state at t, or
               with `every` the states after every `every` steps. Negative times: back in time [T]
    method     a name in kreisel.methods; 'auto' uses exact if it applies, otherwise taylor, and
               always taylor if digits, events or tangents are given. For Kowalewski and
               Goryachev-Chaplygin tops, 'auto' uses exact only for one scene, and only if exact is
               at least as accurate as taylor and, according to the times, not slower (see
               kreisel.plan). 'geometric' chooses a structure-preserving method and a step with
               which the error is at most `error`
    step       positive [T]. Required by fixed-step methods: a time between two grid points is
               reached by one shorter step from the earlier point. For adaptive methods it is the
               first step
    tol        adaptive methods: the local error of a step; implicit methods: the residual of the
               equations of a step; exact ignores tol, and other methods do not allow it
    digits     taylor only, instead of tol: the number of digits, rounded up to 16, 20 or 30;
               path.q_low and path.m_low have the digits beyond doubles
    every      the number of steps of a fixed-step method from one recorded state to the next; only
               if t is a number
    max_steps  the maximal number of steps, with 'geometric' of each trial run; 0: no limit
    error      with 'geometric': the largest attitude error allowed on [0, t], at most 0.1 [rad].
               The error is checked against a reference solution: a run in 20-digit arithmetic or a
               closed form. The search may use at least 64 times the number of steps that was first
               estimated; ValueError if that is not enough
    want       names such as ("nutation", "energy"): the path stores only t and these quantities.
               The core does not compute the heading if no quantity in `want` depends on it
    progress   a function called about ten times per second with the time reached, and at the end
               with the last time [T]; an exception in it stops the run
    events     taylor only: an event of kreisel.events or a list of events; path.events has the
               occurrences. A terminal event ends the path
    tangents   taylor, and exact for a Kowalewski or Goryachev-Chaplygin top as in
               kreisel.ExactTorus: one or several of "start", "moments", "com", "gravity", "mass",
               "damping", "rotor", "turning", "shaking", "friction" (not 0). path.tangents has the
               derivatives of the states with respect to these, path.derivative those of a quantity.
               The states are bitwise equal to those without tangents, unless strong damping
               requires shorter steps for the tangents. With tangents, the results for each top of
               an ensemble are bitwise equal to those of kreisel.solve for this top alone

        >>> import kreisel as kr
        >>> path = kr.solve(kr.scenes.cusps, t=300, method="strang", step=0.01, every=100)
        >>> path
        <kreisel.Path: 301 states, t = 0 .. 300; strang, step=0.01, 30000 steps>
        >>> truth = kr.solve(kr.scenes.cusps, path.t)
        >>> truth.method, bool(kr.attitude_error(path.q, truth.q).max() < 1e-3)
        ('exact', True)
        >>> lows = kr.solve(kr.scenes.cusps, 50, events=[kr.events.nutation(direction=1)]).events
        >>> [f"{t:.6f}" for t in lows.t[:2]]
        ['1.174941', '3.524823']

    For an ensemble, the arguments apply to every top. The result is a kreisel.Paths; the first
    dimensions of its arrays are those of the ensemble. The result for each top does not depend,
    even in its last bit, on the other tops, the threads or the executor. A top gives the same
    result in an ensemble of one top and in a larger ensemble. However, the methods taylor and exact
    may have different rounding errors for a kreisel.Scene and for an ensemble, and 'auto' may
    select different methods. `t` can also be an array of shape (*shape, k), which contains separate
    times for each top. `progress` is called with the fraction of tops that have been computed,
    between 0 and 1. An ensemble has further arguments:

    threads    the number of threads; default: the number of processors
    executor   an executor of concurrent.futures, instead of threads; workers in other processes
               receive copies of the tops
    out        a float64 array (*shape, k, 8) in C order, to which the states are written

        >>> import numpy as np
        >>> tops = kr.scenes.cusps.vary(gravity=np.linspace(0.5, 1.0, 3))
        >>> paths = kr.solve(tops, [0.0, 1.0, 2.0])
        >>> paths.q.shape, paths.failed.tolist(), paths[2].nutation[1].round(3)
        ((3, 3, 4), [], np.float64(1.13))

    Raises TypeError or ValueError for invalid arguments, before any computation starts. Raises
    MemoryError if the states do not fit in memory. Raises kreisel.Error if the run fails, and
    kreisel.Interrupted after Ctrl-C. The valid states are available as the attribute `path` of the
    exception. For an ensemble, the status of the computation for each top is stored in
    paths.status. The method paths.check raises kreisel.Error for the first top whose computation
    failed.
    """
    if unknown:
        refuse_unknown_keywords(solve, unknown)
    is_for_many = threads is not None or executor is not None or out is not None
    is_special = error is not None or events is not None or tangents is not None or is_for_many
    is_checked = is_special or every is not None or not (progress is None or callable(progress))
    if isinstance(scene, Scene) and not is_checked:
        path = try_to_solve_in_core(scene, t, method, step, tol, digits, max_steps, want, progress)
        if path is not None:
            return path
    if isinstance(scene, Ensemble):
        controls = step, tol, digits, every, max_steps, error, want, events
        arguments = SolveArguments(*controls, tangents=tangents)
        return solve_ensemble(scene, t, method, arguments, progress, threads, executor, out)
    request = scene, method, step, tol, digits, max_steps, want, every
    if is_special or method == GEOMETRIC:
        others: dict[str, object] = {"threads": threads, "executor": executor, "out": out}
        options = _validate_special_solve_options(*request, error, events, tangents, others)
    else:
        options = validate_solve_options(*request, t=t)
    return _solve_with_options(scene, options, t, validate_progress_callback(progress))


def _validate_special_solve_options(
    scene: Scene,
    method: str,
    step: float | None,
    tol: float | None,
    digits: int | None,
    max_steps: int,
    want: Iterable[QuantityName] | None,
    every: int | None,
    error: float | None,
    events: EventSpec | None,
    tangents: TangentSpec | None,
    others: dict[str, object],
) -> SolveOptions:
    """Return the validated options for a call with tangents, events or method='geometric'.

    Raises TypeError or ValueError if an argument is invalid, or if an argument in `others` is
    given.
    """
    if tangents is not None:
        exclusions = {"error": error, "want": want, "events": events} | others
        controls = step, tol, digits, max_steps
        return validate_tangent_options(scene, method, tangents, controls, every, exclusions)
    if any(value is not None for value in others.values()):
        refuse_ensemble_arguments(scene, **others)
    if method == GEOMETRIC:
        exclusions = {"step": step, "tol": tol, "digits": digits, "every": every, "events": events}
        validate_type("scene", scene, Scene)
        return validate_geometric_method_options(error, max_steps, want, exclusions)
    if error is not None:
        raise make_error_tolerance_refusal(method)
    return validate_run_options(scene, method, step, tol, digits, max_steps, want, events, every)


def _solve_with_options(
    scene: Scene, options: SolveOptions, t: Numbers, progress: Progress | None
) -> Path:
    """Compute the motion of a scene, in several calls to the C library if necessary."""
    if options.tangents:
        record = (
            record_exact_path_with_tangents if options.method.exact else record_path_with_tangents
        )
        return record(scene, options, t, progress)
    times = time_array(t, options.step, options.every, options.bytes_per_state)
    end = float(times[-1]) if times.size else 0.0
    if options.error is not None:
        return solve_with_step_search(scene, options, times, progress)
    check_resolvable_horizon(scene, end, options.step)
    if options.requests_events or times.size > options.chunk_size:
        return Run(scene, options, end < 0.0)._advance_to_times(times, progress)
    return record_path(scene, options, times, progress)
