"""Tests of parameters that the records of a fit do not determine."""

import kreisel as kr
import numpy as np
import pytest
from fits import SYMMETRIC, change_parameters, differentiate_record, simulate, simulate_gyroscope

HEADING = "the heading: a rotation of the start about the vertical"
TURN_HEADING = "the heading: a rotation of the start and of turning about the vertical"
DELAY = "the delay against the start"
OTHER = ""  # a combination of parameters
PRODUCT = "{} against {}: only mass * gravity * com counts"
FACTOR = "the scale of the moments: moments{} have an unknown common factor"

T = np.linspace(0.0, 4.0, 40)
START = np.array((0.9, 0.3, 0.1, 0.3))
TURNING, SHAKING = (0.3, -0.1, 0.5), (0.05, 7.0, 0.4)


def top(moments=(1.0, 1.3, 0.6), com=(0.05, 0.1, 0.4), velocity=(3.0, 2.0, 12.0), **words):
    body = kr.Body(1.0, moments, com, rotor=words.pop("rotor", (0, 0, 0)), unphysical=True)
    attitude = START / np.linalg.norm(START)
    return kr.Scene(body, attitude=attitude, body_velocity=velocity, gravity=9.81, **words)


FREE_BODY = {"com": (0.0, 0.0, 0.0), "velocity": (1.0, 2.0, 5.0)}
LAGRANGE = {"moments": (1.0, 1.0, 0.6), "com": (0.0, 0.0, 0.4)}
SIDEWAYS = {"moments": (0.6, 1.0, 1.0), "com": (-0.4, 0.0, 0.0)}  # symmetric about the x axis
SPHERE = {"moments": (1.0, 1.0, 1.0), "com": (0.0, 0.0, 0.0)}
DAMPING = {"damping": (0.1, 0.2, 0.3)}
CASES = {
    "heading": (top(), "body_velocity", "start", [HEADING]),
    "turning": (top(turning=TURNING), "inertial_velocity", "start turning", [TURN_HEADING]),
    "no torque": (top(**FREE_BODY), "body_velocity", "start", [HEADING, OTHER, OTHER]),
    "no torque, moments": (
        top(**FREE_BODY),
        "body_velocity",
        "start moments",
        [FACTOR.format(" and damping"), HEADING, OTHER, OTHER],
    ),
    "spin angle": (top(**LAGRANGE), "apex", "start", [OTHER]),
    "spin": (top(**LAGRANGE), "apex", "start moments", [OTHER, OTHER]),
    "spin about the x axis": (top(**SIDEWAYS), "apex", "start moments", [OTHER, OTHER]),
    "rotor against spin": (
        top(**LAGRANGE, rotor=(0.0, 0.0, 2.0)),
        "apex",
        "start rotor",
        [OTHER, OTHER],
    ),
    "rotor against moment": (
        top(**SIDEWAYS, rotor=(2.0, 0.0, 0.0)),
        "apex",
        "moments rotor",
        [OTHER],
    ),
    "delay": (top(), "apex", "start", [DELAY]),
    "delay while shaking": (top(shaking=SHAKING), "apex", "start shaking", [DELAY]),
    "axes": (top(**SPHERE), "q", "start axes", [OTHER, OTHER, OTHER]),
    "gravity and com": (
        top(),
        "apex",
        "gravity mass com",
        [PRODUCT.format("gravity", "com"), PRODUCT.format("mass", "com")],
    ),
    "gravity and mass": (
        top(shaking=SHAKING),
        "apex",
        "gravity mass shaking",
        [PRODUCT.format("gravity", "mass")],
    ),
    "mass and lever": (top(), "apex", "mass lever", [PRODUCT.format("mass", "lever")]),
    "factor": (
        top(friction=0.3, **DAMPING),
        "apex",
        "moments damping friction gravity",
        [FACTOR.format(", damping, friction and gravity")],
    ),
    "factor with a rotor": (
        top(rotor=(0.3, 0.5, 1.0)),
        "apex",
        "moments rotor lever",
        [FACTOR.format(", damping, rotor and lever")],
    ),
    "factor of tied moments": (
        top(**LAGRANGE, damping=0.1),
        "body_velocity",
        "velocity moments damping com",
        [FACTOR.format(", damping and com")],
    ),
    "a fixed damping shows the scale": (
        top(**DAMPING),
        "body_velocity",
        "velocity moments com",
        [],
    ),
    "a fixed rotor shows the scale": (
        top(rotor=(0.0, 0.5, 0.0)),
        "body_velocity",
        "velocity moments com",
        [],
    ),
    "an attitude shows the heading": (top(), "q", "start", []),
    "ratios": (
        top(**FREE_BODY, **DAMPING),
        "body_velocity",
        "velocity moments damping",
        [FACTOR.format(" and damping")],
    ),
    "ratios with a rotor": (
        top(**FREE_BODY, rotor=(0.3, 0.5, 1.0)),
        "body_velocity",
        "moments rotor",
        [FACTOR.format(", damping and rotor")],
    ),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_undetermined_directions_are_named(case):
    """Check that there are as many sentences as changes of the parameters that change nothing.

    Derivatives by differences give these changes, and the parameters that take part in them.
    """
    scene, quantity, free, expected = case
    settings = {"delay[0]": 0.0} if DELAY in expected else {}
    record = simulate(scene, T, {quantity: 0.01}, noise=0.0, settings=settings)
    fit = kr.fit(scene, record, free.split())
    assert len(fit.unidentified) == len(expected)
    for sentence, beginning in zip(fit.unidentified, expected, strict=True):
        assert sentence.startswith(beginning) and f"Not identified: {sentence}" in str(fit)
    jacobian = differentiate_record(scene, T, fit.names, quantity, settings)
    _, values, vectors = np.linalg.svd(jacobian)
    blind = vectors[values < 1e-6 * values[0]]
    assert len(blind) == len(expected)
    takes_part = np.linalg.norm(blind, axis=0) > 1e-3
    assert np.isinf(list(fit.error.values())).tolist() == takes_part.tolist()
    others = fit.unidentified[len(expected) - expected.count(OTHER) :]
    for sentence in others:
        words = [name for name in fit.names if name in sentence.split()] or [sentence]
        assert all(np.isinf(fit.error[name]) for name in words)


def test_a_delay_of_one_of_two_instruments_is_determined():
    one = simulate(top(), T, {"apex": 0.01}, settings={"delay[0]": 0.02})
    other = simulate(top(), T, {"body_velocity": 0.01}, seed=1)
    fit = kr.fit(top(), [one, other], "start")
    assert fit.unidentified == () and abs(fit.values["delay[0]"] - 0.02) < 0.005


def test_the_apex_determines_the_axial_momentum_and_the_transverse_moment():
    record = simulate(SYMMETRIC, T, {"apex": 0.005})
    guess = change_parameters(SYMMETRIC, {"I1": 0.2, "I2": 0.2, "I3": 0.1})
    fit = kr.fit(guess, record)
    assert len(fit.unidentified) == 2
    assert abs(fit.values["I1 = I2"] - 1.0) < 4.0 * fit.error["I1 = I2"] < 0.06
    momentum, error = fit.error_of(lambda scene: kr.solve(scene, [0.0]).axial_momentum[0])
    assert abs(momentum - 12.0) < 4.0 * error < 0.4
    ratios = [error for _, error in fit.moment_ratios.values()]
    assert np.isinf(ratios).all()


def test_a_gyroscope_with_an_unknown_bias_does_not_determine_the_spin():
    """Check that the search does not follow the noise along the sum of spin and bias."""
    scene, t = kr.scenes.asymmetric_regular, np.linspace(0.0, 6.0, 150)
    bias = dict(zip((f"bias[0].body_velocity_{x}" for x in "xyz"), (0.1, -0.2, 0.05), strict=True))
    found = kr.fit(scene, simulate(scene, t, {"body_velocity": 0.02}, 1018, settings=bias))
    assert found.has_converged and found.chi2 < 1.1 * found.dof
    names = ("body_velocity_z", "bias[0].body_velocity_z", "I1", "I2", "I3")
    assert all(np.isinf(found.error[name]) for name in names)
    assert all(np.isinf(error) for _, error in found.moment_ratios.values())
    assert abs(found.values["bias[0].body_velocity_z"]) < 0.232  # the spread of the values
    assert abs(found.values["I3"] - 1.28) < 0.4
    for name in list(bias)[:2]:
        assert abs(found.values[name] - bias[name]) < 4.0 * found.error[name] < 0.01
    heading, combination = found.unidentified
    assert heading == HEADING and combination.startswith("a combination of parameters: ")
    assert "bias[0].body_velocity_z" in combination and " I1 " in combination


def test_records_without_information_determine_nothing():
    rough = simulate_gyroscope(n=50, noise=0.0, sigma=1e9)
    found = kr.fit(top(), rough, "velocity")
    assert np.isinf(list(found.error.values())).all() and len(found.unidentified) == 3
    assert found.nonlinearity == 0.0 and "not identified" in str(found)
    draws = found.scatter(3)
    assert (np.asarray(draws.momentum) == found.scene.momentum).all()
