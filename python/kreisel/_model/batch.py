"""Arrays of bodies and scenes, whose members share values."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping
from html import escape
from types import EllipsisType, MappingProxyType, NoneType
from typing import Any, ClassVar, Self, TypeVar, overload

import numpy as np
import numpy.typing as npt

from .._utils.arguments import Array, HintingType, ShapedBase, freeze_array, short_repr
from .._utils.html import format_html_table
from . import parameters
from .parameters import (
    BatchParameter,
    Column,
    Index,
    Shape,
    collapse_broadcast_axes,
    get_parameter_unit,
)


def broadcast_shapes(words: Iterable[BatchParameter], **more: Shape) -> Shape:
    """Return the shape to which those of parameters broadcast; raise ValueError if they do not."""
    shapes = [*more.items(), *[(one.name, one.shape) for one in words]]
    try:
        return np.broadcast_shapes(*[shape for _, shape in shapes])
    except ValueError:
        listing = ", ".join([f"{name} {shape}" for name, shape in shapes if shape])
        raise ValueError(
            f"the shapes of the members cannot be broadcast together: {listing}"
        ) from None


def read_parameters(given: Mapping[str, object]) -> list[BatchParameter]:
    """Return the values of parameters that broadcast together."""
    words = [parameters.read_parameter(name, value) for name, value in given.items()]
    broadcast_shapes(words)
    return words


def name_varying_dimensions(
    shape: Shape, words: Iterable[BatchParameter]
) -> tuple[str | None, ...]:
    """Name each dimension after the only parameter that varies along it.

    This parameter must be a scalar that varies along no other dimension. All other dimensions have
    the name None.
    """
    parameters_by_axis: list[list[BatchParameter]] = [[] for _ in shape]
    places: dict[str, int] = {}
    for each in words:
        for position, n in enumerate(reversed(each.shape), 1):
            if n != 1 or shape[-position] == 1:
                parameters_by_axis[-position].append(each)
                places[each.name] = places.get(each.name, 0) + 1
    return tuple(
        [
            one[0].name if len(one) == 1 and not one[0].value and places[one[0].name] == 1 else None
            for one in parameters_by_axis
        ]
    )


def shrink_column(values: Column, dims: int, trailing: int) -> Column:
    """Return read-only values with `dims` leading dimensions, of length 1 where they are shared.

    The last `trailing` dimensions are those of one value.
    """
    array = np.asarray(values)
    column = collapse_broadcast_axes(array, array.ndim - trailing)
    missing = dims + trailing - column.ndim
    return freeze_array(column.reshape((1,) * missing + column.shape).view())


_Kind = TypeVar("_Kind", bound="BatchBase")
_IndexKey = slice | EllipsisType | None | list[Any] | npt.NDArray[Any]


class _Stored:
    """An attribute of many, which views their columns. That of one is in its __dict__.

    Unlike __getattr__, this does not slow down the other attributes.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    def __get__(self, batch: BatchBase | None, _: object = None) -> Any:
        if batch is None:
            return self
        fields, name, shape = batch.__dict__, self.name, batch.shape
        if name == "_columns" and batch._stored[0] in fields:
            return {one: np.asarray(getattr(batch, one)) for one in batch._stored}
        if name == "_block" and shape:
            one = type(batch).__name__.lower()
            raise TypeError(
                f"{one} must be one {one}, not an array of shape {shape}: select one by its index, "
                f"as in {one}[0]"
            )
        column = fields.get("_columns", {}).get(name)
        if column is None:
            raise AttributeError(f"{type(batch).__name__!r} object has no attribute {name!r}")
        return np.broadcast_to(column, shape + column.shape[len(shape) :])


def store_columns(kind: type[_Kind]) -> type[_Kind]:
    """Give a class of bodies or scenes the attributes that view the columns of many."""
    for name in (*kind._stored, "_columns", "_block"):
        setattr(kind, name, _Stored(name))
    return kind


class BatchBase(ShapedBase, metaclass=HintingType):
    """Base class of bodies and scenes, for one or for many.

    Many store their parameters as arrays. The first dimensions of a stored array are those of the
    batch, of length 1 where the members share a value. The last dimensions are those of one value.
    One stores its parameters as numbers and tuples, and its `_block`.
    """

    _compared: ClassVar[tuple[str, ...]]  # the attributes that determine equality
    _compared_of_many: ClassVar[tuple[str, ...]]
    _stored: ClassVar[tuple[str, ...]]  # the attributes that are columns of many
    shape: Shape = ()
    _names: tuple[str | None, ...] = ()
    _columns: Mapping[str, Column]
    _varied: Mapping[str, Column] = MappingProxyType({})  # what varies, as the user gave it
    _in_degrees: bool = False  # the unit of the angles in `_varied`

    def _store(
        self, shape: Shape, columns: Mapping[str, tuple[Column, int]], words: list[BatchParameter]
    ) -> None:
        """Store columns, each with the number of dimensions of one value, and what varies."""
        dims = len(shape)
        self.__dict__.update(
            shape=shape,
            _columns={name: shrink_column(x, dims, n) for name, (x, n) in columns.items()},
        )
        self._note_varying_parameters(words)

    def _note_varying_parameters(self, words: list[BatchParameter]) -> Self:
        """Store the parameters that vary, and name the dimensions after them."""
        if self.shape:
            self.__dict__.update(
                _names=name_varying_dimensions(self.shape, words),
                _varied={
                    one.name: shrink_column(one.values, len(self.shape), len(one.value))
                    for one in words
                    if one.shape
                },
                _in_degrees=any(one.degrees and one.shape for one in words),
            )
        return self

    def _select_member(self, index: Index) -> Any:
        raise NotImplementedError

    def _with(
        self, shape: Shape, names: tuple[str | None, ...], change: Callable[[Column], Column]
    ) -> Self:
        """Return a batch of another shape, with changed columns."""
        batch = type(self).__new__(type(self))
        columns, varied = self._columns, self._varied
        kept = {id(x): x for x in (*columns.values(), *varied.values())}
        changed = {key: freeze_array(change(column)) for key, column in kept.items()}
        batch.__dict__.update(
            shape=shape,
            _names=names,
            _columns={name: changed[id(column)] for name, column in columns.items()},
            _varied={name: changed[id(column)] for name, column in varied.items()},
            _in_degrees=self._in_degrees,
        )
        return batch

    @property
    def coords(self) -> Mapping[str, Column]:
        """The varying parameters, as arrays that broadcast to the shape of the batch.

        An array of vectors has an additional last dimension for the components.
        """
        return MappingProxyType(self._varied)

    def _list_varying_parameters(self) -> list[BatchParameter]:
        dims = len(self.shape)
        return [
            BatchParameter(name, x, x.shape[dims:], self._in_degrees)
            for name, x in self._varied.items()
        ]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        if self.shape != other.shape:
            return False
        names = self._compared_of_many if self.shape else self._compared
        pairs = [(getattr(self, name), getattr(other, name)) for name in names]
        return all(
            np.array_equal(mine, theirs) if isinstance(mine, np.ndarray) else mine == theirs
            for mine, theirs in pairs
        )

    def __hash__(self) -> int:
        if self.shape:
            raise TypeError(f"unhashable: a {type(self).__name__} of shape {self.shape}")
        return hash(tuple(getattr(self, name) for name in self._compared))

    def __len__(self) -> int:
        if not self.shape:
            raise TypeError(f"a {type(self).__name__} of shape () has no length")
        return self.shape[0]

    def __iter__(self) -> Iterator[Any]:
        """Iterate over the first dimension.

        Iteration over a one-dimensional batch yields its members; iteration over any other batch
        yields batches with one dimension fewer. Raises TypeError if the batch has no dimensions.
        """
        if not self.shape:
            raise TypeError(f"a {type(self).__name__} of shape () cannot be iterated")
        return (self[i] for i in range(self.shape[0]))

    @overload
    def __getitem__(self, key: _IndexKey) -> Self: ...
    @overload
    def __getitem__(self, key: object) -> Any: ...
    def __getitem__(self, key: Any) -> Any:
        """Return the member at an index, or the batch selected by slices, index arrays or masks."""
        shape = self.shape
        if type(key) is int and len(shape) == 1 and -shape[0] <= key < shape[0]:
            return self._select_member((key % shape[0],))
        parts: list[Any] = list(key) if isinstance(key, tuple) else [key]
        try:
            selection: Any = np.broadcast_to(np.False_, shape)[key]
        except OverflowError:
            raise IndexError(f"{short_repr(key)} is out of range") from None
        except IndexError:
            if shape:
                raise
            raise TypeError(f"a {type(self).__name__} of shape () has no index") from None
        if not isinstance(selection, np.ndarray) and all(map(_is_integer, parts)):
            return self._select_member(
                tuple(operator.index(i) % n for i, n in zip(parts, shape, strict=True))
            )
        plain = slice, EllipsisType, NoneType
        arrays = [x for x in parts if not (isinstance(x, plain) or _is_integer(x))]
        is_alone = not any(x is None or _is_integer(x) for x in parts)
        if arrays and not (len(arrays) == 1 and np.ndim(arrays[0]) == 1 and is_alone):
            order: Any = np.arange(self.size).reshape(shape)[key]
            if not isinstance(order, np.ndarray):
                return self._select_member(tuple(map(int, np.unravel_index(int(order), shape))))
            return self._gather(order)
        missing = len(shape) - sum(x is not None and x is not ... for x in parts)
        middle = next((k for k, x in enumerate(parts) if x is ...), len(parts))
        parts[middle : middle + 1] = [slice(None)] * missing

        def take(column: Column) -> Column:
            lengths = iter(zip(column.shape, shape, strict=False))
            index = []
            for part in parts:
                if part is not None:
                    own, all_of_them = next(lengths)
                    if own != all_of_them:
                        part = 0 if _is_integer(part) else slice(None)
                index.append(part)
            return np.asarray(column[tuple(index)])

        names = iter(self._names)
        paired = [(part, None if part is None else next(names)) for part in parts]
        kept = tuple(name for part, name in paired if not _is_integer(part))
        return self._with(selection.shape, kept, take)

    def _gather(self, order: npt.NDArray[np.int64]) -> Self:
        """Return the members with the indices `order` in the flattened batch (in C order)."""
        dims, size = len(self.shape), self.size

        def gather(column: Column) -> Column:
            value = column.shape[dims:]
            if order.size and max(column.shape[:dims], default=1) <= 1:
                return column.reshape((1,) * order.ndim + value)
            return np.broadcast_to(column, self.shape + value).reshape(size, *value)[order]

        return self._with(order.shape, (None,) * order.ndim, gather)

    def reshape(self, *shape: Any) -> Self:
        """Return a batch with the same members in C order and a new shape.

        >>> import kreisel as kr
        >>> tops = kr.scenes.thesis.vary(gravity=[1, 2, 3, 4])
        >>> tops.reshape(2, 2)[1, 0].gravity
        3.0
        """
        order = np.arange(self.size).reshape(*shape)
        return self if order.shape == self.shape == () else self._gather(order)

    def ravel(self) -> Self:
        """Return a one-dimensional batch that contains all members in C order."""
        return self if len(self.shape) == 1 else self.reshape(-1)

    def _describe(self) -> str:
        """Name the varying parameters, with the least and largest values of scalars."""
        dims = len(self.shape)
        texts = [
            name if x.ndim > dims or not x.size else f"{name} {x.min():.6g} .. {x.max():.6g}"
            for name, x in self._varied.items()
        ] or [name for name, x in self._columns.items() if max(x.shape[:dims], default=0) > 1]
        return f"<{type(self).__name__} of shape {self.shape}: {', '.join(texts) or 'all equal'}>"

    def _list_displayed_parameters(self) -> Mapping[str, Any]:
        """Return the parameters that notebooks show, with values for all members."""
        raise NotImplementedError

    def _list_parameter_rows(self) -> list[tuple[str, str, str]]:
        """Return the name, the value or the range of values, and the unit of each parameter."""
        if not self.size:
            return []
        rows, dims = [], len(self.shape)
        for name, given in {**self._list_displayed_parameters(), **self._varied}.items():
            values = np.asarray(given)
            columns = values.reshape(math.prod(values.shape[:dims]), -1).T
            texts = [
                f"{x.min():.6g}" + f" .. {x.max():.6g}" * bool(x.min() < x.max()) for x in columns
            ]
            width = values.shape[-1] if values.ndim > dims else 1
            lines = [", ".join(texts[k : k + width]) for k in range(0, len(texts), width)]
            unit = get_parameter_unit(name, self._in_degrees and name in self._varied)
            rows.append((name.replace("_", " "), "; ".join(lines), unit and f"[{unit}]"))
        return rows

    def _repr_html_(self) -> str:
        """Return a table of the parameters and their units, for display in notebooks."""
        title = self._describe() if self.shape else f"<{type(self).__name__}>"
        table = format_html_table(self._list_parameter_rows(), ("parameter", "value", "unit"))
        return f"<p>{escape(title)}</p>\n{table}"


def _is_integer(part: object) -> bool:
    return hasattr(part, "__index__") and not isinstance(part, bool) and np.ndim(part) == 0  # type: ignore[arg-type]


def stack_components(*components: Array) -> Array:
    """Stack components into vectors along a new last dimension."""
    return np.stack(np.broadcast_arrays(*components), axis=-1)
