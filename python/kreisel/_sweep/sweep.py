"""Sweeps of many tops, and their results."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor
from functools import cached_property, partial
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from .._model.scene import Scene
from .._options import options
from .._options.options import EventSpec, ReductionSpec
from .._results.calls import STATUSES, EventColumns
from .._results.path import Events, build_event_path
from .._results.path import Path as TopPath
from .._results.results import Interrupted
from .._results.tables import ColumnTable, TableColumn
from .._utils import arguments as checks
from .._utils.arguments import Numbers, optional_dependency, short_repr
from .._utils.processes import Progress
from .._utils.quantity_attributes import MethodName, QuantityName
from ..events import Event
from . import plan as plans
from .plan import DAMAGED, DONE, EVENT, MISSING, OLD, REPAIR, TIMES, TaskName
from .source import PARQUET, Source

if TYPE_CHECKING:
    from pandas import DataFrame
    from pyarrow import Table
    from xarray import Dataset

    from .store import SweepStore

Column = npt.NDArray[Any]


@checks.make_frozen_class_decorator("results of kreisel.sweep are read-only")
class SweepResult:
    """The results of a sweep, read from its folder.

    `result[name]` is the column with this name, with the shape of the sweep, followed by the number
    of times if it has values at times. Only the requested columns are read. Iteration yields one
    mapping from column names to arrays for each existing part.

    folder   the folder that contains the parts
    shape, axes, size  as in the source
    parts    the number of parts
    plan     the plan as in plan.json
    hash     the SHA-256 of the plan, which is also stored in every part
    columns  the names of the columns
    units    the dimension [M L T] of each column

    Columns and tables raise ValueError if a part is missing. If the sweep was opened with
    partial=True, missing and damaged parts are ignored, and `result["top"]` has the indices of the
    tops.
    """

    folder: str
    shape: tuple[int, ...]
    axes: tuple[str, ...]
    size: int
    parts: int
    hash: str
    _store: SweepStore
    _partial: bool
    _found: list[int]

    def __init__(self, store: SweepStore, partial: bool = False) -> None:
        plan, source = store.plan, store.plan.source
        values = {"shape": source.shape, "axes": source.axes, "size": source.size}
        values |= {"folder": str(store.folder), "parts": plan.parts, "hash": plan.hash}
        found = store.list_existing_parts()
        self.__dict__.update(values, _store=store, _partial=partial, _found=found)

    @cached_property
    def present(self) -> list[int]:
        """The numbers of the existing parts; with partial=True, damaged parts are excluded."""
        if not self._partial:
            return self._found
        return [i for i in self._found if self._store.determine_part_status(i) in (DONE, OLD)]

    def __repr__(self) -> str:
        done = f"{len(self.present)} of {self.parts} parts"
        return f"<kreisel.SweepResult of shape {self.shape}: {done}>"

    @property
    def missing(self) -> list[int]:
        """The numbers of the parts that are not in `present`."""
        present = {*self.present}
        return [i for i in range(self.parts) if i not in present]

    @property
    def plan(self) -> dict[str, Any]:
        """The plan, as stored in plan.json."""
        return dict(self._store.plan.as_json)

    @cached_property
    def _schema(self) -> dict[str, TableColumn]:
        """The columns of a part of the sweep, without rows."""
        if not self.present:
            raise ValueError(f"{self.folder} has no parts yet")
        return self._store.read_part(self.present[0], [])

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the columns, with event columns last."""
        return tuple(self._schema)

    @property
    def units(self) -> dict[str, str]:
        """The dimension [M L T] of each column, or an empty string for a dimensionless column."""
        return {name: column.unit for name, column in self._schema.items()}

    def __getitem__(self, name: str) -> Column:
        """Return the values of a column for all tops, or for all events sorted by top.

        Raises KeyError for an unknown name.
        """
        if name not in self._schema:
            raise KeyError(checks.unknown_name_message("column", str(name), self.columns))
        values: Column = np.concatenate([part[name].values for part in self._read_parts([name])])
        if len(self.present) == self.parts and self._schema[name].dims != EVENT:
            values = values.reshape(*self.shape, *values.shape[1:])
        values.flags.writeable = False
        return values

    def _read_parts(self, names: list[str] | None = None) -> Iterator[dict[str, TableColumn]]:
        """Return the parts, or their columns `names`; refuse missing parts unless partial=True."""
        missing_count = self.parts - len(self.present)
        if missing_count and not self._partial:
            present = {*self.present}
            numbers = islice((str(i) for i in range(self.parts) if i not in present), 8)
            raise ValueError(
                f"{missing_count} of {self.parts} parts are missing: {', '.join(numbers)}"
                f"{', ...' if missing_count > 8 else ''}; repeating the call of kreisel.sweep "
                "computes them, and read_sweep(folder, partial=True) reads the others"
            )
        return (self._read_part(i, names) for i in self.present)

    def _read_part(self, i: int, names: list[str] | None = None) -> dict[str, TableColumn]:
        """Read a part, with the names of the statuses in place of their codes."""
        part = self._store.read_part(i, names)
        if "status" in part:
            codes = part["status"].values
            part["status"] = part["status"]._replace(values=np.array(STATUSES)[codes])
        return part

    def __iter__(self) -> Iterator[dict[str, Column]]:
        """Yield the results in each existing part as a mapping from column names to arrays."""
        return map(self.part, self.present)

    def part(self, i: int) -> dict[str, Column]:
        """Return part `i` of the sweep as a mapping from column names to arrays.

        Raises IndexError if the part does not exist.
        """
        number = checks.as_int("the number of a part", i, 0)
        if number >= self.parts:
            raise IndexError(f"there is no part {number}: the sweep has {self.parts} parts")
        if number not in self._found:
            raise IndexError(f"part {number} of {self.parts} is missing")
        return {name: column.values for name, column in self._read_part(number).items()}

    def check(self) -> SweepResult:
        """Verify the checksums of all existing parts, and return this SweepResult.

        Raises ValueError for the first damaged part. Raises FileExistsError if a folder, or a part
        of a different plan, has the file name of a part of this sweep.
        """
        for i in self._found:
            if self._store.determine_part_status(i, refuses_foreign=True) == DAMAGED:
                raise ValueError(f"{self._store.part_file_path(i)} is damaged; {REPAIR}")
        return self

    def verify(self) -> dict[str, list[int]]:
        """Verify the checksums of all parts, and return the numbers of the parts grouped by status.

        The status is "done", "missing", "damaged", "of another version" or "foreign": a folder, or
        a complete part of a different plan, has the file name of the part.
        """
        parts = self._verify_existing_parts()
        existing = {*chain(*parts.values())}
        missing = [i for i in range(self.parts) if i not in existing]
        return parts | ({MISSING: missing} if missing else {})

    def _verify_existing_parts(self) -> dict[str, list[int]]:
        """Return the numbers of the parts whose files exist, grouped by status."""
        parts: dict[str, list[int]] = {DONE: []}
        for i in self._store.list_existing_parts():
            parts.setdefault(self._store.determine_part_status(i), []).append(i)
        parts.pop(MISSING, None)  # removed in the meantime
        return parts

    @property
    def events(self) -> Events | None:
        """The events of all tops, or None if no events were requested, as for sections.

        The column result["events"] has the number of states at events of each top. The columns
        result["event_t"], result["event_q_w"] and so on have the states of all tops.
        """
        ragged = [name for name, column in self._schema.items() if column.dims == EVENT]
        if "event_which" not in ragged:
            return None
        rows = []
        for part in self._read_parts(["top", plans.COUNT, *ragged]):
            top = np.repeat(part["top"].values, part[plans.COUNT].values)
            states = np.column_stack([part[f"event_{name}"].values for name in plans.EVENT_STATE])
            which, direction = part["event_which"].values, part["event_direction"].values
            rows.append((top, states, np.zeros_like(states), which, direction))
        events = EventColumns(*map(np.concatenate, zip(*rows, strict=True)))

        def build_path(columns: EventColumns) -> TopPath:
            tops = self._store.plan.build_tops(range(self.size))
            return build_event_path(tops, self._store.plan.validate(tops)[0], columns)

        find_path = partial(build_path, events)
        return Events(find_path, events.which, events.direction, events, self.shape)

    def to_arrow(self) -> Table:
        """Return a pyarrow.Table with one row per top.

        The entry `units` in the metadata of each column states the physical unit of its values. If
        a column has several values per top, each cell contains a list.
        """
        with optional_dependency(PARQUET):
            import pyarrow as pa

            from .store import make_arrow_table
        return pa.concat_tables([make_arrow_table([*part.values()]) for part in self._read_parts()])

    def to_pandas(self) -> DataFrame:
        """Return a pandas.DataFrame with one row per top, or per state if states are stored.

        `attrs` contains the units. The DataFrame contains the number of events of each top, but not
        the events themselves. Raises ImportError if pandas is not installed.
        """
        columns = {name: one for name, one in self._schema.items() if one.dims != EVENT}
        parts = [*self._read_parts([*columns])] or [columns]
        table = [
            column._replace(values=np.concatenate([part[name].values for part in parts]))
            for name, column in columns.items()
        ]
        sizes = {"top": len(table[0].values)}
        if any(column.dims == TIMES for column in table):
            sizes["time"] = self._store.plan.states
        return ColumnTable(sizes, table).to_pandas()

    def to_xarray(self) -> Dataset:
        """Return an xarray.Dataset with one variable per column, including its units.

        The dimensions are those of the sweep, and time if states are stored. The varying
        parameters, `status` and `reached` are coordinates. A parameter with the name of a stored
        quantity is called, for example, spin_given, and so is its dimension. For tops in missing
        parts, numbers are NaN, integers such as `status` are -1, and truth values are False. Of the
        events, the Dataset has only their number. Raises ImportError if xarray is not installed.
        """
        flat: dict[str, Column] = {}
        names = [name for name, column in self._schema.items() if column.dims != EVENT]
        for part in self._read_parts(names):
            for name, column in part.items():
                values = column.values
                if name not in flat:
                    empty = {"f": np.nan, "b": False, "U": ""}.get(values.dtype.kind, -1)
                    flat[name] = np.full((self.size, *values.shape[1:]), empty, values.dtype)
                flat[name][part["top"].values] = values
        table = {n: rows.reshape(*self.shape, *rows.shape[1:]) for n, rows in flat.items()}
        parameters = {
            f"{axis}_given" if f"{axis}_given" in table else axis: axis for axis in self.axes
        }
        axes, varied = tuple(parameters), self._store.plan.source._varied
        coordinates = {*names[: names.index("status")], "status", "reached", *axes}
        columns = []
        for name in names[1:]:
            values, is_coordinate = table[name], name in coordinates
            dims = (*axes, "time")[: values.ndim]
            if parameters.get(name) in varied:
                dims, values = (name,), varied[parameters[name]].values.reshape(-1)
            elif name == "t":
                dims, values, is_coordinate = ("time",), self._store.plan.times, True
            unit = self._schema[name].unit
            columns.append(TableColumn(name, dims, values, unit, is_coordinate=is_coordinate))
        return ColumnTable({}, columns, {"plan": self.hash}).to_xarray()


def read_sweep(folder: str | os.PathLike[str], *, partial: bool = False) -> SweepResult:
    """Open the results that kreisel.sweep stored in a folder.

    partial  True: read the intact parts even if other parts are missing or damaged

        >>> import kreisel as kr, tempfile
        >>> tops = kr.Source.random(kr.scenes.sleeping, 1000, seed=7, spin=(0, 20), tilt=(0, 1))
        >>> falls = {"nutation": ("min", "max")}
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     _ = kr.sweep(tops, 10, folder=folder, part_size=256, reduce=falls)
        ...     result = kr.read_sweep(folder)
        ...     result, result.columns[:4]
        (<kreisel.SweepResult of shape (1000,): 4 of 4 parts>, ('top', 'spin', 'tilt', 'status'))

    The files can also be read by other programs, such as DuckDB: SELECT spin, nutation_max FROM
    'runs/*.parquet'. Raises FileNotFoundError if the folder does not exist, and ValueError if it is
    not the folder of a sweep. Raises ImportError if pyarrow is not installed.
    """
    from . import store  # it needs pyarrow

    return SweepResult(store.open_sweep_store(folder), checks.as_bool("partial", partial))


def sweep(
    scene: Source | Scene | str | os.PathLike[str],
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
    part is a Parquet file with one row per top: its index, parameters, status (0 or the code of a
    failure) and results, with the units [M L T] of the columns. The plan and the number of a part
    determine its contents, bit for bit.

    Existing part files are verified by their checksums. Damaged parts, and other invalid files with
    the names of parts, are computed again, with a warning. Folders and complete parts that belong
    to a different plan are never replaced. Requires pyarrow: pip install 'kreisel[sweep]'.

    scene      a kreisel.Source, a kreisel.Scene of many tops, or the name of a TOML file. The file
               contains all arguments up to part_size except folder, and the scene (a name, a file
               or a table). It has one of the tables [grid], [random], [scatter], [columns], with
               the arguments of the constructor of Source of this name.
               { from = 0, to = 20, n = 1000 } means 1000 evenly spaced values. Each event is a
               table [[events]] with the name of a function of kreisel.events as `event`, and the
               arguments of this function. The event of a section is a table [event]
    t          a number or a list of times, for all tops; t and the arguments up to reduce are those
               of kreisel.solve and kreisel.reduce
    folder     the folder of the parts: new, empty, or with parts of the same plan
    task       the name of the function that is called for the tops. "solve" is kreisel.solve or,
               with `reduce`, kreisel.reduce. "chaos", or "lyapunov", "megno" and "oli" for one of
               its indicators, have the arguments t, direction, tol and max_steps. Their columns are
               <indicator>, certificate, is_chaotic, is_doubtful, t and <indicator>_curve. "section"
               has the arguments event, n, max_wait (a number), tol, digits and max_steps. Its
               columns are reached, steps, events (the number of states) and event_t, event_q_w,
               ..., event_m_z
    part_size  the number of tops in a part; default: 131072, or fewer so that a part has at most
               about 64 MB
    parts      the parts that this call computes, as range(0, 100); default: all; range(0): none
    threads    the number of threads that compute each part, one after the other; default: the
               number of processors
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

    Raises TypeError or ValueError for invalid arguments, before any computation starts. Raises
    ValueError if the folder contains a different plan, FileExistsError if it contains files but no
    plan, OSError if a file cannot be written, and RuntimeError if an executor loses parts. Ctrl-C
    raises kreisel.Interrupted, whose `result` has the finished parts.
    """
    given, defaults = locals(), {"method": "auto", "max_steps": 0}
    arguments = {}
    for name in plans.ARGUMENTS:
        value, default = given[name], defaults.get(name)
        if value is not None and not (type(value) is type(default) and value == default):
            arguments[name] = value
    if not isinstance(scene, (str, os.PathLike)):
        if not isinstance(scene, Source):
            scene = Source.of(scene)
        plan = plans.SweepPlan(scene, task, arguments, part_size)
    elif task != "solve" or arguments or part_size is not None:
        raise ValueError(f"{os.fspath(scene)} is a whole plan: give no other arguments than folder")
    else:
        plan = plans.read_sweep_plan(Path(scene))
    callback = options.validate_progress_callback(progress)
    count = options.validate_thread_count(threads, executor)
    if parts is None:
        parts = range(plan.parts)
    elif not isinstance(parts, range) or parts.step != 1:
        raise TypeError(
            f"{checks.spell('parts')} must be a range such as range(100), not {short_repr(parts)}"
        )
    if parts and not (parts.start >= 0 and parts.stop <= plan.parts):
        label = checks.spell("parts")
        raise ValueError(
            f"{label} must lie between 0 and {plan.parts}, not {parts.start} to {parts.stop}"
        )
    from . import store as stores  # it needs pyarrow

    store = stores.create_or_open_sweep_store(folder, plan)
    try:
        stores.compute_parts(store, parts, count, executor, callback)
    except KeyboardInterrupt:
        result = SweepResult(store)
        done = sum(i in parts for i in result.present)
        message = (
            f"interrupted: {len(parts) - done} of {len(parts)} parts are left; "
            f"repeating the call resumes the sweep in {store.folder}"
        )
        raise Interrupted(message, result=result) from None
    return SweepResult(store)
