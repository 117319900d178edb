"""A common style for all figures, with SVG text in the page's text colour."""

import io

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

INK = "#010203"  # replaced by the text colour of the page
FAINT = "#8c8c8c"
# Eight hues, distinct under normal vision, protanopia and deuteranopia, on white and on black.
COLOURS = ("#6289eb", "#9d3b00", "#14b162", "#894e62", "#893bff", "#00b1c4", "#b19d14", "#9d279d")
# one more marker than colours, so that no (colour, marker) pair repeats within 72 lines
MARKERS = "os^vDPX<>"
STROKES = (
    ((0, (4, 2)), "o"),
    ((0, (1, 1.5)), "s"),
    ((0, (5, 1.5, 1, 1.5)), "D"),
    ((0, (2, 1)), "^"),
)
# LEADERS are the first methods of kreisel in each figure that shows them. PEER_STROKES holds the
# places of the other integrators in STROKES, the same in all figures.
LEADERS = ("kreisel", "taylor", "exact")
PEER_STROKES = {
    **dict.fromkeys(("heyoka", "heyoka, batches"), 0),
    **dict.fromkeys(("gsl_rk8pd", "GSL rk8pd"), 1),
    **dict.fromkeys(("scipy_dop853", "SciPy DOP853"), 2),
    **dict.fromkeys(("gsl_bsimp", "heyoka, ensemble"), 3),
}
POINTS = 72  # the resolution of SVG [points per inch]
SIZE = 9  # the size of all type in all figures [pt]; the page does not scale figures up
STYLE = {
    "svg.fonttype": "none",
    "font.size": SIZE,
    **dict.fromkeys(("axes.titlesize", "figure.labelsize", "figure.titlesize"), SIZE),
    "font.family": "sans-serif",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "grid.color": FAINT,
    "grid.alpha": 0.25,
    "savefig.transparent": True,
    "legend.frameon": False,
}


def figure_to_svg(figure, **options):
    arrange_axes(figure)
    page = io.StringIO()
    figure.savefig(page, format="svg", metadata={"Date": None}, **options)
    plt.close(figure)
    svg = page.getvalue()
    return svg[svg.index("<svg") :].replace(INK, "currentColor")


def arrange_axes(figure):
    """Let the layout engine place the axes, so that saving the figure does not draw it twice."""
    if engine := figure.get_layout_engine():
        dpi, figure.dpi = figure.dpi, POINTS
        engine.execute(figure)
        figure.dpi = dpi
        figure.set_layout_engine(None)


def make_panel(height=3.1, width=4.9):
    """Create a figure with room for labels on the right.

    Sizes are in inches.
    """
    left, right, top, below = 0.72, 1.5, 0.1, 0.5
    figure = plt.figure(figsize=(width, height))
    return figure, figure.add_axes(
        (left / width, below / height, 1 - (left + right) / width, 1 - (top + below) / height)
    )


def format_tick(x, _=None):
    """Return a tick label such as 1e-9 or 1e0."""
    return f"{x:.0e}".replace("e-0", "e-").replace("e+0", "e")


def set_power_ticks(axis, ticks=12):
    """Set ticks at powers of ten, at most about `ticks` of them."""
    axis.set_major_locator(matplotlib.ticker.LogLocator(numticks=ticks))
    axis.set_major_formatter(format_tick)
    axis.set_minor_formatter(matplotlib.ticker.NullFormatter())


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
    excess = max(0.0, heights[-1] - 1) if heights else 0.0
    for i in reversed(range(len(heights))):
        is_last = i == len(heights) - 1
        most = 1 if is_last else heights[i + 1] - gap
        heights[i] = min(heights[i] - (excess if is_last else 0.0), most)
    return heights


def label_ends(axes, ends):
    """Write labels to the right of the axes, and connect each label to the end of its curve.

    `ends` contains the label, the end point and the style of each curve. If a curve has a marker,
    the same marker is drawn beside its label.
    """
    gap = 11.0 / (72 * axes.get_position().height * axes.figure.get_figheight())
    labels = sorted(
        ((axes_height(axes, y), x, y, name, style) for name, (x, y), style in ends),
        key=lambda label: label[:4],
    )
    heights = spread_labels((place[0] for place in labels), gap)
    after_marker = 1.045 + 5 / (72 * axes.get_position().width * axes.figure.get_figwidth())
    for height, (_, x, y, name, style) in zip(heights, labels, strict=True):
        colour, marker = style["color"], style.get("marker")
        if marker:
            key = {"color": colour, "marker": marker, "markersize": 4, "clip_on": False}
            fill = {"markerfacecolor": style.get("markerfacecolor", colour)}
            axes.plot(1.045, height, transform=axes.transAxes, linestyle="", **key, **fill)
        axes.annotate(
            name,
            (x, np.clip(y, *axes.get_ylim())),
            xytext=(after_marker if marker else 1.03, height),
            textcoords="axes fraction",
            color=INK if marker else colour,
            va="center",
            annotation_clip=False,
            arrowprops={
                "arrowstyle": "-",
                "color": colour,
                "linewidth": 0.5,
                "alpha": 0.5,
                "relpos": (0, 0.5),
                "shrinkB": 2,
            },
        )


def choose_line_styles(family, peers):
    """Return the colours, markers and line styles of all curves in a panel.

    The other integrators, listed in `peers`, have dashed lines and hollow markers.
    """
    own = [name for name in LEADERS if name in family]
    own += [name for name in family if name not in (*peers, *own)]
    styles = {
        name: {
            "color": COLOURS[i % len(COLOURS)],
            "marker": MARKERS[i % len(MARKERS)],
            "linestyle": "-",
        }
        for i, name in enumerate(own)
    }
    hollow = {"color": INK, "markerfacecolor": "none"}
    return styles | {
        name: {**hollow, "linestyle": STROKES[place][0], "marker": STROKES[place][1]}
        for name in peers
        if (place := PEER_STROKES.get(name)) is not None
    }
