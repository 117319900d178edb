"""Tests of the command-line interface."""

import csv
import importlib
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, join_lines, make_raiser
from click.testing import CliRunner
from ensembles import same_bits
from internals import RECORDABLE, cli
from kreisel._options.times import CHUNK_SIZE
from toolbox import HANG
from tops import GENERAL, LAGRANGE

SCENE = GENERAL.replace(gravity=1 / 3)


def test_solve_writes_all_digits(tmp_path):
    scene = tmp_path / "top.toml"
    SCENE.to_toml(scene)
    path = kr.solve(SCENE, [-1, -2], "rk4", step=0.1)
    line = "solve --t -1,-2 --method rk4 --step 0.1"
    header, *rows = csv.reader(call(line, "--csv", "-", scene).splitlines())
    momenta = [f"m_{axis} [M L^2 T^-1]" for axis in "xyz"]
    assert header == ["t [T]", "q_w", "q_x", "q_y", "q_z", *momenta]
    assert np.array_equal(np.array(rows, float), path.states)
    output = call(line, "--npz", tmp_path / "top.npz", scene)
    assert "2 states by rk4: 20 steps" in output and f"{path.m[-1, 0]:.15g}" in output
    with np.load(tmp_path / "top.npz") as archive:
        assert np.array_equal(archive["t"], path.t) and np.array_equal(archive["q"], path.q)
        assert np.array_equal(archive["m"], path.m) and str(archive["scene"]) == SCENE.to_toml()


def test_solve_json_contains_everything_that_determines_the_path():
    path = kr.solve(SCENE, [0, 0.5, 1], "taylor", digits=20)
    data = json.loads(call("solve - --t 0,0.5,1 --digits 20 --json -", text=SCENE.to_toml()))
    assert data["scene"] == tomllib.loads(SCENE.to_toml())
    assert data["kreisel"] == kr.__version__ and data["stopped"] is None
    assert (data["method"], data["digits"], data["tol"]) == ("taylor", 20, path.tol)
    assert data["stats"]["steps"] == path.stats.steps and data["t"] == [0, 0.5, 1]
    assert np.array_equal(data["q"], path.q) and np.array_equal(data["m"], path.m)


def test_json_has_null_for_missing_numbers():
    line = "solve asymmetric --t 1 --want kowalewski --json -"
    data = json.loads(call(line), parse_constant=pytest.fail)
    assert data["kowalewski"] == [None, None]


def test_solve_returns_the_wanted_quantities(tmp_path):
    line = "solve asymmetric --t 1,2,3 --want nutation,apex,q --csv - --npz"
    header, *rows = csv.reader(call(line, tmp_path / "top.npz").splitlines())
    path = kr.solve(kr.scenes.asymmetric, [1, 2, 3], want=("nutation", "apex", "q"))
    apex = ["apex_x", "apex_y", "apex_z"]
    assert header == ["t [T]", "nutation [rad]", *apex, "q_w", "q_x", "q_y", "q_z"]
    assert np.array_equal(
        np.array(rows, float), np.column_stack([path.t, path.nutation, path.apex, path.q])
    )
    with np.load(tmp_path / "top.npz") as archive:
        assert np.array_equal(archive["apex"], path.apex)
        assert set(archive) == {"t", "nutation", "apex", "q", "scene", "head"}
    assert kr.load(tmp_path / "top.npz").want == path.want
    assert "nutation" in call("solve asymmetric --t 3 --want nutation")


def test_angles_are_in_degrees_on_request():
    line = "solve cusps --t 1,2 --want nutation,apex --csv -"
    radians, degrees = (
        np.array([row.split(",") for row in call(more).splitlines()[1:]], float)
        for more in (line, line + " --degrees")
    )
    np.testing.assert_allclose(degrees[:, 1], np.degrees(radians[:, 1]), rtol=1e-15)
    assert np.array_equal(degrees[:, 2:], radians[:, 2:])
    data = json.loads(call("solve cusps --t 1,2 --want nutation --json - --degrees"))
    assert data["nutation"] == degrees[:, 1].tolist()


def test_long_paths_are_written_in_chunks_with_the_same_bits(tmp_path):
    line = "solve asymmetric --t 0:40:0.001 --method strang --step 0.01 --csv"
    path = kr.solve(kr.scenes.asymmetric, np.arange(40001) * 0.001, "strang", step=0.01)
    output = call(line, tmp_path / "a.csv", "--npz", tmp_path / "a.npz")
    rows = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
    assert same_bits(rows, path.states)
    with np.load(tmp_path / "a.npz") as archive:
        assert same_bits(archive["q"], path.q)
    assert "40001 states" in output and f"energy error {path.energy_error:.2g}" in output
    again = kr.load(tmp_path / "a.npz")
    assert same_bits(again.states, path.states) and again.stats == path.stats
    want_output = call(line.replace("--csv", "--want nutation --npz"), tmp_path / "b.npz")
    assert "40001 states" in want_output
    with np.load(tmp_path / "b.npz") as archive:
        assert same_bits(archive["nutation"], path.nutation)


def test_events_of_long_paths_are_joined(tmp_path):
    call("solve asymmetric --t 0:40:0.001 --events nutation --npz", tmp_path / "a.npz")
    found = kr.load(tmp_path / "a.npz").events
    expected = kr.solve(kr.scenes.asymmetric, 40.0, events=[kr.events.nutation()]).events
    assert np.allclose(found.t, expected.t, atol=1e-12) and len(found) > 10
    assert (found.direction == expected.direction).all() and (found.which == 0).all()


def test_every_records_each_nth_step():
    line = "solve thesis --t 1 --method rk4 --step 0.1 --every 5 --csv -"
    times = [row.split(",")[0] for row in call(line).splitlines()[1:]]
    assert times == ["0.0", "0.5", "1.0"]


def test_geometric_prints_its_choice():
    output = call("solve asymmetric_regular --t 5 --method geometric --error 1e-6")
    path = kr.solve(kr.scenes.asymmetric_regular, 5, "geometric", error=1e-6)
    assert str(path.plan.choice) in output and path.method in output


def test_tops_with_unequal_damping_have_no_energy_error_and_no_viewer(tmp_path):
    kr.scenes.asymmetric.replace(damping=(0.1, 0.2, 0.1)).to_toml(tmp_path / "top.toml")
    assert "energy error" not in call("solve --t 5", tmp_path / "top.toml")
    assert "one damping" in call("view", tmp_path / "top.toml", "--save", tmp_path / "a", code=2)


def test_compare_shows_and_writes_its_rows(tmp_path):
    line = (
        "compare thesis --t 2 --methods rk4,extrap --steps 0.1,0.05 --tols 1e-9 --repeats 1 --csv"
    )
    output = call(line, tmp_path / "table.csv")
    with open(tmp_path / "table.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["method"], row["step"], row["tol"]) for row in rows] == [
        ("rk4", "0.1", ""), ("rk4", "0.05", ""), ("extrap", "", "1e-09"),
    ]  # fmt: skip
    assert all(f"{float(row['attitude_error']):.1e}" in output for row in rows)


def test_compare_writes_to_standard_output():
    line = "compare thesis --t 0:2:0.5 --methods rk4 --steps 0.1 --repeats 1 --csv -"
    rows = list(csv.DictReader(call(line).splitlines()))
    assert [(row["scene"], row["method"], row["steps"]) for row in rows] == [
        ("thesis", "rk4", "20")
    ]


def test_methods_are_listed_and_described():
    assert all(name in call("methods") for name in kr.methods)
    assert kr.methods["rk4"].reference in call("methods rk4")


def test_scenes_are_listed_and_written(tmp_path):
    output = call("scenes")
    assert all(name in output for name in kr.scenes.about)
    (tmp_path / "top.toml").write_text(call("scenes dzhanibekov"))
    assert kr.Scene.from_toml(tmp_path / "top.toml") == kr.scenes.dzhanibekov


def test_quantities_are_listed():
    output = call("quantities")
    assert all(name in output for name in RECORDABLE)


def test_the_version_is_printed_by_the_command_and_the_module():
    assert kr.__version__ in call("--version")
    words = [sys.executable, "-m", "kreisel", "--version"]
    output = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert output == f"kreisel, version {kr.__version__}\n"


def test_report_outside_the_source_tree_explains_where_to_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "top folder of the source" in join_lines(call("report --quick", code=2))
    for word in ("-h", "--help"):
        output = join_lines(call(f"report {word}"))
        assert "accuracy, speed and stability" in output and "--thesis" in output


def test_report_runs_the_validation_of_the_source_tree(tmp_path):
    (tmp_path / "validation").mkdir()
    (tmp_path / "validation/__main__.py").write_text(
        "def main(argv):\n    print('made with', argv)\n    return 3\n"
    )
    result = subprocess.run(
        [sys.executable, "-m", "kreisel", "report", "--quick", "-h"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert (result.returncode, result.stdout) == (3, "made with ['--quick', '-h']\n")


PRECESSING = kr.Scene.spinning(LAGRANGE.body, spin=1.0, tilt=1.0, precession=2.0, gravity=1)


def table(text):
    """Return the heading and the numbers of a printed table."""
    _, head, *lines = text.splitlines()
    return head, np.array(
        [line.split() for line in lines if re.match(r" *[-\d.e+]+  ", line)], float
    )


def test_solve_prints_a_table_with_units(tmp_path):
    path = kr.solve(GENERAL, np.linspace(0, 2, 21))
    GENERAL.to_toml(tmp_path / "top.toml")
    output = call("solve --t 0:2:0.1 --want nutation,energy,m --degrees", tmp_path / "top.toml")
    head, rows = table(output)
    assert "nutation [deg]" in head and "energy [M L^2 T^-2]" in head
    assert "t [T]" in head and "m_x [M L^2 T^-1]" in head
    expected = np.column_stack([path.t, np.degrees(path.nutation), path.energy, path.m])
    assert rows == pytest.approx(expected, rel=1e-7, abs=1e-12)


@pytest.mark.parametrize(
    "line",
    [
        "solve asymmetric --t 1",
        "solve asymmetric --t 0:9:1 --events nutation",
        "compare thesis --t 1 --repeats 1 --methods rk4,taylor --steps 0.1",
        "scenes",
        "methods",
        "quantities",
    ],
)
def test_narrow_terminals_cut_no_number_and_no_word(line, monkeypatch):
    words = {}
    for columns in ("500", "20"):
        monkeypatch.setenv("COLUMNS", columns)
        words[columns] = sorted(call(line).split())
        words[columns] = [word for word in words[columns] if not set(word) <= {"─"}]
    if line.startswith("compare"):  # its run times differ
        assert len(words["20"]) == len(words["500"]) and "..." not in "".join(words["20"])
    else:
        assert words["20"] == words["500"]
    assert "…" not in "".join(words["20"])


def test_long_tables_show_both_ends_and_the_number_of_omitted_rows():
    output = call("solve cusps --t 0:10:0.1 --want nutation")
    _, rows = table(output)
    assert rows[:, 0] == pytest.approx([*(0.1 * np.arange(20)), *(8.1 + 0.1 * np.arange(20))])
    assert "... 61 rows omitted: --all-rows prints them, --csv writes them" in output
    _, rows = table(call("solve cusps --t 0:10:0.1 --want nutation --all-rows"))
    assert rows[:, 0] == pytest.approx(0.1 * np.arange(101))
    for count in (40, 41):
        output = call(f"solve cusps --t 0:{count - 1}:1 --want nutation")
        assert ("... 1 row omitted" in output) == (count == 41)
        assert len(table(output)[1]) == 40
    assert "first" in call("solve cusps --t 0:1:1 --want nutation")


def test_angles_are_continuous_with_unwrap(tmp_path):
    scene = tmp_path / "top.toml"
    PRECESSING.to_toml(scene)
    line = "solve --t 0:20:0.1 --want precession_angle,spin_angle"
    path = kr.solve(PRECESSING, 0.1 * np.arange(201))
    for degrees in ("", " --degrees"):
        whole = path.euler(degrees=bool(degrees), unwrap=True)[:, [0, 2]]
        default_output = call(line + degrees, scene)
        assert "angles jump by whole turns: --unwrap makes them continuous" in default_output
        output = call(line + degrees + " --unwrap --all-rows", scene)
        assert "jump" not in output and table(output)[1][:, 1:] == pytest.approx(whole, rel=1e-7)
        text = call(line + degrees + " --unwrap --csv -", scene)
        rows = np.array([*csv.reader(text.splitlines()[1:])], float)
        assert rows[:, 1:] == pytest.approx(whole, abs=1e-9)
        data = json.loads(call(line + degrees + " --unwrap --json -", scene))
        assert data["precession_angle"] == pytest.approx(whole[:, 0], abs=1e-9)


def test_unwrapped_angles_are_continuous_across_chunks():
    line = "solve asymmetric --t 0:2000:0.05 --want spin_angle --unwrap"
    path = kr.solve(kr.scenes.asymmetric, 0.05 * np.arange(40001), want=["spin_angle"])
    rows = np.array([*csv.reader(call(line, "--csv", "-").splitlines()[1:])], float)
    assert len(rows) == 40001 > CHUNK_SIZE
    assert rows[:, 1] == pytest.approx(np.unwrap(path.spin_angle), abs=1e-9)


# The table of methods, and the report


@pytest.fixture
def source_tree(tmp_path, monkeypatch):
    (tmp_path / "validation").mkdir()
    (tmp_path / "validation/__main__.py").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))


def test_the_table_of_methods_is_markdown():
    lines = call("methods --markdown").splitlines()
    rows = {cells[0]: cells for cells in (line.strip("| ").split(" | ") for line in lines)}
    assert rows["rk4"][2:5] == ["1.0"] * 3 and rows["exact"][1] == "varies"
    assert rows.keys() >= kr.methods.keys()


@pytest.mark.usefixtures("source_tree")
def test_a_report_without_its_dependencies_names_them(monkeypatch):
    missing = ModuleNotFoundError("No module named 'heyoka'", name="heyoka")
    monkeypatch.setattr(importlib, "import_module", make_raiser(missing))
    output = call("report --quick", code=1)
    assert "the report needs heyoka: pip install 'kreisel[report]'" in output
    assert "--thesis" in call("report --help")


@pytest.mark.usefixtures("source_tree")
def test_a_missing_module_of_the_report_is_not_hidden(monkeypatch):
    missing = ModuleNotFoundError("no", name="validation.parts")
    monkeypatch.setattr(importlib, "import_module", make_raiser(missing))
    result = CliRunner().invoke(cli.main, ["report"])
    assert result.exception is missing


@pytest.mark.usefixtures("source_tree")
@pytest.mark.parametrize("code", [0, 3])
def test_report_returns_the_exit_code_of_validation(monkeypatch, code):
    machinery = SimpleNamespace(main=lambda words: code if words == ["--quick"] else 9)
    monkeypatch.setattr(importlib, "import_module", lambda name: machinery)
    call("report --quick", code=code)


def test_report_runs_the_validation_of_the_working_directory(tmp_path):
    folder = tmp_path / "validation"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "__main__.py").write_text("def main(words):\n    print('made here', words)\n")
    kreisel = Path(sys.executable).parent / "kreisel"  # its folder is the first in sys.path
    result = subprocess.run(
        [kreisel, "report", "--quick"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=HANG,
    )
    assert result.stdout == "made here ['--quick']\n" and result.returncode == 0
