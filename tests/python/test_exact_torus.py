"""Tests of the closed forms of Kowalewski and Goryachev-Chaplygin tops, for each kind alike."""

import math
import pickle
import signal
from dataclasses import dataclass

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits
from hypothesis import given
from hypothesis import strategies as st
from kreisel import quaternion
from tops import unit

ATTITUDE = (0.8, 0.4, -0.2, 0.4)
LEVEL = (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0)  # at rest, the top has no closed form


@dataclass(frozen=True)
class Form:
    """A type of closed-form solution, and a top to which it applies."""

    ratio: float
    momentum: tuple[float, float, float]
    kind: str

    def body(self, moments=None, com=(1.0, 0.0, 0.0)):
        moments = moments or (self.ratio, self.ratio, 1.0)
        return kr.Body(1.0, moments, com, unphysical=True)

    @property
    def scene(self):
        return kr.Scene(self.body(), momentum=self.momentum, attitude=ATTITUDE, gravity=1)


FORMS = [
    Form(2.0, (0.3, 1.1, 0.8), "kowalewski"),
    Form(4.0, (0.9, 2.1, 0.0), "goryachev_chaplygin"),
]
KOWALEWSKI, CHAPLYGIN = (form.scene for form in FORMS)
SCENES = [
    KOWALEWSKI,
    KOWALEWSKI.replace(
        momentum=(2.0, -0.4, -1.5), attitude=unit((0.3, 0.1, 0.7, -0.5)), gravity=-2.0
    ),
    CHAPLYGIN,
    CHAPLYGIN.replace(momentum=(2, 4, 0), attitude=unit((0.1, -0.6, 0.3, 0.7)), gravity=0.5),
]


@pytest.fixture(params=FORMS, ids=lambda form: form.kind)
def form(request):
    return request.param


def find_largest_distance(one, other):
    angles = kr.attitude_error(one.q, other.q)
    return float((angles + np.linalg.norm(one.m - other.m, axis=1)).max())


# States


def test_a_path_has_the_same_bits_for_one_time_or_many_tops(form):
    top, t = kr.exact(form.scene), np.linspace(-1e6, 1e6, 14)
    assert isinstance(top, kr.ExactTorus) and top.kind == form.kind
    path = top(t)
    assert np.ptp(path.energy) < 1e-13 and np.ptp(path.m[:, 2]) < 1e-13
    assert np.ptp(getattr(path, form.kind)) < 1e-13
    for i, time in enumerate(t):
        assert same_bits(top(time).states[0], path.states[i])
    assert same_bits(pickle.loads(pickle.dumps(top))(t).states, path.states)
    solved = kr.solve(form.scene, t[7:], method="exact")
    assert solved.method == "exact" and find_largest_distance(solved, path[7:]) < 1e-9


@pytest.mark.parametrize(
    "change",
    [
        lambda form: {"body": form.body((form.ratio, form.ratio, float(np.nextafter(1.0, 2.0))))},
        lambda form: {"body": form.body((form.ratio, float(np.nextafter(form.ratio, 0.0)), 1.0))},
        lambda form: {"body": form.body(com=(1.0, 0.0, 1e-15))},
        lambda form: {"momentum": (0.9, 2.1, 1e-16)},
        lambda form: {"momentum": (0.0, 0.0, 0.0), "attitude": LEVEL},
    ],
)
def test_tops_that_are_integrable_only_up_to_rounding_are_refused(form, change):
    """Near a separatrix, tops that differ by a rounding error move apart by up to 2.5 rad."""
    scene = form.scene.replace(**change(form))
    if form.ratio == 2.0 and scene.momentum[2] == 1e-16:
        assert kr.exact(scene).certificate < 1e-13
        return
    for call in (
        lambda: kr.exact(scene),
        lambda: kr.exact([form.scene, scene]).certificate,
        lambda: kr.solve(scene, 1.0, method="exact"),
    ):
        with pytest.raises(ValueError, match=r"only up to rounding|this motion of a"):
            call()
    paths = kr.solve(kr.Scene.stack([form.scene, scene]), 1.0, method="exact")
    assert paths.failed.tolist() == [1]


@given(st.floats(1e-30, 1e30))
def test_products_of_any_moment_and_the_ratio_are_exact(moment):
    for form in FORMS:
        body = form.body((form.ratio * moment, form.ratio * moment, moment))
        assert kr.exact(form.scene.replace(body=body, gravity=1.0 / moment)).certificate < 1e-13


# Frequencies and actions


def differentiate(function, scene, change, h=1e-4):
    """Differentiate a function of the initial state by fourth-order central differences."""

    def evaluate(factor):
        momentum = np.array(scene.momentum) + h * factor * np.array(change[:3])
        attitude = unit(np.array(scene.attitude) + h * factor * np.array(change[3:]))
        return np.array(function(scene.replace(momentum=momentum, attitude=attitude)))

    return (8.0 * (evaluate(1) - evaluate(-1)) - (evaluate(2) - evaluate(-2))) / (12.0 * h)


@pytest.mark.parametrize("scene", SCENES)
def test_frequencies_are_derivatives_of_the_energy_by_the_actions(scene):
    vertical = 0.6 if scene.momentum[2] else 0.0
    for change in [(1, 0, vertical, 0, 0, 0, 0), (0.3, -0.8, 0, 0.2, -0.5, 0.7, 0.1)]:
        by_actions = differentiate(lambda s: kr.exact(s).actions, scene, change)
        expected = differentiate(lambda s: kr.exact(s)(0.0).energy[0], scene, change)
        assert abs(kr.exact(scene).frequencies @ by_actions - expected) < 1e-8


@pytest.mark.parametrize("scene", SCENES)
def test_actions_are_those_of_the_torus(scene):
    """Check twice the mean kinetic energy, other states of one torus, other axes and units."""
    top, t = kr.exact(scene), np.linspace(0.0, 500.0, 10001)
    path, window = top(t), np.kaiser(len(t), 10.0 * math.pi)
    mean = float(window @ (path.m * path.velocity).sum(axis=1) / window.sum())
    assert abs(mean - np.dot(top.frequencies, top.actions)) < 1e-9 * mean
    assert top.actions[2] == scene.momentum[2]
    others = [scene.replace(momentum=path.m[-1], attitude=path.q[-1])]
    attitude = scene.attitude
    for k in (1, 2):  # axis 1 becomes axis 2, axis 2 becomes axis 3
        attitude = quaternion.multiply(attitude, (0.5, -0.5, -0.5, -0.5))
        moments, com = np.roll(scene.body.moments, k), np.roll(scene.body.com, k)
        body = kr.Body(1.0, tuple(moments), tuple(com), unphysical=True)
        others.append(scene.replace(body=body, attitude=attitude))
    for other in others:
        assert np.abs(np.subtract(kr.exact(other).actions, top.actions)).max() < 1e-12
    heavy = kr.Body(
        8.0, tuple(8.0 * i for i in scene.body.moments), scene.body.com, unphysical=True
    )
    scaled = kr.exact(scene.replace(body=heavy, momentum=8.0 * np.array(scene.momentum)))
    assert scaled.actions == tuple(8.0 * a for a in top.actions)


# Tangents

BY = ("start", "gravity", "mass")


def assert_near(tangents, truth, tolerance):
    """Assert that two arrays of tangents agree; that of the vertical momentum may be NaN."""
    is_number = ~np.isnan(tangents).any(axis=(0, 1))
    assert np.delete(is_number, 5).all()
    miss = np.linalg.norm((tangents - truth)[:, :, is_number], axis=1)
    assert (miss <= tolerance * np.linalg.norm(truth[:, :, is_number], axis=1)).all()


TURNED = kr.Body(1.3, (2.0, 1.0, 2.0), (0.0, 0.0, -0.7), unphysical=True)


@pytest.mark.parametrize("scene", [*SCENES[:3], KOWALEWSKI.replace(body=TURNED, gravity=9.81)])
def test_tangents_agree_with_30_digits(scene):
    for t in ([0.7, 200.0], [-30.0]):
        truth = kr.solve(scene, t, digits=30, tangents=BY)
        for path in (kr.exact(scene)(t, tangents=BY), kr.solve(scene, t, "exact", tangents=BY)):
            assert path.tangents.shape == (len(t), 6, 8)
            assert_near(path.tangents, truth.tangents, 2e-11)
            assert path.tangents_rest < 1e-10 and not path.tangents_low.any()
            missing = np.isnan(path.tangents).any(axis=(0, 1)).tolist()
            assert missing == [i == 5 and scene is CHAPLYGIN for i in range(8)]
        assert same_bits(path.states, kr.solve(scene, t, "exact").states)
        for quantity in ("nutation", "q"):
            miss = np.abs(path.derivative(quantity) - truth.derivative(quantity))
            assert np.nanmax(miss) < 1e-9 * np.abs(truth.derivative("q")).max()


def compute_flow(path):
    """Return the angular velocity in the body frame and the torque in the space frame."""
    arm = np.array(quaternion.turn(tuple(path.q.T), path.scene.body.com)).T
    torque = np.cross(arm, (0.0, 0.0, -path.scene.body.mass * path.scene.gravity))
    return np.concatenate([path.body_velocity, torque], axis=1)


@pytest.mark.parametrize("scene", SCENES[:3])
def test_tangents_of_known_changes_are_right_at_late_times(scene):
    """Compare with shifts of time, rotations about the vertical, and a scaling of time.

    Scaling the speed by f multiplies the momentum by f and the gravity by f^2.
    """
    path = kr.exact(scene)([0.0, -1e4, 1e7], tangents=BY)
    n = 5 if scene is CHAPLYGIN else 6
    start, gravity = path.tangents[:, :, :n], path.tangents[:, :, 6]
    sizes = np.abs(start).max(axis=(1, 2))
    assert (sizes[1:] > 100.0).all()
    flow = compute_flow(path)
    vertical = np.array(quaternion.turn_back(tuple(path.q.T), (0.0, 0.0, 1.0))).T
    heading = np.concatenate([vertical, np.cross((0.0, 0.0, 1.0), path.m)], axis=1)
    for change in (flow, heading):
        assert (np.abs(start @ change[0, :n] - change).max(axis=1) < 1e-10 * sizes).all()
    faster = path.t[:, None] * flow
    faster[:, 3:] += path.m
    found = start[:, :, 3:] @ np.array(scene.momentum)[: n - 3] + 2.0 * scene.gravity * gravity
    assert (np.abs(found - faster).max(axis=1) < 1e-10 * (sizes + np.abs(path.t))).all()


def test_tangents_near_a_separatrix_have_an_error_or_are_refused():
    near, nearer = (
        KOWALEWSKI.replace(momentum=size * np.array(KOWALEWSKI.momentum), attitude=LEVEL)
        for size in (1e-3, 1e-6)
    )
    path = kr.exact(near)(150.0, tangents="start")
    truth = kr.solve(near, [150.0], digits=20, tangents="start")
    assert_near(path.tangents, truth.tangents, path.tangents_rest)
    assert 1e-7 < path.tangents_rest < 1e-4
    with pytest.raises(ValueError, match="neighbouring tops, which fail here"):
        kr.exact(nearer)(1.0, tangents="start")


# Ensembles

LAGRANGE = kr.Scene(
    kr.Body(1.3, (0.7, 1.4, 1.4), (0.9, 0, 0), unphysical=True), (0.3, 1.1, 0.8), gravity=9.81
)
LEANING = CHAPLYGIN.replace(momentum=(0.9, 2.1, 0.1))  # its momentum has a vertical component
TOPS = kr.Scene.stack([[KOWALEWSKI, CHAPLYGIN], [LAGRANGE, SCENES[1]]])


def test_an_ensemble_equals_single_tops():
    own, forms = np.random.default_rng(3).normal(size=(2, 2, 5)), kr.exact(TOPS)
    t = np.linspace(0.5, 40.0, 150)
    paths = kr.solve(TOPS, t, method="exact")
    assert not paths.failed.size
    for i in np.ndindex(2, 2):
        one = kr.exact(TOPS[i])
        assert same_bits(forms(own)[i].states, one(own[i]).states)
        assert same_bits(forms([3.0, -1.0, 0.0])[i].states, one([3.0, -1.0, 0.0]).states)
        if i != (1, 0):
            assert forms.certificate[i] == one.certificate
            assert np.array_equal(forms.frequencies[i], one.frequencies)
            assert same_bits(paths[i].states, kr.solve(TOPS[i], t, method="exact").states)
    assert np.isnan(forms.certificate[1, 0]) and np.isnan(forms.frequencies[1, 0]).all()
    with pytest.raises(ValueError, match=r"top\[0, 0\]: turning points exist for"):
        _ = forms.motion_type


@pytest.mark.parametrize("scenes", [[CHAPLYGIN, LEANING], [LEANING, LAGRANGE]])
def test_a_refused_member_fails_alone(scenes, tmp_path):
    i, tops = scenes.index(LEANING), kr.Scene.stack(scenes)
    with pytest.raises(ValueError, match=rf"scene\[{i}\]: this motion .* vertical component"):
        kr.exact(scenes)
    paths = kr.solve(tops, 30.0, method="exact")
    assert paths.failed.tolist() == [i] and np.isnan(paths.q[i]).all()
    with pytest.raises(kr.Error, match=rf"top\[{i}\]: .* vertical component"):
        paths.check()
    other = kr.solve(kr.Scene.stack([scenes[1 - i]]), 30.0, method="exact")
    assert same_bits(paths[1 - i].states, other[0].states)
    sweep = kr.sweep(tops, 30.0, "exact", folder=tmp_path, reduce={"nutation": "last"})
    assert sweep["status"].tolist() == paths.status.tolist()
    assert np.array_equal(sweep["nutation_last"], paths.nutation[:, -1], equal_nan=True)


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs a timer with a signal")
def test_ctrl_c_stops_the_preparation_of_many_tops():
    tops = CHAPLYGIN.vary(momentum=np.broadcast_to((0.9, 2.1, 0.0), (200_000, 3)))
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.1)
    try:
        with pytest.raises(KeyboardInterrupt):
            kr.exact(tops)  # the set-up of all tops would take minutes
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


# Tops of one kind


def test_a_pendulum_of_kowalewski_is_refused():
    pendulum = KOWALEWSKI.replace(momentum=(0.0, 2.5, 0.0), attitude=(1, 0, 0, 0))
    with pytest.raises(ValueError, match="no closed form"):
        kr.exact(pendulum)
    with pytest.raises(ValueError, match=r"does not apply: this motion.*in a plane"):
        kr.solve(pendulum, 1.0, method="exact")


def test_the_vertical_momentum_is_zero_at_any_time():
    assert not kr.exact(CHAPLYGIN)(np.linspace(-1e6, 1e6, 101)).m[:, 2].any()


def test_other_motions_are_refused_alone():
    rest = CHAPLYGIN.replace(momentum=(0.0, 0.0, 0.0), attitude=LEVEL)
    rising, exact = CHAPLYGIN.replace(momentum=(0.9, 2.1, 1e-3)), kr.methods["exact"]
    assert exact.applies_to(CHAPLYGIN.body) and exact.suits(CHAPLYGIN) and not exact.suits(rising)
    for top, word in ((rest, "equilibrium"), (rising, "vertical")):
        for call in (lambda top=top: kr.exact(top), lambda top=top: kr.solve(top, 1.0, "exact")):
            with pytest.raises(ValueError, match=word):
                call()
    paths = kr.solve(kr.Scene.stack([CHAPLYGIN, rising]), 1.0, method="exact")
    assert paths.failed.tolist() == [1]
    assert np.array_equal(paths[0].q, kr.solve(CHAPLYGIN, 1.0, method="exact").q)


def test_newtons_method_converges_near_a_separatrix():
    """Check a solution for which the plain Newton iteration alternates between two points."""
    momentum = (-0.019903457640552673, 0.20531745824418174, 0.0)
    attitude = (0.7809338007617764, 0.4767702483489516, 0.3363007682902849, -0.2230119332331995)
    scene = kr.Scene(CHAPLYGIN.body, momentum, attitude, gravity=-2.0)
    top, t = kr.exact(scene), 7727.366551913936
    before = top(t - 1.0)
    start = scene.replace(momentum=before.m[0], attitude=before.q[0])
    truth = kr.solve(start, 1.0, method="taylor")
    assert np.abs(top(t).m[0] - truth.m[-1]).max() < 1e-11
    assert kr.attitude_error(top(t).q[0], truth.q[-1]) < 1e-11
