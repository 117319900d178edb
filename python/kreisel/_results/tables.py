"""Conversion of paths to pandas, xarray and CSV."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from .._options.quantities import ANGLES, LOW, RECORDABLE, TIME, QuantityDescription
from .._utils.arguments import (
    Array,
    as_bool,
    format_column_head,
    get_angular_unit,
    optional_dependency,
    short_repr,
    unknown_name_message,
)
from .._utils.files import atomic_write
from .._utils.quantity_attributes import QuantityName
from .quantities import PathBase

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset


QuantityRows = list[tuple[QuantityDescription, Array]]


class HasQuantities(Protocol):
    """An object with physical quantities as attributes: a path or the paths of an ensemble."""

    @property
    def want(self) -> tuple[QuantityName, ...] | None: ...
    @property
    def _low(self) -> Array | None: ...


TABLES = "'kreisel[tables]'"
_EULER = "precession_angle", "nutation", "spin_angle"
# The names and labels of the dimensions of a quantity, by the shape of its value for one state.
DIMENSIONS: dict[tuple[int, ...], dict[str, list[str]]] = {
    (): {},
    (3,): {"axis": [*"xyz"]},
    (4,): {"quaternion": [*"wxyz"]},
    (3, 3): {"principal_axis": [*"NBT"], "axis": [*"xyz"]},
}


def describe_quantities(
    path: HasQuantities, names: Iterable[str], degrees: bool
) -> list[QuantityDescription]:
    """Return the requested quantities, in degrees instead of radians if `degrees` is True.

    If `names` is empty, all quantities that the path stores are returned. The name 't' is ignored,
    because all tables contain the times.
    """
    in_degrees, requested = as_bool("degrees", degrees), list(names)
    _validate_quantity_names(requested)
    quantities = [
        RECORDABLE[name]
        for name in dict.fromkeys(requested or _list_default_quantity_names(path))
        if name != TIME.name
    ]
    return [q._replace(dimension=get_angular_unit(q.dimension, in_degrees)) for q in quantities]


def build_quantity_value_pairs(
    path: HasQuantities, names: Iterable[str], degrees: bool, unwrap: bool
) -> QuantityRows:
    """Return the quantities of `describe_quantities` with their values at all states."""
    is_unwrapped, rows = as_bool("unwrap", unwrap), []
    for quantity in describe_quantities(path, names, degrees):
        values = getattr(path, quantity.name)
        if is_unwrapped and quantity.name in ANGLES:
            values = np.unwrap(values)
        if quantity.dimension.startswith("deg"):
            values = np.degrees(values)
        rows.append((quantity, values))
    return rows


def _validate_quantity_names(names: Iterable[str]) -> None:
    for name in names:
        if not isinstance(name, str):
            raise TypeError(
                "quantities must be names, as in to_pandas('nutation', 'energy'), not "
                f"{short_repr(name)}"
            )
        if name not in RECORDABLE and name != TIME.name:
            raise ValueError(unknown_name_message("quantity", name, RECORDABLE))


def _list_default_quantity_names(path: HasQuantities) -> tuple[str, ...]:
    if path.want is not None:
        return path.want
    return ("q", "m") if path._low is None else ("q", "m", *LOW)


def columns(
    path: PathBase, names: Iterable[str] = (), degrees: bool = False, unwrap: bool = False
) -> dict[str, Array]:
    """Return t and the components of the quantities in `names` as one-dimensional columns."""
    return _build_component_columns(path, build_quantity_value_pairs(path, names, degrees, unwrap))


def _build_component_columns(path: PathBase, rows: QuantityRows) -> dict[str, Array]:
    table = {"t": path.t}
    for quantity, values in rows:
        table |= zip(
            quantity.components, values.reshape(len(path), quantity.doubles).T, strict=True
        )
    return table


def units(path: HasQuantities, names: Iterable[str], degrees: bool) -> dict[str, str]:
    """Return the unit of the time and of every component of the given quantities."""
    quantities = [TIME, *describe_quantities(path, names, degrees)]
    return {name: each.dimension for each in quantities for name in each.components}


def format_column_heads(path: HasQuantities, names: Iterable[str], degrees: bool) -> dict[str, str]:
    """Return the head of each of these columns: its name and unit."""
    heads = units(path, names, degrees)
    return {name: format_column_head(name, unit) for name, unit in heads.items()}


def encode_table_as_csv(table: Mapping[str, Sequence[object]], head: bool = True) -> bytes:
    """Return a table in CSV format, with all significant digits of each number."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    if head:
        writer.writerow(table)
    writer.writerows(zip(*table.values(), strict=True))
    return text.getvalue().encode()


class TableExportMethods(PathBase):
    """Methods of a path that export tables."""

    def euler(self, *, degrees: bool = False, unwrap: bool = False) -> Array:
        """Return the z-x-z Euler angles as columns: precession_angle, nutation, spin_angle [rad].

        degrees  True: return degrees
        unwrap   True: remove jumps of whole turns; consecutive states must be less than half a
                 turn apart

            >>> import kreisel as kr
            >>> kr.solve(kr.scenes.cusps, [0.0]).euler(degrees=True).round(6).tolist()
            [[0.0, 53.130102, 0.0]]
        """
        angles = build_quantity_value_pairs(self, _EULER, degrees, unwrap)
        return np.column_stack([values for _, values in angles])

    def to_pandas(self, *names: str, degrees: bool = False, unwrap: bool = False) -> DataFrame:
        """Return a pandas.DataFrame with one row per state, indexed by t.

        The columns are the components of the quantities in `names`. If no names are given, the
        columns are the components of all quantities that the path stores.

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.cusps, [0.0, 1.0])
            >>> table = path.to_pandas("nutation", "m", degrees=True)
            >>> list(table), table.attrs["units"]["nutation"]
            (['nutation', 'm_x', 'm_y', 'm_z'], 'deg')

        `attrs` contains the method, the scene and, under `units`, the unit of each column: 'rad',
        'rad/T' or 'rad/T^2' for angles and their derivatives, and a dimension [M L T] for others.
        With degrees=True, degrees take the place of radians. unwrap=True removes jumps of whole
        turns from angles. Raises ValueError for an unknown name, and TypeError for a
        name that is not a string. Raises AttributeError for a quantity that `want` excludes, and
        ImportError if pandas is not installed.
        """
        with optional_dependency(TABLES):
            import pandas as pd
        rows = build_quantity_value_pairs(self, names, degrees, unwrap)
        frame = pd.DataFrame(_build_component_columns(self, rows)).set_index("t")
        frame.attrs = self._list_run_attributes() | {"units": units(self, names, degrees)}
        return frame

    def to_xarray(self, *names: str, degrees: bool = False, unwrap: bool = False) -> Dataset:
        """Return an xarray.Dataset with one variable per quantity in `names`.

        If no names are given, the Dataset contains all quantities that the path stores. The first
        dimension of every variable is time. The dimensions of the components are named quaternion
        (w, x, y, z), axis (x, y, z) and principal_axis (N, B, T).

            >>> import kreisel as kr
            >>> kr.solve(kr.scenes.cusps, [0.0, 1.0]).to_xarray("frame")["frame"].dims
            ('time', 'principal_axis', 'axis')

        Each variable has the attributes `long_name` and `units`; the units are as in to_pandas. The
        attributes of the Dataset are the method, its step, tol and digits if given, and the scene
        in TOML format. The arguments and exceptions are the same as for to_pandas, but ImportError
        is raised if xarray is not installed.
        """
        with optional_dependency(TABLES):
            import xarray as xr
        coordinates: dict[str, list[str]] = {}
        variables = {}
        for quantity, values in [
            (TIME, self.t),
            *build_quantity_value_pairs(self, names, degrees, unwrap),
        ]:
            attributes = {"units": quantity.dimension, "long_name": quantity.text}
            labels = {f"{quantity.name}_component": quantity.components}
            dimensions = DIMENSIONS.get(quantity.shape, labels)
            coordinates |= dimensions
            variables[quantity.name] = (("time", *dimensions), np.array(values), attributes)
        time = {"time": variables.pop("t")}
        return xr.Dataset(variables, {**time, **coordinates}, self._list_run_attributes())

    def to_csv(
        self,
        file: str | os.PathLike[str],
        *names: str,
        degrees: bool = False,
        unwrap: bool = False,
    ) -> None:
        """Write t and the components of the quantities in `names` as CSV, in full precision.

        If no names are given, all quantities that the path stores are written. The first line of
        the file contains the names and units of the columns. Numbers without a unit have none.

            >>> import pathlib, tempfile
            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.cusps, [0.0, 1.0])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     file = pathlib.Path(folder, "top.csv")
            ...     path.to_csv(file, "m", "spin", degrees=True)
            ...     file.read_text().splitlines()[0]
            't [T],m_x [M L^2 T^-1],m_y [M L^2 T^-1],m_z [M L^2 T^-1],spin [deg/T]'

        kr.Record.from_csv and `kreisel fit` read the units. pandas 3.1 or later reads bitwise equal
        values; older versions need float_precision="round_trip". The file is replaced atomically.
        Raises OSError if the file cannot be written. Raises the same exceptions as to_pandas, but
        never ImportError, because pandas is not required.
        """
        table = columns(self, names, degrees, unwrap)
        heads = format_column_heads(self, names, degrees)
        lists = {heads[name]: column.tolist() for name, column in table.items()}
        atomic_write(file, encode_table_as_csv(lists))

    def _list_run_attributes(self) -> dict[str, object]:
        words = {"method": self.method, "step": self.step, "tol": self.tol, "digits": self.digits}
        attributes: dict[str, object] = {
            word: value for word, value in words.items() if value is not None
        }
        return attributes | {"scene": self.scene.to_toml()}
