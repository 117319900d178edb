"""Tests of damped tops against closed-form solutions, and of strong damping."""

import itertools
import math

import kreisel as kr
import mpmath as mp
import numpy as np
import pytest

DAMPING = (0.1, 0.25, 0.4)
TILTED = (math.cos(0.25), math.sin(0.25), 0, 0)  # by 0.5 rad
LAGRANGE = kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True)
GENERAL = kr.Body(1, (1, 1.2, 1.7), (0.1, 0.2, 1), unphysical=True)
ASIDE = kr.Body(1, (1, 1.2, 0.7), (0.1, 0, 0.3), unphysical=True)
TENSOR = kr.Body(1, ((1.1, 0.1, 0), (0.1, 1.1, 0), (0, 0, 0.7)), (0.1, 0.1, 0.3), unphysical=True)
BALL = kr.Body(1, (1, 1, 1), (0, 0, 1), unphysical=True)
START = {"momentum": (0.3, 0.4, 1.0), "attitude": (0.8, 0.6, 0, 0), "gravity": 1}
BOTH = {"turning": (0.1, 0.2, 0.3), "shaking": (0.1, 3.0, 0.2)}


def release(body, damping, **words):
    """Return a tilted top that is released from rest relative to its support."""
    words = {"attitude": TILTED, "gravity": 1, "damping": damping, **words}
    return kr.Scene(body, body_velocity=(0, 0, 0), **words)


def creep(angle, t, damping):
    """Return the nutation of an overdamped top in a vertical plane, up to O(1 / damping^2)."""
    return 2.0 * np.arctan(np.tan(angle / 2) * np.exp((t - 1 / damping) / damping))


@pytest.mark.parametrize("t", [5.0, -2.0])
@pytest.mark.parametrize("digits", [None, 20, 30])
def test_a_spin_about_each_principal_axis_decays_at_its_own_rate(t, digits):
    with mp.workdps(40):
        for moments in [*itertools.permutations((1.0, 1.5, 2.0)), (1.2, 1.2, 1.2)]:
            for (com, gravity), axis in itertools.product(
                (((0, 0, 0), 1.0), ((0.2, 0.3, 0.4), 0.0)), range(3)
            ):
                body, momentum = kr.Body(1, moments, com, unphysical=True), 3.0 * np.eye(3)[axis]
                scene = kr.Scene(body, momentum=momentum, gravity=gravity, damping=DAMPING)
                path = kr.solve(scene, [t], digits=digits)
                true = 3 * mp.exp(-mp.mpf(DAMPING[axis]) / mp.mpf(moments[axis]) * t)
                miss = abs(mp.mpf(path.m[0, axis]) + mp.mpf(path.m_low[0, axis]) - true)
                assert miss < {None: 1e-15, 20: 1e-18, 30: 1e-27}[digits] * max(1, true)


def test_equal_coefficients_may_be_one_number_and_zero_damping_is_none():
    for body in (GENERAL, TENSOR, BALL, LAGRANGE):
        one, three = (kr.Scene(body, **START, damping=d) for d in (0.25, (0.25, 0.25, 0.25)))
        assert one == three and one.damping == (0.25, 0.25, 0.25)
        for digits in (None, 20):
            paths = [kr.solve(scene, [1.0, 4.0], digits=digits).states for scene in (one, three)]
            assert paths[0].tobytes() == paths[1].tobytes()
        zero, none = kr.Scene(body, **START, damping=0.0), kr.Scene(body, **START)
        assert zero == none and hash(zero) == hash(none) and zero.damping == (0, 0, 0)
        assert np.array_equal(kr.solve(zero, [3.0]).states, kr.solve(none, [3.0]).states)


def test_damping_takes_energy_forward_and_gives_it_backward():
    scene = kr.Scene(GENERAL, **START, damping=DAMPING)
    path, back = kr.solve(scene, np.linspace(0, 40, 200)), kr.solve(scene, np.linspace(0, -1, 9))
    assert np.all(np.diff(path.energy) < 0) and np.all(np.diff(back.energy) > 0)
    assert math.isnan(path.energy_error)
    still = kr.solve(scene, 40.0, events=[kr.events.kinetic(0.1)]).events
    assert len(still) > 2 and np.allclose(still.path.kinetic, 0.1, atol=1e-13)


def test_only_taylor_applies_to_damped_tops():
    damped = kr.scenes.thesis.replace(damping=0.1)
    assert kr.solve(damped, 1.0).method == kr.plan(damped).method == "taylor"
    for name, method in kr.methods.items():
        assert method.suits(damped) == method.damped == (name == "taylor")
        if not method.damped:
            with pytest.raises(ValueError, match="damp"):
                kr.solve(damped, 1.0, name, **({} if method.adaptive else {"step": 0.01}))
    assert {row.method for row in kr.compare(damped, 5.0, tols=[1e-6])} == {"taylor"}


@pytest.mark.parametrize("damping", [1e6, 1e9, 1e15])
def test_a_top_creeps_at_the_rate_of_the_slow_motion(damping):
    times = np.array([0.1, 1.0, 3.0]) * damping
    path = kr.solve(release(LAGRANGE, damping), times, max_steps=100)
    assert np.abs(path.nutation - creep(0.5, times, damping)).max() < 1e-11
    assert path.error < 1e-14


@pytest.mark.parametrize("damping", [1e6, 1e9])
@pytest.mark.parametrize("digits", [None, 20, 30])
def test_the_last_approach_to_rest(damping, digits):
    times = np.array([5.0, 10.0, 20.0, 30.0, 100.0]) * damping
    path = kr.solve(release(LAGRANGE, damping), times, digits=digits, max_steps=200)
    tilts = np.pi - creep(0.5, times, damping)
    assert np.abs(path.q[:, 0] - np.sin(tilts / 2)).max() < 1e-13
    assert np.abs(path.m[:, 0] * damping - np.sin(tilts)).max() < 2e-13


@pytest.mark.parametrize("damping", [1e4, 1e9])
def test_a_free_body_comes_to_rest_and_stays(damping):
    top = kr.Scene(kr.Body(1, (1, 1, 1), (0, 0, 0)), velocity=(0, 0, 3), damping=damping, gravity=1)
    times = np.array([1.0, 20.0, 200.0, 1e3, 1e9]) / damping
    path, decay = kr.solve(top, times, max_steps=300), np.exp(-damping * times)
    assert np.allclose(path.m[:, 2], 3 * decay, rtol=1e-8, atol=1e-100)
    angles = 2 * np.arctan2(path.q[:, 3], path.q[:, 0])
    assert np.abs(angles - 3 / damping * (1 - decay)).max() < 1e-16


def test_a_free_body_with_unequal_damping_comes_to_rest_in_few_steps():
    body = kr.Body(1, (1.6, 0.25, 1.8), (0, 0, 0))
    top = kr.Scene(body, velocity=(4, -20, -4), damping=(1e9, 100, 70), gravity=1)
    path, truth = (kr.solve(top, [0.1, 400.0], digits=n, max_steps=400) for n in (None, 30))
    assert kr.attitude_error(path.q, truth.q).max() < 1e-14


@pytest.mark.parametrize("velocity", [(0.5, 0.2, 3), (0.5, 0.2, 0), (0, 0, 3), (0, 0, 1e-100)])
@pytest.mark.parametrize("damping", [1e3, 1e5, 1e9])
def test_a_symmetric_top_reaches_the_slow_motion_with_any_spin(damping, velocity):
    words = {"attitude": TILTED, "damping": damping, "gravity": 1}
    top = kr.Scene(LAGRANGE, body_velocity=velocity, **words)
    truth = kr.solve(top, [20 / damping], digits=30)
    assert kr.attitude_error(kr.solve(top, [20 / damping]).q, truth.q).max() < 1e-15
    for settings in ({}, {"tol": 1e-9}, {"digits": 20}):
        path = kr.solve(top, [1.0, 3 * damping], max_steps=800, **settings)
        assert path.nutation[0] == pytest.approx(0.5, abs=20 / damping)
        assert abs(path.nutation[1] - creep(0.5, 3 * damping, damping)) < 16 / damping


RESTS = {
    "symmetric": (LAGRANGE, 1e9, {}),
    "spherical": (BALL, 1e9, {}),
    "general": (ASIDE, 1e3, {}),
    "tensor": (TENSOR, 1e4, {}),
    "about the first axis": (kr.Body(1, (0.5, 1, 1), (1, 0, 0), unphysical=True), 1e4, {}),
    "unequal": (ASIDE, (1e3, 2e3, 4e4), {}),
    "rotor": (ASIDE.with_rotor(spin=1, inertia=0.5, axis=(1, 2, 5)), 1e3, {}),
    "upward": (LAGRANGE, 1e9, {"gravity": -1.0}),
    "friction": (LAGRANGE, 1e9, {"friction": 0.01}),
    "held": (LAGRANGE, 1e3, {"friction": 1.0}),
    "turning": (BALL, 1e6, {"turning": (0, 0, 1e-7)}),
    "shaking": (ASIDE, 1e6, {"shaking": (1e5, 1e-6, 0.2)}),
}


@pytest.mark.parametrize("digits", [None, 30])
@pytest.mark.parametrize("name", RESTS)
def test_a_top_comes_to_rest(name, digits):
    body, damping, words = RESTS[name]
    words = {"attitude": TILTED, "gravity": 1, "damping": damping, **words}
    top, t = kr.Scene(body, momentum=(0.1, 0.2, 0.3), **words), 300 * np.max(damping)
    path = kr.solve(top, [0.01 * t, 0.5 * t, t], digits=digits, max_steps=1500)
    assert np.abs(path.apex[1:, 2] + math.copysign(1.0, top.gravity)).max() < 6e-15
    again = top.replace(attitude=path.q[1], momentum=path.m[1])
    assert kr.attitude_error(kr.solve(again, [t], max_steps=1500).q[0], path.q[1]) < 1e-8


def test_a_nearly_upright_top_with_spin_falls_at_the_right_time():
    body = kr.Body(1, (1, 1.2, 0.7), (0, 0, 1), unphysical=True)
    top = kr.Scene(body, momentum=(1e-25, 1e-28, 1e-3), damping=1e3, gravity=1)
    times = [6e4, 6.2e4, 1e5, 1e6]
    path, truth = (kr.solve(top, times, digits=n, max_steps=400) for n in (None, 30))
    assert 0.01 < path.nutation[0] < path.nutation[1] < 1.0
    assert kr.attitude_error(path.q, truth.q).max() < 1e-12


def test_a_rotor_along_the_axis_slows_the_fall():
    damping = rotor = 1e6
    body = kr.Body(1, (1, 1, 1), (0, 0, 1), unphysical=True, rotor=(0, 0, rotor))
    path = kr.solve(release(body, damping), [0.0, 1e6], max_steps=100)
    # In the slow motion D w = h x w + P x c, so that the apex falls as if D were D + h^2 / D.
    fall = np.exp(1e6 / (damping + rotor**2 / damping))
    nutation = 2 * np.arctan(np.tan(path.nutation[0] / 2) * fall)
    assert path.nutation[1] == pytest.approx(nutation, abs=1e-9)


@pytest.mark.parametrize("changes", [{}, BOTH, {"friction": 0.1}, {"gravity": 0.0}])
def test_a_top_that_damping_drives_too_far_backward_is_refused(changes):
    body = kr.Body(1, (1, 1.2, 1.7), (0.1, 0.2, 1), unphysical=True, rotor=(0.3, -0.4, 0.8))
    top = kr.Scene(body, **START | changes, damping=1e5)
    with pytest.raises(ValueError, match="turns"):
        kr.solve(top, -1.0, max_steps=1000)
    path = kr.solve(top, [-1e-5], max_steps=100)
    back = kr.solve(path.end, [1e-5], max_steps=100)
    assert kr.attitude_error(back.q[0], top.attitude) < 1e-13


def test_backward_a_top_from_rest_fails_soon_but_an_equilibrium_stays():
    falling = kr.Scene(GENERAL, **START | {"momentum": (0, 0, 0)}, damping=1e5)
    with pytest.raises(kr.Error, match="finite"):
        kr.solve(falling, -1.0, max_steps=1000)
    hanging = kr.Body(1, (1, 1.2, 1.7), (0, 0, -1), unphysical=True)
    top = kr.Scene(hanging, velocity=(0, 0, 0), gravity=1, damping=1e5)
    path = kr.solve(top, [-1.0], max_steps=40000)
    assert np.array_equal(path.q[0], (1, 0, 0, 0)) and not path.m.any()


@pytest.mark.parametrize("body", [LAGRANGE, GENERAL])
def test_events_of_the_slow_motion_are_found(body):
    damping, level = 1e8, kr.events.plane((0, 0, 1), of="apex")
    top = release(body, damping)
    found = kr.solve(top, 5 * damping, events=[level]).events
    assert len(found) == 1 and abs(kr.solve(top, found.t).apex[0, 2]) < 1e-13
    assert kr.section(top, level, n=1, max_wait=5 * damping).t[0] == pytest.approx(found.t[0])
    if body is LAGRANGE:
        expected = damping * math.log(1 / math.tan(0.25)) + 1 / damping
        assert found.t[0] == pytest.approx(expected, rel=1e-13)


def test_tangents_of_a_strongly_damped_top_agree_with_differences():
    top, t, h = kr.Scene(GENERAL, **START, damping=1e3), 0.5, 2.0**-12
    path = kr.solve(top, [t], tangents="gravity")
    ends = [kr.solve(top.replace(gravity=1.0 + s * h), [t], digits=30) for s in (1, -1)]
    push = (ends[0].m[0] - ends[1].m[0] + ends[0].m_low[0] - ends[1].m_low[0]) / (2 * h)
    assert np.allclose(path.tangents[0, 3:, 0], push, rtol=1e-6)


@pytest.mark.parametrize(
    "bad", [-0.1, (0, 0, -1e-300), math.nan, (1, 2, math.inf), "0.1", (1, 2), True, 1j]
)
def test_bad_damping_is_refused(bad):
    with pytest.raises((TypeError, ValueError), match="damping"):
        kr.Scene(GENERAL, **START, damping=bad)
