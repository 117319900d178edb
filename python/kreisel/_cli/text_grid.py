"""Printing of text tables, whose numbers and words are never cut."""

from __future__ import annotations

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Grid

_SPACE = 3  # largest width of the padding and the border of a column


def print_text_grid(grid: Grid) -> None:
    """Print a table, which is wider than the terminal if a number or a word needs this."""
    least_width = 2
    for column in grid.columns:
        texts = [str(column.header), *map(str, column.cells)]
        parts = texts if column.no_wrap else [word for text in texts for word in text.split()]
        column.min_width = max(map(cell_len, parts), default=0)
        least_width += column.min_width + _SPACE
    console = Console(markup=False, highlight=False)
    console.width = max(console.width, least_width)
    console.print(grid, crop=False)
