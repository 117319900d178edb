"""Tests of kreisel.plan and of kreisel.compare."""

import csv
import pickle

import kreisel as kr
import numpy as np
import pytest
from tops import CORNER, FREE, GENERAL

TOP, THESIS = kr.scenes.asymmetric, kr.scenes.thesis
TOPS = THESIS.vary(spin=[1.0, 2.0, 3.0], tilt=[[0.2], [0.4]])


# Plans


def test_a_plan_describes_method_form_and_memory():
    plan = kr.plan(TOP, want=("nutation", "energy"))
    assert plan.method == "taylor" and plan.columns == ("t", "nutation", "energy")
    assert plan.bytes == 24 and kr.plan(TOP, 100).bytes == 64
    assert plan.kernel in ("avx512", "avx2", "neon", "base") and plan.order in (12, 16, 18, 22, 28)
    assert "24 bytes a state" in str(plan) and all(
        len(line) < 200 for line in str(plan).split("\n")
    )
    assert kr.plan(TOP, digits=30).columns[-1] == "m_low"
    assert kr.plan(THESIS).method == "exact" and "closed form" in kr.plan(THESIS).why


FREE_TOP, ENERGY = FREE.replace(gravity=0), ("energy",)
LISTED = [  # a scene, arguments, the list, an entry, and whether the entry is in the list
    (TOP, {"want": ("nutation", "energy")}, "left_out", "attitude", True),
    (TOP, {"t": 100}, "left_out", "states in between", True),
    (TOP, {"t": [1, 2, 3]}, "left_out", "states in between", False),
    (FREE_TOP, {}, "left_out", "gravity", True),
    (THESIS, {"method": "strang", "step": 0.1}, "left_out", "two of the four rotations", True),
    (TOP, {"want": ENERGY, "method": "strang", "step": 0.1}, "kept", "attitude", True),
    (TOP, {"want": ("apex",), "method": "strang", "step": 0.1}, "kept", "attitude", False),
    (TOP, {"want": ENERGY, "method": "taylor"}, "kept", "attitude", False),
    (TOP.replace(gravity=0), {"method": "taylor"}, "kept", "torque", True),
    (THESIS, {"method": "taylor"}, "kept", "general form", True),
]


@pytest.mark.parametrize(("scene", "words", "name", "entry", "is_listed"), LISTED)
def test_a_plan_lists_what_is_left_out_and_what_is_kept(scene, words, name, entry, is_listed):
    entries = dict(getattr(kr.plan(scene, **words), name))
    assert any(entry in key for key in entries) == is_listed


@pytest.mark.parametrize(
    "words",
    [{}, {"want": ENERGY}, {"digits": 20}, {"method": "strang", "step": 0.1}, {"tol": 1e-3}],
)
def test_the_plan_equals_that_of_the_path(words):
    path = kr.solve(TOP, 5, **words)
    assert path.plan == kr.plan(TOP, 5, **words) == pickle.loads(pickle.dumps(path)).plan
    assert kr.solve(TOP, -5, "strang", step=0.1).plan.step == 0.1


# Comparisons


@pytest.mark.parametrize(
    "tops, words, counts",
    [
        (THESIS.vary(turning=[(0, 0, 1), (0, 1, 0), (0, 0, 0)]), {}, (2, 0, 1)),
        (TOP.vary(turning=[(0, 0, 1), (0, 1, 0)]), {}, (0, 1, 1)),
        (THESIS.vary(gravity=[1, 2]), {"method": "exact"}, (2, 0, 0)),
        (TOP.vary(gravity=[1, 2]), {"method": "rk4", "step": 0.1}, (0, 0, 2)),
        (TOP.vary(gravity=[]), {}, (0, 0, 0)),
    ],
)
def test_a_plan_of_many_tops_counts_them_by_the_way_they_are_computed(tops, words, counts):
    plan = kr.plan(tops, 1.0, **words)
    assert (plan.closed_form, plan.lanes, plan.alone) == counts
    assert (plan.method == "") == (plan.seconds == 0) == (tops.size == 0)


def test_rows_contain_errors_and_run_times(tmp_path):
    methods, steps, tols = ["rk4", "strang", "extrap"], [0.1, 0.02], [1e-6, 1e-10]
    reports = []
    table = kr.compare(
        THESIS, [1, 5], methods, steps=steps, tols=tols, repeats=2, progress=reports.append
    )
    assert [(row.method, row.step, row.tol) for row in table] == [
        *((name, step, None) for name in ("rk4", "strang") for step in steps),
        *(("extrap", None, tol) for tol in tols),
    ]
    assert reports == pytest.approx([i / 12 for i in range(1, 13)]) and reports[-1] == 1.0
    truth = kr.solve(THESIS, [1, 5], digits=30)
    for row in table:
        path = kr.solve(THESIS, [1, 5], row.method, step=row.step, tol=row.tol)
        error = kr.attitude_error(path.q, truth.q).max()
        assert row.attitude_error == pytest.approx(error, rel=1e-3)
        assert row.energy_error == path.energy_error and row.failure == ""
        assert (row.steps, row.evaluations) == (path.stats.steps, path.stats.evaluations)
        assert 0 < row.seconds <= row.median and row.scene == "thesis"
    text = table.to_csv(tmp_path / "table.csv")
    assert (tmp_path / "table.csv").read_text() == text
    for row, words in zip(table, csv.DictReader(text.splitlines()), strict=True):
        values = {name: getattr(row, name) for name in words}
        assert words == {n: "" if value is None else str(value) for n, value in values.items()}
    head, *lines = str(table).splitlines()
    assert len(lines) == 6
    for line, row in zip(lines, table, strict=True):
        cells = {name: line[head.index(name) :].split("  ")[0] for name in ("step", "tol")}
        assert cells["step"] == (f"{row.step:.3g}" if row.step else "")
        assert cells["tol"] == (f"{row.tol:.3g}" if row.tol else "")


def test_all_methods_that_apply_are_compared():
    rows = kr.compare(GENERAL, 1, steps=[0.1], repeats=1)
    applying = {name for name, method in kr.methods.items() if method.applies_to(CORNER)}
    assert {row.method for row in rows} == applying


def test_a_comparison_continues_after_a_failure():
    scene = kr.Scene(CORNER, momentum=(1e3, -2e3, 1e3), gravity=1)
    failed, good = kr.compare(scene, 50, ["rk4", "strang"], [1.0], truth="strang", repeats=1)
    assert "finite" in failed.failure and good.failure == "" and good.seconds > 0
    assert np.isnan([failed.seconds, failed.attitude_error, failed.energy_error]).all()
    [refused] = kr.compare(THESIS, 1.0, ["bobenko_suris4"], steps=[5.0], repeats=1)
    assert "too large" in refused.failure and np.isnan(refused.attitude_error)


def test_a_fixed_step_reference_uses_a_sixteenth_of_the_smallest_step():
    row, _ = kr.compare(TOP, [1.0], ["rk4"], steps=[0.25, 0.5], truth="strang", repeats=1)
    path = kr.solve(TOP, [1.0], "rk4", step=0.25)
    reference = kr.solve(TOP, [1.0], "strang", step=0.25 / 16.0)
    assert row.attitude_error == kr.attitude_error(path.q, reference.q).max()


def test_a_reference_may_be_a_path_at_the_same_times():
    truth = kr.solve(TOP, -2.0, digits=30)
    [row] = kr.compare(TOP, -2.0, ["strang"], steps=[0.1], truth=truth, repeats=1)
    path = kr.solve(TOP, -2.0, "strang", step=0.1)
    assert row.attitude_error == kr.attitude_error(path.q, truth.q).max()


def compare(**words):
    """Compare methods by a call that must be refused before it runs."""

    def fail(_):
        pytest.fail("a method was run")

    return kr.compare(**{"progress": fail, **words})


COMPARISON = {"scene": TOP, "t": [1.0, 2.0], "methods": ["rk4", "extrap"], "steps": [0.1]}
PATH = COMPARISON | {"truth": kr.solve(TOP, [1.0, 2.0])}
REFUSALS = [  # function, valid arguments, name, bad value, exception, word
    (compare, COMPARISON, "t", [2.0, 1.0], ValueError, "away from 0"),
    (compare, PATH, "t", [1.0, np.nan], ValueError, "finite"),
    (compare, COMPARISON, "t", [[1.0, 2.0]], ValueError, "shape"),
    (compare, PATH, "t", 1e300, ValueError, "cannot resolve"),
    (compare, COMPARISON, "tols", [2.0], ValueError, "below 1"),
    (compare, PATH, "t", [1.0, 3.0], ValueError, "requested times"),
    (compare, PATH, "t", [1.0], ValueError, "requested times"),
    (compare, PATH, "t", 2.0, ValueError, "requested times"),
    (compare, COMPARISON, "progress", 3, TypeError, "progress"),
    (compare, COMPARISON, "steps", (), ValueError, "fixed step"),
    (compare, COMPARISON, "steps", 0.1, TypeError, "list"),
    (compare, COMPARISON, "methods", "rk4", TypeError, "list"),
    (
        compare,
        COMPARISON | {"methods": ["extrap"], "steps": ()},
        "truth",
        "rk4",
        ValueError,
        "steps",
    ),
    (kr.plan, {"scene": TOP}, "method", "geometric", ValueError, "trial runs"),
    (kr.plan, {"scene": TOP}, "method", "rk4", ValueError, "fixed step"),
    (kr.plan, {}, "scene", 3, TypeError, "scene"),
    (kr.plan, {"scene": TOP}, "threads", 2, ValueError, "many tops"),
    (kr.plan, {"scene": TOP}, "reduce", {"energy": "min"}, ValueError, "many tops"),
]


@pytest.mark.parametrize(("call", "words", "name", "value", "error", "word"), REFUSALS)
def test_bad_arguments_are_refused(call, words, name, value, error, word):
    with pytest.raises(error, match=word):
        call(**words | {name: value})
