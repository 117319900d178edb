"""Sources of a sweep: lazy descriptions of tops, built when they are needed.

A source takes no memory for its tops. Each top depends on the source and its own index alone.
"""

from __future__ import annotations

import math
import os
import re
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Unpack, overload

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from .._model.bodies import Bodies
from .._model.broadcasting import drop_broadcast
from .._model.kwargs_types import VaryKwargs
from .._model.scene import Ensemble, Scene
from .._model.variation import scatter
from .._options.ensemble_options import format_index, unravel_index
from .._utils.errors import refuse_assignment
from .._utils.validation import Array, as_bool, as_int, check_type, short_repr
from .parameter_values import FLAGS, ParameterValues, Shape, given
from .start_table import read_columns

_DRAWS = 4  # random numbers of a top for a word, of which none that is drawn has more components
_BODY = "mass", "inertia", "com", "inertia_rtol", "unphysical"
_FIRST = re.compile(r"(\w+)\[0\](: | = )")  # the word of the first top in a refusal
_SAMPLED = 1 << 10  # tops by which a source is looked at
_SCATTERED = "momentum", "attitude", "gravity"
_NOT_DRAWN = "attitude", "attitude_xyzw", "inertia"
Places = npt.NDArray[np.int64]
Words = Mapping[str, ParameterValues]


class RandomSpec(NamedTuple):
    """Random parameters of a source: bounds (2, *value), or widths of normal deviations."""

    seed: int
    ranges: Words
    widths: Mapping[str, Any]


@refuse_assignment("make another kreisel.Source")
@dataclass(frozen=True, eq=False)
class Source:
    """Many tops that are not there yet: what kreisel.sweep makes its parts of. It takes no more
    room than its words do, however many tops there are.

    scene  what each top is but for what varies
    shape  of all tops, which are numbered in C order; axes: a name for each dimension

    Made by Source.grid, .random, .scatter, .columns, .of. `len(source)` tops; `source[i]` is the
    kreisel.Scene of that number, `source[a:b]` the kreisel.Ensemble of some, in one dimension.

        >>> import kreisel as kr, numpy as np
        >>> spin, tilt = np.linspace(0, 20, 10000), np.linspace(0, 1, 10000)
        >>> source = kr.Source.grid(kr.scenes.sleeping, spin=spin, tilt=tilt)
        >>> source.shape, source[12345678:12345680].coords["spin"].round(6).tolist()
        ((10000, 10000), [2.468247, 2.468247])
    """

    scene: Scene
    shape: Shape
    axes: tuple[str, ...]
    _words: Words = field(default_factory=dict)  # of which the tops are made
    _told: Words = field(default_factory=dict)  # that vary, as they were given
    _flags: Mapping[str, bool] = field(default_factory=dict)
    _drawn: RandomSpec | None = None

    @classmethod
    def grid(cls, scene: Scene, **words: Unpack[VaryKwargs]) -> Source:
        """Describe all combinations of the values of some parameters.

        Each parameter with a list of values has a dimension of its own, in the order of the
        arguments; a single value applies to all tops. The parameters are those of Scene.vary except
        body. Raises TypeError and ValueError as Scene.vary does.

        >>> import kreisel as kr
        >>> kr.Source.grid(kr.scenes.sleeping, gravity=[1, 2, 3], spin=[4, 5]).shape
        (3, 2)
        """
        numbers, flags = _split(scene, words)
        axes = [name for name, one in numbers.items() if one.lead]
        if not axes:
            raise ValueError("a grid needs the values of at least one word, as spin=[0, 1, 2]")
        for name in axes:
            _refuse_no_row(name, numbers[name])
        shape = tuple(numbers[name].lead[0] for name in axes)
        spread = {name: _along(one, name, axes) for name, one in numbers.items()}
        told = {name: spread[name] for name in axes}
        return cls(scene, _counted(shape), tuple(axes), spread, told, flags)

    @classmethod
    def random(cls, scene: Scene, n: int, *, seed: int = 0, **words: Unpack[VaryKwargs]) -> Source:
        """n tops whose words are evenly distributed between two values each, as spin=(0, 20); of
        vectors between two rows. A word with a single value holds for all.

        A value depends on the seed, the number of the top and the word alone. The words are those
        of Scene.vary, but for body; inertia and attitudes have single values. Raises TypeError and
        ValueError as that.

        >>> import kreisel as kr
        >>> tops = kr.Source.random(kr.scenes.sleeping, 10**9, seed=7, spin=(0, 20), tilt=(0, 1))
        >>> tops[123456789:123456791].coords["spin"].round(3).tolist()
        [15.105, 16.434]
        """
        count, key = as_int("n", n, 1), as_int("seed", seed, 0)
        numbers, flags = _split(scene, words)
        ranges = {name: one for name, one in numbers.items() if one.lead}
        if not ranges:
            raise ValueError("random tops need the range of at least one word, as spin=(0, 20)")
        for name, one in ranges.items():
            _refuse_no_range(name, one)
        still = {name: _along(one, name, ["top"]) for name, one in numbers.items() if not one.lead}
        return cls(scene, (count,), ("top",), still, {}, flags, RandomSpec(key, ranges, {}))

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
        """n uncertain starts: the tops of Scene.scatter, in its words, with what it raises.

        >>> import kreisel as kr
        >>> source = kr.Source.scatter(kr.scenes.thesis, 10**9, seed=7, attitude=0.01)
        >>> source[3] == kr.scenes.thesis.scatter(10, seed=7, attitude=0.01)[3]
        True
        """
        check_type("scene", scene, Scene)
        count, key = as_int("n", n, 1), as_int("seed", seed, 0)
        scatter(Ensemble, scene, 1, key, momentum, attitude, gravity)
        asked = {"momentum": momentum, "attitude": attitude, "gravity": gravity}
        widths = {name: np.asarray(w).tolist() for name, w in asked.items() if w is not None}
        return cls(scene, (count,), ("top",), _drawn=RandomSpec(key, {}, widths))

    @classmethod
    def columns(
        cls,
        scene: Scene,
        file: str | os.PathLike[str],
        *,
        degrees: bool = False,
        steady: bool = False,
        fast: bool = False,
    ) -> Source:
        """The tops in the rows of a table: each column is a word of Scene.vary, as gravity, or a
        component of one, as momentum_x, momentum_y, momentum_z or angles_0, angles_1, angles_2.

        file  .parquet or .csv (which need pyarrow), or .npz with an array for each word

        degrees, steady and fast are those of Scene.vary, and hold for all.

        Raises TypeError and ValueError for other columns, OSError where the file cannot be read.
        """
        words = read_columns(os.fspath(file))
        numbers, flags = _split(
            scene, {**words, "degrees": degrees, "steady": steady, "fast": fast}
        )
        lengths = {name: one.lead for name, one in numbers.items()}
        if len(set(lengths.values())) != 1 or not all(map(_is_row, lengths.values())):
            raise ValueError(
                f"{os.fspath(file)}: its columns must be rows of one length, not {lengths}"
            )
        shape = next(iter(lengths.values()))
        return cls(scene, shape, ("top",), numbers, numbers, flags)

    @classmethod
    def of(cls, tops: Ensemble) -> Source:
        """The tops of an ensemble."""
        check_type("tops", tops, Ensemble)
        if not tops.size:
            raise ValueError("an ensemble of no tops has nothing to sweep")
        columns: dict[str, npt.NDArray[Any]] = dict(tops._columns)
        if isinstance(tops.body, Bodies):
            columns |= {name: tops.body._columns[name] for name in _BODY}
        scene = tops._member((0,) * tops.ndim)
        words, told = (_held(some, tops.ndim) for some in (columns, tops._varied))
        return cls(scene, tops.shape, tops.axes, words, told)

    @property
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
        """A top by its number, or those of some numbers one after the other."""
        if isinstance(key, slice):
            begin, end, step = key.indices(self.size)
            if step != 1:
                raise ValueError(f"tops are taken one after the other, not by {short_repr(key)}")
            return self._made(np.arange(begin, max(begin, end), dtype=np.int64))
        i = as_int("the number of a top", key, -(2**63) + 1)
        if not -self.size <= i < self.size:
            raise IndexError(f"there is no top {i} among {self.size}")
        made: Scene = self._made(np.array([i % self.size]))[0]
        return made

    def __repr__(self) -> str:
        drawn = self._drawn or RandomSpec(0, {}, {})
        told = [*self._told, *drawn.ranges, *drawn.widths]
        return f"<kreisel.Source of shape {self.shape}: {', '.join(told) or 'all alike'}>"

    def _sample(self) -> Places:
        """The numbers of some tops by which a request is looked at: all over the source, with the
        first and the last; of random ones any tell as much."""
        if self._drawn is not None:
            return np.arange(min(self.size, _SAMPLED), dtype=np.int64)
        step = max(1, self.size // _SAMPLED)
        at = np.arange(0, self.size, step, dtype=np.int64)
        return np.unique(np.append(at, self.size - 1))

    def _refusal(
        self, look: Callable[[Ensemble], object], at: Places, of_all: Exception
    ) -> Exception:
        """Return the error of the first invalid top among some, with its index in the source.

        `of_all` is the error that building all of them together raised; it is returned if no single
        top is invalid.
        """
        while at.size > 1:
            middle = at.size // 2
            try:
                look(self._made(at[:middle]))
            except (TypeError, ValueError):
                at = at[:middle]
            else:
                at = at[middle:]
        try:
            look(self._made(at))
        except (TypeError, ValueError) as error:
            own = _FIRST.match(str(error))
            if own is None:
                return error
            where = format_index(unravel_index(int(at[0]), self.shape))
            word = "" if own[1] == "top" else f"{own[1]}{own[2]}"
            return type(error)(f"top{where}: {word}{str(error)[own.end() :]}")
        return of_all

    def _made(self, at: Places) -> Ensemble:
        """The tops of these numbers; of random ones they follow each other."""
        drawn, first = self._drawn, int(at[0]) if at.size else 0
        if drawn is not None and drawn.widths:
            momentum, attitude, gravity = map(drawn.widths.get, _SCATTERED)
            widths = momentum, attitude, gravity
            return scatter(Ensemble, self.scene, at.size, drawn.seed, *widths, begin=first)
        values: dict[str, Any] = {
            name: _taken(one, self.shape, at) for name, one in self._words.items()
        }
        if drawn is not None:
            values |= {
                name: _even(drawn.seed, name, one, first, at.size)
                for name, one in drawn.ranges.items()
            }
        if "unphysical" in values:
            mass, inertia, com, inertia_rtol, unphysical = (values.pop(name) for name in _BODY)
            values["body"] = Bodies(
                mass, inertia, com, inertia_rtol=inertia_rtol, unphysical=unphysical.astype(bool)
            )
        values |= self._flags
        return self.scene.vary(**values)

    def _coords(self, begin: int, end: int, tops: Ensemble) -> dict[str, ParameterValues]:
        """The words that vary, of some tops, which are these."""
        at = np.arange(begin, end, dtype=np.int64)
        rows = {
            n: ParameterValues(_taken(one, self.shape, at), one.value)
            for n, one in self._told.items()
        }
        if self._drawn is not None:
            for name, one in self._drawn.ranges.items():
                drawn = _even(self._drawn.seed, name, one, begin, end - begin)
                rows[name] = ParameterValues(drawn, one.value)
            for name in self._drawn.widths:
                values = tops._columns[name]
                rows[name] = ParameterValues(values, values.shape[1:])
        return rows


def _split(
    scene: Scene, words: Mapping[str, object]
) -> tuple[dict[str, ParameterValues], dict[str, bool]]:
    """The words of numbers, and those that are true or not."""
    check_type("scene", scene, Scene)
    told = {name: value for name, value in words.items() if value is not None}
    numbers = {name: given(name, value) for name, value in told.items() if name not in FLAGS}
    flags = {name: as_bool(name, told[name]) for name in FLAGS if name in told}
    return numbers, {name: True for name, is_so in flags.items() if is_so}


def _is_row(lead: Shape) -> bool:
    return len(lead) == 1 and lead[0] > 0


def _refuse_no_row(name: str, one: ParameterValues) -> None:
    if not _is_row(one.lead):
        raise ValueError(f"{name} must be one value or a list of values, not of shape {one.lead}")


def _refuse_no_range(name: str, one: ParameterValues) -> None:
    if name in _NOT_DRAWN:
        raise ValueError(f"{name} has no range: give one value, or make kreisel.Source.columns")
    if one.lead != (2,) or (one.values[0] > one.values[1]).any():
        raise ValueError(
            f"{name} must be one value, or two between which it lies, the lesser one first; "
            f"not {short_repr(one.values.tolist())}"
        )


def _counted(shape: Shape) -> Shape:
    if math.prod(shape) >= 2**53:
        raise ValueError(f"a grid of shape {shape} has more tops than can be counted")
    return shape


def _along(one: ParameterValues, name: str, axes: list[str]) -> ParameterValues:
    """The values along the dimension of their word, or along none."""
    lead = [len(one.values) if axis == name and one.lead else 1 for axis in axes]
    return ParameterValues(one.values.reshape(*lead, *one.value), one.value)


def _held(columns: Mapping[str, npt.NDArray[Any]], dims: int) -> dict[str, ParameterValues]:
    """Columns of an ensemble of so many dimensions, without what broadcasting makes of them."""
    return {
        name: ParameterValues(drop_broadcast(column, dims).astype(np.float64), column.shape[dims:])
        for name, column in columns.items()
    }


def _taken(one: ParameterValues, shape: Shape, at: Places) -> Array:
    """The values of some members."""
    if not shape:
        return np.broadcast_to(one.values, (at.size, *one.value))
    where = np.unravel_index(at, shape)
    places = zip(where, one.lead, strict=True)
    return one.values[tuple(place if n > 1 else 0 * place for place, n in places)]


def _even(seed: int, name: str, one: ParameterValues, begin: int, n: int) -> Array:
    """Evenly distributed values of a word: that of a top depends on the seed, the word and the
    number of the top, for Philox counts its random words and has no other state."""
    philox = np.random.Philox(key=seed | zlib.crc32(name.encode()) << 64).advance(begin)
    raw = philox.random_raw(n * _DRAWS).reshape(n, _DRAWS)
    parts = math.prod(one.value)
    even = (raw[:, :parts] >> np.uint64(11)).astype(np.float64) * 2.0**-53
    low, high = one.values
    return np.asarray(low + (high - low) * even.reshape(n, *one.value))
