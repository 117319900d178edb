"""Tables of states that are printed to standard output."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import click
import numpy as np
from rich import box
from rich.table import Table as Grid

from .._options.quantities import ANGLES
from .._results.path import Path
from .._results.tables import columns, format_column_heads
from .._utils.counts import format_count
from .._utils.validation import Array
from .text_grid import print_text_grid

_ENDS = 20  # rows printed at each end of a table that is not printed as a whole
_WIDTH = 14  # smallest width of a column: 8 digits, a sign and an exponent
Row = tuple[float, ...]


class AngleOptions:
    """Options for the representation of angles in tables.

    degrees  True: angles and rates are in degrees
    unwrap   True: jumps of whole turns are removed, also between consecutive pieces
    """

    def __init__(self, degrees: bool, unwrap: bool) -> None:
        self.degrees, self.unwrap = degrees, unwrap
        self._before: dict[str, float] = {}

    def columns(self, piece: Path, names: Iterable[str]) -> dict[str, Array]:
        """Return the time and the components of the given quantities as columns."""
        table = columns(piece, names, self.degrees)
        if self.unwrap and len(piece):
            period = 360.0 if self.degrees else 2.0 * np.pi
            for name in ANGLES & table.keys():
                last_angles = [self._before[name]] if name in self._before else []
                angles = np.unwrap([*last_angles, *table[name].tolist()], period=period)
                self._before[name] = float(angles[-1])
                table[name] = angles[len(last_angles) :]
        return table


class StateTablePrinter:
    """A table of states that is printed to standard output.

    is_whole  True: all rows are kept in memory and printed at the end
    """

    def __init__(self, angles: AngleOptions, is_whole: bool) -> None:
        self._angles = angles
        self._heads: dict[str, str] = {}
        self._first: list[Row] = []
        self._last: deque[Row] = deque(maxlen=None if is_whole else _ENDS)
        self._before: dict[str, Array] = {}
        self._has_jumps = False
        self.rows = 0

    def add_states(self, piece: Path, names: tuple[str, ...]) -> None:
        table = self._angles.columns(piece, names)
        if not self._heads:
            self._heads = format_column_heads(piece, names, self._angles.degrees)
        self._update_has_jumps(table)
        count = len(piece)
        self.rows += count
        head = min(count, _ENDS - len(self._first))
        self._first += _select_table_rows(table, slice(head))
        begin = head if self._last.maxlen is None else max(head, count - _ENDS)
        self._last.extend(_select_table_rows(table, slice(begin, None)))

    def _update_has_jumps(self, table: dict[str, Array]) -> None:
        half_turn = 180.0 if self._angles.degrees else np.pi
        for name in ANGLES & table.keys():
            values = np.append(self._before.get(name, []), table[name])
            self._has_jumps |= bool((np.abs(np.diff(values)) > half_turn).any())
            self._before[name] = values[-1:]

    def print_table(self) -> None:
        """Print the table of states."""
        if self.rows <= 2:
            self._print_first_and_last_rows()
            return
        width = {name: max(_WIDTH, len(head)) for name, head in self._heads.items()}
        click.echo("  ".join(f"{head:>{width[name]}}" for name, head in self._heads.items()))
        omitted_count = self.rows - len(self._first) - len(self._last)
        for k, row in enumerate([*self._first, *self._last]):
            if k == _ENDS and omitted_count:
                click.echo(
                    f"... {format_count(omitted_count, 'row')} omitted: --all-rows prints them, "
                    "--csv writes them"
                )
            cells = zip(row, width.values(), strict=True)
            click.echo("  ".join(f"{value:>{cell_width}.8g}" for value, cell_width in cells))
        if self._has_jumps and not self._angles.unwrap:
            click.echo("angles jump by whole turns: --unwrap makes them continuous")

    def _print_first_and_last_rows(self) -> None:
        grid = Grid(box=box.SIMPLE_HEAD)
        for name in ("", "first", "last"):
            grid.add_column(name, no_wrap=True)
        for head, first, last in zip(
            self._heads.values(), self._first[0], self._first[-1], strict=True
        ):
            grid.add_row(head, f"{first: .15g}", f"{last: .15g}")
        print_text_grid(grid)


def _select_table_rows(table: dict[str, Array], rows: slice) -> list[Row]:
    return list(zip(*(column[rows].tolist() for column in table.values()), strict=True))
