"""Outputs of commands: tables, files and progress."""

from __future__ import annotations

import json
import math
import signal
import sys
import tomllib
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from types import FrameType
from typing import Protocol, TypedDict, TypeVar

import click
import numpy as np
from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table as Grid

from .._core import values as values_of
from .._core import version
from .._options.quantities import ANGLES, LOW
from .._results.archive import encode_path_as_archive
from .._results.path import Error, Events, Interrupted, Path
from .._results.quantities import NO_STATES
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
from .options import FILE, UsageError, parse_output_files, print_text_grid

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


_MET = "which", "direction"
_SHOWN = 20  # largest number of events in the summary


class PathPieceReceiver(Protocol):
    """Interface of outputs to which the states of a path are passed in consecutive parts."""

    def receive_path_piece(self, piece: Path) -> None:
        """Receive the states of the next part of the path."""


def write_bytes(file: str, data: bytes) -> None:
    """Write bytes to a file, or to standard output."""
    if file != "-":
        atomic_write(file, data)
        return
    remainder = memoryview(data)
    while remainder:  # an unbuffered standard output may write only some of the bytes
        remainder = remainder[sys.stdout.buffer.write(remainder) :]
    sys.stdout.buffer.flush()


def list_output_quantities(path: Path) -> tuple[str, ...]:
    """Return the names of the quantities that are written for each state."""
    return path.want or (("q", "m", *LOW) if (path.digits or 0) > 16 else ("q", "m"))


def convert_columns_to_lists(table: Mapping[str, Array]) -> dict[str, list[float]]:
    return {name: column.tolist() for name, column in table.items()}


class CsvOutput:
    """A CSV file that is written in chunks, so that memory use stays constant."""

    def __init__(self, file: str, angles: AngleOptions, files: ExitStack) -> None:
        self._file, self._angles, self._files = file, angles, files
        self._grow: Callable[[bytes], None] | None = None

    def receive_path_piece(self, piece: Path) -> None:
        names = list_output_quantities(piece)
        table = convert_columns_to_lists(self._angles.columns(piece, names))
        heads = format_column_heads(piece, names, self._angles.degrees)
        rows = encode_table_as_csv(
            {heads[name]: column for name, column in table.items()}, head=self._grow is None
        )
        if self._grow is None:
            self._grow = self._make_csv_write_function()
        self._grow(rows)

    def _make_csv_write_function(self) -> Callable[[bytes], None]:
        if self._file == "-":
            return lambda rows: write_bytes("-", rows)
        return self._files.enter_context(atomic_open(self._file)).append_bytes


@dataclass
class PathCollector:
    """An output that stores all parts of a path in memory."""

    pieces: list[Path] = field(default_factory=list)

    def receive_path_piece(self, piece: Path) -> None:
        """Append the next piece."""
        self.pieces.append(piece)

    @property
    def whole_path(self) -> Path:
        """The whole path, obtained by joining the parts that the output has received."""
        last, rest = self.pieces[-1], self.pieces[:-1]
        return last if not rest else _join_paths([*rest, last])


def _join_paths(pieces: list[Path]) -> Path:
    last = pieces[-1]
    event_parts = [piece._events for piece in pieces if piece._events is not None]
    events = None
    if event_parts:
        indices, direction = (np.concatenate([getattr(m, n) for m in event_parts]) for n in _MET)
        events = Events(_join_paths([m.path for m in event_parts]), indices, direction)
    if last.want is not None:
        names: tuple[str, ...] = ("t", *last.want)
        table = {n: np.concatenate([getattr(p, n) for p in pieces]) for n in names}
        return replace(last, states=NO_STATES, _events=events, _columns=table)
    low = None if last._low is None else np.concatenate([p._low for p in pieces])
    states = np.concatenate([piece.states for piece in pieces])
    return replace(last, states=states, _events=events, _low=low)


@dataclass
class EventCollector:
    """An output that collects the events of a run."""

    words: tuple[str, ...]
    degrees: bool
    parts: list[tuple[Events, tuple[str, ...]]] = field(default_factory=list)

    def receive_path_piece(self, piece: Path) -> None:
        self.parts.append((piece.events, list_output_quantities(piece)))

    def build_event_table(self) -> dict[str, list[object]]:
        """Return a table with one row for each event."""
        lists: dict[str, list[object]] = {"event": [], "t": [], "direction": []}
        for events, names in self.parts:
            table = convert_columns_to_lists(columns(events.path, names, self.degrees))
            rows = {
                "event": [self.words[i] for i in events.which],
                "t": table.pop("t"),
                "direction": events.direction.tolist(),
            }
            for name, column in (rows | table).items():
                lists.setdefault(name, []).extend(column)
        return lists

    def encode_as_csv(self) -> bytes:
        """Return the table in CSV format, with units in the heads of its columns."""
        events, names = self.parts[0]
        heads = format_column_heads(events.path, names, self.degrees)
        table = self.build_event_table()
        return encode_table_as_csv({heads.get(name, name): table[name] for name in table})

    def print_output(self) -> None:
        """Print a table of the first few events, unless no piece of the run was received."""
        if not self.parts:
            return
        table = self.build_event_table()
        names = ("event", "t", "direction")
        rows = list(zip(*(table[name] for name in names), strict=True))
        grid = Grid(box=box.SIMPLE_HEAD)
        for name in names:
            grid.add_column(name, no_wrap=True)
        for event, t, direction in rows[:_SHOWN]:
            grid.add_row(str(event), f"{t: .15g}", f"{direction:+d}")
        print_text_grid(grid)
        if len(rows) > _SHOWN:
            click.echo(f"... {len(rows) - _SHOWN} more events: --events-csv writes all")


class RunSummaryPrinter:
    """An output that prints a table of states and the largest energy error."""

    def __init__(self, angles: AngleOptions, is_whole: bool) -> None:
        self._table = StateTablePrinter(angles, is_whole)
        self._change = self._size = 0.0
        self._last: Path | None = None

    def receive_path_piece(self, piece: Path) -> None:
        if not len(piece):
            self._last = self._last or piece
            return
        self._last = piece
        self._table.add_states(piece, list_output_quantities(piece))
        if piece.want is None and not math.isnan(piece.energy_error):
            size = _compute_energy_error_scale(piece)
            self._change = max(self._change, piece.energy_error * size)
            self._size = max(self._size, size)

    def print_output(self) -> None:
        """Print the summary to standard output, unless no piece was received."""
        path = self._last
        if path is None:
            return
        stats = path.stats
        steps = format_count(stats.steps, "step")
        evaluations = format_count(stats.evaluations, "evaluation")
        states = format_count(self._table.rows, "state")
        click.echo(f"{states} by {path.method}: {steps}, {evaluations}")
        if self._table.rows:
            self._table.print_table()
        if self._size:
            click.echo(f"energy error {self._change / self._size:.2g}")
        if path.plan.choice:
            click.echo(str(path.plan.choice))


def _compute_energy_error_scale(path: Path) -> float:
    """Return the energy that is the denominator of path.energy_error [M L^2 T^-2]."""
    scene = path.scene
    start_energy = float(values_of("kinetic", scene._block, scene._start_state)[0])
    lever = scene.body.mass * abs(scene.gravity) * float(np.linalg.norm(scene.body.com))
    return max(start_energy, float(path.kinetic.max())) + lever


def encode_path_as_json(
    path: Path, collector: EventCollector | None, angles: AngleOptions, reason: str | None
) -> bytes:
    """Return a path in JSON format, together with its scene and options.

    `reason` states why the run ended early; it is None if the run was completed.
    """
    head = {
        "kreisel": version,
        "scene": tomllib.loads(path.scene.to_toml()),
        "method": path.method,
        "step": path.step,
        "tol": path.tol,
        "digits": path.digits,
        "stats": path.stats._asdict(),
        "stopped": reason,
    }
    quantities, units = {}, {}
    names = list_output_quantities(path)
    for column in list_quantity_columns(path, names, angles.degrees, angles.unwrap):
        quantities[column.name] = _replace_nonfinite(column.values.tolist())
        units[column.name] = column.unit
    events = (
        {} if collector is None else {"events": _replace_nonfinite(collector.build_event_table())}
    )
    return (
        json.dumps({**head, "units": units, **quantities, **events}, allow_nan=False) + "\n"
    ).encode()


def _replace_nonfinite(value: object) -> object:
    """Replace infinities and NaN by None, because JSON cannot represent them."""
    if isinstance(value, dict):
        return {name: _replace_nonfinite(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_replace_nonfinite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def encode_path_as_npz(path: Path) -> bytes:
    """Return the contents of the file that path.save would write."""
    return encode_path_as_archive(path, path._events_for_archive)


class StopSignalHandler:
    """A handler for Ctrl-C and SIGTERM during a run.

    After the first signal, the run stops, and the results obtained so far are written to the output
    files. A second signal of the same kind terminates the process immediately.
    """

    def __init__(self, end: float) -> None:
        self._end, self.asked = end, False
        self._bar: Progress | None = None

    @contextmanager
    def defer_signals(self) -> Iterator[None]:
        """Return a context manager that records signals instead of raising KeyboardInterrupt."""
        with replace_signal_handlers((signal.SIGINT, signal.SIGTERM), self._handle_stop_signal):
            yield

    def _handle_stop_signal(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        signal.signal(number, signal.SIG_DFL)

    @contextmanager
    def show_progress(self) -> Iterator[None]:
        """Return a context manager that shows a progress bar if standard error is a terminal."""
        console = Console(stderr=True)
        with (
            Progress(console=console, transient=True)
            if console.is_terminal
            else nullcontext() as bar
        ):
            if bar is not None:
                self._bar, self._task = bar, bar.add_task("t", total=abs(self._end))
            yield

    def update_progress_bar(self, t: float) -> None:
        """Update the progress bar; raise KeyboardInterrupt if a signal arrived before the end."""
        if self._bar is not None:
            self._bar.update(self._task, completed=abs(t))
        if self.asked and t != self._end:
            raise KeyboardInterrupt


@dataclass
class RunOutcome:
    """The exception that stopped a run, if any, and a checkpoint for resuming the run.

    The checkpoint corresponds to the last state that was written to all outputs.
    """

    stopped: BaseException | None = None
    checkpoint: bytes | None = None


def write_path_pieces_to_outputs(
    outputs: list[PathPieceReceiver],
    pieces: Iterator[Path],
    run: Run | None,
    stops: StopSignalHandler,
) -> RunOutcome:
    """Write a path to all outputs piece by piece, and return the outcome of the run.

    `run` provides the checkpoint.
    """
    while True:
        checkpoint = run.checkpoint if run else None
        failure: BaseException | None = None
        try:
            piece = next(pieces, None)
        except (Error, Interrupted) as error:
            piece, failure = error.path, error
        if piece is None:
            return RunOutcome(None, checkpoint)
        try:
            for output in outputs:
                output.receive_path_piece(piece)
        except OSError as error:
            return RunOutcome(error, checkpoint)
        if failure is None and stops.asked:
            failure = KeyboardInterrupt(f"interrupted at t = {piece.t[-1]:g}")
        if failure is not None:
            return RunOutcome(failure, run.checkpoint if run else None)


_Command = TypeVar("_Command", bound=Callable[..., object])


class OutputFileOptions(TypedDict):
    """Options that select the output files and the output format."""

    csv_file: str | None
    json_file: str | None
    npz_file: str | None
    events_file: str | None
    save_file: str | None
    degrees: bool
    unwrap: bool
    all_rows: bool


_OPTIONS = (
    click.option(
        "--csv", "csv_file", type=FILE, help="Write the states, or the quantities of --want."
    ),
    click.option(
        "--json",
        "json_file",
        type=FILE,
        help="Write the states, the scene and the options as one JSON object.",
    ),
    click.option(
        "--npz",
        "npz_file",
        type=FILE,
        help="Write the path for kreisel.load; numpy.load can also read its arrays.",
    ),
    click.option("--events-csv", "events_file", type=FILE, help="Write the events."),
    click.option(
        "--save",
        "save_file",
        type=FILE,
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


def add_output_options(command: _Command) -> _Command:
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


class RunOutputs:
    """The outputs of a run, to which the path is written in chunks.

    `file` is the name of the file from which the scene or the run is read.
    """

    def __init__(
        self,
        options: OutputFileOptions,
        file: str,
        events: tuple[str, ...],
        options_that_may_replace_file: tuple[str, ...] = (),
    ) -> None:
        if options["events_file"] and not events:
            raise UsageError("--events-csv needs --events")
        places = parse_output_files(
            [
                ("--csv", options["csv_file"]),
                ("--json", options["json_file"]),
                ("--npz", options["npz_file"]),
                ("--events-csv", options["events_file"]),
                ("--save", options["save_file"]),
            ],
            (file,),
            options_that_may_replace_file,
        )
        self.files = {place.option: place.file for place in places}
        self._shows = not any(place.is_stdout for place in places)
        self._open, self._where = ExitStack(), options
        self._summary, self._collector = (
            RunSummaryPrinter(self._build_angle_output_options(), options["all_rows"]),
            PathCollector(),
        )
        self._met = EventCollector(events, options["degrees"]) if events else None

    def _build_angle_output_options(self) -> AngleOptions:
        return AngleOptions(self._where["degrees"], self._where["unwrap"])

    @property
    def needs_whole_path(self) -> bool:
        """True if the whole path must be kept in memory."""
        return not {"--json", "--npz"}.isdisjoint(self.files)

    def create_path_outputs(self) -> list[PathPieceReceiver]:
        """Create the output objects to which the states of the run are written.

        The CSV file is the first output, because only it can fail to receive a piece; all other
        outputs must then end with the same piece as the CSV file.
        """
        outputs: list[PathPieceReceiver] = []
        if "--csv" in self.files:
            outputs.append(
                CsvOutput(self.files["--csv"], self._build_angle_output_options(), self._open)
            )
        if self._met:
            outputs.append(self._met)
        if self._shows:
            outputs.append(self._summary)
        if self.needs_whole_path:
            outputs.append(self._collector)
        return outputs

    def discard_output_files(self) -> None:
        """Discard the output, and leave existing files unchanged."""
        error = ValueError()
        self._open.__exit__(ValueError, error, None)

    def finish_outputs(self, end: RunOutcome) -> None:
        """Finish all outputs, even if an error occurs in one of them, and save the run.

        The saved state is the last one that has been written to all outputs. The run is not saved
        if an output cannot be finished. Raises the exception that stopped the run or, if there is
        none, the first error that occurred while writing an output.
        """
        failures = [end.stopped] if end.stopped else []
        for write in (self._open.close, lambda: self._write_whole_path(end), self._write_events):
            try:
                write()
            except OSError as error:
                failures.append(error)
        save = self.files.get("--save")
        if save and end.checkpoint and failures == ([end.stopped] if end.stopped else []):
            write_bytes(save, end.checkpoint)
        if self._shows:
            self._summary.print_output()
            if self._met:
                self._met.print_output()
        if failures:
            raise failures[0]

    def _write_whole_path(self, end: RunOutcome) -> None:
        if not self._collector.pieces:
            return
        path = self._collector.whole_path
        reason = str(end.stopped) if end.stopped else None
        if "--npz" in self.files:
            write_bytes(self.files["--npz"], encode_path_as_npz(path))
        if "--json" in self.files:
            write_bytes(
                self.files["--json"],
                encode_path_as_json(path, self._met, self._build_angle_output_options(), reason),
            )

    def _write_events(self) -> None:
        if self._met and self._met.parts and "--events-csv" in self.files:
            write_bytes(self.files["--events-csv"], self._met.encode_as_csv())
