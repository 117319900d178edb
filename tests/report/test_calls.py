"""Tests of the report's comparison of computing times at equal error."""

from math import inf

import kreisel as kr
import numpy as np
import pytest

from validation.competitors import peak
from validation.competitors.single_runs import EPS, HeyokaRun, Setting, series_order
from validation.parts import calls
from validation.references.problems import attitude_error, load_problem
from validation.report import page

NAME = "goryachev_chaplygin"


@pytest.fixture(scope="module")
def findings():
    """Measure the run times for one scene with few repetitions."""
    return [calls.measure_scene(NAME, 2, (1e-6, 0.0), quick=True)]


def test_all_programs_are_timed_at_each_error(findings):
    (scene,) = findings
    first, last = scene["bands"]
    assert first["error"] == 1e-6 and not first["tightest"]
    assert last["tightest"] and 0 < last["error"] < 1e-10
    for band in scene["bands"]:
        assert set(band["seconds"]) == {calls.HEYOKA, calls.SOLVE, calls.RUN}
        for seconds in band["seconds"].values():
            assert len(seconds) == 2 and min(seconds) > 0
        assert band["compiling"] > 0
    assert first["function"] > 0, "DOP853 reaches 1e-6"


def test_all_calls_compute_the_same_motion():
    problem, end = load_problem(NAME), calls.ENDS[NAME]
    scene = problem.to_scene()
    peer = HeyokaRun(problem, end, Setting(tol=EPS))
    again = calls.make_reused_call(scene, end, 1e-15)
    attitudes = [
        calls.make_heyoka_call(peer)()[:4],
        calls.make_solve_call(scene, end, 1e-15)().q[-1],
        *(again().q[-1] for _ in range(2)),
        calls.FunctionRun(problem, end, 1e-13).solve(),
    ]
    truth = peer.solve()
    assert all(attitude_error(q, truth) < 1e-9 for q in attitudes)


def test_a_reused_run_restarts_before_its_time_loses_digits(monkeypatch):
    monkeypatch.setattr(calls, "LATEST", 2.5)
    call = calls.make_reused_call(load_problem(NAME).to_scene(), 1.0, 1e-12)
    assert [float(call().t[-1]) for _ in range(5)] == [1.0, 2.0, 3.0, 1.0, 2.0]


def test_each_order_of_heyoka_has_one_tolerance():
    runs = calls.list_heyoka_runs(load_problem(NAME), 1.0, list(calls.ORDERS)[:2])
    tolerances = [run.top.tol for run in runs]
    assert (
        [run.top.order for run in runs[:-1]]
        == [4, 5]
        == [series_order(tol) for tol in tolerances[:-1]]
    )
    assert tolerances[-1] == EPS and series_order(EPS) == calls.ORDERS[-1] + 1


def test_times_are_interpolated_between_adjacent_settings():
    """Check the interpolation of run times that are proportional to a power of the error."""
    ladder = [(k, error) for k, error in enumerate((1e-2, 1e-5, 1e-5, 1e-8, 1e-8, 1e-11))]

    def time_at(target):
        bracket = calls.select_bracket(ladder, target)
        (seconds,) = calls.interpolate(bracket, [[error**-0.25] for _, error in bracket], target)
        return [k for k, _ in bracket], seconds

    steps, seconds = time_at(1e-6)
    assert steps == [1, 3] and seconds == pytest.approx(1e-6**-0.25, rel=1e-12)
    assert time_at(1e-1) == ([0], 1e-2**-0.25), "the loosest setting is the fastest"
    steps, seconds = time_at(1e-12)
    assert steps == [3, 5] and np.isnan(seconds), "not reached"


def make_band(own, peer, compiling=1.0, function=2e-3):
    seconds = {calls.SOLVE: own, calls.RUN: [t / 2 for t in own], calls.HEYOKA: peer}
    values = {"error": 1e-9, "tightest": False, "seconds": seconds}
    return values | {"compiling": compiling, "function": function, "operations": 1e4}


def make_findings(*bands, peak=4e9):
    header = {"scene": "s", "end": 5.0, "rounds": 3, "processor": "Abacus, 2 cores", "peak": peak}
    return [header | {"bands": bands}]


def test_ratios_and_break_even_runs_are_computed():
    faster, slower = make_band([1e-5, 2e-5, 4e-5], [3e-5] * 3), make_band([3e-5] * 3, [1e-5] * 3)
    assert calls.compare(faster, calls.SOLVE) == pytest.approx((1.5, 3.0))
    assert calls.compare(faster, calls.RUN) == pytest.approx((3.0, 6.0))
    assert calls.count_paying_runs(faster) == inf
    assert calls.count_paying_runs(slower) == pytest.approx(1 / 2e-5)


def test_a_run_stays_below_the_peak_of_a_core(findings):
    (scene,) = findings
    for band in scene["bands"]:
        assert band["operations"] > 0
        assert 0.0 < calls.compute_share(scene, band) < 1.0


def test_the_operations_of_a_series_are_counted():
    """Compare the operation count with an explicit count of the products in one Taylor step."""
    scene = kr.scenes.goryachev_chaplygin
    path = kr.solve(scene, [0.01], "taylor", tol=1e-3)
    assert path.stats.steps == 1
    terms = [(j, n - j) for n in range(path.plan.order) for j in range(n + 1)]
    vectors = 4 * 3 + 2 * 3 + 3  # q W, P x W and the products of two components of W
    assert peak.count_operations(path) == 2 * vectors * len(terms)


def test_without_a_compiler_there_is_no_share(monkeypatch):
    monkeypatch.setattr(peak.shutil, "which", lambda name: None)
    assert peak.measure_peak.__wrapped__() is None
    band = make_band([1e-5] * 3, [3e-5] * 3)
    section = page.render_section(calls.PART, make_findings(band, peak=None), {"versions": ""})
    assert "billion operations" not in section["body"]


def test_every_time_is_a_row_of_the_table(findings):
    text = dict(calls.PART.list_files(findings, {}))["calls.csv"]
    assert text.splitlines()[0] == ",".join(calls.COLUMNS)
    assert len(text.splitlines()) == 1 + sum(
        3 + (band["function"] is not None) for band in findings[0]["bands"]
    )
