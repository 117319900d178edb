"""Charts of fits: measurements, the fitted motion, and residuals in a lower panel."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from .._utils.optional import optional_dependency
from .._utils.validation import Array
from .charts import FigureAxes
from .panels import format_time_axis_label
from .solids import BLUE, ORANGE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

with optional_dependency("'kreisel[plot]'"):
    from matplotlib.figure import Figure

_COLOURS = (BLUE, ORANGE, "#5a9e6f")
_WIDTH, _HEIGHT = 4.5, 4.5  # size of a column of two charts [inches]


class PlottableFitSeries(Protocol):
    """The measurements of one quantity, and the residuals of the fit.

    values and residuals have the shapes (n, j) and (n, k), where j > k for attitudes, and are NaN
    where nothing was measured. sigma broadcasts to the residuals. motion has times and values of
    the fitted motion that a line joins, or is None.
    """

    @property
    def name(self) -> str: ...
    @property
    def t(self) -> Array: ...
    @property
    def values(self) -> Array: ...
    @property
    def residuals(self) -> Array: ...
    @property
    def sigma(self) -> Array: ...
    @property
    def motion(self) -> tuple[Array, Array] | None: ...


def plot_fit_panels(panels: list[PlottableFitSeries]) -> FigureAxes:
    """Draw two charts per panel: one of measurements and fitted motion, and one of residuals."""
    figure = Figure(figsize=(_WIDTH * len(panels), _HEIGHT), layout="constrained")
    axes: list[Axes] = []
    grid = figure.subplots(2, len(panels), sharex="col", squeeze=False, height_ratios=(2.0, 1.0))
    for (upper, lower), panel in zip(grid.T, panels, strict=True):
        for chart, columns in (upper, panel.values), (lower, panel.residuals):
            for k in range(columns.shape[1]):
                colour = _COLOURS[k % len(_COLOURS)]
                chart.plot(panel.t, columns[:, k], ".", ms=3, color=colour)
        if panel.motion is not None:
            t, motion = panel.motion
            for k in range(motion.shape[1]):
                upper.plot(t, motion[:, k], color="black", lw=0.8)
        elif panel.values.shape == panel.residuals.shape:
            upper.plot(panel.t, panel.values + panel.residuals * panel.sigma, "k.", ms=1.5)
        upper.set_title(panel.name)
        lower.axhline(0.0, color="black", lw=0.8)
        lower.set_xlabel(format_time_axis_label("T"))
        lower.set_ylabel("residual [sigma]")
        axes += [upper, lower]
    return FigureAxes(axes)
