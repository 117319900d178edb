"""Stacked bar charts that show how often each method received each verdict."""

import numpy as np

from .style import STYLE, figure_to_svg, plt

# Okabe and Ito's palette, which readers with any colour vision tell apart, and greys
COLOURS = ("#0072b2", "#56b4e9", "#f0e442", "#d55e00", "#999999", "#d9d9d9", "#000000")
ROW, WIDTH, NAMES, TOP, BELOW = 0.175, 8.6, 1.45, 0.35, 0.45  # [inch]


def draw_verdict_bars(counts, verdicts):
    """Draw a stacked bar for each method, showing how often each verdict occurs.

    `counts` maps each method to the number of occurrences of each verdict.
    """
    height = TOP + ROW * len(counts) + BELOW
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(WIDTH, height))
        axes = figure.add_axes(
            (NAMES / WIDTH, BELOW / height, 0.99 - NAMES / WIDTH, ROW * len(counts) / height)
        )
        begin, numbers = np.zeros(len(counts)), np.array(list(counts.values()))
        for verdict, colour, number in zip(verdicts, COLOURS, numbers.T, strict=True):
            if number.any():
                axes.barh(list(counts), number, 0.8, begin, color=colour, label=verdict)
            begin += number
        axes.set(ylim=(len(counts) - 0.5, -0.5), xlabel="cases")
        axes.tick_params(axis="y", length=0)
        figure.legend(loc="upper left", bbox_to_anchor=(NAMES / WIDTH, 1.0), ncols=len(verdicts))
        return figure_to_svg(figure)
