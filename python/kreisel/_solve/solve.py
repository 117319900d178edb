"""Solve: paths of one top and of many, whole or in pieces, their plans and files."""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path as File
from typing import Literal, Unpack, cast, overload

import numpy as np

from .._model.scene import Scene, Scenes
from .._options import options as checks
from .._options.options import (
    EnsembleKeywords,
    EventSpec,
    Options,
    ReductionSpec,
    StreamKeywords,
    TangentSpec,
)
from .._options.plan import Plan, make_plan_of_tops, make_solve_plan
from .._results import calls
from .._results import path as paths
from .._results.calls import LANES, SCALAR, SliceRunner, run_ensemble
from .._results.path import EnsemblePath, Events, Path, Reductions
from .._results.requests import record_path, report_final_time, try_to_solve_in_core
from .._results.tables import read_archive
from .._utils.arguments import (
    Array,
    Numbers,
    as_int,
    has_unknown_keywords,
    refuse_unknown_keywords,
    short_repr,
    validate_type,
)
from .._utils.processes import Progress, WorkerPool
from .._utils.quantity_attributes import MethodName, QuantityName
from ..events import refuse_kinetic
from .exact import record_exact_path_with_tangents
from .geometric import STEP_SEARCH, solve_with_step_search
from .run import MAGIC, Run, refuse_step_search, resume, start_motion

_NO_TIMES = cast(Numbers, None)  # refused like None, but after unknown keywords
_ZIP = b"PK"  # the first bytes of an archive, which is a ZIP file
_MAX_SCENE_BYTES = 1 << 20
_SAMPLES = 16  # maximal number of tops that are run to estimate the run time
_MAX_STATES, _MAX_STEPS = 1 << 11, 1 << 11  # limits of each of these runs


@overload
def solve(
    scene: Scenes,
    t: Numbers,
    method: MethodName | Literal["geometric"] = "auto",
    **controls: Unpack[EnsembleKeywords],
) -> EnsemblePath: ...
@overload
def solve(
    scene: Scene,
    t: Numbers,
    method: MethodName | Literal["geometric"] = "auto",
    **controls: Unpack[EnsembleKeywords],
) -> Path: ...
@has_unknown_keywords("solve", required="t")
def solve(
    scene: Scene,
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
) -> Path:
    """Compute the motion of one or of many tops, starting at t = 0.

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
    error      with 'geometric': the largest attitude error allowed on [0, t], at most 0.1 [rad],
               against a reference: a run in 20-digit arithmetic or a closed form. ValueError if 64
               times the number of steps that was first estimated are not enough
    want       names such as ("nutation", "energy"): the path stores only t and these quantities.
               The core does not compute the heading if no quantity in `want` depends on it
    progress   a function called about ten times per second with the time reached, and at the end
               with the last time [T]; an exception in it stops the run
    events     taylor only: an event of kreisel.events or a list of events; path.events has the
               occurrences. A terminal event ends the path
    tangents   taylor, and exact for a Kowalewski or Goryachev-Chaplygin top as in
               kreisel.ExactTorus: one or several of "start", "moments", "com", "gravity", "mass",
               "damping", "rotor", "turning", "shaking", "friction" (not 0), "gradient".
               path.tangents has the derivatives of the states with respect to these,
               path.derivative those of a quantity. The states are bitwise equal to those without
               tangents, unless strong damping requires shorter steps, and to those of
               kreisel.solve for each of many tops alone

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

    For many tops, the first dimensions of the path's arrays are those of the scene. The result for
    each top does not depend, even in its last bit, on the other tops, the threads or the executor.
    However, the methods taylor and exact may have different rounding errors for one top and for
    many, and 'auto' may select different methods. `t` can also be an array (*shape, k) with
    separate times for each top. `progress` is called with the fraction of tops that have been
    computed. There are further arguments:

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
    kreisel.Interrupted after Ctrl-C, with the valid states as the attribute `path`. For many tops,
    paths.status has the status of each, and paths.check raises kreisel.Error for the first failure.
    """
    if unknown:
        refuse_unknown_keywords(solve, unknown)
    is_special = error is not None or events is not None or tangents is not None
    is_special |= threads is not None or executor is not None or out is not None
    is_checked = is_special or every is not None or not (progress is None or callable(progress))
    if isinstance(scene, Scene) and not (is_checked or scene.shape):
        path = try_to_solve_in_core(scene, t, progress, method, step, tol, digits, max_steps, want)
        if path is not None:
            return path
    keys = {"step": step, "tol": tol, "digits": digits, "every": every, "max_steps": max_steps}
    options = checks.make_options(
        method, **keys, error=error, want=want, events=events, tangents=tangents
    )
    validate_type("scene", scene, Scene)
    if scene.shape:
        options = options.for_tops(scene)
        if options.events:
            refuse_kinetic(scene, options.events)
        pool = WorkerPool(checks.validate_thread_count(threads, executor), executor)
        callback = checks.validate_progress_callback(progress)
        times = checks.validate_times(scene, t, options)
        checks.check_result_memory(scene, times, options)
        target = checks.validate_output_array(scene, out, times, options)
        kind, runner = EnsemblePath._of_many, select_slice_runner(options)
        return run_ensemble(kind, scene, times, options, pool, runner, callback, target)
    _refuse_arguments_of_many(threads=threads, executor=executor, out=out)
    options = options.for_tops(scene, None if is_special else t)
    callback = checks.validate_progress_callback(progress)
    times = checks.validate_times(scene, t, options)
    end = float(times[-1]) if times.size else 0.0
    if options.error is not None:
        return solve_with_step_search(scene, options, times, callback)
    checks.check_resolvable_horizon(scene, end, options.step)
    if options.tangents:
        is_exact = options.integrator.exact
        record = record_exact_path_with_tangents if is_exact else _record_path_with_tangents
        return record(scene, options, times, callback)
    if options.events is not None or times.size > options.chunk_size:
        return Run(scene, options, end < 0.0)._advance_to_times(times, callback)
    return record_path(scene, options, times, callback)


def select_slice_runner(options: Options) -> SliceRunner:
    """Return the function that computes the motions of a slice of many tops."""
    if options.error is not None:
        return STEP_SEARCH
    return SCALAR if options.uses_one_run_per_top else LANES


def _refuse_arguments_of_many(**arguments: object) -> None:
    if names := [name for name, value in arguments.items() if value is not None]:
        text = " and ".join(names)
        raise ValueError(f"{text}: only for a scene of many tops, not for one top")


def _record_path_with_tangents(
    scene: Scene, options: Options, times: Array, progress: Progress | None
) -> Path:
    end = float(times[-1]) if times.size else 0.0
    motion, has_low = start_motion(scene, options, end < 0.0), options.has_extended_precision
    result, high, low, rest = motion.record_tangents(times, has_low, progress)
    tangents = calls.TangentData.from_flat_arrays(high, low, rest, options.tangents)
    path = paths.build_path_from_core_result(scene, options, result)
    path = replace(path, _tangent_data=tangents)
    if result[0] != "OK":
        raise paths.make_stop_exception(result[0], path, end)
    return report_final_time(path, progress)


@overload
def stream(
    scene: Scenes,
    t: Numbers,
    method: MethodName = "auto",
    *,
    chunk: int | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    **controls: Unpack[StreamKeywords],
) -> Iterator[EnsemblePath]: ...
@overload
def stream(
    scene: Scene,
    t: Numbers | Iterator[float],
    method: MethodName = "auto",
    *,
    chunk: int | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    **controls: Unpack[StreamKeywords],
) -> Iterator[Path]: ...
def stream(
    scene: Scene,
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
) -> Iterator[Path] | Iterator[EnsemblePath]:
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

    For many tops, yield a kreisel.Path for each group of consecutive tops in C order. Each path has
    at most `chunk` states in total (default 2**20), but at least one top. t must not be an
    iterator. threads, executor and progress are as in kreisel.solve.

    The statistics of each path refer to the entire run up to the last state of the path. Each path
    contains the events that occurred after the end of the previous path. For one top, the path that
    contains a terminal event is the last one.

    Raises the same exceptions as kreisel.solve: immediately for invalid arguments, and while the
    paths are iterated over for failed runs and for invalid times from an iterator.
    """
    most = None if chunk is None else as_int("chunk", chunk, 1)
    refuse_step_search(method)
    keys = {"step": step, "tol": tol, "digits": digits, "every": every, "max_steps": max_steps}
    options = checks.make_options(method, **keys, want=want, events=events)
    options = options.for_tops(validate_type("scene", scene, Scene))
    callback = checks.validate_progress_callback(progress)
    if not scene.shape:
        _refuse_arguments_of_many(threads=threads, executor=executor)
        is_back, times = checks.find_time_direction(t)
        chunks = checks.iterate_time_chunks(
            times, options.step, options.every, most or checks.CHUNK_SIZE, None
        )
        return Run(scene, options, is_back)._yield_path_per_chunk(chunks, callback)
    if isinstance(t, Iterator):
        raise TypeError("times of many tops must be a number, a list or an array, not an iterator")
    if options.events:
        refuse_kinetic(scene, options.events)
    pool = WorkerPool(checks.validate_thread_count(threads, executor), executor)
    rows, row = checks.validate_times(scene, t, options), scene.ravel()
    size = max(1, (most or 1 << 20) // max(1, rows.shape[-1]))

    def yield_paths() -> Iterator[EnsemblePath]:
        kind, runner = EnsemblePath._of_many, select_slice_runner(options)
        for begin in range(0, len(row), size):
            some = slice(begin, begin + size)
            times = rows[some] if rows.ndim == 2 else rows
            yield run_ensemble(kind, row[some], times, options, pool, runner)
            if callback is not None:
                callback(min(1.0, (begin + size) / len(row)))

    return yield_paths()


def reduce(
    scene: Scene,
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
    """Compute statistics of the path of one or of many tops, without storing the states.

    reductions  a mapping from names of quantities or of their components to one or several of min,
                max, mean, variance, last, where_min, where_max, as in {"nutation": ("min", "max")}

    The other arguments are the same as for kreisel.solve. Memory use is independent of the number
    of times.

        >>> import kreisel as kr
        >>> tops = kr.scenes.cusps.vary(gravity=[0.5, 1.0])
        >>> kr.reduce(tops, [0.0, 0.5, 1.0], {"nutation": "max"})["nutation"]["max"].round(3)
        array([1.023, 1.13 ])

    Raises TypeError or ValueError for invalid arguments, before any computation starts. Raises
    kreisel.Interrupted after Ctrl-C; its attribute `result` contains the results obtained so far.
    Raises kreisel.Error if the computation for one top fails. Of many tops, those that failed have
    the value NaN, `status` has the reason, and check() raises kreisel.Error for the first of them.
    """
    if reductions is None:
        raise TypeError("reductions must name quantities, as in {'nutation': ('min', 'max')}")
    keys = {"step": step, "tol": tol, "digits": digits, "every": every, "max_steps": max_steps}
    options = checks.make_options(method, **keys, reduce=reductions)
    options = options.for_tops(validate_type("scene", scene, Scene), is_many=True)
    pool = WorkerPool(checks.validate_thread_count(threads, executor), executor)
    callback = checks.validate_progress_callback(progress)
    times = checks.validate_times(scene, t, options)
    result = run_ensemble(Reductions, scene, times, options, pool, LANES, callback)
    return result if scene.shape else result.check()


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

    For many tops with times `t`, a few tops are integrated for a limited number of steps to
    estimate the run time.

    t       the times as in kreisel.solve; if given, the plan includes the number of states
    reduce  for many tops: the reductions of kreisel.reduce, instead of states

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
    if isinstance(method, str) and method == checks.GEOMETRIC:
        raise ValueError("method='geometric' chooses by trial runs: call solve, and see path.plan")
    options = checks.make_options(
        method, step=step, tol=tol, digits=digits, every=every, want=want, reduce=reduce
    )
    is_one = not validate_type("scene", scene, Scene).shape
    if is_one:
        _refuse_arguments_of_many(threads=threads, reduce=reduce)
    options = options.for_tops(scene, t if is_one else None)
    times = None if t is None else checks.validate_times(scene, t, options)
    states = None if times is None else times.shape[-1]
    if is_one:
        return make_solve_plan(scene, options, states, times=times)
    count, first = checks.validate_thread_count(threads), None
    if scene.size:
        member = checks.get_member_by_flat_index(scene, 0)
        first = make_solve_plan(member, options.for_member(member), states)
    made = make_plan_of_tops(scene, options, first, states, count)
    return made if times is None else _add_estimate_of_run_time(made, scene, times, options)


def _add_estimate_of_run_time(plan: Plan, tops: Scene, t: Array, options: Options) -> Plan:
    """Return the plan with a run time extrapolated from a limited number of steps of a few tops."""
    if not tops.size or not t.shape[-1]:
        return replace(plan, seconds=0.0)
    indices = np.unique(np.linspace(0, tops.size - 1, _SAMPLES).astype(np.int64))
    n, every = indices.size, t[indices] if t.ndim == 2 else t
    times = every[..., :_MAX_STATES]
    options = replace(options, max_steps=min(options.max_steps or _MAX_STEPS, _MAX_STEPS))
    rows = calls.EnsembleBuffers.allocate_buffers(n, times.shape[-1], options)
    begin = time.perf_counter()
    select_slice_runner(options).run(calls.Slice(rows, options, tops.ravel()[indices], 0, n, times))
    duration = time.perf_counter() - begin
    is_complete = rows.done == times.shape[-1]
    part = np.where(is_complete, rows.done / every.shape[-1], np.inf)
    end = np.abs(np.broadcast_to(every[..., -1], part.shape))
    with np.errstate(invalid="ignore", divide="ignore"):
        time_share = np.where(end > 0.0, np.abs(rows.reached) / end, np.inf)
    done = float(np.maximum(np.minimum(part, time_share), 1e-9).mean())
    return replace(plan, seconds=duration / done * tops.size / n / plan.threads, measured=n)


def load(file: str | os.PathLike[str]) -> Path | Scene | Run:
    """Load a path, a scene or a run from a file.

    A path written by path.save is restored bit for bit. A scene is read from a TOML file, a run
    from a checkpoint written by run.save.

        >>> import os, tempfile
        >>> import kreisel as kr
        >>> path = kr.solve(kr.scenes.thesis, [1.0, 2.0])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path.save(os.path.join(folder, "top.npz"))
        ...     kr.load(os.path.join(folder, "top.npz"))
        <kreisel.Path: 2 states, t = 1 .. 2; exact, 2 steps>

    Raises TypeError if `file` is not a str or a path of text. Raises OSError if the file cannot be
    read, and ValueError if it is damaged, or contains neither a path nor a scene nor a run. Loading
    a file does not execute any code in it. Memory use is bounded by the size of the file.
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
            try:
                saved = read_archive(stream, status.st_size)
            except ValueError as error:
                raise ValueError(f"{name} is not a saved path: {error}") from None
            if len(saved) == 4:
                return EnsemblePath._of_many(*saved)
            path, found = saved
            events = None if found is None else Events(Path(**found[0]), *found[1:])
            return Path(**path, _events=events)
    kinds = "a saved path or run, nor a scene in TOML"
    if status.st_size > _MAX_SCENE_BYTES:
        raise ValueError(f"{name} is neither {kinds}, which would be smaller")
    try:
        return Scene.from_toml(File(name))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{error}; the file is neither {kinds}") from None
