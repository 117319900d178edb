"""Results in tables (one list of columns, written to pandas, xarray and CSV) and in archives."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import numpy as np
import numpy.typing as npt

from .._core import tangents as TANGENTS
from .._core import version
from .._model.parameters import get_parameter_unit
from .._model.scene import Scene, parse_scene_toml
from .._options import options as choices
from .._options.options import LOW, RECORDABLE, TIME, Options, QuantityDescription
from .._options.plan import StepChoice
from .._utils import arguments
from .._utils.arguments import Array, as_bool, as_float, as_int, short_repr
from .._utils.files import ArchiveReader, Integers, atomic_write, pack_archive
from .._utils.quantity_attributes import QuantityAttributes
from . import calls
from .calls import EnsembleBuffers, EventColumns, TangentData

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
        lead = self.values.shape[: len(self.dims)]
        if self.values.shape == lead or not self.components:
            yield self.name, self.values
            return
        columns = self.values.reshape(*lead, len(self.components))
        yield from zip(self.components, np.moveaxis(columns, -1, 0), strict=True)


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
                whole = *self.sizes.values(), *inner
                rows = np.broadcast_to(values.reshape((*lead, *inner)), whole).reshape(-1, *inner)
                flat[name] = list(map(tuple, rows.tolist())) if inner else rows
        return flat

    def list_units(self) -> dict[str, str]:
        return {name: each.unit for each in self.columns for name, _ in each.split_components()}

    def list_heads(self) -> dict[str, str]:
        """Return the head of each flat column: its name and unit."""
        units = self.list_units().items()
        return {name: f"{name} [{unit}]" if unit else name for name, unit in units}

    def number_dimensions(self) -> ColumnTable:
        """Return a table with a column of indices for each dimension of tops without a column."""
        names = {"time", *(column.name for column in self.columns)}
        dims = {dim: np.arange(n) for dim, n in self.sizes.items() if dim not in names}
        numbers = [TableColumn(dim, (dim,), rows) for dim, rows in dims.items()]
        return self._replace(columns=[*numbers, *self.columns])

    def to_pandas(self, index: Sequence[str] = ()) -> DataFrame:
        """Return the flat table as a DataFrame, with the columns `index` as its index."""
        with arguments.optional_dependency(TABLES):
            import pandas as pd
        frame = pd.DataFrame(self.flatten())
        frame = frame.set_index([*index]) if index else frame
        frame.attrs = {**self.attributes, "units": self.list_units()}
        return frame

    def to_xarray(self) -> Dataset:
        """Return a Dataset; times that are common to all tops are its coordinate `time`."""
        with arguments.optional_dependency(TABLES):
            import xarray as xr
        variables: dict[str, Any] = {}
        coordinates: dict[str, Any] = {}
        for column in self.columns:
            long_name = {"long_name": column.text} if column.text else {}
            attributes = {"units": column.unit, **long_name}
            name = "time" if (column.name, column.dims) == ("t", ("time",)) else column.name
            dims = (*column.dims, *column.labels)
            target = coordinates if column.is_coordinate else variables
            target[name] = (dims, np.array(column.values), attributes)
            coordinates |= {dim: [*labels] for dim, labels in column.labels.items() if labels}
        return xr.Dataset(variables, coordinates, self.attributes)

    def to_csv(self, file: str | os.PathLike[str]) -> None:
        """Write the flat table to a file, with the units in the heads of its columns."""
        heads, flat = self.list_heads(), self.flatten()
        table = {heads[name]: np.asarray(values).tolist() for name, values in flat.items()}
        atomic_write(file, encode_table_as_csv(table))


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


def list_parameter_columns(tops: Scene, taken: Iterable[str] = ()) -> list[TableColumn]:
    """Return a column for each parameter that varies between tops.

    In xarray, a variable with the name of a dimension must have only this dimension. A parameter
    or dimension with one of the names in `taken` is therefore called, for example, spin_given.
    """
    columns = []
    for name, values in tops.coords.items():
        shape, inner = np.shape(values)[: tops.ndim], np.shape(values)[tops.ndim :]
        varied = [d for d, n in enumerate(shape) if n != 1 or tops.shape[d] == 1]
        dims = tuple(tops.axes[d] for d in varied)
        if name in tops.axes and dims != (name,):
            continue
        rows = np.array(values).reshape([shape[d] for d in varied] + list(inner))
        [given, *names] = [f"{word}_given" if word in taken else word for word in (name, *dims)]
        labels = {f"{given}_component": ()} if inner else {}
        unit = get_parameter_unit(name, tops._in_degrees)
        column = TableColumn(given, tuple(names), rows, unit, labels=labels, is_coordinate=True)
        columns.append(column)
    return columns


def name_axes(tops: Any, taken: Iterable[str] = ()) -> tuple[str, ...]:
    """Return the names of the dimensions of `tops`, apart from the names `taken`."""
    return tuple(f"{name}_given" if name in taken else name for name in tops.axes)


def describe_quantities(
    path: Any, names: Iterable[str], degrees: bool
) -> list[QuantityDescription]:
    """Return the requested quantities, in degrees instead of radians if `degrees` is True.

    If `names` is empty, all quantities that the path stores are returned. The name 't' is ignored,
    because all tables contain the times.
    """
    in_degrees, requested = as_bool("degrees", degrees), list(names) or path.want
    for name in requested or ():
        if not isinstance(name, str):
            raise TypeError(
                "quantities must be names, as in to_pandas('nutation', 'energy'), not "
                f"{short_repr(name)}"
            )
        if name not in RECORDABLE and name != TIME.name:
            raise ValueError(arguments.unknown_name_message("quantity", name, RECORDABLE))
    if requested is None:
        requested = ("q", "m") if path._low is None else ("q", "m", *LOW)
    rows = [RECORDABLE[name] for name in dict.fromkeys(requested) if name != TIME.name]
    units = [arguments.get_angular_unit(row.dimension, in_degrees) for row in rows]
    return [row._replace(dimension=unit) for row, unit in zip(rows, units, strict=True)]


def list_quantity_columns(
    path: Any,
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
        if is_unwrapped and each.name in choices.ANGLES:
            values = np.unwrap(values)
        if each.dimension.startswith("deg"):
            values = np.degrees(values)
        rest = each.dimension, each.text, each.components, list_component_labels(each)
        columns.append(TableColumn(each.name, dims, values, *rest))
    return columns


class TableExportMethods(QuantityAttributes):
    """Methods of paths that export tables."""

    _tabulate: Callable[[Iterable[str], bool, bool], ColumnTable]  # of a path

    def euler(self, *, degrees: bool = False, unwrap: bool = False) -> Array:
        """Return the z-x-z Euler angles as columns: precession_angle, nutation, spin_angle [rad].

        degrees  True: return degrees
        unwrap   True: remove jumps of whole turns between states less than half a turn apart

            >>> import kreisel as kr
            >>> kr.solve(kr.scenes.cusps, [0.0]).euler(degrees=True).round(6).tolist()
            [[0.0, 53.130102, 0.0]]
        """
        names = "precession_angle", "nutation", "spin_angle"
        angles = list_quantity_columns(self, names, degrees, unwrap)[1:]
        return np.stack([each.values for each in angles], axis=-1)

    def to_pandas(self, *names: str, degrees: bool = False, unwrap: bool = False) -> DataFrame:
        """Return a pandas.DataFrame with one row per state, indexed by t.

        The columns are the components of the quantities in `names`, by default of all that the path
        stores. For many tops, the rows are indexed by the dimensions of the ensemble and by t, and
        the other varying parameters, `status` and `reached` come first; a parameter with the name
        of a quantity in the table is called, for example, spin_given.

            >>> import kreisel as kr
            >>> path = kr.solve(kr.scenes.cusps, [0.0, 1.0])
            >>> table = path.to_pandas("nutation", "m", degrees=True)
            >>> list(table), table.attrs["units"]["nutation"]
            (['nutation', 'm_x', 'm_y', 'm_z'], 'deg')

        `attrs` contains the method, the scene and, under `units`, the unit of each column: 'rad',
        'rad/T' or 'rad/T^2' for angles and their derivatives (degrees=True: 'deg', ...), and a
        dimension [M L T] for others. unwrap=True removes jumps of whole turns from angles. Raises
        ValueError for an unknown name, TypeError for a name that is not a string, AttributeError
        for a quantity that `want` excludes, and ImportError if pandas is not installed.
        """
        table = self._tabulate(names, degrees, unwrap).number_dimensions()
        return table.to_pandas([*(dim for dim in table.sizes if dim != "time"), "t"])

    def to_xarray(self, *names: str, degrees: bool = False, unwrap: bool = False) -> Dataset:
        """Return an xarray.Dataset with one variable per quantity in `names`.

        The default, the arguments and the exceptions are those of to_pandas. The dimensions of
        every variable are those of the ensemble, time, and those of the components: quaternion (w,
        x, y, z), axis (x, y, z) and principal_axis (N, B, T).

            >>> import kreisel as kr
            >>> kr.solve(kr.scenes.cusps, [0.0, 1.0]).to_xarray("frame")["frame"].dims
            ('time', 'principal_axis', 'axis')
            >>> tops = kr.scenes.thesis.vary(gravity=[0.5, 1.0])
            >>> kr.solve(tops, [0.0, 1.0]).to_xarray("apex")["apex"].dims
            ('gravity', 'time', 'axis')

        For many tops, the coordinates include the varying parameters, `status` and `reached`. A
        parameter with the name of a quantity in the Dataset is called, for example, spin_given, and
        so is its dimension. If each top has its own times, the coordinate t depends on the
        dimensions of the ensemble and on time. Each variable has the attributes `long_name` and
        `units`. The attributes of the Dataset are the method, its step, tol and digits if given,
        and for one top the scene in TOML.
        """
        return self._tabulate(names, degrees, unwrap).to_xarray()

    def to_csv(
        self, file: str | os.PathLike[str], *names: str, degrees: bool = False, unwrap: bool = False
    ) -> None:
        """Write t and the components of the quantities in `names` as CSV, in full precision.

        The other arguments and columns are those of to_pandas, and so are the exceptions, except
        ImportError. The first line contains the names and units of the columns.

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
        Raises OSError if the file cannot be written.
        """
        self._tabulate(names, degrees, unwrap).number_dimensions().to_csv(file)


_FORMAT = 1  # version of the archive's layout: the header's entries and the names of the arrays
_EVENTS = "events_"
_MET = "which", "direction"
PathArguments = dict[str, Any]  # keyword arguments of kreisel.Path
SavedEnsemble = tuple[Scene, Array, Options, EnsembleBuffers]


def encode_as_archive(path: Any) -> bytes:
    """Return the archive of a kreisel.Path, as described in Path.save."""

    def list_states(path: Any, prefix: str) -> dict[str, Any]:
        low = () if path._low is None else LOW
        names = ("q", "m", *low) if path.want is None else path.want
        return {prefix + name: getattr(path, name) for name in ("t", *names)}

    head = {"kreisel": version, "format": _FORMAT, **path._options.to_json()}
    if path._is_many:
        return _encode_many(head, path.scene, path._t, path._buffers)
    data, events, choice = path._tangent_data, path._events, path._choice
    head |= {
        "step": path.step,
        "low": path._low is not None,
        "start": path._origin.to_json(),
        "stats": path.stats,
        "choice": choice and asdict(choice),
        "tangents": data and {"by": data.by, "rest": data.truncation},
        "events": None,
    }
    arrays = list_states(path, "")
    if data:
        arrays |= {"tangents": data.high, "tangents_low": data.low}
    if events is not None:
        head["events"] = {"want": events.path.want, "low": events.path._low is not None}
        arrays |= list_states(events.path, _EVENTS)
        arrays |= {_EVENTS + name: getattr(events, name) for name in _MET}
    return pack_archive({"head": json.dumps(head), "scene": path.scene.to_toml()}, arrays)


def _encode_many(head: dict[str, Any], tops: Scene, t: Array, buffers: EnsembleBuffers) -> bytes:
    events = [np.concatenate(column) for column in zip(*buffers.events, strict=True)]
    given = {f"given_{name}": np.asarray(values) for name, values in tops.coords.items()}
    head |= {
        "shape": tops.shape,
        "scenes": [scene.to_toml() for scene in tops.ravel()],
        "names": tops._names,
        "given": {name: values.shape for name, values in given.items()},
        "in_degrees": tops._in_degrees,
        "times": t.shape,
        "last": [[i, *states.shape] for i, states in buffers.last.items()],
        "chosen": [[i, asdict(choice)] for i, choice in buffers.chosen.items()],
        "messages": list(buffers.messages.items()),
        "event_count": len(events[0]) if events else 0,
    }
    arrays: dict[str, Any] = {"t": t, **buffers.arrays, **given}
    arrays |= {f"column_{name}": column for name, column in buffers.columns.items()}
    arrays |= {f"last_{i}": states for i, states in buffers.last.items()}
    arrays |= {_EVENTS + name: x for name, x in zip(EventColumns._fields, events, strict=False)}
    # Doubles hold the integers of all arrays exactly.
    doubles = {name: np.asarray(array, np.float64) for name, array in arrays.items()}
    return pack_archive({"head": json.dumps(head)}, doubles)


def _read_many(archive: ArchiveReader, head: dict[str, Any]) -> SavedEnsemble:
    read = archive.read_archive_doubles
    scenes = [parse_scene_toml(text) for text in head["scenes"]]
    tops, options = Scene.stack(scenes).reshape(tuple(head["shape"])), Options.from_json(head)
    given = {name.removeprefix("given_"): read(name, *n) for name, n in head["given"].items()}
    if len(head["names"]) != tops.ndim:
        raise ValueError("its dimensions have no names")
    own = {"_names": tuple(head["names"]), "_in_degrees": bool(head["in_degrees"])}
    vars(tops).update(own, _varied=given)
    t = read("t", *head["times"])
    if t.ndim not in (1, 2) or (t.ndim == 2 and len(t) != tops.size):
        raise ValueError("its times have the wrong shape")
    buffers = EnsembleBuffers.allocate_buffers(tops.size, t.shape[-1], options)
    columns = {f"column_{name}": column for name, column in buffers.columns.items()}
    for name, array in (buffers.arrays | columns).items():
        array[...] = read(name, *array.shape)
    is_known = (buffers.status >= 0) & (buffers.status < len(calls.STATUSES))
    if not (is_known & (buffers.done >= 0) & (buffers.done <= t.shape[-1])).all():
        raise ValueError("the statuses of its tops are damaged")
    for i, *shape in head["last"]:
        if shape not in ([1, 8], [2, 8]):
            raise ValueError("its last states have the wrong shape")
        buffers.last[int(i)] = read(f"last_{i}", *shape)
    for i, choice in head["chosen"]:
        buffers.chosen[int(i)] = _read_step_choice(choice)
    buffers.messages = {int(i): str(text) for i, text in head["messages"]}
    k = as_int("event_count", head["event_count"], 0)
    if options.events is not None:
        top = read(f"{_EVENTS}top", k).astype(np.int64)
        which, direction = (read(_EVENTS + name, k).astype(np.intc) for name in _MET)
        if k and not (top.min() >= 0 and top.max() < tops.size and which.min() >= 0):
            raise ValueError("its events are damaged")
        states, low = (read(_EVENTS + name, k, 8) for name in ("states", "low"))
        buffers.events = [EventColumns(top, states, low, which, direction)]
    return tops, t, options, buffers


def read_archive(
    file: BinaryIO, size: int
) -> SavedEnsemble | tuple[PathArguments, tuple[PathArguments, Integers, Integers] | None]:
    """Read a path with its events (path, indices, directions), or the results of an ensemble."""
    archive = ArchiveReader(file, size)
    try:
        head = _require_json_object(json.loads(archive.read_archive_text("head")))
        if as_int("format", head["format"], 1) != _FORMAT:
            raise ValueError(f"its format {head['format']} belongs to a later version of kreisel")
        if "scenes" in head:
            return _read_many(archive, head)
        scene = parse_scene_toml(archive.read_archive_text("scene"))
        if not isinstance(head["stats"], list):
            raise TypeError("stats must be a list of numbers")
        step = None if head["step"] is None else as_float("step", head["step"])
        recorded = {"step": step and abs(step), "want": None, "events": None, "tangents": None}
        options = Options.from_json(head | recorded).with_heading(scene)
        choice, events = head["choice"], head["events"]
        words: PathArguments = {
            "scene": scene,
            "stats": calls.Stats(*(as_int("a number of the stats", n, 0) for n in head["stats"])),
            "_options": options if events is None else replace(options, events=()),
            "_is_back": step is not None and step < 0.0,
            "_choice": None if choice is None else _read_step_choice(choice),
            "_origin": calls.RunStart.from_json(head.get("start")),
        }
        path, n = _read_states(archive, "", words, head)
        if head.get("tangents") is not None:
            path["_tangent_data"] = _read_tangents(archive, n, head["tangents"])
        if events is None:
            return path, None
        rows, n = _read_states(archive, _EVENTS, words, _require_json_object(events))
    except (KeyError, RecursionError, TypeError) as error:
        raise ValueError(f"its header is damaged: {error}") from None
    which, direction = (archive.read_archive_integers(_EVENTS + name, n) for name in _MET)
    if not (np.abs(direction) == 1).all() or which.min(initial=0) < 0:
        raise ValueError("its events are damaged")
    return path, (rows, which, direction)


def _require_json_object(value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise TypeError(f"{short_repr(value)} is not a table")
    return value


def _read_step_choice(head: object) -> StepChoice:
    words = _require_json_object(head)
    for field in fields(StepChoice):
        value = words[field.name]
        if type(value).__name__ != field.type:
            raise TypeError(f"choice.{field.name} = {short_repr(value)} is not a {field.type}")
    return StepChoice(**words)


def _read_tangents(archive: ArchiveReader, n: int, head: object) -> TangentData:
    words = _require_json_object(head)
    names, rest = words["by"], as_float("rest", words["rest"])
    known = [name for name in TANGENTS if isinstance(names, list) and name in names]
    if not known or names != known:
        raise ValueError(f"its tangents have the invalid columns {short_repr(names)}")
    shape = n, 6, sum(TANGENTS[name][1] for name in names)
    high, low = (archive.read_archive_doubles(x, *shape) for x in ("tangents", "tangents_low"))
    return TangentData.from_flat_arrays(high, low, rest, tuple(names))


def _read_states(
    archive: ArchiveReader, prefix: str, words: PathArguments, head: dict[str, Any]
) -> tuple[PathArguments, int]:
    """Return the arguments of a path with its states or quantities, and their number."""
    want, is_low = head["want"], head["low"]
    if not isinstance(is_low, bool):
        raise TypeError(f"low must be true or false, not {short_repr(is_low)}")
    names: Any = ("q", "m", *(LOW if is_low else ()))
    if want is not None:
        names = choices.validate_requested_quantities(want) or ()
    read = archive.read_archive_doubles
    t = read(f"{prefix}t", None)
    columns = {name: read(prefix + name, len(t), *RECORDABLE[name].shape) for name in names}
    if want is not None:
        options = replace(words["_options"], want=names)
        more = {"states": calls.NO_STATES, "_options": options, "_columns": {"t": t} | columns}
        return words | more, len(t)
    q, m, *low = columns.values()
    words = words | {"states": np.column_stack([t, q, m])}
    return words | {"_low": np.column_stack([np.zeros(len(t)), *low]) if low else None}, len(t)
