"""Tests that existing files survive crashes and full disks."""

import errno
import importlib.metadata
import inspect
import os
import pathlib
import resource
import signal
import textwrap
import threading

import kreisel as kr
import numpy as np
import pytest
from sweeps import fork

TOP = kr.scenes.asymmetric
OLD = b"old"
[COMMAND] = importlib.metadata.entry_points(group="console_scripts", name="kreisel")
SYSTEM_CALLS = "open", "write", "fsync", "link", "replace", "close", "unlink"


def make_command(line):
    def run_command(file):
        if COMMAND.load()([*line.split(), str(file)], standalone_mode=False):
            raise SystemExit("the command says that it failed")

    return run_command


def make_run():
    run = kr.start(TOP, "strang", step=0.01)
    run.to(1.0)
    return run


PATH = kr.solve(TOP, np.linspace(0.0, 1.0, 60))
TABLE = kr.compare(TOP, 1.0, ["strang"], steps=[0.1], repeats=1)
WRITERS = {
    "run": make_run().save,
    "path": PATH.save,
    "rows.csv": PATH.to_csv,
    "table.csv": TABLE.to_csv,
    "scene": TOP.to_toml,
    "fit": kr.fit(TOP, kr.Record(PATH.t, {"q": PATH.q}, 0.1)).to_toml,
    "page": kr.view(TOP, open=False).save,
    "command.csv": make_command("solve asymmetric --t 1 --csv"),
    "command.npz": make_command("solve asymmetric --t 1 --npz"),
    "command.html": make_command("view asymmetric --save"),
}


def kill_at_call(number):
    """Let this process be killed at a system call; of a write, half the bytes are written."""
    calls = []

    def replace_call(name, call):
        def count_and_call(*words, **more):
            calls.append(name)
            if len(calls) == number:
                if name == "write":
                    call(words[0], bytes(words[1])[: len(words[1]) // 2])
                os.kill(os.getpid(), signal.SIGKILL)
            return call(*words, **more)

        return count_and_call

    for name in SYSTEM_CALLS:
        setattr(os, name, replace_call(name, getattr(os, name)))


def list_outcomes(file, write):
    """Kill a process that writes a file at each of its system calls, and list the contents."""
    outcomes = []
    file.write_bytes(OLD)
    write(file)  # imports what it needs

    def write_and_die():
        kill_at_call(len(outcomes) + 1)
        write(file)

    while not outcomes or outcomes[-1][0] == -signal.SIGKILL:
        file.write_bytes(OLD)
        code = fork(write_and_die)
        outcomes.append((code, file.read_bytes()))
    return outcomes


@pytest.mark.parametrize("name", WRITERS)
def test_a_killed_writer_leaves_the_old_file_or_a_new_one(tmp_path, name):
    file = tmp_path / name
    outcomes = list_outcomes(file, WRITERS[name])
    code, new = outcomes[-1]
    assert code == 0 and len(new) > 50
    assert os.listdir(tmp_path) == [name]
    assert {code for code, _ in outcomes[:-1]} == {-signal.SIGKILL} and len(outcomes) > 5
    assert outcomes[0][1] == OLD and {content for _, content in outcomes} == {OLD, new}


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_the_old_file_and_raises(tmp_path, name):
    file = tmp_path / name
    file.write_bytes(OLD)

    def write():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (50, 50))
        WRITERS[name](file)

    assert fork(write) == (1 if name.startswith("command") else errno.EFBIG)
    assert file.read_bytes() == OLD and os.listdir(tmp_path) == [name]


@pytest.mark.parametrize("name", [name for name in WRITERS if not name.startswith("command")])
def test_unwritable_files_raise_os_error(tmp_path, name):
    with pytest.raises(FileNotFoundError) as error:
        WRITERS[name](tmp_path / "none" / "file")
    assert error.value.filename == str(tmp_path / "none" / "file")
    with pytest.raises(IsADirectoryError):
        WRITERS[name](tmp_path)
    with pytest.raises(OSError):
        WRITERS[name]("/proc/version")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("call", ["open", "fsync"])
def test_files_are_saved_if_the_folder_cannot_be_synced(tmp_path, monkeypatch, call):
    real = getattr(os, call)

    def refuse_folder(target, *words, **more):
        if pathlib.Path(f"/proc/self/fd/{target}" if call == "fsync" else target).is_dir():
            raise OSError(22, "Invalid argument")
        return real(target, *words, **more)

    with monkeypatch.context() as patch:
        patch.setattr(os, call, refuse_folder)
        TOP.to_toml(tmp_path / "top.toml")
    assert kr.Scene.from_toml(tmp_path / "top.toml") == TOP


def test_two_threads_can_save_one_file(tmp_path):
    file, runs = tmp_path / "run", [make_run(), kr.start(kr.scenes.thesis)]
    runs[1].to(1.0)
    runs[0].save(file)

    def save(run):
        for _ in range(20):
            run.save(file)

    threads = [threading.Thread(target=save, args=(run,)) for run in runs]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        assert kr.resume(file).t == 1.0
    assert os.listdir(tmp_path) == ["run"]


def test_a_symbolic_link_stays_a_link(tmp_path):
    real, link = tmp_path / "real", tmp_path / "link"
    real.write_bytes(OLD)
    real.chmod(0o640)
    link.symlink_to(real)
    TOP.to_toml(link)
    assert link.is_symlink() and kr.Scene.from_toml(real) == TOP
    assert real.stat().st_mode & 0o777 == 0o640


def test_devices_and_pipes_are_written_directly():
    TOP.to_toml(os.devnull)
    assert not os.path.isfile(os.devnull)
    read_end, write_end = os.pipe()
    TOP.to_toml(f"/dev/fd/{write_end}")  # the name that a shell gives for >(command)
    make_command("solve asymmetric --t 1 --csv")(f"/dev/fd/{write_end}")
    os.close(write_end)
    with open(read_end, "rb") as pipe:
        scene, rows = pipe.read().decode().split("t [T]")
    assert kr.Scene.from_toml(scene) == TOP and rows.count("\n") == 3


def make_example():
    """Return the last example in the docstring of kreisel.start, with a shorter duration."""
    text = inspect.getdoc(kr.start)
    code = textwrap.dedent(text[text.index('    file, begun = pathlib.Path("run.kreisel")') :])
    assert "1e6, every=100" in code
    return code.replace("1e6, every=100", "24.0, every=5, chunk=100")


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_run_that_is_killed_repeatedly_stores_every_state_once(tmp_path, monkeypatch, call):
    monkeypatch.chdir(tmp_path)
    whole = kr.solve(TOP, 24.0, "strang", step=0.01, every=5)

    def run_example():
        calls, real = [], getattr(os, call)

        def call_or_exit(*words):
            calls.append(words)
            if len(calls) == 3:
                os._exit(9)
            return real(*words)

        setattr(os, call, call_or_exit)
        exec(make_example(), {"os": os, "pathlib": pathlib, "kr": kr, "np": np, "scene": TOP})

    lives = 1
    while code_of_child := fork(run_example):
        assert code_of_child == 9
        lives += 1
        with open("states", "ab") as states:  # as if the write had been cut short
            states.write(b"half a row")
    assert lives > 2
    assert np.array_equal(np.fromfile("states").reshape(-1, 8), whole.states)
