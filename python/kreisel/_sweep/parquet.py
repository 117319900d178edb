"""Parts as Parquet: a row for each top; what has many numbers of a top is a list, and so are its
events. Doubles are split into streams of bytes, which packs them without loss."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .._utils.optional import optional_dependency
from .checksum import OPEN
from .part_table import COUNT, Column, PartTable
from .start_table import PARQUET

with optional_dependency(PARQUET):
    import pyarrow as pa
    import pyarrow.parquet as parquet

if TYPE_CHECKING:
    from pyarrow import Table

_GROUP = 1 << 16  # rows that a reader takes at once
_PER = b"top", b"time", b"event"  # what a column has a value for
_ABOUT, _SEAL = "kreisel", "kreisel seal"


def encode(rows: PartTable, about: Mapping[str, Any]) -> bytearray:
    """The file, with an open seal."""
    table = as_table(rows)
    out = pa.BufferOutputStream()
    doubles = [name for name in parquet_paths(table) if name[1] == pa.float64()]
    with parquet.ParquetWriter(
        out,
        table.schema,
        compression="zstd",
        compression_level=1,
        use_dictionary=False,
        use_byte_stream_split=[name for name, _ in doubles],
        write_page_checksum=True,
    ) as writer:
        writer.write_table(table, row_group_size=_GROUP)
        writer.add_key_value_metadata({_ABOUT: json.dumps(about), _SEAL: OPEN})
    return bytearray(out.getvalue())


def parquet_paths(table: Table) -> list[tuple[str, Any]]:
    """The columns by the names that the file has for their numbers, with their kinds."""
    return [
        (f"{field.name}.list.element", field.type.value_type)
        if pa.types.is_large_list(field.type)
        else (field.name, field.type)
        for field in table.schema
    ]


def as_table(rows: PartTable) -> Table:
    """The rows as a table of Arrow, whose fields have their units, and say of what there are many:
    a top has one value, or one per time or per event."""
    columns = {name: _array(values) for name, values in rows.columns.items()}
    per = {name: "top" if rows.columns[name].ndim == 1 else "time" for name in columns}
    if rows.ragged:
        offsets = np.concatenate([[0], np.cumsum(rows.columns[COUNT])]).astype(np.int64)
        columns |= {name: _list(offsets, values) for name, values in rows.ragged.items()}
    fields = [
        pa.field(
            name,
            column.type,
            metadata={"units": rows.units.get(name, ""), "per": per.get(name, "event")},
        )
        for name, column in columns.items()
    ]
    return pa.Table.from_arrays(list(columns.values()), schema=pa.schema(fields))


def _array(values: Column) -> Any:
    if values.ndim == 1:
        return pa.array(values)
    n, k = values.shape
    return _list(np.arange(n + 1, dtype=np.int64) * k, values.reshape(-1))


def _list(offsets: Column, values: Column) -> Any:
    return pa.LargeListArray.from_arrays(pa.array(offsets), pa.array(values))


def about(file: str) -> dict[str, Any]:
    """Return the description in a part file; raise ValueError if it has none."""
    try:
        found = parquet.read_metadata(file).metadata or {}
        told: dict[str, Any] = json.loads(found[_ABOUT.encode()])
    except (pa.ArrowException, OSError, KeyError, ValueError) as error:
        raise ValueError(f"{file} is damaged, or no part of a sweep: {error}") from None
    if not isinstance(told, dict):
        raise ValueError(f"{file} is damaged, or no part of a sweep")
    return told


def decode(file: str, names: Iterable[str] | None, states: int) -> PartTable:
    """The rows of a part, or some columns of them; ValueError where bits of these have changed."""
    wanted = None if names is None else list(names)
    try:
        with parquet.ParquetFile(file, page_checksum_verification=True) as source:
            table = source.read(columns=wanted)
    except (pa.ArrowException, OSError) as error:
        raise ValueError(f"{file} is damaged: {error}") from None
    if wanted is not None and not {*wanted} <= {*table.column_names}:
        raise ValueError(f"{file} is damaged: it has no {wanted}")
    try:
        return _rows_of(table, states)
    except (AttributeError, TypeError, ValueError, pa.ArrowException) as error:
        # The schema has no checksum of its own.
        raise ValueError(f"{file} is damaged: {error}") from None


def _rows_of(table: Table, states: int) -> PartTable:
    """Convert a table of Arrow to the rows of a part."""
    rows = PartTable()
    for field, column in zip(table.schema, table.columns, strict=True):
        whole, told = column.combine_chunks(), field.metadata or {}
        rows.units[field.name] = told.get(b"units", b"").decode()
        per = told.get(b"per")
        if per not in _PER or pa.types.is_primitive(field.type) != (per == b"top"):
            raise ValueError(f"its schema does not tell how {field.name!r} belongs to the tops")
        flat = whole if per == b"top" else whole.flatten()
        values = flat.to_numpy(zero_copy_only=False)
        if per == b"event":
            rows.ragged[field.name] = values
        else:
            shape = (len(whole),) if per == b"top" else (len(whole), states)
            rows.columns[field.name] = values.reshape(shape)
    return rows
