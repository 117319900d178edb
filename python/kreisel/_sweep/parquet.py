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
    """Encode a part and its description as a file with a placeholder for its checksum."""
    table = convert_to_arrow_table(part)
    stream = pa.BufferOutputStream()
    doubles = []
    for field in table.schema:
        if field.type == pa.float64():
            doubles.append(field.name)
        elif pa.types.is_large_list(field.type) and field.type.value_type == pa.float64():
            doubles.append(f"{field.name}.list.element")
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


def convert_to_arrow_table(part: PartResults) -> Table:
    """Return the rows of a part as a pyarrow.Table.

    The entry `units` in the metadata of each column states the physical unit of its values. The
    metadata entry `per` states whether a column has values per top, per time or per event.
    """
    arrays, fields = [], []

    def add_column(name: str, scope: str, values: Column, ends: Column | None = None) -> None:
        array = pa.array(values)
        if ends is not None:
            offsets = pa.array(np.concatenate([[0], ends]).astype(np.int64))
            array = pa.LargeListArray.from_arrays(offsets, array)
        metadata = {"units": part.units.get(name, ""), "per": scope}
        arrays.append(array)
        fields.append(pa.field(name, array.type, metadata=metadata))

    for name, values in part.columns.items():
        if values.ndim == 1:
            add_column(name, "top", values)
        else:
            n, k = values.shape
            add_column(name, "time", values.reshape(-1), np.arange(1, n + 1) * k)
    for name, values in part.ragged.items():
        add_column(name, "event", values, np.cumsum(part.columns[COUNT]))
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def read_part_description(data: bytes) -> dict[str, Any]:
    """Return the description stored in a part; raise ValueError if there is none."""
    try:
        return _parse_description(parquet.read_metadata(pa.BufferReader(data)).metadata)
    except (pa.ArrowException, OSError) as error:
        raise ValueError(f"it is not a part of a sweep: {error}") from None


def _parse_description(metadata: Mapping[bytes, bytes] | None) -> dict[str, Any]:
    try:
        return dict(json.loads((metadata or {})[_ABOUT.encode()]))
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"it is not a part of a sweep: {error}") from None


def decode_part_from_parquet(
    file: str, expected: Mapping[str, Any], names: Iterable[str] | None, states: int
) -> PartResults:
    """Read the columns `names`, or all; an empty list gives all columns without rows."""
    column_names = None if names is None else list(names)
    try:
        with (
            pa.OSFile(os.fsencode(file)) as stream,  # pyarrow refuses a str that is not UTF-8
            parquet.ParquetFile(stream, page_checksum_verification=True) as source,
        ):
            description = _parse_description(source.metadata.metadata)
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
            elif scope == b"time":
                part.columns[field.name] = values.reshape(len(array), states)
            else:
                part.columns[field.name] = values.reshape(len(array))
        return part
    except (pa.ArrowException, OSError, AttributeError, TypeError, ValueError) as error:
        # Parquet has no checksum of the schema, so a damaged schema can cause any of these errors.
        raise ValueError(f"{file} is damaged, or not a part of this sweep: {error}") from None
