"""Encoding of the parts of a sweep as Parquet files with one row per top.

If a column has several values or events per top, each cell contains a list. To improve compression,
the eight bytes of each double are stored in separate streams.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .._utils.arguments import optional_dependency
from .._utils.files import PLACEHOLDER
from .plan import COUNT, Column, PartResults
from .source import PARQUET

with optional_dependency(PARQUET):
    import pyarrow as pa
    import pyarrow.parquet as parquet

if TYPE_CHECKING:
    from pyarrow import Table

_GROUP = 1 << 16  # number of rows that a reader decodes together: a row group of Parquet
_PER = b"top", b"time", b"event"  # values of `per`: a column has one value per top, time or event
_ABOUT, _CHECKSUM = "kreisel", "kreisel seal"  # keys in the metadata of a file


def encode_part_as_parquet(part: PartResults, description: Mapping[str, Any]) -> bytearray:
    """Encode a part as a Parquet file with a placeholder for its checksum.

    The dictionary `description` is stored as JSON in the metadata of the file.
    """
    table = convert_to_arrow_table(part)
    stream = pa.BufferOutputStream()
    doubles = [name for name, kind in list_parquet_column_types(table) if kind == pa.float64()]
    with parquet.ParquetWriter(
        stream,
        table.schema,
        compression="zstd",
        compression_level=1,
        use_dictionary=False,
        use_byte_stream_split=doubles,
        write_page_checksum=True,
    ) as writer:
        writer.write_table(table, row_group_size=_GROUP)
        writer.add_key_value_metadata({_ABOUT: json.dumps(description), _CHECKSUM: PLACEHOLDER})
    return bytearray(stream.getvalue())


def list_parquet_column_types(table: Table) -> list[tuple[str, Any]]:
    """Return the path of each column in the Parquet schema, and the type of its values."""
    return [
        (f"{field.name}.list.element", field.type.value_type)
        if pa.types.is_large_list(field.type)
        else (field.name, field.type)
        for field in table.schema
    ]


def convert_to_arrow_table(part: PartResults) -> Table:
    """Return the rows of a part as a pyarrow.Table.

    The entry `units` in the metadata of each column states the physical unit of its values. The
    metadata entry `per` states whether a column has values per top, per time or per event.
    """
    columns = {name: _to_arrow_array(values) for name, values in part.columns.items()}
    scopes = {name: "top" if part.columns[name].ndim == 1 else "time" for name in columns}
    if part.ragged:
        offsets = np.concatenate([[0], np.cumsum(part.columns[COUNT])]).astype(np.int64)
        columns |= {name: _to_arrow_list(offsets, values) for name, values in part.ragged.items()}
    fields = [
        pa.field(
            name,
            column.type,
            metadata={"units": part.units.get(name, ""), "per": scopes.get(name, "event")},
        )
        for name, column in columns.items()
    ]
    return pa.Table.from_arrays(list(columns.values()), schema=pa.schema(fields))


def _to_arrow_array(values: Column) -> Any:
    if values.ndim == 1:
        return pa.array(values)
    n, k = values.shape
    return _to_arrow_list(np.arange(n + 1, dtype=np.int64) * k, values.reshape(-1))


def _to_arrow_list(offsets: Column, values: Column) -> Any:
    return pa.LargeListArray.from_arrays(pa.array(offsets), pa.array(values))


def read_part_description(data: bytes) -> dict[str, Any]:
    """Return the dictionary `description` that is stored in a part.

    Raises ValueError if the data are not a part of a sweep.
    """
    try:
        return _parse_sweep_part_metadata(parquet.read_metadata(pa.BufferReader(data)).metadata)
    except (pa.ArrowException, OSError) as error:
        raise ValueError(f"it is not a part of a sweep: {error}") from None


def _parse_sweep_part_metadata(metadata: Mapping[bytes, bytes] | None) -> dict[str, Any]:
    """Return the dictionary `description` from the metadata of a file.

    Raises ValueError if the metadata contain no valid dictionary.
    """
    try:
        description = json.loads((metadata or {})[_ABOUT.encode()])
    except (KeyError, ValueError) as error:
        raise ValueError(f"it is not a part of a sweep: {error}") from None
    if not isinstance(description, dict):
        raise ValueError("it is not a part of a sweep")
    return description


def decode_part_from_parquet(
    file: str, expected: Mapping[str, Any], names: Iterable[str] | None, states: int
) -> PartResults:
    """Read a part from a file, optionally only the columns in `names`.

    If `names` is an empty list, the returned table has all columns but no rows. `states` is the
    number of states per top. Raises ValueError if the file is damaged, or if it is not the part
    described by `expected`.
    """
    column_names = None if names is None else list(names)
    try:
        with (
            pa.OSFile(os.fsencode(file)) as stream,  # pyarrow refuses a str that is not UTF-8
            parquet.ParquetFile(stream, page_checksum_verification=True) as source,
        ):
            description = _parse_sweep_part_metadata(source.metadata.metadata)
            if any(description.get(name) != value for name, value in expected.items()):
                raise ValueError(f"it is not part {expected['part']} of this plan")
            table = (
                source.schema_arrow.empty_table()
                if column_names == []
                else source.read(column_names)
            )
        missing_names = {*(column_names or ())} - {*table.column_names}
        if missing_names:
            raise ValueError(f"it has no {', '.join(sorted(missing_names))}")
        return _convert_arrow_to_part_results(table, states)
    except (pa.ArrowException, OSError, AttributeError, TypeError, ValueError) as error:
        # Parquet has no checksum of the schema, so a damaged schema can cause any of these errors.
        raise ValueError(f"{file} is damaged, or not a part of this sweep: {error}") from None


def _convert_arrow_to_part_results(table: Table, states: int) -> PartResults:
    """Convert an Arrow table to a PartResults."""
    part = PartResults()
    for field, column in zip(table.schema, table.columns, strict=True):
        array, metadata = column.combine_chunks(), field.metadata or {}
        part.units[field.name] = metadata.get(b"units", b"").decode()
        scope = metadata.get(b"per")
        if scope not in _PER or pa.types.is_primitive(field.type) != (scope == b"top"):
            raise ValueError(f"its schema does not specify the shape of {field.name!r}")
        flat = array if scope == b"top" else array.flatten()
        values = flat.to_numpy(zero_copy_only=False)
        if scope == b"event":
            part.ragged[field.name] = values
        else:
            shape = (len(array),) if scope == b"top" else (len(array), states)
            part.columns[field.name] = values.reshape(shape)
    return part
