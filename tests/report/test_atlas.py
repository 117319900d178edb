"""Tests of the methods' stability for many kinds of tops.

No assertion depends on run times.
"""

import re
from dataclasses import replace
from functools import cache
from itertools import pairwise
from math import pi

import kreisel as kr
import numpy as np
import pytest

from validation.competitors import single_runs
from validation.drawing.heatmap import draw_heatmap
from validation.parts import (
    atlas,
    atlas_cases,
    atlas_cells,
    omissions,
    published,
    random_tops,
    verdicts,
)
from validation.references.problems import attitude_error, problem_of_scene

CASES = {f"{case.family}: {case.name}": case for case in atlas_cases.list_cases()}


@cache
def examine_case(name, *methods):
    """Return the results of a test case for the named methods, or for all if none are named."""

    def list_chosen(scene, radians):
        candidates = atlas_cells.list_candidates(scene, radians)
        return [candidate for candidate in candidates if not methods or candidate.name in methods]

    return {cell["method"]: cell for cell in atlas_cells.make_cells(CASES[name], list_chosen)}


def test_families_have_cases_with_unique_names():
    assert {case.family for case in CASES.values()} == set(atlas_cases.FAMILIES)
    assert len(CASES) == len(list(atlas_cases.list_cases())) > 80


@pytest.mark.parametrize(
    "name",
    [
        "spin: Lagrange, spin 1e6",
        "sleeping: at critical spin",
        "SI: planet",
        "SI: nanoparticle, 1e9 rad/s",
    ],
)
def test_no_cell_is_wrong_in_silence(name):
    cells = examine_case(name)
    methods = {method for method in kr.methods if kr.methods[method].suits(CASES[name].scene())}
    assert methods | {"heyoka"} <= set(cells) <= methods | set(single_runs.RECORDERS)
    for method, cell in cells.items():
        assert cell["verdict"] in ("right", "within tolerance", "degraded", "lost"), (
            f"{method}: {cell}"
        )
        assert cell["agreement"] < cell["conditioning"], "the references are not accurate enough"
    assert max(cells[method]["attitude_error"] for method in ("strang", "extrap", "rk4")) < 0.01


@pytest.mark.parametrize("name", [name for name in CASES if name.startswith("damping")])
def test_taylor_is_right_under_strong_damping(name):
    cells = examine_case(name, "taylor")
    assert cells["taylor"]["verdict"] in ("right", "within tolerance")
    assert cells["taylor"]["steps"] < 1000
    assert cells["taylor"]["agreement"] < cells["taylor"]["conditioning"]


def test_invalid_bodies_are_refused_with_their_message():
    for cell in examine_case("shape: no body, I3 > I1 + I2").values():
        assert cell["verdict"] == "refused" and "not physical" in cell["message"]


def test_every_method_refuses_times_at_which_the_attitude_cannot_be_resolved():
    for cell in examine_case("long: Lagrange, 2^54 rad").values():
        assert cell["verdict"] == "refused" and re.search("turns|count", cell["message"]), cell


def test_steps_far_too_large_blow_up_or_lose_the_attitude():
    cells = examine_case("steps: Lagrange, 0.25 a turn", "rk4", "strang", "extrap")
    assert cells["rk4"]["verdict"] == "stopped" and cells["rk4"]["mark"] == verdicts.BLOW_UP
    assert cells["strang"]["verdict"] == "lost", "but its energy stays"
    assert cells["extrap"]["verdict"] == "degraded", "it may choose a smaller first step"


def test_exact_drifts_keep_the_attitude_of_a_stiff_top():
    cells = examine_case("stiff: needle, 64 a turn of precession", "rk4", "strang")
    assert cells["strang"]["attitude_error"] < 0.01
    assert cells["rk4"]["verdict"] == "stopped"


def test_a_run_that_turns_too_fast_for_its_steps_is_detected():
    """Check the verdict on a run in which a needle turns by many radians per step."""
    (cell,) = examine_case("shape: needle, I3/I1 = 1e-8", "implicit_midpoint").values()
    assert cell["verdict"] == "lost" and cell["fastest"] * cell["step"] > 100


@pytest.mark.parametrize(
    "error, estimate, per_turn, expected",
    [
        (1e-13, 0.0, 64, "right"),
        (1e-3, 4e-4, 64, "degraded"),
        (1.0, 0.4, 64, "lost"),
        (3.0, 0.15, 64, "lost"),  # if two runs differ so much, neither can be trusted
        (3.0, 0.05, 64, "silent"),
        (1e-3, 1e-4, 64, "silent"),
        (1.0, 1e-9, 64, "silent"),
        (1.0, 1e-9, 8, "silent"),  # too large a step would cause a larger difference
        (1e-3, 1e-4, 8, "degraded"),
        (1.0, 1e-9, 2, "lost"),  # two steps per turn are too few, as a user knows beforehand
        (5e-12, 1e-12, 64, "degraded"),  # accumulated rounding errors
        (5e-12, 0.0, 64, "silent"),  # rounding errors would differ between both runs
        (float("nan"), 0.0, 2, "silent"),
    ],
)
def test_verdicts(error, estimate, per_turn, expected):
    sign = verdicts.find_sign(error, estimate, per_turn, (1e-12, 1e-11, 0.0))
    assert verdicts.choose_verdict(error, 1e-12, sign) == expected


def test_attitudes_below_the_conditioning_are_lost_not_right():
    """Check the verdict if rounding errors alone determine the computed attitude."""
    sign = verdicts.find_sign(1.0, 0.0, 64, (10.0, 100.0, 0.0))
    assert sign == "rounding" and verdicts.choose_verdict(1.0, 10.0, sign) == "lost"


def test_errors_within_the_tolerance_are_explained():
    for error, expected in ((9e-9, "tolerance"), (2e-8, None)):
        assert verdicts.find_sign(error, 0.0, np.inf, (1e-12, 1e-11, 1e-8)) == expected


def test_errors_within_the_requested_tolerance_are_as_asked():
    for error, tol, expected in (
        (1e-10, 1e-9, "within tolerance"),
        (1e-9, 1e-9, "within tolerance"),
        (1e-13, 1e-9, "right"),
        (2e-9, 1e-9, "degraded"),
        (1e-10, None, "degraded"),
        (0.5, 1.0, "lost"),
    ):
        assert verdicts.choose_verdict(error, 1e-12, "second run", tol) == expected, (error, tol)


def test_taylor_is_not_called_degraded_for_meeting_its_tolerance():
    (cell,) = examine_case("gravity: general, g = -1", "taylor").values()
    assert cell["rounding"] < cell["attitude_error"] <= cell["tol"]
    assert cell["verdict"] == "within tolerance" and not cell["shown_by"] and not cell["mark"]
    assert atlas.make_square(cell).text.endswith("=")
    assert "taylor is right or within tolerance most often (1 cells)" in atlas.conclude(
        atlas.Atlas([cell], [])
    )


def test_the_second_run_estimates_the_error():
    """Check the error estimate for errors that are exactly of order h^p."""
    for order in (1, 2, 4, 8):
        assert verdicts.estimate_error(1e-3 * (1 - 2.0**-order), order) == pytest.approx(
            1e-3, rel=1e-12
        )
    assert verdicts.has_order_reduction(
        4, 1e-3, 1e-3 / 4, 1e-15
    ) and not verdicts.has_order_reduction(4, 1e-3, 1e-3 / 16, 1e-15)
    assert not verdicts.has_order_reduction(4, 1e-14, 1e-14, 1e-14), (
        "at rounding no order is to be seen"
    )


FAULTY = ("gravity: Lagrange, g = -1", "gravity: general, g = -1", "shape: disc, I3 = 2 I1")


def make_faulty_candidates(fault):
    """Return a function that lists all methods, each with an artificial fault."""

    def list_faulty_candidates(scene, radians):
        return [
            replace(candidate, run=lambda *args, candidate=candidate: fault(candidate, *args))
            for candidate in atlas_cells.list_candidates(scene, radians)
            if candidate.name in kr.methods
        ]

    return list_faulty_candidates


def increase_gravity(candidate, problem, scene, times, setting):
    return candidate.run(problem, scene.replace(gravity=scene.gravity * 1.3), times, setting)


def shorten_times(candidate, problem, scene, times, setting):
    return candidate.run(problem, scene, [t * (1 - 0.02 * (t > 0)) for t in times], setting)


def mirror(candidate, problem, scene, times, setting):
    q, m, *counts = candidate.run(problem, scene, times, setting)
    q = np.array(q)
    q[1:, 3] *= -1
    return q, m, *counts


def twist(candidate, problem, scene, times, setting):
    """Rotate the body by 0.2 rad about its axis T. The energy of symmetric tops does not change."""
    q, m, *counts = candidate.run(problem, scene, times, setting)
    jump = (np.cos(0.1), 0.0, 0.0, np.sin(0.1))
    return np.array([*q[:1], *(kr.quaternion.multiply(p, jump) for p in q[1:])]), m, *counts


def turn_heading(candidate, problem, scene, times, setting):
    """Rotate body and momentum by 0.2 rad about the vertical, which changes no integral."""
    q, m, *counts = candidate.run(problem, scene, times, setting)
    jump = (np.cos(0.1), 0.0, 0.0, np.sin(0.1))
    q = np.array([*q[:1], *(kr.quaternion.multiply(jump, p) for p in q[1:])])
    m = np.array([*m[:1], *(kr.quaternion.turn(jump, p) for p in m[1:])])
    return q, m, *counts


@pytest.mark.parametrize("name", FAULTY)
@pytest.mark.parametrize("fault", [increase_gravity, shorten_times, mirror, twist, turn_heading])
def test_gross_faults_are_wrong_in_silence_in_every_method(fault, name):
    """Check that large artificial errors are never mistaken for correct results."""
    sound = examine_case(name)
    for cell in atlas_cells.make_cells(CASES[name], make_faulty_candidates(fault)):
        method = cell["method"]
        if "attitude_error" not in cell or sound[method].get("attitude_error", 1.0) > 5e-3:
            continue
        assert cell["verdict"] == "silent" and cell["mark"] == verdicts.ALARM, f"{method}: {cell}"


@pytest.mark.parametrize(
    "method", ["exact", "taylor", "kahan_li8", "extrap", "suzuki4", "takahashi_imada4"]
)
def test_small_faults_are_found_where_the_method_is_exact_enough(method):
    """Check that an error of 0.1 % in gravity is classified as an error that users cannot notice.

    Only methods whose errors are much smaller than the effect of the changed gravity are tested.
    """

    def increase_gravity_slightly(candidate, problem, scene, times, setting):
        return candidate.run(problem, scene.replace(gravity=scene.gravity * 1.001), times, setting)

    has_fault = {
        cell["method"]: cell
        for cell in atlas_cells.make_cells(
            CASES[FAULTY[0]], make_faulty_candidates(increase_gravity_slightly)
        )
    }
    assert has_fault[method]["verdict"] == "silent"


def test_a_missing_kick_is_found():
    """Check that the omission of gravity for 0.05 units of time, or for one step, is detected."""
    case, method = CASES[FAULTY[0]], atlas_cells.make_method_candidate(kr.methods["suzuki4"])

    def omit_gravity(seconds):
        def run(candidate, problem, scene, times, setting):
            middle, gap = times[len(times) // 2], seconds or setting["step"]
            first_path = kr.solve(scene, middle, candidate.name, **setting)
            second_path = kr.solve(
                scene.replace(momentum=first_path.m[-1], attitude=first_path.q[-1], gravity=0.0),
                gap,
                candidate.name,
                **setting,
            )
            rest = scene.replace(momentum=second_path.m[-1], attitude=second_path.q[-1])
            q, m, *counts = candidate.run(problem, rest, [0.0, times[-1] - middle - gap], setting)
            first = candidate.run(problem, scene, times[:1], setting)
            return np.array([first[0][0], q[-1]]), np.array([first[1][0], m[-1]]), *counts

        return lambda scene, radians: [replace(method, run=lambda *args: run(method, *args))]

    (fixed,), (scaled,) = (
        atlas_cells.make_cells(case, omit_gravity(seconds)) for seconds in (0.05, None)
    )
    assert fixed["verdict"] == "silent"
    assert scaled["verdict"] != "right" and scaled["mark"] == verdicts.REDUCED, (
        "an error of order 1 in a method of order 4"
    )


def test_wrong_orders_and_ignored_tolerances_are_detected():
    case, ours = CASES["gravity: general, g = -1"], atlas_cells.make_method_candidate
    four = replace(ours(kr.methods["strang"]), order=4)
    loose = ours(kr.methods["taylor"])

    def replace_tolerance(factor, power):
        def run(problem, scene, times, setting):
            return loose.run(
                problem, scene, times, setting | {"tol": factor * setting["tol"] ** power}
            )

        return replace(loose, run=run)

    cells = atlas_cells.make_cells(
        case, lambda scene, radians: [four, replace_tolerance(1e7, 1), replace_tolerance(1e-4, 0)]
    )
    assert [cell["mark"] for cell in cells] == [verdicts.REDUCED, verdicts.BEYOND, verdicts.ALARM]


def test_the_midpoint_rule_changes_the_axial_momentum_by_a_formula():
    """Compare the change of the axial momentum per step with the formula in stiff_needle.py.

    Agreement with the formula shows that the energy drift is a property of the method and not a
    bug.
    """
    case = CASES["stiff: needle, 64 a turn of precession"]
    scene, step = case.scene(), 2 * pi / case.rate / case.steps
    path = kr.solve(scene, step * np.arange(20), "implicit_midpoint", step=step)
    momenta = pairwise(path.axial_momentum)
    for (p, q), (before, after) in zip(pairwise(path.q), momenta, strict=True):
        w, *vector = kr.quaternion.multiply(
            kr.quaternion.conjugate(p), q
        )  # r^2 of r = (1, y) / |(1, y)|, y = h V / 4
        size = ((1 - w) / (1 + w)) ** 0.5
        y = np.array(vector) * (1 + size**2) / 2
        middle = kr.quaternion.multiply(p, np.array([1.0, *y]) / (1 + size**2) ** 0.5)
        axis, v = kr.quaternion.turn(middle, (0.0, 0.0, 1.0)), y / size
        torque = kr.quaternion.turn_back(middle, np.cross((0.0, 0.0, 1.0), axis))
        change = step * (1 - np.cos(2 * np.arctan(size))) * v[2] * (torque @ v)
        assert abs(change) > 1e-7 and after - before == pytest.approx(change, rel=1e-5), (
            "far above rounding, and by the formula"
        )


def test_drift_is_distinguished_from_oscillation():
    t = np.linspace(0, 20, 17)
    assert (
        atlas_cells.has_drift(1e-4 * t)
        and not atlas_cells.has_drift(1e-4 * (1 - np.cos(1.7 * t)))
        and not atlas_cells.has_drift(1e-9 * t)
    )


def test_the_atlas_has_a_heat_map_notes_and_a_conclusion():
    cells = atlas_cells.make_cells(CASES["shape: rod, I3 = 0"]) + atlas_cells.make_cells(
        CASES["shape: sphere"]
    )
    squares = list(map(atlas.make_square, cells))
    assert draw_heatmap(squares, atlas.column_names(cells)).startswith("<svg")
    (note,) = atlas.collect_notes(cells)
    (group,) = note["whom"]
    assert (
        group["methods"] == ", ".join(kr.methods)
        and note["verdict"] == "refused"
        and "0.0 is not positive" in note["message"]
    )
    assert sum(sum(line["counts"]) for line in atlas.count_verdicts(cells)) == len(cells)
    assert len(atlas.write_table(cells).splitlines()) == 1 + len(cells)


@pytest.mark.parametrize("kind", random_tops.KINDS)
def test_random_tops_are_of_their_kind_and_reproducible(kind):
    first, again = random_tops.draw_problems(kind, 3), random_tops.draw_problems(kind, 3)
    assert [top.momentum for top in first] == [top.momentum for top in again]
    kinds = {top.user.body.kind for top in first}
    assert kinds <= {
        "Lagrange": {"lagrange"},
        "Kowalewski": {"kowalewski"},
        "Euler": {"euler"},
    }.get(kind, {"general"})


def test_random_tops_are_run_by_every_suitable_method():
    runs = random_tops.measure_kind("Euler", 2)
    names = [
        name
        for name, method in kr.methods.items()
        if method.suits(random_tops.draw_problems("Euler", 1)[0].user)
    ]
    assert [run["method"] for run in runs] == [name for name in names for _ in range(2)]
    worst = {line["method"]: line["worst"] for line in random_tops.summarize_methods(runs, "Euler")}
    assert worst["exact"] < 1e-13 and all(0 <= error <= pi for error in worst.values())


@pytest.mark.parametrize("problem", published.load_problems(), ids=lambda problem: problem.name)
def test_published_references_are_reproduced(problem):
    """Compare attitudes and energies with the published reference solutions."""
    path = kr.solve(problem.scene, problem.end, method="extrap", tol=1e-13)
    assert attitude_error(path.q[-1], problem.reference["q"]) < 1e-9
    candidate = next(
        candidate
        for candidate in single_runs.list_contenders(problem_of_scene("it", problem.scene))
        if candidate.name == "extrap"
    )
    row = published.measure_run(
        problem, problem_of_scene("it", problem.scene), candidate, single_runs.Setting(tol=1e-12)
    )
    assert row["attitude_error"] < 1e-7 and row["energy_error"] < 1e-8 and "failure" not in row


def test_the_symmetric_form_is_the_same_top():
    problem = omissions.load_problem("thesis")
    ends = [
        kr.solve(scene, 2 * pi, method="extrap", tol=1e-12).q[-1]
        for scene in omissions.scene_forms(problem).values()
    ]
    assert attitude_error(ends[0], ends[1]) < 1e-7
