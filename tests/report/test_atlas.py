"""Tests of the stability atlas: every cell is judged, and silent errors are found."""

from dataclasses import replace
from functools import cache

import kreisel as kr
import numpy as np
import pytest

from validation.competitors import single_runs
from validation.parts import atlas, atlas_cases, atlas_cells, verdicts

CASES = {f"{case.family}: {case.name}": case for case in atlas_cases.list_cases()}


@cache
def examine_case(name, *methods):
    """Return the results of a test case for the named methods, or for all if none are named."""

    def list_chosen(scene, radians):
        candidates = atlas_cells.list_candidates(scene, radians)
        return [candidate for candidate in candidates if not methods or candidate.name in methods]

    return {cell["method"]: cell for cell in atlas_cells.make_cells(CASES[name], list_chosen)}


@pytest.mark.parametrize(
    "name", ["spin: Lagrange, spin 1e6", "sleeping: at critical spin", "SI: planet"]
)
def test_no_cell_is_wrong_in_silence(name):
    cells = examine_case(name)
    methods = {method for method in kr.methods if kr.methods[method].suits(CASES[name].scene())}
    assert methods | {"heyoka"} <= set(cells) <= methods | set(single_runs.RECORDERS)
    for method, cell in cells.items():
        assert cell["verdict"] in ("right", "within tolerance", "degraded", "lost"), method
        assert cell["agreement"] < cell["conditioning"], "the references are not accurate enough"
    assert max(cells[method]["attitude_error"] for method in ("strang", "extrap", "rk4")) < 0.01


@pytest.mark.parametrize("name", [name for name in CASES if name.startswith("damping")][1::2])
def test_taylor_is_right_under_strong_damping(name):
    (cell,) = examine_case(name, "taylor").values()
    assert cell["verdict"] in verdicts.MET and cell["steps"] < 1000
    assert cell["agreement"] < cell["conditioning"]


@pytest.mark.parametrize(
    ("name", "method", "verdict", "mark"),
    [
        ("shape: no body, I3 > I1 + I2", "rk4", "refused", verdicts.REFUSED),
        ("long: Lagrange, 2^54 rad", "exact", "refused", verdicts.REFUSED),
        ("steps: Lagrange, 0.25 a turn", "rk4", "stopped", verdicts.BLOW_UP),
        ("steps: Lagrange, 0.25 a turn", "strang", "lost", None),
        ("steps: Lagrange, 0.25 a turn", "extrap", "degraded", None),
        ("stiff: needle, 64 a turn of precession", "strang", "degraded", None),
        ("shape: needle, I3/I1 = 1e-8", "implicit_midpoint", "lost", None),
        ("gravity: general, g = -1", "taylor", "within tolerance", ""),
    ],
)
def test_extreme_runs_are_judged(name, method, verdict, mark):
    cell = examine_case(name, method)[method]
    assert cell["verdict"] == verdict and mark in (None, cell["mark"]), cell


@pytest.mark.parametrize(
    ("error", "estimate", "per_turn", "expected"),
    [
        (1e-13, 0.0, 64, "right"),
        (1e-3, 4e-4, 64, "degraded"),
        (1.0, 0.4, 64, "lost"),
        (3.0, 0.15, 64, "lost"),  # if two runs differ so much, neither can be trusted
        (3.0, 0.05, 64, "silent"),
        (1e-3, 1e-4, 64, "silent"),
        (1.0, 1e-9, 8, "silent"),  # too large a step would cause a larger difference
        (1e-3, 1e-4, 8, "degraded"),
        (1.0, 1e-9, 2, "lost"),  # two steps per turn are too few, as a user knows beforehand
        (5e-12, 1e-12, 64, "degraded"),  # accumulated rounding errors
        (5e-12, 0.0, 64, "silent"),  # rounding errors would differ between both runs
        (float("nan"), 0.0, 2, "silent"),
    ],
)
def test_verdicts_follow_from_what_a_user_can_see(error, estimate, per_turn, expected):
    sign = verdicts.find_sign(error, estimate, per_turn, (1e-12, 1e-11, 0.0))
    assert verdicts.choose_verdict(error, 1e-12, sign) == expected


@pytest.mark.parametrize(
    ("error", "tol", "expected"),
    [
        (1e-9, 1e-9, "within tolerance"),
        (1e-13, 1e-9, "right"),
        (2e-9, 1e-9, "degraded"),
        (1e-10, None, "degraded"),
        (0.5, 1.0, "lost"),
    ],
)
def test_verdicts_grant_the_requested_tolerance(error, tol, expected):
    assert verdicts.choose_verdict(error, 1e-12, "second run", tol) == expected


def test_the_second_run_estimates_the_error():
    """Check the error estimate for errors that are exactly of order h^p."""
    for order in (1, 2, 4, 8):
        estimate = verdicts.estimate_error(1e-3 * (1 - 2.0**-order), order)
        assert estimate == pytest.approx(1e-3, rel=1e-12)


FAULTY = ("gravity: Lagrange, g = -1", "gravity: general, g = -1", "shape: disc, I3 = 2 I1")
JUMP = (np.cos(0.1), 0.0, 0.0, np.sin(0.1))  # a rotation by 0.2 rad about the third axis


def make_faulty_candidates(fault):
    """Return a function that lists all methods, each with an artificial fault."""

    def list_faulty_candidates(scene, radians):
        return [
            replace(candidate, run=lambda *args, candidate=candidate: fault(candidate, *args))
            for candidate in atlas_cells.list_candidates(scene, radians)
            if candidate.name in kr.methods
        ]

    return list_faulty_candidates


def increase_gravity(candidate, problem, scene, times, setting, factor=1.3):
    return candidate.run(problem, scene.replace(gravity=scene.gravity * factor), times, setting)


def shorten_times(candidate, problem, scene, times, setting):
    return candidate.run(problem, scene, [t * (1 - 0.02 * (t > 0)) for t in times], setting)


def twist(candidate, problem, scene, times, setting):
    """Rotate the body about its axis T. The energy of symmetric tops does not change."""
    q, m, *counts = candidate.run(problem, scene, times, setting)
    return np.array([*q[:1], *(kr.quaternion.multiply(p, JUMP) for p in q[1:])]), m, *counts


def turn_heading(candidate, problem, scene, times, setting):
    """Rotate body and momentum about the vertical, which changes no integral."""
    q, m, *counts = candidate.run(problem, scene, times, setting)
    q = np.array([*q[:1], *(kr.quaternion.multiply(JUMP, p) for p in q[1:])])
    m = np.array([*m[:1], *(kr.quaternion.turn(JUMP, p) for p in m[1:])])
    return q, m, *counts


@pytest.mark.parametrize("name", FAULTY)
@pytest.mark.parametrize("fault", [increase_gravity, shorten_times, twist, turn_heading])
def test_gross_faults_are_wrong_in_silence_in_every_method(fault, name):
    """Check that large artificial errors are never mistaken for correct results."""
    sound = examine_case(name)
    for cell in atlas_cells.make_cells(CASES[name], make_faulty_candidates(fault)):
        method = cell["method"]
        if "attitude_error" in cell and sound[method].get("attitude_error", 1.0) <= 5e-3:
            assert cell["verdict"] == "silent" and cell["mark"] == verdicts.ALARM, method


def test_small_faults_are_found_where_the_method_is_exact_enough():
    """Check an error of 0.1 % in gravity, which is much larger than the errors of these methods."""

    def fault(*arguments):
        return increase_gravity(*arguments, factor=1.001)

    cells = atlas_cells.make_cells(CASES[FAULTY[0]], make_faulty_candidates(fault))
    found = {cell["method"] for cell in cells if cell["verdict"] == "silent"}
    assert found >= {"exact", "taylor", "kahan_li8", "extrap", "suzuki4", "takahashi_imada4"}


def test_wrong_orders_and_ignored_tolerances_are_detected():
    case, ours = CASES["gravity: general, g = -1"], atlas_cells.make_method_candidate
    four, loose = replace(ours(kr.methods["strang"]), order=4), ours(kr.methods["taylor"])

    def replace_tolerance(factor, power):
        def run(problem, scene, times, setting):
            tol = factor * setting["tol"] ** power
            return loose.run(problem, scene, times, setting | {"tol": tol})

        return replace(loose, run=run)

    candidates = [four, replace_tolerance(1e7, 1), replace_tolerance(1e-4, 0)]
    cells = atlas_cells.make_cells(case, lambda scene, radians: candidates)
    assert [cell["mark"] for cell in cells] == [verdicts.REDUCED, verdicts.BEYOND, verdicts.ALARM]


def test_failed_runs_are_explained_in_a_table():
    cells = atlas_cells.make_cells(CASES["shape: rod, I3 = 0"])
    ((word, message), whom), *others = atlas.collect_notes(cells).items()
    assert word == "refused" and "0.0 is not positive" in message and not others
    assert whom == {", ".join(kr.methods): ["rod, I3 = 0"]}
    assert sum(sum(line["counts"]) for line in atlas.count_verdicts(cells)) == len(cells)
