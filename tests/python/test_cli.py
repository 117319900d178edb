"""Comparisons, scenes as files, and the command line, which speaks the same words."""

import csv
import os
import re
import subprocess
import sys

import kreisel as kr
import numpy as np
import pytest
from click.testing import CliRunner
from kreisel.cli import main

CORNER = kr.Body.cuboid(half=(0.6, 0.8, 1), pivot=(0.1, -0.2, -1))
SCENE = kr.Scene(
    CORNER, momentum=(0.172, -1.862, 1.46), attitude=(0.8, 0.4, -0.2, 0.4), gravity=1 / 3
)


# kreisel.compare


def test_compare(tmp_path):
    scene = kr.scenes.thesis
    table = kr.compare(
        scene, [1, 5], ["rk4", "strang", "extrap"], steps=[0.1, 0.02], tols=[1e-6, 1e-10], repeats=2
    )
    assert [(row.method, row.step, row.tol) for row in table] == [
        ("rk4", 0.1, None), ("rk4", 0.02, None), ("strang", 0.1, None), ("strang", 0.02, None),
        ("extrap", None, 1e-6), ("extrap", None, 1e-10),
    ]  # fmt: skip
    for coarse, fine in zip(table.rows[::2], table.rows[1::2]):
        assert (
            0 < fine.attitude_error < coarse.attitude_error
            and 0 < fine.energy_error < coarse.energy_error
        )
        assert (
            0 < fine.seconds <= fine.median
            and fine.evaluations > coarse.evaluations > 0
            and fine.failure == ""
        )
    assert table[0].scene == "thesis" and table[0].steps == 50 and len(table) == 6
    truth = kr.solve(scene, [1, 5], tol=1e-13)
    again = kr.compare(scene, [1, 5], ["rk4"], steps=[0.1], truth=truth, repeats=1)[0]
    assert again.attitude_error == table[0].attitude_error
    assert (
        again.attitude_error
        == kr.attitude_error(kr.solve(scene, [1, 5], "rk4", step=0.1).q, truth.q).max()
    )
    by_method = kr.compare(scene, [1, 5], ["strang"], steps=[0.1], truth="rk4", repeats=1)[0]
    assert by_method.attitude_error == pytest.approx(table[2].attitude_error, rel=1e-3)
    table.to_csv(tmp_path / "table.csv")
    lines = (tmp_path / "table.csv").read_text().splitlines()
    assert len(lines) == 7 and lines[0].startswith("scene,method,step,tol,seconds")
    assert repr(table[0].energy_error) in lines[1]
    assert len(str(table).splitlines()) == 7 and "bobenko" not in str(table)


def test_compare_takes_all_methods_that_apply():
    rows = kr.compare(SCENE, 1, steps=[0.1], repeats=1)
    assert {row.method for row in rows} == {
        name for name, method in kr.methods.items() if method.applies_to(CORNER)
    }


def test_compare_goes_on_after_a_failure():
    scene = kr.Scene(CORNER, momentum=(1e3, -2e3, 1e3))
    blown, fine = kr.compare(scene, 50, ["rk4", "strang"], steps=[1.0], truth="strang", repeats=1)
    assert (
        "finite" in blown.failure
        and np.isnan([blown.seconds, blown.attitude_error, blown.energy_error]).all()
    )
    assert fine.failure == "" and fine.seconds > 0


# Scenes as TOML


@pytest.mark.parametrize("scale", [1e-40, 1, 1e40])
def test_toml_keeps_every_bit(scale, tmp_path):
    body = kr.Body.cuboid(
        half=np.array((0.6, 0.8, 1)) * scale, pivot=np.array((0.1, -0.2, -1)) * scale
    )
    scene = kr.Scene(
        body,
        velocity=np.array((0.172, -1.862, 1e-5)) / 3,
        attitude=SCENE.attitude,
        gravity=-0.1 * scale,
    )
    text = scene.to_toml(tmp_path / "top.toml")
    again = kr.Scene.from_toml(tmp_path / "top.toml")
    assert again == scene and again.to_toml() == text == (tmp_path / "top.toml").read_text()
    assert again._block == scene._block


@pytest.mark.parametrize(
    "body, expected",
    [
        ("cuboid = { half = [0.6, 0.8, 1], pivot = [0.1, -0.2, -1] }", CORNER),
        (
            "symmetric = { mass = 1, i1 = 2, i3 = 1.5, height = 0.5 }",
            kr.Body.symmetric(1, 2, 1.5, 0.5),
        ),
        (
            "from_com = { mass = 1, inertia_about_com = [2, 2, 1.5], com = [0, 0, 1], pivot = [0, 0.5, 0] }",
            kr.Body.from_com(1, (2, 2, 1.5), (0, 0, 1), (0, 0.5, 0)),
        ),
        (
            "mass = 1\ninertia = [[2, 0, 0], [0, 2, 0], [0, 0, 1]]\ncom = [0, 0, 1]",
            kr.Body(1, (2, 2, 1), (0, 0, 1)),
        ),
    ],
)
def test_toml_takes_the_words_of_the_constructors(body, expected, tmp_path):
    file = tmp_path / "top.toml"
    file.write_text(f"body_velocity = [0, 0.1, 2]\nattitude_xyzw = [0, 0, 1, 0]\n[body]\n{body}\n")
    assert kr.Scene.from_toml(file) == kr.Scene(
        expected, body_velocity=(0, 0.1, 2), attitude_xyzw=(0, 0, 1, 0)
    )


GOOD = "[body]\nmass = 1\ninertia = [2, 2, 1]\ncom = [0, 0, 1]\n"


@pytest.mark.parametrize(
    "text, exception, message",
    [
        (
            "momentun = [0, 0, 1]\n" + GOOD,
            ValueError,
            "unknown key in a scene: 'momentun'; did you mean 'momentum'?",
        ),
        (
            "momentum = [0, 0, 1]\n" + GOOD.replace("mass", "mas"),
            ValueError,
            "'mas'; did you mean 'mass'?",
        ),
        ("momentum = [0, 0, 1]\n[body]\ncubiod = {}\n", ValueError, "did you mean 'cuboid'?"),
        (
            "momentum = [0, 0, 1]\n[body]\ncuboid = { half = [1, 1, 1] }\n",
            ValueError,
            "cuboid has no pivot",
        ),
        ("momentum = [0, 0, 1]\n[body]\ncuboid = 3\n", TypeError, "cuboid must be a table"),
        ("momentum = [0, 0, 1]\n" + GOOD + "cuboid = {}\n", ValueError, "described in one way"),
        ("momentum = [0, 0, 1]\n", ValueError, r"table \[body\] is missing"),
        ("body = 1\nmomentum = [0, 0, 1]\n", TypeError, "body must be a table"),
        ("momentum = [0, '0', 1]\n" + GOOD, TypeError, "momentum must be 3 numbers"),
        (GOOD, ValueError, "exactly one of momentum"),
        ("momentum = [0, nan, 1]\n" + GOOD, ValueError, "momentum must be finite"),
        ("momentum = [0, 0, 1\n", ValueError, "Unclosed array"),
    ],
)
def test_toml_that_is_wrong(text, exception, message, tmp_path):
    file = tmp_path / "top.toml"
    file.write_text(text)
    with pytest.raises(exception, match=f"top.toml: .*{message}"):
        kr.Scene.from_toml(file)


# The command line


def call(*words, code=0):
    done = CliRunner().invoke(main, [str(word) for word in words])
    assert done.exit_code == code and (code == 0 or done.exc_info[0] is SystemExit), done.output
    return done.output


def test_solve_writes_all_digits(tmp_path):
    scene = tmp_path / "top.toml"
    SCENE.to_toml(scene)
    path = kr.solve(SCENE, [-1, -2], "rk4", step=0.1)
    how = ("--t", "-1,-2", "--method", "rk4", "--step", 0.1)
    header, *rows = csv.reader(call("solve", scene, *how, "--csv", "-").splitlines())
    assert header == ["t", "qw", "qx", "qy", "qz", "mx", "my", "mz"]
    assert np.array_equal(np.array(rows, float), path.states)
    shown = call("solve", scene, *how, "--npz", tmp_path / "top.npz")
    assert "2 states by rk4: 20 steps" in shown and f"{path.m[-1, 0]:.15g}" in shown
    with np.load(tmp_path / "top.npz") as saved:
        assert np.array_equal(saved["t"], path.t) and np.array_equal(saved["q"], path.q)
        assert np.array_equal(saved["m"], path.m) and str(saved["scene"]) == SCENE.to_toml()


def test_solve_keeps_what_a_failed_run_reached(tmp_path):
    how = (
        "--t",
        10,
        "--method",
        "rk4",
        "--step",
        0.1,
        "--every",
        2,
        "--max-steps",
        5,
        "--csv",
        tmp_path / "part.csv",
    )
    assert "largest number of steps" in call("solve", "thesis", *how, code=1)
    times = [line.split(",")[0] for line in (tmp_path / "part.csv").read_text().splitlines()[1:]]
    assert times == ["0.0", "0.2", "0.4", "0.5"]


PRESSED = """
import os, signal
import kreisel as kr
from kreisel.cli import main

solve = kr.solve
kr.solve = lambda *words, **how: solve(*words, progress=lambda t: os.kill(os.getpid(), signal.SIGINT), **how)
main()
"""


@pytest.mark.skipif(os.name != "posix", reason="needs signals")
def test_solve_keeps_what_ctrl_c_left(tmp_path):
    words = [
        "solve",
        "thesis",
        "--t",
        "1e8",
        "--method",
        "rk4",
        "--step",
        "1e-3",
        "--csv",
        "part.csv",
    ]
    done = subprocess.run(
        [sys.executable, "-c", PRESSED, *words],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        timeout=60,
    )
    assert done.returncode == 130 and "Error: interrupted" in done.stderr
    assert len((tmp_path / "part.csv").read_text().splitlines()) == 3


@pytest.mark.parametrize(
    "words, code, message",
    [
        (
            ("solve", "thesi", "--t", 1),
            2,
            "no file 'thesi', nor a scene of that name; the scenes are thesis, kowalewski",
        ),
        (("solve", "thesis", "--t", "1,x"), 2, "'1,x' is not a number"),
        (("solve", "thesis"), 2, "--t"),
        (("solve", "thesis", "--t", 1, "--method", "rk5"), 1, "did you mean 'rk4'?"),
        (("solve", "thesis", "--t", "nan"), 1, "t must be finite"),
        (("compare", "thesis", "--t", 1, "--methods", "rk4"), 1, "give steps"),
        (("methods", "strng"), 1, "did you mean 'strang'?"),
        (("look",), 2, "No such command"),
    ],
)
def test_what_is_wrong_is_said(words, code, message):
    assert message in re.sub(r"\s+", " ", call(*words, code=code))


def test_compare_command(tmp_path):
    how = (
        "--t",
        2,
        "--methods",
        "rk4,extrap",
        "--steps",
        "0.1,0.05",
        "--tols",
        1e-9,
        "--repeats",
        1,
    )
    shown = call("compare", "thesis", *how, "--csv", tmp_path / "table.csv")
    with open(tmp_path / "table.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["method"], row["step"], row["tol"]) for row in rows] == [
        ("rk4", "0.1", ""), ("rk4", "0.05", ""), ("extrap", "", "1e-09"),
    ]  # fmt: skip
    assert all(f"{float(row['attitude_error']):.1e}" in shown for row in rows)


def test_methods_command():
    assert all(name in call("methods") for name in kr.methods)
    assert kr.methods["rk4"].reference in call("methods", "rk4")


def test_version_and_module():
    assert kr.__version__ in call("--version")
    words = [sys.executable, "-m", "kreisel", "--version"]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert said == f"kreisel, version {kr.__version__}\n"


def test_report_says_where_it_is_made(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "top folder of the source tree" in re.sub(r"\s+", " ", call("report", "--quick", code=1))


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


def test_solve_what_is_wanted(tmp_path):
    how = ("--t", "1,2,3", "--want", "nutation,apex,q", "--npz", tmp_path / "top.npz", "--csv", "-")
    header, *rows = csv.reader(call("solve", "asymmetric", *how).splitlines())
    path = kr.solve(kr.scenes.asymmetric, [1, 2, 3], want=("nutation", "apex", "q"))
    assert header == ["t", "nutation", "apex_x", "apex_y", "apex_z", "qw", "qx", "qy", "qz"]
    assert np.array_equal(
        np.array(rows, float), np.column_stack([path.t, path.nutation, path.apex, path.q])
    )
    with np.load(tmp_path / "top.npz") as saved:
        assert np.array_equal(saved["apex"], path.apex) and set(saved) == {
            "t",
            "nutation",
            "apex",
            "q",
            "scene",
        }
    assert "nutation" in call("solve", "asymmetric", "--t", 3, "--want", "nutation")
