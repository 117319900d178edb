"""Tests of the closed-form solutions for Kowalewski and Goryachev-Chaplygin tops.

Each test runs for a Kowalewski top and for a Goryachev-Chaplygin top.
"""

import itertools
import pickle
from dataclasses import dataclass

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits


@dataclass(frozen=True)
class Form:
    """A type of closed-form solution, and a top to which it applies."""

    result: type
    scene: kr.Scene
    ratio: float
    integral: str

    @property
    def name(self):
        return {2.0: "Kowalewski", 4.0: "Goryachev-Chaplygin"}[self.ratio]

    def body(self, moments=None, com=(1.0, 0.0, 0.0)):
        moments = moments or (self.ratio, self.ratio, 1.0)
        return kr.Body(1.0, moments, com, unphysical=True)


def make_form(result, ratio, momentum, integral):
    body = kr.Body(1.0, (ratio, ratio, 1.0), (1.0, 0.0, 0.0), unphysical=True)
    scene = kr.Scene(body, momentum=momentum, attitude=(0.8, 0.4, -0.2, 0.4), gravity=1)
    return Form(result, scene, ratio, integral)


FORMS = [
    make_form(kr.ExactKowalewski, 2.0, (0.3, 1.1, 0.8), "kowalewski"),
    make_form(kr.ExactGoryachevChaplygin, 4.0, (0.9, 2.1, 0.0), "goryachev_chaplygin"),
]


@pytest.fixture(params=FORMS, ids=lambda form: form.integral)
def form(request):
    return request.param


def largest_distance(one, other):
    distances = np.minimum(
        np.linalg.norm(one.q - other.q, axis=1), np.linalg.norm(one.q + other.q, axis=1)
    )
    return float((distances + np.linalg.norm(one.m - other.m, axis=1)).max())


def test_states_agree_with_30_digits(form):
    top = kr.exact(form.scene)
    assert isinstance(top, form.result) and isinstance(top, kr.ExactTorus)
    assert top.certificate < 1e-13 and top.mismatch == 0.0
    for t in ([0.5, 7.0, 300.0], [-3.0, -200.0]):
        assert largest_distance(top(t), kr.solve(form.scene, t, digits=30)) < 2e-14


@pytest.mark.parametrize("axes", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("gravity", [9.81, -2.5])
def test_states_are_right_for_any_axis_order_and_sign_of_gravity(form, axes, gravity):
    moments = np.array((form.ratio, form.ratio, 1.0))[list(axes)]
    com = np.array((0.0, -0.7, 0.0))[list(axes)]
    scene = form.scene.replace(body=form.body(tuple(moments), tuple(com)), gravity=gravity)
    # Some tops are near a resonance: one rounding error of the start moves them by 2e-14 rad.
    assert (
        largest_distance(kr.exact(scene)([5.0, 40.0]), kr.solve(scene, [5.0, 40.0], digits=30))
        < 2e-13
    )


def test_many_times_equal_single_times_bitwise(form):
    top, t = kr.exact(form.scene), np.linspace(-1e5, 1e6, 13)
    path = top(t)
    for i, time in enumerate(t):
        alone = top(time)
        assert same_bits(alone.q[0], path.q[i])
        assert same_bits(alone.m[0], path.m[i])


def test_integrals_are_constant_at_any_time(form):
    path = kr.exact(form.scene)(np.linspace(-1e6, 1e6, 101))
    assert np.ptp(path.energy) < 1e-13 and np.ptp(path.m[:, 2]) < 1e-13
    assert np.ptp(getattr(path, form.integral)) < 1e-13


def test_method_exact_equals_the_closed_form(form):
    t = [1.0, 20.0]
    path = kr.solve(form.scene, t, method="exact")
    assert path.method == "exact" and largest_distance(path, kr.exact(form.scene)(t)) < 5e-15


def test_motions_without_closed_form_are_refused_by_name(form):
    still, level = (0.0, 0.0, 0.0), (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)
    rest = kr.Scene(form.body(), momentum=still, attitude=level, gravity=1)
    with pytest.raises(ValueError, match=f"{form.name} top has no closed form"):
        kr.exact(rest)
    with pytest.raises(ValueError, match="does not apply: this motion"):
        kr.solve(rest, 1.0, method="exact")
    with pytest.raises(ValueError, match="damping"):
        kr.exact(form.scene.replace(damping=(0.1, 0.1, 0.1)))


def test_the_error_of_a_path_includes_the_mismatch(form):
    t = [10.0, 3000.0]
    bodies = form.body(), form.body((form.ratio * 0.1, form.ratio * 0.1, 0.1 * (1.0 + 6e-15)))
    exact_scene, near_scene = (form.scene.replace(body=body, gravity=0.1) for body in bodies)
    assert (
        kr.exact(exact_scene).mismatch == 0.0
        and kr.solve(exact_scene, t, method="exact").error < 5e-14
    )
    mismatch, path = kr.exact(near_scene).mismatch, kr.solve(near_scene, t, method="exact")
    assert 5e-15 < mismatch < 7e-15
    true = kr.solve(near_scene, t, digits=20)
    assert path.error == pytest.approx(kr.attitude_error(path.q, true.q).max(), rel=1e-3)
    angle = 3000.0 * np.linalg.norm(path.velocity[0])
    assert 0.05 < path.error / (mismatch * angle) < 5.0


def test_the_closed_form_survives_pickling(form):
    top = kr.exact(form.scene)
    assert np.array_equal(pickle.loads(pickle.dumps(top))(12.0).q, top(12.0).q)


def test_times_beyond_the_horizon_are_refused(form):
    with pytest.raises(ValueError, match="double precision cannot resolve its attitude"):
        kr.exact(form.scene)(1e300)


def test_every_line_of_the_spectrum_is_a_sum_of_the_frequencies(form):
    # Small multiples of the frequencies suffice for these starts.
    scene = form.scene if form.ratio == 2.0 else form.scene.replace(momentum=(2.0, 1.0, 0.0))
    top = kr.exact(scene)
    first, second, precession = top.frequencies
    assert (precession == 0.0) == (form.ratio == 4.0)
    lines = kr.frequencies(top(np.linspace(0.0, 4000.0, 20001))).lines[:4]
    for line in lines:
        miss = min(
            abs(line - (i * first + j * second + sign * precession))
            for i, j in itertools.product(range(-10, 11), repeat=2)
            for sign in (-1, 0, 1)
            if sign or not precession
        )
        assert miss < 1e-7, line
