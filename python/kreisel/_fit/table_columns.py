"""Reading of CSV files and data frames, and assignment of their columns to quantities."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from .._utils.errors import unknown_name_message
from .._utils.units import split_column_head
from .._utils.validation import Array, as_array, short_repr

if TYPE_CHECKING:
    from pandas import DataFrame

_DELIMITERS = ",;\t"


def read_csv_columns(
    file: str | os.PathLike[str], columns: object = None, t: object = ""
) -> dict[str, Array]:
    """Read the columns of a CSV file; empty fields are NaN.

    Columns that are neither `t` nor in `columns` may contain words, and are NaN; if `columns` is
    None, all are needed.
    """
    name = os.fspath(file)
    rows = _read_csv_rows(name)
    if len(rows) < 2:
        raise ValueError(f"{name}: it needs a line of names and at least one line of numbers")
    names = [word.strip() for word in rows[0]]
    if len(set(names)) < len(names):
        raise ValueError(f"{name}: two columns have the same name: {', '.join(names)}")
    is_needed = [True] * len(names)
    if isinstance(columns, Mapping):
        needed = [t, *_list_names(columns.values())]
        is_needed = [head in needed or split_column_head(head)[0] in needed for head in names]
    numbers = np.full((len(rows) - 1, len(names)), np.nan)
    for i, row in enumerate(rows[1:]):
        if len(row) != len(names):
            raise ValueError(f"{name}: row {i + 1} has {len(row)} fields instead of {len(names)}")
        for k in np.flatnonzero(is_needed):
            numbers[i, k] = _parse_number_field(name, i + 1, row[k])
    return {word: numbers[:, k] for k, word in enumerate(names)}


def _list_names(values: Iterable[str | Sequence[str]]) -> list[str]:
    """Return the names of columns in the values of `columns`."""
    return [name for value in values for name in ([value] if isinstance(value, str) else value)]


def _read_csv_rows(name: str) -> list[list[str]]:
    """Return the fields of each row of a CSV file, skipping rows in which all fields are empty."""
    with open(name, encoding="utf-8-sig", newline="") as text:
        try:
            head = next((line for line in text if line.strip()), "")
            delimiter = max(_DELIMITERS, key=head.count)
            lines = chain([head], text)  # a pipe cannot be read again from its beginning
            return [
                row for row in csv.reader(lines, delimiter=delimiter) if any(map(str.strip, row))
            ]
        except (UnicodeDecodeError, csv.Error) as error:
            raise ValueError(f"{name} is not a CSV file in UTF-8: {error}") from None


def _parse_number_field(file: str, row: int, word: str) -> float:
    try:
        return float(word) if word.strip() else np.nan
    except ValueError:
        hint = "; write decimal points, not commas" if "," in word else ""
        raise ValueError(
            f"{file}: row {row} has {short_repr(word)}, which is not a number{hint}"
        ) from None


def read_data_frame_columns(frame: DataFrame, t: str) -> dict[str, Array]:
    """Return the columns of a data frame, and its index if the index is named `t`."""
    if not hasattr(frame, "columns") or not hasattr(frame, "index"):
        raise TypeError(f"frame must be a pandas.DataFrame, not {short_repr(frame)}")
    table = {str(name): np.asarray(frame[name]) for name in frame.columns}
    head = str(frame.index.name)
    if t not in table and t in (head, split_column_head(head)[0]):
        table[head] = np.asarray(frame.index)
    return table


def select_measured_columns(
    table: Mapping[str, Array],
    columns: Mapping[str, str | Sequence[str]] | None,
    t: str,
    parts: Mapping[str, tuple[str, int]],
) -> tuple[Array, dict[str, Array], list[tuple[str, str]]]:
    """Select the times and the measured quantities from a table.

    The last item returned has the head of each selected column, and its quantity or component.
    `parts` maps component names, such as "apex_x", to pairs of a quantity and an index.
    """
    time = _find_column("column of times", t, table)
    if columns is None:
        measured = [split_column_head(head)[0] for head in table if head != time]
        heads = {name: _find_column("column", name, table) for name in measured}
        values = _join_vector_components({n: table[head] for n, head in heads.items()}, parts)
        return table[time], values, [(head, name) for name, head in heads.items()]
    if not isinstance(columns, Mapping):
        raise TypeError(
            "columns must map quantities to names of columns, as in "
            f"{{'spin': 'rpm'}}, not {short_repr(columns)}"
        )
    values, selection = {}, []
    for quantity, names in columns.items():
        words = [names] if isinstance(names, str) else names
        found = [_find_column("column", name, table) for name in words]
        values[quantity] = (
            table[found[0]]
            if isinstance(names, str)
            else np.stack([as_array(head, table[head], "numbers") for head in found], axis=-1)
        )
        selection += [(head, quantity) for head in found]
    return table[time], values, selection


def _find_column(kind: str, name: object, table: Mapping[str, Array]) -> str:
    """Return the head of the column that has this head, or this name before its unit."""
    if not isinstance(name, str):
        raise TypeError(f"a {kind} must have a name, not {short_repr(name)}")
    heads = [name] if name in table else [h for h in table if split_column_head(h)[0] == name]
    if not heads:
        raise ValueError(unknown_name_message(kind, name, table))
    if len(heads) > 1:
        raise ValueError(f"several columns are called {name}: {', '.join(heads)}")
    return heads[0]


def _join_vector_components(
    table: dict[str, Array], parts: Mapping[str, tuple[str, int]]
) -> dict[str, Array]:
    """Merge the component columns of each vector quantity in a table into one array."""
    for name in table:
        if name not in parts:
            hint = unknown_name_message("quantity in the name of a column:", name, parts)
            raise ValueError(f"{hint}; or pass columns")
    names_by_quantity: dict[str, list[str]] = {}
    for name, (quantity, _) in parts.items():
        names_by_quantity.setdefault(quantity, []).append(name)
    values: dict[str, Array] = {}
    for name, column in table.items():
        quantity = parts[name][0]
        names = names_by_quantity[quantity]
        if len(names) == 1 or not all(n in table for n in names) or len(names) == 9:
            values[name] = column
        elif quantity not in values:
            values[quantity] = np.stack([table[n] for n in names], axis=-1)
    return values
