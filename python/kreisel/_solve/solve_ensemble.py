"""kreisel.solve for an ensemble, and kreisel.reduce."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from dataclasses import replace
from typing import NamedTuple

from .._model.scene import Ensemble, Scene
from .._options.ensemble_options import (
    EnsembleOptions,
    ReductionSpec,
    check_result_memory,
    validate_ensemble_options,
    validate_ensemble_times,
    validate_output_array,
    validate_thread_count,
)
from .._options.methods import FALLBACK
from .._options.plan import GEOMETRIC
from .._options.solve_options import Progress, validate_progress_callback
from .._results.ensemble_buffers import LANES, SCALAR, SliceRunner
from .._results.ensemble_paths import Paths
from .._results.executor import WorkerPool
from .._results.reductions import Reductions
from .._results.run_ensemble import run_ensemble
from .._utils.quantity_attributes import MethodName, QuantityName
from .._utils.validation import Array, Numbers, validate_type
from ..events import refuse_kinetic, to_core_events, validate_events
from .run import EventSpec
from .step_search import (
    STEP_SEARCH,
    make_error_tolerance_refusal,
    validate_geometric_method_options,
)
from .variational import (
    TangentSpec,
    check_computes_tangents,
    refuse_arguments_with_tangents,
    refuse_undefined_friction_tangents,
    validate_tangent_names,
)


class SolveArguments(NamedTuple):
    """Keyword arguments of kreisel.solve that control the method and select the recorded data."""

    step: float | None = None
    tol: float | None = None
    digits: int | None = None
    every: int | None = None
    max_steps: int = 0
    error: float | None = None
    want: Iterable[QuantityName] | None = None
    events: EventSpec | None = None
    reduce: ReductionSpec | None = None
    tangents: TangentSpec | None = None


def reduce(
    tops: Ensemble,
    t: Numbers,
    reductions: ReductionSpec,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> Reductions:
    """Compute statistics of the path of each top in an ensemble, without storing the states.

    reductions  a mapping from names of quantities or of their components to one or several of min,
                max, mean, variance, last, where_min, where_max, as in {"nutation": ("min", "max")}

    The other arguments are the same as for kreisel.solve. Memory use is independent of the number
    of times.

        >>> import kreisel as kr
        >>> tops = kr.scenes.cusps.vary(gravity=[0.5, 1.0])
        >>> kr.reduce(tops, [0.0, 0.5, 1.0], {"nutation": "max"})["nutation"]["max"].round(3)
        array([1.023, 1.13 ])

    Raises TypeError or ValueError for invalid arguments, before any computation starts. Raises
    kreisel.Interrupted after Ctrl-C; its attribute `paths` contains the results obtained so far. If
    the computation for a top fails, its values are NaN, and `status` indicates the reason. The
    check() method of the result raises kreisel.Error for the first top whose computation failed.
    """
    if type(tops) is not Ensemble:
        validate_type("tops", tops, Ensemble)
    controls = step, tol, digits, max_steps, None, reductions, every
    options = validate_ensemble_options(tops, method, *controls)
    if not options.reductions:
        raise TypeError("reductions must name quantities, as in {'nutation': ('min', 'max')}")
    pool = WorkerPool(validate_thread_count(threads, executor), executor)
    callback, times = (
        validate_progress_callback(progress),
        validate_ensemble_times(tops, t, options),
    )
    return run_ensemble(Reductions, tops, times, options, pool, LANES, callback)


def solve_ensemble(
    tops: Ensemble,
    t: Numbers,
    method: str,
    arguments: SolveArguments,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    out: Array | None = None,
) -> Paths:
    """Compute the motions of all tops in an ensemble."""
    options = validate_ensemble_arguments(tops, method, arguments)
    pool = WorkerPool(validate_thread_count(threads, executor), executor)
    callback, times = (
        validate_progress_callback(progress),
        validate_ensemble_times(tops, t, options),
    )
    check_result_memory(tops, times, options)
    target = validate_output_array(tops, out, times, options)
    return run_ensemble(
        Paths, tops, times, options, pool, select_slice_runner(options), callback, target
    )


def select_slice_runner(options: EnsembleOptions) -> SliceRunner:
    """Return the function that computes the motions of a slice of an ensemble."""
    if options.has_step_search:
        return STEP_SEARCH
    return SCALAR if options.uses_one_run_per_top else LANES


def stream_ensemble(
    tops: Ensemble,
    t: Numbers,
    method: str,
    arguments: SolveArguments,
    chunk: int,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> Iterator[Paths]:
    """Return an iterator over the paths of consecutive groups of tops in an ensemble.

    Each group contains at least one top. A group of several tops has at most `chunk` states in
    total.
    """
    options = validate_ensemble_arguments(tops, method, arguments)
    pool = WorkerPool(validate_thread_count(threads, executor), executor)
    callback, times = (
        validate_progress_callback(progress),
        validate_ensemble_times(tops, t, options),
    )
    return _yield_paths_of_batches(
        tops, times, options, pool, callback, max(1, chunk // max(1, times.shape[-1]))
    )


def _yield_paths_of_batches(
    tops: Ensemble,
    t: Array,
    options: EnsembleOptions,
    pool: WorkerPool,
    progress: Progress | None,
    size: int,
) -> Iterator[Paths]:
    row, runner = tops.ravel(), select_slice_runner(options)
    for begin in range(0, len(row), size):
        times = t[begin : begin + size] if t.ndim == 2 else t
        yield run_ensemble(Paths, row[begin : begin + size], times, options, pool, runner)
        if progress is not None:
            progress(min(1.0, (begin + size) / len(row)))


def validate_ensemble_arguments(
    tops: Ensemble, method: str, arguments: SolveArguments
) -> EnsembleOptions:
    """Validate the arguments for solving an ensemble, and return the options.

    Raises TypeError or ValueError for an invalid argument.
    """
    if isinstance(method, str) and method == GEOMETRIC:
        exclusions = arguments._asdict()
        error, max_steps, want = (exclusions.pop(name) for name in ("error", "max_steps", "want"))
        return EnsembleOptions(
            validate_geometric_method_options(error, max_steps, want, exclusions)
        )
    if arguments.tangents is not None:
        return _validate_ensemble_tangent_options(tops, method, arguments)
    step, tol, digits, every, max_steps, error, want, events, reduce, _ = arguments
    if error is not None:
        raise make_error_tolerance_refusal(method)
    if events is not None and reduce is not None:
        raise ValueError("events need paths: leave out reduce")
    controls = step, tol, digits, max_steps, want, reduce, every
    options = validate_ensemble_options(tops, method, *controls, requests_events=events is not None)
    if events is None:
        return options
    event_list = validate_events(options.solve.method.name, events)
    refuse_kinetic(tops, event_list)
    return replace(options, core_events=to_core_events(event_list))


def _validate_ensemble_tangent_options(
    tops: Ensemble, method: str, arguments: SolveArguments
) -> EnsembleOptions:
    """Return the validated options for solving an ensemble with tangents."""
    step, tol, digits, every, max_steps, error, want, events, reduce, tangents = arguments
    names = validate_tangent_names(tangents)
    refuse_arguments_with_tangents(
        {"error": error, "want": want, "events": events, "reduce": reduce}
    )
    method_name = FALLBACK if method == "auto" else method
    options = validate_ensemble_options(
        tops, method_name, step, tol, digits, max_steps, every=every
    )
    check_computes_tangents(options.solve.method)
    refuse_undefined_friction_tangents(tops, names)
    return replace(options, solve=replace(options.solve, requested_method=method, tangents=names))


def refuse_ensemble_arguments(scene: object, **arguments: object) -> None:
    """Raise ValueError if arguments for ensembles are given for a single scene.

    Raises TypeError if `scene` is not a kreisel.Scene.
    """
    validate_type("scene", scene, Scene)
    names = [name for name, value in arguments.items() if value is not None]
    raise ValueError(f"{' and '.join(names)}: only for a kreisel.Ensemble, not for a single scene")
