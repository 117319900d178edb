"""Strongly damped bodies with rotors, and damping backward in time, which adds energy."""

import kreisel as kr
import numpy as np
import pytest
from decimal_series import Series, attitude_error

from validation.references import radau
from validation.references.problems import Problem

MOMENTS, COM = (1, 1.2, 1.7), (0.1, 0.2, 1)
START = {"momentum": (0.3, 0.4, 1.0), "attitude": (0.8, 0.6, 0, 0)}


def scene(damping, rotor=(0.3, -0.4, 0.8), **changes):
    body = kr.Body(1, MOMENTS, COM, unphysical=True, rotor=rotor)
    return kr.Scene(body, **START, damping=damping).replace(**changes)


@pytest.mark.parametrize(
    "damping, rotor, steps",
    [
        (1e4, (30, -40, 80), 60),
        (1e3, (3000, -4000, 8000), 400),  # the rotor exceeds the damping
        ((300, 1e4, 2e3), (0.3, -0.4, 0.8), 200),
        ((0, 1e4, 1e4), (0.3, -0.4, 0.8), 200),
    ],
)
def test_paths_agree_with_an_implicit_integrator(damping, rotor, steps):
    top, t = scene(damping, rotor), 30.0
    problem = Problem("top", MOMENTS, COM, START["attitude"], START["momentum"], top.damping)
    q, m = radau.integrate(problem, [t], rotor=rotor)
    path = kr.solve(top, [t], max_steps=steps)
    assert kr.attitude_error(path.q[0], q[0].astype(float)) < 2e-14
    assert np.abs(path.body_momentum[0] - m[0]).max() < 1e-14 * max(1, np.abs(rotor).max())


@pytest.mark.parametrize(
    "damping, rotor",
    [
        (1e4, (0.3, -0.4, 0.8)),
        (1e4, (9e3, 0, -6e3)),
        ((3e3, 1e4, 2e4), (0, 30, 0)),
        ((0, 1e4, 1e4), (0.3, -0.4, 0.8)),
        ((0, 1e4, 1e4), (6e3, 0, -9e3)),
        ((0.3, 0, 1e5), (0.3, -0.4, 0.8)),
    ],
)
def test_every_precision_agrees_with_the_series(damping, rotor):
    top, t = scene(damping, rotor), 0.004
    q, _ = Series(top).to(t)
    for digits, tolerance in ((None, 1e-13), (20, 1e-18), (30, 1e-27)):
        path = kr.solve(top, [t], digits=digits, max_steps=1000)
        low = path.q_low[0] if digits else (0, 0, 0, 0)
        assert attitude_error(q, path.q[0], low) < tolerance


def test_a_rotor_along_the_axis_slows_the_fall():
    damping = rotor = 1e6
    body = kr.Body(1, (1, 1, 1), (0, 0, 1), unphysical=True, rotor=(0, 0, rotor))
    top = kr.Scene(body, body_velocity=(0, 0, 0), attitude=START["attitude"], damping=damping)
    path = kr.solve(top, [0.0, 1e6], max_steps=100)
    # On the slow manifold D w = h x w + P x c, so that the apex falls as if D were D + h^2 / D.
    slowed = damping + rotor**2 / damping
    fallen = 2 * np.arctan(np.tan(path.nutation[0] / 2) * np.exp(1e6 / slowed))
    assert path.nutation[1] == pytest.approx(fallen, abs=1e-9)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"turning": (0.1, 0.2, 0.3)},
        {"shaking": (0.1, 3.0, 0.2)},
        {"friction": 0.1},
        {"gravity": 0.0},
    ],
)
def test_excessive_growth_backward_in_time_is_refused(changes):
    top = scene(1e5, **changes)
    with pytest.raises(ValueError, match="makes more turns than a double can resolve"):
        kr.solve(top, -1.0, max_steps=1000)
    path = kr.solve(top, [-1e-5], max_steps=100)
    back = kr.solve(path.end, [1e-5], max_steps=100)
    assert kr.attitude_error(back.q[0], top.attitude) < 1e-13


def test_a_top_from_rest_fails_soon_backward():
    with pytest.raises(kr.Error, match="no longer finite"):
        kr.solve(scene(1e5, (0, 0, 0), momentum=(0, 0, 0)), -1.0, max_steps=1000)


def test_a_top_at_rest_stays_at_rest_backward():
    hanging = kr.Scene(kr.Body(1, MOMENTS, (0, 0, -1), unphysical=True), velocity=(0, 0, 0))
    path = kr.solve(hanging.replace(damping=1e5), [-1.0], max_steps=40000)
    assert np.array_equal(path.q[0], (1, 0, 0, 0)) and not path.m.any()


def test_events_before_the_refused_time_are_found():
    level = kr.events.plane((0, 0, 1), of="apex", terminal=True)
    top = kr.Scene(kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True), velocity=(30, 0, 0))
    found = kr.solve(top.replace(damping=100.0), -0.02, events=[level]).events
    assert len(found) == 1
    again = kr.solve(top.replace(damping=100.0), -1.0, events=[level]).events
    assert again.path.t[0] == found.path.t[0]
