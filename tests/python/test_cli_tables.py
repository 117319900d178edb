"""Tests of the tables, outputs, signals and summaries of commands."""

import errno
import io
import math
import signal
import sys
import types

import click
import kreisel as kr
import numpy as np
import pytest
from cli_helpers import list_cells_by_column, record_console_calls
from kreisel._cli import (
    outputs,
    progress,
    sweep_command,
    table,
    text_grid,
)
from rich.console import Console
from toolbox import python
from tops import GENERAL

TOP = kr.scenes.asymmetric


@pytest.fixture
def console_calls(monkeypatch):
    return record_console_calls(monkeypatch, text_grid)


class SlowBuffer(io.BytesIO):
    """A stream that writes at most three bytes at a time."""

    flushes = 0

    def write(self, data):
        return super().write(data[:3])

    def flush(self):
        self.flushes += 1


def test_bytes_are_written_completely(tmp_path, monkeypatch):
    buffer = SlowBuffer()
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", types.SimpleNamespace(buffer=buffer))
        outputs.write_bytes("-", b"0123456789")
    assert buffer.getvalue() == b"0123456789" and buffer.flushes == 1
    outputs.write_bytes(str(tmp_path / "a"), b"abc")
    assert (tmp_path / "a").read_bytes() == b"abc"


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ({}, ("q", "m")),
        ({"digits": 16}, ("q", "m")),
        ({"digits": 20}, ("q", "m", "q_low", "m_low")),
        ({"want": ["apex"]}, ("apex",)),
    ],
)
def test_low_words_are_written_beyond_16_digits(words, names):
    path = kr.solve(TOP, 0.1, method="taylor", **words)
    assert tuple(outputs.list_output_quantities(path)) == names


def test_a_csv_file_has_its_head_once():
    columns = {"a": [1, 2], "b": [0.1, 1e-20]}
    assert outputs.encode_table_as_csv(columns) == b"a,b\n1,0.1\n2,1e-20\n"
    assert outputs.encode_table_as_csv(columns, head=False) == b"1,0.1\n2,1e-20\n"


def test_numbers_that_json_lacks_become_null():
    value = {"a": [1.0, math.nan, {"b": -math.inf}], "c": "x", "d": 2}
    assert outputs._replace_nonfinite(value) == {"a": [1.0, None, {"b": None}], "c": "x", "d": 2}


@pytest.mark.parametrize("gravity", [1.5, -1.5])
def test_the_energy_error_of_a_run_is_that_of_its_largest_piece(gravity, capsys):
    scene = GENERAL.replace(gravity=gravity)
    path = kr.solve(scene, np.arange(0.5, 9.0, 0.25), "rk4", step=0.05)
    pieces = [path[:12], path[12:20], path[20:]]
    lever = scene.body.mass * 1.5 * np.linalg.norm(scene.body.com)
    start = float(kr.solve(scene, [0.0]).kinetic[0])
    sizes = [max(start, float(piece.kinetic.max())) + lever for piece in pieces]
    assert outputs._compute_energy_error_scale(pieces[1]) == pytest.approx(sizes[1])
    printer = outputs.RunSummaryPrinter(table.AngleOptions(False, False), False)
    for piece in pieces:
        printer.receive_path_piece(piece)
    printer.print_output()
    changes = [piece.energy_error * size for piece, size in zip(pieces, sizes, strict=True)]
    expected = max(changes) / max(sizes)
    lines = capsys.readouterr().out.splitlines()
    assert (
        lines[0]
        == f"34 states by rk4: {path.stats.steps} steps, {path.stats.evaluations} evaluations"
    )
    assert f"energy error {expected:.2g}" in lines


@pytest.mark.parametrize("count, is_complete", [(19, True), (20, True), (21, False), (25, False)])
def test_a_summary_shows_twenty_events(count, is_complete, console_calls, capsys):
    collector = outputs.EventCollector(("nutation",), False)
    path = kr.solve(kr.scenes.thesis, [200.0], events=kr.events.nutation(max_count=count))
    collector.receive_path_piece(path)
    collector.print_output()
    [(words, grid)] = console_calls
    cells = list_cells_by_column(grid)
    assert words == {"markup": False, "highlight": False} and list(cells) == [
        "event",
        "t",
        "direction",
    ]
    assert cells["t"] == [f"{t: .15g}" for t in path.events.t[:20]]
    assert cells["direction"] == [f"{d:+d}" for d in path.events.direction[:20]]
    text = "" if is_complete else f"... {count - 20} more events: --events-csv writes all\n"
    assert capsys.readouterr().out == text


# Tables of states


@pytest.mark.parametrize("degrees", [False, True])
def test_a_jump_is_a_change_by_more_than_half_a_turn(degrees):
    half = 180.0 if degrees else math.pi
    for values, has_jumps in [
        ([0.0, half], False),
        ([0.0, -half], False),
        ([0.0, 1.001 * half], True),
        ([1.001 * half, 0.0], True),
        ([0.0, 0.9 * half, 1.8 * half], False),
    ]:
        for pieces in ([values], [[value] for value in values]):
            printer = table.StateTablePrinter(table.AngleOptions(degrees, False), False)
            for piece in pieces:
                printer._update_has_jumps({"spin_angle": np.array(piece), "t": np.array([9.0])})
            assert printer._has_jumps is has_jumps


@pytest.mark.parametrize("sizes", [(3,), (19, 1), (20, 1), (21, 21), (1, 45), (7, 30, 2), (45, 30)])
@pytest.mark.parametrize("is_whole", [False, True])
def test_a_table_shows_the_first_and_the_last_twenty_rows(sizes, is_whole, capsys):
    printer = table.StateTablePrinter(table.AngleOptions(False, False), is_whole)
    count = sum(sizes)
    path = kr.solve(TOP, np.arange(1.0 * count), want=["nutation"])
    for begin, size in zip(np.cumsum((0, *sizes[:-1])), sizes, strict=True):
        printer.add_states(path[begin : begin + size], ("nutation",))
    printer.print_table()
    head, *lines = capsys.readouterr().out.splitlines()
    assert head == f"{'t [T]':>14}  nutation [rad]" and printer.rows == count
    rows = [f"{t:>14.8g}  {angle:>14.8g}" for t, angle in zip(path.t, path.nutation, strict=True)]
    if count > 40 and not is_whole:
        rows_text = "1 row" if count == 41 else f"{count - 40} rows"
        note = f"... {rows_text} omitted: --all-rows prints them, --csv writes them"
        rows = [*rows[:20], note, *rows[-20:]]
    assert lines == rows


def test_two_rows_stand_in_columns(console_calls):
    printer = table.StateTablePrinter(table.AngleOptions(True, False), False)
    path = kr.solve(TOP, [1.0, 2.0], want=["nutation"])
    printer.add_states(path, ("nutation",))
    printer.print_table()
    [(words, grid)] = console_calls
    angles = np.degrees(path.nutation)
    assert words == {"markup": False, "highlight": False}
    assert list_cells_by_column(grid) == {
        "": ["t [T]", "nutation [deg]"],
        "first": [" 1", f"{angles[0]: .15g}"],
        "last": [" 2", f"{angles[1]: .15g}"],
    }


@pytest.mark.parametrize("degrees", [False, True])
def test_angles_continue_from_piece_to_piece(degrees):
    path = kr.solve(kr.scenes.thesis, np.arange(0.0, 6.0, 0.1), want=["spin_angle"])
    options = table.AngleOptions(degrees, True)
    angles = [
        options.columns(path[k : k + 7], ["spin_angle"])["spin_angle"] for k in range(0, 60, 7)
    ]
    expected = np.unwrap(path.spin_angle) * (180.0 / math.pi if degrees else 1.0)
    assert np.ptp(expected) > (360.0 if degrees else 2 * math.pi)
    assert np.concatenate(angles) == pytest.approx(expected)
    plain = table.AngleOptions(degrees, False).columns(path, ["spin_angle"])["spin_angle"]
    assert np.ptp(plain) <= (360.0 if degrees else 2 * math.pi)


@pytest.mark.parametrize("degrees", [False, True])
def test_pieces_are_joined_at_their_last_angle(degrees, monkeypatch):
    """Check angles that grow by 0.4 turns from each state to the next."""
    turn = 360.0 if degrees else 2 * math.pi
    angles = 0.4 * np.arange(12.0) * turn
    monkeypatch.setattr(table, "columns", lambda piece, *_: {"spin_angle": np.array(piece)})
    options = table.AngleOptions(degrees, True)
    pieces = [options.columns(angles[k : k + 3] % turn, ["spin_angle"]) for k in (0, 3, 6, 9)]
    assert np.concatenate([piece["spin_angle"] for piece in pieces]) == pytest.approx(angles)
    assert options.columns(np.zeros(0), ["spin_angle"])["spin_angle"].size == 0


@pytest.mark.parametrize("words", [{}, {"digits": 20}, {"want": ["nutation", "apex"]}])
def test_the_pieces_of_a_path_are_joined(words):
    path = kr.solve(TOP, np.arange(6.0), method="taylor", events=kr.events.nutation(), **words)
    collector = outputs.PathCollector()
    for piece in path[:2], path[2:3], path[3:]:
        collector.receive_path_piece(piece)
    whole = collector.whole_path
    names = words.get("want") or outputs.list_output_quantities(path)
    assert np.array_equal(whole.t, path.t) and whole.want == path.want
    for name in names:
        assert np.array_equal(getattr(whole, name), getattr(path, name))
    single = outputs.PathCollector([path])
    assert single.whole_path is path


# Signals and the outcome of a run


@pytest.fixture
def signal_handlers():
    """Install the handlers of `kreisel`. Shells make background processes ignore SIGINT."""
    handlers = dict.fromkeys((signal.SIGINT, signal.SIGTERM), signal.default_int_handler)
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    yield handlers
    for number, handler in before.items():
        signal.signal(number, handler)


def test_the_second_signal_has_its_default_effect(signal_handlers):
    stops = progress.StopSignalHandler(5.0)
    with stops.defer_signals():
        for number in signal_handlers:
            assert signal.getsignal(number) == stops._handle_stop_signal
        assert not stops.asked
        stops._handle_stop_signal(signal.SIGTERM, None)
        assert stops.asked and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
        assert signal.getsignal(signal.SIGINT) == stops._handle_stop_signal
        stops.update_progress_bar(5.0)
        with pytest.raises(KeyboardInterrupt):
            stops.update_progress_bar(4.9)
    assert {number: signal.getsignal(number) for number in signal_handlers} == signal_handlers


@pytest.mark.parametrize("end, t", [(8.0, 2.0), (-8.0, -2.0)])
@pytest.mark.parametrize("is_terminal", [True, False])
def test_a_progress_bar_counts_time_forwards(end, t, is_terminal, monkeypatch):
    words = []

    def make_console(**more):
        words.append(more)
        return Console(file=io.StringIO(), force_terminal=is_terminal)

    monkeypatch.setattr(progress, "Console", make_console)
    stops = progress.StopSignalHandler(end)
    with stops.show_progress():
        assert (stops._bar is not None) == is_terminal and words == [{"stderr": True}]
        stops.update_progress_bar(t)
        if is_terminal:
            [task] = stops._bar.tasks
            assert (task.total, task.completed) == (8.0, 2.0) and stops._bar.live.transient


class CountingRun:
    """A stub of a run that uses the number of computed path pieces as its checkpoint."""

    count = 0

    @property
    def checkpoint(self):
        return self.count

    def compute_pieces(self, pieces):
        for piece in pieces:
            self.count += 1
            if isinstance(piece, BaseException):
                raise piece
            yield piece


def make_piece(t):
    return types.SimpleNamespace(t=np.array([t]))


class ListOutput(list):
    """An output that raises OSError at the time 3, and asks to stop at the time 7."""

    def __init__(self, stops):
        self.stops = stops

    def receive_path_piece(self, piece):
        if piece.t[-1] == 3.0:
            raise OSError(errno.ENOSPC, "full")
        self.stops.asked |= piece.t[-1] == 7.0
        self.append(piece.t[-1])


@pytest.mark.parametrize(
    ("times", "received", "error", "checkpoint"),
    [
        ([1.0, 2.0], [1.0, 2.0], None, 2),
        ([1.0, 3.0, 2.0], [1.0], "[Errno 28] full", 1),
        ([1.0, 7.0, 2.0], [1.0, 7.0], "interrupted at t = 7", 2),
    ],
)
@pytest.mark.parametrize("is_saved", [True, False])
def test_the_outcome_of_a_run_belongs_to_its_last_written_state(
    times, received, error, checkpoint, is_saved
):
    stops, run = progress.StopSignalHandler(9.0), CountingRun()
    output = ListOutput(stops)
    outcome = progress.write_path_pieces_to_outputs(
        [output], run.compute_pieces(map(make_piece, times)), run if is_saved else None, stops
    )
    assert output == received
    assert outcome.checkpoint == (checkpoint if is_saved else None)
    assert (outcome.stopped and str(outcome.stopped)) == error


# Sweeps


@pytest.mark.parametrize(
    ("numbers", "text"),
    [
        ([], ""),
        ([4], "4:5"),
        ([0, 1, 2], "0:3"),
        ([0, 2, 3, 7], "0:1, 2:4, 7:8"),
        (list(range(0, 12, 2)), "0:1, 2:3, 4:5, 6:7, 8:9, 10:11"),
        (list(range(0, 14, 2)), "0:1, 2:3, 4:5, 6:7, 8:9, 10:11, ..."),
    ],
)
def test_numbers_are_shown_as_ranges(numbers, text):
    ranges = list(sweep_command._group_into_ranges(numbers)) if numbers else []
    assert [k for one in ranges for k in one] == numbers
    assert sweep_command._format_ranges(iter(ranges)) == text


@pytest.mark.parametrize(
    "word, parts", [(None, None), ("0:0", range(0)), ("3:3", range(3, 3)), ("2:10", range(2, 10))]
)
def test_parts_are_a_range(word, parts):
    assert sweep_command._parse_parts_option(None, None, word) == parts


@pytest.mark.parametrize("word", ["3", "3:", ":3", "4:3", "-1:3", "a:3", "3:a", "1:2:3"])
def test_other_parts_are_refused(word):
    with pytest.raises(click.BadParameter, match="is not a range of parts"):
        sweep_command._parse_parts_option(None, None, word)


def test_a_summary_of_a_sweep_counts_parts_tops_and_bytes(tmp_path):
    (tmp_path / "part-0").write_bytes(bytes(1_500_000))
    (tmp_path / "part-1").write_bytes(bytes(250_000))
    (tmp_path / "plan.json").write_bytes(bytes(900_000))
    sweep = types.SimpleNamespace(folder=tmp_path, parts=7, size=420, hash="0123456789abcdefXYZ")
    assert sweep_command._format_sweep_summary(sweep, [1, 3]) == (
        f"{tmp_path}: 2 of 7 parts, 420 tops in all, 1.75 MB; plan 0123456789abcdef"
    )


@pytest.mark.parametrize("is_terminal", [True, False])
def test_the_progress_bar_of_a_sweep_shows_its_share(monkeypatch, is_terminal):
    console, bars = Console(file=io.StringIO(), force_terminal=is_terminal), []
    create = sweep_command.Progress

    def create_bar(*columns, **words):
        bars.append((create(*columns, **words), words))
        return bars[-1][0]

    monkeypatch.setattr(sweep_command, "Console", lambda stderr: console if stderr else None)
    monkeypatch.setattr(sweep_command, "Progress", create_bar)
    with sweep_command._open_progress_bar() as watch:
        assert (watch is not None) == is_terminal
        [(bar, words)] = bars
        assert words["transient"] is True and words["speed_estimate_period"] == 1e9
        if watch:
            watch(0.25)
            [task] = bar.tasks
            assert (task.total, task.completed) == (1.0, 0.25)


WORKER = """
import os, signal, sys
from kreisel._cli import sweep_command
set_timer, timers = signal.setitimer, []
signal.setitimer = lambda *words: timers.append(words)
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT, signal.SIGTERM])
sweep_command.prepare_worker_process()
assert not signal.pthread_sigmask(signal.SIG_BLOCK, [])
os.kill(os.getpid(), getattr(signal, sys.argv[1]))
print("alive", flush=True)
for which, seconds in timers:
    assert seconds > 1.0
    set_timer(which, 1e-3)
    signal.pause()
"""


@pytest.mark.parametrize(("name", "end"), [("SIGINT", 0), ("SIGTERM", -signal.SIGALRM)])
def test_workers_ignore_ctrl_c_and_end_a_moment_after_sigterm(name, end):
    result = python(WORKER, name)
    assert (result.stdout, result.returncode) == ("alive\n", end), result.stderr
