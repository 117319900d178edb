"""Tests of tangents of the closed-form solutions for Kowalewski and Goryachev-Chaplygin tops."""

import pickle

import kreisel as kr
import numpy as np
import pytest

BODIES = {
    ratio: kr.Body(1.0, (ratio, ratio, 1.0), (1.0, 0.0, 0.0), unphysical=True)
    for ratio in (2.0, 4.0)
}
ATTITUDE = (0.8, 0.4, -0.2, 0.4)
KOWALEWSKI = kr.Scene(BODIES[2.0], (0.3, 1.1, 0.8), ATTITUDE)
LEVEL = kr.Scene(BODIES[4.0], (0.9, 2.1, 0.0), ATTITUDE)
SCENES = [
    KOWALEWSKI,
    kr.Scene(BODIES[2.0], (-1.2, 2.0, -1.5), ATTITUDE, gravity=-2.0),
    LEVEL,
]
BY = ("start", "gravity", "mass")


def size_of_columns(tangents):
    return np.linalg.norm(tangents, axis=1)


def assert_near(tangents, truth, tolerance):
    """Assert that two arrays of tangents agree, except for tangents that are NaN."""
    is_number = ~np.isnan(tangents).any(axis=(0, 1))
    miss = size_of_columns((tangents - truth)[:, :, is_number])
    assert (miss <= tolerance * size_of_columns(truth[:, :, is_number])).all()


@pytest.mark.parametrize("scene", SCENES)
def test_tangents_agree_with_30_digits(scene):
    for t in ([0.7, 1000.0], [-300.0]):
        path, truth = kr.exact(scene)(t, tangents=BY), kr.solve(scene, t, digits=30, tangents=BY)
        assert path.tangents.shape == (len(t), 6, 8)
        assert_near(path.tangents, truth.tangents, 2e-11)
        assert path.tangents_rest < 1e-10 and not path.tangents_low.any()


@pytest.mark.parametrize("scene", SCENES)
def test_only_the_column_of_vertical_momentum_has_no_closed_form(scene):
    path = kr.exact(scene)([0.0, 3.0], tangents=BY)
    is_missing = np.isnan(path.tangents).any(axis=(0, 1))
    assert is_missing.tolist() == [i == 5 and scene is LEVEL for i in range(8)]
    is_present = ~is_missing[:6]
    assert np.abs(path.tangents[0, :, :6] - np.eye(6))[:, is_present].max() < 1e-11
    assert np.abs(path.tangents[0, :, 6:]).max() < 1e-11


def compute_flow(path):
    """Return the angular velocity in the body frame and the torque in the space frame."""
    scene = path.scene
    arm = np.array(kr.quaternion.turn(tuple(path.q.T), scene.body.com)).T
    torque = np.cross(arm, (0.0, 0.0, -scene.body.mass * scene.gravity))
    return np.concatenate([path.body_velocity, torque], axis=1)


def compute_heading_change(path):
    """Return the derivative of the state with respect to a rotation about the vertical."""
    vertical = np.array(kr.quaternion.turn_back(tuple(path.q.T), (0.0, 0.0, 1.0))).T
    return np.concatenate([vertical, np.cross((0.0, 0.0, 1.0), path.m)], axis=1)


@pytest.mark.parametrize("scene", SCENES)
def test_tangents_of_known_changes_are_right_at_late_times(scene):
    """Compare tangents with exact derivatives along three symmetries of the equations of motion.

    The symmetries are time shifts, rotations about the vertical, and a scaling of time. Scaling the
    speed by f multiplies the momentum by f and the gravity by f^2.
    """
    path = kr.exact(scene)([0.0, -1e4, 1e7], tangents=BY)
    n = 5 if scene is LEVEL else 6
    start, gravity = path.tangents[:, :, :n], path.tangents[:, :, 6]
    sizes = np.abs(start).max(axis=(1, 2))
    assert (sizes[1:] > 100.0).all()
    flow = compute_flow(path)
    for change in (flow, compute_heading_change(path)):
        miss = np.abs(start @ change[0, :n] - change).max(axis=1)
        assert (miss < 1e-10 * sizes).all()
    faster = path.t[:, None] * flow
    faster[:, 3:] += path.m
    change_rate = (
        start[:, :, 3:] @ np.array(scene.momentum)[: n - 3] + 2.0 * scene.gravity * gravity
    )
    assert (np.abs(change_rate - faster).max(axis=1) < 1e-10 * (sizes + np.abs(path.t))).all()


@pytest.mark.parametrize(("ratio", "momentum"), [(2.0, (0.3, 1.1, 0.8)), (4.0, (0.9, 2.1, 0.0))])
@pytest.mark.parametrize("axes", [(1, 2, 0), (2, 1, 0)])
def test_tangents_are_in_the_frame_of_description(ratio, momentum, axes):
    moments, com = np.array((ratio, ratio, 1.0)), np.array((0.0, -0.7, 0.0))
    body = kr.Body(1.3, moments[list(axes)], com[list(axes)], unphysical=True)
    scene = kr.Scene(body, momentum, ATTITUDE, gravity=9.81)
    path, truth = kr.exact(scene)(5.0, tangents=BY), kr.solve(scene, [5.0], tangents=BY)
    assert_near(path.tangents, truth.tangents, 1e-9)


@pytest.mark.parametrize("factor", [1e-100, 1e100])
def test_tangents_do_not_depend_on_units(factor):
    other = KOWALEWSKI.replace(
        momentum=factor * np.array(KOWALEWSKI.momentum),
        gravity=factor * KOWALEWSKI.gravity * factor,
    )
    tangents = kr.exact(KOWALEWSKI)([7.0, 90.0], tangents=BY).tangents
    other_tangents = kr.exact(other)(np.array((7.0, 90.0)) / factor, tangents=BY).tangents
    units = np.repeat((1.0, factor), 3)[:, None]
    columns = np.array((1.0, 1.0, 1.0, factor, factor, factor, factor * factor, 1.0))
    assert_near(other_tangents / units * columns, tangents, 1e-10)


def test_the_tangents_of_a_time_do_not_depend_on_the_other_times():
    top, t = kr.exact(KOWALEWSKI), [3.0, -1e4, 0.0, 250.0]
    tangents = top(t, tangents="start").tangents
    for i, time in enumerate(t):
        assert np.array_equal(top(time, tangents="start").tangents[0], tangents[i])
    assert top([], tangents="start").tangents.shape == (0, 6, 6)


def test_tangents_do_not_change_the_path():
    top, t = kr.exact(KOWALEWSKI), [1.0, 40.0]
    path = top(t, tangents=("gravity", "start"))
    assert np.array_equal(path.states, top(t).states)
    truth = kr.solve(KOWALEWSKI, t, tangents=("start", "gravity"))
    for quantity in ("nutation", "kowalewski", "q"):
        miss = np.abs(path.derivative(quantity) - truth.derivative(quantity)).max()
        assert miss < 1e-9 * np.abs(truth.derivative("q")).max()
    assert np.array_equal(pickle.loads(pickle.dumps(path)).tangents, path.tangents)
    level = kr.exact(LEVEL)(1.0, tangents="start").derivative("nutation")
    assert np.isnan(level).tolist() == [[False] * 5 + [True]]


def test_tangents_near_a_separatrix_have_an_error_or_are_refused():
    level = (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)  # the closed form refuses this start at rest
    near_scene, nearer_scene = (
        KOWALEWSKI.replace(momentum=size * np.array(KOWALEWSKI.momentum), attitude=level)
        for size in (1e-3, 1e-6)
    )
    path = kr.exact(near_scene)(150.0, tangents="start")
    truth = kr.solve(near_scene, [150.0], digits=20, tangents="start")
    assert_near(path.tangents, truth.tangents, path.tangents_rest)
    assert 1e-7 < path.tangents_rest < 1e-4
    with pytest.raises(ValueError, match=r"neighbouring tops, which fail here.*no closed form"):
        kr.exact(nearer_scene)(1.0, tangents="start")


@pytest.mark.parametrize("name", ["moments", "com", "damping"])
def test_tangents_without_closed_form_are_refused_by_name(name):
    with pytest.raises(ValueError, match=f"has no tangents with respect to '{name}'"):
        kr.exact(KOWALEWSKI)(1.0, tangents=("start", name))


@pytest.mark.parametrize(
    ("t", "tangents", "error", "words"),
    [
        (1.0, "starts", ValueError, "did you mean 'start'"),
        (1.0, 3, TypeError, "tangents must be names"),
        (1.0, [], ValueError, "tangents is empty"),
        (np.nan, "start", ValueError, "t must be finite"),
        ([[1.0]], "start", ValueError, "t must be a number or a list"),
        ("x", "start", TypeError, "t must be"),
        (1e12, "start", ValueError, "t must be at most .* for the tangents"),
        (1e300, "start", ValueError, "cannot resolve its attitude"),
    ],
)
def test_invalid_arguments_are_refused(t, tangents, error, words):
    with pytest.raises(error, match=words):
        kr.exact(KOWALEWSKI)(t, tangents=tangents)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("t", [[0.0, 0.7, 40.0], [-300.0], 25.0, []])
def test_method_exact_gives_the_same_tangents(scene, t):
    path, plain = kr.solve(scene, t, "exact", tangents=BY), kr.solve(scene, t, "exact")
    assert path.method == "exact" and np.array_equal(path.states, plain.states)
    truth, late = kr.solve(scene, t, digits=30, tangents=BY), path.t != 0.0
    assert_near(path.tangents[late], truth.tangents[late], 2e-11)
    assert path.tangents_rest < 1e-10
    assert path.derivative("energy").shape == (len(path.t), 8)


@pytest.mark.parametrize("name", ["moments", "com", "damping"])
def test_method_exact_refuses_other_tangents(name):
    with pytest.raises(ValueError, match=f"no tangents with respect to '{name}'"):
        kr.solve(KOWALEWSKI, 1.0, "exact", tangents=("start", name))


def test_method_exact_refuses_unsupported_tangent_requests():
    with pytest.raises(ValueError, match="t must be at most"):
        kr.solve(KOWALEWSKI, 1e12, "exact", tangents="start")
    with pytest.raises(ValueError, match="leave out want"):
        kr.solve(KOWALEWSKI, 1.0, "exact", tangents="start", want=["energy"])
    with pytest.raises(ValueError, match="computes no tangents"):
        kr.solve(kr.Ensemble.of([KOWALEWSKI]), 1.0, "exact", tangents="start")
