"""Colours, markers and labels of curves, and figures as SVG in the text colour of the page."""

import io
from functools import wraps
from pathlib import Path

import kreisel as kr
import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

SHEET = Path(__file__).with_name("report.mplstyle")
INK = "#010203"  # replaced by the text colour of the page
FAINT = "#8c8c8c"
LEAST = 1e-17  # value drawn for an error of zero
# Eight hues, distinct under normal vision, protanopia and deuteranopia, on white and on black.
COLOURS = ("#6289eb", "#9d3b00", "#14b162", "#894e62", "#893bff", "#00b1c4", "#b19d14", "#9d279d")
MARKERS = "os^vDPX<>"
DASHES = (0, (4, 2))
# One colour and one marker for each method of kreisel, the same in all figures. The first two
# colours are for what kreisel chooses by itself; in the order of their orders, the other methods of
# one panel have different colours.
DEFAULTS = {"kreisel": COLOURS[0], "taylor": COLOURS[0], "exact": COLOURS[1]}
OTHERS = [name for name in kr.methods if not name.startswith("gsl_")]
OTHERS.sort(key=lambda name: (kr.methods[name].order, name))
STYLES = {
    name: {"color": DEFAULTS.get(name, COLOURS[2 + i % 6]), "marker": MARKERS[i % len(MARKERS)]}
    for i, name in enumerate(dict.fromkeys([*DEFAULTS, *OTHERS]))
}
# The strokes and markers of the other integrators, the same in all figures.
PEERS = {
    **dict.fromkeys(("heyoka", "heyoka, batches"), (DASHES, "o")),
    **dict.fromkeys(("gsl_rk8pd", "GSL rk8pd"), ((0, (1, 1.5)), "s")),
    **dict.fromkeys(("scipy_dop853", "SciPy DOP853"), ((0, (5, 1.5, 1, 1.5)), "D")),
    **dict.fromkeys(("gsl_bsimp", "heyoka, ensemble"), ((0, (2, 1)), "^")),
}


def as_svg(draw):
    """Let a function that returns a figure return the SVG code of the figure."""

    @wraps(draw)
    def draw_svg(*arguments, **words):
        with plt.style.context(SHEET):
            figure, page = draw(*arguments, **words), io.StringIO()
            figure.canvas.print_svg(page, metadata={"Date": None})
            plt.close(figure)
        svg = page.getvalue()
        return svg[svg.index("<svg") :].replace(INK, "currentColor")

    return draw_svg


def set_power_ticks(axis, ticks=12):
    """Set at most about `ticks` ticks at powers of ten, with labels such as 1e-9 or 1e0."""
    axis.set_major_locator(matplotlib.ticker.LogLocator(numticks=ticks))
    axis.set_major_formatter(lambda x, _=None: f"{x:.0e}".replace("e-0", "e-").replace("e+0", "e"))
    axis.set_minor_locator(matplotlib.ticker.NullLocator())  # minor ticks take most of the time


def axes_height(axes, y):
    """Return the height of a value as a fraction of the axes; linear axes must run from 0 to 1."""
    low, high = axes.get_ylim()
    is_log = axes.get_yscale() == "log"
    return np.clip(np.log10(y / low) / np.log10(high / low) if is_log else y, 0, 1)


def spread_labels(heights, gap):
    """Return the vertical positions of labels, moved so that no two labels overlap."""
    heights = list(heights)
    for i in range(1, len(heights)):
        heights[i] = max(heights[i], heights[i - 1] + gap)
    most = 1.0
    for i in reversed(range(len(heights))):
        heights[i] = min(heights[i], most)
        most = heights[i] - gap
    return heights


def label_ends(axes, ends):
    """Write labels to the right of the axes, and connect each label to the end of its curve.

    `ends` contains the label, the end point and the style of each curve. If a curve has a marker,
    the same marker is drawn beside its label.
    """
    width, height = axes.get_position().size * axes.figure.get_size_inches()
    labels = sorted(
        ((axes_height(axes, y), x, y, name, style) for name, (x, y), style in ends),
        key=lambda label: label[:4],
    )
    places = spread_labels((label[0] for label in labels), 11.0 / (72 * height))
    line = {"arrowstyle": "-", "linewidth": 0.5, "alpha": 0.5, "relpos": (0, 0.5), "shrinkB": 2}
    for place, (_, x, y, name, style) in zip(places, labels, strict=True):
        key = {word: value for word, value in style.items() if word != "linestyle"}
        axes.plot(1.045, place, transform=axes.transAxes, linestyle="", clip_on=False, **key)
        axes.annotate(
            name,
            (x, np.clip(y, *axes.get_ylim())),
            xytext=(1.045 + 5 / (72 * width), place),
            textcoords="axes fraction",
            va="center",
            annotation_clip=False,
            arrowprops=line | {"color": style["color"]},
        )


def choose_line_styles(family, peers):
    """Return the colours, markers and line styles of all curves in a panel.

    The other integrators, listed in `peers`, have dashed lines and hollow markers.
    """
    styles = {name: STYLES[name] for name in family if name not in peers}
    for name in peers:
        if name in PEERS:
            stroke, marker = PEERS[name]
            hollow = {"color": INK, "markerfacecolor": "none"}
            styles[name] = {**hollow, "linestyle": stroke, "marker": marker}
    return styles
