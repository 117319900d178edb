"""Sources of tops for sweeps: grids, random starts and tables of starts."""

from __future__ import annotations

import math
import os
import re
import zlib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Unpack, overload

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from .._model.body import Body
from .._model.ensemble import VaryKwargs
from .._model.parameters import PARAMETERS as TABLE
from .._model.parameters import BatchParameter, Shape, collapse_broadcast_axes
from .._model.scene import Ensemble, Scene
from .._model.vary import scatter, vary
from .._options.options import format_index, unravel_index
from .._utils.arguments import (
    Array,
    as_bool,
    as_finite_array,
    as_int,
    find_unit_of_angles,
    get_parameter_unit,
    make_frozen_class_decorator,
    optional_dependency,
    short_repr,
    split_column_head,
    unknown_name_message,
    validate_type,
)

_NAMES = (
    "mass gravity friction spin tilt precession com rotor turning momentum velocity body_momentum "
    "body_velocity inertia angles rates damping shaking attitude attitude_xyzw"
)
# {parameter: the endings of the names of its components}
_ENDINGS = {name: TABLE[name].endings for name in _NAMES.split()}
FLAGS = "steady", "fast", "degrees"
PARAMETERS = tuple(_ENDINGS)


def validate_sweep_parameter(name: str, numbers: object) -> BatchParameter:
    if name not in _ENDINGS:
        raise ValueError(unknown_name_message("parameter", name, [*PARAMETERS, *FLAGS]))
    n = len(_ENDINGS[name])
    description = f"{n} numbers, or rows of {n} numbers" if n else "a number, or a list of numbers"
    values = as_finite_array(name, numbers, description)
    shape = values.shape
    if name == "inertia" and shape[-2:] == (3, 3):
        return BatchParameter(name, values, (3, 3))
    if name == "damping" and not shape:
        return BatchParameter(name, values.repeat(3), (3,))
    if name == "damping" and shape[-1:] == (1,):
        return BatchParameter(name, values, (1,))
    value_shape = (n,) if n else ()
    if value_shape and shape[-1:] != value_shape:
        raise ValueError(f"{name} must be {description}, not of the shape {shape}")
    return BatchParameter(name, values, value_shape)


def list_parameter_component_names(name: str, value: Shape) -> list[str]:
    """Return names such as momentum_x; `value` is the shape of the value for a single top."""
    if not value:
        return [name]
    n, endings = math.prod(value), _ENDINGS.get(name, "")
    return [f"{name}_{endings[i] if len(endings) == n else i}" for i in range(n)]


PARQUET = "'kreisel[sweep]'"
_VALUES = (3, 3), (4,), (3,), (1,), ()  # possible shapes of a value, the largest first


def read_parameters_of_tops(file: str, degrees: bool | None) -> tuple[dict[str, Array], bool]:
    """Read parameters from a table, and return each as an array with one row per top.

    The second item returned is True if angles and rates are in degrees: the heads of the columns
    decide, or else `degrees`. Raises ValueError for an unknown column name or a wrong unit, and
    ImportError if pyarrow is not installed.
    """
    columns = _read_start_table_columns(file)
    parameters, units, remainder = {}, [], dict(columns)
    for parameter in PARAMETERS:
        for value in _VALUES:
            names = list_parameter_component_names(parameter, value)
            if remainder.keys() >= set(names):
                parts = [remainder.pop(name)[1] for name in names]
                parameters[parameter] = np.stack(parts, axis=-1).reshape(-1, *value)
                for i, name in enumerate(names):
                    head = columns[name][0]
                    unit = get_parameter_unit(parameter, False, i)
                    units.append((head, split_column_head(head)[1], unit))
    for name in remainder:
        raise ValueError(f"{file}: {_describe_unused_column(name, columns)}")
    in_degrees = find_unit_of_angles(units, degrees)
    return {name: np.asarray(values) for name, values in parameters.items()}, in_degrees


def _read_start_table_columns(file: str) -> dict[str, tuple[str, npt.NDArray[np.generic]]]:
    """Return the head and the values of each column of numbers by its name."""
    ending = Path(file).suffix.lower()
    if ending not in (".parquet", ".csv"):
        raise ValueError(f"{file}: a table of starts ends in .parquet or .csv")
    with optional_dependency(PARQUET):
        import pyarrow as pa
        import pyarrow.csv as text
        import pyarrow.parquet as parquet
    try:
        with pa.OSFile(os.fsencode(file)) as stream:  # pyarrow refuses a str that is not UTF-8
            table = parquet.read_table(stream) if ending == ".parquet" else text.read_csv(stream)
    except pa.ArrowInvalid as error:
        raise ValueError(f"{file} cannot be read: {error}") from None
    columns: dict[str, tuple[str, npt.NDArray[np.generic]]] = {}
    for head, column in zip(table.column_names, table.columns, strict=True):
        name, _ = split_column_head(head)
        if name in columns:
            raise ValueError(f"{file}: it has several columns {name!r}")
        if column.null_count:
            raise ValueError(f"{file}: its column {head!r} has missing values")
        columns[name] = head, column.to_numpy()
        if columns[name][1].dtype.kind not in "fiub":
            raise ValueError(f"{file}: its column {head!r} must be numbers, not {column.type}")
    return columns


def _describe_unused_column(name: str, columns: Collection[str]) -> str:
    """Return the reason why a column is not a parameter, nor a component of a whole parameter."""
    absent = []
    for parameter, endings in _ENDINGS.items():
        for value in ((3, 3), (3,)) if parameter == "inertia" else ((len(endings),),):
            names = list_parameter_component_names(parameter, value) if endings else []
            if name in names:
                absent.append((parameter, [one for one in names if one not in columns]))
    if not absent:
        return unknown_name_message("column", name, PARAMETERS)
    parameter, names = min(absent, key=lambda group: len(group[1]))
    missing = "columns are" if len(names) > 1 else "column is"
    return (
        f"the column {name!r} is a component of {parameter}, whose other {missing} missing: "
        f"{', '.join(names)}"
    )


_DRAWS = 4  # random numbers drawn per top and parameter; no random parameter has more components
_BODY = "mass", "inertia", "com", "inertia_rtol", "rotor", "unphysical"
_FIRST_TOP = re.compile(r"(\w+)\[0\](: | = )")  # beginning of an error message about the first top
_SAMPLE_SIZE = 1 << 10  # approximate number of tops on which a plan is validated
_SCATTERED = "momentum", "attitude", "gravity"
_WITHOUT_RANGE = "attitude", "attitude_xyzw", "inertia"
Places = npt.NDArray[np.int64]
Parameters = Mapping[str, BatchParameter]


class RandomSpec(NamedTuple):
    """The seed of random parameters, and their ranges or standard deviations."""

    seed: int
    ranges: Parameters
    widths: Mapping[str, Any]


@make_frozen_class_decorator("construct a new kreisel.Source")
@dataclass(frozen=True, eq=False)
class Source:
    """A lazy description of many tops, from which kreisel.sweep constructs the tops of each part.

    A Source object stores only parameters, and constructs each top when it is needed. The
    constructors are Source.grid, Source.random, Source.scatter, Source.columns and Source.of.

    scene  the scene whose parameters vary
    shape  the shape of the array of all tops, which are numbered in C order
    axes   the names of its dimensions

    `len(source)` is the number of tops, and `source[i]` is a single top as a kreisel.Scene. A slice
    `source[a:b]` is a one-dimensional kreisel.Ensemble.

        >>> import kreisel as kr, numpy as np
        >>> spin, tilt = np.linspace(0, 20, 10000), np.linspace(0, 1, 10000)
        >>> source = kr.Source.grid(kr.scenes.sleeping, spin=spin, tilt=tilt)
        >>> source.shape, source[12345678:12345680].coords["spin"].round(6).tolist()
        ((10000, 10000), [2.468247, 2.468247])
    """

    scene: Scene
    shape: Shape
    axes: tuple[str, ...]
    _parameters: Parameters = field(default_factory=dict)  # parameters from which tops are built
    _varied: Parameters = field(default_factory=dict)  # parameters that vary, as the user gave them
    _flags: Mapping[str, bool] = field(default_factory=dict)
    _random: RandomSpec | None = None

    @classmethod
    def grid(cls, scene: Scene, **arguments: Unpack[VaryKwargs]) -> Source:
        """Return a sweep source that contains one top for each combination of parameter values.

        Each list of parameter values becomes a dimension of the array of tops, in the order of the
        arguments. Parameters with a single value are the same for all tops. All parameters of
        Scene.vary except `body` are allowed. Raises ValueError for an unknown parameter, and
        TypeError or ValueError for invalid values. Combinations of parameters are checked only when
        tops are constructed.

        >>> import kreisel as kr
        >>> kr.Source.grid(kr.scenes.sleeping, gravity=[1, 2, 3], spin=[4, 5]).shape
        (3, 2)
        """
        parameters, flags = _validate_parameters_and_flags(scene, arguments)
        shapes = {name: one.shape for name, one in parameters.items()}
        axes = tuple(filter(shapes.__getitem__, shapes))
        if not axes:
            raise ValueError("a grid needs values of at least one parameter, as in spin=[0, 1, 2]")
        for name in axes:
            if len(shapes[name]) != 1 or 0 in shapes[name]:
                raise ValueError(
                    f"{name} must be one value or a list of values, not of shape {shapes[name]}"
                )
        shape = sum(map(shapes.__getitem__, axes), ())
        if math.prod(shape) >= 2**53:
            raise ValueError(f"a grid of shape {shape} has more tops than can be counted")
        columns = {
            name: _reshape_parameter_along_axis(one, axes) for name, one in parameters.items()
        }
        varied = {name: columns[name] for name in axes}
        return cls(scene, shape, axes, columns, varied, flags)

    @classmethod
    def random(
        cls, scene: Scene, n: int, *, seed: int = 0, **arguments: Unpack[VaryKwargs]
    ) -> Source:
        """Return a source of `n` tops with random parameters.

        A parameter given as two values, such as spin=(0, 20), is uniformly distributed between
        them. For a vector parameter, the two bounds are the rows of an array. Parameters with a
        single value are the same for all tops. Each random value depends only on the seed, the
        index of the top and the parameter. All parameters of Scene.vary except `body` are allowed,
        but inertia and attitudes cannot be random and must be the same for all tops. The exceptions
        are the same as for Source.grid, with ValueError for an invalid range.

        >>> import kreisel as kr
        >>> tops = kr.Source.random(kr.scenes.sleeping, 10**9, seed=7, spin=(0, 20), tilt=(0, 1))
        >>> tops[123456789:123456791].coords["spin"].round(3).tolist()
        [15.105, 16.434]
        """
        count, key = as_int("n", n, 1), as_int("seed", seed, 0)
        parameters, flags = _validate_parameters_and_flags(scene, arguments)
        ranges = {name: one for name, one in parameters.items() if one.shape}
        if not ranges:
            raise ValueError(
                "random tops need the range of at least one parameter, as in spin=(0, 20)"
            )
        for name, one in ranges.items():
            shown = short_repr(one.values.tolist())
            if name in _WITHOUT_RANGE:
                raise ValueError(
                    f"{name} has no range: give one value, or make kreisel.Source.columns"
                )
            if one.shape != (2,) or (one.values[0] > one.values[1]).any():
                raise ValueError(f"{name} must be one value or a range (low, high), not {shown}")
            with np.errstate(over="ignore"):
                is_finite = np.isfinite(one.values[1] - one.values[0]).all()
            if not is_finite:
                raise ValueError(f"{name} must lie in a range of finite width, not {shown}")
        constants = {
            n: _reshape_parameter_along_axis(one, ("top",))
            for n, one in parameters.items()
            if n not in ranges
        }
        return cls(scene, (count,), ("top",), constants, {}, flags, RandomSpec(key, ranges, {}))

    @classmethod
    def scatter(
        cls,
        scene: Scene,
        n: int,
        *,
        seed: int = 0,
        momentum: ArrayLike | None = None,
        attitude: ArrayLike | None = None,
        gravity: float | None = None,
    ) -> Source:
        """Return a source of `n` tops whose initial states are scattered as in Scene.scatter.

        The arguments and exceptions are the same as for Scene.scatter.

        >>> import kreisel as kr
        >>> source = kr.Source.scatter(kr.scenes.thesis, 10**9, seed=7, attitude=0.01)
        >>> source[3] == kr.scenes.thesis.scatter(10, seed=7, attitude=0.01)[3]
        True
        """
        validate_type("scene", scene, Scene)
        count, key = as_int("n", n, 1), as_int("seed", seed, 0)
        scatter(scene, 1, key, momentum, attitude, gravity)
        deviations = {"momentum": momentum, "attitude": attitude, "gravity": gravity}
        widths = {name: np.asarray(w).tolist() for name, w in deviations.items() if w is not None}
        return cls(scene, (count,), ("top",), _random=RandomSpec(key, {}, widths))

    @classmethod
    def columns(
        cls,
        scene: Scene,
        file: str | os.PathLike[str],
        *,
        degrees: bool | None = None,
        steady: bool = False,
        fast: bool = False,
    ) -> Source:
        """Return a source that takes its tops from the rows of a table.

        Each column contains a parameter of Scene.vary, such as gravity, or one of its components,
        such as momentum_x or angles_0. A parameter must have all its components.

        file     the name of a .parquet or .csv file
        degrees  as in Scene.vary. By default, the units in the heads of the columns decide, as in
                 "spin [deg/T]", and radians are assumed without units

        steady and fast are as in Scene.vary, and apply to all tops. Raises TypeError or ValueError
        if a column is neither a parameter nor a component, or has invalid values or a wrong unit.
        Raises OSError if the file cannot be read, and ImportError if pyarrow is not installed.
        """
        arguments, in_degrees = read_parameters_of_tops(os.fspath(file), degrees)
        parameters, flags = _validate_parameters_and_flags(
            scene, {**arguments, "degrees": in_degrees, "steady": steady, "fast": fast}
        )
        lengths = {name: one.shape for name, one in parameters.items()}
        is_row = all(len(lead) == 1 and lead[0] > 0 for lead in lengths.values())
        if len(set(lengths.values())) != 1 or not is_row:
            raise ValueError(
                f"{os.fspath(file)}: its columns must be rows of one length, not {lengths}"
            )
        shape = next(iter(lengths.values()))
        return cls(scene, shape, ("top",), parameters, parameters, flags)

    @classmethod
    def of(cls, scene: Ensemble) -> Source:
        """Return a source of tops for a sweep, created from an ensemble."""
        validate_type("scene", scene, Ensemble)
        if not scene.size:
            raise ValueError("an empty ensemble cannot be swept")
        columns: dict[str, npt.NDArray[Any]] = dict(scene._columns)
        if scene.body.shape:
            columns |= {name: scene.body._columns[name] for name in _BODY}
        first = scene._select_member((0,) * scene.ndim)
        arguments = _collapse_broadcast_columns(columns, scene.ndim)
        varied = _collapse_broadcast_columns(scene._varied, scene.ndim, scene._in_degrees)
        return cls(first, scene.shape, scene.axes, arguments, varied)

    @cached_property
    def size(self) -> int:
        """The number of tops."""
        return math.prod(self.shape)

    def __len__(self) -> int:
        return self.size

    @overload
    def __getitem__(self, key: slice) -> Ensemble: ...
    @overload
    def __getitem__(self, key: int) -> Scene: ...
    def __getitem__(self, key: int | slice) -> Ensemble | Scene:
        """Return a single top as a scene, or several tops as an ensemble."""
        if isinstance(key, slice):
            begin, end, step = key.indices(self.size)
            if step != 1:
                raise ValueError(
                    f"tops are selected by consecutive indices, not by {short_repr(key)}"
                )
            return self._build_tops(np.arange(begin, max(begin, end), dtype=np.int64))
        i = as_int("the index of a top", key, -(2**63) + 1)
        if not -self.size <= i < self.size:
            raise IndexError(f"index {i} is out of range for {self.size} tops")
        scene: Scene = self._build_tops(np.array([i % self.size]))[0]
        return scene

    def __repr__(self) -> str:
        random = self._random or RandomSpec(0, {}, {})
        varied = [*self._varied, *random.ranges, *random.widths]
        return f"<kreisel.Source of shape {self.shape}: {', '.join(varied) or 'all equal'}>"

    def _choose_validation_tops(self) -> Places:
        """Return the first tops of random ones, or evenly spaced ones with the first and last."""
        if self._random is not None:
            return np.arange(min(self.size, _SAMPLE_SIZE), dtype=np.int64)
        step = max(1, self.size // _SAMPLE_SIZE)
        places = np.arange(0, self.size, step, dtype=np.int64)
        return np.unique(np.append(places, self.size - 1))

    def _find_error_of_first_invalid_top(
        self, validate: Callable[[Ensemble], object], places: Places, common: Exception
    ) -> Exception:
        """Return the error of the first top that is invalid alone, with its index, or `common`."""
        while places.size > 1:
            middle = places.size // 2
            try:
                validate(self._build_tops(places[:middle]))
            except (TypeError, ValueError):
                places = places[:middle]
            else:
                places = places[middle:]
        try:
            validate(self._build_tops(places))
        except (TypeError, ValueError) as error:
            match = _FIRST_TOP.match(str(error))
            if match is None:
                return error
            index = format_index(unravel_index(int(places[0]), self.shape))
            prefix = "" if match[1] == "top" else f"{match[1]}{match[2]}"
            return type(error)(f"top{index}: {prefix}{str(error)[match.end() :]}")
        return common

    def _build_tops(self, places: Places) -> Ensemble:
        """Build the tops with the given indices; random tops must have consecutive indices."""
        random, first = self._random, int(places[0]) if places.size else 0
        if random is not None and random.widths:
            momentum, attitude, gravity = map(random.widths.get, _SCATTERED)
            widths = momentum, attitude, gravity
            return scatter(self.scene, places.size, random.seed, *widths, begin=first)
        arguments: dict[str, Any] = _select_parameters_of_tops(self._parameters, self.shape, places)
        if random is not None:
            arguments |= _draw_uniform_parameters(random, first, places.size)
        if "unphysical" in arguments:
            body = {name: arguments.pop(name) for name in _BODY}
            body["unphysical"] = body["unphysical"].values.astype(bool)
            arguments["body"] = Body(**body)
        return vary(self.scene, {**arguments, **self._flags})

    def _list_varying_values(
        self, begin: int, end: int, tops: Ensemble
    ) -> dict[str, BatchParameter]:
        """Return the values of the varying parameters for consecutive tops, the ensemble `tops`."""
        rows = _select_parameters_of_tops(
            self._varied, self.shape, np.arange(begin, end, dtype=np.int64)
        )
        if self._random is not None:
            rows |= _draw_uniform_parameters(self._random, begin, end - begin)
            for name in self._random.widths:
                values: Array = getattr(tops, name)
                rows[name] = BatchParameter(name, values, values.shape[1:])
        return rows


def _validate_parameters_and_flags(
    scene: Scene, arguments: Mapping[str, object]
) -> tuple[dict[str, BatchParameter], dict[str, bool]]:
    """Validate arguments; `degrees` becomes part of the parameters, others remain flags."""
    validate_type("scene", scene, Scene)
    parameters: dict[str, BatchParameter] = {}
    flags: dict[str, bool] = {}
    for name, value in arguments.items():
        if value is None:
            continue
        if name not in FLAGS:
            parameters[name] = validate_sweep_parameter(name, value)
        elif as_bool(name, value):
            flags[name] = True
    if flags.pop("degrees", False):
        parameters = {name: one._replace(degrees=True) for name, one in parameters.items()}
    return parameters, {name: True for name in FLAGS if name in flags}


def _reshape_parameter_along_axis(one: BatchParameter, axes: tuple[str, ...]) -> BatchParameter:
    """Let the values of a parameter vary along the axis of its name alone, if there is one."""
    lead = [1] * len(axes)
    if one.name in axes:
        lead[axes.index(one.name)] = len(one.values)
    return one._replace(values=one.values.reshape(*lead, *one.value))


def _collapse_broadcast_columns(
    columns: Mapping[str, npt.NDArray[Any]], dims: int, degrees: bool = False
) -> dict[str, BatchParameter]:
    """Return the columns of an ensemble, with repeated values stored only once."""
    return {
        name: BatchParameter(
            name,
            collapse_broadcast_axes(column, dims).astype(np.float64),
            column.shape[dims:],
            degrees,
        )
        for name, column in columns.items()
    }


def _select_parameters_of_tops(
    arguments: Parameters, shape: Shape, places: Places
) -> dict[str, BatchParameter]:
    """Return the values of the given parameters for the tops with the indices `places`."""
    indices = np.unravel_index(places, shape) if shape else ()
    first = np.zeros_like(places)
    selection: dict[str, BatchParameter] = {}
    for name, one in arguments.items():
        if shape:
            lengths = one.values.shape[: len(shape)]
            key = [i if n > 1 else first for i, n in zip(indices, lengths, strict=True)]
            values = one.values[tuple(key)]
        else:
            values = np.broadcast_to(one.values, (places.size, *one.value))
        selection[name] = one._replace(values=values)
    return selection


def _draw_uniform_parameters(random: RandomSpec, begin: int, n: int) -> dict[str, BatchParameter]:
    """Draw uniformly distributed values for `n` consecutive tops, starting with top `begin`.

    Each value depends only on the seed, the parameter and the index of the top. The state of the
    Philox generator can be set directly, because it is a counter.
    """
    samples: dict[str, BatchParameter] = {}
    for name, one in random.ranges.items():
        key = random.seed | zlib.crc32(name.encode()) << 64
        raw = np.random.Philox(key=key).advance(begin).random_raw(n * _DRAWS).reshape(n, _DRAWS)
        parts = math.prod(one.value)
        uniform = (raw[:, :parts] >> np.uint64(11)).astype(np.float64) * 2.0**-53
        low, high = one.values
        values = np.asarray(low + (high - low) * uniform.reshape(n, *one.value))
        samples[name] = one._replace(values=values)
    return samples
