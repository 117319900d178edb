"""Named curves: errors against cost or time, distributions of errors, and bands of run times."""

import numpy as np

from .style import FAINT, as_svg, choose_line_styles, label_ends, plt, set_power_ticks

GREY = {"color": FAINT, "linewidth": 0.8, "alpha": 0.45}
LEFT, RIGHT, TOP, BELOW = 0.72, 1.5, 0.25, 0.5  # margins; labels are on the right [inch]


def lowest_point(points):
    """Return the point of a curve at which y is smallest."""
    return min(zip(*points, strict=True), key=lambda point: point[1])


def last_point(points):
    x, y = points
    return x[-1], y[-1]


def mark_floor(axes, floor):
    axes.axhline(floor, color=FAINT, linewidth=0.8)
    axes.annotate(
        "one rounding of the data",
        (0, floor),
        xycoords=("axes fraction", "data"),
        xytext=(3, 0),
        textcoords="offset points",
        va="top",
        color=FAINT,
    )


@as_svg
def draw_curves(
    lines, styles, find_end=lowest_point, size=(4.9, 3.1), floor=None, ticks=(8, 9), **properties
):
    """Draw curves in given styles, with their names on the right, and all other curves in grey.

    `lines` maps each name to coordinates x and y. `find_end` returns the point of a curve to which
    its name is connected. `properties` are those of the axes, which are logarithmic by default.
    """
    width, height = size
    figure = plt.figure(figsize=size)
    inner = (width - LEFT - RIGHT) / width, (height - 0.1 - BELOW) / height
    axes = figure.add_axes((LEFT / width, BELOW / height, *inner))
    axes.set(**{"xscale": "log", "yscale": "log"} | properties)
    for name, (x, y) in lines.items():
        if name not in styles:
            axes.plot(x, y, marker="o" if len(x) == 1 else None, **GREY)
    shown = {name: style for name, style in styles.items() if name in lines}
    # Wider lines first, so that none is hidden by another with the same values.
    widths = np.linspace(2.6, 1.2, len(shown)) if len(shown) > 1 else [1.4]
    for wide, (name, style) in zip(widths, shown.items(), strict=True):
        x, y = lines[name]
        strokes = {"linewidth": wide, "markersize": 2.5 + wide}
        axes.plot(x, y, markevery=max(1, len(x) // 15), **strokes, **style)
    if floor:
        mark_floor(axes, floor)
    for axis, count in zip((axes.xaxis, axes.yaxis), ticks, strict=True):
        if axis.get_scale() == "log":
            set_power_ticks(axis, count)
    axes.grid(True)
    label_ends(axes, [(name, find_end(lines[name]), style) for name, style in shown.items()])
    return figure


def keep_finite(band):
    """Return the columns of a band where its upper limit is finite."""
    return [np.array(column)[np.isfinite(band[-1])] for column in band]


@as_svg
def draw_bands(panels, own, label, width=6.0, panel=2.0, gap=0.6):
    """Draw one panel per group of initial states, with a line and a band for each integrator.

    `panels` maps titles to curves, and each curve to its errors, and to the medians, lower limits
    and upper limits of its run times. A line ends at the smallest error that the integrator reaches
    for most initial states.
    """
    height = TOP + len(panels) * (panel + gap) - gap + BELOW
    figure, first = plt.figure(figsize=(width, height)), None
    for i, (title, bands) in enumerate(panels.items()):
        bottom = 1 - (TOP + i * (panel + gap) + panel) / height
        place = (LEFT / width, bottom, 1 - (LEFT + RIGHT) / width, panel / height)
        axes = figure.add_axes(place, sharex=first, sharey=first)
        axes.set_title(title, loc="left")
        axes.set(xscale="log", yscale="log", ylabel=label)
        first = first or axes
        styles = choose_line_styles([own], [name for name in bands if name != own])
        for name, band in bands.items():
            errors, middle, low, high = keep_finite(band)
            fill = {"color": styles[name]["color"], "alpha": 0.25 if name == own else 0.1}
            axes.fill_betweenx(errors, low, high, linewidth=0, **fill)
            axes.plot(middle, errors, markevery=2, **styles[name])
    for axes, bands in zip(figure.axes, panels.values(), strict=True):
        set_power_ticks(axes.xaxis, 7)
        set_power_ticks(axes.yaxis, 7)
        axes.grid(True)
        curves = {name: keep_finite(band)[1::-1] for name, band in bands.items()}
        ends = [(n, last_point(c), styles[n]) for n, c in curves.items() if len(c[0])]
        label_ends(axes, ends)
    figure.axes[-1].set_xlabel("run time [ms]")
    return figure
