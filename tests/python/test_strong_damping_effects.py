"""Tests of strong damping of bodies with rotors or on moving supports."""

import kreisel as kr
import numpy as np
import pytest
from decimal_series import Series, attitude_error

from validation.references import radau
from validation.references.problems import Problem

MOMENTS, COM = (1, 1.2, 1.7), (0.1, 0.2, 1)
START = {"momentum": (0.3, 0.4, 1.0), "attitude": (0.8, 0.6, 0, 0), "gravity": 1}
ROTOR, NONE = (0.3, -0.4, 0.8), (0, 0, 0)
TURNING, SHAKING = {"turning": (0.1, 0.2, 0.3)}, {"shaking": (0.1, 3.0, 0.2)}
BOTH = TURNING | SHAKING


def scene(damping, rotor=ROTOR, **changes):
    body = kr.Body(1, MOMENTS, COM, unphysical=True, rotor=rotor)
    return kr.Scene(body, **START, damping=damping).replace(**changes)


@pytest.mark.parametrize(
    "damping, rotor, effects, t, steps",
    [
        (1e4, (30, -40, 80), {}, 30.0, 60),
        (1e3, (3000, -4000, 8000), {}, 30.0, 400),  # the rotor exceeds the damping
        ((300, 1e4, 2e3), ROTOR, {}, 30.0, 200),
        ((0, 1e4, 1e4), ROTOR, {}, 30.0, 200),
        (1e4, NONE, TURNING, 30.0, 60),
        (1e6, NONE, BOTH, 30.0, 100),
        (1e6, NONE, {"turning": (100, 200, 300)} | SHAKING, 3.0, 60),
        (1e4, (30, -40, 80), BOTH, 10.0, 60),
        ((300, 1e4, 2e3), NONE, BOTH, 3.0, 200),
        ((0, 1e4, 1e4), NONE, BOTH, 3.0, 60),
        ((0, 1e6, 1e6), ROTOR, BOTH, 3.0, 100),
        ((1e6, 1e6, 0), NONE, {"turning": (3, 4, 5)}, 3.0, 100),
        (1e6, NONE, {"shaking": (1e-3, 300.0, 0.2)}, 0.1, 100),
    ],
)
def test_paths_agree_with_an_implicit_integrator(damping, rotor, effects, t, steps):
    top = scene(damping, rotor, **effects)
    problem = Problem("top", MOMENTS, COM, START["attitude"], START["momentum"], top.damping)
    q, m = radau.integrate(problem, [t], rotor=rotor, **effects)
    path = kr.solve(top, [t], max_steps=steps)
    size = 2.0 * max(1, np.abs(m).max()) if effects else max(1, np.abs(rotor).max())
    assert kr.attitude_error(path.q[0], q[0].astype(float)) < 2e-14
    assert np.abs(path.body_momentum[0] - m[0]).max() < 2e-14 * size


@pytest.mark.parametrize(
    "damping, rotor, effects",
    [
        (1e4, ROTOR, {}),
        (1e4, (9e3, 0, -6e3), {}),
        ((3e3, 1e4, 2e4), (0, 30, 0), {}),
        ((0, 1e4, 1e4), ROTOR, {}),
        ((0, 1e4, 1e4), (6e3, 0, -9e3), {}),
        ((0.3, 0, 1e5), ROTOR, {}),
        (1e4, NONE, TURNING),
        (1e4, NONE, SHAKING),
        (1e4, (30, -40, 80), BOTH),
        ((3e3, 1e4, 2e4), NONE, {"turning": (3, 4, 5)}),
        ((0, 1e5, 1e5), ROTOR, BOTH),
        ((0.3, 0, 1e5), NONE, BOTH),
        # Near the limits of strong damping, on both sides.
        (1e4, NONE, {"turning": (30, 40, 20)}),
        (1e4, NONE, {"turning": (300, 400, 200)}),
        (1e4, NONE, {"shaking": (1e-4, 150.0, 0.2)}),
        (1e4, NONE, {"shaking": (1e-5, 1e3, 0.2)}),
        (1e4, NONE, {"shaking": (1e-7, 1e4, 0.2)}),
        (1e4, NONE, SHAKING | {"gravity": 0.0}),
    ],
)
def test_every_precision_agrees_with_the_series(damping, rotor, effects):
    top, t = scene(damping, rotor, **effects), 0.004
    q, _ = Series(top).to(t)
    for digits, tolerance in ((None, 1e-13), (20, 1e-18), (30, 1e-27)):
        path = kr.solve(top, [t], digits=digits, max_steps=1000)
        low = path.q_low[0] if digits else (0, 0, 0, 0)
        assert attitude_error(q, path.q[0], low) < tolerance


def test_a_rotor_along_the_axis_slows_the_fall():
    damping = rotor = 1e6
    body = kr.Body(1, (1, 1, 1), (0, 0, 1), unphysical=True, rotor=(0, 0, rotor))
    top = kr.Scene(
        body, body_velocity=(0, 0, 0), attitude=START["attitude"], damping=damping, gravity=1
    )
    path = kr.solve(top, [0.0, 1e6], max_steps=100)
    # On the slow manifold D w = h x w + P x c, so that the apex falls as if D were D + h^2 / D.
    effective_damping = damping + rotor**2 / damping
    nutation = 2 * np.arctan(np.tan(path.nutation[0] / 2) * np.exp(1e6 / effective_damping))
    assert path.nutation[1] == pytest.approx(nutation, abs=1e-9)


@pytest.mark.parametrize(
    "changes",
    [{}, TURNING, SHAKING, BOTH, {"friction": 0.1}, {"gravity": 0.0}],
)
def test_a_top_that_damping_drives_too_far_is_refused(changes):
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
    hanging = kr.Scene(
        kr.Body(1, MOMENTS, (0, 0, -1), unphysical=True), velocity=(0, 0, 0), gravity=1
    )
    path = kr.solve(hanging.replace(damping=1e5), [-1.0], max_steps=40000)
    assert np.array_equal(path.q[0], (1, 0, 0, 0)) and not path.m.any()


def test_events_before_the_refused_time_are_found():
    level = kr.events.plane((0, 0, 1), of="apex", terminal=True)
    top = kr.Scene(
        kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True), velocity=(30, 0, 0), gravity=1
    )
    found = kr.solve(top.replace(damping=100.0), -0.02, events=[level]).events
    assert len(found) == 1
    again = kr.solve(top.replace(damping=100.0), -1.0, events=[level]).events
    assert again.path.t[0] == found.path.t[0]


@pytest.mark.parametrize("effects", [TURNING, SHAKING, BOTH])
def test_few_steps_suffice(effects):
    top = scene(1e6, NONE, **effects)
    path = kr.solve(top, [1.0], max_steps=100)
    deep = kr.solve(top, [1.0], digits=30, max_steps=200)
    assert kr.attitude_error(path.q[0], deep.q[0]) < 1e-15


def test_a_top_on_a_turning_support_falls_as_on_a_support_at_rest():
    body = kr.Body(1, (1, 1, 1), (0, 0, 1), unphysical=True)
    top = kr.Scene(
        body, body_velocity=(0, 0, 0), attitude=START["attitude"], damping=1e6, gravity=1
    )
    # A support that turns about the vertical carries the ball along without tilting it.
    path = kr.solve(top.replace(turning=(0, 0, 2.0)), [0.0, 1e6], max_steps=100)
    nutation = 2 * np.arctan(np.tan(path.nutation[0] / 2) * np.exp(1.0))
    assert path.nutation[1] == pytest.approx(nutation, abs=1e-5)


def test_permuted_axes_give_the_same_path():
    times, other_path = (
        np.linspace(0, 3, 7),
        kr.solve(scene((300, 1e4, 2e3), NONE, **BOTH), np.linspace(0, 3, 7)),
    )
    cycle = np.array((0.5, 0.5, 0.5, 0.5))  # takes x to y, y to z and z to x
    body = kr.Body(1, np.roll(MOMENTS, 1), np.roll(COM, 1), unphysical=True)
    attitude = kr.quaternion.multiply(START["attitude"], kr.quaternion.conjugate(cycle))
    top = kr.Scene(
        body, momentum=START["momentum"], attitude=attitude, damping=(2e3, 300, 1e4), gravity=1
    )
    path = kr.solve(top.replace(**BOTH), times, max_steps=300)
    assert np.abs(path.apex - other_path.apex).max() < 1e-14
    assert np.abs(path.m - other_path.m).max() < 1e-14


@pytest.mark.parametrize("damping", [1e5, (0, 1e5, 1e5)])
def test_dense_times_streams_and_continued_paths_agree(damping):
    top, times = scene(damping, **BOTH), np.linspace(0, 2, 41)
    path, alone = kr.solve(top, times), kr.solve(top, [2.0])
    assert np.array_equal(path.q[-1], alone.q[0])
    attitudes = np.concatenate([part.q for part in kr.stream(top, times)])
    assert np.array_equal(attitudes, path.q)
    half = kr.solve(top, [1.0])
    later_path = kr.solve(half.end, [1.0])
    assert kr.attitude_error(later_path.q[0], path.q[-1]) < 1e-14


def test_events_on_the_way_are_found():
    top = scene(1e4, NONE, **BOTH)
    height = kr.solve(top, [500.0]).apex[0, 2]
    level = kr.events.crossing("apex_z", height)
    found = kr.solve(top, 1000.0, events=[level]).events
    apex = kr.solve(top, found.path.t).apex
    assert len(found) > 0
    assert np.abs(apex[:, 2] - height).max() < 1e-13
