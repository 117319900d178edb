"""A scatter plot of a Poincaré section, with one point per state."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._utils.optional import optional_dependency
from .._utils.validation import Array
from .panels import CLASSES, apply_chart_style, create_axes_in_new_figure
from .solids import validate_axes_type

with optional_dependency("'kreisel[plot]'"):
    import matplotlib
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

_INK = 12000.0  # sum of the areas of all points [pt^2], within the limits below
_SMALLEST, _LARGEST = 0.35, 9.0  # area of a point [pt^2]
_DARKEST, _BRIGHTEST = 0.05, 0.85  # part of the colour map that is visible on white


def draw_section_points(
    axes: Axes | None,
    points: tuple[Array, Array],
    labels: tuple[str, str],
    top: npt.NDArray[np.int64],
    classes: npt.NDArray[np.int8] | None,
) -> Axes:
    """Draw the points of a Poincaré section, and return the axes.

    points   the coordinates (e,) across and upwards
    top      (e,) the index of the top of each point
    classes  for each top, the index of its class in CLASSES; None: a colour for each top
    """
    chart = create_axes_in_new_figure(5.2, 4.4) if axes is None else validate_axes_type(axes)
    x, y = points
    size = float(np.clip(_INK / max(len(x), 1), _SMALLEST, _LARGEST))
    if classes is None:
        most = max(int(top.max(initial=0)), 1)
        part = _DARKEST + (_BRIGHTEST - _DARKEST) * top / most
        colours = matplotlib.colormaps["viridis"](part)
    else:
        palette = np.array([matplotlib.colors.to_rgba(colour) for _, colour in CLASSES])
        colours = palette[classes[top]]
        marks = [
            Line2D([], [], color=colour, marker="o", markersize=4, linestyle="", label=name)
            for k, (name, colour) in enumerate(CLASSES)
            if (classes == k).any()
        ]
        chart.legend(
            handles=marks, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=8,
            frameon=False,
        )  # fmt: skip
    chart.scatter(x, y, c=colours, s=size, linewidths=0, rasterized=True)
    chart.set(xlabel=labels[0], ylabel=labels[1])
    apply_chart_style(chart)
    chart.grid(visible=False)
    return chart
