"""Tests of the output files of the command-line program."""

import json
import os
import subprocess
import sys

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, join_lines, make_raiser
from internals import cli, view
from kreisel._cli.outputs import CsvOutput
from toolbox import HANG

KREISEL = [sys.executable, "-m", "kreisel"]
ENDLESS = "asymmetric --t 1e9 --max-steps 100000"  # a run that fails after 100000 steps


def shell(words, **options):
    """Run a command in a separate process, and assert that it prints no traceback."""
    result = subprocess.run(
        [*KREISEL, *words.split()], stderr=subprocess.PIPE, text=True, timeout=HANG, **options
    )
    assert "Traceback" not in result.stderr and "Exception ignored" not in result.stderr
    return result


@pytest.mark.parametrize("option", ["csv", "json", "npz", "save", "events-csv --events loop"])
@pytest.mark.parametrize(
    "place, message",
    [
        ("no/file", "there is no folder"),
        ("folder", "folder"),
        ("x" * 300, "File name too long"),
        ("a.xlsx", "not .xlsx"),
    ],
)
def test_output_files_are_checked_before_anything_runs(tmp_path, option, place, message):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.npz").mkdir()
    words = f"solve {ENDLESS} --{option.split()[0]}"
    output = call(words, tmp_path / place, *option.split()[1:], code=2)
    assert message in join_lines(output) and output.count("\n") == 1
    assert sorted(os.listdir(tmp_path)) == ["folder", "folder.npz"]


@pytest.mark.parametrize(
    "words", ["compare thesis --t 1 --methods rk4 --steps .1 --csv", "view --save"]
)
def test_other_commands_check_their_output_files(tmp_path, words):
    assert "there is no folder" in join_lines(call(words, tmp_path / "no/file", code=2))


@pytest.mark.parametrize(
    "words",
    [
        "--csv a --json a",
        "--csv a --json ./a",
        "--csv a --save link",
        "--json a.npz --npz a",
        "--npz a.npz --save a.npz",
        "--csv - --npz -",
        "--csv /dev/stdout --json -",
        "--csv top",
        "--events loop --events-csv a --csv a",
    ],
)
def test_two_outputs_never_share_a_file_nor_replace_the_scene(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    kr.scenes.thesis.to_toml("top")
    (tmp_path / "link").symlink_to("a")
    output = call(f"solve top --t 1e9 --method taylor {words}", code=2)
    assert "is the same file" in output or "writes" in output
    assert kr.Scene.from_toml("top") == kr.scenes.thesis and len(os.listdir(tmp_path)) == 2


@pytest.mark.parametrize(
    "words",
    [
        "compare top --t 1 --methods rk4 --steps 0.1 --csv top",
        "view top --save ./top",
        "view top --save link",
        "fit record top --csv top",
        "fit record top --plot record",
        "fit record top --save record",
        "resume run --t 2 --csv run",
        "resume run --t 2 --json link_to_run",
        "resume run --t 2 --save run --csv run",
    ],
)
def test_no_output_replaces_an_input(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    kr.scenes.thesis.to_toml("top")
    kr.start(kr.scenes.thesis).save("run")
    (tmp_path / "record").write_text("t,spin\n0,1\n1,1\n2,1\n")
    (tmp_path / "link").symlink_to("top")
    (tmp_path / "link_to_run").symlink_to("run")
    contents = {name: (tmp_path / name).read_bytes() for name in os.listdir(tmp_path)}
    assert "is the same file" in join_lines(call(words, code=2))
    assert {name: (tmp_path / name).read_bytes() for name in os.listdir(tmp_path)} == contents


def test_several_outputs_may_go_to_one_device():
    call("solve thesis --t 1 --csv /dev/null --json /dev/null --save /dev/null")


def test_archives_get_the_suffix_of_numpy(tmp_path):
    call("solve thesis --t 1 --npz", tmp_path / "a_h0.1")
    assert os.listdir(tmp_path) == ["a_h0.1.npz"]


def test_archives_and_runs_can_go_to_standard_output(tmp_path):
    archive = tmp_path / "a.npz"
    with open(archive, "wb") as out:
        shell("solve thesis --t 1 --npz -", stdout=out)
    with np.load(archive) as arrays:
        assert np.array_equal(arrays["q"], kr.solve(kr.scenes.thesis, 1).q)
    with open(tmp_path / "run", "wb") as out:
        shell("solve thesis --t 1 --save -", stdout=out)
    assert kr.resume(tmp_path / "run").t == 1


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize("option", ["csv", "json", "npz -", "save", "events-csv"])
def test_a_full_disk_is_reported_in_one_line_and_other_outputs_are_complete(tmp_path, option):
    if option == "npz -":
        with open("/dev/full", "wb") as full:
            result = shell("solve thesis --t 1 --npz -", stdout=full, cwd=tmp_path)
    else:
        more = "" if option == "csv" else "--csv kept.csv"
        words = f"solve thesis --t 1 --method taylor --events loop --{option} /dev/full {more}"
        words = words.replace("--events loop", "") if option == "save" else words
        result = shell(words, stdout=subprocess.DEVNULL, cwd=tmp_path)
        assert os.listdir(tmp_path) == (["kept.csv"] if more else [])
    assert (result.returncode, result.stderr.count("\n")) == (1, 1)
    assert "No space left on device" in result.stderr
    assert option == "npz -" or "'/dev/full'" in result.stderr


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_unwritable_standard_output_is_dropped(monkeypatch):
    with open("/dev/full", "w") as full:
        full.write("lost")
        monkeypatch.setattr(sys, "stdout", full)
        cli.main_command.drop_unwritable_stdout()
        monkeypatch.undo()
        full.write("lost too")  # closing the file raises no exception


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize(
    "words", ["methods", "scenes thesis", "solve thesis --t 1", "-h", "solve thesis --t 1 --csv -"]
)
def test_full_standard_output_causes_no_traceback(words):
    with open("/dev/full", "w") as full:
        result = shell(words, stdout=full)
    assert result.returncode == 1 and "No space left on device" in result.stderr


@pytest.mark.parametrize(
    "words, stream, code, message",
    [
        ("solve nosuch --t 1", 1, 2, "there is no file or named scene 'nosuch'"),
        ("solve cusps --t 1 --csv -", 1, 2, "--csv -: standard output is closed"),
        ("compare cusps --t 1 --csv -", 1, 2, "--csv -: standard output is closed"),
        ("view cusps --save -", 1, 2, "--save -: standard output is closed"),
        ("solve cusps --t 1 --csv a.csv", 1, 0, ""),
        ("solve - --t 1", 0, 2, "standard input is closed"),
        ("resume - --t 1", 0, 2, "standard input is closed"),
        ("solve cusps --t 1 --csv a.csv", 0, 0, ""),
        ("solve cusps --t 1 --csv a.csv", 2, 0, ""),
        ("solve nosuch --t 1", 2, 2, ""),
    ],
)
def test_closed_streams_cause_no_traceback(tmp_path, words, stream, code, message):
    shell_line = f'exec "$@" {stream}>&-'
    result = subprocess.run(
        ["/bin/sh", "-c", shell_line, "sh", *KREISEL, *words.split()],
        capture_output=True,
        text=True,
        timeout=HANG,
        cwd=tmp_path,
    )
    assert result.returncode == code and message in result.stderr
    assert result.stderr.count("\n") == (1 if message else 0)
    assert (tmp_path / "a.csv").exists() == (code == 0)


@pytest.mark.parametrize(
    "words",
    [
        "scenes",
        "solve asymmetric --t 0:1e9:0.01 --csv -",
        "compare thesis --t 1 --repeats 1 --methods exact --csv -",
    ],
)
def test_closed_pipes_end_the_command_quietly(words):
    read_end, write_end = os.pipe()
    os.close(read_end)
    result = shell(words, stdout=write_end)
    os.close(write_end)
    assert (result.returncode, result.stderr) == (1, "")


def test_rows_are_written_as_they_are_computed():
    words = [*KREISEL, "solve", "asymmetric", "--t", "0:1e9:0.01", "--csv", "-"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        lines = [run.stdout.readline() for _ in range(20_000)]
        run.stdout.close()
        assert run.wait(60) == 1 and run.stderr.read() == ""
    assert lines[0].startswith("t [T],q_w") and float(lines[-1].split(",")[0]) == 19998 * 0.01


def test_a_disk_that_fills_up_keeps_earlier_rows(tmp_path, monkeypatch):
    write, calls = os.write, []

    def full(descriptor, data):
        calls.append(len(data))
        if len(calls) > 1:
            write(descriptor, data[: len(data) // 2])
            raise OSError(28, "No space left on device")
        return write(descriptor, data)

    monkeypatch.setattr(os, "write", full)
    line = "solve asymmetric --t 0:1000:0.01 --method strang --step 0.1 --csv"
    output = call(line, tmp_path / "a.csv", "--save", tmp_path / "run", code=1)
    assert "No space left on device" in output
    rows = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
    assert len(rows) == 1 << 14 and np.array_equal(rows[:, 0], np.arange(1 << 14) * 0.01)


def test_all_outputs_end_with_the_last_piece_of_a_csv_file_that_fails(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    append, calls = CsvOutput.receive_path_piece, []

    def fail_at_second_piece(self, piece):
        calls.append(piece)
        if len(calls) > 1:
            raise OSError(28, "No space left on device")
        append(self, piece)

    monkeypatch.setattr(CsvOutput, "receive_path_piece", fail_at_second_piece)
    times = "0:1000:0.01 --method taylor"
    files = "--csv a.csv --events-csv e.csv --json a.json --save run"
    call(f"solve asymmetric --t {times} --events nutation {files}", code=1)
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    last = float((tmp_path / "a.csv").read_text().splitlines()[-1].split(",")[0])
    data = json.loads((tmp_path / "a.json").read_text())
    assert data["t"][-1] == last == kr.resume("run").t

    def read_event_times(file):
        return [line.split(",")[1] for line in (tmp_path / file).read_text().splitlines()[1:]]

    call("resume run --t 1000 --events-csv rest.csv")
    call("solve asymmetric --t 1000 --method taylor --events nutation --events-csv all.csv")
    assert read_event_times("e.csv") + read_event_times("rest.csv") == read_event_times("all.csv")


def test_a_failed_rename_keeps_the_other_outputs(tmp_path, monkeypatch):
    def fails(file, *_):
        if str(file).endswith(".json"):
            raise PermissionError(13, "Permission denied")

    replace = os.replace
    monkeypatch.setattr(os, "replace", lambda a, b: fails(b) or replace(a, b))
    line = (
        f"solve thesis --t 1 --json {tmp_path}/a.json --csv {tmp_path}/a.csv --npz {tmp_path}/a.npz"
    )
    assert "Permission denied" in call(line, "--save", tmp_path / "run", code=1)
    assert sorted(os.listdir(tmp_path)) == ["a.csv", "a.npz"]


@pytest.mark.parametrize("has_browser", [True, False])
def test_view_prints_the_file_of_the_viewer_and_leaves_one_file(tmp_path, monkeypatch, has_browser):
    addresses = []
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("webbrowser.open", lambda address: addresses.append(address) or has_browser)
    page = tmp_path / "kreisel/cusps.html"
    for _ in range(3):
        output = call("view cusps")
        assert f"wrote {page}" in output and ("no browser" in output) is not has_browser
    assert os.listdir(page.parent) == ["cusps.html"] and addresses == [page.as_uri()] * 3


def test_view_in_python_warns_without_a_browser(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("webbrowser.open", lambda _: False)
    with pytest.warns(UserWarning, match="no browser was found"):
        file = kr.view(kr.scenes.asymmetric.replace(gravity=2.0), open=False).open()
    assert file == tmp_path / "kreisel/top.html" and file.is_file()


def test_view_works_without_a_home_directory(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr(view.tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr("webbrowser.open", lambda _: True)
    file = kr.view(kr.scenes.cusps, open=False).open()
    assert file.is_file() and file.parent.parent == tmp_path


def test_a_viewer_that_was_not_built_is_reported(tmp_path, monkeypatch):
    monkeypatch.setattr(view, "_PAGE", tmp_path / "viewer.html")
    for more in ("", f" --save {tmp_path}/top.html"):
        told = join_lines(call("view cusps" + more, code=1))
        assert told.startswith("Error: ") and "make" in told
    assert os.listdir(tmp_path) == []


def test_view_can_write_to_standard_output():
    assert call("view cusps --save -").startswith("<!")


def test_invalid_checkpoints_are_reported_with_the_file_name_once(tmp_path):
    (tmp_path / "bad").write_bytes(b"no run")
    output = join_lines(call("resume", tmp_path / "bad", "--t", "3", code=2))
    assert f"{tmp_path / 'bad'}: " in output and output.count("bad") == 1
    missing = join_lines(call("resume", tmp_path / "none", "--t", "3", code=2))
    assert "No such file" in missing and missing.count("none") == 1


# Boundary values


def test_a_run_without_enough_memory_leaves_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        cli.solve_command, "write_path_pieces_to_outputs", make_raiser(MemoryError())
    )
    assert "not enough memory" in call("solve asymmetric --t 1 --csv a.csv", code=1)
    assert os.listdir(tmp_path) == []
