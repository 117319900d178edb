"""Outputs of commands: tables, files and progress."""

from __future__ import annotations

import json
import math
import signal
import sys
import tomllib
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, TypeVar

import click
import numpy as np
from rich import box
from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.progress import Progress
from rich.table import Table

from .._core import values as values_of
from .._core import version
from .._options.options import ANGLES, LOW
from .._results.archive import encode_as_archive
from .._results.path import Events, Path, join_events, join_paths
from .._results.results import Error, Interrupted
from .._results.tables import (
    columns,
    encode_table_as_csv,
    format_column_heads,
    list_quantity_columns,
)
from .._solve.run import Run
from .._utils.arguments import Array, format_count
from .._utils.files import atomic_open, atomic_write
from .._utils.processes import replace_signal_handlers
from .options import OutputFile, UsageError

_BORDER = 3  # largest width of the padding and the border of a column


def print_table(
    head: Sequence[str], rows: Iterable[Sequence[str]], right: Collection[str] = ()
) -> None:
    """Print a table, which is wider than the terminal if a number or a word needs this.

    The columns `right` are aligned to the right, and the first column is never wrapped.
    """
    grid = Table(box=box.SIMPLE_HEAD)
    for name in head:
        justify: JustifyMethod = "right" if name in right else "left"
        grid.add_column(name, justify=justify, no_wrap=name is head[0])
    for row in rows:
        grid.add_row(*row)
    for column in grid.columns:
        texts = [str(column.header), *map(str, column.cells)]
        parts = texts if column.no_wrap else [word for text in texts for word in text.split()]
        column.min_width = max(map(cell_len, parts), default=0)
    console = Console(markup=False, highlight=False)
    least_width = 2 + sum((column.min_width or 0) + _BORDER for column in grid.columns)
    console.width = max(console.width, least_width)
    console.print(grid, crop=False)


def write_bytes(file: str, data: bytes) -> None:
    if file != "-":
        atomic_write(file, data)
        return
    remainder = memoryview(data)
    while remainder:  # an unbuffered standard output may write only some of the bytes
        remainder = remainder[sys.stdout.buffer.write(remainder) :]
    sys.stdout.buffer.flush()


@contextmanager
def show_progress(total: float) -> Iterator[Callable[[float], object]]:
    """Return a context manager that shows a progress bar if standard error is a terminal.

    It yields a function to update the bar. The remaining time is estimated from the average speed
    since the start.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda done: None
        return
    with Progress(console=console, transient=True, speed_estimate_period=1e9) as bar:
        task = bar.add_task("", total=total)
        yield lambda done: bar.update(task, completed=done)


_Command = TypeVar("_Command", bound=Callable[..., object])
_OPTIONS = (
    click.option(
        "--csv", type=OutputFile(".csv"), help="Write the states, or the quantities of --want."
    ),
    click.option(
        "--json",
        type=OutputFile(".json"),
        help="Write the states, the scene and the options as one JSON object.",
    ),
    click.option(
        "--npz",
        type=OutputFile(".npz"),
        help="Write the path for kreisel.load; numpy.load can also read its arrays.",
    ),
    click.option("--events-csv", type=OutputFile(".csv"), help="Write the events."),
    click.option(
        "--save",
        type=OutputFile(".kreisel", replaces="run"),
        help="Write the state of the run when it ends or is stopped, for `kreisel resume`.",
    ),
    click.option(
        "--degrees", is_flag=True, help="Write angles and rates in degrees, except in .npz."
    ),
    click.option(
        "--unwrap",
        is_flag=True,
        help="Write continuous angles, without jumps of whole turns, except in .npz and at "
        "events; successive states must be less than half a turn apart.",
    ),
    click.option("--all-rows", is_flag=True, help="Print all rows of the table of states."),
)
_FILES = "csv", "json", "npz", "events_csv", "save"


def add_output_options(command: _Command) -> _Command:
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


class RunOutputs:
    """The outputs of a run, to which its path is written in consecutive pieces.

    The output options are taken out of the dictionary `options`. `event_names` are the names of the
    events in tables.
    """

    def __init__(self, options: dict[str, Any], event_names: tuple[str, ...], end: float) -> None:
        given = {name: options.pop(name) for name in _FILES}
        self.files: dict[str, str] = {name: file for name, file in given.items() if file}
        if "events_csv" in self.files and not event_names:
            raise UsageError("--events-csv needs --events")
        self._degrees, self._unwrap = options.pop("degrees"), options.pop("unwrap")
        self._event_names, self._end, self._is_stopped = event_names, end, False
        table = _StateTable(options.pop("all_rows"))
        self._table = None if "-" in self.files.values() else table
        self._open = ExitStack()
        self._grow: Callable[[bytes], None] | None = None
        self._last_angles: dict[str, Array] = {}
        self._pieces: list[Path] = []
        self._events: list[Events] = []
        self._update_bar: Callable[[float], object]

    @property
    def needs_whole_path(self) -> bool:
        return not {"json", "npz"}.isdisjoint(self.files)

    def report_progress(self, t: float) -> None:
        """Update the progress bar; raise KeyboardInterrupt if a signal arrived before the end."""
        self._update_bar(abs(t))
        if self._is_stopped and t != self._end:
            raise KeyboardInterrupt

    def write_path(self, pieces: Iterator[Path], run: Run | None = None) -> None:
        """Write the pieces of a path to all outputs as they are computed, and save the run.

        After a first Ctrl-C or SIGTERM, the run stops, and the results so far are written. A second
        signal of the same kind terminates the process at once. The saved state is the last one
        that has been written to all outputs. The run is not saved if an output fails. Raises the
        exception that stopped the run or, if there is none, the first error of an output.
        """

        def stop(number: int, _: object) -> None:
            self._is_stopped = True
            signal.signal(number, signal.SIG_DFL)

        saved = run if "save" in self.files else None
        with replace_signal_handlers((signal.SIGINT, signal.SIGTERM), stop):
            try:
                with show_progress(abs(self._end)) as self._update_bar:
                    failure, checkpoint = self._write_pieces(pieces, saved)
            except BaseException as error:
                self._open.__exit__(type(error), error, None)  # existing files stay as they are
                if isinstance(error, MemoryError):
                    raise click.ClickException("not enough memory") from None
                raise
            self._finish(failure, checkpoint)

    def _write_pieces(
        self, pieces: Iterator[Path], run: Run | None
    ) -> tuple[BaseException | None, bytes | None]:
        """Return the exception that stopped the run, and the checkpoint after the last piece."""
        while True:
            checkpoint = run.checkpoint if run else None
            failure: BaseException | None = None
            try:
                piece = next(pieces, None)
            except (Error, Interrupted) as error:
                piece, failure = error.path, error
            if piece is None:
                return None, checkpoint
            try:
                self._write_piece(piece)
            except OSError as error:
                return error, checkpoint
            if failure is None and self._is_stopped:
                failure = KeyboardInterrupt(f"interrupted at t = {piece.t[-1]:g}")
            if failure is not None:
                return failure, run.checkpoint if run else None

    def _write_piece(self, piece: Path) -> None:
        """Write a piece to the CSV file, which can fail, before all other outputs receive it."""
        states: tuple[str, ...] = ("q", "m", *LOW) if (piece.digits or 0) > 16 else ("q", "m")
        self._names = names = piece.want or states
        heads = format_column_heads(piece, names, self._degrees)
        if "csv" in self.files or self._table:
            table = self._compute_columns(piece, names)
        if "csv" in self.files:
            rows = {heads[name]: column.tolist() for name, column in table.items()}
            data = encode_table_as_csv(rows, head=self._grow is None)
            if self._grow is None and self.files["csv"] == "-":
                self._grow = lambda more: write_bytes("-", more)
            elif self._grow is None:
                file = self._open.enter_context(atomic_open(self.files["csv"]))
                self._grow = file.append_bytes
            self._grow(data)
        if self._table:
            self._table.add_piece(piece, heads, table)
        if self._event_names:
            self._events.append(piece.events)
        if self.needs_whole_path:
            self._pieces.append(piece)

    def _compute_columns(self, piece: Path, names: Iterable[str]) -> dict[str, Array]:
        """Return the columns of a table of the piece; unwrap angles that follow earlier ones."""
        table = columns(piece, names, self._degrees)
        turn = 360.0 if self._degrees else 2.0 * np.pi
        for name in ANGLES & table.keys() if len(piece) else ():
            angles = np.append(self._last_angles.get(name, []), table[name])
            if self._unwrap:
                angles = np.unwrap(angles, period=turn)
                table[name] = angles[-len(piece) :]
            elif self._table and (np.abs(np.diff(angles)) > turn / 2.0).any():
                self._table.has_jumps = True
            self._last_angles[name] = angles[-1:]
        return table

    def _finish(self, failure: BaseException | None, checkpoint: bytes | None) -> None:
        """Finish all outputs, even if an error occurs in one of them."""
        failures = [failure] if failure else []

        def write_whole_path() -> None:
            if self._pieces:
                path = join_paths(self._pieces)
                if "npz" in self.files:
                    write_bytes(self.files["npz"], encode_as_archive(path))
                if "json" in self.files:
                    write_bytes(self.files["json"], self._encode_as_json(path, failure))

        def write_events() -> None:
            if self._events and "events_csv" in self.files:
                write_bytes(self.files["events_csv"], encode_table_as_csv(self._tabulate_events()))

        for write in (self._open.close, write_whole_path, write_events):
            try:
                write()
            except OSError as error:
                failures.append(error)
        if checkpoint and failures == ([failure] if failure else []):
            write_bytes(self.files["save"], checkpoint)
        if self._table and self._table.last_piece:
            self._table.print_summary()
            if self._events:
                self._print_events()
        if failures:
            raise failures[0]

    def _tabulate_events(self, has_units: bool = True) -> dict[str, list[Any]]:
        events = join_events(self._events)
        table = columns(events.path, self._names, self._degrees)
        heads = format_column_heads(events.path, self._names, self._degrees) if has_units else {}
        return {
            "event": [self._event_names[i] for i in events.which],
            heads.get("t", "t"): table.pop("t").tolist(),
            "direction": events.direction.tolist(),
        } | {heads.get(name, name): column.tolist() for name, column in table.items()}

    def _print_events(self) -> None:
        head = "event", "t", "direction"
        rows = list(zip(*map(self._tabulate_events(False).get, head), strict=True))
        cells = [(event, f"{t:.15g}", f"{direction:+d}") for event, t, direction in rows[:_SHOWN]]
        print_table(head, cells, head[1:])
        if rows[_SHOWN:]:
            click.echo(f"... {len(rows) - _SHOWN} more events: --events-csv writes all")

    def _encode_as_json(self, path: Path, failure: BaseException | None) -> bytes:
        """Return a path in JSON format, together with its scene and options."""
        document: dict[str, Any] = {
            "kreisel": version,
            "scene": tomllib.loads(path.scene.to_toml()),
            "method": path.method,
            "step": path.step,
            "tol": path.tol,
            "digits": path.digits,
            "stats": path.stats._asdict(),
            "stopped": str(failure) if failure else None,
            "units": {},
        }
        for column in list_quantity_columns(path, self._names, self._degrees, self._unwrap):
            document["units"][column.name] = column.unit
            document[column.name] = _replace_nonfinite(column.values.tolist())
        if self._event_names:
            document["events"] = _replace_nonfinite(self._tabulate_events(False))
        return (json.dumps(document, allow_nan=False) + "\n").encode()


def _replace_nonfinite(value: Any) -> Any:
    """Replace infinities and NaN by None, because JSON cannot represent them."""
    if isinstance(value, dict):
        return {name: _replace_nonfinite(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_replace_nonfinite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


_ENDS = 20  # rows printed at each end of a table that is not printed as a whole
_SHOWN = 20  # largest number of events that are printed
_WIDTH = 14  # smallest width of a column: 8 digits, a sign and an exponent


class _StateTable:
    """The summary of a run: its costs, its first and last states, and its energy error.

    is_whole  True: all rows are kept in memory and printed
    """

    def __init__(self, is_whole: bool) -> None:
        self.last_piece: Path | None = None
        self.has_jumps = False
        self._heads: dict[str, str] = {}
        self._first: list[tuple[float, ...]] = []
        self._last: deque[tuple[float, ...]] = deque(maxlen=None if is_whole else _ENDS)
        self._count = 0
        self._energy_change = self._energy_scale = 0.0

    def add_piece(self, piece: Path, heads: dict[str, str], table: dict[str, Array]) -> None:
        count = len(piece)
        if count or self.last_piece is None:
            self.last_piece = piece
        if not count:
            return
        self._heads = heads
        head = min(count, _ENDS - len(self._first))
        tail = head if self._last.maxlen is None else max(head, count - _ENDS)
        for rows, part in (self._first, slice(head)), (self._last, slice(tail, None)):
            rows.extend(zip(*(column[part].tolist() for column in table.values()), strict=True))
        self._count += count
        if piece.want is None and not math.isnan(piece.energy_error):
            scene = piece.scene
            lever = scene.body.mass * abs(scene.gravity) * float(np.linalg.norm(scene.body.com))
            start_energy = float(values_of("kinetic", scene._block, scene._start_state)[0])
            scale = max(start_energy, float(piece.kinetic.max())) + lever  # as in energy_error
            self._energy_change = max(self._energy_change, piece.energy_error * scale)
            self._energy_scale = max(self._energy_scale, scale)

    def print_summary(self) -> None:
        path, count = self.last_piece, self._count
        assert path is not None
        steps = format_count(path.stats.steps, "step")
        evaluations = format_count(path.stats.evaluations, "evaluation")
        click.echo(f"{format_count(count, 'state')} by {path.method}: {steps}, {evaluations}")
        if 0 < count <= 2:
            numbers = zip(self._first[0], self._first[-1], strict=True)
            cells = [[f"{number:.15g}" for number in pair] for pair in numbers]
            rows = [(head, *pair) for head, pair in zip(self._heads.values(), cells, strict=True)]
            print_table(("", "first", "last"), rows, ("first", "last"))
        elif count:
            widths = [max(_WIDTH, len(head)) for head in self._heads.values()]
            click.echo("  ".join(map(str.rjust, self._heads.values(), widths)))
            omitted_count = count - len(self._first) - len(self._last)
            for k, row in enumerate([*self._first, *self._last]):
                if k == _ENDS and omitted_count:
                    click.echo(
                        f"... {format_count(omitted_count, 'row')} omitted: --all-rows prints "
                        "them, --csv writes them"
                    )
                texts = [f"{value:.8g}" for value in row]
                click.echo("  ".join(map(str.rjust, texts, widths)))
            if self.has_jumps:
                click.echo("angles jump by whole turns: --unwrap makes them continuous")
        if self._energy_scale:
            click.echo(f"energy error {self._energy_change / self._energy_scale:.2g}")
        if path.plan.choice:
            click.echo(str(path.plan.choice))
