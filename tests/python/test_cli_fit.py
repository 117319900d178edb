"""Tests of the command kreisel fit."""

import errno
import os
import sys

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, make_raiser
from click.testing import CliRunner
from internals import cli
from kreisel._cli import fit_command
from kreisel._utils import atomic_io

FIT = "fit record.csv asymmetric --free velocity --sigma 1"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Write a record of a few rates, and make its folder the current one."""
    monkeypatch.chdir(tmp_path)
    path = kr.solve(kr.scenes.asymmetric, np.linspace(0.0, 1.0, 9), want=("body_velocity",))
    path.to_csv("record.csv")
    return tmp_path


@pytest.fixture
def fit_calls(monkeypatch):
    """Replace the fit by a function that notes its call, and return the notes."""
    calls = []
    monkeypatch.setattr(fit_command, "estimate", lambda *words, **_: calls.append(words))
    return calls


@pytest.mark.parametrize("file", ["a", "a.foo", "a.jpg", "-.foo", "a.toml", "no/a.png"])
def test_plots_of_unknown_format_are_refused_before_the_fit(folder, fit_calls, file):
    output = call(f"{FIT} --plot {file}", code=2)
    assert file in output and output.count("\n") == 1
    assert not fit_calls and os.listdir(folder) == ["record.csv"]


def test_a_missing_matplotlib_is_found_before_the_fit(folder, fit_calls, monkeypatch):
    modules = [name for name in sys.modules if name.startswith(("matplotlib", "kreisel._plot."))]
    for name in modules:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    output = call(f"{FIT} --plot a.png", code=1)
    assert output.startswith("Error: this needs matplotlib") and "'kreisel[plot]'" in output
    assert output.count("\n") == 1 and not fit_calls and os.listdir(folder) == ["record.csv"]


@pytest.mark.parametrize(
    ("file", "start"), [("a.png", b"\x89PNG"), ("a.PDF", b"%PDF"), ("a.svg", b"<?xml")]
)
def test_the_ending_of_a_plot_is_its_format(folder, file, start):
    call(f"{FIT} --plot {file}")
    assert (folder / file).read_bytes().startswith(start)


@pytest.mark.parametrize("file", ["-", "/dev/stdout"])
def test_a_plot_on_standard_output_is_a_png_file_and_nothing_else(folder, file):
    result = CliRunner().invoke(cli.main, [*FIT.split(), "--plot", file])
    assert result.exit_code == 0 and result.stdout_bytes.startswith(b"\x89PNG")
    assert os.listdir(folder) == ["record.csv"]


def test_a_plot_that_fills_the_disk_leaves_the_old_file(folder, monkeypatch):
    (folder / "a.svg").write_text("old")
    full = OSError(errno.ENOSPC, "No space left on device")
    monkeypatch.setattr(atomic_io.os, "write", make_raiser(full))
    output = call(f"{FIT} --plot a.svg", code=1)
    assert "No space left on device: 'a.svg'" in output
    assert (folder / "a.svg").read_text() == "old"
    assert sorted(os.listdir(folder)) == ["a.svg", "record.csv"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--sigma body_velocity=1 --sigma body_velocity=2", "--sigma body_velocity=2"),
        ("--column spin=a --column nutation=b --column spin=c", "--column spin=c"),
    ],
)
def test_a_quantity_given_twice_is_refused(folder, fit_calls, words, message):
    output = call(f"fit record.csv asymmetric {words}", code=2)
    assert message in output and "is already given" in output and not fit_calls


def test_a_record_may_be_a_pipe(folder):
    table = (folder / "record.csv").read_bytes()
    read_end, write_end = os.pipe()
    with open(write_end, "wb") as pipe:
        pipe.write(table)
    output = call(f"fit /dev/fd/{read_end} asymmetric --free velocity --sigma 1")
    os.close(read_end)
    assert output == call(FIT)


def test_the_number_of_evaluations_is_checked(folder):
    output = call(f"{FIT} --max-evaluations 0", code=2)
    assert "--max-evaluations must be at least 1" in output
