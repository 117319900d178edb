"""Plots of run time against error, with medians and quantiles over many initial states."""

import numpy as np

from .style import (
    STYLE,
    choose_line_styles,
    figure_to_svg,
    label_ends,
    plt,
    set_power_ticks,
)

WIDTH, LEFT, RIGHT, TOP, BELOW, PANEL, GAP = 6.0, 0.72, 1.5, 0.25, 0.5, 2.0, 0.35  # [inch]


def draw_cost_bands(panels, own, label):
    """Draw one panel per group of initial states, with a line and a band for each integrator.

    `panels` maps the title of each panel to the data of its curves. The line of each integrator
    ends at the smallest error that it reaches for most initial states. The line of the integrator
    `own` is drawn in colour, and the other lines have the colour of the text.
    """
    height = TOP + len(panels) * (PANEL + GAP) - GAP + BELOW
    with plt.rc_context(STYLE):
        figure, first_axes = plt.figure(figsize=(WIDTH, height)), None
        for i, (title, bands) in enumerate(panels.items()):
            low = 1 - (TOP + i * (PANEL + GAP) + PANEL) / height
            place = (LEFT / WIDTH, low, 1 - (LEFT + RIGHT) / WIDTH, PANEL / height)
            axes = figure.add_axes(place, sharex=first_axes, sharey=first_axes)
            axes.set_title(title, loc="left")
            axes.set_ylabel("run time [ms]")
            if first_axes is None:
                axes.invert_xaxis()
            first_axes = first_axes or axes
            draw_bands(axes, bands, own)
        axes.set_xlabel(label)
        for axes in figure.axes:
            set_power_ticks(axes.xaxis, 7)
            set_power_ticks(axes.yaxis, 7)
            axes.grid(True)
            axes.tick_params(labelbottom=axes is figure.axes[-1])
        for axes, bands in zip(figure.axes, panels.values(), strict=True):
            label_ends(axes, find_ends(bands, own))
        return figure_to_svg(figure)


def draw_bands(axes, bands, own):
    styles = choose_line_styles([own], [name for name in bands if name != own])
    for title, band in bands.items():
        errors, middle, low, high = map(np.array, band)
        is_finite = np.isfinite(high)
        if is_finite.any():
            style = styles[title]
            fill = {"color": style["color"], "alpha": 0.25 if title == own else 0.1}
            axes.fill_between(
                errors[is_finite], low[is_finite], high[is_finite], linewidth=0, **fill
            )
            axes.loglog(errors[is_finite], middle[is_finite], markersize=4, markevery=2, **style)


def find_ends(bands, own):
    """Return the name, end point and style of each curve that contains finite values."""
    styles = choose_line_styles([own], [name for name in bands if name != own])
    ends = []
    for title, (errors, middle, _, high) in bands.items():
        indices = np.flatnonzero(np.isfinite(high))
        if len(indices):
            ends.append((title, (errors[indices[-1]], middle[indices[-1]]), styles[title]))
    return ends
