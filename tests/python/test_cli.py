"""The command line, which speaks the words of the package."""

import csv
import os
import re
import subprocess
import sys

import kreisel as kr
import numpy as np
import pytest
from click.testing import CliRunner
from inside import cli
from toolbox import python
from tops import GENERAL

SCENE = GENERAL.replace(gravity=1 / 3)


def call(line, *more, code=0):
    """What the command line says to the words of a line, and to more that may have spaces."""
    done = CliRunner().invoke(cli.main, [*line.split(), *map(str, more)])
    assert done.exit_code == code and (code == 0 or done.exc_info[0] is SystemExit), done.output
    return done.output


def test_solve_writes_all_digits(tmp_path):
    scene = tmp_path / "top.toml"
    SCENE.to_toml(scene)
    path = kr.solve(SCENE, [-1, -2], "rk4", step=0.1)
    line = "solve --t -1,-2 --method rk4 --step 0.1"
    header, *rows = csv.reader(call(line, "--csv", "-", scene).splitlines())
    assert header == ["t", "q_w", "q_x", "q_y", "q_z", "m_x", "m_y", "m_z"]
    assert np.array_equal(np.array(rows, float), path.states)
    shown = call(line, "--npz", tmp_path / "top.npz", scene)
    assert "2 states by rk4: 20 steps" in shown and f"{path.m[-1, 0]:.15g}" in shown
    with np.load(tmp_path / "top.npz") as saved:
        assert np.array_equal(saved["t"], path.t) and np.array_equal(saved["q"], path.q)
        assert np.array_equal(saved["m"], path.m) and str(saved["scene"]) == SCENE.to_toml()


def test_solve_keeps_what_a_failed_run_reached(tmp_path):
    line = "solve thesis --t 10 --method rk4 --step 0.1 --every 2 --max-steps 5 --csv"
    assert "largest number of steps" in call(line, tmp_path / "part.csv", code=1)
    times = [line.split(",")[0] for line in (tmp_path / "part.csv").read_text().splitlines()[1:]]
    assert times == ["0.0", "0.2", "0.4", "0.5"]


PRESSED = """
import os, signal
from kreisel._showing import cli

solve = cli.solved
def press(t): os.kill(os.getpid(), signal.SIGINT)
cli.solved = lambda *words, **how: solve(*words, progress=press, **how)
cli.main()
"""


@pytest.mark.skipif(os.name != "posix", reason="needs signals")
def test_solve_keeps_what_ctrl_c_left(tmp_path):
    line = "solve thesis --t 1e8 --method rk4 --step 1e-3 --csv part.csv"
    done = python(PRESSED, *line.split(), cwd=tmp_path)
    assert done.returncode == 130 and "Error: interrupted" in done.stderr
    assert len((tmp_path / "part.csv").read_text().splitlines()) == 3


@pytest.mark.parametrize(
    "line, code, message",
    [
        (
            "solve thesi --t 1",
            2,
            "no file 'thesi', nor a scene of that name; the scenes are thesis, kowalewski",
        ),
        ("solve thesis --t 1,x", 2, "'1,x' is not a number"),
        ("solve thesis", 2, "--t"),
        ("solve thesis --t 1 --method rk5", 1, "did you mean 'rk4'?"),
        ("solve thesis --t nan", 1, "t must be finite"),
        ("compare thesis --t 1 --methods rk4", 1, "give steps"),
        ("methods strng", 1, "did you mean 'strang'?"),
        ("look", 2, "No such command"),
    ],
)
def test_what_is_wrong_is_said(line, code, message):
    assert message in re.sub(r"\s+", " ", call(line, code=code))


def test_compare_shows_and_writes_its_rows(tmp_path):
    line = (
        "compare thesis --t 2 --methods rk4,extrap --steps 0.1,0.05 --tols 1e-9 --repeats 1 --csv"
    )
    shown = call(line, tmp_path / "table.csv")
    with open(tmp_path / "table.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["method"], row["step"], row["tol"]) for row in rows] == [
        ("rk4", "0.1", ""), ("rk4", "0.05", ""), ("extrap", "", "1e-09"),
    ]  # fmt: skip
    assert all(f"{float(row['attitude_error']):.1e}" in shown for row in rows)


def test_methods_are_listed_and_described():
    assert all(name in call("methods") for name in kr.methods)
    assert kr.methods["rk4"].reference in call("methods rk4")


def test_the_version_is_told_by_the_module_too():
    assert kr.__version__ in call("--version")
    words = [sys.executable, "-m", "kreisel", "--version"]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert said == f"kreisel, version {kr.__version__}\n"


def test_report_says_where_it_is_made(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "top folder of the source tree" in re.sub(r"\s+", " ", call("report --quick", code=1))


def test_report_is_that_of_the_source_tree(tmp_path, monkeypatch):
    (tmp_path / "validation").mkdir()
    (tmp_path / "validation/__main__.py").write_text(
        "def main(argv):\n    print('made with', argv)\n    return 3\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "kreisel", "report", "--quick", "-h"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout) == (3, "made with ['--quick', '-h']\n")


def test_solve_gives_what_is_wanted(tmp_path):
    line = "solve asymmetric --t 1,2,3 --want nutation,apex,q --csv - --npz"
    header, *rows = csv.reader(call(line, tmp_path / "top.npz").splitlines())
    path = kr.solve(kr.scenes.asymmetric, [1, 2, 3], want=("nutation", "apex", "q"))
    assert header == ["t", "nutation", "apex_x", "apex_y", "apex_z", "q_w", "q_x", "q_y", "q_z"]
    assert np.array_equal(
        np.array(rows, float), np.column_stack([path.t, path.nutation, path.apex, path.q])
    )
    with np.load(tmp_path / "top.npz") as saved:
        assert np.array_equal(saved["apex"], path.apex)
        assert set(saved) == {"t", "nutation", "apex", "q", "scene", "head"}
    assert kr.load(tmp_path / "top.npz").want == path.want
    assert "nutation" in call("solve asymmetric --t 3 --want nutation")
