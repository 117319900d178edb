"""The picture of the atlas: a heat map a family, its cases by the methods."""

import numpy as np

from .figures import FAINT, INK, STYLE, as_svg, plt

COLOURS = plt.get_cmap("RdYlBu_r")
LEAST, MOST = -16.0, 0.5  # decades of the attitude error
ROW, WIDTH, NAMES, TOP, RIGHT = 0.21, 10.2, 2.75, 1.0, 0.55  # [inch], as wide as the page
RAN = ("right", "degraded", "lost", "silent")


def decade(cell):
    return float(np.log10(np.clip(cell["attitude_error"], 10**LEAST, 10**MOST)))


def paint(axes, cell, column, row):
    """One cell: its colour and its decade with a mark, or the letter of why there is none."""
    ran = cell["verdict"] in RAN
    colour = COLOURS((decade(cell) - LEAST) / (MOST - LEAST)) if ran else (0.6, 0.6, 0.6, 0.35)
    thick = cell["verdict"] == "silent"
    axes.add_patch(
        plt.Rectangle(
            (column, row),
            1,
            1,
            facecolor=colour,
            edgecolor=INK if thick else "white",
            linewidth=2 if thick else 0.8,
        )
    )
    number = f"{round(decade(cell))}".replace("-", "−") if ran else ""
    number += "•" if cell["verdict"] == "right" else ""
    dark = ran and np.dot(colour[:3], (0.3, 0.6, 0.1)) < 0.5
    axes.text(
        column + 0.5,
        row + 0.52,
        f"{number}{cell['mark']}",
        ha="center",
        va="center",
        fontsize=7.5,
        color="white" if dark else "#111111" if ran else INK,
    )


def family(cells, methods):
    """One family as a picture; what does not apply stays empty."""
    names = list(dict.fromkeys(cell["case"] for cell in cells))
    height = TOP + ROW * len(names) + 0.05
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(WIDTH, height))
        axes = figure.add_axes(
            (NAMES / WIDTH, 0.05 / height, 1 - (NAMES + RIGHT) / WIDTH, ROW * len(names) / height)
        )
        for cell in cells:
            paint(axes, cell, methods.index(cell["method"]), names.index(cell["case"]))
        axes.set(xlim=(0, len(methods)), ylim=(len(names), 0))
        axes.set_yticks(np.arange(len(names)) + 0.5, names, fontsize=8.5)
        axes.set_xticks(
            np.arange(len(methods)) + 0.5,
            methods,
            fontsize=8.5,
            rotation=45,
            ha="left",
            rotation_mode="anchor",
        )
        axes.tick_params(length=0, top=False, labeltop=True, labelbottom=False)
        for side in axes.spines.values():
            side.set_visible(False)
        return as_svg(figure)


def key():
    """What the colours stand for."""
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(5.2, 0.62))
        axes = figure.add_axes((0.04, 0.62, 0.92, 0.34))
        axes.imshow(
            np.linspace(0, 1, 32)[None], aspect="auto", cmap=COLOURS, extent=(LEAST, MOST, 0, 1)
        )
        axes.set_yticks([])
        axes.set_xticks(range(-15, 1, 3), [f"1e{x}" if x else "1" for x in range(-15, 1, 3)])
        axes.set_xlabel("attitude error [rad]", fontsize=9)
        axes.tick_params(labelsize=8, color=FAINT)
        return as_svg(figure)
