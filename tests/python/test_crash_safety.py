"""Tests that existing files survive crashes and full disks.

The environment variable KREISEL_KILLS sets how many times each writing process is killed.
"""

import inspect
import itertools
import os
import random
import re
import signal
import subprocess
import sys
import textwrap
import time
from collections import Counter

import kreisel as kr
import numpy as np
import pytest
from kreisel._sweep.store import open_sweep_store
from kreisel._utils.atomic_io import atomic_open
from toolbox import HANG, python

END, CHUNK = 24.0, 100
KILLS = int(os.environ.get("KREISEL_KILLS", 8))

TOP = kr.scenes.asymmetric
# Forks a process for each writer. At the given moment of writing, this process kills itself or the
# disk is full.
WRITER = """
import importlib.metadata, os, pathlib, resource, signal, sys
import kreisel as kr
(command_line,) = importlib.metadata.entry_points(group="console_scripts", name="kreisel")
main = command_line.load()
moment, folder = sys.argv[1], pathlib.Path(sys.argv[2])
def end(*_, **__):
    os.kill(os.getpid(), signal.SIGKILL)
def command(*words):
    def call(file):
        if main([*words, str(file)], standalone_mode=False):
            raise SystemExit("the command says that it failed")
    return call
def fail():
    if moment == "half":  # no more than so many bytes of a file
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (50, 50))
    elif moment != "none":
        setattr(os, moment, end)
run = kr.start(kr.scenes.asymmetric, "strang", step=0.01)
path = run.to(1.0)
for writer, write in {
    "run": run.save,
    "path": path.save,
    "rows": path.to_csv,
    "scene": kr.scenes.asymmetric.to_toml,
    "view": kr.view(kr.scenes.asymmetric, open=False).save,
    "csv": command("solve", "asymmetric", "--t", "1", "--csv"),
    "npz": command("solve", "asymmetric", "--t", "1", "--npz"),
    "page": command("view", "asymmetric", "--save"),
    "table": command("compare", "asymmetric", "--t", "1", "--methods", "strang", "--steps", "0.1",
                     "--repeats", "1", "--csv"),
}.items():
    (folder / writer).mkdir(exist_ok=True)
    endings = {"npz": "npz", "rows": "csv", "csv": "csv", "table": "csv", "page": "html"}
    file = folder / writer / f"file.{endings.get(writer, 'own')}"
    file.write_bytes(b"old")
    child = os.fork()
    if not child:
        fail()
        try:
            write(file)
        except BaseException as error:
            print(writer, type(error).__name__, error, flush=True)
            os._exit(3)
        os._exit(0)
    print(writer, "ended", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""
WRITERS = {"run", "path", "rows", "scene", "view", "csv", "npz", "page", "table"}
JUNK = re.compile(r"\.[0-9a-f]{16}\.new")


def run_writers(moment, folder):
    result = subprocess.run(
        [sys.executable, "-c", WRITER, moment, str(folder)],
        capture_output=True,
        text=True,
        timeout=HANG,
    )
    assert result.returncode == 0 and "Traceback" not in result.stderr, result.stderr
    ends = {w: int(code) for w, code in re.findall(r"^(\w+) ended (-?\d+)$", result.stdout, re.M)}
    assert set(ends) == WRITERS
    return ends, result.stdout + result.stderr


def test_each_writer_writes(tmp_path):
    ends, output = run_writers("none", tmp_path)
    assert set(ends.values()) == {0}, output
    for writer in WRITERS:
        (file,) = (tmp_path / writer).iterdir()
        assert file.stem == "file" and file.stat().st_size > 50


@pytest.mark.parametrize("moment", ["fsync", "replace"])
def test_a_killed_writer_leaves_the_old_file(tmp_path, moment):
    ends, output = run_writers(moment, tmp_path)
    assert set(ends.values()) == {-signal.SIGKILL}, output
    for writer in WRITERS:
        new, file = sorted((tmp_path / writer).iterdir())
        assert file.read_bytes() == b"old" and JUNK.fullmatch(new.name)
    run_writers("none", tmp_path)
    for writer in WRITERS:
        (file,) = (tmp_path / writer).iterdir()
        assert file.read_bytes() != b"old", "the next writer removes the remains"


def test_a_file_that_is_being_written_is_not_taken_for_abandoned(tmp_path):
    with atomic_open(tmp_path / "file") as one, atomic_open(tmp_path / "file") as other:
        one.append_bytes(b"one")
        other.append_bytes(b"other")
        TOP.to_toml(tmp_path / "file")
        assert len(os.listdir(tmp_path)) == 3
    assert (tmp_path / "file").read_bytes() == b"one" and len(os.listdir(tmp_path)) == 1


def test_a_full_disk_leaves_the_old_file_and_raises(tmp_path):
    ends, output = run_writers("half", tmp_path)
    assert set(ends.values()) == {3} and output.count("File too large") == len(WRITERS), output
    for writer in WRITERS:
        (file,) = (tmp_path / writer).iterdir()
        assert file.read_bytes() == b"old"


@pytest.mark.parametrize("write", [kr.start(TOP).save, TOP.to_toml, kr.view(TOP, open=False).save])
def test_unwritable_files_raise_os_error(tmp_path, write):
    with pytest.raises(FileNotFoundError):
        write(tmp_path / "none" / "file")
    with pytest.raises(IsADirectoryError):
        write(tmp_path)
    with pytest.raises(OSError):
        write("/proc/version")
    assert os.listdir(tmp_path) == []


def test_a_symbolic_link_stays_a_link(tmp_path):
    real, link = tmp_path / "real", tmp_path / "link"
    real.write_bytes(b"old")
    real.chmod(0o640)
    link.symlink_to(real)
    TOP.to_toml(link)
    assert link.is_symlink() and kr.Scene.from_toml(real) == TOP
    assert real.stat().st_mode & 0o777 == 0o640


# Processes that save repeatedly are killed at a random moment. Each overwrites a file alternately
# with two contents.

OLD, WHOLE, TORN, STRANGE, ENDED = "old", "whole", "torn", "strange", "ended"
LONGEST = 3.0  # longest delay before the kill, in multiples of the duration of a write
KINDS = ["run", "path", "table", "scene", "page", "part"]


def make_writers(folder):
    top, other = kr.scenes.asymmetric, kr.scenes.kowalewski
    runs, paths, views = [], [], []
    for scene in (top, other):
        run = kr.start(scene, "strang", step=0.01)
        paths.append(run.to(20.0, every=1))
        runs.append(run)
        views.append(kr.view(scene, open=False))
    sweep = folder / "sweep"
    kr.sweep(top.vary(spin=[1.0, 2.0, 3.0, 4.0]), 1.0, folder=sweep, part_size=2, threads=1)
    parts = open_sweep_store(sweep)
    rows = [parts.read_part(i) for i in (0, 1)]
    return {
        "run": ("run", [run.save for run in runs]),
        "path": ("path", [path.save for path in paths]),
        "table": ("table.csv", [path.to_csv for path in paths]),
        "scene": ("top.toml", [top.to_toml, other.to_toml]),
        "page": ("page.html", [view.save for view in views]),
        "part": (parts.part_file_path(0), [lambda _, r=r: parts.write_part(0, r) for r in rows]),
    }


def write_contents(file, ways):
    """Call each writing function, and return the file contents and the longest run time [s]."""
    contents, longest = [], 0.0
    for write in ways:
        begin = time.perf_counter()
        write(file)
        longest = max(longest, time.perf_counter() - begin)
        contents.append(file.read_bytes())
    return contents, longest


def kill_writer(file, ways, seconds):
    """Write a file repeatedly in a child process, and kill the process after `seconds`.

    Return True if the child process was still running when it was killed.
    """
    read_end, write_end = os.pipe()
    child = os.fork()
    if not child:
        try:
            os.write(write_end, b"begun")
            for write in itertools.cycle(ways):
                write(file)
        finally:
            os._exit(1)
    os.read(read_end, 5)
    time.sleep(seconds)
    os.kill(child, signal.SIGKILL)
    os.close(read_end)
    os.close(write_end)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL


def inspect_file(file, contents):
    """Classify a file as unchanged, completely rewritten or damaged, and remove temporary files."""
    for name in filter(JUNK.fullmatch, os.listdir(file.parent)):
        os.unlink(file.parent / name)
    content = file.read_bytes() if file.is_file() else None
    return OLD if content == OLD.encode() else WHOLE if content in contents else TORN


def count_outcomes(file, ways, times, chance):
    """Kill a writing process repeatedly, and count the unchanged, complete and damaged files."""
    contents, longest = write_contents(file, ways)
    assert contents[0] != contents[1]
    outcomes, before = Counter(), set(os.listdir(file.parent))
    for _ in range(times):
        file.write_bytes(OLD.encode())
        outcomes[ENDED] += not kill_writer(file, ways, chance.uniform(0.0, LONGEST * longest))
        outcomes[inspect_file(file, contents)] += 1
        outcomes[STRANGE] += set(os.listdir(file.parent)) != before
    return outcomes


@pytest.fixture(scope="module")
def writers(tmp_path_factory):
    folder = tmp_path_factory.mktemp("killed")
    return {name: (folder / file, ways) for name, (file, ways) in make_writers(folder).items()}


def test_no_writer_is_forgotten(writers):
    assert list(writers) == KINDS


@pytest.mark.parametrize("kind", KINDS)
def test_a_killed_writer_leaves_the_old_file_or_a_new_one(writers, kind):
    outcomes = count_outcomes(*writers[kind], KILLS, random.Random(kind))
    assert outcomes[OLD] + outcomes[WHOLE] == KILLS
    assert not outcomes[TORN] + outcomes[STRANGE] + outcomes[ENDED]


def test_a_file_that_is_written_in_its_place_is_seen_torn(tmp_path):
    ways = [lambda file, n=n: file.write_bytes(b"x" * n) for n in (1 << 24, (1 << 24) + 1)]
    chance = random.Random(1)
    tries = (count_outcomes(tmp_path / "file", ways, 12, chance) for _ in range(50))
    assert any(outcomes[TORN] for outcomes in tries)


# Boundary values


def example():
    """Return the last example in the docstring of kreisel.start, with a shorter duration."""
    text = inspect.getdoc(kr.start)
    code = textwrap.dedent(text[text.index('    file, begun = pathlib.Path("run.kreisel")') :])
    assert "1e6, every=100" in code
    return code.replace("1e6, every=100", f"{END}, every=5, chunk={CHUNK}")


def count_processes(folder, kill):
    """Return the number of processes needed to complete a run that is killed repeatedly.

    Each process exits when it calls the function `kill` for the third time.
    """
    code = f"""
import os, pathlib, kreisel as kr, numpy as np
scene = kr.scenes.asymmetric
calls = []
def call_or_exit(call, *words):
    calls.append(call)
    if len(calls) == 3:
        os._exit(9)
    return call(*words)
real = {kill}
def replacement(*words):
    return call_or_exit(real, *words)
{kill} = replacement
"""
    for life in itertools.count(1):
        result = python(code + example(), cwd=folder)
        assert result.returncode in (0, 9), result.stderr
        if result.returncode == 0:
            return life
        with open(folder / "states", "ab") as states:  # as if the write had been cut short
            states.write(b"half a row")


@pytest.mark.parametrize("kill", ["os.fsync", "kr.Run.save"], ids=["kept", "saved"])
def test_every_state_is_stored_once(kill, tmp_path):
    whole = kr.solve(kr.scenes.asymmetric, END, "strang", step=0.01, every=5)
    chunks = -(-len(whole) // CHUNK)
    assert count_processes(tmp_path, kill) > chunks / 3
    states = np.fromfile(tmp_path / "states").reshape(-1, 8)
    assert np.array_equal(states, whole.states)
