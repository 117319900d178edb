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


def test_other_motions_are_refused_alone():
    level = (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)
    rest = kr.Scene(BODY, momentum=(0.0, 0.0, 0.0), attitude=level, gravity=1)
    rising, exact = SCENE.replace(momentum=(0.9, 2.1, 1e-3)), kr.methods["exact"]
    assert exact.applies_to(BODY) and exact.suits(SCENE) and not exact.suits(rising)
    for top, word in ((rest, "equilibrium"), (rising, "vertical")):
        for call in (lambda top=top: kr.exact(top), lambda top=top: kr.solve(top, 1.0, "exact")):
            with pytest.raises(ValueError, match=word):
                call()
    paths = kr.solve(kr.Ensemble.of([SCENE, rising]), 1.0, method="exact")
    assert paths.failed.tolist() == [1]
    assert np.array_equal(paths[0].q, kr.solve(SCENE, 1.0, method="exact").q)


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
