"""Parts as numpy's own files, where pyarrow is not installed: an array with a named field for each
column, which numpy.load reads; behind it one of events, and what the part tells of itself."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .checksum import OPEN, is_whole
from .part_table import Column, PartTable

_ABOUT = b"\nkreisel: "


def encode(rows: PartTable, about: Mapping[str, Any]) -> bytearray:
    """The file, with an open seal."""
    out = io.BytesIO()
    np.lib.format.write_array(out, _fields(rows.columns), allow_pickle=False)
    if rows.ragged:
        np.lib.format.write_array(out, _fields(rows.ragged), allow_pickle=False)
    told = json.dumps({**about, "units": rows.units, "ragged": bool(rows.ragged)})
    out.write(_ABOUT + told.encode() + b"\n" + OPEN.encode() + b"\n")
    return bytearray(out.getbuffer())


def _fields(columns: Mapping[str, Column]) -> Column:
    """Columns as one array of rows."""
    kinds = [(name, values.dtype, values.shape[1:]) for name, values in columns.items()]
    rows = np.empty(len(next(iter(columns.values()))), dtype=kinds)
    for name, values in columns.items():
        rows[name] = values
    return rows


def about(file: str) -> dict[str, Any]:
    """Return the description in a part file; raise ValueError if the file is damaged."""
    return _read_header(file)[0]


def _read_header(file: str) -> tuple[dict[str, Any], bytes]:
    """Return the description in a complete part file, and its bytes."""
    data = Path(file).read_bytes()
    if not is_whole(data):
        raise ValueError(f"{file} is damaged, or no part of a sweep")
    at = data.rindex(_ABOUT)
    line, _, _ = data[at + len(_ABOUT) :].partition(b"\n")
    told: dict[str, Any] = json.loads(line)
    return told, data


def decode(file: str, names: Iterable[str] | None, states: int) -> PartTable:
    """The rows of a part, or some columns of them; ValueError where it is damaged."""
    about, data = _read_header(file)
    source = io.BytesIO(data)
    rows = np.lib.format.read_array(source, allow_pickle=False)
    met = np.lib.format.read_array(source, allow_pickle=False) if about["ragged"] else None
    wanted = None if names is None else set(names)
    columns, ragged = (
        {}
        if some is None
        else {
            name: np.ascontiguousarray(some[name])
            for name in some.dtype.names or ()
            if wanted is None or name in wanted
        }
        for some in (rows, met)
    )
    return PartTable(columns, ragged, dict(about["units"]))
