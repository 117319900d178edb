"""Sources of tops for sweeps: grids, random starts and tables of starts."""

from __future__ import annotations

import math
import os
import re
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, Unpack, cast

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from .._model.body import Body
from .._model.parameters import (
    FLAGS,
    PARAMETERS,
    BatchParameter,
    Shape,
    collapse_broadcast_axes,
    get_parameter_unit,
)
from .._model.scene import VARIED, Scene, VaryKwargs, validate_one_top
from .._options.options import format_index, unravel_index
from .._utils import arguments as checks
from .._utils.arguments import Array, as_int, short_repr, validate_type

_NAMES = [name for name in VARIED if name in PARAMETERS]
_BODY = "mass", "inertia", "com", "inertia_rtol", "rotor", "wheels", "unphysical"
_WITHOUT_RANGE = "attitude", "attitude_xyzw", "inertia"
_DRAWS = 4  # random numbers drawn per top and parameter; no random parameter has more components
_FIRST_TOP = re.compile(r"(\w+)\[0\](: | = )")  # beginning of an error message about the first top
PARQUET = "'kreisel[sweep]'"
Places = npt.NDArray[np.int64]
Parameters = Mapping[str, BatchParameter]
_T = TypeVar("_T")


def list_component_names(name: str, value: Shape) -> list[str]:
    """Return names such as momentum_x; `value` is the shape of the value for a single top."""
    if not value:
        return [name]
    n, endings = math.prod(value), PARAMETERS[name].endings
    return [f"{name}_{endings[i] if len(endings) == n else i}" for i in range(n)]


def _read_columns(file: str, degrees: bool | None) -> tuple[dict[str, Array], bool]:
    """Read parameters, each as an array with one row per top, and whether angles are in degrees."""
    ending = Path(file).suffix.lower()
    if ending not in (".parquet", ".csv"):
        raise ValueError(f"{file}: a table of starts ends in .parquet or .csv")
    with checks.optional_dependency(PARQUET):
        import pyarrow as pa
        import pyarrow.csv as text
        import pyarrow.parquet as parquet
    try:
        with pa.OSFile(os.fsencode(file)) as stream:  # pyarrow refuses a str that is not UTF-8
            table = parquet.read_table(stream) if ending == ".parquet" else text.read_csv(stream)
    except pa.ArrowInvalid as error:
        raise ValueError(f"{file} cannot be read: {error}") from None
    columns: dict[str, npt.NDArray[Any]] = {}
    heads: dict[str, str] = {}
    for head, column in zip(table.column_names, table.columns, strict=True):
        name, _ = checks.split_column_head(head)
        if name in columns:
            raise ValueError(f"{file}: it has several columns {name!r}")
        if column.null_count:
            raise ValueError(f"{file}: its column {head!r} has missing values")
        columns[name], heads[name] = column.to_numpy(), head
        if columns[name].dtype.kind not in "fiub":
            raise ValueError(f"{file}: its column {head!r} must be numbers, not {column.type}")
    parameters, units = {}, []
    incomplete: dict[str, tuple[str, list[str]]] = {}
    for parameter in _NAMES:
        for value in PARAMETERS[parameter].shapes:
            names = list_component_names(parameter, value)
            missing = [name for name in names if name not in columns]
            for name in names if missing else ():
                if name not in incomplete or len(missing) < len(incomplete[name][1]):
                    incomplete[name] = parameter, missing
            if not missing:
                parts = [columns.pop(name) for name in names]
                parameters[parameter] = np.asarray(np.stack(parts, axis=-1).reshape(-1, *value))
                for i, name in enumerate(names):
                    _, unit = checks.split_column_head(heads[name])
                    expected = get_parameter_unit(parameter, False, i)
                    units.append((heads[name], unit, expected))
    for name in columns:
        if name not in incomplete:
            raise ValueError(f"{file}: {checks.unknown_name_message('column', name, _NAMES)}")
        parameter, missing = incomplete[name]
        raise ValueError(
            f"{file}: the column {name!r} is a component of {parameter}, of which are missing: "
            f"{', '.join(missing)}"
        )
    return parameters, checks.find_unit_of_angles(units, degrees)


@checks.make_frozen_class_decorator("construct a new kreisel.Source")
@dataclass(frozen=True, eq=False)
class Source:
    """A lazy description of many tops, from which kreisel.sweep constructs the tops of each part.

    The constructors are Source.grid, Source.random, Source.scatter, Source.columns and Source.of.

    scene  the scene whose parameters vary
    shape  the shape of the array of all tops, which are numbered in C order
    axes   the names of its dimensions

    `len(source)` is the number of tops, and `source[i]` is a single top as a kreisel.Scene. A slice
    `source[a:b]` is a one-dimensional kreisel.Scene.

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
    _seed: int = 0  # of random parameters
    _ranges: Parameters = field(default_factory=dict)  # of uniformly distributed parameters
    _widths: Mapping[str, Any] = field(default_factory=dict)  # of normally distributed starts

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
        parameters, flags = _read_parameters_and_flags(scene, arguments)
        shapes = {name: one.shape for name, one in parameters.items()}
        axes = tuple(filter(shapes.__getitem__, shapes))
        if not axes:
            raise ValueError("a grid needs values of at least one parameter, as in spin=[0, 1, 2]")
        for name in axes:
            if len(shapes[name]) != 1 or 0 in shapes[name]:
                raise ValueError(f"{name} must be one value or a list, not of {shapes[name]}")
        shape = sum(map(shapes.__getitem__, axes), ())
        if math.prod(shape) >= 2**53:
            raise ValueError(f"a grid of shape {shape} has more tops than can be counted")
        columns = _spread_along_axes(parameters.values(), axes)
        return cls(scene, shape, axes, columns, {name: columns[name] for name in axes}, flags)

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
        parameters, flags = _read_parameters_and_flags(scene, arguments)
        ranges = {name: one for name, one in parameters.items() if one.shape}
        if not ranges:
            raise ValueError("random tops need a range of at least one parameter: spin=(0, 20)")
        for name, one in ranges.items():
            shown = short_repr(one.values.tolist())
            if name in _WITHOUT_RANGE:
                raise ValueError(f"{name} has no range: give one value, or use Source.columns")
            if one.shape != (2,) or (one.values[0] > one.values[1]).any():
                raise ValueError(f"{name} must be one value or a range (low, high), not {shown}")
            with np.errstate(over="ignore"):
                is_finite = np.isfinite(one.values[1] - one.values[0]).all()
            if not is_finite:
                raise ValueError(f"{name} must lie in a range of finite width, not {shown}")
        constants = _spread_along_axes(
            [one for one in parameters.values() if not one.shape], ("top",)
        )
        return cls(scene, (count,), ("top",), constants, {}, flags, key, ranges)

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
        validate_one_top("scene", scene)
        count, key = as_int("n", n, 1), as_int("seed", seed, 0)
        scene._scatter(1, key, momentum, attitude, gravity)
        deviations = {"momentum": momentum, "attitude": attitude, "gravity": gravity}
        widths = {name: np.asarray(w).tolist() for name, w in deviations.items() if w is not None}
        return cls(scene, (count,), ("top",), _seed=key, _widths=widths)

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
        arguments, in_degrees = _read_columns(os.fspath(file), degrees)
        parameters, flags = _read_parameters_and_flags(
            scene, {**arguments, "degrees": in_degrees, "steady": steady, "fast": fast}
        )
        shapes = {one.shape for one in parameters.values()}
        if len(shapes) != 1 or shapes <= {(), (0,)}:
            raise ValueError(f"{os.fspath(file)}: a table of starts needs rows of numbers")
        return cls(scene, shapes.pop(), ("top",), parameters, parameters, flags)

    @classmethod
    def of(cls, scene: Scene) -> Source:
        """Return a source of tops for a sweep, created from a scene of many tops."""
        if not validate_type("scene", scene, Scene).size:
            raise ValueError("an empty scene cannot be swept")
        columns: dict[str, npt.NDArray[Any]] = dict(scene._columns)
        if scene.body.shape:
            columns |= {name: scene.body._columns[name] for name in _BODY}
        first = scene._select_member((0,) * scene.ndim)
        arguments, varied = (
            {
                name: BatchParameter(
                    name,
                    collapse_broadcast_axes(column, scene.ndim).astype(np.float64),
                    column.shape[scene.ndim :],
                    degrees,
                )
                for name, column in given.items()
            }
            for given, degrees in ((columns, False), (scene._varied, scene._in_degrees))
        )
        return cls(first, scene.shape, scene.axes, arguments, varied)

    @cached_property
    def size(self) -> int:
        """The number of tops."""
        return math.prod(self.shape)

    def __len__(self) -> int:
        return self.size

    def __getitem__(self, key: int | slice) -> Scene:
        """Return the scene of a single top, or of several tops."""
        if isinstance(key, slice):
            begin, end, step = key.indices(self.size)
            if step != 1:
                raise ValueError(f"tops have consecutive indices: {short_repr(key)} has a step")
            return self._build_tops(np.arange(begin, max(begin, end), dtype=np.int64))
        i = as_int("the index of a top", key, -(2**63) + 1)
        if not -self.size <= i < self.size:
            raise IndexError(f"index {i} is out of range for {self.size} tops")
        scene: Scene = self._build_tops(np.array([i % self.size]))[0]
        return scene

    def __repr__(self) -> str:
        varied = [*self._varied, *self._ranges, *self._widths]
        return f"<kreisel.Source of shape {self.shape}: {', '.join(varied) or 'all equal'}>"

    def _name_invalid_top(
        self, places: Places, validate: Callable[[Scene], object], call: Callable[[], _T]
    ) -> _T:
        """Return the result of `call`; an error names the first top that `validate` refuses."""
        try:
            return call()
        except (TypeError, ValueError) as error:
            common = error
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
                raise
            index = format_index(unravel_index(int(places[0]), self.shape))
            prefix = "" if match[1] == "top" else f"{match[1]}{match[2]}"
            raise type(error)(f"top{index}: {prefix}{str(error)[match.end() :]}") from None
        raise common

    def _build_tops(self, places: Places) -> Scene:
        """Build the tops with the given indices; random tops must have consecutive indices."""
        if self._widths:
            first = int(places[0]) if places.size else 0
            given = {name: self._widths.get(name) for name in ("momentum", "attitude", "gravity")}
            return self.scene._scatter(places.size, self._seed, **given, begin=first)
        arguments: dict[str, Any] = self._select_values(self._parameters, places)
        if "unphysical" in arguments:
            body = {name: arguments.pop(name) for name in _BODY}
            body["unphysical"] = body["unphysical"].values.astype(bool)
            arguments["body"] = Body(**body)
        return self.scene.vary(**cast(VaryKwargs, {**arguments, **self._flags}))

    def _select_values(self, parameters: Parameters, places: Places) -> dict[str, BatchParameter]:
        """Return the values of the parameters, and of random ones, for the tops at `places`.

        Random values are uniformly distributed. They depend only on the seed, the parameter and the
        index of the top, because the Philox generator is a counter, whose state can be set.
        """
        indices = np.unravel_index(places, self.shape) if self.shape else ()
        selection: dict[str, BatchParameter] = {}
        for name, one in parameters.items():
            lengths = one.values.shape[: len(self.shape)]
            key = [i if n > 1 else np.zeros_like(i) for i, n in zip(indices, lengths, strict=True)]
            values = one.values[tuple(key)] if key else one.values[None].repeat(places.size, axis=0)
            selection[name] = one._replace(values=values)
        n, first = places.size, int(places[0]) if places.size else 0
        for name, one in self._ranges.items():
            generator = np.random.Philox(key=self._seed | zlib.crc32(name.encode()) << 64)
            raw = generator.advance(first).random_raw(n * _DRAWS).reshape(n, _DRAWS)
            raw = raw[:, : math.prod(one.value)] >> np.uint64(11)
            uniform = raw.astype(np.float64).reshape(n, *one.value) * 2.0**-53
            low, high = one.values
            selection[name] = one._replace(values=np.asarray(low + (high - low) * uniform))
        return selection


def _read_parameters_and_flags(
    scene: Scene, arguments: Mapping[str, object]
) -> tuple[dict[str, BatchParameter], dict[str, bool]]:
    """Validate arguments; `degrees` becomes part of the parameters, others remain flags.

    Conditions on the values, such as a positive mass, are checked when tops are built.
    """
    validate_one_top("scene", scene)
    given = {name: value for name, value in arguments.items() if value is not None}
    flags = {name: True for name in FLAGS if checks.as_bool(name, given.pop(name, False))}
    degrees = flags.pop("degrees", False)
    parameters = {}
    for name, value in given.items():
        if name not in _NAMES:
            raise ValueError(checks.unknown_name_message("parameter", name, [*_NAMES, *FLAGS]))
        form, shapes = f"{PARAMETERS[name].form}, or a list of such values", PARAMETERS[name].shapes
        values = checks.as_finite_array(name, value, form)
        if name == "damping" and not values.shape:
            values = values.repeat(3)
        fits = [one for one in shapes if values.shape[max(values.ndim - len(one), 0) :] == one]
        if not fits:
            raise ValueError(
                f"{name} must be {form}, or a list of such values, not {short_repr(value)}"
            )
        parameters[name] = BatchParameter(name, values, fits[0], degrees)
    return parameters, flags


def _spread_along_axes(
    parameters: Iterable[BatchParameter], axes: tuple[str, ...]
) -> dict[str, BatchParameter]:
    """Let the values of each parameter vary along the axis of its name alone, if there is one."""
    return {
        one.name: one._replace(
            values=one.values.reshape(*(-1 if one.name == axis else 1 for axis in axes), *one.value)
        )
        for one in parameters
    }
