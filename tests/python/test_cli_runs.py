"""Tests of command-line runs that are interrupted, saved and resumed."""

import errno
import io
import os
import signal
import subprocess
import sys
import threading

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, join_lines, make_raiser
from click.testing import CliRunner
from ensembles import same_bits
from internals import cli
from kreisel._cli import outputs, progress
from rich.console import Console
from toolbox import HEEDING, python

COMPARED = "compare asymmetric --t 1 --methods rk4 --steps 0.1 --repeats 1"

TOP = kr.scenes.asymmetric
signals = pytest.mark.skipif(os.name != "posix", reason="needs signals")


def rows(text):
    return np.array([row.split(",") for row in text.splitlines()[1:]], float)


HOW = {
    "strang": "--method strang --step 0.1",
    "strang want": "--method strang --step 0.1 --want nutation,energy",
    "taylor": "--method taylor",
    "taylor 20": "--method taylor --digits 20 --want q,q_low",
    "tol": "--method extrap --tol 1e-9",
}


@pytest.mark.parametrize("options", HOW.values(), ids=HOW)
@pytest.mark.parametrize("times", ["0:{}:0.25", "0:-{}:0.25", "0:{}:0.1"])
def test_a_resumed_run_has_the_same_bits(tmp_path, options, times):
    run, whole, half = tmp_path / "run", times.format(20), times.format(10.1)
    at_once = rows(call(f"solve asymmetric --t {whole} {options} --csv -"))
    first = rows(call(f"solve asymmetric --t {half} {options} --csv - --save", run))
    second = rows(call(f"resume {run} --t {whole} --csv - --save", run))
    assert same_bits(np.concatenate([first, second]), at_once)
    assert kr.resume(run).t == at_once[-1, 0]


def test_a_resumed_run_counts_turns_from_its_first_state(tmp_path):
    line, run = "solve asymmetric --want spin_angle --csv -", tmp_path / "run"
    whole = rows(call(f"{line} --t 0:50:0.05 --unwrap"))
    call(f"{line} --t 20 --save", run)
    rest = rows(call(f"resume {run} --t 0:50:0.05 --unwrap --csv -"))
    assert rest[0, 1] == rows(call(f"{line} --t 0:50:0.05"))[-len(rest), 1]
    turns = (whole[-len(rest) :, 1] - rest[:, 1]) / (2.0 * np.pi)
    assert np.round(turns[0]) != 0.0 and turns == pytest.approx(np.round(turns[0]), abs=1e-12)
    assert "counts whole turns from the first state" in join_lines(call("resume --help"))


def test_a_resumed_run_continues_every(tmp_path):
    run, options = tmp_path / "run", "--every 3 --csv -"
    first = rows(call(f"solve thesis --t 1 --method rk4 --step 0.1 {options} --save", run))
    second = rows(call(f"resume {run} --t 2 {options}"))
    assert np.array_equal(second, rows(call(f"resume {run} --t 2 {options} --npz", tmp_path / "a")))
    path = kr.solve(kr.scenes.thesis, 2, "rk4", step=0.1, every=3)
    assert np.array_equal(np.concatenate([first, second]), path.states)


def test_resume_with_one_time_returns_the_state_at_this_time(tmp_path):
    run = tmp_path / "run"
    call("solve thesis --t 5 --save", run)
    assert rows(call(f"resume {run} --t 7 --csv -"))[:, 0].tolist() == [7]
    output = call(f"resume - --t 7 --json {tmp_path}/a.json", text=run.read_bytes())
    assert "1 state by exact" in output


@pytest.mark.parametrize(
    "words, message",
    [
        ("resume {run} --t 5", "has already reached t = 5.0"),
        ("resume {run} --t 0:4:1", "has already reached t = 5.0"),
        ("resume {run} --t -9", "goes back"),
        ("resume {run} --t 9 --max-steps -1", "Error: --max-steps must be at least 0"),
        ("solve thesis --t 9 --max-steps -1", "Error: --max-steps must be at least 0"),
        ("resume {run} --t 9 --every 2", "every needs a method of fixed step"),
        ("resume {run} --t 9 --csv {run}/a", "there is no folder"),
        ("resume {toml} --t 9", "is not a saved run"),
        ("resume /dev/zero --t 9", "is not a saved run"),
        ("resume nothing --t 9", "No such file"),
        (
            "solve thesis --t 9 --method geometric --error 1e-3 --save a",
            "--save needs a single method",
        ),
        ("solve thesis --t 9 --error 1e-3 --save a", "--save needs a single method"),
    ],
)
def test_invalid_resumptions_are_refused(tmp_path, words, message):
    names = {"run": tmp_path / "run", "toml": tmp_path / "top.toml"}
    call("solve thesis --t 5 --save", names["run"])
    TOP.to_toml(names["toml"])
    output = call(words.format(**names), code=2)
    assert message in join_lines(output) and output.count("\n") == 1


def test_a_failed_run_keeps_its_states_and_can_be_resumed(tmp_path):
    run, csv = tmp_path / "run", tmp_path / "part.csv"
    line = "solve thesis --t 10 --method rk4 --step 0.1 --every 2 --max-steps 5 --csv"
    assert "largest number of steps" in call(line, csv, "--save", run, code=1)
    assert rows(csv.read_text())[:, 0].tolist() == [0.0, 0.2, 0.4, 0.5]
    assert "largest number" in call(f"resume {run} --t 1", code=1)
    rest = rows(call(f"resume {run} --t 1 --every 2 --max-steps 50 --csv -"))
    path = kr.solve(kr.scenes.thesis, 1, "rk4", step=0.1, every=2)
    assert np.array_equal(rest, path.states[3:])


@signals
@pytest.mark.parametrize("is_buffered", [True, False])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_between_rows_neither_loses_nor_repeats_rows(tmp_path, number, is_buffered):
    words = (
        f"solve asymmetric --t 0:1e6:0.05 --method strang --step 0.1 --csv - --save {tmp_path}/run"
    )
    start = f"{HEEDING}from kreisel._cli import main\nmain()"
    with subprocess.Popen(
        [sys.executable, "-c", start, *words.split()],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=os.environ | ({} if is_buffered else {"PYTHONUNBUFFERED": "1"}),
        text=True,
    ) as run:
        text = run.stdout.readline() + run.stdout.readline()
        run.send_signal(number)
        text += run.stdout.read()
        assert run.wait(60) == 130
        assert run.stderr.read().count("\n") == 1
    first = rows(text)
    end = float(first[-1, 0]) + 100
    rest = rows(call(f"resume {tmp_path}/run --t 0:{end!r}:0.05 --csv -"))
    states = np.concatenate([first, rest])
    grid = np.isin(states[:, 0], np.arange(len(states)) * 0.05)
    assert (~grid).sum() <= 1  # the last valid state may lie between two requested times
    path = kr.solve(TOP, np.arange(grid.sum()) * 0.05, "strang", step=0.1)
    assert np.array_equal(states[grid], path.states)


PRESSED = """
import os, signal
from kreisel._cli import main, progress

tell = progress.StopSignalHandler.update_progress_bar
def press(stops, t):
    os.kill(os.getpid(), signal.SIGNAL)
    tell(stops, t)
progress.StopSignalHandler.update_progress_bar = press
main()
"""


@signals
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize(
    "options",
    [
        "--method rk4 --step 1e-3 --save run",
        "--method taylor --want energy --save run",
        "--events nutation:max_count=1 --events-csv events.csv",
    ],
)
def test_a_signal_keeps_the_computed_states(tmp_path, name, options):
    line = f"solve asymmetric --t 1e7 {options} --csv part.csv --json part.json --npz part.npz"
    result = python(PRESSED.replace("SIGNAL", name), *line.split(), cwd=tmp_path)
    assert result.returncode == 130 and result.stderr.startswith("Error: interrupted")
    assert result.stderr.count("\n") == 1
    states = rows((tmp_path / "part.csv").read_text())
    assert len(states) == 2 and 0 < states[1, 0] < 1e7
    assert all((tmp_path / f"part.{ending}").stat().st_size for ending in ("json", "npz"))
    if "--save" in options:
        assert kr.resume(tmp_path / "run").t == states[1, 0]
    else:
        assert len((tmp_path / "events.csv").read_text().splitlines()) == 2


@signals
def test_a_signal_during_writing_ends_the_run_after_complete_rows(tmp_path, monkeypatch):
    add, numbers = outputs.CsvOutput.receive_path_piece, [signal.SIGTERM]

    def add_and_signal(csv, piece):
        if numbers:
            os.kill(os.getpid(), numbers.pop())
        add(csv, piece)

    monkeypatch.setattr(outputs.CsvOutput, "receive_path_piece", add_and_signal)
    output = call("solve asymmetric --t 0:1e4:1 --csv", tmp_path / "part.csv", code=130)
    last = rows((tmp_path / "part.csv").read_text())[-1, 0]
    assert join_lines(output).endswith(f"Error: interrupted at t = {last:g} ")


@signals
def test_an_ignored_sigterm_stays_ignored():
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with cli.main_command.convert_sigterm_to_interrupt():
            assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("end", [10.0, -10.0])
def test_a_terminal_shows_the_share_of_the_computed_time(monkeypatch, end):
    console = Console(file=io.StringIO(), force_terminal=True)
    monkeypatch.setattr(progress, "Console", lambda stderr: console)
    stops = progress.StopSignalHandler(end)
    with stops.show_progress():
        stops.update_progress_bar(0.25 * end)
        [task] = stops._bar.tasks
        assert task.percentage == 25.0


@signals
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_ends_other_commands_in_one_line(name, tmp_path):
    line = "compare asymmetric --t 1e9 --methods rk4 --steps 1e-3 --truth rk4"
    program = f"""
import os, signal
from kreisel._cli import compare_command, main

compare_methods = compare_command.compare_methods
def press(*words):
    os.kill(os.getpid(), signal.{name})
    return compare_methods(*words)
compare_command.compare_methods = press
main()
"""
    result = python(program, *line.split(), cwd=tmp_path)
    assert result.returncode == 130 and result.stderr.startswith("Error: interrupted")
    assert result.stderr.count("\n") == 1


@signals
def test_ignored_ctrl_c_stays_ignored(tmp_path):
    code = PRESSED.replace("SIGNAL", "SIGINT").replace(
        "main()", "signal.signal(signal.SIGINT, signal.SIG_IGN)\nmain()"
    )
    line = "solve asymmetric --t 10 --method rk4 --step 1e-3"
    assert python(code, *line.split(), cwd=tmp_path).returncode == 0


def test_the_archive_of_a_stopped_run_with_events_can_be_loaded(tmp_path):
    line = "solve asymmetric --t 0:50:1 --events nutation --max-steps 20 --npz"
    call(line, tmp_path / "a.npz", code=1)
    with pytest.raises(kr.Error) as error:
        kr.solve(TOP, np.arange(51.0), events=[kr.events.nutation()], max_steps=20)
    path, again = error.value.path, kr.load(tmp_path / "a.npz")
    assert np.array_equal(again.states, path.states) and len(again.events) == len(path.events) > 0
    assert np.array_equal(again.events.states, path.events.states)


def test_a_run_with_events_is_saved_and_resumed(tmp_path):
    run, event_options = (
        tmp_path / "run",
        "--events nutation --events crossing:apex_x --events-csv -",
    )
    whole = call(f"solve asymmetric --t 40 {event_options}").splitlines()
    first = call(f"solve asymmetric --t 17 {event_options} --save", run).splitlines()
    second = call(f"resume {run} --t 40 --events-csv -").splitlines()
    assert first[0] == second[0] == whole[0] and len(whole) > 10
    event_rows = [row.partition(",")[2] for row in [*first[1:], *second[1:]]]
    assert event_rows == [row.partition(",")[2] for row in whole[1:]]


def test_a_run_that_a_terminal_event_ended_is_not_resumed(tmp_path):
    run, csv_file = tmp_path / "run", tmp_path / "a.csv"
    call("solve asymmetric --t 40 --events nutation:terminal --save", run, "--csv", csv_file)
    [end] = kr.solve(TOP, 40.0, events=[kr.events.nutation(terminal=True)]).events.t.tolist()
    rows_before = csv_file.read_text()
    output = call(f"resume {run} --t 80 --csv", csv_file, code=2)
    assert f"the run has ended at t = {end!r}, where a terminal event" in join_lines(output)
    assert csv_file.read_text() == rows_before


def test_geometric_refuses_events():
    line = "solve asymmetric --t 1 --method geometric --error 1e-6 --events nutation"
    assert "--events need taylor" in join_lines(call(line, code=2))


def test_a_stopped_comparison_shows_its_finished_rows(monkeypatch):
    table = kr.compare(TOP, 1, ["taylor"])

    def stop_comparison(*_):
        raise kr.CompareInterrupted("interrupted: one of two methods", table)

    monkeypatch.setattr(cli.compare_command, "compare_methods", stop_comparison)
    output = call("compare asymmetric --t 1", code=130)
    assert "taylor" in output and "Error: interrupted: one of two" in join_lines(output)


# Boundary values


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (KeyboardInterrupt(), 130, "Error: interrupted"),
        (KeyboardInterrupt("at t = 3"), 130, "Error: at t = 3"),
        (OSError(errno.ENOSPC, "No space left on device"), 1, "No space left on device"),
        (OSError(errno.EPIPE, "Broken pipe"), 1, ""),
    ],
)
def test_exceptions_end_a_command_with_one_line_and_an_exit_code(monkeypatch, error, code, words):
    monkeypatch.setattr(cli.compare_command, "compare_methods", make_raiser(error))
    output = call(COMPARED, code=code)
    assert words in output and output.count("\n") == (1 if words else 0)


@pytest.mark.parametrize("line", ["scenes", "solve asymmetric --t 1"])
def test_a_command_runs_in_another_thread_too(line):
    results = []
    thread = threading.Thread(
        target=lambda: results.append(CliRunner().invoke(cli.main, line.split()))
    )
    thread.start()
    thread.join()
    assert results[0].exit_code == 0 and join_lines(results[0].output) == join_lines(call(line))


def test_the_summary_of_a_run_without_states_has_no_table(capsys):
    printer = outputs.RunSummaryPrinter(outputs.AngleOptions(False, False), False)
    printer.receive_path_piece(kr.solve(TOP, []))
    printer.print_output()
    assert capsys.readouterr().out == "0 states by taylor: 0 steps, 0 evaluations\n"
