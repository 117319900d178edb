"""Tests of the closed-form solution for Goryachev-Chaplygin tops.

Tests for both closed forms on a torus are in test_exact_torus_forms.py.
"""

import kreisel as kr
import numpy as np
import pytest

BODY = kr.Body(1.0, (4.0, 4.0, 1.0), (1.0, 0.0, 0.0), unphysical=True)
SCENE = kr.Scene(BODY, momentum=(0.9, 2.1, 0.0), attitude=(0.8, 0.4, -0.2, 0.4), gravity=1)


def test_the_vertical_momentum_is_zero_at_any_time():
    assert not kr.exact(SCENE)(np.linspace(-1e6, 1e6, 101)).m[:, 2].any()


def test_motions_are_refused_with_their_reason():
    still, level = (0.0, 0.0, 0.0), (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)
    rest = kr.Scene(BODY, momentum=still, attitude=level, gravity=1)
    bad_scene = SCENE.replace(momentum=(0.9, 2.1, 1e-3))
    for scene, reason in ((rest, "in equilibrium"), (bad_scene, "vertical component")):
        with pytest.raises(ValueError, match=f"Goryachev-Chaplygin top has no.*{reason}"):
            kr.exact(scene)
        with pytest.raises(ValueError, match=f"does not apply: this motion.*{reason}"):
            kr.solve(scene, 1.0, method="exact")


def test_a_member_with_vertical_momentum_fails_alone():
    bad_scene = SCENE.replace(momentum=(0.9, 2.1, 1e-3))
    ensemble = kr.Ensemble.of([SCENE, bad_scene])
    paths = kr.solve(ensemble, 1.0, method="exact")
    assert paths.failed.tolist() == [1]
    assert np.array_equal(paths[0].q, kr.solve(SCENE, 1.0, method="exact").q)


def test_suits_selects_the_right_scenes():
    exact = kr.methods["exact"]
    assert exact.applies_to(BODY) and exact.suits(SCENE)
    assert not exact.suits(SCENE.replace(momentum=(0.9, 2.1, 1e-3)))


def test_newtons_method_converges_near_a_separatrix():
    """Check a solution for which the plain Newton iteration alternates between two points."""
    momentum = (-0.019903457640552673, 0.20531745824418174, 0.0)
    attitude = (0.7809338007617764, 0.4767702483489516, 0.3363007682902849, -0.2230119332331995)
    scene = kr.Scene(BODY, momentum, attitude, gravity=-2.0)
    top, t = kr.exact(scene), 7727.366551913936
    before = top(t - 1.0)
    start = scene.replace(momentum=before.m[0], attitude=before.q[0])
    truth = kr.solve(start, 1.0, method="taylor")
    assert np.abs(top(t).m[0] - truth.m[-1]).max() < 1e-11
    assert kr.attitude_error(top(t).q[0], truth.q[-1]) < 1e-11
