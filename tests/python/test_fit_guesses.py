"""Tests of the initial guesses that kreisel.fit computes from the records."""

import kreisel as kr
import numpy as np
import pytest
from fits import GUESS, HEAVY, SYMMETRIC, SYMMETRIC_GUESS, gyroscope
from kreisel._fit.initial_guess import guess_parameters_from_records
from kreisel._fit.motion_data import compute_apex_samples, reconstruct_motions
from kreisel._fit.parameters import FreeParameters, convert_scene_to_fit_point, expand_free_names

T = np.linspace(0.0, 3.0, 600)
BODY = ("start", "moments", "com")
NEAR = HEAVY.replace(
    body=kr.Body(1.0, (1.0, 1.2, 0.7), com=(0.1, 0.1, 0.3), unphysical=True), velocity=(0, 0, 1)
)


def guesses(start, record, free=BODY):
    """Return the initial guesses of the free parameters that are computed from one record."""
    return guess_parameters_from_records(
        FreeParameters(start, expand_free_names(free), [record]), [record]
    )


def measure(scene, names, t=T):
    """Return a record of exact values of the given quantities and components of the apex."""
    path = kr.solve(scene, t)
    apex = dict(zip(("apex_x", "apex_y", "apex_z"), path.apex.T, strict=True))
    return kr.Record(t, {n: apex[n] if n in apex else getattr(path, n) for n in names})


@pytest.mark.parametrize("damping", [0.0, 0.2])
@pytest.mark.parametrize(
    "names",
    [("velocity",), ("body_velocity",), ("body_velocity", "body_vertical"), ("q",)],
    ids="+".join,
)
def test_a_guess_is_near_the_truth(names, damping):
    scene = HEAVY.replace(damping=damping)
    free = (*BODY, "damping") if damping else BODY
    found = guesses(NEAR, measure(scene, names), free)
    assert {guess.motion.source for guess in found} == {
        {"velocity": "space", "q": "attitude", "body_vertical": "vertical"}.get(
            names[-1], "gyroscope"
        )
    }
    for guess in found:
        made = guess.point.to_scene()
        assert np.allclose(made.body.moments, HEAVY.body.moments, rtol=0.01)
        assert np.allclose(made.body.com, HEAVY.body.com, atol=0.01)
        assert np.allclose(made.damping, damping, atol=0.002)
        path, true = kr.solve(made, T[:50]), kr.solve(scene, T[:50])
        for name in names:
            expected = getattr(true, name)
            assert np.allclose(getattr(path, name), expected, atol=0.06 * np.abs(expected).max())


def test_gyroscope_data_do_not_determine_the_side_of_an_unknown_centre_of_mass():
    start = GUESS.replace(body=kr.Body(1.0, (1.0, 1.1, 1.2), com=(0, 0, 0), unphysical=True))
    found = [guess.point for guess in guesses(start, measure(HEAVY, ["body_velocity"]))]
    assert len(found) >= 2
    for one, other in zip(found[::2], found[1::2], strict=True):
        assert (one.com == -other.com).all() and (one.moments == other.moments).all()
        lever = np.linalg.norm(HEAVY.body.com) / HEAVY.body.moments[0]
        assert np.isclose(np.linalg.norm(one.com) / one.moments[0], lever, rtol=0.01)


@pytest.mark.parametrize("names", [("apex_x", "apex_y"), ("nutation", "precession_angle")])
def test_components_and_angles_of_the_apex_are_as_good_as_the_apex(names):
    t, free = np.linspace(0.0, 4.0, 200), ("start", "moments")
    found = guesses(SYMMETRIC_GUESS, measure(SYMMETRIC, names, t), free)
    expected = guesses(SYMMETRIC_GUESS, measure(SYMMETRIC, ["apex"], t), free)
    assert len(found) == len(expected) > 1
    for guess, other in zip(found, expected, strict=True):
        assert np.allclose(guess.point.moments, other.point.moments, rtol=1e-6)
        assert np.allclose(guess.motion.attitude, other.motion.attitude, atol=1e-6)
    assert np.allclose(found[0].point.moments[:2], SYMMETRIC.body.moments[:2], rtol=0.01)


def test_horizontal_components_of_the_apex_are_on_the_side_of_the_guess():
    hanging = SYMMETRIC.replace(attitude=(0.0, 1.0, 0.0, 0.0))
    record = measure(SYMMETRIC, ["apex_x", "apex_y"])
    [up] = compute_apex_samples([record], convert_scene_to_fit_point(SYMMETRIC))
    [down] = compute_apex_samples([record], convert_scene_to_fit_point(hanging))
    assert np.allclose(up.apex, kr.solve(SYMMETRIC, T).apex, atol=1e-12)
    assert np.allclose(down.apex, up.apex * (1.0, 1.0, -1.0), atol=1e-12)


def test_only_changes_of_the_free_state_are_allowed_for_a_guess_from_the_apex():
    record = measure(SYMMETRIC, ["apex"], np.linspace(0.0, 4.0, 200))
    for free, allowed in (
        (("attitude", "moments"), (1, 1, 1, 0, 0)),
        (("attitude", "velocity"), (1, 1, 1, 1, 1, 0)),  # not the spin
    ):
        found = guesses(SYMMETRIC_GUESS, record, free)
        assert len(found) >= 2
        for guess in found:
            assert np.allclose(guess.allowed, np.diag(allowed), atol=1e-12)


@pytest.mark.parametrize("name", ["q", "body_velocity", "velocity", "apex", "energy"])
@pytest.mark.parametrize("count", [1, 3, 7])
def test_few_measurements_make_no_guess(name, count):
    record = measure(HEAVY, [name], T[:count])
    assert reconstruct_motions([record], convert_scene_to_fit_point(HEAVY)) == []
    assert compute_apex_samples([record], convert_scene_to_fit_point(HEAVY)) == []
    assert guesses(NEAR, record) == []


def test_the_apex_makes_no_guess_for_a_body_without_a_centre_of_mass():
    start = SYMMETRIC_GUESS.replace(body=kr.Body.symmetric(1.0, 1.7, 1.5, 0.0, unphysical=True))
    assert guesses(start, measure(SYMMETRIC, ["apex"])) == []


def test_a_gyroscope_at_rest_makes_no_guess():
    assert guesses(GUESS, kr.Record(T, {"body_velocity": np.zeros((600, 3))})) == []


@pytest.mark.parametrize("value", [(0.0, np.nan, 1.0), (0.0, 0.0, 0.0)])
def test_verticals_without_a_direction_are_left_out(value):
    rates = gyroscope(n=20).series[0].values
    values = {"body_velocity": rates, "body_vertical": np.tile(value, (20, 1))}
    point = convert_scene_to_fit_point(HEAVY)
    [motion] = reconstruct_motions([kr.Record(T[:20], values)], point)
    assert motion.source == "gyroscope" and (motion.rate == rates).all()


def test_the_vertical_nearest_to_the_first_rate_counts():
    path = kr.solve(HEAVY, T[:20])
    values = {"body_velocity": path.body_velocity, "body_vertical": path.body_vertical.copy()}
    values["body_vertical"][:3] = np.nan
    [motion] = reconstruct_motions([kr.Record(T[:20], values)], convert_scene_to_fit_point(HEAVY))
    first = kr.Scene(HEAVY.body, attitude=motion.attitude[0], momentum=(0, 0, 0), gravity=1)
    assert np.allclose(kr.solve(first, [0.0]).body_vertical, path.body_vertical[3], atol=1e-12)


def test_a_guess_whose_start_cannot_be_computed_is_the_first_measured_state():
    top = kr.Scene(kr.Body(1.0, (1.0, 1.3, 0.7), com=(0, 0, 0)), momentum=(0, 0, 1))
    values = np.tile((1e3, 0.0, 2e4), (20, 1))
    record = kr.Record(np.linspace(10.0, 10.1, 20), {"body_velocity": values})
    [guess] = guesses(top, record, "velocity")
    assert np.allclose(guess.point.rate, values[0], rtol=1e-12)
