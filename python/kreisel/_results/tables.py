"""Tables of results: one list of columns, written to pandas, xarray and CSV."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._model.scene import Ensemble
from .._options.options import ANGLES, LOW, RECORDABLE, TIME, QuantityDescription
from .._utils.arguments import (
    Array,
    as_bool,
    format_column_head,
    get_angular_unit,
    get_parameter_unit,
    optional_dependency,
    short_repr,
    unknown_name_message,
)
from .._utils.files import atomic_write
from .._utils.quantity_attributes import QuantityAttributes, QuantityName

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset


TABLES = "'kreisel[tables]'"
# The names and labels of the dimensions of a quantity, by the shape of its value for one state.
_LABELS: dict[tuple[int, ...], dict[str, Sequence[str]]] = {
    (): {},
    (3,): {"axis": "xyz"},
    (4,): {"quaternion": "wxyz"},
    (3, 3): {"principal_axis": "NBT", "axis": "xyz"},
}


class TableColumn(NamedTuple):
    """A variable of a table.

    dims        the names of the first dimensions of `values`, in the order of the table
    components  the names of the columns of a flat table that contain the components of a vector;
                empty: a vector is a tuple in a single column
    labels      {name of a dimension of the components: labels, which may be missing}
    """

    name: str
    dims: tuple[str, ...]
    values: npt.NDArray[Any]
    unit: str = ""
    text: str = ""
    components: Sequence[str] = ()
    labels: Mapping[str, Sequence[str]] = {}
    is_coordinate: bool = False

    def split_components(self) -> Iterator[tuple[str, Any]]:
        """Yield the name and the values of each component, over the dimensions `dims`."""
        count = len(self.dims)
        if self.values.ndim == count or not self.components:
            yield self.name, self.values
            return
        rows = self.values.reshape(*self.values.shape[:count], len(self.components))
        for i, name in enumerate(self.components):
            yield name, rows[..., i]


class ColumnTable(NamedTuple):
    """Columns over common dimensions, given by their names and sizes."""

    sizes: Mapping[str, int]
    columns: Sequence[TableColumn]
    attributes: Mapping[str, object] = {}

    def flatten(self) -> dict[str, Any]:
        """Return one-dimensional columns, with a row for each element of all dimensions."""
        flat: dict[str, Any] = {}
        for column in self.columns:
            lead = [n if dim in column.dims else 1 for dim, n in self.sizes.items()]
            for name, values in column.split_components():
                inner = values.shape[len(column.dims) :]
                whole = np.broadcast_to(
                    values.reshape(*lead, *inner), (*self.sizes.values(), *inner)
                )
                rows = whole.reshape(-1, *inner)
                flat[name] = list(map(tuple, rows.tolist())) if inner else rows
        return flat

    def list_units(self) -> dict[str, str]:
        return {name: each.unit for each in self.columns for name, _ in each.split_components()}

    def number_dimensions(self) -> ColumnTable:
        """Return a table with a column of indices for each dimension of tops without a column."""
        names = {"time", *(column.name for column in self.columns)}
        numbers = [
            TableColumn(dim, (dim,), np.arange(n))
            for dim, n in self.sizes.items()
            if dim not in names
        ]
        return self._replace(columns=[*numbers, *self.columns])

    def to_pandas(self, index: Sequence[str] = ()) -> DataFrame:
        """Return the flat table as a DataFrame, with the columns `index` as its index."""
        with optional_dependency(TABLES):
            import pandas as pd
        frame = pd.DataFrame(self.flatten())
        frame = frame.set_index([*index]) if index else frame
        frame.attrs = {**self.attributes, "units": self.list_units()}
        return frame

    def to_xarray(self) -> Dataset:
        """Return a Dataset; times that are common to all tops are its coordinate `time`."""
        with optional_dependency(TABLES):
            import xarray as xr
        variables: dict[str, Any] = {}
        coordinates: dict[str, Any] = {}
        for column in self.columns:
            attributes = {"units": column.unit}
            if column.text:
                attributes["long_name"] = column.text
            name = "time" if (column.name, column.dims) == ("t", ("time",)) else column.name
            dims = (*column.dims, *column.labels)
            target = coordinates if column.is_coordinate else variables
            target[name] = (dims, np.array(column.values), attributes)
            coordinates |= {dim: [*labels] for dim, labels in column.labels.items() if labels}
        return xr.Dataset(variables, coordinates, self.attributes)

    def to_csv(self, file: str | os.PathLike[str]) -> None:
        """Write the flat table to a file, with the units in the heads of its columns."""
        units = self.list_units()
        atomic_write(
            file,
            encode_table_as_csv(
                {
                    format_column_head(name, units[name]): np.asarray(values).tolist()
                    for name, values in self.flatten().items()
                }
            ),
        )


def encode_table_as_csv(table: Mapping[str, Sequence[object]], head: bool = True) -> bytes:
    """Return a table in CSV format, with all significant digits of each number."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    if head:
        writer.writerow(table)
    writer.writerows(zip(*table.values(), strict=True))
    return text.getvalue().encode()


def list_component_labels(quantity: QuantityDescription) -> dict[str, Sequence[str]]:
    """Return the names of the dimensions of a vector or matrix quantity, and their labels."""
    return _LABELS.get(quantity.shape, {f"{quantity.name}_component": quantity.components})


def list_parameter_columns(tops: Ensemble, taken: Iterable[str] = ()) -> list[TableColumn]:
    """Return a column for each parameter that varies between tops.

    In xarray, a variable with the name of a dimension must have only this dimension. A parameter
    or dimension with one of the names in `taken` is therefore called, for example, spin_given.
    """
    columns = []
    for name, values in tops.coords.items():
        shape, inner = np.shape(values)[: tops.ndim], np.shape(values)[tops.ndim :]
        varied = [d for d, n in enumerate(shape) if n > 1 or tops.shape[d] == 1]
        dims = tuple(tops.axes[d] for d in varied)
        if name in tops.axes and dims != (name,):
            continue
        rows = np.array(values).reshape([shape[d] for d in varied] + list(inner))
        [given, *names] = _name_apart_from([name, *dims], taken)
        labels = {f"{given}_component": ()} if inner else {}
        unit = get_parameter_unit(name, tops._in_degrees)
        columns.append(
            TableColumn(given, tuple(names), rows, unit, labels=labels, is_coordinate=True)
        )
    return columns


def name_axes(tops: Ensemble, taken: Iterable[str] = ()) -> tuple[str, ...]:
    """Return the names of the dimensions of `tops`, apart from the names `taken`."""
    return tuple(_name_apart_from(tops.axes, taken))


def _name_apart_from(names: Iterable[str], taken: Iterable[str]) -> list[str]:
    return [f"{name}_given" if name in taken else name for name in names]


def describe_quantities(
    path: TableExportMethods, names: Iterable[str], degrees: bool
) -> list[QuantityDescription]:
    """Return the requested quantities, in degrees instead of radians if `degrees` is True.

    If `names` is empty, all quantities that the path stores are returned. The name 't' is ignored,
    because all tables contain the times.
    """
    in_degrees, requested = as_bool("degrees", degrees), list(names)
    for name in requested:
        if not isinstance(name, str):
            raise TypeError(
                "quantities must be names, as in to_pandas('nutation', 'energy'), not "
                f"{short_repr(name)}"
            )
        if name not in RECORDABLE and name != TIME.name:
            raise ValueError(unknown_name_message("quantity", name, RECORDABLE))
    stored = ("q", "m") if path._low is None else ("q", "m", *LOW)
    quantities = [
        RECORDABLE[name]
        for name in dict.fromkeys(requested or (stored if path.want is None else path.want))
        if name != TIME.name
    ]
    return [q._replace(dimension=get_angular_unit(q.dimension, in_degrees)) for q in quantities]


def list_quantity_columns(
    path: TableExportMethods,
    names: Iterable[str] = (),
    degrees: bool = False,
    unwrap: bool = False,
    axes: tuple[str, ...] = (),
) -> list[TableColumn]:
    """Return the times and the quantities of `describe_quantities`, over `axes` and the times."""
    is_unwrapped, dims, t = as_bool("unwrap", unwrap), (*axes, "time"), path.t
    time_dims = dims if t.ndim > 1 else ("time",)
    columns = [TableColumn("t", time_dims, t, TIME.dimension, TIME.text, is_coordinate=True)]
    for each in describe_quantities(path, names, degrees):
        values = getattr(path, each.name)
        if is_unwrapped and each.name in ANGLES:
            values = np.unwrap(values)
        if each.dimension.startswith("deg"):
            values = np.degrees(values)
        labels = list_component_labels(each)
        columns.append(
            TableColumn(each.name, dims, values, each.dimension, each.text, each.components, labels)
        )
    return columns


def columns(
    path: TableExportMethods, names: Iterable[str], degrees: bool = False
) -> dict[str, Array]:
    """Return t and the components of the quantities in `names` as one-dimensional columns."""
    return dict(
        part
        for each in list_quantity_columns(path, names, degrees)
        for part in each.split_components()
    )


def format_column_heads(
    path: TableExportMethods, names: Iterable[str], degrees: bool
) -> dict[str, str]:
    """Return the head of each of these columns: its name and unit."""
    quantities = [TIME, *describe_quantities(path, names, degrees)]
    return {
        name: format_column_head(name, each.dimension)
        for each in quantities
        for name in each.components
    }


class TableExportMethods(QuantityAttributes):
    """Methods of paths that export tables."""

    if TYPE_CHECKING:

        @property
        def t(self) -> Array: ...
        @property
        def want(self) -> tuple[QuantityName, ...] | None: ...
        @property
        def _low(self) -> Array | None: ...

    def _tabulate(self, names: Iterable[str], degrees: bool, unwrap: bool) -> ColumnTable:
        """Return the times and quantities, with the attributes of the run."""
        raise NotImplementedError

    def euler(self, *, degrees: bool = False, unwrap: bool = False) -> Array:
        """Return the z-x-z Euler angles as columns: precession_angle, nutation, spin_angle [rad].

        degrees  True: return degrees
        unwrap   True: remove jumps of whole turns; consecutive states must be less than half a
                 turn apart

            >>> import kreisel as kr
            >>> kr.solve(kr.scenes.cusps, [0.0]).euler(degrees=True).round(6).tolist()
            [[0.0, 53.130102, 0.0]]
        """
        angles = list_quantity_columns(
            self, ["precession_angle", "nutation", "spin_angle"], degrees, unwrap
        )
        return np.stack([each.values for each in angles[1:]], axis=-1)

    def to_pandas(self, *names: str, degrees: bool = False, unwrap: bool = False) -> DataFrame:
        """Return a pandas.DataFrame with one row per state, indexed by t.

        For many tops, the rows are indexed by the dimensions of the ensemble and by t. The columns
        then begin with the other varying parameters, `status` and `reached`; a parameter with the
        name of a quantity in the table is called, for example, spin_given.

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
        table = self._tabulate(names, degrees, unwrap).number_dimensions()
        return table.to_pandas([*(dim for dim in table.sizes if dim != "time"), "t"])

    def to_xarray(self, *names: str, degrees: bool = False, unwrap: bool = False) -> Dataset:
        """Return an xarray.Dataset with one variable per quantity in `names`.

        If no names are given, the Dataset contains all quantities that the path stores. The
        dimensions of every variable are those of the ensemble, if there is one, and time. The
        dimensions of the components are named quaternion (w, x, y, z), axis (x, y, z) and
        principal_axis (N, B, T).

            >>> import kreisel as kr
            >>> kr.solve(kr.scenes.cusps, [0.0, 1.0]).to_xarray("frame")["frame"].dims
            ('time', 'principal_axis', 'axis')
            >>> tops = kr.scenes.thesis.vary(gravity=[0.5, 1.0])
            >>> kr.solve(tops, [0.0, 1.0]).to_xarray("apex")["apex"].dims
            ('gravity', 'time', 'axis')

        For many tops, the coordinates include the varying parameters, `status` and `reached`. A
        parameter with the name of a quantity in the Dataset is called, for example, spin_given, and
        so is its dimension. If each top has its own times, the coordinate t depends on the
        dimensions of the ensemble and on time.

        Each variable has the attributes `long_name` and `units`; the units are as in to_pandas. The
        attributes of the Dataset are the method, its step, tol and digits if given, and for one
        top the scene in TOML format. The arguments and exceptions are the same as for to_pandas,
        but ImportError is raised if xarray is not installed.
        """
        return self._tabulate(names, degrees, unwrap).to_xarray()

    def to_csv(
        self,
        file: str | os.PathLike[str],
        *names: str,
        degrees: bool = False,
        unwrap: bool = False,
    ) -> None:
        """Write t and the components of the quantities in `names` as CSV, in full precision.

        If no names are given, all quantities that the path stores are written. For many tops, they
        follow the dimensions of the ensemble and the other columns named in to_pandas. The first
        line of the file contains the names and units of the columns. Numbers without a unit have
        none.

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
        self._tabulate(names, degrees, unwrap).number_dimensions().to_csv(file)
