"""`kreisel solve` and `kreisel resume`, and the outputs of their runs."""

from __future__ import annotations

import json
import math
import signal
import tomllib
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from textwrap import wrap
from typing import Any

import click
import numpy as np

from .._core import values as values_of
from .._core import version
from .._model.scene import Scene, list_scene_file_keys
from .._options import options
from .._results import tables
from .._results.path import Events, Path, join_events, join_paths
from .._results.results import Error, Interrupted
from .._solve.run import Run, start
from .._solve.run import resume as resume_run
from .._solve.solve import solve as solve_scene
from .._utils.arguments import Array, as_int, format_count
from .._utils.files import atomic_open
from .._utils.processes import replace_signal_handlers
from . import options as cli
from .options import SCENE, TimeSequence, UsageError, command, print_table, write_bytes

_FILES = "csv", "json", "npz", "events_csv", "save"
_ENDS = 20  # rows printed at each end of a table that is not printed as a whole
_SHOWN = 20  # largest number of events that are printed
_WIDTH = 14  # smallest width of a column: 8 digits, a sign and an exponent
_LONGEST = 1 << 24  # bytes read at most from a checkpoint; checkpoints are much smaller


class RunOutputs:
    """The outputs of a run, whose options are taken out of `words`; its path comes in pieces."""

    def __init__(self, words: dict[str, Any], event_names: tuple[str, ...], end: float) -> None:
        given = {name: words.pop(name) for name in _FILES}
        self.files: dict[str, str] = {name: file for name, file in given.items() if file}
        if "events_csv" in self.files and not event_names:
            raise UsageError("--events-csv needs --events")
        self._degrees, self._unwrap = words.pop("degrees"), words.pop("unwrap")
        self._event_names, self._end, self._is_stopped = event_names, end, False
        table = _StateTable(words.pop("all_rows"))
        self._table = None if "-" in self.files.values() else table
        self._open = ExitStack()
        self._append: Callable[[bytes], None] | None = None
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
        # If an exception leaves the stack, files that are still open stay as they were.
        with replace_signal_handlers((signal.SIGINT, signal.SIGTERM), stop), self._open:
            try:
                with cli.show_progress(abs(self._end)) as self._update_bar:
                    failure, checkpoint = self._write_pieces(pieces, saved)
            except MemoryError:
                raise click.ClickException("not enough memory") from None
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
        states = ("q", "m", *options.LOW) if (piece.digits or 0) > 16 else ("q", "m")
        self._names: tuple[str, ...] = piece.want or states
        heads, table = {}, {}
        if "csv" in self.files or self._table:
            whole = piece._tabulate(self._names, self._degrees, False)
            heads, table = whole.list_heads(), whole.flatten()
            self._unwrap_angles(table)
        if "csv" in self.files:
            rows = {heads[name]: column.tolist() for name, column in table.items()}
            data = tables.encode_table_as_csv(rows, head=self._append is None)
            if self._append is None and self.files["csv"] == "-":
                self._append = partial(write_bytes, "-")
            elif self._append is None:
                file = self._open.enter_context(atomic_open(self.files["csv"]))
                self._append = file.append_bytes
            self._append(data)
        if self._table:
            self._table.add_piece(piece, heads, table)
        if self._event_names:
            self._events.append(piece.events)
        if self.needs_whole_path:
            self._pieces.append(piece)

    def _unwrap_angles(self, table: dict[str, Array]) -> None:
        """Unwrap angles that follow those of earlier pieces, or note that angles jump."""
        turn = 360.0 if self._degrees else 2.0 * np.pi
        for name in options.ANGLES & table.keys() if len(table["t"]) else ():
            angles = np.append(self._last_angles.get(name, []), table[name])
            if self._unwrap:
                angles = np.unwrap(angles, period=turn)
                table[name] = angles[-len(table["t"]) :]
            elif self._table and (np.abs(np.diff(angles)) > turn / 2.0).any():
                self._table.has_jumps = True
            self._last_angles[name] = angles[-1:]

    def _finish(self, failure: BaseException | None, checkpoint: bytes | None) -> None:
        """Finish all outputs, even if an error occurs in one of them."""
        failures = [failure] if failure else []

        def write_whole_path() -> None:
            if self._pieces:
                path = join_paths(self._pieces)
                if "npz" in self.files:
                    write_bytes(self.files["npz"], tables.encode_as_archive(path))
                if "json" in self.files:
                    write_bytes(self.files["json"], self._encode_as_json(path, failure))

        def write_events() -> None:
            if self._events and "events_csv" in self.files:
                data = tables.encode_table_as_csv(self._tabulate_events(has_units=True))
                write_bytes(self.files["events_csv"], data)

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
                columns, head = self._tabulate_events(), ("event", "t", "direction")
                rows = [*zip(*map(columns.get, head), strict=True)]
                cells = [(name, f"{t:.15g}", f"{sign:+d}") for name, t, sign in rows[:_SHOWN]]
                print_table(head, cells, head[1:])
                if rows[_SHOWN:]:
                    click.echo(f"... {len(rows) - _SHOWN} more events: --events-csv writes all")
        if failures:
            raise failures[0]

    def _tabulate_events(self, has_units: bool = False) -> dict[str, list[Any]]:
        events = join_events(self._events)
        whole = events.path._tabulate(self._names, self._degrees, False)
        heads, table = whole.list_heads(), whole.flatten()
        named = {heads[n] if has_units else n: column.tolist() for n, column in table.items()}
        (head, times), *others = named.items()
        names = [self._event_names[i] for i in events.which]
        signs = events.direction.tolist()
        return {"event": names, head: times, "direction": signs, **dict(others)}

    def _encode_as_json(self, path: Path, failure: BaseException | None) -> bytes:
        """Return a path in JSON format, together with its scene and options."""
        document: dict[str, Any] = {
            "kreisel": version,
            "scene": tomllib.loads(path.scene.to_toml()),
            **{name: getattr(path, name) for name in ("method", "step", "tol", "digits")},
            "stats": path.stats._asdict(),
            "stopped": str(failure) if failure else None,
            "units": {},
        }
        for column in tables.list_quantity_columns(path, self._names, self._degrees, self._unwrap):
            document["units"][column.name] = column.unit
            document[column.name] = _replace_nonfinite(column.values.tolist())
        if self._event_names:
            document["events"] = _replace_nonfinite(self._tabulate_events())
        return (json.dumps(document, allow_nan=False) + "\n").encode()


def _replace_nonfinite(value: Any) -> Any:
    """Replace infinities and NaN by None, because JSON cannot represent them."""
    if isinstance(value, dict):
        return {name: _replace_nonfinite(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_replace_nonfinite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


class _StateTable:
    """The summary of a run: its costs, its first and last states or all, and its energy error."""

    def __init__(self, is_whole: bool) -> None:
        self.last_piece: Path | None = None
        self.has_jumps = False
        self._heads: list[str] = []
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
        self._heads = [*heads.values()]
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
        path, count, heads = self.last_piece, self._count, self._heads
        assert path is not None
        steps = format_count(path.stats.steps, "step")
        evaluations = format_count(path.stats.evaluations, "evaluation")
        click.echo(f"{format_count(count, 'state')} by {path.method}: {steps}, {evaluations}")
        if 0 < count <= 2:
            ends = ([f"{x:.15g}" for x in row] for row in (self._first[0], self._first[-1]))
            print_table(("", "first", "last"), [*zip(heads, *ends, strict=True)], ("first", "last"))
        elif count:
            widths = [max(_WIDTH, len(head)) for head in heads]
            rows = [[f"{value:.8g}" for value in row] for row in (*self._first, *self._last)]
            lines = ["  ".join(map(str.rjust, row, widths)) for row in (heads, *rows)]
            if omitted := count - len(rows):
                what = format_count(omitted, "row")
                note = f"... {what} omitted: --all-rows prints them, --csv writes them"
                lines.insert(1 + _ENDS, note)
            if self.has_jumps:
                lines.append("angles jump by whole turns: --unwrap makes them continuous")
            click.echo("\n".join(lines))
        if self._energy_scale:
            click.echo(f"energy error {self._energy_change / self._energy_scale:.2g}")
        if path.plan.choice:
            click.echo(str(path.plan.choice))


def _describe_scene_files() -> str:
    """Return the keys of scene files, for the end of a help text."""
    lines = ["\b", "Keys of SCENE files (TOML)"]
    for table, keys in list_scene_file_keys().items():
        text = f"{table or 'the file':<17} {', '.join(keys)}"
        lines += wrap(text, 78, initial_indent="  ", subsequent_indent=" " * 20)
    return "\n".join(lines)


@command("solve thesis --t 0:10:0.1 --csv path.csv", epilog=_describe_scene_files())
@click.argument("scene", type=SCENE)
def solve(scene: Scene, t: TimeSequence, events: tuple[str, ...], **words: Any) -> None:
    """Compute the motion of a scene.

    If the computation fails or is interrupted, the output files contain all states up to the last
    valid one. Memory use is constant except with --json, --npz, --all-rows, --events, --error or
    the method geometric.
    """
    outputs = RunOutputs(words, events, t.end)
    event_functions = [cli.parse_event(scene, text) for text in events] or None
    if words["method"] != "geometric" and words["error"] is None:
        every = words.pop("every")
        del words["error"]
        run = start(scene, **words, events=event_functions, back=t.end < 0.0)
        outputs.write_path(_iterate_path_pieces(run, t, every, outputs), run)
        return
    if "save" in outputs.files:
        raise UsageError("--save needs a single method; geometric and --error cannot be saved")
    if events:
        raise UsageError("--events need taylor, and cannot be combined with geometric or --error")
    report = outputs.report_progress
    outputs.write_path(
        solve_scene(scene, times, progress=report, **words) for times in [t.to_solve_argument()]
    )


@command("resume run.kreisel --t 20 --csv rest.csv")
@click.argument("run", type=cli.InputFile(allow_dash=True))
def resume(
    run: str, t: TimeSequence, every: int | None, max_steps: int | None, **words: Any
) -> None:
    """Continue a saved RUN; the results are bitwise identical to those of an uninterrupted run.

    RUN is a file written by --save. Times up to the saved state are ignored, so --t can be the same
    as for the whole run. --save can overwrite the file RUN. Two outputs differ from those of an
    uninterrupted run: --unwrap counts whole turns from the first state of this command, and events
    are called event 1, event 2 and so on, in the order of --events.
    """
    if max_steps is not None:
        as_int("max_steps", max_steps, 0)
    try:
        if run == "-":
            data = cli.get_binary_stdin().read(_LONGEST)
        else:
            with open(run, "rb") as stream:
                data = stream.read(_LONGEST)
        top = resume_run(data, max_steps=max_steps)
    except OSError as error:
        raise UsageError(str(error)) from None
    except ValueError as error:
        raise UsageError(f"{run}: {error}") from None
    event_names = tuple(f"event {i + 1}" for i in range(len(top.events or ())))
    outputs = RunOutputs(words, event_names, t.end)
    outputs.write_path(_iterate_path_pieces(top, t, every, outputs), top)


def _iterate_path_pieces(
    run: Run, t: TimeSequence, every: int | None, outputs: RunOutputs
) -> Iterator[Path]:
    """Return an iterator over the parts of a path, starting at the current time of the run."""
    options.check_resolvable_horizon(run.scene, t.end, run.step)
    if run.ended:
        raise UsageError(f"the run has ended at t = {run.t!r}, where a terminal event occurred")
    rest = t if run._fresh else t.select_later_times(run.t)
    if not rest.grids:
        raise UsageError(f"the run has already reached t = {run.t!r}: give a later --t")
    size = run._options.bytes_per_state + 8
    times: float | Array | Iterator[float] = iter(rest)
    if not t.one:
        if outputs.needs_whole_path:
            options.check_states_fit_in_memory(len(rest), size)
    elif every is None:
        times = np.array([0.0, t.end] if run._fresh else [t.end])
    elif outputs.needs_whole_path:  # refuse times that would not fit in memory
        number = options.validate_recording_interval(run._options.integrator, every)
        whole = options.time_array(t.end, run.step, number, size)
        times, every = whole if run._fresh else whole[np.abs(whole) > abs(run.t)], None
    else:
        times = t.end
    return run.stream(times, every=every, progress=outputs.report_progress)
