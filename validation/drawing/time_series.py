"""Plots of error against time, with a colour for each kind of method."""

import numpy as np

from .style import (
    COLOURS,
    MARKERS,
    STYLE,
    figure_to_svg,
    label_ends,
    make_panel,
    plt,
    set_power_ticks,
)

LEAST = 1e-17  # value drawn for an error of zero


def choose_colours(kinds):
    """Assign a colour to each kind of method."""
    return dict(zip(dict.fromkeys(kinds), COLOURS, strict=False))


def draw_time_series(lines, quantity, label, colours):
    """Plot a quantity against time, with one line for each run."""
    with plt.rc_context(STYLE):
        figure, axes = make_panel(4.2)
        styles = {
            kind: {"color": colour, "marker": marker}
            for (kind, colour), marker in zip(colours.items(), MARKERS, strict=False)
        }
        long_lines = [line for line in lines if len(line["t"]) > 1]
        for line in long_lines:
            axes.semilogy(
                line["t"][1:],
                np.maximum(line[quantity][1:], LEAST),
                **styles[line["kind"]],
                markersize=4,
                markevery=max(1, len(line["t"]) // 5),
                linewidth=1.2,
            )
        axes.set(xlabel="time; one turn of the precession is 2 pi", ylabel=label)
        axes.set_ylim(LEAST, 10)
        set_power_ticks(axes.yaxis, 9)
        axes.grid(True)
        ends = [(line["t"][-1], max(line[quantity][-1], LEAST)) for line in long_lines]
        label_ends(
            axes,
            [
                (line["method"], end, styles[line["kind"]])
                for line, end in zip(long_lines, ends, strict=True)
            ],
        )
        return figure_to_svg(figure)
