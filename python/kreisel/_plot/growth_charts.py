"""Charts of chaos indicators: curves over time, and maps over two parameters."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from .._model.scene import Ensemble
from .._utils.optional import optional_dependency
from .._utils.validation import Array
from .panels import (
    CLASSES,
    apply_chart_style,
    create_axes_in_new_figure,
    format_axis_label,
    format_time_axis_label,
)
from .solids import FAINT, validate_axes_type

with optional_dependency("'kreisel[plot]'"):
    from matplotlib.axes import Axes
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_NAMES = {"lyapunov": ("largest exponent", "T^-1"), "megno": ("MEGNO", ""), "oli": ("OLI", "")}
_LOWEST = {"megno": 0.1, "oli": 0.1}  # values below are left out of the logarithmic scale
_CHAOTIC, _DOUBTFUL = 1, 2  # indices of CLASSES


class IndicatorWithClasses(Protocol):
    """The values of a chaos indicator and the classification of each top."""

    @property
    def name(self) -> str: ...
    @property
    def t(self) -> Array: ...
    @property
    def curve(self) -> Array: ...
    @property
    def value(self) -> Array | float: ...
    @property
    def threshold(self) -> float: ...
    @property
    def is_chaotic(self) -> npt.NDArray[np.bool_] | bool: ...
    @property
    def is_doubtful(self) -> npt.NDArray[np.bool_] | bool: ...


def classify_tops_by_chaos(indicator: IndicatorWithClasses) -> npt.NDArray[np.int8]:
    """Return the class of each top: 0 if it is regular, 1 if it is chaotic, and 2 if uncertain."""
    classes = np.where(np.ravel(indicator.is_chaotic), _CHAOTIC, 0).astype(np.int8)
    classes[np.ravel(indicator.is_doubtful)] = _DOUBTFUL
    return classes


def draw_indicator_curves(indicator: IndicatorWithClasses, axes: Axes | None, unit: str) -> Axes:
    """Plot a chaos indicator over time, in colours for regular, chaotic and uncertain tops."""
    chart = create_axes_in_new_figure() if axes is None else validate_axes_type(axes)
    curves = indicator.curve.reshape(-1, indicator.t.size)
    lowest, classes = _LOWEST.get(indicator.name, 0.0), classify_tops_by_chaos(indicator)
    visible = np.where(curves > lowest, curves, np.nan)
    marker = "o" if indicator.t.size == 1 else ""
    for k in np.unique(classes):
        chart.plot(
            np.abs(indicator.t), visible[classes == k].T, color=CLASSES[k][1], marker=marker,
            linewidth=1.4 if len(curves) == 1 else 0.8, zorder=2.0 + 0.1 * float(k),
            alpha=max(0.15, min(1.0, 20.0 / len(curves))),
        )  # fmt: skip
    marks = _make_legend_entry_per_class(classes)
    if indicator.name == "megno":
        chart.axhline(indicator.threshold, color=FAINT, linewidth=0.9, linestyle="--", zorder=1)
        marks.append(Line2D([], [], color=FAINT, linewidth=0.9, linestyle="--", label="threshold"))
    chart.legend(handles=marks, fontsize=8, frameon=False)
    chart.set(xscale="log", yscale="log")
    chart.set(
        xlabel=format_time_axis_label(unit), ylabel=format_axis_label(*_NAMES[indicator.name], unit)
    )
    if indicator.t[-1] < 0.0:
        chart.set_xlabel(f"{format_time_axis_label(unit)}, back from the start")
    apply_chart_style(chart)
    return chart


def _make_legend_entry_per_class(classes: npt.NDArray[np.int8]) -> list[Line2D]:
    """Return a legend entry for each class of tops that occurs."""
    numbers, counts = np.unique(classes, return_counts=True)
    marks = []
    for k, n in zip(numbers, counts, strict=True):
        name, colour = CLASSES[k]
        label = name if len(classes) == 1 else f"{name} ({n})"
        marks.append(Line2D([], [], color=colour, linewidth=2.0, label=label))
    return marks


def draw_chaos_indicator_map(
    indicator: IndicatorWithClasses, tops: Ensemble, axes: Axes | None, unit: str
) -> Axes:
    """Plot the final values of an indicator over two parameters; dots mark borderline cases."""
    chart = create_axes_in_new_figure() if axes is None else validate_axes_type(axes)
    values = indicator.curve[..., -1]
    (y_name, y), (x_name, x) = (_get_varied_axis_name_and_values(tops, d) for d in (0, 1))
    scale: Normalize = Normalize()
    if indicator.name != "lyapunov":
        largest = float(np.max(values, where=np.isfinite(values), initial=10.0))
        scale = LogNorm(1.0, largest)
        values = np.maximum(values, 1.0)
    field = chart.pcolormesh(x, y, values, cmap="cividis", norm=scale, rasterized=True)
    doubtful = np.asarray(indicator.is_doubtful)
    if doubtful.any():
        rows, columns = np.nonzero(doubtful)
        chart.plot(
            x[columns], y[rows], ".", color="white", markersize=1.5,
            markeredgewidth=0.0,
        )  # fmt: skip
        chart.set_title("dots: classification in doubt", fontsize=9)
    chart.set(xlabel=x_name, ylabel=y_name)
    apply_chart_style(chart)
    chart.grid(visible=False)
    figure = chart.get_figure()
    assert isinstance(figure, Figure)
    end = f"t = {indicator.t[-1]:g}"
    figure.colorbar(
        field, ax=chart, label=f"{format_axis_label(*_NAMES[indicator.name], unit)}, {end}"
    )
    return chart


def _get_varied_axis_name_and_values(tops: Ensemble, dimension: int) -> tuple[str, Array]:
    """Return the name of a dimension, and its monotonic parameter values or else its indices."""
    name, n = tops.axes[dimension], tops.shape[dimension]
    values: Any = tops.coords.get(name)
    if values is not None and np.size(values) == n:
        flat = np.ravel(values).astype(np.float64)
        steps = np.diff(flat)
        if (steps > 0.0).all() or (steps < 0.0).all():
            return name.replace("_", " "), flat
    return name.replace("_", " "), np.arange(n, dtype=np.float64)
