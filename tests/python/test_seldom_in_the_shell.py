"""What the command line and files meet seldom: tools that are not installed, Ctrl-C between two
steps, a memory that is full, another thread than the main one."""

import errno
import importlib
import os
import sys
import threading
from types import SimpleNamespace

import kreisel as kr
import pytest
from click.testing import CliRunner
from inside import cli
from shell import call, said

TOP = kr.scenes.asymmetric
COMPARED = "compare asymmetric --t 1 --methods rk4 --steps 0.1 --repeats 1"


def raising(error):
    def fails(*_, **__):
        raise error

    return fails


def test_the_table_of_methods_is_markdown():
    lines = call("methods --markdown").splitlines()
    rows = {cells[0]: cells for cells in (line.strip("| ").split(" | ") for line in lines)}
    assert rows["rk4"][2:5] == ["1.0"] * 3 and rows["exact"][1] == "varies"
    assert rows.keys() >= kr.methods.keys()


@pytest.fixture
def source_tree(tmp_path, monkeypatch):
    (tmp_path / "validation").mkdir()
    (tmp_path / "validation/__main__.py").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))


@pytest.mark.usefixtures("source_tree")
def test_a_report_without_its_tools_says_which_to_install(monkeypatch):
    missing = ModuleNotFoundError("No module named 'heyoka'", name="heyoka")
    monkeypatch.setattr(importlib, "import_module", raising(missing))
    told = call("report --quick", code=1)
    assert "the report needs heyoka: pip install 'kreisel[report]'" in told
    assert "--thesis" in call("report --help")


@pytest.mark.usefixtures("source_tree")
def test_a_report_that_lacks_a_part_of_itself_is_broken(monkeypatch):
    missing = ModuleNotFoundError("no", name="validation.parts")
    monkeypatch.setattr(importlib, "import_module", raising(missing))
    done = CliRunner().invoke(cli.main, ["report"])
    assert done.exception is missing


@pytest.mark.usefixtures("source_tree")
@pytest.mark.parametrize("code", [0, 3])
def test_a_report_ends_as_its_machinery_does(monkeypatch, code):
    machinery = SimpleNamespace(main=lambda words: code if words == ["--quick"] else 9)
    monkeypatch.setattr(importlib, "import_module", lambda name: machinery)
    call("report --quick", code=code)


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (KeyboardInterrupt(), 130, "Error: interrupted"),
        (KeyboardInterrupt("at t = 3"), 130, "Error: at t = 3"),
        (OSError(errno.ENOSPC, "No space left on device"), 1, "No space left on device"),
        (OSError(errno.EPIPE, "Broken pipe"), 1, ""),
    ],
)
def test_what_stops_a_command_is_a_line_and_a_code(monkeypatch, error, code, words):
    monkeypatch.setattr(cli.compare, "compared", raising(error))
    told = call(COMPARED, code=code)
    assert words in told and told.count("\n") == (1 if words else 0)


def test_a_run_for_which_there_is_no_memory_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cli.solve, "fed", raising(MemoryError()))
    assert "there is not memory enough" in call("solve asymmetric --t 1 --csv a.csv", code=1)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("line", ["scenes", "solve asymmetric --t 1"])
def test_a_command_runs_in_another_thread_too(line):
    ran = []
    thread = threading.Thread(target=lambda: ran.append(CliRunner().invoke(cli.main, line.split())))
    thread.start()
    thread.join()
    assert ran[0].exit_code == 0 and said(ran[0].output) == said(call(line))


def test_ctrl_c_while_quantities_are_computed_loses_nothing(monkeypatch):
    real, pressed = kr.Path.only, []

    def only(path, want):
        if not pressed:
            pressed.append(path)
            raise KeyboardInterrupt
        return real(path, want)

    monkeypatch.setattr(kr.Path, "only", only)
    with pytest.raises(kr.Interrupted) as stopped:
        list(kr.stream(TOP, [1.0, 2.0], want=["energy"]))
    assert len(stopped.value.path.energy) == 2 and stopped.value.status == "ERR_INTERRUPTED"


def test_a_film_is_saved_once_it_is_made(tmp_path):
    film = kr.solve(TOP, 0.5).animate(speed=0.5, fps=2, size=32)
    film.save(tmp_path / "top.gif")
    assert (tmp_path / "top.gif").read_bytes().startswith(b"GIF89a")
    with pytest.raises(ValueError, match="file must end in one of"):
        film.save(tmp_path / "top.txt")


def test_a_place_that_takes_no_file_is_refused_before_anything_runs(tmp_path, monkeypatch):
    film = kr.solve(TOP, 0.5).animate(speed=0.5, fps=2, size=32)
    with monkeypatch.context() as patch:
        patch.setattr(os, "open", raising(PermissionError(errno.EACCES, "Permission denied")))
        with pytest.raises(PermissionError, match=r"top\.gif cannot be written: Permission denied"):
            film.save(tmp_path / "top.gif")
    assert os.listdir(tmp_path) == []
