"""Heat maps of the errors of methods on test cases, and bar charts of their verdicts."""

import numpy as np

from .style import INK, as_svg, plt

SCALE = plt.get_cmap("RdYlBu_r")
GREY = (0.6, 0.6, 0.6, 0.35)
LOW, HIGH = -16.0, 0.5  # decades of the error
# Okabe and Ito's palette, which readers with any colour vision tell apart, and greys
VERDICTS = ("#0072b2", "#56b4e9", "#f0e442", "#d55e00", "#999999", "#d9d9d9", "#000000")


def draw_square(axes, place, error, mark, is_framed):
    """Draw the decade of an error, such as 9 for 1e-9 rad, and a mark; the error may be None."""
    colour, text, ink = GREY, mark, INK
    if error is not None:
        decade = float(np.log10(np.clip(error, 10**LOW, 10**HIGH)))
        colour, text = SCALE((decade - LOW) / (HIGH - LOW)), f"{abs(round(decade))}{mark}"
        ink = "white" if np.dot(colour[:3], (0.3, 0.6, 0.1)) < 0.5 else "#111111"
    edge = {"edgecolor": INK, "linewidth": 2} if is_framed else {"edgecolor": "white"}
    axes.add_patch(plt.Rectangle(place, 1, 1, facecolor=colour, **edge))
    axes.text(place[0] + 0.5, place[1] + 0.52, text, ha="center", va="center", color=ink)


@as_svg
def draw_heatmap(squares, columns, row=0.21, width=10.2, left=2.75, top=1.0, right=0.55):
    """Draw a heat map of squares (row, column, error, mark, is_framed), as wide as the page."""
    rows = list(dict.fromkeys(square[0] for square in squares))
    height = top + row * len(rows) + 0.05
    figure = plt.figure(figsize=(width, height))
    inner = 1 - (left + right) / width, row * len(rows) / height
    axes = figure.add_axes((left / width, 0.05 / height, *inner))
    for name, column, *rest in squares:
        draw_square(axes, (columns.index(column), rows.index(name)), *rest)
    axes.set(xlim=(0, len(columns)), ylim=(len(rows), 0))
    axes.set_yticks(np.arange(len(rows)) + 0.5, rows)
    slanted = {"rotation": 45, "ha": "left", "rotation_mode": "anchor"}
    axes.set_xticks(np.arange(len(columns)) + 0.5, columns, **slanted)
    axes.tick_params(length=0, top=False, labeltop=True, labelbottom=False)
    axes.spines[:].set_visible(False)
    return figure


@as_svg
def draw_key():
    """Draw the colour scale."""
    figure = plt.figure(figsize=(5.2, 0.72))
    axes = figure.add_axes((0.04, 0.67, 0.92, 0.3))
    axes.imshow(np.linspace(0, 1, 32)[None], aspect="auto", cmap=SCALE, extent=(LOW, HIGH, 0, 1))
    axes.set(yticks=[], xlabel="attitude error [rad]")
    axes.set_xticks(range(-15, 1, 3), [f"1e{x}" if x else "1" for x in range(-15, 1, 3)])
    return figure


@as_svg
def draw_bars(counts, verdicts, row=0.175, width=8.6, left=1.45, top=0.35, below=0.45):
    """Draw a stacked bar for each method, showing how often each verdict occurs."""
    height = top + row * len(counts) + below
    figure = plt.figure(figsize=(width, height))
    inner = 0.99 - left / width, row * len(counts) / height
    axes = figure.add_axes((left / width, below / height, *inner))
    begin, numbers = np.zeros(len(counts)), np.array(list(counts.values()))
    for verdict, colour, number in zip(verdicts, VERDICTS, numbers.T, strict=True):
        if number.any():
            axes.barh(list(counts), number, 0.8, begin, color=colour, label=verdict)
        begin += number
    axes.set(ylim=(len(counts) - 0.5, -0.5), xlabel="cases")
    axes.tick_params(axis="y", length=0)
    figure.legend(loc="upper left", bbox_to_anchor=(left / width, 1.0), ncols=len(verdicts))
    return figure
