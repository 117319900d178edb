"""Conversion of chaos indicators to pandas and xarray."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .._model.scene import Ensemble
from .._options.quantities import TIME
from .._utils.optional import optional_dependency
from .ensemble_tables import Variable, build_parameter_variables, list_values_per_top
from .tables import TABLES

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

    from .._plot.growth_charts import IndicatorWithClasses


_UNITS = {"lyapunov": "T^-1", "megno": "", "oli": ""}
_TEXTS = {
    "final_megno": "MEGNO at the last time",
    "is_chaotic": "True if MEGNO at the last time exceeds the threshold",
    "doubt": "the reason why the classification is in doubt, or empty",
    "certificate": "estimate of the largest relative error of the tangent",
    "turns": "the last time in slow turns of the top",
    "status": "OK, or the name of the failure",
}


def build_indicator_data_frame(indicator: IndicatorWithClasses, tops: Ensemble | None) -> DataFrame:
    """Return a DataFrame with one row per top."""
    with optional_dependency(TABLES):
        import pandas as pd
    columns: dict[str, Any] = {}
    units: dict[str, str] = {}
    if tops is not None:
        for name, (dims, values, attributes) in build_parameter_variables(tops).items():
            columns[name] = list_values_per_top(tops, dims, values)
            units[name] = str(attributes["units"])
    columns[indicator.name] = np.atleast_1d(indicator.value).ravel()
    for name in _TEXTS:
        columns[name] = np.ravel(getattr(indicator, name))
    units |= {indicator.name: _UNITS[indicator.name], **dict.fromkeys(_TEXTS, "")}
    frame = pd.DataFrame(columns)
    frame.attrs = _make_indicator_table_attributes(indicator) | {
        "t": float(indicator.t[-1]),
        "units": units,
    }
    return frame


def build_indicator_dataset(indicator: IndicatorWithClasses, tops: Ensemble | None) -> Dataset:
    """Return a Dataset that contains each top's indicator over time and its classification."""
    with optional_dependency(TABLES):
        import xarray as xr
    axes = () if tops is None else tops.axes
    variables: dict[str, Variable] = {} if tops is None else build_parameter_variables(tops)
    coordinates = set(variables) | {"time"}
    attributes: dict[str, object] = {"units": TIME.dimension, "long_name": TIME.text}
    variables["time"] = ("time",), np.array(indicator.t), attributes
    value_attributes: dict[str, object] = {
        "units": _UNITS[indicator.name],
        "long_name": indicator.name,
    }
    variables[indicator.name] = (*axes, "time"), np.array(indicator.curve), value_attributes
    for name, text in _TEXTS.items():
        attributes = {"units": "", "long_name": text}
        variables[name] = axes, np.array(getattr(indicator, name)), attributes
    return xr.Dataset(variables, attrs=_make_indicator_table_attributes(indicator)).set_coords(
        coordinates
    )


def _make_indicator_table_attributes(indicator: IndicatorWithClasses) -> dict[str, object]:
    return {"indicator": indicator.name, "threshold": indicator.threshold}
