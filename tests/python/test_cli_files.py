"""Output files of the command line: standard streams, pipes, full disks and lack of memory."""

import io
import json
import os
from functools import partial

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, invoke, read_csv, run_process, start_process
from toolbox import HANG

needs_full = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")


def test_archives_and_runs_can_go_to_standard_output():
    archive = invoke(["solve", "thesis", "--t", "1", "--npz", "-"]).stdout_bytes
    with np.load(io.BytesIO(archive)) as arrays:
        assert np.array_equal(arrays["q"], kr.solve(kr.scenes.thesis, 1).q)
    run = invoke(["solve", "thesis", "--t", "1", "--save", "-"]).stdout_bytes
    assert kr.resume(run).t == 1


# Full disks


@needs_full
@pytest.mark.parametrize("option", ["csv", "json", "npz", "save", "events-csv"])
def test_a_full_disk_is_reported_and_other_outputs_are_complete(tmp_path, monkeypatch, option):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full.npz").symlink_to("/dev/full")
    place = "full.npz" if option == "npz" else "/dev/full"
    line = "solve thesis --t 1 --method taylor --events nutation"
    line += "" if option == "csv" else " --csv kept"
    told = call(f"{line} --{option} {place}", code=1)
    assert f"No space left on device: '{place}'" in told and told.count("Error") == 1
    assert (tmp_path / "kept").exists() == (option != "csv")


@needs_full
@pytest.mark.parametrize("line", ["solve thesis --t 1 --csv -", "solve thesis --t 1"])
def test_full_standard_output_causes_no_traceback(line):
    with open("/dev/full", "w") as full:
        code, _, errors = run_process(line, stdout=full)
    assert code == 1 and "No space left on device" in errors and errors.count("\n") == 1


def fill_disk_once(monkeypatch, error):
    """Let the second write of this process write half of the data and fail."""
    write, calls = os.write, []

    def write_or_fail(descriptor, data):
        calls.append(len(data))
        if len(calls) == 2:
            write(descriptor, data[: len(data) // 2])
            raise error
        return write(descriptor, data)

    monkeypatch.setattr(os, "write", write_or_fail)


def test_all_outputs_end_with_the_last_complete_piece_of_a_csv_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = "solve asymmetric --method taylor --events nutation"
    files = "--csv a.csv --json a.json --events-csv e.csv --save run"
    fill_disk_once(monkeypatch, OSError(28, "No space left on device"))
    assert "No space left" in call(f"{line} --t 0:400:0.01 {files}", code=1)
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    t = read_csv((tmp_path / "a.csv").read_text())["t [T]"]
    assert 1 < len(t) < 40001 and np.array_equal(t, np.arange(len(t)) * 0.01)
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["t"] == t.tolist() and kr.resume("run").t == t[-1] and "No space" in data["stopped"]
    call("resume run --t 400 --events-csv rest.csv")
    call(f"{line} --t 400 --events-csv all.csv")
    first, rest, whole = (
        read_csv((tmp_path / name).read_text())["t [T]"].tolist()
        for name in ("e.csv", "rest.csv", "all.csv")
    )
    assert first + rest == whole


def test_a_lack_of_memory_leaves_no_file(tmp_path, monkeypatch):
    fill_disk_once(monkeypatch, MemoryError())
    output = call("solve asymmetric --t 0:400:0.01 --csv", tmp_path / "a.csv", code=1)
    assert "not enough memory" in output and os.listdir(tmp_path) == []


# Pipes and closed streams


def test_rows_are_written_as_they_are_computed_until_the_pipe_closes():
    with start_process("solve asymmetric --t 0:1e9:0.01 --csv -") as run:
        lines = [run.stdout.readline() for _ in range(20_000)]
        run.stdout.close()
        assert run.wait(HANG) == 1 and run.stderr.read() == ""
    assert lines[0].startswith("t [T],q_w") and float(lines[-1].split(",")[0]) == 19998 * 0.01


@pytest.mark.parametrize(
    ("line", "stream", "code", "message"),
    [
        ("solve cusps --t 1 --csv -", 1, 2, "standard output is closed"),
        ("solve cusps --t 1 --csv a.csv", 1, 0, ""),
        ("solve - --t 1", 0, 2, "standard input is closed"),
        ("solve cusps --t 1 --csv a.csv", 2, 0, ""),
        ("solve nosuch --t 1", 2, 2, ""),
    ],
)
def test_closed_streams_cause_no_traceback(tmp_path, line, stream, code, message):
    close = partial(os.close, stream)
    found_code, _, errors = run_process(line, preexec_fn=close, cwd=tmp_path)
    assert found_code == code and message in errors and errors.count("\n") == bool(message)
    assert (tmp_path / "a.csv").exists() == (code == 0)


# The report


def test_report_runs_the_validation_of_the_working_directory(tmp_path):
    folder = tmp_path / "validation"
    folder.mkdir()
    program = "def main(words):\n    print('made here', words)\n    return 3\n"
    (folder / "__main__.py").write_text(program)
    code, output, _ = run_process("report --quick -h", cwd=tmp_path)
    assert (code, output) == (3, "made here ['--quick', '-h']\n")
    error = "raise ModuleNotFoundError('none', name='heyoka')\n"
    (folder / "__main__.py").write_text(error)
    code, _, errors = run_process("report", cwd=tmp_path)
    assert code == 1 and "pip install 'kreisel[report]'" in errors
