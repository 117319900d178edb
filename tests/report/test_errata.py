"""Tests of the errors found in the thesis and of their corrections."""

import kreisel as kr
import numpy as np
import pytest

from validation.thesis import errata, errata_maps, su2
from validation.thesis.integrals import special_scene
from validation.thesis.trajectories import SCENE, solve_fixed_step, solve_theorem42, solve_truth

STATED = {  # the error of the text, to within a tenth, and the largest error of the correction
    1: (2.42, 5e-3),
    2: (8.5e-2, 1e-13),
    3: (2.96, 5e-3),
    4: (1.83, 1e-14),
    5: (0.26, 1e-11),
    6: (0.72, 1e-11),
    7: (0.62, 1e-14),
    8: (0.25, 0.0),
    9: (0.306, 1e-7),
    10: (1.41, 1e-14),
    11: (0.752, 1e-13),
    12: (0.21, 1e-15),
    13: (1.23, 1e-7),
    14: (9.64, 1e-9),
    15: (1.0, 0.03),
}
ALL = {erratum["number"]: erratum for erratum in errata.compute_errata()}


def test_all_fifteen_errata_exist():
    assert set(ALL) == set(STATED) == set(range(1, 16))


@pytest.mark.parametrize("number", STATED)
def test_the_printed_text_is_wrong_and_the_correction_is_right(number):
    wrong, right = STATED[number]
    assert ALL[number]["printed_error"] == pytest.approx(wrong, rel=0.1)
    assert ALL[number]["corrected_error"] <= right


def test_the_error_of_c_does_not_vanish_with_the_step():
    tilted = errata_maps.TILTED
    text, right = (
        [
            errata_maps.attitude_error_at(su2.run_theorem42(tilted, h, 5.0, c_of=c), tilted, 5.0)
            for h in (0.02, 0.01)
        ]
        for c in "pa"
    )
    assert abs(text[1] / text[0] - 1) < 0.1 and right[1] / right[0] == pytest.approx(0.5, rel=0.1)


def test_the_error_of_c_has_no_effect_in_the_scene_of_the_thesis():
    """Check that the erratum on the constant c does not affect the example in the thesis.

    In this scene a0 = e3, hence <m, p> / g equals <m, a>, and g = p = 1 before scaling.
    """
    course = solve_truth(SCENE, np.linspace(0, 20, 21))
    assert course.axial_momentum == pytest.approx(course.vertical_momentum, abs=1e-10)


@pytest.mark.parametrize(
    "scene", [errata_maps.SCALED, errata_maps.TILTED], ids=["upright", "tilted"]
)
def test_the_run_of_theorem_42_follows_the_theorem_literally(scene):
    path = solve_theorem42(scene, 0.05, 5.0).path
    for form in 1, 2:
        assert kr.attitude_error(su2.run_theorem42(scene, 0.05, 5.0, form=form), path.q[-1]) < 1e-11


def test_right_multiplication_does_not_correct_theorem_42():
    q = su2.run_theorem42(errata_maps.TILTED, 0.02, 20.0, side="right")
    assert errata_maps.attitude_error_at(q, errata_maps.TILTED, 20.0) > 0.5


def test_the_matrix_of_theorem_34_is_not_a_rotation():
    axis = np.array((2, -1, 2)) / 3
    text = np.cos(0.35) * su2.ID + np.sin(0.35) * su2.to_matrix(axis)
    assert np.linalg.det(text).real == pytest.approx(0.91, abs=0.005)
    assert np.linalg.det(su2.rotation_matrix(axis, 0.7)).real == pytest.approx(1, abs=1e-15)


def test_the_first_terms_of_h_eps_are_the_energy_up_to_a_constant():
    course = solve_truth(errata_maps.TILTED, np.linspace(0, 10, 11))
    path = course.path
    alpha, g = path.scene.body.moments[2], path.scene.body.mass * path.scene.gravity
    terms = (path.m**2).sum(-1) / 2 + g * path.apex[:, 2]
    constant = (1 / alpha - 1) * course.axial_momentum[0] ** 2 / 2
    assert constant > 1e-3 and path.energy - terms == pytest.approx(constant, abs=1e-9)


def test_inverse_and_derivative_do_not_commute():
    """Check the proof of theorem 3.5, which contains (Phi')^-1 instead of (Phi^-1)'."""
    h, a = 1e-5, np.array((2, -1, 2)) / 3
    before, middle, after = (su2.rotation_matrix(a, angle) for angle in (0.7 - h, 0.7, 0.7 + h))
    change = (after - before) / (2 * h)
    rate_of_inverse = (np.linalg.inv(after) - np.linalg.inv(before)) / (2 * h)
    assert abs(np.linalg.inv(change) - rate_of_inverse).max() > 0.5
    assert (
        abs(-np.linalg.inv(middle) @ change @ np.linalg.inv(middle) - rate_of_inverse).max() < 1e-9
    )


@pytest.mark.parametrize(
    "words",
    [{"method": "rk4", "step": 0.1}, {"method": "extrap", "tol": 1e-6}],
    ids=["rk4", "extrap"],
)
def test_restarts_do_not_reduce_the_accuracy_of_one_step_methods(words):
    """Check that restarting a one-step method does not reduce its accuracy."""
    whole, half = kr.solve(SCENE, 4.0, **words), kr.solve(SCENE, 2.0, **words)
    again, true = kr.solve(half.end, 2.0, **words), su2.exact_attitude(SCENE, 4.0)
    assert kr.attitude_error(again.q[-1], true) < 3 * kr.attitude_error(whole.q[-1], true)


def test_runge_kutta_has_four_stages():
    course = solve_fixed_step(SCENE, "rk4", 0.1, 1.0)
    assert course.evaluations == 4 * course.steps == 40


def test_g_is_constant_only_for_horizontal_momenta():
    """Check that the Goryachev-Chaplygin integral G is constant only for horizontal momenta.

    In the units of equation (5.2) in the thesis, the integral G satisfies dG/dt = 2 M2 <M, P>.
    """
    level = special_scene("goryachev_chaplygin")
    tilted = level.replace(momentum=SCENE.momentum)
    change = [
        np.ptp(solve_truth(scene, np.linspace(0, 20, 201)).path.goryachev_chaplygin)
        for scene in (level, tilted)
    ]
    assert change[0] < 1e-10 and change[1] > 0.05
