"""Arrays of tops: batches whose members share values, and the shapes of their arguments."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import EllipsisType, MappingProxyType
from typing import Any, Generic, NamedTuple, Self, TypeVar, overload

import numpy as np
import numpy.typing as npt

from .._utils.arguments import (
    Array,
    as_array,
    as_float,
    as_float_list,
    as_non_negative,
    as_positive,
    convert_parameter_to_radians,
    freeze_array,
    short_repr,
)
from .._utils.name_hints import HintingType
from .shapes import validate_inertia_tensor

Shape = tuple[int, ...]
Index = tuple[int, ...]
Validator = Callable[[str, Any], object]  # validates (name, value)
Column = npt.NDArray[Any]
ColumnMap = Callable[[Column], Column]
_BLOCK = 4096  # members per block, so that the data of a block fits into the cache


class BatchParameter(NamedTuple):
    """A named parameter and its values."""

    name: str
    values: Array  # (*shape, *value)
    value: Shape  # shape of one value
    degrees: bool = False  # True if angles and rates are in degrees

    @property
    def radians(self) -> Array:
        """The values, with angles and rates in radians."""
        return convert_parameter_to_radians(self.name, self.values) if self.degrees else self.values

    @property
    def shape(self) -> Shape:
        """The shape of the batch: the shape of `values` without the dimensions of one value."""
        return self.values.shape[: self.values.ndim - len(self.value)]

    def broadcast_to(self, shape: Shape) -> Array:
        """Broadcast the values of the parameter to a batch of the given shape."""
        return np.broadcast_to(self.values, shape + self.value)

    def raise_error_of_first_bad_value(self, bad: Any, validate: Validator) -> None:
        """Raise the exception of `validate` for the first value marked in `bad`, with its index."""
        if np.any(bad):
            index = tuple(map(int, np.unravel_index(int(np.argmax(bad)), self.shape)))
            raise self.make_error_for_value_at(index, validate)

    def make_error_for_value_at(self, index: Index, validate: Validator) -> Exception:
        """Return the exception raised by `validate` for the value at `index`."""
        value = convert_to_python_numbers(self.values[index])
        try:
            validate(self.name, value)
        except (TypeError, ValueError) as error:
            place = f"{self.name}{list(index)} = {short_repr(value)}: " if index else ""
            return type(error)(f"{place}{error}")
        return ValueError(f"{self.name}{list(index)} = {short_repr(value)} is invalid")


def convert_to_python_numbers(value: Any) -> Any:
    """Convert a NumPy scalar to a Python number, and an array to nested tuples of numbers."""
    return tuple(map(convert_to_python_numbers, value)) if np.ndim(value) else value.item()


def validate_parameter(
    name: str, numbers: object, value: Shape = (), form: str = "", *, degrees: bool = False
) -> BatchParameter:
    """Convert an argument to a BatchParameter with finite values, each of shape `value`.

    An argument that is already a BatchParameter is returned unchanged. `form` states the expected
    form in error messages.
    """
    if isinstance(numbers, BatchParameter):
        return numbers
    description = form or (f"{value[0]} numbers" if value else "a number")
    values = as_array(
        name,
        collapse_broadcast_axes(numbers) if type(numbers) is np.ndarray else numbers,
        description,
    )
    if isinstance(numbers, np.ndarray):
        values = np.broadcast_to(values, numbers.shape)
    if value and values.shape[-len(value) :] != value:
        raise ValueError(
            f"{name} must be {description}, or an array whose last dimension has them, "
            f"not {short_repr(numbers)}"
            if len(value) == 1
            else f"{name} must be {description}, not {short_repr(numbers)}"
        )
    parameter = BatchParameter(name, values, value, degrees)
    if not np.isfinite(collapse_broadcast_axes(values)).all():
        finite = np.isfinite(values)
        trailing_axes = tuple(range(-len(value), 0))
        parameter.raise_error_of_first_bad_value(
            ~(finite.all(axis=trailing_axes) if value else finite), select_validator_by_shape(value)
        )
    return parameter


def select_validator_by_shape(value: Shape) -> Validator:
    if not value:
        return as_float
    if len(value) == 2:
        return validate_inertia_tensor
    return lambda name, numbers: as_float_list(name, numbers, value[0], f"{value[0]} numbers")


def validate_positive_parameter(name: str, numbers: object) -> BatchParameter:
    """Validate a parameter whose values must be positive."""
    parameter = validate_parameter(name, numbers)
    parameter.raise_error_of_first_bad_value(~(parameter.values > 0.0), as_positive)
    return parameter


def validate_non_negative_parameter(name: str, numbers: object) -> BatchParameter:
    """Validate a parameter whose values must not be negative."""
    parameter = validate_parameter(name, numbers)
    parameter.raise_error_of_first_bad_value(~(parameter.values >= 0.0), as_non_negative)
    return parameter


def collapse_broadcast_axes(values: Column, lead: int | None = None) -> Column:
    """Reduce broadcast dimensions, in which the stride is zero, to length 1.

    If `lead` is given, only broadcast dimensions among the first `lead` ones are reduced.
    """
    strides = values.strides[:lead]
    if 0 not in strides or not values.size:
        return values
    return values[tuple([slice(0, 1) if stride == 0 else slice(None) for stride in strides])]


def memoize_by_buffer(change: ColumnMap) -> ColumnMap:
    """Cache the results of `change`, so that arrays sharing memory are converted only once."""
    results: dict[tuple[object, ...], Column] = {}

    def change_once_per_buffer(column: Column) -> Column:
        data = column.__array_interface__["data"][0]
        key = data, column.shape, column.strides, column.dtype.str
        if key not in results:
            results[key] = change(column)
        return results[key]

    return change_once_per_buffer


def broadcast_column(values: Column, shape: Shape, trailing: int) -> Column:
    """Broadcast `values` to a batch of the given shape, as a read-only array.

    The last `trailing` dimensions of `values` are the shape of one value.
    """
    lead = values.ndim - trailing
    view = np.asarray(values).view()
    view.flags.writeable = False
    return np.broadcast_to(view, shape + view.shape[lead:])


def broadcast_named_columns(
    entries: Iterable[tuple[str, Column, int]], shape: Shape
) -> dict[str, Column]:
    """Broadcast columns, given as (name, values, trailing), to `shape`, and return them by name."""
    return {name: broadcast_column(values, shape, trailing) for name, values, trailing in entries}


def broadcast_named_shapes(names: Sequence[str], shapes: Sequence[Shape]) -> Shape:
    """Return the shape to which `shapes` broadcast; raise ValueError if they do not broadcast."""
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        pairs = zip(names, shapes, strict=True)
        listing = ", ".join([f"{name} {shape}" for name, shape in pairs if shape])
        raise ValueError(
            f"the shapes of the members cannot be broadcast together: {listing}"
        ) from None


def compute_common_parameter_shape(*words: BatchParameter) -> Shape:
    """Return the shape to which the given parameters broadcast."""
    return broadcast_named_shapes([each.name for each in words], [each.shape for each in words])


def name_varying_dimensions(
    shape: Shape, words: Iterable[BatchParameter]
) -> tuple[str | None, ...]:
    """Name each dimension after the only parameter that varies along it.

    This parameter must be a scalar that varies along no other dimension. All other dimensions have
    the name None.
    """
    if not shape:
        return ()
    parameters_by_axis: list[list[BatchParameter]] = [[] for _ in shape]
    places: dict[str, int] = {}
    for each in words:
        lead = each.values.shape[: each.values.ndim - len(each.value)]
        for position, n in enumerate(reversed(lead), 1):
            if n != 1 or shape[-position] == 1:
                parameters_by_axis[-position].append(each)
                places[each.name] = places.get(each.name, 0) + 1
    return tuple(
        [
            parameters[0].name
            if len(parameters) == 1 and not parameters[0].value and places[parameters[0].name] == 1
            else None
            for parameters in parameters_by_axis
        ]
    )


def stack_components(*components: Array) -> Array:
    """Stack components into vectors along a new last dimension."""
    return np.stack(np.broadcast_arrays(*components), axis=-1)


def split_components(values: Array) -> tuple[Array, ...]:
    """Split vectors along the last dimension, and return their components."""
    return tuple(np.moveaxis(values, -1, 0))


def compute_vectors_in_blocks(
    compute: Callable[..., tuple[Array, ...]], shape: Shape, width: int, *arrays: Array
) -> Array:
    """Compute vectors of length `width` in blocks that are small enough for the cache.

    For each array in `arrays`, `compute` receives the tuple of its vector components.
    """
    result = np.empty((*shape, width))
    rows = result if shape else result[None]
    columns = [
        np.moveaxis(np.broadcast_to(values, (*rows.shape[:-1], values.shape[-1])), -1, 0)
        for values in arrays
    ]
    step = max(1, _BLOCK // max(1, math.prod(shape[1:])))
    for begin in range(0, len(rows), step):
        block = slice(begin, begin + step)
        with np.errstate(all="ignore"):
            vectors = compute(*[tuple(values[:, block]) for values in columns])
        for k, component in enumerate(vectors):
            rows[block][..., k] = component
    result.flags.writeable = False
    return result


_IndexKey = slice | EllipsisType | None | list[Any] | npt.NDArray[Any]
_M = TypeVar("_M")
_PLACEHOLDER = np.False_  # represents each member where only shapes matter


class BatchBase(Generic[_M], metaclass=HintingType):
    """Base class of ensembles and arrays of bodies, which store their parameters as arrays.

    Each parameter is stored in an array; its first dimensions are those of the batch, and its last
    dimensions are those of a single value. Values that do not vary along a dimension are stored
    with stride zero.
    """

    shape: Shape
    _names: tuple[str | None, ...]
    _columns: Mapping[str, Column]
    _varied: Mapping[str, Column]  # the parameters that vary, as the user gave them
    _in_degrees: bool  # the unit of the angles in `_varied`

    def _set_shape_and_columns(
        self,
        shape: Shape,
        names: tuple[str | None, ...],
        columns: Mapping[str, Column],
        varied: Mapping[str, Column],
        in_degrees: bool = False,
    ) -> None:
        self.__dict__.update(shape=shape, _names=names, _columns=columns, _varied=varied)
        self.__dict__["_in_degrees"] = in_degrees

    def _select_member(self, index: Index) -> _M:
        raise NotImplementedError

    def _apply_to_columns(
        self, change: ColumnMap, shape: Shape, names: tuple[str | None, ...]
    ) -> Self:
        """Return a batch in which each parameter array (column) is replaced by `change(column)`."""
        batch, change = type(self).__new__(type(self)), memoize_by_buffer(change)
        columns = {name: change(column) for name, column in self._columns.items()}
        varied = {name: change(column) for name, column in self._varied.items()}
        batch._set_shape_and_columns(shape, names, columns, varied, self._in_degrees)
        return batch

    @property
    def _dimension_names(self) -> tuple[str, ...]:
        """The names of the dimensions of the batch.

        If exactly one parameter varies along a dimension, the dimension is named after this
        parameter. A dimension can be named only after a scalar parameter that varies along no other
        dimension. All other dimensions are named 'dim_k', where k is the index; a single dimension
        is named 'top'.
        """
        is_one_dimensional = len(self.shape) == 1
        return tuple(
            name or ("top" if is_one_dimensional else f"dim_{k}")
            for k, name in enumerate(self._names)
        )

    @property
    def coords(self) -> Mapping[str, Column]:
        """The varying parameters, as arrays that broadcast to the shape of the batch.

        An array of vectors has an additional last dimension for the components.
        """
        dims = len(self.shape)
        return MappingProxyType(
            {name: collapse_broadcast_axes(column, dims) for name, column in self._varied.items()}
        )

    def _list_varying_parameters(self) -> list[BatchParameter]:
        """Return the varying parameters."""
        return [
            BatchParameter(name, values, values.shape[len(self.shape) :])
            for name, values in self.coords.items()
        ]

    def _forget_varying_parameters(self) -> Self:
        """Clear the list of varying parameters and the names of the dimensions."""
        self.__dict__.update(_names=(None,) * len(self.shape), _varied={})
        return self

    @property
    def ndim(self) -> int:
        """The number of dimensions."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """The number of members."""
        return int(np.prod(self.shape, dtype=np.int64))

    def __len__(self) -> int:
        if not self.shape:
            raise TypeError(f"{type(self).__name__} of shape () has no length")
        return self.shape[0]

    def __iter__(self) -> Iterator[Any]:
        """Iterate over the first dimension.

        Iteration over a one-dimensional batch yields its members; iteration over any other batch
        yields batches with one dimension fewer. Raises TypeError if the batch has no dimensions.
        """
        if not self.shape:
            raise TypeError(f"{type(self).__name__} of shape () cannot be iterated")
        return (self[i] for i in range(self.shape[0]))

    @overload
    def __getitem__(self, key: _IndexKey) -> Self: ...
    @overload
    def __getitem__(self, key: object) -> Any: ...
    def __getitem__(self, key: object) -> _M | Self:
        """Return the member at an index, or the batch selected by slices, index arrays or masks."""
        if type(key) is int and len(self.shape) == 1 and -len(self) <= key < len(self):
            return self._select_member((key % len(self),))
        if not _is_basic_index(key):
            return self._select_members_by_arrays(key)
        selection: Any = _apply_index_to_column(np.broadcast_to(_PLACEHOLDER, self.shape), key)
        places = _expand_index_key(key, len(self.shape))
        if not isinstance(selection, np.ndarray):
            return self._select_member(
                tuple(operator.index(i) % n for i, n in zip(places, self.shape, strict=True))
            )
        names = iter(self._names)
        dimension_names = []
        for place in places:
            name = None if place is None else next(names)
            dimension_names += [name] if place is None or isinstance(place, slice) else []
        return self._apply_to_columns(
            lambda column: np.asarray(column[places]), selection.shape, tuple(dimension_names)
        )

    def _select_members_by_arrays(self, key: object) -> _M | Self:
        """Return the member or the batch selected by index arrays or masks."""
        order: Any = _apply_index_to_column(np.arange(self.size).reshape(self.shape), key)
        if not isinstance(order, np.ndarray):
            return self._select_member(tuple(map(int, np.unravel_index(int(order), self.shape))))
        dims = len(self.shape)
        parts = _expand_key_with_index_array(key, dims)
        if parts is None:
            return self._select_flat_members(order, (None,) * order.ndim)

        def take_from_column(column: Column) -> Column:
            small = collapse_broadcast_axes(column, dims)
            index = tuple(
                part if small.shape[k] == self.shape[k] else slice(None)
                for k, part in enumerate(parts)
            )
            return np.broadcast_to(freeze_array(small[index]), order.shape + column.shape[dims:])

        return self._apply_to_columns(take_from_column, order.shape, self._names)

    def _select_flat_members(
        self, order: npt.NDArray[np.int64], names: tuple[str | None, ...]
    ) -> Self:
        """Return the members with the indices `order` in the flattened batch (in C order)."""
        dims = len(self.shape)
        indices = np.unravel_index(order, self.shape) if dims else ()

        def gather_from_column(column: Column) -> Column:
            trailing = column.shape[dims:]
            small = collapse_broadcast_axes(column, dims)
            is_varying = [n > 1 for n in small.shape[:dims]]
            if order.size and not any(is_varying):
                return np.broadcast_to(small[(0,) * dims], order.shape + trailing)
            index = tuple(w if v else 0 * w for w, v in zip(indices, is_varying, strict=True))
            return np.broadcast_to(freeze_array(small[index]), order.shape + trailing)

        return self._apply_to_columns(gather_from_column, order.shape, names)

    def reshape(self, *shape: Any) -> Self:
        """Return a batch with the same members in C order and a new shape.

        >>> import kreisel as kr
        >>> tops = kr.scenes.thesis.vary(gravity=[1, 2, 3, 4])
        >>> tops.reshape(2, 2)[1, 0].gravity
        3.0
        """
        order = np.arange(self.size).reshape(*shape)
        return self._select_flat_members(order, (None,) * order.ndim)

    def ravel(self) -> Self:
        """Return a one-dimensional batch that contains all members in C order."""
        return self if len(self.shape) == 1 else self.reshape(-1)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        columns, other_columns = self._columns, other._columns
        return self.shape == other.shape and all(
            columns[name].shape == other_columns[name].shape
            and np.array_equal(columns[name], other_columns[name])
            for name in columns
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        varying = [_format_parameter_range(word) for word in self._list_varying_parameters()]
        dims = len(self.shape)
        varying = varying or [
            name for name, column in self._columns.items() if any(column.strides[:dims])
        ]
        return f"<{type(self).__name__} of shape {self.shape}: {', '.join(varying) or 'all equal'}>"

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for pickling, without repeated copies of broadcast values."""
        copy_column = memoize_by_buffer(
            lambda column: collapse_broadcast_axes(column, len(self.shape)).copy()
        )
        return {
            "shape": self.shape,
            "names": self._names,
            "columns": {name: copy_column(column) for name, column in self._columns.items()},
            "varied": {name: copy_column(column) for name, column in self._varied.items()},
            "in_degrees": self._in_degrees,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        shape = state["shape"]
        dims = len(shape)

        def broadcast_columns(columns: Mapping[str, Column]) -> dict[str, Column]:
            return {
                name: np.broadcast_to(column, shape + column.shape[dims:])
                for name, column in columns.items()
            }

        self._set_shape_and_columns(
            shape,
            state["names"],
            broadcast_columns(state["columns"]),
            broadcast_columns(state["varied"]),
            state["in_degrees"],
        )


def _format_parameter_range(word: BatchParameter) -> str:
    """Describe a varying parameter by its name and, for a scalar, its least and largest values."""
    if word.value or not word.values.size:
        return word.name
    return f"{word.name} {word.values.min():.6g} .. {word.values.max():.6g}"


def _apply_index_to_column(array: Column, key: Any) -> Any:
    try:
        return array[key]
    except OverflowError:
        raise IndexError(f"{short_repr(key)} is out of range") from None


def _is_basic_index(key: object) -> bool:
    """Return True if `key` contains only integers, slices, Ellipsis and None.

    Indexing a NumPy array with such a key returns a view instead of a copy.
    """
    return all(
        part is None or part is ... or isinstance(part, slice) or _is_integer_index(part)
        for part in (key if isinstance(key, tuple) else (key,))
    )


def _is_integer_index(part: object) -> bool:
    return isinstance(part, int | np.integer) and not isinstance(part, bool)


def _expand_index_key(key: object, dims: int) -> tuple[Any, ...]:
    """Replace an Ellipsis by full slices, so that the key has an entry for each dimension."""
    parts = list(key) if isinstance(key, tuple) else [key]
    index_count = sum(part is not None and part is not ... for part in parts)
    position = next((k for k, part in enumerate(parts) if part is ...), len(parts))
    return (*parts[:position], *[slice(None)] * (dims - index_count), *parts[position + 1 :])


def _expand_key_with_index_array(key: object, dims: int) -> tuple[Any, ...] | None:
    """Expand an index of slices and one array to all dimensions; return None for other indices."""
    parts = _expand_index_key(key, dims)
    arrays = [part for part in parts if not isinstance(part, slice)]
    is_one = len(parts) == dims and len(arrays) == 1 and np.ndim(arrays[0]) == 1
    return parts if is_one else None
