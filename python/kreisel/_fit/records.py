"""Records: measurements of one instrument during one motion, and tables of them."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._options.options import ANGLES, QUANTITIES, QuantityDescription
from .._results.results import SPECIFIC_FORCE
from .._utils.arguments import (
    RADIANS_PER_DEGREE,
    Array,
    ReadOnlyArrays,
    as_array,
    as_bool,
    as_finite_array,
    as_three_floats,
    find_unit_of_angles,
    format_count,
    freeze_arrays,
    is_angular,
    short_repr,
    spell,
    split_column_head,
    unknown_name_message,
)

if TYPE_CHECKING:
    from pandas import DataFrame
    from scipy.spatial.transform import Rotation


# Constant, or NaN for most bodies.
_INTEGRALS = ("kowalewski", "goryachev_chaplygin")
_WHEELS = ("wheel_rate", "second_wheel_rate", "third_wheel_rate")  # fits know only their momentum
MEASURABLE: dict[str, QuantityDescription] = {
    quantity.name: quantity
    for quantity in (*QUANTITIES.values(), SPECIFIC_FORCE)
    if quantity.name not in (*_INTEGRALS, *_WHEELS)
}
# Vectors that an instrument on the body sees in its own frame.
SEEN_FROM_BODY = frozenset(
    name
    for name in MEASURABLE
    if name.startswith("body_") or name in ("inertial_velocity", SPECIFIC_FORCE.name)
)


InstrumentName = Literal["bias", "scale", "mounting", "delay"]
Sigma = ArrayLike | Mapping[str, ArrayLike] | None
Mask = NDArray[np.bool_]
Columns = Mapping[str, str | Sequence[str]]

INSTRUMENT: tuple[InstrumentName, ...] = ("bias", "scale", "mounting", "delay")
_UNIT_RTOL = 1e-3  # measured quaternions may differ from unit quaternions by rounding to 3 digits
_LARGEST = 1e100  # largest value, and inverse of the smallest
_MANY_TURNS = 4.0 * np.pi  # a larger measured angle is probably in degrees [rad]
SCALAR_LAST = {"attitude_xyzw": "attitude", "q_xyzw": "q"}  # and the names of scalar first
ATTITUDE_NAMES = ("attitude", "q", *SCALAR_LAST)
_KNOWN = QUANTITIES | MEASURABLE
_PARTS = {c: (name, k) for name, q in _KNOWN.items() for k, c in enumerate(q.components)}


Table = dict[str, Array]  # the columns by their heads


def read_csv_table(file: str | os.PathLike[str], columns: object, t: object) -> Table:
    """Read the columns of a CSV file; empty fields are NaN.

    Columns that are neither `t` nor in `columns` may contain words, and are NaN; if `columns` is
    None, all are needed.
    """
    name = os.fspath(file)
    with open(name, encoding="utf-8-sig", newline="") as text:
        try:
            head = next((line for line in text if line.strip()), "")
            delimiter = max(",;\t", key=head.count)
            lines = chain([head], text)  # a pipe cannot be read again from its beginning
            rows = [row for row in csv.reader(lines, delimiter=delimiter) if "".join(row).strip()]
        except (UnicodeDecodeError, csv.Error) as error:
            raise ValueError(f"{name} is not a CSV file in UTF-8: {error}") from None
    if len(rows) < 2:
        raise ValueError(f"{name}: it needs a line of names and at least one line of numbers")
    names = [word.strip() for word in rows[0]]
    if len(set(names)) < len(names):
        raise ValueError(f"{name}: two columns have the same name: {', '.join(names)}")
    needed: set[object] = set(names)
    if isinstance(columns, Mapping):
        needed = {t, *chain(*([x] if isinstance(x, str) else x for x in columns.values()))}
    numbers = np.full((len(rows) - 1, len(names)), np.nan)
    for i, row in enumerate(rows[1:]):
        if len(row) != len(names):
            raise ValueError(f"{name}: row {i + 1} has {len(row)} fields instead of {len(names)}")
        for k, (head, word) in enumerate(zip(names, row, strict=True)):
            if word.strip() and not needed.isdisjoint((head, split_column_head(head)[0])):
                try:
                    numbers[i, k] = float(word)
                except ValueError:
                    hint = "; write decimal points, not commas" if "," in word else ""
                    raise ValueError(
                        f"{name}: row {i + 1} has {short_repr(word)}, which is not a number{hint}"
                    ) from None
    return dict(zip(names, numbers.T, strict=True))


def _find_column(name: object, table: Table, kind: str = "column") -> str:
    """Return the head of the column that has this head, or this name before its unit."""
    if not isinstance(name, str):
        raise TypeError(f"a {kind} must have a name, not {short_repr(name)}")
    heads = [name] if name in table else [h for h in table if split_column_head(h)[0] == name]
    if not heads:
        raise ValueError(unknown_name_message(kind, name, table))
    if len(heads) > 1:
        raise ValueError(f"several columns are called {name}: {', '.join(heads)}")
    return heads[0]


def _join_vector_components(table: Table) -> Table:
    for name in table:
        if name not in _PARTS:
            hint = unknown_name_message("quantity in the name of a column:", name, _PARTS)
            raise ValueError(f"{hint}; or give {spell('columns')}")
    values: Table = {}
    for name, column in table.items():
        quantity = _PARTS[name][0]
        names = _KNOWN[quantity].components
        if len(names) == 1 or not all(n in table for n in names) or len(names) == 9:
            values[name] = column
        elif quantity not in values:
            values[quantity] = np.stack([table[n] for n in names], axis=-1)
    return values


class Series(NamedTuple):
    """The measurements of one quantity by one instrument.

    name      the name of the quantity or of a component
    quantity  the name of the quantity
    part      the index of the component, or None for the whole quantity
    values    (n, k), zero where nothing was measured; angles in radians
    measured  (n, k), True where something was measured
    sigma     (n, k) standard deviations, or None if they are unknown
    unit      factor from the user's unit to the unit of `values`
    """

    name: str
    quantity: str
    part: int | None
    values: Array
    measured: Mask
    sigma: Array | None
    unit: float

    @property
    def is_angle(self) -> bool:
        return self.quantity in ANGLES

    @property
    def is_attitude(self) -> bool:
        return self.quantity == "q"

    @property
    def residuals_per_row(self) -> int:
        """The number of residuals at each time; an attitude contributes three."""
        return 3 if self.is_attitude else self.values.shape[1]

    @property
    def typical_value_scale(self) -> float:
        """The standard deviation of the values; for angles and attitudes, 1 rad is used instead."""
        if self.is_attitude or self.is_angle:
            return 1.0
        number = np.maximum(self.measured.sum(axis=0), 1)
        mean = self.values.sum(axis=0) / number
        square = np.where(self.measured, (self.values - mean) ** 2, 0.0).sum(axis=0) / number
        return float(np.sqrt(square.mean())) or float(np.abs(self.values).max()) or 1.0

    @property
    def size(self) -> float:
        """The root mean square of the measured values; for angles and attitudes, always 1 rad."""
        if self.is_attitude or self.is_angle:
            return 1.0
        square = float((self.values**2).sum()) / max(int(self.measured.sum()), 1)
        return math.sqrt(square) or 1.0


@dataclass(frozen=True, eq=False, init=False)
class Record(ReadOnlyArrays):
    """The measurements of one instrument during one motion.

    t        (n,) times since the start of the motion, which do not decrease [T]
    values   {quantity: (n, ...)}: names of quantities or of their components, as "apex_x", and
             their values. NaN where nothing was measured. An attitude is named "attitude" or "q",
             as quaternions (w, x, y, z) or a SciPy Rotation, or "attitude_xyzw" or "q_xyzw", scalar
             last; -q equals q
    sigma    standard deviation of the errors: a number, or an array that broadcasts to the values,
             or {quantity: number or array}. The standard deviation of an attitude is an angle
             [rad].
             None: it is estimated from the residuals of the fit, for each quantity
    free     properties of the instrument that the fit estimates: "bias" and "scale" of each
             component, "mounting", the rotation from the instrument to the frame of the body, and
             "delay", the time by which the clock of the instrument is ahead [T]
    degrees  True: angles, angular velocities and angular accelerations are in degrees, and their
             sigma too
    point    place (x, y, z) of an accelerometer, which measures specific_force, from the fixed
             point in the frame of the body [L]

    A record may contain `specific_force`, `inertial_velocity`, and any quantity of a path except
    the integrals kowalewski and goryachev_chaplygin. The specific force is the acceleration of
    `point` minus the acceleration of gravity, in the body frame [L T^-2]. At rest, the specific
    force points up and has the magnitude of gravity. A gyroscope measures body_velocity or, on a
    turning support, inertial_velocity.

    The measured values are modelled as scale * quantity(t - delay) + bias + errors. The errors are
    independent and normally distributed.

        >>> import kreisel as kr
        >>> record = kr.Record([0.0, 0.1], {"apex_x": [0.0, 0.2], "apex_y": [0.1, 0.3]}, sigma=0.01)
        >>> record
        <kreisel.Record: 2 times, t = 0 .. 0.1; apex_x, apex_y; 4 numbers>

    Raises TypeError if an argument is not numeric. Raises ValueError for unknown names, decreasing
    times, values of the wrong shape, infinite values, and a record without measurements. Also
    raises ValueError for a nonpositive sigma, and for quaternions whose norm differs from 1 by more
    than 0.001.
    """

    t: Array
    free: tuple[InstrumentName, ...]
    series: tuple[Series, ...]
    point: Array | None

    def __init__(
        self,
        t: ArrayLike,
        values: Mapping[str, ArrayLike | Rotation],
        sigma: Sigma = None,
        free: InstrumentName | Iterable[InstrumentName] = (),
        *,
        degrees: bool = False,
        point: ArrayLike | None = None,
    ) -> None:
        times = as_finite_array("t", t, "a list of times")
        if times.ndim != 1 or not times.size:
            raise ValueError(f"t must be a list of times, not an array of shape {times.shape}")
        decreases = np.flatnonzero(np.diff(times) < 0.0)
        if decreases.size:
            i = int(decreases[0])
            raise ValueError(
                f"t must not decrease, but t[{i + 1}] = {times[i + 1]} follows t[{i}] = {times[i]}:"
                " sort the rows by their times, or split the record where its clock was reset"
            )
        if not isinstance(values, Mapping):
            raise TypeError(
                "values must map names of quantities to arrays, as in "
                f"{{'body_velocity': w}}, not {short_repr(values)}"
            )
        if not values:
            raise ValueError("values is empty: give at least one quantity")
        in_degrees, label = as_bool("degrees", degrees), spell("sigma")
        for name in sigma if isinstance(sigma, Mapping) else ():
            if name not in values:
                raise ValueError(unknown_name_message(f"name in {label}:", str(name), values))
        series = tuple(
            _validate_measurement_series(name, values, sigma, times, in_degrees) for name in values
        )
        if not any(one.measured.any() for one in series):
            raise ValueError("values has no measurement: all numbers are NaN")
        attitudes = [one.name for one in series if one.is_attitude]
        if len(attitudes) > 1:
            raise ValueError(f"values has the attitude twice, as {' and '.join(attitudes)}")
        has_force = any(one.quantity == SPECIFIC_FORCE.name for one in series)
        if has_force and point is None:
            raise ValueError(
                f"specific_force needs {spell('point')}, the place of the accelerometer from the "
                "fixed point, in the frame of the body"
            )
        if point is not None and not has_force:
            raise ValueError(
                f"{spell('point')} needs values of specific_force, which an accelerometer measures"
            )
        place = None if point is None else np.array(as_three_floats("point", point))
        names = _validate_free_instrument_parameters(free, series)
        self.__dict__.update(t=times, free=names, series=series, point=place)
        freeze_arrays((times, series, place))

    @property
    def size(self) -> int:
        """The number of measured values, where each attitude counts as three."""
        masks = (one.measured[:, : one.residuals_per_row] for one in self.series)
        return sum(int(mask.sum()) for mask in masks)

    @property
    def missing(self) -> int:
        """The number of missing values (NaN), where each missing attitude counts as three."""
        return sum(len(self.t) * one.residuals_per_row for one in self.series) - self.size

    def __repr__(self) -> str:
        names = ", ".join(one.name for one in self.series)
        omission = f", {self.missing} left out" if self.missing else ""
        free_names = f"; free {', '.join(self.free)}" if self.free else ""
        span = f"{format_count(len(self.t), 'time')}, t = {self.t[0]:g} .. {self.t[-1]:g}"
        numbers = format_count(self.size, "number")
        return f"<kreisel.Record: {span}; {names}; {numbers}{omission}{free_names}>"

    @classmethod
    def from_csv(
        cls,
        file: str | os.PathLike[str],
        columns: Columns | None = None,
        t: str = "t",
        sigma: Sigma = None,
        free: InstrumentName | Iterable[InstrumentName] = (),
        *,
        degrees: bool | None = None,
        point: ArrayLike | None = None,
    ) -> Record:
        """Read a record from a CSV file whose first line contains the column names.

        columns  {quantity: names of its columns}, as in {"body_velocity": ("wx", "wy", "wz")}. The
                 default is all columns except t, which then have names such as body_velocity_x
        t        the name of the column of times
        degrees  as in kreisel.Record. By default, the units in the heads of the columns decide, as
                 in "spin [deg/s]", and radians are assumed without units

        The names of columns may omit the units in their heads. Files of path.to_csv and of `kreisel
        solve --csv` have such heads. Fields may be separated by commas, semicolons or tabs. Empty
        fields and NaN mark values that were not measured. The remaining arguments are described in
        kreisel.Record. Raises ValueError for missing or unknown columns, for fields that are not
        numbers, and for units that contradict `degrees` or a quantity. Raises OSError if the file
        cannot be read.
        """
        table = read_csv_table(file, columns, t)
        words = {"sigma": sigma, "free": free, "point": point}
        return cls._from_table(table, {}, columns, t, degrees, **words)

    @classmethod
    def from_pandas(
        cls,
        frame: DataFrame,
        columns: Columns | None = None,
        t: str = "t",
        sigma: Sigma = None,
        free: InstrumentName | Iterable[InstrumentName] = (),
        *,
        degrees: bool | None = None,
        point: ArrayLike | None = None,
    ) -> Record:
        """Return a record built from the columns of a pandas.DataFrame.

        The arguments have the same meaning as in kreisel.Record.from_csv. Without a column `t`, the
        times are taken from an index named `t`. The units may also be in frame.attrs["units"], as
        in the result of path.to_pandas. Raises TypeError if the first argument is not a DataFrame.
        """
        if not hasattr(frame, "columns") or not hasattr(frame, "index"):
            raise TypeError(f"frame must be a pandas.DataFrame, not {short_repr(frame)}")
        table = {str(name): np.asarray(frame[name]) for name in frame.columns}
        head = str(frame.index.name)
        if t not in table and t in (head, split_column_head(head)[0]):
            table[head] = np.asarray(frame.index)
        words = {"sigma": sigma, "free": free, "point": point}
        return cls._from_table(table, frame.attrs.get("units", {}), columns, t, degrees, **words)

    @classmethod
    def _from_table(
        cls,
        table: Table,
        units: Mapping[str, str],
        columns: Columns | None,
        t: str,
        degrees: bool | None,
        **words: Any,
    ) -> Record:
        """Return the record in a table; `units` takes precedence over the units in its heads."""
        time, values = _find_column(t, table, "column of times"), {}
        if columns is None:
            names = [split_column_head(head)[0] for head in table if head != time]
            selection = [(_find_column(name, table), name) for name in names]
            values = _join_vector_components({name: table[head] for head, name in selection})
        elif not isinstance(columns, Mapping):
            raise TypeError(
                "columns must map quantities to names of columns, as in "
                f"{{'spin': 'rpm'}}, not {short_repr(columns)}"
            )
        else:
            selection = []
            for quantity, given in columns.items():
                heads = [
                    _find_column(x, table) for x in ([given] if isinstance(given, str) else given)
                ]
                parts = [as_array(head, table[head], "numbers") for head in heads]
                values[quantity] = parts[0] if isinstance(given, str) else np.stack(parts, axis=-1)
                selection += [(head, quantity) for head in heads]
        stated = []
        for head, name in selection:
            known = _KNOWN.get(name if name in _KNOWN else _PARTS.get(name, ("", 0))[0])
            unit = units.get(head, split_column_head(head)[1])
            stated.append((head, unit, known.dimension if known else ""))
        in_degrees = find_unit_of_angles(stated, degrees)
        return cls(table[time], values, degrees=in_degrees, **words)

    def _replace(self, t: Array, series: Iterable[Series]) -> Record:
        """Return a record of the same instrument with other times and series."""
        record = object.__new__(Record)
        record.__dict__.update(t=t, series=tuple(series), free=self.free, point=self.point)
        return record


def _resolve_quantity_and_component(name: object) -> tuple[str, int | None]:
    if not isinstance(name, str):
        raise TypeError(f"the names in values must be strings, not {short_repr(name)}")
    if name in ATTITUDE_NAMES:
        return "q", None
    quantity, part = (name, None) if name in _KNOWN else _PARTS.get(name, (name, None))
    if quantity not in _KNOWN:
        parts = [part for part, (known, _) in _PARTS.items() if known in MEASURABLE]
        raise ValueError(
            unknown_name_message(
                "quantity", name, dict.fromkeys([*MEASURABLE, *ATTITUDE_NAMES, *parts])
            )
        )
    if quantity not in MEASURABLE:
        raise ValueError(f"{name} cannot be fitted: it is constant, or NaN for most bodies")
    if quantity == "q" and part is not None:
        raise ValueError(f"{name} cannot be fitted alone: give all four components as attitude")
    return quantity, part


def _validate_measurement_series(
    name: str, values: Mapping[str, ArrayLike | Rotation], sigma: Sigma, t: Array, degrees: bool
) -> Series:
    quantity, part = _resolve_quantity_and_component(name)
    shape = MEASURABLE[quantity].shape if part is None else ()
    given = values[name]
    is_scalar_last = name in SCALAR_LAST
    if quantity == "q" and hasattr(given, "as_quat"):
        given, is_scalar_last = given.as_quat(), True
    array = as_array(name, given, "numbers")
    if array.shape != (len(t), *shape):
        raise ValueError(
            f"{name} must have the shape {(len(t), *shape)}, one row for each time, "
            f"not {array.shape}"
        )
    numbers = array.reshape(len(t), -1)
    if np.isinf(numbers).any():
        raise ValueError(f"{name} must be finite, or NaN where nothing was measured")
    largest = float(np.nanmax(np.abs(numbers), initial=0.0))
    if largest > _LARGEST or 0.0 < largest < 1.0 / _LARGEST:
        raise ValueError(
            f"{name} is up to {largest:g}: choose units in which its squares are in the range of "
            "doubles"
        )
    is_measured: Mask = np.logical_not(np.isnan(numbers))
    if quantity == "q":
        if is_scalar_last:
            numbers, is_measured = np.roll(numbers, 1, axis=1), np.roll(is_measured, 1, axis=1)
        is_complete: Mask = np.asarray(is_measured.all(axis=1))
        norm = np.sqrt((np.where(is_complete[:, None], numbers, 0.5) ** 2).sum(axis=1))
        bad = np.flatnonzero(np.abs(norm - 1.0) > _UNIT_RTOL)
        if bad.size:
            raise ValueError(
                f"{name} must be unit quaternions; the norm of {name}[{bad[0]}] is {norm[bad[0]]:g}"
            )
        numbers, is_measured = numbers / norm[:, None], np.repeat(is_complete[:, None], 4, axis=1)
    is_rescaled = degrees and is_angular(MEASURABLE[quantity].dimension)
    numbers = np.where(is_measured, numbers, 0.0) * (RADIANS_PER_DEGREE if is_rescaled else 1.0)
    if quantity in ANGLES and not degrees and np.abs(numbers).max(initial=0.0) > _MANY_TURNS:
        largest = float(np.abs(numbers).max())
        raise ValueError(
            f"{name} is up to {largest:g}, which is more than two turns: angles are in radians, or "
            f"in degrees with {spell('degrees')}"
        )
    unit = RADIANS_PER_DEGREE if is_rescaled or (degrees and quantity == "q") else 1.0
    width = 3 if quantity == "q" else numbers.shape[1]
    deviation = _validate_series_sigma(name, sigma, is_measured[:, :width], unit)
    return Series(name, quantity, part, numbers, is_measured, deviation, unit)


def _validate_series_sigma(name: str, sigma: Sigma, is_measured: Mask, unit: float) -> Array | None:
    """Return validated standard deviations, or None if they must be estimated."""
    shape = is_measured.shape
    value = sigma.get(name) if isinstance(sigma, Mapping) else sigma
    if value is None:
        return None
    label = f"{spell('sigma')} of {name}"
    numbers = as_array(label, value, "a number or an array of the shape of the values")
    if numbers.ndim == 1 and numbers.shape == (shape[0],) and shape[0] != shape[1]:
        numbers = numbers[:, None]
    try:
        numbers = np.broadcast_to(numbers, shape)
    except ValueError:
        raise ValueError(
            f"{label} must be a number or broadcast to {shape}, not {short_repr(value)}"
        ) from None
    numbers = np.where(is_measured, numbers, 1.0)
    if not (np.isfinite(numbers) & (numbers > 0.0)).all():
        raise ValueError(f"{label} must be positive and finite; leave it out if it is unknown")
    return numbers * unit


def _validate_free_instrument_parameters(
    free: InstrumentName | Iterable[InstrumentName], series: tuple[Series, ...]
) -> tuple[InstrumentName, ...]:
    items, label = [free] if isinstance(free, str) else free, spell("free")
    if not isinstance(items, Iterable):
        raise TypeError(f"{label} must be names such as 'bias', not {short_repr(free)}")
    names = list(items)
    for name in names:
        if name not in INSTRUMENT:
            raise ValueError(unknown_name_message(f"name in {label}:", str(name), INSTRUMENT))
    if "mounting" in names and not any(
        one.is_attitude or (one.quantity in SEEN_FROM_BODY and one.part is None) for one in series
    ):
        raise ValueError("mounting needs attitudes or a whole vector seen from the body")
    if {"bias", "scale"} & set(names) and all(one.is_attitude for one in series):
        raise ValueError("attitudes have no bias and no scale: use 'mounting'")
    return tuple(name for name in INSTRUMENT if name in names)


def slice_record(record: Record, begin: int, end: int, origin: float = 0.0) -> Record:
    """Return rows `begin` to `end` - 1 of a record, with times measured from `origin`."""
    rows, series = slice(begin, end), []
    for one in record.series:
        sigma = None if one.sigma is None else one.sigma[rows]
        values, measured = one.values[rows], one.measured[rows]
        series.append(one._replace(values=values, measured=measured, sigma=sigma))
    return record._replace(record.t[rows] - origin, series)
