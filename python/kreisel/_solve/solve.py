"""Solve: paths of one top and of ensembles, whole or in pieces, and files of them."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path as File
from typing import BinaryIO, Literal, NamedTuple, TypedDict, Unpack, cast, overload

from .._model.scene import Ensemble, Scene
from .._options.methods import FALLBACK
from .._options.options import (
    EnsembleOptions,
    ReductionSpec,
    SolveOptions,
    check_result_memory,
    validate_ensemble_options,
    validate_ensemble_times,
    validate_output_array,
    validate_progress_callback,
    validate_solve_options,
    validate_thread_count,
)
from .._options.plan import GEOMETRIC
from .._options.times import (
    CHUNK_SIZE,
    check_resolvable_horizon,
    find_time_direction_and_chunks,
    time_array,
)
from .._results.archive import read_saved_path_arguments
from .._results.buffers import LANES, SCALAR, SliceRunner
from .._results.path import Events, Path, record_path, try_to_solve_in_core
from .._results.paths import Paths, Reductions, run_ensemble
from .._utils.arguments import Array, Numbers, as_int, short_repr, validate_type
from .._utils.name_hints import has_unknown_keywords, refuse_unknown_keywords
from .._utils.processes import Progress, WorkerPool
from .._utils.quantity_attributes import MethodName, QuantityName
from ..events import refuse_kinetic, to_core_events, validate_events
from .exact import record_exact_path_with_tangents
from .geometric import (
    STEP_SEARCH,
    make_error_tolerance_refusal,
    solve_with_step_search,
    validate_geometric_method_options,
)
from .run import MAGIC, EventSpec, Run, resume, validate_run_options
from .tangents import (
    TangentSpec,
    check_computes_tangents,
    record_path_with_tangents,
    refuse_arguments_with_tangents,
    refuse_undefined_friction_tangents,
    validate_tangent_names,
    validate_tangent_options,
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


class MethodKeywords(TypedDict, total=False):
    """Keyword arguments that control the integration method."""

    step: float | None
    tol: float | None
    digits: int | None
    every: int | None


class StreamKeywords(MethodKeywords, total=False):
    """Keyword arguments of kreisel.stream for a single scene."""

    max_steps: int
    want: Iterable[QuantityName] | None
    events: EventSpec | None
    progress: Progress | None


class SolveKeywords(StreamKeywords, total=False):
    """Keyword arguments of kreisel.solve that apply to both single scenes and ensembles."""

    error: float | None


class PoolKeywords(TypedDict, total=False):
    """Keyword arguments that select the threads or the executor used to run an ensemble."""

    threads: int | None
    executor: Executor | None


_ZIP = b"PK"  # the first bytes of an archive, which is a ZIP file
_MAX_SCENE_BYTES = 1 << 20


def load(file: str | os.PathLike[str]) -> Path | Scene | Run:
    """Load a path, a scene or a run from a file.

    The type of the returned object depends on the contents of the file. A path written by path.save
    is restored exactly, bit for bit. A scene is read from a TOML file. A run is restored from a
    checkpoint that was written by run.save.

        >>> import os, tempfile
        >>> import kreisel as kr
        >>> path = kr.solve(kr.scenes.thesis, [1.0, 2.0])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path.save(os.path.join(folder, "top.npz"))
        ...     kr.load(os.path.join(folder, "top.npz"))
        <kreisel.Path: 2 states, t = 1 .. 2; exact, 2 steps>

    Raises TypeError if `file` is not a str or a path of text. Raises OSError if the file cannot be
    read. Raises ValueError if the file is damaged, or contains neither a path nor a scene nor a
    run. Loading a file does not execute any code that the file contains. Memory use is bounded by
    the size of the file.
    """
    name = os.fspath(file)
    if not isinstance(name, str):
        raise TypeError(f"file must be the name of a file, not {short_repr(file)}")
    status = os.stat(name)
    if not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
        raise ValueError(f"{name} is not a regular file")
    with open(name, "rb") as stream:
        head = stream.read(len(MAGIC))
        if head == MAGIC:
            return resume(File(name))
        if head.startswith(_ZIP):
            return _load_path(name, stream, status.st_size)
    return _load_scene(name, status.st_size)


def _load_path(name: str, file: BinaryIO, size: int) -> Path:
    try:
        path, event_data = read_saved_path_arguments(file, size)
    except ValueError as error:
        raise ValueError(f"{name} is not a saved path: {error}") from None
    if event_data is None:
        return Path(*path)
    event_arguments, which, direction = event_data
    return Path(*path._replace(events=Events(Path(*event_arguments), which, direction)))


def _load_scene(name: str, size: int) -> Scene:
    kinds = "a saved path or run, nor a scene in TOML"
    if size > _MAX_SCENE_BYTES:
        raise ValueError(f"{name} is neither {kinds}, which would be smaller")
    try:
        return Scene.from_toml(File(name))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{error}; the file is neither {kinds}") from None


class _EnsembleSolveKeywords(SolveKeywords, PoolKeywords, total=False):
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
    **controls: Unpack[_EnsembleSolveKeywords],
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


class _EnsembleStreamKeywords(StreamKeywords, PoolKeywords, total=False):
    pass


@overload
def stream(
    scene: Scene,
    t: Numbers | Iterator[float],
    method: MethodName = "auto",
    *,
    chunk: int | None = None,
    **controls: Unpack[StreamKeywords],
) -> Iterator[Path]: ...
@overload
def stream(
    scene: Ensemble,
    t: Numbers,
    method: MethodName = "auto",
    *,
    chunk: int | None = None,
    **controls: Unpack[_EnsembleStreamKeywords],
) -> Iterator[Paths]: ...
def stream(
    scene: Scene | Ensemble,
    t: Numbers | Iterator[float],
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    want: Iterable[QuantityName] | None = None,
    events: EventSpec | None = None,
    chunk: int | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> Iterator[Path] | Iterator[Paths]:
    """Yield the states of kreisel.solve as paths of at most `chunk` states, in constant memory.

    The yielded states are bitwise identical to those of kreisel.solve with the same method. The
    default of `chunk` is 2**14.

    t      a list; an iterator of times, which can be infinite; or with `every` a number, which can
           be math.inf [T]

        for path in kr.stream(scene, math.inf, "strang", step=0.01, every=10): ...
        for path in kr.stream(scene, (0.01 * k for k in itertools.count())): ...

        >>> import kreisel as kr
        >>> words = {"method": "strang", "step": 0.01, "every": 10, "want": ["nutation"]}
        >>> [len(path) for path in kr.stream(kr.scenes.asymmetric, 1000, chunk=4000, **words)]
        [4000, 4000, 2001]

    For an ensemble, yield a kreisel.Paths for each group of consecutive tops in C order. Each
    kreisel.Paths has at most `chunk` states in total (default 2**20), but at least one top. t must
    not be an iterator. threads, executor and progress are as in kreisel.solve.

    The statistics of each path refer to the entire run up to the last state of the path. Each path
    contains the events that occurred after the end of the previous path. For a single scene, the
    path that contains a terminal event is the last one.

    Raises the same exceptions as kreisel.solve. Exceptions for invalid arguments are raised
    immediately. Exceptions for failed runs and for invalid times from an iterator are raised only
    while the paths are iterated over. The attribute `path` of kreisel.Error and kreisel.Interrupted
    contains the valid states of the last path.
    """
    most = None if chunk is None else as_int("chunk", chunk, 1)
    if isinstance(scene, Ensemble):
        if isinstance(t, Iterator):
            raise TypeError(
                "times of an ensemble must be a number, a list or an array, not an iterator"
            )
        arguments = SolveArguments(step, tol, digits, every, max_steps, None, want, events)
        size = most or 1 << 20
        return stream_ensemble(scene, t, method, arguments, size, progress, threads, executor)
    if threads is not None or executor is not None:
        refuse_ensemble_arguments(scene, threads=threads, executor=executor)
    options = validate_run_options(scene, method, step, tol, digits, max_steps, want, events, every)
    is_back, chunks = find_time_direction_and_chunks(
        t, options.step, options.every, most or CHUNK_SIZE
    )
    return Run(scene, options, is_back)._yield_path_per_chunk(
        chunks, validate_progress_callback(progress)
    )
