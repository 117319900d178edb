"""The style of the figures, and a scraper for figures that pyplot does not manage."""

from pathlib import Path
from weakref import WeakSet

import matplotlib
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

shown_figures = WeakSet()  # figures already shown at the end of earlier blocks
LAST = "___"  # the name under which sphinx-gallery stores the value of a block's last expression
# Distinct under normal vision, protanopia and deuteranopia, with a contrast of about 3 or more.
COLOURS = ["#1f6fd6", "#e07a1f", "#29413d", "#b38f76", "#0e9ebb", "#5e3f04", "#0609f9", "#232a65"]
# The examples that open their part of the gallery; the others follow by name.
FIRST = (
    *("loops_cusps_waves.py", "toy_gyroscope.py", "sleeping.py", "gyrocompass.py", "kapitza.py"),
    *(
        "satellite.py",
        "rods.py",
        "polhodes.py",
        "sections.py",
        "cloud.py",
        "horseshoe.py",
        "film.py",
        "toutatis.py",
    ),
)
LOOK = {
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10.5,
    "axes.labelsize": 9.5,
    "figure.dpi": 110,
    "figure.figsize": (7.6, 4.2),
    "font.size": 9.5,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "savefig.dpi": 110,
}


def get_sort_key(file):
    """Return the sort key of an example."""
    name = Path(file).name
    return FIRST.index(name) if name in FIRST else len(FIRST), name


def style(conf, file):
    """Set the style before each example."""
    matplotlib.rcParams.update(LOOK)


def scraper(block, block_vars, gallery_conf):
    """Save the figure at the end of a block, and return its reST.

    Figures that pyplot manages are left to sphinx-gallery.
    """
    figure = figure_of(block_vars["example_globals"].get(LAST))
    if figure is None or hasattr(figure, "number") or figure in shown_figures:
        return ""
    shown_figures.add(figure)
    file = next(block_vars["image_path_iterator"])
    figure.savefig(file, dpi=LOOK["savefig.dpi"])
    return figure_rst([file], gallery_conf["src_dir"])


def figure_of(thing):
    if isinstance(thing, Figure):
        return thing
    one = thing[0] if isinstance(thing, tuple) and thing else thing
    return one.get_figure() if isinstance(one, Axes) else None
