"""Tables of ensemble results, with units, for xarray and pandas."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .._model.scene import Ensemble
from .._options.quantities import ANGLES, QUANTITIES, TIME, QuantityDescription
from .._utils.optional import optional_dependency
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
    along = paths.tops.axes
    coordinates, variables = _build_dataset_coordinates(paths), {}
    own = paths.t.ndim > 1
    for quantity, values in rows:
        inner = _get_component_dimension_labels(quantity)
        coordinates |= {name: ((name,), words, {}) for name, words in inner.items()}
        variables[quantity.name] = (
            (*along, "time", *inner),
            np.array(values),
            _make_unit_attributes(quantity),
        )
    time = "t" if own else "time"
    where = (*along, "time") if own else ("time",)
    coordinates[time] = (where, np.array(paths.t), _make_unit_attributes(TIME))
    return xr.Dataset(variables, coordinates, _list_run_attributes(paths))


def build_reduction_dataset(reduced: EnsembleResult, kept: Reduced) -> Dataset:
    """Return a Dataset of the reductions for all tops."""
    with optional_dependency(TABLES):
        import xarray as xr
    along = reduced.tops.axes
    coordinates, variables = _build_dataset_coordinates(reduced), {}
    for name, quantity, values in _yield_reductions_with_units(kept):
        inner = _get_component_dimension_labels(quantity) if values.ndim > reduced.ndim else {}
        coordinates |= {dim: ((dim,), words, {}) for dim, words in inner.items()}
        variables[name] = ((*along, *inner), np.array(values), _make_unit_attributes(quantity))
    return xr.Dataset(variables, coordinates, _list_run_attributes(reduced))


def build_reduction_data_frame(reduced: EnsembleResult, kept: Reduced) -> DataFrame:
    """Return a DataFrame of the reductions, with one row per top."""
    with optional_dependency(TABLES):
        import pandas as pd
    columns: dict[str, Any] = {}
    units: dict[str, str] = {}
    for name, (dims, values, about) in _build_dataset_coordinates(reduced).items():
        columns[name] = list_values_per_top(reduced.tops, dims, values)
        units[name] = str(about["units"])
    for column, values, unit in yield_reduction_columns(reduced, kept):
        columns[column], units[column] = values, unit
    frame = pd.DataFrame(columns)
    frame.attrs = _list_run_attributes(reduced) | {"units": units}
    return frame


def yield_reduction_columns(
    reduced: EnsembleResult, kept: Reduced
) -> Iterator[tuple[str, Array, str]]:
    """Yield one column (name, values, unit) per component of the reductions."""
    n = len(reduced._buffers.status)
    for name, quantity, values in _yield_reductions_with_units(kept):
        kind = name.removeprefix(quantity.name)
        parts = values.reshape(n, -1)
        for i in range(parts.shape[1]):
            column = name if parts.shape[1] == 1 else quantity.components[i] + kind
            yield column, parts[:, i], quantity.dimension


def _yield_reductions_with_units(kept: Reduced) -> Iterator[tuple[str, QuantityDescription, Array]]:
    """Yield the name of each reduction, a description of its quantity, and its values."""
    for name, kinds in kept.items():
        of = QUANTITIES.get(name) or next(
            each for each in QUANTITIES.values() if name in each.components
        )
        unit = "rad" if of.name in ANGLES else of.dimension
        for kind, values in kinds.items():
            dimension = unit
            if kind.startswith("where_"):
                dimension = TIME.dimension
            elif kind == "variance" and unit:
                dimension = f"({unit})^2"
            text = f"{kind} over the times: {of.text}"
            yield f"{name}_{kind}", of._replace(name=name, dimension=dimension, text=text), values


def _get_component_dimension_labels(quantity: QuantityDescription) -> dict[str, list[str]]:
    """Return the names of a quantity's component dimensions, together with their labels."""
    own = {f"{quantity.name}_component": quantity.components}
    return DIMENSIONS.get(quantity.shape, own)


def _make_unit_attributes(quantity: QuantityDescription) -> dict[str, object]:
    return {"units": quantity.dimension, "long_name": quantity.text}


def _list_run_attributes(of: EnsembleResult) -> dict[str, object]:
    values = {"method": of.method, "step": of.step, "tol": of.tol, "digits": of.digits}
    return {name: value for name, value in values.items() if value is not None}


def _build_dataset_coordinates(of: EnsembleResult) -> dict[str, Variable]:
    """Return a variable for each varying parameter, and the variables `status` and `reached`."""
    axes, rows = of.tops.axes, build_parameter_variables(of.tops)
    codes: dict[str, object] = {"units": "", "long_name": "0 if the run succeeded"}
    rows["status"] = (axes, np.array(of.status), codes)
    about: dict[str, object] = {
        "units": TIME.dimension,
        "long_name": "the time of the last valid state",
    }
    rows["reached"] = (axes, np.array(of.reached), about)
    return rows


def build_parameter_variables(tops: Ensemble) -> dict[str, Variable]:
    """Return one variable for each parameter that varies."""
    axes = tops.axes
    rows: dict[str, Variable] = {}
    for word, values in tops.coords.items():
        shape = np.shape(values)[: tops.ndim]
        inner = np.shape(values)[tops.ndim :]
        at = [d for d, n in enumerate(shape) if n > 1 or tops.shape[d] == 1]
        dims = tuple(axes[d] for d in at)
        if word in axes and dims != (word,):
            continue  # in xarray, a variable named like a dimension must have only this dimension
        kept = np.array(values).reshape([shape[d] for d in at] + list(inner))
        own = tuple(f"{word}_component" for _ in inner)
        rows[word] = ((*dims, *own), kept, {"units": ""})
    return rows


def list_values_per_top(tops: Ensemble, dims: tuple[str, ...], values: Any) -> Any:
    """Broadcast values to the ensemble's shape, and return a list with one value per top.

    Vector values are returned as tuples.
    """
    axes = tops.axes
    own = [d for d in dims if d not in axes]
    shape = [n if axis in dims else 1 for axis, n in zip(axes, tops.shape, strict=True)]
    inner = values.shape[len(dims) - len(own) :]
    over = np.broadcast_to(values.reshape(*shape, *inner), (*tops.shape, *inner))
    flat = over.reshape(tops.size, *inner)
    return list(map(tuple, flat.tolist())) if inner else flat
