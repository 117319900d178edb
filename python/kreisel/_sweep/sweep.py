"""kreisel.sweep: more tops than a machine's memory holds, in parts on the disk."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, Literal

from .._model.scene import Ensemble
from .._options.ensemble_options import ReductionSpec, parse_threads
from .._options.solve_options import Progress, parse_progress
from .._solve.run import EventSpec
from .._utils.errors import warn
from .._utils.literals import MethodName, QuantityName
from .._utils.validation import Numbers, check_type, short_repr
from ..events import Event
from .plan_file import from_file
from .runner import PartRunner
from .source import Source
from .store import DAMAGED, DONE, FOREIGN, OLD, SweepStore, create_or_open
from .sweep_plan import SweepPlan, make_plan
from .sweep_result import SweepResult
from .task import WORDS, Verb, parse_task


class SweepInterrupted(KeyboardInterrupt):
    """Ctrl-C during kreisel.sweep. `.sweep` is what kreisel.read_sweep reads: all parts that were
    finished; the same call makes the others."""

    __module__ = "kreisel"  # a traceback names what users catch

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
    to: str | os.PathLike[str],
    verb: Verb = "solve",
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
    part: int | None = None,
    parts: range | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> SweepResult:
    """Moves tops part by part into files of a folder, and goes on where it was ended: by Ctrl-C, by
    a crash, on another machine.

    A part is a file with a row for each of its tops: number, start, how it went, and what solve was
    asked for, with units [M L T]; in Parquet, or where pyarrow is not installed numpy's. It depends
    on the plan and its own number alone, not on who makes it, when, or beside what. A top that
    fails is a row as others are, whose status is not 0. What stands in the folder already is looked
    at, bit by bit; what is missing or damaged is made. Names of parts in the folder belong to the
    sweep: whatever file has one and is not that part of the plan counts as damaged, and is replaced
    with a warning. A folder, or a whole part of another plan, is never replaced: FileExistsError.

    tops      a kreisel.Source or kreisel.Ensemble; or the name of a TOML file that has all: t and
              the words to `part`, scene (a name, a file or a table), and one of the tables [grid],
              [random], [scatter], [columns] with the words of that maker of Source, where values
              may be { from = 0, to = 20, n = 1000 }; events are tables [[events]], each with the
              `event` of kreisel.events and its words, and so is [event] of a section
    t         a number or a list of times, for all tops; this and the words to `reduce` are those of
              kreisel.solve
    to        the folder: one that is not there yet, or empty, or has parts of the same plan
    verb      what becomes of each top; with its own words, which are those of kreisel.<verb>:
              "solve"; "lyapunov", "megno" or "oli": t, direction, tol, max_steps, and the columns
              are the verb's name, certificate, t and <verb>_curve; "section": event, n, max_wait (a
              number), tol, digits, max_steps, and the columns are events, how many were met, and
              event_t, event_q_w, ..., event_m_z, which are the states
    part      tops of a part; left out: 131072, or fewer so that a part takes about 64 MB
    parts     which parts this call is to make, as range(0, 100); left out: all; range(0) plans only
    threads   how many make a part, one part after the other; left out: all processors
    executor  of concurrent.futures, in their place: each worker makes a part on one thread. Of a
              Dask client: client.get_executor()
    progress  called now and then with the part of this call's tops that is done, 0 .. 1

        >>> import kreisel as kr, numpy as np, tempfile
        >>> spin, tilt = np.linspace(0, 20, 100), np.linspace(0.1, 1, 100)
        >>> source = kr.Source.grid(kr.scenes.sleeping, spin=spin, tilt=tilt)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = kr.sweep(source, 10, to=folder + "/runs", reduce={"nutation": "max"})
        ...     done, done["nutation_max"].shape
        (<kreisel.SweepResult of shape (100, 100): 1 of 1 parts>, (100, 100))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     chaos = kr.sweep(source[:8], 1000, to=folder, verb="lyapunov")
        ...     chaos["lyapunov"].shape, chaos["lyapunov_curve"].shape, chaos.units["lyapunov"]
        ((8,), (8, 32), 'T^-1')

    Raises before anything runs TypeError and ValueError for words, ValueError for a folder of
    another plan, FileExistsError for one of something else, OSError where it cannot be written.
    OSError too where the disk is full, RuntimeError where an executor loses parts,
    kreisel.SweepInterrupted for Ctrl-C; what is done then stays.
    """
    given = _task_arguments(locals())  # all words by their names, before there is anything else
    plan = _plan(tops, verb, given, part)
    callback = parse_progress(progress)
    number = parse_threads(threads, executor)
    chosen = _choose_parts(parts, plan.parts)
    folder = create_or_open(to, plan)
    return _make_plan(
        PartRunner(folder, _to_make(folder, chosen), callback), chosen, number, executor
    )


def _task_arguments(words: Mapping[str, Any]) -> dict[str, Any]:
    """Select the arguments of sweep that belong to its task."""
    left_out = {"method": "auto", "max_steps": 0}
    told = {}
    for name in WORDS:
        value, default = words[name], left_out.get(name)
        if value is not None and not (type(value) is type(default) and value == default):
            told[name] = value
    return told


def _make_plan(
    shift: PartRunner, chosen: range, threads: int, executor: Executor | None
) -> SweepResult:
    """The sweep with these parts made. SweepInterrupted for Ctrl-C."""
    folder = shift.folder
    try:
        if executor is None:
            shift.here(threads)
        else:
            shift.by(executor)
    except KeyboardInterrupt:
        found = SweepResult(folder)
        done = sum(i in chosen for i in found.done)
        left = f"{len(chosen) - done} of {len(chosen)} parts are left"
        said = f"interrupted: {left}; the same call goes on in {folder.place}"
        raise SweepInterrupted(said, found) from None
    return SweepResult(folder)


def _plan(tops: Any, verb: str, words: Mapping[str, Any], part: int | None) -> SweepPlan:
    if isinstance(tops, (str, os.PathLike)):
        if verb != "solve" or words or part is not None:
            raise ValueError(f"{os.fspath(tops)} is a whole plan: give no more words than to")
        return from_file(Path(tops))
    source = Source.of(tops) if isinstance(tops, Ensemble) else check_type("tops", tops, Source)
    return make_plan(source, parse_task(verb, words), part)


def _choose_parts(parts: object, count: int) -> range:
    """The parts that are asked for."""
    if parts is None:
        return range(count)
    if not isinstance(parts, range) or parts.step != 1:
        raise TypeError(
            f"parts must be a range of numbers, as range(0, 100), not {short_repr(parts)}"
        )
    if parts and not (parts.start >= 0 and parts.stop <= count):
        raise ValueError(f"parts must be among 0 to {count}, not {parts.start} to {parts.stop}")
    return parts


def _to_make(folder: SweepStore, chosen: range) -> list[int]:
    """Return the parts that are missing or damaged, and warn of those that are damaged. Raises
    FileExistsError for a folder, or a part of another plan, in the place of a part."""
    stand = {i: folder.look(i) for i in chosen}
    for i, how in stand.items():
        if how == FOREIGN:
            raise folder.refusal(i)
    for what in (DAMAGED, OLD):
        found = [i for i, how in stand.items() if how == what]
        if found:
            first = f"part {found[0]}" + (f" and {len(found) - 1} more" if found[1:] else "")
            warn(f"{folder.place}: {first} made anew, {what}")
    return [i for i, how in stand.items() if how != DONE]
