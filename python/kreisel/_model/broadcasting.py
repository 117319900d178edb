"""Broadcasting of parameters to the shape of an ensemble.

A column is an array whose shape is that of the ensemble, followed by that of one value, such as ()
or (3,). Along a dimension to which a value is broadcast, the stride is zero, so the value is stored
only once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._utils.units import convert_parameter_to_radians
from .._utils.validation import (
    Array,
    as_array,
    as_float,
    as_float_list,
    as_non_negative,
    as_positive,
    short_repr,
)
from .inertia import validate_inertia_tensor

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
