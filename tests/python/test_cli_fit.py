"""The command kreisel fit: the numbers of kr.fit, its output files and its interruption."""

import csv
import errno
import os

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import call, invoke, make_raiser

TRUTH = kr.scenes.asymmetric
START = kr.solve(TRUTH, [0.0]).body_velocity[0]
GUESS = TRUTH.replace(body_velocity=START + 0.05)
FIT = "fit record.csv guess.toml --free velocity --sigma 1e-3"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Write records of one motion and a guess of it, and make their folder the current one."""
    monkeypatch.chdir(tmp_path)
    path = kr.solve(TRUTH, np.linspace(0.0, 1.0, 13))
    path.to_csv("record.csv", "body_velocity", "nutation")
    path.to_csv("degrees.csv", "body_velocity", "nutation", degrees=True)
    _, *rows = (tmp_path / "degrees.csv").read_text().splitlines()
    (tmp_path / "plain.csv").write_text("\n".join(["when,wx,wy,wz,lean", *rows, ""]))
    force = np.column_stack([path.t, path.specific_force((0.1, 0.0, 0.2))])
    np.savetxt("force.csv", force, delimiter=",", header="t,ax,ay,az", comments="")
    GUESS.to_toml("guess.toml")
    return tmp_path


FITS = [  # (record and options, arguments of Record.from_csv, arguments of kr.fit)
    ("record.csv --free velocity --sigma 1e-3", {"sigma": 1e-3}, {"free": "velocity"}),
    ("record.csv --free velocity", {}, {"free": "velocity"}),
    (
        "degrees.csv --free velocity --sigma 1e-3 --degrees",
        {"sigma": 1e-3, "degrees": True},
        {"free": "velocity"},
    ),
    (
        "plain.csv --free velocity --time when --degrees --column body_velocity=wx,wy,wz "
        "--column nutation=lean --sigma nutation=0.1 --sigma body_velocity=1e-3",
        {
            "t": "when",
            "columns": {"body_velocity": ["wx", "wy", "wz"], "nutation": "lean"},
            "degrees": True,
            "sigma": {"nutation": 0.1, "body_velocity": 1e-3},
        },
        {"free": "velocity"},
    ),
    (
        "record.csv --free velocity,gravity --instrument bias,delay --sigma 1e-3",
        {"sigma": 1e-3, "free": ["bias", "delay"]},
        {"free": ["velocity", "gravity"]},
    ),
    (
        "force.csv --free velocity --column specific_force=ax,ay,az --point .1,0,.2 --sigma 1e-3",
        {"columns": {"specific_force": ["ax", "ay", "az"]}, "point": (0.1, 0, 0.2), "sigma": 1e-3},
        {"free": "velocity"},
    ),
    (
        "record.csv --free start --loss soft --sigma 1e-2",
        {"sigma": 1e-2},
        {"free": "start", "loss": "soft"},
    ),
    (
        "record.csv --free velocity --pieces 2 --sigma 1e-3",
        {"sigma": 1e-3},
        {"free": "velocity", "pieces": 2},
    ),
]


@pytest.mark.parametrize(("options", "record", "words"), FITS, ids=[row[0] for row in FITS])
def test_every_option_of_fit_means_the_same_as_in_python(folder, options, record, words):
    file, _, options = options.partition(" ")
    fit = kr.fit(GUESS, kr.Record.from_csv(file, **record), **words)
    told = call(f"fit {file} guess.toml {options} --csv fit.csv --save fit.toml")
    assert told == f"{fit}\n"
    head, *rows = csv.reader((folder / "fit.csv").read_text().splitlines())
    assert head == ["parameter", "value", "error", "unit"]
    for (name, value, error, unit), expected in zip(rows, fit.names, strict=True):
        assert (name, unit) == (expected, dict(zip(fit.names, fit.units, strict=True))[name])
        assert (float(value), float(error)) == (fit.values[name], fit.error[name])
    assert (folder / "fit.toml").read_text() == fit.to_toml()
    found = kr.solve(kr.Scene.from_toml("fit.toml"), [0.0]).body_velocity[0]
    np.testing.assert_allclose(found, START, atol=1e-6)


@pytest.mark.parametrize("option", ["--save", "--csv"])
def test_an_output_on_standard_output_replaces_the_summary(folder, option):
    call(f"{FIT} {option} file")
    assert call(f"{FIT} {option} -") == (folder / "file").read_text()


@pytest.mark.filterwarnings("default")  # a warning must appear as a line of the output
def test_a_fit_that_does_not_converge_ends_with_exit_code_1(folder):
    told = call(f"{FIT} --free start,moments --max-evaluations 2 --csv fit.csv", code=1)
    assert "Warning: " in told and "--max-evaluations" in told and (folder / "fit.csv").exists()


@pytest.mark.parametrize("has_fit", [True, False])
def test_an_interrupted_fit_writes_the_best_one_so_far(folder, monkeypatch, has_fit):
    decompose, calls = np.linalg.eigh, []

    def decompose_or_stop(matrix):
        calls.append(matrix)
        if not has_fit or len(calls) > 3:
            raise KeyboardInterrupt
        return decompose(matrix)

    monkeypatch.setattr(np.linalg, "eigh", decompose_or_stop)
    told = call(f"{FIT} --csv fit.csv", code=130)
    assert told.endswith("Error: the fit was interrupted\n") and told.count("Error") == 1
    assert ("Fit of" in told) == (folder / "fit.csv").exists() == has_fit


def test_a_record_may_be_a_pipe(folder):
    read_end, write_end = os.pipe()
    with open(write_end, "wb") as pipe:
        pipe.write((folder / "record.csv").read_bytes())
    output = call(FIT.replace("record.csv", f"/dev/fd/{read_end}"))
    os.close(read_end)
    assert output == call(FIT)


# Plots


@pytest.mark.parametrize(
    ("file", "start"), [("a.png", b"\x89PNG"), ("a.PDF", b"%PDF"), ("a.svg", b"<?xml")]
)
def test_the_ending_of_a_plot_is_its_format(folder, file, start):
    call(f"{FIT} --plot {file}")
    assert (folder / file).read_bytes().startswith(start)


def test_a_plot_on_standard_output_is_a_png_file_and_nothing_else(folder):
    result = invoke([*FIT.split(), "--plot", "/dev/stdout"])
    assert result.exit_code == 0 and result.stdout_bytes.startswith(b"\x89PNG")


def test_a_plot_that_fills_the_disk_leaves_the_old_file(folder, monkeypatch):
    (folder / "a.svg").write_text("old")
    full = OSError(errno.ENOSPC, "No space left on device")
    monkeypatch.setattr(os, "write", make_raiser(full))
    output = call(f"{FIT} --plot a.svg", code=1)
    assert "No space left on device: 'a.svg'" in output
    assert (folder / "a.svg").read_text() == "old" and not [*folder.glob(".*")]
