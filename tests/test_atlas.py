"""The stability atlas, the random and the published tops. Nothing here asserts a time."""

import sys
from math import pi
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))     # validation is a package of the source tree
pytest.importorskip("heyoka")

import kreisel as kr                                                        # noqa: E402
from validation import atlas, atlas_cases, contenders, ensemble, heatmap, left_out, page, published      # noqa: E402
from validation.scenes import attitude_error, described                     # noqa: E402

CASES = {f"{case.family}: {case.name}": case for case in atlas_cases.cases()}


def cells(name):
    return {cell["method"]: cell for cell in atlas.examine(CASES[name])}


def test_every_family_has_cases_and_no_two_share_a_name():
    assert {case.family for case in CASES.values()} == set(atlas_cases.FAMILIES)
    assert len(CASES) == len(list(atlas_cases.cases())) > 80


@pytest.mark.parametrize("name", ["spin: Lagrange, spin 1e6", "sleeping: at critical spin", "SI: planet",
                                  "SI: nanoparticle, 1e9 rad/s"])
def test_nothing_is_wrong_in_silence(name):
    found = cells(name)
    assert set(found) == {method for method in kr.methods if kr.methods[method].suits(CASES[name].scene())}
    for method, cell in found.items():
        assert cell["verdict"] in ("right", "degraded", "lost"), f"{method}: {cell}"
        assert cell["agreement"] < cell["conditioning"], "the truth is truer than the data"
    assert max(found[method]["attitude_error"] for method in ("strang", "extrap", "rk4")) < 0.01


def test_what_is_no_body_is_refused_with_its_message():
    for cell in cells("shape: no body, I3 > I1 + I2").values():
        assert cell["verdict"] == "refused" and "not physical" in cell["message"]


def test_steps_far_too_large_blow_up_or_lose_the_attitude():
    found = cells("steps: Lagrange, 0.25 a turn")
    assert found["rk4"]["verdict"] == "stopped" and found["rk4"]["mark"] == atlas.BLOW_UP
    assert found["strang"]["verdict"] == "lost", "but its energy stays"
    assert found["extrap"]["verdict"] == "degraded", "it may choose a smaller first step"


def test_a_stiff_top_keeps_its_attitude_under_exact_drift():
    found = cells("stiff: needle, 64 a turn of precession")
    assert found["strang"]["attitude_error"] < 0.01
    assert found["rk4"]["verdict"] == "stopped"


CASE = atlas_cases.Case("family", "name", None)


@pytest.mark.parametrize("error, second, tolerated, steered, expected", [
    (1e-13, 1e-13, 1e-12, "step", "right"),
    (1e-3, 9e-4, 1e-12, "step", "degraded"),
    (1.0, 0.9, 1e-12, "step", "lost"),
    (1e-3, 1e-9, 1e-12, "step", "silent"),
    (1e-3, 1e-9, 1e-4, "step", "degraded"),     # its energy error says as much
    (1e-3, 9e-4, 1e-6, "tol", "silent"),        # a tolerance is to be trusted without a second run
    (1e-5, 9e-6, 1e-6, "tol", "degraded"),
    (1e-3, 0.0, 1e-12, "", "silent"),           # a closed form has nothing to blame
])
def test_verdicts(error, second, tolerated, steered, expected):
    cell = {"attitude_error": error, "second_run": second}
    assert atlas.verdict(CASE, steered, cell, 1e-12, tolerated) == expected


def test_a_step_that_does_not_resolve_the_motion_is_lost_not_silent():
    coarse = atlas_cases.Case("family", "name", None, steps=2)
    assert atlas.verdict(coarse, "step", {"attitude_error": 1.0, "second_run": 0.0}, 1e-12, 1e-12) == "lost"


def test_drift_is_not_oscillation():
    t = np.linspace(0, 20, 17)
    assert atlas.drifts(1e-4 * t) and not atlas.drifts(1e-4 * (1 - np.cos(1.7 * t))) and not atlas.drifts(1e-9 * t)


def test_the_atlas_is_drawn_and_told(tmp_path):
    found = atlas.examine(CASES["shape: rod, I3 = 0"]) + atlas.examine(CASES["shape: sphere"])
    assert heatmap.family(found, list(kr.methods)).startswith("<svg")
    (note,) = page.notes(found)
    assert note["methods"] == ", ".join(kr.methods) and note["verdict"] == "refused"
    assert sum(sum(line["counts"]) for line in page.verdicts(found)) == len(found)
    atlas.write_csv(tmp_path / "stability.csv", found)
    assert len((tmp_path / "stability.csv").read_text().splitlines()) == 1 + len(found)


@pytest.mark.parametrize("kind", ensemble.KINDS)
def test_random_tops_are_of_their_kind_and_the_same_each_time(kind):
    first, again = ensemble.tops(kind, 3), ensemble.tops(kind, 3)
    assert [top.momentum for top in first] == [top.momentum for top in again]
    kinds = {top.user.body.kind for top in first}
    assert kinds <= {"Lagrange": {"lagrange"}, "Kowalewski": {"kowalewski"}, "Euler": {"euler"}}.get(kind, {"general"})


def test_random_tops_are_run_by_every_method_that_suits_them():
    found = ensemble.examine("Euler", 2)
    suited = [name for name, method in kr.methods.items() if method.suits(ensemble.tops("Euler", 1)[0].user)]
    assert [run["method"] for run in found] == 2 * suited
    worst = {line["method"]: line["worst"] for line in ensemble.summary(found)}
    assert worst["exact"] < 1e-13 and all(0 <= error <= pi for error in worst.values())


@pytest.mark.parametrize("problem", published.problems(), ids=lambda problem: problem.name)
def test_published_references_are_met(problem):
    """To their 17 digits: scene and reference say the same."""
    path = kr.solve(problem.scene, problem.end, method="extrap", tol=1e-13)
    assert attitude_error(path.q[-1], problem.reference["q"]) < 1e-9
    who = next(who for who in contenders.ours(described("it", problem.scene)) if who.name == "extrap")
    row = published.run(problem, described("it", problem.scene), who, contenders.Setting(tol=1e-12))
    assert row["attitude_error"] < 1e-7 and row["energy_error"] < 1e-8 and "failure" not in row


def test_the_symmetric_form_is_the_same_top():
    problem = left_out.load("thesis")
    ends = [kr.solve(scene, 2 * pi, method="extrap", tol=1e-12).q[-1] for scene in left_out.forms(problem).values()]
    assert attitude_error(ends[0], ends[1]) < 1e-7
