"""Comparisons of methods."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from .._model.scene import Scene, validate_one_top
from .._options.methods import methods as known
from .._options.methods import resolve_method
from .._options.options import (
    check_resolvable_horizon,
    make_options,
    time_array,
    validate_progress_callback,
)
from .._results.path import Path, check_is_one
from .._results.results import Error, Interrupted
from .._results.tables import encode_table_as_csv
from .._solve.solve import solve
from .._utils.arguments import Numbers, as_int, as_positive, short_repr, spell
from .._utils.files import atomic_write
from .._utils.html import format_html_table
from .._utils.processes import Progress
from .._utils.quantity_attributes import MethodName
from ..quaternion import attitude_error
from ..scenes import name_of

_TRUTH_TOL = 1e-13


@dataclass(frozen=True)
class Row:
    """The result of one method for one step size or tolerance.

    seconds         the shortest run time of the repeats [s]
    median          the median of the run times [s]
    attitude_error  the largest angle between attitude and true attitude [rad]
    energy_error    max |E - E0| / max (T + mass * |gravity| * |com|); E is the energy, E0 its
                    initial value, and T the kinetic energy
    failure         the reason why the run failed, or empty. After a failure, errors and times are
                    NaN
    """

    scene: str
    method: MethodName
    step: float | None
    tol: float | None
    seconds: float
    median: float
    steps: int
    evaluations: int
    attitude_error: float
    energy_error: float
    failure: str = ""


@dataclass(frozen=True)
class Table:
    """A table with one row for each step size or tolerance of each method."""

    rows: tuple[Row, ...]

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __getitem__(self, i: int) -> Row:
        return self.rows[i]

    def __str__(self) -> str:
        lines = [list(_COLUMNS), *self._format_cells()]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        return "\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)

    def _format_cells(self) -> list[list[str]]:
        return [
            [
                f"{value:.3g}" if isinstance(value, float) else "" if value is None else str(value)
                for value in (getattr(row, name) for name in _COLUMNS)
            ]
            for row in self.rows
        ]

    def _repr_html_(self) -> str:
        return format_html_table(self._format_cells(), _COLUMNS)

    def to_csv(self, path: str | os.PathLike[str] | None = None) -> str:
        """Return the table as CSV in full precision; if `path` is given, also write it to `path`.

        Missing values are empty.
        """
        table = {name: [getattr(row, name) for row in self.rows] for name in _COLUMNS}
        text = encode_table_as_csv(table).decode()
        if path is not None:
            atomic_write(path, text.encode())
        return text


_COLUMNS = tuple(column.name for column in fields(Row))


def compare(
    scene: Scene,
    t: Numbers,
    methods: Iterable[MethodName] | None = None,
    steps: Iterable[float] = (),
    tols: Iterable[float] = (),
    truth: Path | MethodName = "auto",
    repeats: int = 5,
    progress: Progress | None = None,
) -> Table:
    """Measure the errors and run times of several methods for the same motion.

    The repetitions of the methods are interleaved, so other load on the machine affects all methods
    equally.

    t         times, as in kreisel.solve. Errors are maxima over the states at these times only: a
              number compares only the end; numpy.linspace(0, 10, 101) compares the whole path
    methods   names of methods; by default, all methods that apply to the scene
    steps     steps for the methods of fixed step
    tols      tolerances for the other methods; by default, each method uses its default tolerance
    truth     the reference: a path at the same times, or the name of a method. taylor is run with
              20 digits, other methods with tol 1e-13 or a sixteenth of the smallest step; 'auto' is
              the method that kreisel.solve would choose
    progress  function that is called after each run with the fraction of the runs that are done, up
              to 1; an exception that it raises stops the comparison

        >>> import kreisel as kr
        >>> table = kr.compare(kr.scenes.thesis, 10, ["exact", "rk4"], steps=[0.1, 0.05])
        >>> [(row.method, row.step, row.attitude_error < 1e-3) for row in table]
        [('exact', None, True), ('rk4', 0.1, True), ('rk4', 0.05, True)]

    Raises the same exceptions as kreisel.solve for invalid arguments, before any run starts. If a
    run fails, the reason is stored in the field `failure` of the table row. Ctrl-C raises
    kreisel.Interrupted, whose attribute `result` has a row for each completed run.
    """
    validate_one_top("scene", scene)
    lists: list[list[float]] = []
    for name, values in (("steps", steps), ("tols", tols)):
        if not isinstance(values, Iterable):
            given = short_repr(values)
            raise TypeError(f"{name} must be a list, as in {name}=[1e-3], not {given}")
        lists.append([as_positive(name, x) for x in values])
    step_sizes, tolerances = lists
    if methods is None:
        methods = [method.name for method in known.values() if method.suits(scene)]
    if isinstance(methods, str) or not isinstance(methods, Iterable):
        raise TypeError(f"{spell('methods')} must be a list of names, not {short_repr(methods)}")
    runs: list[dict[str, Any]] = []  # the method of each, with its step or tolerance
    for name in methods:
        method = resolve_method(name, scene)
        if method.adaptive:
            each = tolerances if tolerances and not method.exact else [None]
            runs += [{"method": name, "step": None, "tol": tol} for tol in each]
        elif step_sizes:
            runs += [{"method": name, "step": step, "tol": None} for step in step_sizes]
        else:
            raise ValueError(f"the method {name!r} has a fixed step: give {spell('steps')}")
    for run in runs:
        make_options(**run).for_tops(scene)
    times = time_array(t, None, None)
    if times.size:
        check_resolvable_horizon(scene, float(times[-1]), None)
    if isinstance(truth, Path):
        check_is_one("truth must be a path of", truth)
        if not np.array_equal(times, truth.t):
            raise ValueError("truth must be a path at the requested times")
    total = as_int("repeats", repeats, 1) * len(runs)
    report_progress = validate_progress_callback(progress)
    reference: Path | None = None
    seconds: list[list[float]] = [[] for _ in runs]
    paths: dict[int, Path | None] = {}
    failures: dict[int, str] = {}

    def build_table() -> Table:
        rows, nan = [], math.nan
        for i, run in enumerate(runs):
            path, failure, spent = paths.get(i), failures.get(i, ""), seconds[i]
            good = None if failure else path
            if reference is None or not (spent or failure):
                continue
            row = Row(
                scene=name_of(scene),
                **run,
                seconds=min(spent, default=nan),
                median=nan if failure else float(np.median(spent)),
                steps=path.stats.steps if path else 0,
                evaluations=path.stats.evaluations if path else 0,
                attitude_error=float(attitude_error(good.q, reference.q).max(initial=0.0))
                if good
                else nan,
                energy_error=good.energy_error if good else nan,
                failure=failure,
            )
            rows.append(row)
        return Table(tuple(rows))

    try:
        reference = truth if isinstance(truth, Path) else _solve_truth(scene, t, truth, step_sizes)
        for done in range(total):
            i, begin = done % len(runs), time.perf_counter()
            try:
                paths[i] = solve(scene, t, **runs[i])
                seconds[i].append(time.perf_counter() - begin)
            except Error as error:
                paths[i], failures[i] = error.path, str(error)
            except ValueError as error:  # a step that turns out to be too large
                failures[i] = str(error)
            if report_progress is not None:
                report_progress((done + 1) / total)
    except KeyboardInterrupt:
        table = build_table()
        message = f"interrupted: {len(table)} of {len(runs)} runs were completed"
        raise Interrupted(message, result=table) from None
    return build_table()


def _solve_truth(scene: Scene, t: Numbers, name: MethodName, step_sizes: list[float]) -> Path:
    method = resolve_method(name, scene)
    if method.digits:
        return solve(scene, t, name, digits=20)
    if method.adaptive:
        return solve(scene, t, name, tol=_TRUTH_TOL)
    if not step_sizes:
        raise ValueError(f"the method {name!r} has a fixed step: give {spell('steps')}")
    return solve(scene, t, name, step=min(step_sizes) / 16.0)
