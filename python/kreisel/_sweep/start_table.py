"""Tables of initial states read from files, with one column per parameter or vector component."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .._utils.errors import unknown_name_message
from .._utils.optional import optional_dependency
from .._utils.units import find_unit_of_angles, get_parameter_unit, split_column_head
from .._utils.validation import Array
from .start_parameters import (
    PARAMETERS,
    list_component_groups,
    list_parameter_component_names,
)

PARQUET = "'kreisel[sweep]'"
_VALUES = (3, 3), (4,), (3,), (1,), ()  # possible shapes of a value, the largest first


def read_parameters_of_tops(file: str, degrees: bool | None) -> tuple[dict[str, Array], bool]:
    """Read parameters from a table, and return each as an array with one row per top.

    The second item returned is True if angles and rates are in degrees: the heads of the columns
    decide, or else `degrees`. Raises ValueError for an unknown column name or a wrong unit, and
    ImportError if pyarrow is not installed.
    """
    ending = Path(file).suffix.lower()
    if ending not in (".parquet", ".csv"):
        raise ValueError(f"{file}: a table of starts ends in .parquet or .csv")
    columns = _read_start_table_columns(file, ending)
    names = {head: split_column_head(head) for head in columns}
    table = {names[head][0]: values for head, values in columns.items()}
    parameters = _join_vector_components(file, table)
    units = [(head, unit, _find_unit(name)) for head, (name, unit) in names.items()]
    return parameters, find_unit_of_angles(units, degrees)


def _find_unit(column: str) -> str:
    """Return the unit of a column in radians."""
    [(parameter, names), *_] = list_component_groups(column) or [(column, [column])]
    return get_parameter_unit(parameter, False, names.index(column))


def _read_start_table_columns(file: str, ending: str) -> dict[str, npt.NDArray[np.generic]]:
    with optional_dependency(PARQUET):
        import pyarrow as pa
        import pyarrow.csv as text
        import pyarrow.parquet as parquet
    try:
        with pa.OSFile(os.fsencode(file)) as stream:  # pyarrow refuses a str that is not UTF-8
            table = parquet.read_table(stream) if ending == ".parquet" else text.read_csv(stream)
    except pa.ArrowInvalid as error:
        raise ValueError(f"{file} cannot be read: {error}") from None
    names = [split_column_head(head)[0] for head in table.column_names]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{file}: it has several columns {name!r}")
    holes = [name for name in table.column_names if table[name].null_count]
    if holes:
        raise ValueError(f"{file}: its column {holes[0]!r} has missing values")
    columns = {name: table[name].to_numpy() for name in table.column_names}
    for name, values in columns.items():
        if values.dtype.kind not in "fiub":
            raise ValueError(f"{file}: its column {name!r} must be numbers, not {table[name].type}")
    return columns


def _join_vector_components(
    file: str, columns: dict[str, npt.NDArray[np.generic]]
) -> dict[str, Array]:
    """Combine columns that contain components of the same parameter."""
    parameters, remainder = {}, dict(columns)
    for name in PARAMETERS:
        for value in _VALUES:
            names = list_parameter_component_names(name, value)
            if remainder.keys() >= set(names):
                parts = [remainder.pop(one) for one in names]
                parameters[name] = np.stack(parts, axis=-1).reshape(-1, *value)
    if remainder:
        raise ValueError(f"{file}: {_describe_unused_column(next(iter(remainder)), columns)}")
    return {name: np.asarray(values) for name, values in parameters.items()}


def _describe_unused_column(name: str, columns: Collection[str]) -> str:
    """Return the reason why a column is not a parameter, nor a component of a whole parameter."""
    absent = [
        (parameter, [one for one in names if one not in columns])
        for parameter, names in list_component_groups(name)
    ]
    if absent:
        parameter, names = min(absent, key=lambda group: len(group[1]))
        missing = "columns are" if len(names) > 1 else "column is"
        return (
            f"the column {name!r} is a component of {parameter}, whose other {missing} missing: "
            f"{', '.join(names)}"
        )
    return unknown_name_message("column", name, PARAMETERS)
