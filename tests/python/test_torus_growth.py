"""Tests of chaos indicators against closed forms for integrable tops."""

import math

import kreisel as kr
import numpy as np
import pytest

BODIES = {
    ratio: kr.Body(1.0, (ratio, ratio, 1.0), (1.0, 0.0, 0.0), unphysical=True)
    for ratio in (2.0, 4.0)
}
ATTITUDE = (0.8, 0.4, -0.2, 0.4)
SCENES = [
    kr.Scene(BODIES[2.0], (0.3, 1.1, 0.8), ATTITUDE, gravity=1),
    kr.Scene(BODIES[2.0], (-1.2, 2.0, -1.5), ATTITUDE, gravity=-2.0),
    kr.Scene(BODIES[4.0], (0.9, 2.1, 0.0), ATTITUDE, gravity=1),
]
CHANGE = np.array((0.6, -0.8, 0.0))  # of the momentum; <m, e3> stays the same


def neighbour(scene, size):
    return kr.exact(scene.replace(momentum=np.array(scene.momentum) + size * CHANGE))


def tangent(scene, t):
    """Return a path, and the directional derivatives of its states along `CHANGE`."""
    path = kr.solve(scene, t, method="taylor", tangents="start")
    change = path.tangents @ np.concatenate([np.zeros(3), CHANGE])
    return path, change[:, :3], change[:, 3:]


@pytest.mark.parametrize("scene", SCENES)
def test_tangents_agree_with_differences_of_closed_forms(scene):
    t, size = [-10.0, -200.0], 1e-6
    _, _, momentum = tangent(scene, t)
    ahead, back = neighbour(scene, size)(t), neighbour(scene, -size)(t)
    differences = (ahead.m - back.m) / (2.0 * size)
    assert np.abs(momentum - differences).max() < 1e-6 * np.abs(momentum).max()


@pytest.mark.parametrize("scene", SCENES)
def test_tangents_grow_at_the_rate_of_frequency_differences(scene):
    """Compare the growth of tangents with the exact derivatives of the frequencies.

    In the body frame, the momentum M is a function of angle variables chi, which grow at constant
    rates w. If the rates of the angle variables change by dw, the momentum at the time t changes by
    t sum(dw dM/dchi), up to a bounded term.
    """
    size, n = 1e-5, 64
    ahead, back = neighbour(scene, size), neighbour(scene, -size)
    shear = np.subtract(ahead.frequencies, back.frequencies)[:2] / (2.0 * size)
    turns = np.stack(np.meshgrid(*2 * [np.arange(n) / n], indexing="ij"), axis=-1)
    states = kr.exact(scene)._compute_states_at_angles(turns.reshape(-1, 2))
    q, m = tuple(states[:, 1:5].T), tuple(states[:, 5:8].T)
    waves = np.fft.fft2(np.array(kr.quaternion.turn_back(q, m)).reshape(3, n, n)) / n**2
    order = np.fft.fftfreq(n, 1.0 / n)
    growth = shear[0] * order[:, None] + shear[1] * order
    expected = float((np.abs(growth * waves) ** 2).sum())

    t = np.linspace(3000.0, 4000.0, 4001)
    path, rotation, momentum = tangent(scene, t)
    changes = np.array(kr.quaternion.turn_back(tuple(path.q.T), tuple(momentum.T))).T
    changes -= np.cross(rotation, path.body_momentum)
    square = (changes**2).sum(axis=1) / t**2
    window = np.kaiser(len(t), 4.0 * math.pi)
    assert float(window @ square / window.sum()) == pytest.approx(expected, rel=1e-2)


@pytest.mark.parametrize("scene", SCENES)
def test_indicators_of_integrable_tops_show_linear_growth(scene):
    t = np.array((2000.0, 20000.0))
    assert np.abs(kr.megno(scene, t).curve - 2.0).max() < 0.2
    exponents = kr.lyapunov(scene, t).curve
    assert (np.abs(exponents / (np.log(t) / t) - 1.0) < 0.35).all()
