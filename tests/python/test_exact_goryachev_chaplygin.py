"""The closed form of Goryachev-Chaplygin tops in Python: states, frequencies, errors."""

import itertools
import pickle

import kreisel as kr
import numpy as np
import pytest

BODY = kr.Body(1.0, (4.0, 4.0, 1.0), (1.0, 0.0, 0.0), unphysical=True)
SCENE = kr.Scene(BODY, momentum=(0.9, 2.1, 0.0), attitude=(0.8, 0.4, -0.2, 0.4))


def apart(one, other):
    near = np.minimum(
        np.linalg.norm(one.q - other.q, axis=1), np.linalg.norm(one.q + other.q, axis=1)
    )
    return float((near + np.linalg.norm(one.m - other.m, axis=1)).max())


def test_states_are_those_of_30_digits():
    top = kr.exact(SCENE)
    assert isinstance(top, kr.ExactGoryachevChaplygin) and isinstance(top, kr.ExactTorus)
    assert top.certificate < 1e-13 and top.mismatch == 0.0
    for t in ([0.5, 7.0, 300.0], [-3.0, -200.0]):
        assert apart(top(t), kr.solve(SCENE, t, digits=30)) < 2e-14


@pytest.mark.parametrize("axes", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("gravity", [9.81, -2.5])
def test_any_order_of_axes_and_sign_of_gravity_is_right(axes, gravity):
    moments, com = np.array((4.0, 4.0, 1.0))[list(axes)], np.array((0.0, -0.7, 0.0))[list(axes)]
    body = kr.Body(1.0, tuple(moments), tuple(com), unphysical=True)
    scene = SCENE.replace(body=body, gravity=gravity)
    # Some tops are near a resonance: one rounding error of the start moves them by 2e-14 rad.
    assert apart(kr.exact(scene)([5.0, 40.0]), kr.solve(scene, [5.0, 40.0], digits=30)) < 2e-13


def test_many_times_have_the_bits_of_one():
    top, t = kr.exact(SCENE), np.linspace(-1e5, 1e6, 13)
    together = top(t)
    for i, at in enumerate(t):
        alone = top(at)
        assert np.array_equal(alone.q[0], together.q[i])
        assert np.array_equal(alone.m[0], together.m[i])


def test_integrals_are_constant_at_any_time():
    path = kr.exact(SCENE)(np.linspace(-1e6, 1e6, 101))
    assert np.ptp(path.energy) < 1e-13 and np.ptp(path.goryachev_chaplygin) < 1e-13
    assert not path.m[:, 2].any()


def test_method_exact_takes_it_and_auto_does_not():
    t = [1.0, 20.0]
    path = kr.solve(SCENE, t, method="exact")
    assert path.method == "exact" and apart(path, kr.exact(SCENE)(t)) < 5e-15
    assert kr.solve(SCENE, t).method == "taylor"
    other = SCENE.replace(momentum=(1.3, 0.0, 0.0))
    ensemble = kr.Ensemble.of([SCENE, other])
    one = kr.solve(other, t, method="exact")
    assert np.array_equal(kr.solve(ensemble, t, method="exact")[1].q, one.q)
    assert kr.solve(ensemble, t)[0].method == "taylor"


def test_every_line_of_the_spectrum_is_a_sum_of_the_frequencies():
    top = kr.exact(SCENE.replace(momentum=(2.0, 1.0, 0.0)))
    first, second, precession = top.frequencies
    assert precession == 0.0
    lines = kr.frequencies(top(np.linspace(0.0, 4000.0, 20001))).lines[:4]
    for line in lines:
        miss = min(
            abs(line - (i * first + j * second))
            for i, j in itertools.product(range(-10, 11), repeat=2)
        )
        assert miss < 1e-7, line


def test_motions_without_closed_form_are_refused_by_name():
    still, level = (0.0, 0.0, 0.0), (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)
    rest = kr.Scene(BODY, momentum=still, attitude=level)
    lifted = SCENE.replace(momentum=(0.9, 2.1, 1e-3))
    for scene, reason in ((rest, "integral G is near zero"), (lifted, "vertical component")):
        with pytest.raises(ValueError, match=f"Goryachev-Chaplygin top has no.*{reason}"):
            kr.exact(scene)
        with pytest.raises(ValueError, match=f"does not apply: this motion.*{reason}"):
            kr.solve(scene, 1.0, method="exact")
    with pytest.raises(ValueError, match="damping"):
        kr.exact(SCENE.replace(damping=(0.1, 0.1, 0.1)))
    with pytest.raises(ValueError, match="for single scenes only"):
        kr.exact([SCENE, SCENE])


def test_a_member_with_vertical_momentum_fails_alone():
    lifted = SCENE.replace(momentum=(0.9, 2.1, 1e-3))
    ensemble = kr.Ensemble.of([SCENE, lifted])
    paths = kr.solve(ensemble, 1.0, method="exact")
    assert paths.failed.tolist() == [1]
    assert np.array_equal(paths[0].q, kr.solve(SCENE, 1.0, method="exact").q)


def test_methods_know_which_scenes_suit():
    exact = kr.methods["exact"]
    assert exact.applies_to(BODY) and exact.suits(SCENE)
    assert not exact.suits(SCENE.replace(momentum=(0.9, 2.1, 1e-3)))


def test_a_body_that_misses_the_ratio_has_a_mismatch():
    moments = 0.4, 0.4, float(np.nextafter(0.1, 1.0))
    rounded = kr.Body(1.0, moments, (1.0, 0.0, 0.0), unphysical=True)
    assert 0.0 < kr.exact(SCENE.replace(body=rounded)).mismatch < 1e-15


def test_a_vertical_momentum_of_a_roundings_size_has_a_mismatch():
    top = kr.exact(SCENE.replace(momentum=(0.9, 2.1, 1e-16)))
    assert 0.0 < top.mismatch < 1e-15 and top(3.0).m[0, 2] == 1e-16


def test_it_survives_pickling():
    top = kr.exact(SCENE)
    assert np.array_equal(pickle.loads(pickle.dumps(top))(12.0).q, top(12.0).q)


def test_times_beyond_the_horizon_are_refused():
    with pytest.raises(ValueError):
        kr.exact(SCENE)(1e300)
