"""Results of a sweep on disk, read on demand: a column, a part, or a table."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cached_property
from itertools import chain, islice, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .._results.ensemble_buffers import RawEvents
from .._results.ensemble_events import EnsembleEvents, ensemble_events
from .._results.tables import TABLES
from .._utils.errors import refuse_assignment, unknown_name_message
from .._utils.optional import optional_dependency
from .._utils.validation import as_bool, as_int
from .part_table import COUNT, MET, PartTable
from .start_table import PARQUET
from .store import DAMAGED, DONE, FOREIGN, MISSING, OLD, REPAIR, SweepStore, open_store

if TYPE_CHECKING:
    from pandas import DataFrame
    from pyarrow import Table
    from xarray import Dataset

Column = npt.NDArray[Any]
_HOW = "status", "reached"


@refuse_assignment("kreisel.sweep computes, this reads what is there")
class SweepResult:
    """The parts of a sweep. `swept[name]` is a column as an array of numpy: of the shape of all
    tops, and behind it k where a top has as many values, one for each time. Nothing is read before
    it is asked for, and then no more than that.

    shape, axes, size  of all tops, as of the source
    parts    how many parts the plan has
    plan     the plan, as plan.json has it; hash: its SHA-256
    columns  the names, units the dimension [M L T] of each

    Iteration gives the parts that are there, one after the other, each as a mapping from names to
    arrays. A column of parts that are not all there is refused, unless read_sweep was asked for
    what there is: then it has the rows of the tops that `swept["top"]` tells. For that each bit of
    the parts is verified once, and damaged parts count as missing.
    """

    _folder: SweepStore
    _partial: bool
    _found: list[int]

    def __init__(self, folder: SweepStore, partial: bool = False) -> None:
        self.__dict__.update(_folder=folder, _partial=partial, _found=folder.found())

    @cached_property
    def done(self) -> list[int]:
        """The numbers of the parts that are there; of read_sweep(partial=True) those that are
        whole."""
        if not self._partial:
            return self._found
        return [i for i in self._found if self._folder.look(i) in (DONE, OLD)]

    def __repr__(self) -> str:
        there = f"{len(self.done)} of {self.parts} parts"
        return f"<kreisel.SweepResult of shape {self.shape}: {there}>"

    @property
    def folder(self) -> str:
        """The folder of the parts."""
        return str(self._folder.place)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of all tops."""
        return self._folder.plan.source.shape

    @property
    def axes(self) -> tuple[str, ...]:
        """A name for each dimension."""
        return self._folder.plan.source.axes

    @property
    def size(self) -> int:
        """The number of tops in all parts."""
        return self._folder.plan.source.size

    @property
    def parts(self) -> int:
        """The number of parts of the plan."""
        return self._folder.plan.parts

    @property
    def missing(self) -> list[int]:
        """The numbers of the parts that are not there."""
        return [i for gap in gaps(self.done, self.parts) for i in gap]

    @property
    def plan(self) -> dict[str, Any]:
        """The contents of plan.json."""
        return dict(self._folder.plan.told)

    @property
    def hash(self) -> str:
        """The SHA-256 of the plan, which each part has too."""
        return self._folder.plan.hash

    @cached_property
    def _first(self) -> PartTable:
        """The names and units of all parts, by the first that is there."""
        if not self.done:
            raise ValueError(f"{self.folder} has no part yet")
        return self._folder.get(self.done[0])

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of what there is of each top, and of the events that it met."""
        return (*self._first.columns, *self._first.ragged)

    @property
    def units(self) -> dict[str, str]:
        """The dimension [M L T] of each column; empty for a pure number."""
        return {name: self._first.units.get(name, "") for name in self.columns}

    def __getitem__(self, name: str) -> Column:
        """A column over all tops; of events over all events, those of a top after those of
        another."""
        if name not in self.columns:
            raise KeyError(unknown_name_message("column", str(name), self.columns))
        pieces = [
            (rows.ragged if name in rows.ragged else rows.columns)[name]
            for rows in self._parts([name])
        ]
        return self._shaped(np.concatenate(pieces), name in self._first.ragged)

    def _shaped(self, values: Column, ragged: bool) -> Column:
        if len(self.done) == self.parts and not ragged:
            values = values.reshape(*self.shape, *values.shape[1:])
        values.flags.writeable = False
        return values

    def _parts(self, names: list[str] | None = None) -> Iterator[PartTable]:
        """The rows of all parts, or of those that are there; ValueError where that is not all."""
        left = self.parts - len(self.done)
        if left and not self._partial:
            missing = chain.from_iterable(gaps(self.done, self.parts))
            some = ", ".join(map(str, islice(missing, 8)))
            raise ValueError(
                f"{left} of {self.parts} parts are missing: {some}"
                f"{', ...' if left > 8 else ''}; the same call of kreisel.sweep makes them, "
                "read_sweep(folder, partial=True) reads what there is"
            )
        return (self._folder.get(i, names) for i in self.done)

    def __iter__(self) -> Iterator[dict[str, Column]]:
        """The parts that are there, each as columns by their names."""
        for i in self.done:
            rows = self._folder.get(i)
            yield {**rows.columns, **rows.ragged}

    def part(self, i: int) -> dict[str, Column]:
        """A part by its number, as columns by their names."""
        number = as_int("the number of a part", i, 0)
        if number not in self._found:
            raise IndexError(f"part {number} is not there: there are {len(self._found)} parts")
        rows = self._folder.get(number)
        return {**rows.columns, **rows.ragged}

    def check(self) -> SweepResult:
        """Return this sweep after verifying each bit of each part that is there. Raises ValueError
        for the first part that is damaged, FileExistsError for a folder or a part of another plan
        in the place of a part."""
        for i in self._found:
            how = self._folder.look(i)
            if how == FOREIGN:
                raise self._folder.refusal(i)
            if how == DAMAGED:
                raise ValueError(f"{self._folder.file(i)} is damaged; {REPAIR}")
        return self

    def look(self) -> dict[str, list[int]]:
        """Return the numbers of the parts that are done, missing, damaged, of another version, or
        foreign, after verifying each bit of them. The same call of kreisel.sweep makes all of them
        but foreign ones: a folder, or a whole part of another plan, in the place of a part."""
        stand, there = self._verify()
        missing = [i for gap in gaps(there, self.parts) for i in gap]
        return stand | ({MISSING: missing} if missing else {})

    def _verify(self) -> tuple[dict[str, list[int]], list[int]]:
        """Verify the parts that have files; return how they stand, and the numbers of all."""
        stand: dict[str, list[int]] = {DONE: []}
        there = []
        for i in self._folder.found():
            how = self._folder.look(i)
            if how != MISSING:
                stand.setdefault(how, []).append(i)
                there.append(i)
        return stand, there

    @property
    def events(self) -> EnsembleEvents | None:
        """The events that the tops of solve met, where they were looked for; else None. Where parts
        are missing their tops have met none. The states of a section are columns: `events` tells
        how many a top has, `event_t` and the others are those of all tops."""
        if "event_which" not in self._first.ragged:
            return None
        met = [_events_of(rows) for rows in self._parts(["top", COUNT, *self._first.ragged])]
        columns = [np.concatenate(column) for column in zip(*met, strict=True)]
        return ensemble_events(RawEvents(*columns), self.shape)

    def to_arrow(self) -> Table:
        """A pyarrow.Table with a row for each top, whose fields have their `units` as metadata;
        what has many numbers of a top is a list. ImportError without pyarrow."""
        with optional_dependency(PARQUET):
            import pyarrow as pa

            from .parquet import as_table
        return pa.concat_tables([as_table(rows) for rows in self._parts()])

    def to_pandas(self) -> DataFrame:
        """A pandas.DataFrame with a row for each top, or where states are kept for each of them;
        `attrs` has the units. Of events there is how many: see `events`. ImportError without
        pandas."""
        with optional_dependency(TABLES):
            import pandas as pd
        many = self._many
        each = self._folder.plan.states if many else 1
        pieces = [
            pd.DataFrame(
                {
                    name: values.reshape(-1) if values.ndim > 1 else np.repeat(values, each)
                    for name, values in rows.columns.items()
                }
            )
            for rows in self._parts()
        ]
        frame = pd.concat(pieces, ignore_index=True)
        frame.attrs = {"units": {name: self.units[name] for name in frame.columns}}
        return frame

    @property
    def _many(self) -> list[str]:
        """The columns that have many numbers of a top."""
        return [name for name, values in self._first.columns.items() if values.ndim > 1]

    def to_xarray(self) -> Dataset:
        """An xarray.Dataset with a variable for each column, with its units, over the dimensions of
        the tops by name, and time where states are kept. Words that vary are coordinates, and so
        are `status` and `reached`. Tops of parts that are missing have NaN, or -1. Of events there
        is how many. ImportError without xarray."""
        with optional_dependency(TABLES):
            import xarray as xr
        table, source = self._whole(), self._folder.plan.source
        names = list(table)
        starts = names[1 : names.index(_HOW[0])]
        variables: dict[str, Any] = {}
        coordinates: dict[str, Any] = {}
        for name, values in table.items():
            unit = {"units": self.units[name]}
            if name in self.axes and name in source._told:
                coordinates[name] = ((name,), source._told[name].values.reshape(-1), unit)
            elif name == "t":
                coordinates["time"] = (("time",), self._folder.plan.times, unit)
            elif name in (*starts, *_HOW, *self.axes):
                coordinates[name] = (self.axes, values, unit)
            elif name != "top":
                inner = ("time",) * (values.ndim - len(self.shape))
                variables[name] = ((*self.axes, *inner), values, unit)
        return xr.Dataset(variables, coordinates, {"plan": self.hash})

    def _whole(self) -> dict[str, Column]:
        """Return all columns over the shape of all tops."""
        table: dict[str, Column] = {}
        for rows in self._parts():
            where = rows.columns["top"]
            for name, values in rows.columns.items():
                if name not in table:
                    nothing = np.nan if values.dtype.kind == "f" else -1
                    shape = self.size, *values.shape[1:]
                    table[name] = np.full(shape, nothing, values.dtype)
                table[name][where] = values
        return {n: values.reshape(*self.shape, *values.shape[1:]) for n, values in table.items()}


def gaps(numbers: list[int], end: int) -> Iterator[range]:
    """Yield the ranges of numbers below `end` that ascending `numbers` leave out."""
    for before, after in pairwise([-1, *numbers, end]):
        if after > before + 1:
            yield range(before + 1, after)


def _events_of(rows: PartTable) -> RawEvents:
    """The events of a part, with the numbers of their tops."""
    top = np.repeat(rows.columns["top"], rows.columns[COUNT])
    states = np.column_stack([rows.ragged[f"event_{name}"] for name in MET])
    which, direction = rows.ragged["event_which"], rows.ragged["event_direction"]
    return RawEvents(top, states, np.zeros_like(states), which, direction)


def read_sweep(folder: str | os.PathLike[str], *, partial: bool = False) -> SweepResult:
    """Open the results of kreisel.sweep in a folder.

    partial  True: use the intact parts if some parts are missing or damaged

        >>> import kreisel as kr, tempfile
        >>> tops = kr.Source.random(kr.scenes.sleeping, 1000, seed=7, spin=(0, 20), tilt=(0, 1))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     _ = kr.sweep(tops, 10, to=folder, part=256, reduce={"nutation": ("min", "max")})
        ...     swept = kr.read_sweep(folder)
        ...     swept, swept.columns[:4]
        (<kreisel.SweepResult of shape (1000,): 4 of 4 parts>, ('top', 'spin', 'tilt', 'status'))

    Other programs can read the files, as DuckDB: SELECT spin, nutation_max FROM 'runs/*.parquet'.
    Raises FileNotFoundError and ValueError if the folder does not belong to a sweep.
    """
    return SweepResult(open_store(folder), as_bool("partial", partial))
