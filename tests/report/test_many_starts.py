"""Tests of the part of the report that compares many random initial states."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from validation.parts import advice, fastest, many_starts, scene_runs
from validation.parts.tasks import SIZES
from validation.references.problems import load_problem


@pytest.fixture(scope="module")
def findings():
    """Measure the run times for one scene with few repetitions."""
    return [many_starts.measure_scene(load_problem("thesis"), replace(SIZES["quick"], members=2))]


def test_every_program_runs_on_every_start(findings):
    (scene,) = findings
    places = {(run["program"], run["start"], run["tol"]) for run in scene["runs"]}
    programs = many_starts.list_programs()
    assert len(places) == len(programs) * many_starts.LEAST_STARTS * len(many_starts.QUICK)
    for run in scene["runs"]:
        assert run["seconds"] > 0 and run["attitude_error"] < (1.0 if run["tol"] > 1e-5 else 1e-4)
    tight = [run for run in scene["runs"] if run["tol"] == 1e-12]
    assert all(run["attitude_error"] < 1e-7 for run in tight), "one truth for all programs"


def test_a_start_keeps_the_character_of_the_motion():
    problem = load_problem("goryachev_chaplygin")
    start, other = many_starts.draw_starts(problem, 2)
    assert start.momentum[2] == other.momentum[2] == 0 and start.momentum != other.momentum
    assert abs(np.linalg.norm(start.attitude) - 1) < 1e-15
    fast = load_problem("fast")
    assert 0.8 < many_starts.draw_starts(fast, 1)[0].rate / fast.rate < 1.2


def test_a_measured_scene_has_runs_with_more_digits(findings):
    (scene,) = findings
    assert len(scene["precise"]) == scene["starts"] and max(scene["precise"]) < 1e-13


def test_a_quantile_is_infinite_if_too_many_starts_fail():
    times = [1.0, 2.0, 3.0, np.inf]
    assert many_starts.compute_quantile(times, 0.5) == 3.0
    assert many_starts.compute_quantile(times, 0.9) == np.inf


def make_row(scene, method, seconds, step=None):
    values = {"attitude_error": 1e-13, "energy_error": 1e-13, "samples": [seconds], "step": step}
    return scene_runs.Measurement(scene, 1.0, method, method == "heyoka", **values)


def test_the_advice_names_the_winner_of_each_group_with_its_ratios():
    """Check the recommended methods for two scenes whose fastest methods differ."""
    scenes = {"thesis": ("exact", 1e-6), "asymmetric": ("taylor", 1e-5)}
    rows = []
    for scene, (method, seconds) in scenes.items():
        rows += [make_row(scene, method, seconds), make_row(scene, "heyoka", 8 * seconds)]
        rows += [make_row(scene, "strang", 1e-3, step) for step in (0.2, 0.1)]
    problems = [(load_problem(scene), 1.0) for scene in scenes]
    late = {"thesis": None, "asymmetric": {"t": 1e6, "exact": 1e-3, "taylor": 0.5, "heyoka": 2.0}}
    comparison = SimpleNamespace(problems=problems, rows=rows, scenes=list(scenes), late=late)
    lead = advice.build_lead(comparison)
    n = len(fastest.TARGETS)
    first, second = lead["groups"]
    assert (first["kinds"], first["method"], first["times"]) == ("Symmetric tops", "exact", "0.001")
    assert (second["kinds"], second["method"]) == ("Asymmetric tops", "taylor")
    assert first["wins"] == second["cases"] == n and first["ratios"] == "8"
    assert first["rivals"] == "heyoka" and not first["unreached"]
    assert (lead["late"]["exact"], lead["late"]["ratios"]) == ("1.00", "4")
    assert (lead["late"]["t"], lead["late"]["scenes"]) == ("1e6", "asymmetric")
    (fixed,) = lead["fixed"]
    assert fixed["method"] == "strang" and fixed["symplectic"]
    assert fixed["targets"] == "1e-3, 1e-6, 1e-9 and 1e-12"
