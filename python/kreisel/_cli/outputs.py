"""Writers of the output files of a run, and of the printed summary."""

from __future__ import annotations

import json
import math
import sys
import tomllib
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Protocol

import click
import numpy as np
from rich import box
from rich.table import Table as Grid

from .._core import values as values_of
from .._core import version
from .._options.quantities import LOW, TIME
from .._results.path import Events, Path
from .._results.serialization import encode_path_as_archive
from .._results.state_quantities import NO_STATES
from .._results.tables import (
    build_quantity_value_pairs,
    columns,
    encode_table_as_csv,
    format_column_heads,
)
from .._utils.atomic_io import atomic_open, atomic_write
from .._utils.counts import format_count
from .._utils.validation import Array
from .table import AngleOptions, StateTablePrinter
from .text_grid import print_text_grid

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
    quantities, units = {"t": path.t.tolist()}, {"t": TIME.dimension}
    for quantity, values in build_quantity_value_pairs(
        path, list_output_quantities(path), angles.degrees, angles.unwrap
    ):
        quantities[quantity.name] = _replace_nonfinite(values.tolist())
        units[quantity.name] = quantity.dimension
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
