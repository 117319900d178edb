"""Tests of damped tops against an independent integrator."""

import math
import pickle
import warnings

import kreisel as kr
import numpy as np
import pytest
from kreisel._model import environment

GENERAL = kr.Body(
    2.0,
    [[3, -0.25, 0.5], [-0.25, 2.5, 0.125], [0.5, 0.125, 1.5]],
    (0.25, -0.5, 0.75),
    unphysical=True,
)
HEAVY = kr.Scene(
    GENERAL,
    momentum=(0.5, 2.0, -1.0),
    attitude=(0.6, 0, 0.8, 0),
    gravity=1.5,
    damping=(0.1, 0.4, 0.2),
)
TIMES = [0.5, 2.0, 7.0]


def rates(t, y):
    """Return the time derivatives of the attitude and of the angular velocity."""
    q, w = y[:4], y[4:]
    x = kr.quaternion
    inertia, com = np.array(GENERAL.inertia), np.array(GENERAL.com)
    axes = np.array([x.turn(GENERAL.axes, e) for e in np.eye(3)])
    drag = axes.T @ np.diag(HEAVY.damping) @ axes
    up = np.array(x.turn_back(tuple(q), (0, 0, 1)))
    torque = GENERAL.mass * HEAVY.gravity * np.cross(up, com) - drag @ w
    turning = np.array(x.multiply(tuple(q), (0, *w))) / 2.0
    return [*turning, *np.linalg.solve(inertia, torque - np.cross(w, inertia @ w))]


@pytest.mark.parametrize("digits", [None, 16, 20, 30])
def test_paths_agree_with_scipy(digits):
    integrate = pytest.importorskip("scipy.integrate")
    path = kr.solve(HEAVY, TIMES, digits=digits)
    at_start = np.linalg.solve(
        np.array(GENERAL.inertia), kr.quaternion.turn_back(HEAVY.attitude, HEAVY.momentum)
    )
    truth = integrate.solve_ivp(
        rates, (0, 7), [*HEAVY.attitude, *at_start], "DOP853", TIMES, rtol=1e-13, atol=1e-13
    )
    assert kr.attitude_error(path.q, truth.y[:4].T).max() < 1e-10
    assert np.abs(path.body_velocity - truth.y[4:].T).max() < 1e-10


@pytest.mark.parametrize("digits, tolerance", [(20, 1e-18), (30, 1e-27)])
def test_digits_of_a_decaying_spin(digits, tolerance):
    """Check the momentum about a principal axis against its exact exponential decay."""
    mp = pytest.importorskip("mpmath")
    with mp.workdps(40):
        scene = kr.Scene(
            kr.Body(1, (1, 1.5, 2), (0, 0, 0)), momentum=(0, 0, 3), damping=(1, 2, 0.7)
        )
        path = kr.solve(scene, [5.0], digits=digits)
        expected = 3 * mp.exp(-mp.mpf(0.7) * 5 / 2)
        momentum = mp.mpf(path.m[0, 2]) + mp.mpf(path.m_low[0, 2])
        assert abs(momentum - expected) < tolerance
        assert path.error < 30 * tolerance


def test_zero_damping_equals_no_damping():
    for scene in (kr.scenes.thesis, kr.scenes.asymmetric):
        zero = scene.replace(damping=0.0)
        assert zero == scene and hash(zero) == hash(scene)
        assert np.array_equal(kr.solve(zero, TIMES).states, kr.solve(scene, TIMES).states)
    assert "damping" not in kr.scenes.thesis.to_toml()
    assert kr.scenes.thesis.damping == (0.0, 0.0, 0.0)


def test_damping_may_be_one_or_three_numbers():
    body = kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True)
    one = kr.Scene(body, (0, 0, 3), damping=0.25, gravity=1)
    assert one.damping == (0.25, 0.25, 0.25)
    three = kr.Scene(body, velocity=(0, 0, 6), damping=np.array([0.25, 0.25, 0.5]), gravity=1)
    assert three.damping == (0.25, 0.25, 0.5) and three != one
    assert three.replace(momentum=(1, 0, 0)).damping == three.damping
    assert kr.Scene(body, (0, 0, 3), attitude_xyzw=(0, 0, 0, 1), damping=0.25, gravity=1) == one
    assert pickle.loads(pickle.dumps(three)) == three


def test_damping_survives_toml(tmp_path):
    file = tmp_path / "damped.toml"
    HEAVY.to_toml(file)
    again = kr.Scene.from_toml(file)
    assert again == HEAVY and again.damping == HEAVY.damping


@pytest.mark.parametrize("bad", [-0.1, (0, 0, -1e-300), math.nan, (1, 2, math.inf)])
def test_invalid_damping_values_are_refused(bad):
    with pytest.raises(ValueError, match="damping"):
        HEAVY.replace(damping=bad)


@pytest.mark.parametrize("bad", ["0.1", (1, 2), (1, 2, 3, 4), [[1, 2, 3]], True, 1j])
def test_invalid_damping_types_are_refused(bad):
    with pytest.raises((TypeError, ValueError), match="damping"):
        HEAVY.replace(damping=bad)


def test_methods_without_damping_are_refused():
    damped = kr.scenes.thesis.replace(damping=0.1)
    assert kr.solve(damped, 1.0).method == "taylor"
    for name, method in kr.methods.items():
        assert method.suits(damped) == method.damped == (name == "taylor")
        if not method.damped:
            with pytest.raises(ValueError, match=r"damp.* these apply: taylor"):
                kr.solve(damped, 1.0, name, **({} if method.adaptive else {"step": 0.01}))
    with pytest.raises(ValueError, match=r"closed form .* damping"):
        kr.exact(damped)
    with pytest.raises(ValueError, match="damp"):
        kr.exact(damped, map="bobenko_suris", step=0.01)
    with pytest.raises(ValueError, match="damp"):
        kr.solve(damped, 1.0, "geometric", error=1e-6)
    assert "damping" in str(kr.plan(damped))


def test_rods_of_damped_tops_are_refused():
    path = kr.solve(kr.scenes.thesis.replace(damping=0.1), TIMES)
    with pytest.raises(ValueError, match="damped"):
        kr.rod(path)
    assert math.isnan(path.energy_error)


def test_streams_runs_and_events_agree_with_solve():
    path = kr.solve(HEAVY, TIMES)
    assert path.error < 1e-12
    run = kr.start(HEAVY)
    run.to(0.5)
    run_copy = kr.resume(run.checkpoint)
    assert np.array_equal(run_copy.to(TIMES[1:]).states, path.states[1:])
    pieces = list(kr.stream(HEAVY, TIMES, chunk=1))
    assert np.array_equal(np.concatenate([piece.q for piece in pieces]), path.q)
    quantities = kr.solve(HEAVY, TIMES, want=("nutation", "kinetic"))
    assert np.abs(quantities.nutation - path.nutation).max() < 1e-13
    assert np.abs(kr.solve(path.end, [1.0]).q - kr.solve(HEAVY, [8.0]).q).max() < 1e-12
    still = kr.solve(HEAVY, 40.0, events=[kr.events.kinetic(0.1)]).events
    energy = still.path.kinetic
    assert len(still) > 2 and np.allclose(energy, 0.1, atol=1e-13)
    back = kr.solve(HEAVY, [-1.0])
    assert back.energy[0] > kr.solve(HEAVY, [0.0]).energy[0]


def test_compare_and_progress():
    times = []
    kr.solve(HEAVY, 200.0, progress=times.append)
    assert times[-1] == 200.0
    table = kr.compare(HEAVY, 5.0, tols=[1e-6])
    assert {row.method for row in table} == {"taylor"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(kr.solve(HEAVY, [0.0]).q) == 1


# Boundary values


def test_damping_may_be_zero_but_not_negative():
    assert environment.validate_damping(None) == (0.0, 0.0, 0.0) and environment.validate_damping(
        0
    ) == (
        0.0,
        0.0,
        0.0,
    )
    assert environment.validate_damping(np.float64(0.5)) == (0.5, 0.5, 0.5)
    assert tuple(environment.validate_damping((0.0, 0.1, 0.2))) == (0.0, 0.1, 0.2)
    for wrong in (-0.1, (0.1, -1e-300, 0.0)):
        with pytest.raises(ValueError, match="damping must not be negative"):
            environment.validate_damping(wrong)
