"""Tables of ensemble results, with units, for xarray and pandas."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .._model.scene import Ensemble
from .._options.quantities import QUANTITIES, TIME, QuantityDescription
from .._utils.optional import optional_dependency
from .._utils.units import get_parameter_unit
from .._utils.validation import Array
from .ensemble_result import EnsembleResult
from .tables import DIMENSIONS, TABLES, QuantityRows

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

Reduced = Mapping[str, Mapping[str, Array]]  # {name of a quantity: {kind of reduction: values}}
Variable = tuple[tuple[str, ...], Any, dict[str, object]]


def build_state_dataset(paths: EnsembleResult, rows: QuantityRows) -> Dataset:
    """Build a Dataset from quantities at all states of an ensemble."""
    with optional_dependency(TABLES):
        import xarray as xr
    names = _name_parameters_apart_from_quantities(paths.tops, rows)
    axes, variables = tuple(names.get(axis, axis) for axis in paths.tops.axes), {}
    coordinates: dict[str, Variable] = {
        names.get(name, name): (tuple(names.get(dim, dim) for dim in dims), values, attributes)
        for name, (dims, values, attributes) in _build_dataset_coordinates(paths).items()
    }
    has_own_times = paths.t.ndim > 1
    for quantity, values in rows:
        inner = _get_component_dimension_labels(quantity)
        coordinates |= {name: ((name,), words, {}) for name, words in inner.items()}
        variables[quantity.name] = (
            (*axes, "time", *inner),
            np.array(values),
            _make_unit_attributes(quantity),
        )
    time = "t" if has_own_times else "time"
    dimensions = (*axes, "time") if has_own_times else ("time",)
    coordinates[time] = (dimensions, np.array(paths.t), _make_unit_attributes(TIME))
    return xr.Dataset(variables, coordinates, _list_run_attributes(paths))


def _name_parameters_apart_from_quantities(tops: Ensemble, rows: QuantityRows) -> dict[str, str]:
    """Return other names for those parameters and dimensions that are also names of quantities.

    In xarray, a variable with the name of a dimension must have only this dimension.
    """
    quantity_names = {quantity.name for quantity, _ in rows}
    return {name: f"{name}_given" for name in (*tops.axes, *tops.coords) if name in quantity_names}


def build_reduction_dataset(result: EnsembleResult, reductions: Reduced) -> Dataset:
    """Return a Dataset of the reductions for all tops."""
    with optional_dependency(TABLES):
        import xarray as xr
    axes = result.tops.axes
    coordinates, variables = _build_dataset_coordinates(result), {}
    for name, quantity, values in _yield_reductions_with_units(reductions):
        inner = _get_component_dimension_labels(quantity) if values.ndim > result.ndim else {}
        coordinates |= {dim: ((dim,), words, {}) for dim, words in inner.items()}
        variables[name] = ((*axes, *inner), np.array(values), _make_unit_attributes(quantity))
    return xr.Dataset(variables, coordinates, _list_run_attributes(result))


def build_reduction_data_frame(result: EnsembleResult, reductions: Reduced) -> DataFrame:
    """Return a DataFrame of the reductions, with one row per top."""
    with optional_dependency(TABLES):
        import pandas as pd
    columns: dict[str, Any] = {}
    units: dict[str, str] = {}
    for name, (dims, values, attributes) in _build_dataset_coordinates(result).items():
        columns[name] = list_values_per_top(result.tops, dims, values)
        units[name] = str(attributes["units"])
    for column, values, unit in yield_reduction_columns(result, reductions):
        columns[column], units[column] = values, unit
    frame = pd.DataFrame(columns)
    frame.attrs = _list_run_attributes(result) | {"units": units}
    return frame


def yield_reduction_columns(
    result: EnsembleResult, reductions: Reduced
) -> Iterator[tuple[str, Array, str]]:
    """Yield a column (name, values, unit) for each component of each reduction."""
    n = len(result._buffers.status)
    for name, quantity, values in _yield_reductions_with_units(reductions):
        kind = name.removeprefix(quantity.name)
        parts = values.reshape(n, -1)
        for i in range(parts.shape[1]):
            column = name if parts.shape[1] == 1 else quantity.components[i] + kind
            yield column, parts[:, i], quantity.dimension


def _yield_reductions_with_units(
    reductions: Reduced,
) -> Iterator[tuple[str, QuantityDescription, Array]]:
    """Yield the name of each statistic, a description of its quantity, and its values."""
    for name, kinds in reductions.items():
        quantity = QUANTITIES.get(name) or next(
            each for each in QUANTITIES.values() if name in each.components
        )
        for kind, values in kinds.items():
            dimension = unit = quantity.dimension
            if kind.startswith("where_"):
                dimension = TIME.dimension
            elif kind == "variance" and unit:
                dimension = f"({unit})^2"
            text = f"{kind} over the times: {quantity.text}"
            yield (
                f"{name}_{kind}",
                quantity._replace(name=name, dimension=dimension, text=text),
                values,
            )


def _get_component_dimension_labels(quantity: QuantityDescription) -> dict[str, list[str]]:
    """Return the names of the dimensions of a vector or matrix quantity, and their labels."""
    labels = {f"{quantity.name}_component": quantity.components}
    return DIMENSIONS.get(quantity.shape, labels)


def _make_unit_attributes(quantity: QuantityDescription) -> dict[str, object]:
    return {"units": quantity.dimension, "long_name": quantity.text}


def _list_run_attributes(result: EnsembleResult) -> dict[str, object]:
    values = {
        "method": result.method,
        "step": result.step,
        "tol": result.tol,
        "digits": result.digits,
    }
    return {name: value for name, value in values.items() if value is not None}


def _build_dataset_coordinates(result: EnsembleResult) -> dict[str, Variable]:
    """Return xarray variables for all parameters that vary, for `status` and for `reached`."""
    axes, rows = result.tops.axes, build_parameter_variables(result.tops)
    codes: dict[str, object] = {"units": "", "long_name": "0 if the run succeeded"}
    rows["status"] = (axes, np.array(result.status), codes)
    attributes: dict[str, object] = {
        "units": TIME.dimension,
        "long_name": "the time of the last valid state",
    }
    rows["reached"] = (axes, np.array(result.reached), attributes)
    return rows


def build_parameter_variables(tops: Ensemble) -> dict[str, Variable]:
    """Return one xarray variable for each parameter that varies between tops."""
    axes = tops.axes
    rows: dict[str, Variable] = {}
    for word, values in tops.coords.items():
        shape = np.shape(values)[: tops.ndim]
        inner = np.shape(values)[tops.ndim :]
        dimensions = [d for d, n in enumerate(shape) if n > 1 or tops.shape[d] == 1]
        dims = tuple(axes[d] for d in dimensions)
        if word in axes and dims != (word,):
            continue  # in xarray, a variable named like a dimension must have only this dimension
        array = np.array(values).reshape([shape[d] for d in dimensions] + list(inner))
        inner_dims = tuple(f"{word}_component" for _ in inner)
        unit = get_parameter_unit(word, tops._in_degrees)
        rows[word] = ((*dims, *inner_dims), array, {"units": unit})
    return rows


def list_values_per_top(tops: Ensemble, dims: tuple[str, ...], values: Any) -> Any:
    """Broadcast values to the ensemble's shape, and return a list with one value per top.

    Vector values are returned as tuples.
    """
    axes = tops.axes
    inner_dims = [d for d in dims if d not in axes]
    shape = [n if axis in dims else 1 for axis, n in zip(axes, tops.shape, strict=True)]
    inner = values.shape[len(dims) - len(inner_dims) :]
    table = np.broadcast_to(values.reshape(*shape, *inner), (*tops.shape, *inner))
    flat = table.reshape(tops.size, *inner)
    return list(map(tuple, flat.tolist())) if inner else flat
