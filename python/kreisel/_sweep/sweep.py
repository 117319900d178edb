"""kreisel.sweep: computation of ensembles larger than memory, written to disk in parts."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, Literal

from .._model.scene import Ensemble
from .._options.ensemble_options import ReductionSpec, validate_thread_count
from .._options.solve_options import Progress, validate_progress_callback
from .._solve.run import EventSpec
from .._utils.errors import warn_user
from .._utils.quantity_attributes import MethodName, QuantityName
from .._utils.validation import Numbers, short_repr, validate_type
from ..events import Event
from .plan_file import read_sweep_plan
from .runner import SweepPartsRunner
from .source import Source
from .store import DAMAGED, DONE, FOREIGN, OLD, SweepStore, create_or_open_sweep_store
from .sweep_plan import SweepPlan, make_sweep_plan
from .sweep_result import SweepResult
from .task import ARGUMENTS, TaskName, build_task_from_arguments


class SweepInterrupted(KeyboardInterrupt):
    """Exception raised by Ctrl-C during a sweep; calling kreisel.sweep again continues the sweep.

    sweep  a kreisel.SweepResult with the finished parts
    """

    __module__ = "kreisel"  # a traceback then shows the public name

    def __init__(self, message: str, sweep: SweepResult) -> None:
        super().__init__(message)
        self.sweep = sweep

    def __reduce__(self) -> tuple[type[SweepInterrupted], tuple[str, SweepResult]]:
        return type(self), (str(self), self.sweep)


def sweep(
    tops: Source | Ensemble | str | os.PathLike[str],
    t: Numbers | None = None,
    method: MethodName | Literal["geometric"] = "auto",
    *,
    folder: str | os.PathLike[str],
    task: TaskName = "solve",
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    error: float | None = None,
    want: Iterable[QuantityName] | None = None,
    events: EventSpec | None = None,
    reduce: ReductionSpec | None = None,
    direction: Sequence[float] | None = None,
    event: Event | None = None,
    n: int | None = None,
    max_wait: float | None = None,
    part_size: int | None = None,
    parts: range | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> SweepResult:
    """Run a task on many tops, and store the results in a folder, as one file per part.

    To resume a sweep that was interrupted, repeat the call, possibly on a different machine. Each
    part is a Parquet file with one row per top. The columns contain the index, parameters, status
    and results of each top. The units [M L T] of the columns are stored in the file. The contents
    of each part are determined, bit for bit, by the plan and the part number. A nonzero status
    means that the computation for the top failed.

    Existing part files are verified by their checksums, and damaged parts are computed again. The
    names of part files are reserved; do not use them for other files in the folder. An invalid file
    that has the name of a part file is replaced, and a warning is issued. Folders and complete
    parts that belong to a different plan are never replaced. Requires pyarrow: pip install
    'kreisel[sweep]'.

    tops       a kreisel.Source or kreisel.Ensemble; or the name of a TOML file. The file contains
               all arguments up to part_size except folder, and the scene (a name, a file or a
               table). It has one
               of the tables [grid], [random], [scatter], [columns], with the arguments of the
               constructor of Source of this name. { from = 0, to = 20, n = 1000 } means 1000 evenly
               spaced values. Each event is a table [[events]] with the name of a function of
               kreisel.events as `event`, and the arguments of this function. The event of a section
               is a table [event]
    t          a number or a list of times, for all tops; t and the arguments up to reduce are those
               of kreisel.solve and kreisel.reduce
    folder     the folder of the parts: new, empty, or with parts of the same plan
    task       the name of the function that is called for the tops. "solve" is kreisel.solve or,
               with `reduce`, kreisel.reduce. "lyapunov", "megno" and "oli" have the arguments t,
               direction, tol and max_steps. Their columns are <task>, certificate, is_chaotic,
               is_doubtful, t and <task>_curve. "section" has the arguments event, n, max_wait (a
               number), tol, digits and max_steps. Its columns are reached, steps, events (the
               number of states) and event_t, event_q_w, ..., event_m_z
    part_size  the number of tops in a part; default: 131072, or fewer so that a part has at most
               about 64 MB
    parts      the parts that this call computes, as range(0, 100); default: all; range(0): none
    threads    the number of threads that compute each part; parts are computed one after the
               other; default: the number of processors
    executor   an executor of concurrent.futures instead of threads; each worker computes a part in
               one thread. For a Dask client use client.get_executor()
    progress   a function called with the finished fraction of the tops of this call, 0 .. 1

        >>> import kreisel as kr, numpy as np, tempfile
        >>> spin, tilt = np.linspace(0, 20, 100), np.linspace(0.1, 1, 100)
        >>> source = kr.Source.grid(kr.scenes.sleeping, spin=spin, tilt=tilt)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = kr.sweep(source, 10, folder=folder + "/runs", reduce={"nutation": "max"})
        ...     done, done["nutation_max"].shape
        (<kreisel.SweepResult of shape (100, 100): 1 of 1 parts>, (100, 100))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     chaos = kr.sweep(source[:8], 1000, folder=folder, task="lyapunov")
        ...     chaos["lyapunov"].shape, chaos["lyapunov_curve"].shape, chaos.units["lyapunov"]
        ((8,), (8, 32), 'T^-1')

    Raises TypeError or ValueError for invalid arguments, before any computation starts. Raises
    ValueError if the folder contains a different plan, and FileExistsError if it contains files but
    no plan. Raises OSError if the folder cannot be written, and ImportError if pyarrow is not
    installed. During the computation, raises OSError if a file cannot be written, and RuntimeError
    if an executor loses parts. Ctrl-C raises kreisel.SweepInterrupted. Finished parts are kept.
    """
    arguments = _select_nondefault_arguments(
        locals()
    )  # first, so that locals() contains only the arguments
    plan = _make_sweep_plan(tops, task, arguments, part_size)
    callback = validate_progress_callback(progress)
    count = validate_thread_count(threads, executor)
    part_range = _validate_part_range(parts, plan.parts)
    store = create_or_open_sweep_store(folder, plan)
    runner = SweepPartsRunner(store, _list_incomplete_parts(store, part_range), callback)
    return _run_selected_sweep_parts(runner, part_range, count, executor)


def _select_nondefault_arguments(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of a task that differ from their defaults."""
    defaults = {"method": "auto", "max_steps": 0}
    arguments = {}
    for name in ARGUMENTS:
        value, default = values[name], defaults.get(name)
        if value is not None and not (type(value) is type(default) and value == default):
            arguments[name] = value
    return arguments


def _run_selected_sweep_parts(
    runner: SweepPartsRunner, part_range: range, threads: int, executor: Executor | None
) -> SweepResult:
    """Compute the selected parts of a sweep, and return the results of all parts that exist.

    Raises SweepInterrupted after Ctrl-C.
    """
    store = runner.store
    try:
        if executor is None:
            runner.compute_parts_locally(threads)
        else:
            runner.compute_parts_on_executor(executor)
    except KeyboardInterrupt:
        result = SweepResult(store)
        done = sum(i in part_range for i in result.present)
        remainder = f"{len(part_range) - done} of {len(part_range)} parts are left"
        message = (
            f"interrupted: {remainder}; repeating the call resumes the sweep in {store.folder}"
        )
        raise SweepInterrupted(message, result) from None
    return SweepResult(store)


def _make_sweep_plan(
    tops: Any, task: str, arguments: Mapping[str, Any], part_size: int | None
) -> SweepPlan:
    if isinstance(tops, (str, os.PathLike)):
        if task != "solve" or arguments or part_size is not None:
            raise ValueError(
                f"{os.fspath(tops)} is a whole plan: give no other arguments than folder"
            )
        return read_sweep_plan(Path(tops))
    source = Source.of(tops) if isinstance(tops, Ensemble) else validate_type("tops", tops, Source)
    return make_sweep_plan(source, build_task_from_arguments(task, arguments), part_size)


def _validate_part_range(parts: object, count: int) -> range:
    """Validate and return the requested range of part numbers; the default is all parts."""
    if parts is None:
        return range(count)
    if not isinstance(parts, range) or parts.step != 1:
        raise TypeError(
            f"parts must be a range of numbers such as range(0, 100), not {short_repr(parts)}"
        )
    if parts and not (parts.start >= 0 and parts.stop <= count):
        raise ValueError(f"parts must lie between 0 and {count}, not {parts.start} to {parts.stop}")
    return parts


def _list_incomplete_parts(store: SweepStore, part_range: range) -> list[int]:
    """Return the requested parts that must be computed, and warn about damaged and outdated files.

    Raises FileExistsError if the name of a part is used by a folder, or by a part of a different
    plan.
    """
    numbers: list[int] = []
    replacements: dict[str, list[int]] = {DAMAGED: [], OLD: []}
    for i in part_range:
        status = store.determine_part_status(i)
        if status == FOREIGN:
            raise store.make_misplaced_file_error(i)
        if status != DONE:
            numbers.append(i)
        if status in replacements:
            replacements[status].append(i)
    for status, parts in replacements.items():
        if parts:
            first = f"part {parts[0]}" + (f" and {len(parts) - 1} more" if parts[1:] else "")
            warn_user(f"{store.folder}: {first} computed again, {status}")
    return numbers
