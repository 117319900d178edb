"""Elements shared by all charts: new axes, styles and colours."""

from __future__ import annotations

from .._utils.optional import optional_dependency

with optional_dependency("'kreisel[plot]'"):
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

# Classes of tops and their colours, which deuteranopes tell apart by hue and by lightness.
CLASSES = (("regular", "#1f5fb5"), ("chaotic", "#f0810f"), ("in doubt", "#a0a0a0"))

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def create_axes_in_new_figure(width: float = 6.0, height: float = 4.0) -> Axes:
    """Create a figure of the given size [in], and return its axes."""
    return Figure(figsize=(width, height), layout="constrained").add_subplot()


def apply_chart_style(chart: Axes) -> None:
    """Set the grid, frame, ticks and font sizes of a chart."""
    chart.grid(True, alpha=0.25, linewidth=0.6)
    chart.spines[["top", "right"]].set_visible(False)
    chart.tick_params(labelsize=8, length=3)
    chart.tick_params(which="minor", labelsize=7)
    if chart.get_yscale() != "log":
        chart.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    if chart.get_xscale() != "log":
        chart.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    chart.xaxis.label.set_fontsize(9)
    chart.yaxis.label.set_fontsize(9)
    chart.margins(x=0.01)


def format_axis_label(name: str, dimension: str, time_unit: str) -> str:
    """Return the label of an axis: a name and, if there is one, a unit such as M L^2 T^-1.

    The letter T in `dimension` is replaced by the unit of time, and deg by the sign of degrees.
    """
    if not dimension:
        return name
    parts = [
        base.replace("T", time_unit).replace("deg", "°") + power.translate(_SUPERSCRIPTS)
        for base, _, power in (factor.partition("^") for factor in dimension.split())
    ]
    return f"{name} [{' '.join(parts)}]"


def format_time_axis_label(unit: str) -> str:
    """Return the label of a time axis."""
    return format_axis_label("time", "T", unit)
