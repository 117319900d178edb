"""Tables of starts in files: a column for each word, or for each of its components."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .._utils.errors import unknown_name_message
from .._utils.optional import optional_dependency
from .._utils.validation import Array
from .parameter_values import WORDS, components

PARQUET = "'kreisel[sweep]'"
_VALUES = (3, 3), (4,), (3,), (1,), ()  # shapes of a word's value, the longest first


def read_columns(file: str) -> dict[str, Array]:
    """The words in a table, (n, *value) each; ValueError for columns that are none."""
    ending = Path(file).suffix.lower()
    if ending == ".npz":
        columns = _of_npz(file)
        known = {name: np.asarray(columns.pop(name)) for name in WORDS if name in columns}
        return known | {name: np.asarray(column) for name, column in columns.items()}
    if ending not in (".parquet", ".csv"):
        raise ValueError(f"{file}: a table of starts ends in .parquet, .csv or .npz")
    return _words(file, _of_arrow(file, ending))


def _of_npz(file: str) -> dict[str, npt.NDArray[np.generic]]:
    try:
        with np.load(file, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (ValueError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"{file} is no archive of numpy: {error}") from None


def _of_arrow(file: str, ending: str) -> dict[str, npt.NDArray[np.generic]]:
    with optional_dependency(PARQUET):
        import pyarrow as pa
        import pyarrow.csv as text
        import pyarrow.parquet as parquet
    try:
        table = parquet.read_table(file) if ending == ".parquet" else text.read_csv(file)
    except pa.ArrowInvalid as error:
        raise ValueError(f"{file} cannot be read: {error}") from None
    for name in table.column_names:
        if table.column_names.count(name) > 1:
            raise ValueError(f"{file}: it has more than one column {name!r}")
    holes = [name for name in table.column_names if table[name].null_count]
    if holes:
        raise ValueError(f"{file}: its column {holes[0]!r} has places without a value")
    columns = {name: table[name].to_numpy() for name in table.column_names}
    for name, values in columns.items():
        if values.dtype.kind not in "fiub":
            raise ValueError(f"{file}: its column {name!r} must be numbers, not {table[name].type}")
    return columns


def _words(file: str, columns: dict[str, npt.NDArray[np.generic]]) -> dict[str, Array]:
    """Columns put together, component by component, as the words that they are."""
    words, left = {}, dict(columns)
    for name in WORDS:
        for value in _VALUES:
            names = components(name, value)
            if left.keys() >= set(names):
                joined = [left.pop(one) for one in names]
                words[name] = np.stack(joined, axis=-1).reshape(-1, *value)
    if left:
        known = [one for name in WORDS for one in components(name, ())]
        raise ValueError(f"{file}: {unknown_name_message('column', next(iter(left)), known)}")
    return {name: np.asarray(values) for name, values in words.items()}
