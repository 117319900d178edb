"""The closed form of Kowalewski tops in Python: states, certificate, frequencies, refusals."""

import itertools

import kreisel as kr
import numpy as np
import pytest

BODY = kr.Body(1.0, (2.0, 2.0, 1.0), (1.0, 0.0, 0.0), unphysical=True)
SCENE = kr.Scene(BODY, momentum=(0.3, 1.1, 0.8), attitude=(0.8, 0.4, -0.2, 0.4))


def apart(one, other):
    near = np.minimum(
        np.linalg.norm(one.q - other.q, axis=1), np.linalg.norm(one.q + other.q, axis=1)
    )
    return float((near + np.linalg.norm(one.m - other.m, axis=1)).max())


def test_states_are_those_of_30_digits():
    top = kr.exact(SCENE)
    assert isinstance(top, kr.ExactKowalewski)
    assert top.certificate < 1e-13 and top.mismatch == 0.0
    for t in ([0.5, 7.0, 300.0], [-3.0, -200.0]):
        assert apart(top(t), kr.solve(SCENE, t, digits=30)) < 2e-14


def test_many_times_have_the_bits_of_one():
    top, t = kr.exact(SCENE), np.linspace(-1e5, 1e6, 13)
    together = top(t)
    for i, at in enumerate(t):
        alone = top(at)
        assert np.array_equal(alone.q[0], together.q[i])
        assert np.array_equal(alone.m[0], together.m[i])


def test_method_exact_takes_it_and_auto_does_not():
    t = [1.0, 20.0]
    path = kr.solve(SCENE, t, method="exact")
    assert path.method == "exact" and apart(path, kr.exact(SCENE)(t)) < 5e-15
    assert kr.solve(SCENE, t).method == "taylor"
    ensemble = kr.Ensemble.of([SCENE, SCENE.replace(momentum=(0.0, 0.0, 1.7))])
    one = kr.solve(SCENE.replace(momentum=(0.0, 0.0, 1.7)), t, method="exact")
    assert np.array_equal(kr.solve(ensemble, t, method="exact")[1].q, one.q)


def test_every_line_of_the_spectrum_is_a_sum_of_the_frequencies():
    top = kr.exact(SCENE)
    first, second, precession = top.frequencies
    t = np.linspace(0.0, 4000.0, 20001)
    lines = kr.frequencies(top(t)).lines[:4]
    whole = range(-8, 9)
    for line in lines:
        miss = min(
            abs(line - (i * first + j * second + sign * precession))
            for i, j in itertools.product(whole, whole)
            for sign in (-1, 1)
        )
        assert miss < 1e-7, line


def test_motions_without_closed_form_are_refused_by_name():
    still, level = (0.0, 0.0, 0.0), (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)
    rest = kr.Scene(BODY, momentum=still, attitude=level)
    pendulum = kr.Scene(BODY, momentum=(0.0, 2.5, 0.0))
    for scene in (rest, pendulum):
        with pytest.raises(ValueError, match="no closed form"):
            kr.exact(scene)
        with pytest.raises(ValueError, match=r"does not apply: this motion.*coincide"):
            kr.solve(scene, 1.0, method="exact")
    with pytest.raises(ValueError, match="damping"):
        kr.exact(SCENE.replace(damping=(0.1, 0.1, 0.1)))
    with pytest.raises(ValueError, match="for single scenes only"):
        kr.exact([SCENE, SCENE])


def test_a_body_that_misses_the_ratio_is_told():
    assert 0.0 < kr.exact(kr.scenes.kowalewski).mismatch < 1e-15


def test_times_beyond_the_horizon_are_refused():
    with pytest.raises(ValueError):
        kr.exact(SCENE)(1e300)
