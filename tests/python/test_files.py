"""Tests of atomic file writing and of malicious checkpoints."""

import json
import os
import threading
import zlib

import kreisel as kr
import pytest
from click.testing import CliRunner
from kreisel._cli import main
from kreisel._utils import atomic_io

TOP = kr.scenes.asymmetric


def writers():
    run = kr.start(TOP)
    run.to(1.0)
    table = kr.compare(TOP, 1.0, ["strang"], steps=[0.1], repeats=1)
    return [run.save, TOP.to_toml, table.to_csv, kr.view(TOP, open=False).save]


@pytest.mark.parametrize("i", range(4))
def test_a_failing_disk_leaves_only_the_old_file(tmp_path, monkeypatch, i):
    file, write = tmp_path / "file", writers()[i]
    file.write_bytes(b"old")

    def full(_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(atomic_io.os, "fsync", full)
        with pytest.raises(OSError, match="No space"):
            write(file)
    assert file.read_bytes() == b"old" and os.listdir(tmp_path) == ["file"]
    write(file)
    assert file.stat().st_size > 10 and os.listdir(tmp_path) == ["file"]


@pytest.mark.parametrize("i", range(4))
def test_a_missing_folder_is_named_as_given(tmp_path, i):
    file = tmp_path / "no" / "file"
    with pytest.raises(FileNotFoundError) as error:
        writers()[i](file)
    assert error.value.filename == str(file)


def test_two_threads_can_save_one_file(tmp_path):
    file, runs = tmp_path / "run", [kr.start(TOP), kr.start(kr.scenes.thesis)]
    for run in runs:
        run.to(1.0)
    runs[0].save(file)

    def save(run):
        for _ in range(50):
            run.save(file)

    threads = [threading.Thread(target=save, args=(run,)) for run in runs]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        assert kr.resume(file).t == 1.0
    assert os.listdir(tmp_path) == ["run"]


@pytest.mark.parametrize("word", ["--csv", "--npz"])
def test_a_missing_folder_is_refused_before_anything_runs(tmp_path, word):
    words = ["solve", "asymmetric", "--t", "1e9", word, str(tmp_path / "no" / "file")]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 2 and "there is no folder" in result.output
    assert result.output.count("\n") == 1


def test_deeply_nested_tables_are_refused(tmp_path):
    file = tmp_path / "deep.toml"
    file.write_text("a = " + "[" * 5000 + "]" * 5000)
    with pytest.raises(ValueError, match="nested too deeply"):
        kr.Scene.from_toml(file)


def forge_checkpoint(**changes):
    run = kr.start(TOP, "strang", step=0.1)
    run.to(1.0)
    body = run.checkpoint.split(b"\n", 2)[2]
    line, _, memory = body.partition(b"\n")
    head = json.loads(line) | changes
    body = json.dumps(head).encode() + b"\n" + memory
    return b"kreisel run\n" + b"%08x\n" % zlib.crc32(body) + body


@pytest.mark.parametrize(
    "changes",
    [
        {"t": "soon"},
        {"t": 7.0},
        {"t": float("nan")},
        {"stats": [1, 2]},
        {"stats": [1, 2, 3, -4]},
        {"stats": None},
        {"fresh": "no"},
        {"scene": 3},
        {"scene": "a = " + "[" * 5000},
        {"method": []},
        {"want": 5},
        {"back": None},
        {"kernel": 5},
        {"max_steps": {}},
    ],
)
def test_a_checkpoint_with_a_forged_header_is_refused(changes):
    assert kr.resume(forge_checkpoint()).t == 1.0
    with pytest.raises(ValueError, match="not a checkpoint of a run"):
        kr.resume(forge_checkpoint(**changes))


def test_a_header_that_is_not_an_object_is_refused():
    for line in (b"[]", b"3", b"[" * 100_000, b"\xff"):
        body = line + b"\n"
        with pytest.raises(ValueError, match="not a checkpoint of a run"):
            kr.resume(b"kreisel run\n" + b"%08x\n" % zlib.crc32(body) + body)


# Devices, folders and interrupted writes


def test_a_trial_file_removed_by_another_process_is_no_error(monkeypatch, tmp_path):
    close = os.close

    def close_and_unlink(handle):
        name = os.readlink(f"/proc/self/fd/{handle}")
        close(handle)
        os.unlink(name)

    with monkeypatch.context() as patch:
        patch.setattr(atomic_io.os, "close", close_and_unlink)
        atomic_io.check_file_is_writable(tmp_path / "path.csv")
    assert list(tmp_path.iterdir()) == []


def test_a_device_is_written_directly():
    TOP.to_toml(os.devnull)
    assert not os.path.isfile(os.devnull)


@pytest.mark.parametrize("call", ["open", "fsync"])
def test_files_are_saved_if_the_folder_cannot_be_synced(tmp_path, monkeypatch, call):
    real, folders = getattr(os, call), []

    def no_folder(target, *words, **more):
        is_folder = (
            target == tmp_path if call == "open" else os.path.isdir(f"/proc/self/fd/{target}")
        )
        if is_folder:
            folders.append(target)
            raise OSError(22, "Invalid argument")
        return real(target, *words, **more)

    with monkeypatch.context() as broken:
        broken.setattr(os, call, no_folder)
        TOP.to_toml(tmp_path / "top.toml")
    assert folders and kr.Scene.from_toml(tmp_path / "top.toml") == TOP


def test_an_interrupted_write_is_undone(tmp_path, monkeypatch):
    real, file = os.write, tmp_path / "rows.csv"

    def write_half(descriptor, data):
        real(descriptor, data[: len(data) // 2])
        raise KeyboardInterrupt

    with atomic_io.atomic_open(file) as rows:
        rows.append_bytes(b"whole\n")
        with monkeypatch.context() as broken:
            broken.setattr(atomic_io.os, "write", write_half)
            with pytest.raises(KeyboardInterrupt) as stopped:
                rows.append_bytes(b"half\n")
    assert not hasattr(stopped.value, "filename")
    assert file.read_bytes() == b"whole\n"


def test_a_file_into_which_nothing_is_written_stays(tmp_path):
    file = tmp_path / "rows.csv"
    file.write_text("old")
    with atomic_io.atomic_open(file) as rows:
        assert rows.is_empty
    assert file.read_text() == "old" and os.listdir(tmp_path) == ["rows.csv"]


def test_a_pipe_without_a_file_name_is_written():
    read_end, write_end = os.pipe()
    name = f"/dev/fd/{write_end}"  # the name that a shell gives for >(command)
    atomic_io.check_file_is_writable(name)
    atomic_io.atomic_write(name, b"rows")
    os.close(write_end)
    with open(read_end, "rb") as pipe:
        assert pipe.read() == b"rows"


def test_a_pipe_that_must_not_be_written_is_refused(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    atomic_io.check_file_is_writable(tmp_path / "pipe")
    monkeypatch.setattr(atomic_io.os, "access", lambda *_: False)
    with pytest.raises(PermissionError, match="pipe must not be written"):
        atomic_io.check_file_is_writable(tmp_path / "pipe")
