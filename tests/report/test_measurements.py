"""Tests of how the report stores measurements, selects the fastest run and compares programs."""

import os
from dataclasses import replace
from math import isnan

import kreisel as kr
import mpmath as mp
import numpy as np
import pytest

from validation.competitors import ensemble_runs, equal_error, timing
from validation.competitors.equal_error import Run
from validation.competitors.method_families import group_methods
from validation.competitors.single_runs import EPS, HeyokaRun, Setting
from validation.parts import advice, calls, fastest, scene_runs, workprecision
from validation.parts.result_cache import ResultStore, write_atomic
from validation.parts.tasks import TYPICAL, Task, estimate_minutes, run_tasks
from validation.references import random_ensembles, reference
from validation.references.problems import attitude_error, attitude_errors, load_problem

KINDS = list(random_ensembles.SCENES)


def row(error, energy, seconds):
    values = {"tol": error, "attitude_error": error, "energy_error": energy, "samples": [seconds]}
    return scene_runs.Measurement("thesis", 1.0, "m", False, **values)


def test_accidentally_small_errors_do_not_win():
    lucky, honest, finer = row(1e-13, 1e-13, 1), row(5e-7, 1e-8, 2), row(1e-8, 1e-9, 3)
    closed_form, drifting = replace(honest, tol=None), row(1e-13, 1e-5, 1)
    for rows, target, best in (
        ([lucky, honest, finer], 1e-6, lucky),
        ([lucky, honest, finer], 1e-9, None),  # the next tighter run is worse
        ([drifting, honest, finer], 1e-6, honest),  # the energy disagrees
        ([honest], 1e-6, None),  # nothing tighter bears it out
        ([closed_form], 1e-6, closed_form),
    ):
        assert fastest.fastest_reaching(rows, target) is best


def test_findings_are_stored_and_not_recomputed(tmp_path):
    calls, file = [], tmp_path / "findings.jsonl"

    def make(i):
        if i == 2 and len(calls) < 3:
            calls.append("interrupted")
            raise KeyboardInterrupt
        calls.append(i)
        return i

    class Bar:
        add_task = update = advance = staticmethod(lambda *args, **words: None)

    tasks = [Task(f"task/{i}", lambda i=i: make(i)) for i in range(4)]
    with pytest.raises(KeyboardInterrupt):
        run_tasks(tasks, ResultStore(file, ["as before"]), Bar)
    run_tasks(tasks, ResultStore(file, ["as before"]), Bar)
    assert calls == [0, 1, "interrupted", 2, 3]
    file.write_text(file.read_text() + '["cu')
    ResultStore(file, ["as before"]).put("after a truncated line", 4)
    assert list(ResultStore(file, ["as before"]).known.values()) == [0, 1, 2, 3, 4]
    assert ResultStore(file, ["another machine"]).known == {}


def test_the_time_said_beforehand_is_that_of_the_remaining_tasks(tmp_path, monkeypatch):
    store = ResultStore(tmp_path / "findings.jsonl", [])
    tasks = [Task(f"task/{i}", lambda: 1, 90.0) for i in range(4)]
    for slowness, minutes in ((1.0, 6), (3.0, 18)):
        monkeypatch.setattr(timing, "time_once", lambda call, slowness=slowness: TYPICAL * slowness)
        assert estimate_minutes(tasks, store) == minutes
    store.put("task/0", 1)
    store.put("task/1", 1)
    assert estimate_minutes(tasks, store) == 9


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_files_are_written_atomically(tmp_path, monkeypatch, call):
    file = tmp_path / "index.html"
    write_atomic(file, "old")

    def full(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(os, call, full)
        with pytest.raises(OSError, match="No space"):
            write_atomic(file, "new")
    assert file.read_text() == "old" and os.listdir(tmp_path) == ["index.html"]


def test_every_method_is_in_one_family_or_a_peer():
    families = group_methods().values()
    peers = next(iter(families))[1]
    places = [name for own, _ in families for name in own]
    assert sorted(places + [name for name in peers if name in kr.methods]) == sorted(kr.methods)


def make_row(scene, method, seconds, step=None):
    values = {"attitude_error": 1e-13, "energy_error": 1e-13, "samples": [seconds], "step": step}
    return scene_runs.Measurement(scene, 1.0, method, method == "heyoka", **values)


def test_the_advice_names_the_winner_of_each_group_with_its_ratios():
    scenes = {"thesis": ("exact", 1e-6), "asymmetric": ("taylor", 1e-5)}
    rows = []
    for scene, (method, seconds) in scenes.items():
        rows += [make_row(scene, method, seconds), make_row(scene, "heyoka", 8 * seconds)]
        rows += [make_row(scene, "strang", 1e-3, step) for step in (0.2, 0.1)]
    late = {"asymmetric": {"t": 1e6, "exact": 1e-3, "taylor": 0.5, "heyoka": 2.0}}
    problems = [(load_problem(scene), 1.0) for scene in scenes]
    lead = advice.build_lead(workprecision.Comparison(problems, {}, rows, late))
    assert [group["method"] for group in lead["groups"]] == ["exact", "taylor"]
    for group in lead["groups"]:
        assert group["ratios"] == pytest.approx([8.0] * 4) and group["rivals"] == ["heyoka"]
    assert lead["late"]["ratios"] == [2000.0] and lead["late"]["kinds"] == "asymmetric tops"
    assert lead["fixed"] == [("strang", ["1e-3", "1e-6", "1e-9", "1e-12"], True)]


def runs(errors, seconds):
    return [
        Run("it", str(i), 1, error, error, error, times)
        for i, (error, times) in enumerate(zip(errors, seconds, strict=True))
    ]


STRAIGHT = runs([1e-2, 1e-6, 1e-10], [[1.0, 10.0], [2.0, 20.0], [4.0, 40.0]])
LUCKY = runs([1e-7, 1e-6, 1e-10, 1e-10], [[1.0], [2.0], [4.0], [9.0]])


@pytest.mark.parametrize(
    ("target", "own", "seconds"),
    [
        (1e-6, STRAIGHT, [2.0, 20.0]),
        (1e-4, STRAIGHT, [2**0.5, 10 * 2**0.5]),
        (1.0, STRAIGHT, [1.0, 10.0]),
        (0.9e-10, STRAIGHT, [np.nan, np.nan]),
        (1e-7, LUCKY, [4**0.25]),  # 1e-6 is its error
        (1e-10, LUCKY, [4.0]),
    ],
)
def test_times_are_interpolated_between_settings(target, own, seconds):
    assert equal_error.seconds_at(target, own) == pytest.approx(seconds, nan_ok=True)


def test_ratios_are_medians_of_rounds_at_an_error_that_both_reach():
    other = runs([1e-6], [[6.0, 40.0]])
    assert equal_error.time_ratio(other, STRAIGHT, 1e-6) == pytest.approx((2.5, 23.0, 11.0))
    assert isnan(equal_error.time_ratio(other, STRAIGHT, 1e-9)[0])
    uneven = runs([1e-3, 4e-10, 6e-10], [[1.0] * 2, [2.0] * 2, [3.0] * 2])
    target = equal_error.tightest_common_error(STRAIGHT, uneven)
    assert target == pytest.approx(equal_error.NEAR * 6e-10)
    assert not isnan(equal_error.time_ratio(uneven, STRAIGHT, target)[0])


@pytest.mark.parametrize("kind", KINDS)
def test_every_program_returns_the_tops_of_an_ensemble_in_order(kind):
    tops = random_ensembles.draw_tops(kind, 11, end=10.0)
    assert np.array_equal(tops.momenta[:3], random_ensembles.draw_tops(kind, 3).momenta)
    true = random_ensembles.compute_truths(tops)
    problem = replace(tops.problem, momentum=tuple(tops.momenta[1]))
    (state,) = reference.integrate_states(problem, [tops.end])
    assert attitude_error(true[1], [mp.nstr(x, 25) for x in state[:4]]) < 1e-18
    for mover in ensemble_runs.select_movers(tops):
        setting = Setting(tol=1e-13) if mover.settings[0].tol else mover.settings[0]
        call = mover.make(tops.first(4) if mover.is_serial else tops, setting, 2)
        for q in (call(), call()):
            assert len(q) == (4 if mover.is_serial else 11)
            assert attitude_errors(q, true[: len(q)]).max() < 1e-10, mover.name


def test_all_timed_calls_compute_the_same_motion(monkeypatch):
    problem, end = load_problem("goryachev_chaplygin"), 10.0
    scene, peer = problem.to_scene(), HeyokaRun(problem, end, Setting(tol=EPS))
    other = HeyokaRun(replace(problem, momentum=(1.0, 2.0, 0.0)), end, Setting(tol=EPS))
    monkeypatch.setattr(calls, "LATEST", 15.0)  # a reused run begins anew at this time
    again = calls.make_reused_call(scene, end, 1e-15)
    attitudes = [
        calls.make_heyoka_call(peer)()[:4],
        other.restart(problem).solve(),
        calls.make_solve_call(scene, end, 1e-15)().q[-1],
        *(again().q[-1] for _ in range(3)),
    ]
    truth = reference.truth_of(problem, end)["attitude"]
    assert all(attitude_error(q, truth) < 1e-9 for q in attitudes)
