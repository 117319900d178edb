"""Tests of tangents of tops with dry friction against finite differences."""

import kreisel as kr
import numpy as np
import pytest
from moving_tops import make_scene

STEP = 1e-8
LAGRANGE = kr.Body(1.2, (1.3, 1.3, 1.7), (0, 0, 0.4), unphysical=True)
MOVED = {"damping": (0.1, 0.2, 0.3), "turning": (0.3, -0.2, 0.5), "shaking": (0.1, 5.0, 0.3)}
BODY = kr.Body(1.2, (1.3, 1.7, 2.1), (0.1, -0.2, 0.4))


def quotient(change, t):
    """Return the derivatives of attitude and momentum at time `t` by central differences."""
    ahead, behind = (kr.solve(change(e), [t], "taylor", digits=30) for e in (STEP, -STEP))
    q = ((ahead.q - behind.q) + (ahead.q_low - behind.q_low))[-1] / (2 * STEP)
    m = ((ahead.m - behind.m) + (ahead.m_low - behind.m_low))[-1] / (2 * STEP)
    back = 0.5 * (ahead.q[-1] + behind.q[-1]) * (1, -1, -1, -1)
    return np.append(2 * np.array(kr.quaternion.multiply(back, q))[1:], m)


def changes_of(scene):
    """Return functions that change a parameter at fixed momentum, or a component of momentum."""

    def by_body(name, i):
        words = {"moments": scene.body.moments, "com": scene.body.com}

        def change(e):
            new = words | {name: np.array(words[name]) + e * np.eye(3)[i]}
            body = kr.Body(scene.body.mass, new["moments"], new["com"])
            return scene.replace(body=body, momentum=scene.momentum)

        return change

    def by_vector(name, i):
        def change(e):
            changes = {name: np.array(getattr(scene, name)) + e * np.eye(3)[i]}
            return scene.replace(**{"momentum": scene.momentum, **changes})

        return change

    vectors = ["momentum", *(name for name in MOVED if np.all(getattr(scene, name)))]
    return {
        ("friction", 0): lambda e: scene.replace(friction=scene.friction + e),
        ("gravity", 0): lambda e: scene.replace(gravity=scene.gravity + e),
        **{(name, i): by_body(name, i) for name in ("moments", "com") for i in range(3)},
        **{(name, i): by_vector(name, i) for name in vectors for i in range(3)},
    }


def check_tangents(scene, t, **options):
    changes = changes_of(scene)
    for (name, i), change in changes.items():
        key = "start" if name == "momentum" else name
        path = kr.solve(scene, [t], "taylor", tangents=key, **options)
        own = path.tangents[-1][:, i + 3 * (key == "start")]
        truth = quotient(change, t)
        assert np.abs(own - truth).max() < 1e-7 * (1 + np.abs(truth).max()), (name, i)


@pytest.mark.parametrize("friction", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("words", [{}, MOVED], ids=["rest", "moved"])
def test_tangents_agree_with_differences(friction, words):
    scene = kr.Scene(BODY, gravity=1.3, body_velocity=(0.4, 0.3, 1.0), friction=friction, **words)
    for t in (0.5, 4.0):
        check_tangents(scene, t)


def test_tangents_backward_and_with_digits():
    scene = kr.Scene(BODY, gravity=1.3, body_velocity=(0.4, 0.3, 1.0), friction=0.3, **MOVED)
    check_tangents(scene, -0.5)
    names = ("start", "moments", "com", "friction", "shaking")
    few, many = (
        kr.solve(scene, [4.0], "taylor", tangents=names, digits=digits) for digits in (20, 30)
    )
    gap = (few.tangents - many.tangents) + (few.tangents_low - many.tangents_low)
    assert np.abs(gap).max() < 1e-17 * np.abs(many.tangents).max()
    single = kr.solve(scene, [4.0], "taylor", tangents=names).tangents
    assert np.abs(single - many.tangents).max() < 1e-12 * np.abs(many.tangents).max()


def test_the_spin_of_a_symmetric_top_in_closed_form():
    top = kr.Scene.spinning(LAGRANGE, spin=-2.0, tilt=0.7, gravity=1.3, friction=0.1)
    stop = 1.7 * 2.0 / 0.1
    path = kr.solve(top, [0.5 * stop, 1.5 * stop], tangents=("start", "friction"))
    slope = path.derivative("spin")[:, -1]
    assert slope == pytest.approx([0.5 * stop / 1.7, 0.0], abs=1e-10)
    assert np.abs(path.derivative("spin")[1]).max() < 1e-10


@pytest.mark.parametrize("digits", [16, 30])
def test_friction_at_rest_keeps_the_spin_tangent_at_zero(digits):
    top = kr.Scene(
        LAGRANGE, gravity=1.3, attitude=(0.6, 0.8, 0.0, 0.0), momentum=(0, 0, 0), friction=0.2
    )
    names = ("start", "gravity", "turning")
    path = kr.solve(top, [0.0, 3.0], "taylor", tangents=names, digits=digits)
    assert np.abs(path.derivative("spin")).max() < 1e-13


def test_a_start_that_friction_cannot_hold_has_no_tangents():
    top = kr.Scene(BODY, gravity=1.3, body_velocity=(2.0, 1.0, 0.0), friction=1e-3)
    top = top.replace(body_velocity=np.cross(BODY.com, (1.0, -2.0, 0.3)) * 9)
    with pytest.raises(kr.Error, match="tangent"):
        kr.solve(top, [0.0, 1.0], tangents="start")
    assert np.isfinite(kr.solve(top, [0.0, 1.0], tangents="gravity").tangents).all()


def test_conditioning_needs_tangents_by_the_friction():
    scene = make_scene("general", friction=0.05)
    with pytest.raises(AttributeError, match="all parameters that are not 0"):
        _ = kr.solve(scene, [1.0], tangents="start").conditioning
    hint = ("start", "moments", "com", "gravity", "mass", "rotor", "friction")
    path = kr.solve(scene, [1.0], tangents=hint)
    assert 0 < path.conditioning[-1] < 1e-13


def test_the_error_of_paths_across_a_stop():
    scene = kr.Scene(BODY, gravity=1.3, body_velocity=(0.4, 0.3, 1.0), friction=1.0)
    paths = [kr.solve(scene, [4.0], "taylor", digits=digits) for digits in (20, 30)]
    gap = (paths[0].q[-1] - paths[1].q[-1]) + (paths[0].q_low[-1] - paths[1].q_low[-1])
    assert np.abs(gap).max() < 10 * paths[0].error and 0 < paths[1].error < 1e-28


def test_tops_of_an_ensemble_have_the_tangents_of_single_tops():
    scene = kr.Scene(BODY, gravity=1.3, body_velocity=(0.4, 0.3, 1.0), friction=1.0)
    tops = scene.vary(friction=[0.1, 1.0])
    paths = kr.solve(tops, [0.0, 4.0], tangents=("start", "friction"))
    for i in range(2):
        single = kr.solve(tops[i], [0.0, 4.0], tangents=("start", "friction"))
        assert np.array_equal(paths[i].tangents, single.tangents)
