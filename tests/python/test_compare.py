"""Tests of kreisel.compare, including methods that fail."""

import kreisel as kr
import numpy as np
import pytest
from cli_helpers import make_raiser
from kreisel._analysis.compare import _TimedMethodRun
from tops import CORNER, GENERAL

TOP, THESIS = kr.scenes.asymmetric, kr.scenes.thesis

TRUE = "strang", 0.25 / 16.0


def test_rows_contain_errors_and_run_times(tmp_path):
    scene = kr.scenes.thesis
    table = kr.compare(
        scene, [1, 5], ["rk4", "strang", "extrap"], steps=[0.1, 0.02], tols=[1e-6, 1e-10], repeats=2
    )
    assert [(row.method, row.step, row.tol) for row in table] == [
        ("rk4", 0.1, None), ("rk4", 0.02, None), ("strang", 0.1, None), ("strang", 0.02, None),
        ("extrap", None, 1e-6), ("extrap", None, 1e-10),
    ]  # fmt: skip
    for coarse, fine in zip(table.rows[::2], table.rows[1::2], strict=True):
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


def test_compare_includes_all_methods_that_apply():
    rows = kr.compare(GENERAL, 1, steps=[0.1], repeats=1)
    assert {row.method for row in rows} == {
        name for name, method in kr.methods.items() if method.applies_to(CORNER)
    }


def test_compare_continues_after_a_failure():
    scene = kr.Scene(CORNER, momentum=(1e3, -2e3, 1e3), gravity=1)
    failed_row, good_row = kr.compare(
        scene, 50, ["rk4", "strang"], steps=[1.0], truth="strang", repeats=1
    )
    assert (
        "finite" in failed_row.failure
        and np.isnan([failed_row.seconds, failed_row.attitude_error, failed_row.energy_error]).all()
    )
    assert good_row.failure == "" and good_row.seconds > 0


# Boundary values


def test_the_text_of_a_comparison_has_one_column_per_field():
    table = kr.compare(THESIS, [1.0], ["rk4", "taylor"], steps=[0.125], tols=[1e-9], repeats=1)
    head, *lines = str(table).splitlines()
    for line, step, tol in zip(lines, ("0.125", ""), ("", "1e-09"), strict=True):
        cells = {name: line[head.index(name) :].split("  ")[0] for name in ("step", "tol")}
        assert cells == {"step": step, "tol": tol}
        assert line.startswith("thesis")


def test_a_fixed_step_reference_uses_a_sixteenth_of_the_smallest_step():
    (row, _) = kr.compare(TOP, [1.0], ["rk4"], steps=[0.25, 0.5], truth="strang", repeats=1)
    ends = [kr.solve(TOP, [1.0], *method, step=step).q for *method, step in (("rk4", 0.25), TRUE)]
    assert row.attitude_error == kr.attitude_error(*ends).max()


def test_a_step_that_a_method_refuses_has_a_row():
    (row,) = kr.compare(THESIS, 1.0, ["bobenko_suris4"], steps=[5.0], repeats=1)
    assert "too large" in row.failure and np.isnan(row.attitude_error) and row.steps == 0


@pytest.mark.parametrize("truth", ["auto", kr.solve(TOP, [1.0, 2.0])], ids=["method", "path"])
@pytest.mark.parametrize(
    "t, tols, message",
    [
        ([2.0, 1.0], [], "times must move away from 0"),
        ([1.0, np.nan], [], "t must be finite"),
        ([[1.0, 2.0]], [], "not an array of shape"),
        (1e300, [], "double precision cannot resolve"),
        ([1.0, 2.0], [2.0], "tol must be below 1"),
    ],
)
def test_invalid_arguments_are_refused_before_any_run(monkeypatch, truth, t, tols, message):
    monkeypatch.setattr(_TimedMethodRun, "solve_and_store_seconds", make_raiser(AssertionError))
    with pytest.raises(ValueError, match=message):
        kr.compare(TOP, t, ["rk4", "extrap"], steps=[0.1], tols=tols, truth=truth)


@pytest.mark.parametrize("t, others", [([1.0, 2.0], [1.0, 3.0]), ([1.0], [1.0, 2.0]), (2.0, [2.0])])
def test_a_reference_at_other_times_is_refused(monkeypatch, t, others):
    monkeypatch.setattr(_TimedMethodRun, "solve_and_store_seconds", make_raiser(AssertionError))
    with pytest.raises(ValueError, match="a path at the requested times"):
        kr.compare(TOP, t, ["strang"], steps=[0.1], truth=kr.solve(TOP, others), repeats=1)


@pytest.mark.parametrize("t", [2.0, -2.0, [0.5, 2.0], []])
def test_a_reference_may_be_a_path_at_the_same_times(t):
    (row,) = kr.compare(TOP, t, ["strang"], steps=[0.1], truth=kr.solve(TOP, t), repeats=1)
    assert row.failure == "" and (row.attitude_error > 0.0) == bool(np.size(t))
