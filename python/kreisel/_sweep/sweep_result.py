"""Results of a sweep, which are stored on disk and read only when they are accessed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cached_property
from itertools import chain, islice, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .._results.ensemble_buffers import EventColumns
from .._results.ensemble_events import EnsembleEvents, convert_columns_to_ensemble_events
from .._results.tables import TABLES
from .._utils.errors import make_frozen_class_decorator, unknown_name_message
from .._utils.optional import optional_dependency
from .._utils.validation import as_bool, as_int
from .part_table import COUNT, EVENT_STATE, PartResults
from .start_table import PARQUET
from .store import DAMAGED, DONE, FOREIGN, MISSING, OLD, REPAIR, SweepStore, open_sweep_store

if TYPE_CHECKING:
    from pandas import DataFrame
    from pyarrow import Table
    from xarray import Dataset

Column = npt.NDArray[Any]
_STATUS = "status", "reached"


@make_frozen_class_decorator("results of kreisel.sweep are read-only")
class SweepResult:
    """The results of a sweep, read from its folder.

    `result[name]` is the column with this name, as a NumPy array with the shape of the sweep. If
    the column has values at k times, the array has an additional last dimension of length k. Only
    the requested columns are read from the files.

    shape, axes, size  as in the source
    parts    the number of parts
    plan     the plan as in plan.json
    hash     the SHA-256 of the plan
    columns  the names of the columns
    units    the dimension [M L T] of each column

    Iteration over a SweepResult yields one mapping from column names to arrays for each existing
    part of the sweep. Reading a column raises ValueError if any part of the sweep is missing. If
    the sweep was opened with partial=True, its missing parts are ignored. In a partial result, the
    column `result["top"]` contains the indices of the tops. In a partial result, damaged part files
    are treated as missing.
    """

    _store: SweepStore
    _partial: bool
    _found: list[int]

    def __init__(self, store: SweepStore, partial: bool = False) -> None:
        self.__dict__.update(_store=store, _partial=partial, _found=store.list_existing_parts())

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
    def folder(self) -> str:
        """The folder that contains the parts."""
        return str(self._store.folder)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the array of tops in the sweep."""
        return self._store.plan.source.shape

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of the dimensions of the sweep."""
        return self._store.plan.source.axes

    @property
    def size(self) -> int:
        """The total number of tops in the sweep."""
        return self._store.plan.source.size

    @property
    def parts(self) -> int:
        """The number of parts into which the sweep is divided."""
        return self._store.plan.parts

    @property
    def missing(self) -> list[int]:
        """The numbers of the parts that are not in `present`."""
        return [i for gap in list_missing_ranges(self.present, self.parts) for i in gap]

    @property
    def plan(self) -> dict[str, Any]:
        """The plan, as stored in plan.json."""
        return dict(self._store.plan.as_json)

    @property
    def hash(self) -> str:
        """The SHA-256 hash of the plan, which is also stored in every part."""
        return self._store.plan.hash

    @cached_property
    def _empty_part_table(self) -> PartResults:
        """A table without rows that has the columns of a part of the sweep."""
        if not self.present:
            raise ValueError(f"{self.folder} has no parts yet")
        return self._store.read_part(self.present[0], [])

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the columns, with event columns last."""
        return (*self._empty_part_table.columns, *self._empty_part_table.ragged)

    @property
    def units(self) -> dict[str, str]:
        """The dimension [M L T] of each column, or an empty string for a dimensionless column."""
        return {name: self._empty_part_table.units.get(name, "") for name in self.columns}

    def __getitem__(self, name: str) -> Column:
        """Return the values of a column for all tops, or for all events sorted by top.

        Raises KeyError for an unknown name.
        """
        schema = self._empty_part_table
        is_ragged = name in schema.ragged
        if name not in schema.columns and not is_ragged:
            raise KeyError(unknown_name_message("column", str(name), self.columns))
        parts = self._read_existing_parts([name])
        values = np.concatenate([(p.ragged if is_ragged else p.columns)[name] for p in parts])
        if len(self.present) == self.parts and not is_ragged:
            values = values.reshape(*self.shape, *values.shape[1:])
        values.flags.writeable = False
        return values

    def _read_existing_parts(self, names: list[str] | None = None) -> Iterator[PartResults]:
        """Return an iterator over the existing parts, limited to the columns `names` if given.

        Raises ValueError if parts are missing, unless the sweep was opened with partial=True.
        """
        missing_count = self.parts - len(self.present)
        if missing_count and not self._partial:
            numbers = chain.from_iterable(list_missing_ranges(self.present, self.parts))
            examples = ", ".join(map(str, islice(numbers, 8)))
            raise ValueError(
                f"{missing_count} of {self.parts} parts are missing: {examples}"
                f"{', ...' if missing_count > 8 else ''}; repeating the call of kreisel.sweep "
                "computes them, and read_sweep(folder, partial=True) reads the others"
            )
        return (self._store.read_part(i, names) for i in self.present)

    def __iter__(self) -> Iterator[dict[str, Column]]:
        """Yield the results in each existing part as a mapping from column names to arrays."""
        for i in self.present:
            part = self._store.read_part(i)
            yield {**part.columns, **part.ragged}

    def part(self, i: int) -> dict[str, Column]:
        """Return part `i` of the sweep as a mapping from column names to arrays.

        Raises IndexError if the part does not exist.
        """
        number = as_int("the number of a part", i, 0)
        if number >= self.parts:
            raise IndexError(f"there is no part {number}: the sweep has {self.parts} parts")
        if number not in self._found:
            raise IndexError(f"part {number} of {self.parts} is missing")
        part = self._store.read_part(number)
        return {**part.columns, **part.ragged}

    def check(self) -> SweepResult:
        """Verify the checksums of all existing parts, and return this SweepResult.

        Raises ValueError for the first damaged part. Raises FileExistsError if a folder, or a part
        of a different plan, has the file name of a part of this sweep.
        """
        for i in self._found:
            status = self._store.determine_part_status(i)
            if status == FOREIGN:
                raise self._store.make_misplaced_file_error(i)
            if status == DAMAGED:
                raise ValueError(f"{self._store.part_file_path(i)} is damaged; {REPAIR}")
        return self

    def verify(self) -> dict[str, list[int]]:
        """Verify the checksums of all parts, and return the numbers of the parts grouped by status.

        The status is "done", "missing", "damaged", "of another version" or "foreign". A part is
        foreign if a folder, or a complete part of a different plan, has its file name. Calling
        kreisel.sweep again computes the parts whose status is not 'done', but raises
        FileExistsError if a part is foreign.
        """
        parts, numbers = self._verify_existing_parts()
        missing_numbers = [i for gap in list_missing_ranges(numbers, self.parts) for i in gap]
        return parts | ({MISSING: missing_numbers} if missing_numbers else {})

    def _verify_existing_parts(self) -> tuple[dict[str, list[int]], list[int]]:
        """Verify the files of all existing parts of the sweep.

        Return a mapping from each status to the indices of the parts with this status, and a list
        of the indices of all existing parts.
        """
        parts: dict[str, list[int]] = {DONE: []}
        numbers = []
        for i in self._store.list_existing_parts():
            status = self._store.determine_part_status(i)
            if status != MISSING:
                parts.setdefault(status, []).append(i)
                numbers.append(i)
        return parts, numbers

    @property
    def events(self) -> EnsembleEvents | None:
        """The events of all tops, or None if no events were requested.

        The events of tops in missing parts of the sweep are omitted. If the task is "section", the
        value is None, because the states are stored in columns instead. For each top, the column
        result["events"] contains the number of states recorded at events. The columns
        result["event_t"], result["event_q_w"] and so on contain the states of all tops.
        """
        if "event_which" not in self._empty_part_table.ragged:
            return None
        parts = self._read_existing_parts(["top", COUNT, *self._empty_part_table.ragged])
        columns = zip(*[_extract_part_events(part) for part in parts], strict=True)
        return convert_columns_to_ensemble_events(
            EventColumns(*map(np.concatenate, columns)), self.shape
        )

    def to_arrow(self) -> Table:
        """Return a pyarrow.Table with one row per top.

        The entry `units` in the metadata of each column states the physical unit of its values. If
        a column has several values per top, each cell contains a list.
        """
        with optional_dependency(PARQUET):
            import pyarrow as pa

            from .parquet import convert_to_arrow_table
        return pa.concat_tables(
            [convert_to_arrow_table(part) for part in self._read_existing_parts()]
        )

    def to_pandas(self) -> DataFrame:
        """Return a pandas.DataFrame with one row per top, or per state if states are stored.

        `attrs` contains the units. The DataFrame contains the number of events of each top, but not
        the events themselves. Raises ImportError if pandas is not installed.
        """
        with optional_dependency(TABLES):
            import pandas as pd
        has_states = any(values.ndim > 1 for values in self._empty_part_table.columns.values())
        each = self._store.plan.states if has_states else 1
        pieces = [
            pd.DataFrame(
                {
                    name: values.reshape(-1) if values.ndim > 1 else np.repeat(values, each)
                    for name, values in part.columns.items()
                }
            )
            for part in self._read_existing_parts()
        ]
        frame = pd.concat(pieces, ignore_index=True)
        frame.attrs = {"units": {name: self.units[name] for name in frame.columns}}
        return frame

    def to_xarray(self) -> Dataset:
        """Return an xarray.Dataset with one variable per column, including its units.

        The dimensions are those of the sweep; if states are stored, there is an additional
        dimension `time`. The varying parameters, `status` and `reached` are stored as coordinates.
        A parameter with the name of a stored quantity is called, for example, spin_given, and so is
        its dimension. For tops in missing parts, numbers are NaN, integers such as `status` are -1,
        and truth values are False. The Dataset contains the number of events of each top, but not
        the events themselves. Raises ImportError if xarray is not installed.
        """
        with optional_dependency(TABLES):
            import xarray as xr
        table, source = self._read_all_columns(), self._store.plan.source
        names = list(table)
        parameters = {
            f"{axis}_given" if f"{axis}_given" in table else axis: axis for axis in self.axes
        }
        axes = tuple(parameters)
        starts = names[1 : names.index(_STATUS[0])]
        variables: dict[str, Any] = {}
        coordinates: dict[str, Any] = {}
        for name, values in table.items():
            unit = {"units": self.units[name]}
            parameter = parameters.get(name, "")
            if parameter in source._varied:
                coordinates[name] = ((name,), source._varied[parameter].values.reshape(-1), unit)
            elif name == "t":
                coordinates["time"] = (("time",), self._store.plan.times, unit)
            elif name in (*starts, *_STATUS, *axes):
                coordinates[name] = (axes, values, unit)
            elif name != "top":
                inner = ("time",) * (values.ndim - len(self.shape))
                variables[name] = ((*axes, *inner), values, unit)
        return xr.Dataset(variables, coordinates, {"plan": self.hash})

    def _read_all_columns(self) -> dict[str, Column]:
        """Return each column as an array with the shape of the sweep."""
        table: dict[str, Column] = {}
        for part in self._read_existing_parts():
            places = part.columns["top"]
            for name, values in part.columns.items():
                if name not in table:
                    empty = {"f": np.nan, "b": False}.get(values.dtype.kind, -1)
                    table[name] = np.full((self.size, *values.shape[1:]), empty, values.dtype)
                table[name][places] = values
        return {n: values.reshape(*self.shape, *values.shape[1:]) for n, values in table.items()}


def list_missing_ranges(numbers: list[int], end: int) -> Iterator[range]:
    """Yield the ranges of nonnegative integers below `end` that are missing from `numbers`."""
    for low, high in pairwise([-1, *numbers, end]):
        if high > low + 1:
            yield range(low + 1, high)


def _extract_part_events(part: PartResults) -> EventColumns:
    """Return the events of a part, together with the indices of their tops in the sweep."""
    top = np.repeat(part.columns["top"], part.columns[COUNT])
    states = np.column_stack([part.ragged[f"event_{name}"] for name in EVENT_STATE])
    which, direction = part.ragged["event_which"], part.ragged["event_direction"]
    return EventColumns(top, states, np.zeros_like(states), which, direction)


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
    return SweepResult(open_sweep_store(folder), as_bool("partial", partial))
