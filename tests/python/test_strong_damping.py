"""Tests of damping that dominates all other torques.

The step size must be limited by the slow motion and not by the fast damping.
"""

import math

import kreisel as kr
import numpy as np
import pytest
from decimal_series import Series, attitude_error

from validation.references.radau import cross

BODY = kr.Body(1, (1, 1.2, 1.7), (0.1, 0.2, 1), unphysical=True)


def scene(damping, **changes):
    return kr.Scene(
        BODY, momentum=(0.3, 0.4, 1.0), attitude=(0.8, 0.6, 0, 0), damping=damping, gravity=1
    ).replace(**changes)


@pytest.mark.parametrize(
    "damping", [1e3, 1e4, (0, 1e4, 1e4), (0.3, 0, 1e4), (50, 100, 1e4), (1e2, 2e3, 1e4)]
)
@pytest.mark.parametrize("t", [0.001, 0.05])
def test_paths_agree_with_the_series(damping, t):
    top = scene(damping)
    q, m = Series(top).to(t)
    for digits, tolerance in ((None, 1e-14), (20, 1e-19), (30, 1e-29)):
        path = kr.solve(top, [t], digits=digits, max_steps=200)
        low = path.q_low[0] if path.q_low is not None else (0, 0, 0, 0)
        assert attitude_error(q, path.q[0], low) < tolerance
        size = max(abs(float(x)) for x in m)
        assert np.abs(path.m[0] - np.array(m, float)).max() < 1e-12 * size


@pytest.mark.parametrize("damping", [200.0, 3e3, (300.0, 1e4, 2e3)])
def test_paths_agree_with_an_implicit_integrator(damping):
    integrate = pytest.importorskip("scipy.integrate")
    top, t = scene(damping), 100.0
    inertia, lever = np.array(BODY.moments), np.array(BODY.principal_com)
    damping = np.array(top.damping)

    def rates(_, y):
        w, up = y[:3], y[3:]
        torque = cross(inertia * w, w) + cross(up, lever) - damping * w
        return np.concatenate([torque / inertia, cross(up, w)])

    up = kr.quaternion.turn_back(top.attitude, (0, 0, 1))
    w = np.array(kr.quaternion.turn_back(top.attitude, top.momentum)) / inertia
    truth = integrate.solve_ivp(rates, (0, t), [*w, *up], "Radau", rtol=1e-11, atol=1e-14)
    path = kr.solve(top, [t], max_steps=100)
    assert np.abs(path.body_vertical[0] - truth.y[3:, -1]).max() < 1e-8
    assert np.allclose(path.body_velocity[0], truth.y[:3, -1], rtol=1e-7, atol=1e-14)


def compute_creep_nutation(t, damping, height=1.0):
    """Return the nutation of an overdamped top in a vertical plane, up to O(1 / damping^2)."""
    return 2.0 * math.atan(math.tan(0.25) * math.exp((t - height / damping) / damping))


@pytest.mark.parametrize("damping", [1e6, 1e9, 1e15])
def test_a_top_creeps_at_the_rate_of_the_slow_motion(damping):
    body = kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True)
    attitude = (math.cos(0.25), math.sin(0.25), 0, 0)
    top = kr.Scene(body, momentum=(0, 0, 0), attitude=attitude, damping=damping, gravity=1)
    times = np.array([0.1, 1.0, 3.0]) * damping
    path = kr.solve(top, times, max_steps=100)
    assert np.abs(path.nutation - [compute_creep_nutation(t, damping) for t in times]).max() < 1e-11
    assert path.error < 1e-14


@pytest.mark.parametrize("damping", [1e4, 1e9])
def test_a_free_body_comes_to_rest_and_stays(damping):
    body = kr.Body(1, (1, 1, 1), (0, 0, 0))
    top = kr.Scene(body, velocity=(0, 0, 3), damping=damping, gravity=1)
    times = np.array([1.0, 20.0, 200.0, 1e3, 1e9]) / damping
    path = kr.solve(top, times, max_steps=300)
    decay = np.exp(-damping * times)
    assert np.abs(path.m[:, 2] - 3 * decay).max() < 1e-15
    assert np.allclose(path.m[:, 2], 3 * decay, rtol=1e-8, atol=1e-100)
    assert (
        np.abs(2 * np.arctan2(path.q[:, 3], path.q[:, 0]) - 3 / damping * (1 - decay)).max() < 1e-16
    )


@pytest.mark.parametrize("velocity", [(0.5, 0.2, 3), (0.5, 0.2, 0), (0, 0, 3), (0, 0, 1e-100)])
@pytest.mark.parametrize("damping", [1e3, 1e5, 1e9])
def test_a_symmetric_top_reaches_the_slow_manifold_with_any_spin(damping, velocity):
    body = kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True)
    attitude = (math.cos(0.25), math.sin(0.25), 0, 0)
    top = kr.Scene(body, body_velocity=velocity, attitude=attitude, damping=damping, gravity=1)
    for settings in ({}, {"tol": 1e-9}, {"digits": 20}):
        path = kr.solve(top, [1.0, 3 * damping], max_steps=800, **settings)
        assert path.nutation[0] == pytest.approx(0.5, abs=20 / damping)
    angle = 4 * 2.0 / damping  # exceeds the rotation until the spin has decayed
    assert abs(path.nutation[1] - compute_creep_nutation(3 * damping, damping)) < 2 * angle
    q, _ = Series(top).to(20 / damping)
    assert attitude_error(q, kr.solve(top, [20 / damping], max_steps=200).q[0]) < 1e-15


def test_every_function_takes_the_same_steps():
    top, times = scene(1e7), [1e-6, 1.0, 1e6, 1e7]
    path = kr.solve(top, times, max_steps=200)
    run = kr.start(top)
    run.to(times[1])
    assert np.array_equal(kr.resume(run.checkpoint).to(times[2:]).states, path.states[2:])
    states = np.concatenate([piece.states for piece in kr.stream(top, times, chunk=1)])
    assert np.array_equal(states, path.states)
    tops = kr.Ensemble.of([top, kr.scenes.thesis])
    assert np.array_equal(kr.solve(tops, times, max_steps=200)[0].states, path.states)


def test_events_are_found_on_the_slow_manifold():
    body = kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True)
    attitude, damping = (math.cos(0.25), math.sin(0.25), 0, 0), 1e8
    top = kr.Scene(body, momentum=(0, 0, 0), attitude=attitude, damping=damping, gravity=1)
    level = kr.events.plane((0, 0, 1), of="apex")
    found = kr.solve(top, 5 * damping, events=[level]).events
    expected = damping * math.log(1 / math.tan(0.25)) + 1 / damping
    assert len(found) == 1 and abs(found.path.t[0] / expected - 1) < 1e-13
    assert abs(kr.section(top, level, n=1, max_wait=5 * damping).t[0] / expected - 1) < 1e-13


def test_tangents_of_strongly_damped_tops_agree_with_short_steps():
    top, t = scene(1e3), 0.5
    path = kr.solve(top, [t], tangents="gravity")
    assert kr.attitude_error(path.q, kr.solve(top, [t]).q)[0] < 1e-14
    h = 2.0**-12
    ends = [kr.solve(top.replace(gravity=1.0 + s * h), [t], digits=30) for s in (1, -1)]
    push = (ends[0].m[0] - ends[1].m[0] + ends[0].m_low[0] - ends[1].m_low[0]) / (2 * h)
    assert np.allclose(path.tangents[0, 3:, 0], push, rtol=1e-6)


def test_paths_backward_in_time_agree_with_the_series():
    top = scene(1e3)
    path = kr.solve(top, [-0.01], digits=20)
    q, _ = Series(top).to(-0.01)
    assert attitude_error(q, path.q[0], path.q_low[0]) < 1e-18


LAGRANGE = kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True)
SPHERICAL = kr.Body(1, (1, 1, 1), (0, 0, 0.3))
ASIDE = kr.Body(1, (1, 1.2, 0.7), (0.1, 0, 0.3), unphysical=True)
ROTOR = kr.Body(1, (1, 1.2, 0.7), (0.1, 0, 0.3), unphysical=True, rotor=(0.1, 0.2, 0.5))
TURNED = kr.Body(1, ((1.1, 0.1, 0), (0.1, 1.1, 0), (0, 0, 0.7)), (0.1, 0.1, 0.3), unphysical=True)
PERMUTED = kr.Body(1, (0.5, 1, 1), (1, 0, 0), unphysical=True)
RESTS = {
    "symmetric": (LAGRANGE, 1e3, {}),
    "faster": (LAGRANGE, 1e9, {}),
    "spherical": (SPHERICAL, 1e9, {}),
    "general": (ASIDE, 1e3, {}),
    "turned": (TURNED, 1e4, {}),
    "permuted": (PERMUTED, 1e4, {}),
    "unequal": (ASIDE, (1e3, 2e3, 4e4), {}),
    "rotor": (ROTOR, 1e3, {}),
    "upward": (LAGRANGE, 1e9, {"gravity": -1.0}),
    "friction": (LAGRANGE, 1e9, {"friction": 0.01}),
    "held": (LAGRANGE, 1e3, {"friction": 1.0}),
    "turning": (SPHERICAL, 1e6, {"turning": (0, 0, 1e-7)}),
    "shaking": (ASIDE, 1e6, {"shaking": (1e5, 1e-6, 0.2)}),
}


@pytest.mark.parametrize("digits", [None, 20, 30])
@pytest.mark.parametrize("name", RESTS)
def test_a_top_comes_to_rest(name, digits):
    body, damping, words = RESTS[name]
    attitude = (math.cos(0.25), math.sin(0.25), 0, 0)
    words = {"attitude": attitude, "gravity": 1, "damping": damping, **words}
    top = kr.Scene(body, momentum=(0.1, 0.2, 0.3), **words)
    t = 300 * np.max(damping)
    path = kr.solve(top, [0.01 * t, 0.5 * t, t], digits=digits, max_steps=1500)
    com = np.array(body.com) / np.linalg.norm(body.com)
    up = [kr.quaternion.turn_back(q, (0, 0, 1)) for q in path.q[1:]]
    assert np.abs(np.array(up) + math.copysign(1.0, top.gravity) * com).max() < 3e-15
    again = top.replace(attitude=path.q[1], momentum=path.m[1])
    assert kr.attitude_error(kr.solve(again, [t], max_steps=1500).q[0], path.q[1]) < 1e-8


@pytest.mark.parametrize("damping", [1e6, 1e9])
@pytest.mark.parametrize("digits", [None, 20, 30])
def test_the_last_approach_to_rest(damping, digits):
    attitude = (math.cos(0.25), math.sin(0.25), 0, 0)
    top = kr.Scene(LAGRANGE, momentum=(0, 0, 0), attitude=attitude, damping=damping, gravity=1)
    times = np.array([5.0, 10.0, 20.0, 30.0, 100.0]) * damping
    path = kr.solve(top, times, digits=digits, max_steps=200)
    tilts = 2 * np.arctan(np.exp(-(times - 1 / damping) / damping) / math.tan(0.25))
    assert np.abs(path.q[:, 0] - np.sin(tilts / 2)).max() < 1e-13
    assert np.abs(path.m[:, 0] * damping - np.sin(tilts)).max() < 2e-13
    others = kr.solve(kr.Ensemble.of([top, top]), times, digits=digits, max_steps=200)
    assert np.array_equal(others[1].states, path.states)


def test_a_nearly_upright_top_with_spin_falls_at_the_right_time():
    body = kr.Body(1, (1, 1.2, 0.7), (0, 0, 1), unphysical=True)
    top = kr.Scene(body, momentum=(1e-25, 1e-28, 1e-3), damping=1e3, gravity=1)
    times = [6e4, 6.2e4, 1e5, 1e6]
    path, truth = (kr.solve(top, times, digits=n, max_steps=400) for n in (None, 30))
    assert 0.01 < path.nutation[0] < path.nutation[1] < 1.0
    assert kr.attitude_error(path.q, truth.q).max() < 1e-12
