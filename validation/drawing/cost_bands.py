"""Figures of the run time over the error: the median of many starts, with a band of quantiles."""

import numpy as np

from .style import (
    STYLE,
    choose_line_styles,
    figure_to_svg,
    label_ends,
    make_panel,
    plt,
    set_power_ticks,
)


def draw_cost_bands(bands, label):
    """Draw a line with a band for each program.

    `bands` is {title: (errors, median, lower and upper quantiles)}. A line ends where the upper
    quantile is infinite.
    """
    with plt.rc_context(STYLE):
        figure, axes = make_panel(3.5, 6.0)
        ends, styles = [], choose_line_styles(list(bands), ())
        for title, band in bands.items():
            errors, middle, low, high = map(np.array, band)
            known = np.isfinite(high)
            if not known.any():
                continue
            style = styles[title]
            fill = {"color": style["color"], "alpha": 0.2, "linewidth": 0}
            axes.fill_between(errors[known], low[known], high[known], **fill)
            axes.loglog(errors[known], middle[known], markersize=5, markevery=2, **style)
            ends.append((title, (errors[known][-1], middle[known][-1]), style))
        axes.set(xlabel=label, ylabel="run time [ms]")
        axes.invert_xaxis()
        set_power_ticks(axes.xaxis, 7)
        set_power_ticks(axes.yaxis, 9)
        axes.grid(True)
        label_ends(axes, ends)
        return figure_to_svg(figure)
