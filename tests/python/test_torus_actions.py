"""Tests of the action variables of Kowalewski and Goryachev-Chaplygin tops."""

import math

import kreisel as kr
import numpy as np
import pytest
from kreisel import quaternion
from kreisel._solve.torus_actions import compute_torus_action
from tops import unit

KOWALEWSKI, CHAPLYGIN = 2.0, 4.0  # ratios of the moments
STEP = 1e-4  # of differences


def make_scene(ratio, momentum, attitude, gravity=1.0):
    body = kr.Body(1.0, (ratio, ratio, 1.0), (1.0, 0.0, 0.0), unphysical=True)
    return kr.Scene(body, momentum, unit(attitude), gravity=gravity)


SCENES = [
    make_scene(KOWALEWSKI, (0.3, 1.1, 0.8), (0.8, 0.4, -0.2, 0.4)),
    make_scene(KOWALEWSKI, (2.0, -0.4, -1.5), (0.3, 0.1, 0.7, -0.5), -2.0),
    make_scene(CHAPLYGIN, (0.9, 2.1, 0.0), (0.8, 0.4, -0.2, 0.4)),
    make_scene(CHAPLYGIN, (2.0, 4.0, 0.0), (0.1, -0.6, 0.3, 0.7), 0.5),
]


def energy(scene):
    return float(kr.exact(scene)(0.0).energy[0])


def slope(function, scene, change):
    """Differentiate a function of the initial state by fourth-order central differences."""

    def at(factor):
        h = STEP * factor
        momentum = np.array(scene.momentum) + h * np.array(change[:3])
        attitude = unit(np.array(scene.attitude) + h * np.array(change[3:]))
        return np.array(function(scene.replace(momentum=momentum, attitude=attitude)))

    return (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * STEP)


@pytest.mark.parametrize("scene", SCENES)
def test_frequencies_are_derivatives_of_the_energy_by_the_actions(scene):
    vertical = 0.6 if scene.momentum[2] else 0.0
    for change in [(1, 0, vertical, 0, 0, 0, 0), (0.3, -0.8, 0, 0.2, -0.5, 0.7, 0.1)]:
        by_actions = slope(lambda s: kr.exact(s).actions, scene, change)
        expected = slope(energy, scene, change)
        assert abs(kr.exact(scene).frequencies @ by_actions - expected) < 1e-8


@pytest.mark.parametrize("scene", SCENES)
def test_mean_twice_the_kinetic_energy_is_the_sum_of_frequencies_times_actions(scene):
    top = kr.exact(scene)
    t = np.linspace(0.0, 500.0, 10001)
    path = kr.solve(scene, t, method="taylor")
    window = np.kaiser(len(t), 10.0 * math.pi)
    mean = float(window @ (path.m * path.velocity).sum(axis=1) / window.sum())
    assert abs(mean - np.dot(top.frequencies, top.actions)) < 1e-9 * mean


@pytest.mark.parametrize("scene", SCENES)
def test_actions_do_not_depend_on_the_state_or_the_order_of_axes(scene):
    top = kr.exact(scene)
    later = top(1234.5)
    later_scene = scene.replace(momentum=later.m[0], attitude=later.q[0])
    assert np.abs(np.subtract(kr.exact(later_scene).actions, top.actions)).max() < 1e-12
    attitude = scene.attitude
    for k in (1, 2):  # axis 1 becomes axis 2, axis 2 becomes axis 3
        attitude = quaternion.multiply(attitude, (0.5, -0.5, -0.5, -0.5))
        moments, com = np.roll(scene.body.moments, k), np.roll(scene.body.com, k)
        body = kr.Body(1.0, tuple(moments), tuple(com), unphysical=True)
        permuted_top = kr.exact(scene.replace(body=body, attitude=attitude))
        assert np.abs(np.subtract(permuted_top.actions, top.actions)).max() < 1e-12


@pytest.mark.parametrize("scene", SCENES)
def test_actions_scale_with_the_unit_of_momentum(scene):
    body = scene.body
    heavy = kr.Body(8.0, tuple(8.0 * i for i in body.moments), body.com, unphysical=True)
    scaled = scene.replace(body=heavy, momentum=8.0 * np.array(scene.momentum))
    assert kr.exact(scaled).actions == tuple(8.0 * a for a in kr.exact(scene).actions)


def test_actions_of_a_small_oscillation_are_energies_divided_by_frequencies():
    """Check that the actions of a small oscillation are its energies divided by its frequencies."""
    size = 1e-3
    third, second = 0.3 * size, 0.7 * size  # momenta about both axes
    hanging = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
    top = kr.exact(make_scene(KOWALEWSKI, (third, second, 0.0), hanging))
    slow = math.sqrt(0.5)
    assert np.allclose(top.frequencies, (1.0 - slow, slow, 0.0), atol=1e-6)
    quick_action, slow_action = third**2 / 2.0, second**2 / 4.0 / slow
    expected = quick_action, quick_action + slow_action
    assert np.allclose(top.actions[:2], expected, rtol=3e-6) and top.actions[2] == 0.0


def test_the_third_action_is_the_vertical_momentum():
    for scene in SCENES:
        assert kr.exact(scene).actions[2] == scene.momentum[2]


def test_unresolved_loops_have_no_action():
    rng = np.random.default_rng(1)
    with pytest.raises(ValueError, match="too near to a separatrix"):
        compute_torus_action(lambda turns: rng.normal(size=(len(turns), 8)), 0, False)
