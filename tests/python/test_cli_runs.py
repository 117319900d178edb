"""Runs of the command line that fail, are stopped by signals, or show their progress."""

import os
import pty
import re
import signal
import subprocess
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import PLAN, PROGRAM, call, join_lines, read_csv, start_process
from toolbox import HANG

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs signals")
TOP = kr.scenes.asymmetric


# Failures


def test_a_failed_run_keeps_its_states_and_can_be_resumed(tmp_path):
    run, csv = tmp_path / "run", tmp_path / "part.csv"
    line = "solve thesis --t 10 --method rk4 --step 0.1 --every 2 --max-steps 5 --csv"
    assert "largest number of steps" in call(line, csv, "--save", run, code=1)
    assert read_csv(csv.read_text())["t [T]"].tolist() == [0.0, 0.2, 0.4, 0.5]
    assert "largest number" in call(f"resume {run} --t 1", code=1)
    rest = read_csv(call(f"resume {run} --t 1 --every 2 --max-steps 50 --csv -"))
    path = kr.solve(kr.scenes.thesis, 1, "rk4", step=0.1, every=2)
    assert np.array_equal(np.column_stack([*rest.values()]), path.states[3:])


def test_a_failed_run_writes_its_events_and_the_reason(tmp_path):
    line = "solve asymmetric --t 0:50:1 --events nutation --max-steps 20"
    call(f"{line} --npz {tmp_path}/a.npz --json {tmp_path}/a.json", code=1)
    with pytest.raises(kr.Error) as error:
        kr.solve(TOP, np.arange(51.0), events=[kr.events.nutation()], max_steps=20)
    path, again = error.value.path, kr.load(tmp_path / "a.npz")
    assert np.array_equal(again.states, path.states) and len(again.events) == len(path.events) > 0
    assert np.array_equal(again.events.states, path.events.states)
    assert '"stopped": null' not in (tmp_path / "a.json").read_text()


def test_a_run_that_a_terminal_event_ended_is_not_resumed(tmp_path):
    run, csv = tmp_path / "run", tmp_path / "a.csv"
    call("solve asymmetric --t 40 --events nutation:terminal --save", run, "--csv", csv)
    [end] = kr.solve(TOP, 40.0, events=[kr.events.nutation(terminal=True)]).events.t.tolist()
    rows = csv.read_text()
    output = call(f"resume {run} --t 80 --csv", csv, code=2)
    assert f"ended at t = {end!r}" in join_lines(output) and csv.read_text() == rows


# Signals


@pytest.mark.parametrize(
    ("number", "options"),
    [
        (signal.SIGINT, "--method strang --step 0.1"),
        (signal.SIGTERM, "--method taylor --want nutation,m --events nutation:max_count=9"),
    ],
)
def test_a_signal_between_rows_neither_loses_nor_repeats_rows(tmp_path, number, options):
    line = f"solve asymmetric --t 0:1e5:0.05 {options} --csv - --save {tmp_path}/run"
    with start_process(f"{line} --json {tmp_path}/a.json --npz {tmp_path}/a.npz") as run:
        text = run.stdout.readline() + run.stdout.readline()
        run.send_signal(number)
        text += run.stdout.read()
        assert run.wait(HANG) == 130
        assert re.fullmatch(r"Error: interrupted at t = .+\n", run.stderr.read())
    first = read_csv(text)
    last = float(first["t [T]"][-1])
    assert kr.resume(tmp_path / "run").t == kr.load(tmp_path / "a.npz").t[-1] == last < 1e5
    assert '"stopped": "interrupted' in (tmp_path / "a.json").read_text()[:2000]
    rest = read_csv(call(f"resume {tmp_path}/run --t 0:{last + 100!r}:0.05 --csv -"))
    rows = {head: np.concatenate([first[head], rest[head]]) for head in first}
    is_asked = np.isin(rows["t [T]"], np.arange(len(rows["t [T]"])) * 0.05)
    assert (~is_asked).sum() <= 1  # the last valid state may lie between two requested times
    whole = f"solve asymmetric --t 0:{last + 100!r}:0.05 {options} --csv -"
    expected = read_csv(call(whole))
    assert all(np.array_equal(rows[head][is_asked], expected[head]) for head in expected)


def test_an_ignored_ctrl_c_stays_ignored():
    program = PROGRAM.replace("signal.default_int_handler", "signal.SIG_IGN")
    assert program != PROGRAM
    with start_process("solve asymmetric --t 0:1000:0.05 --csv -", program) as run:
        run.stdout.readline()
        run.send_signal(signal.SIGINT)
        rows = run.stdout.read().splitlines()
        assert run.wait(HANG) == 0 and len(rows) == 20001 and run.stderr.read() == ""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_other_commands_in_one_line(tmp_path, number):
    """Send a signal to a command that has opened its scene, which is a pipe."""
    os.mkfifo(tmp_path / "top")
    line = f"compare {tmp_path}/top --t 1e9 --methods rk4 --steps 1e-3 --truth rk4"
    with start_process(line) as run, open(tmp_path / "top", "w") as pipe:
        pipe.write(TOP.to_toml())
        pipe.close()
        run.send_signal(number)
        assert run.wait(HANG) == 130
        assert re.fullmatch(r"Error: interrupted.*\n", run.stderr.read())


def test_a_command_runs_in_another_thread_and_keeps_an_ignored_sigterm():
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with ThreadPoolExecutor() as pool:
            output = pool.submit(call, "solve asymmetric --t 1").result()
        assert output == call("solve asymmetric --t 1")
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGTERM, before)


# Progress


def read_screen(screen):
    """Return the bytes written since the last call, or b"" at the end of the stream."""
    try:
        return screen.read(4096)
    except OSError:
        return b""


@pytest.mark.parametrize(
    ("line", "number"),
    [
        ("solve asymmetric --t 0:-3000:0.05", None),
        ("sweep plan.toml --folder runs", None),
        ("solve asymmetric --t 1e7 --method rk4 --step 1e-3 --csv a --save run", signal.SIGINT),
        ("solve asymmetric --t 1e7 --method rk4 --step 1e-3 --csv a --save run", signal.SIGTERM),
    ],
)
def test_a_terminal_shows_the_progress_of_a_command_until_a_signal(line, number, tmp_path):
    (tmp_path / "plan.toml").write_text(PLAN)
    terminal, run_side = pty.openpty()
    options = {"stderr": run_side, "stdout": subprocess.DEVNULL, "cwd": tmp_path}
    with os.fdopen(terminal, "rb", buffering=0) as screen, start_process(line, **options) as run:
        os.close(run_side)
        output = read_screen(screen)
        if number:
            run.send_signal(number)
        output += b"".join(iter(partial(read_screen, screen), b""))
        assert run.wait(HANG) == (130 if number else 0)
    assert (b"Error: interrupted" if number else b"100%") in output
    if number:
        last = read_csv((tmp_path / "a").read_text())["t [T]"][-1]
        assert 0 < kr.resume(tmp_path / "run").t == last < 1e7
