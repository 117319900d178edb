"""Heat maps that show the error of each method on each test case.

Each square shows the order of magnitude of the error, and a symbol for the verdict.
"""

from dataclasses import dataclass

import numpy as np

from .style import FAINT, INK, STYLE, figure_to_svg, plt

COLOURS = plt.get_cmap("RdYlBu_r")
GREY = (0.6, 0.6, 0.6, 0.35)
LEAST, MOST = -16.0, 0.5  # decades of the error
ROW, WIDTH, NAMES, TOP, RIGHT = 0.21, 10.2, 2.75, 1.0, 0.55  # [inch], as wide as the page


@dataclass(frozen=True)
class Square:
    """A square of the heat map, showing the error of one run if it is known."""

    row: str
    column: str
    error: float | None  # [rad]
    mark: str
    is_framed: bool

    @property
    def decade(self):
        return float(np.log10(np.clip(self.error, 10**LEAST, 10**MOST)))

    @property
    def colour(self):
        return GREY if self.error is None else COLOURS((self.decade - LEAST) / (MOST - LEAST))

    @property
    def text(self):
        """The text drawn in the square of the heat map, such as 9 for an error of 1e-9 rad."""
        return ("" if self.error is None else f"{abs(round(self.decade))}") + self.mark

    @property
    def ink(self):
        if self.error is None:
            return INK
        return "white" if np.dot(self.colour[:3], (0.3, 0.6, 0.1)) < 0.5 else "#111111"


def draw_square(axes, square, column, row):
    axes.add_patch(
        plt.Rectangle(
            (column, row),
            1,
            1,
            facecolor=square.colour,
            edgecolor=INK if square.is_framed else "white",
            linewidth=2 if square.is_framed else 0.8,
        )
    )
    axes.text(
        column + 0.5,
        row + 0.52,
        square.text,
        ha="center",
        va="center",
        color=square.ink,
    )


def set_labels(axes, columns, rows):
    axes.set(xlim=(0, len(columns)), ylim=(len(rows), 0))
    axes.set_yticks(np.arange(len(rows)) + 0.5, rows)
    slanted = {"rotation": 45, "ha": "left", "rotation_mode": "anchor"}
    axes.set_xticks(np.arange(len(columns)) + 0.5, columns, **slanted)
    axes.tick_params(length=0, top=False, labeltop=True, labelbottom=False)
    for side in axes.spines.values():
        side.set_visible(False)


def draw_heatmap(squares, columns):
    """Draw a heat map with the given column titles."""
    rows = list(dict.fromkeys(square.row for square in squares))
    height = TOP + ROW * len(rows) + 0.05
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(WIDTH, height))
        axes = figure.add_axes(
            (NAMES / WIDTH, 0.05 / height, 1 - (NAMES + RIGHT) / WIDTH, ROW * len(rows) / height)
        )
        for square in squares:
            draw_square(axes, square, columns.index(square.column), rows.index(square.row))
        set_labels(axes, columns, rows)
        return figure_to_svg(figure)


def draw_key():
    """Draw the colour scale."""
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(5.2, 0.72))
        axes = figure.add_axes((0.04, 0.67, 0.92, 0.3))
        axes.imshow(
            np.linspace(0, 1, 32)[None], aspect="auto", cmap=COLOURS, extent=(LEAST, MOST, 0, 1)
        )
        axes.set_yticks([])
        axes.set_xticks(range(-15, 1, 3), [f"1e{x}" if x else "1" for x in range(-15, 1, 3)])
        axes.set_xlabel("attitude error [rad]")
        axes.tick_params(color=FAINT)
        return figure_to_svg(figure)
