"""Tests of tangents of the closed-form solutions for Kowalewski and Goryachev-Chaplygin tops."""

import pickle
import re

import kreisel as kr
import numpy as np
import pytest
from kreisel._solve import torus_tangents

BODIES = {
    ratio: kr.Body(1.0, (ratio, ratio, 1.0), (1.0, 0.0, 0.0), unphysical=True)
    for ratio in (2.0, 4.0)
}
ATTITUDE = (0.8, 0.4, -0.2, 0.4)
KOWALEWSKI = kr.Scene(BODIES[2.0], (0.3, 1.1, 0.8), ATTITUDE, gravity=1)
LEVEL = kr.Scene(BODIES[4.0], (0.9, 2.1, 0.0), ATTITUDE, gravity=1)
SCENES = [
    KOWALEWSKI,
    kr.Scene(BODIES[2.0], (-1.2, 2.0, -1.5), ATTITUDE, gravity=-2.0),
    LEVEL,
]
BY = ("start", "gravity", "mass")


def size_of_columns(tangents):
    return np.linalg.norm(tangents, axis=1)


def assert_near(tangents, truth, tolerance):
    """Assert that two arrays of tangents agree; that of the vertical momentum may be NaN."""
    is_number = ~np.isnan(tangents).any(axis=(0, 1))
    assert np.delete(is_number, 5).all()
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
    level = (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)  # at rest, the top has no closed form
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


def find_weights(order):
    """Return the weights of the quotients (f(k h) - f(-k h)) / (2 k h) of a central difference.

    Polynomials of odd degrees below `order` are differentiated exactly.
    """
    k = np.arange(1.0, order // 2 + 1.0)
    return np.linalg.solve(
        [k ** (2 * j) for j in range(order // 2)], [1.0, *[0.0] * (order // 2 - 1)]
    )


@pytest.mark.parametrize("factor", [1e-3, 1e3])
@pytest.mark.parametrize("step", [0.3, 0.02])
def test_differences_are_of_order_8_and_their_error_of_order_6(factor, step):
    """Test motions whose state components are polynomials in those of the initial momentum."""
    size, units = KOWALEWSKI._rotation_rate * 2.0, KOWALEWSKI._rotation_rate * 2.0
    group = torus_tangents._list_parameter_perturbations(KOWALEWSKI, "start")[1]
    assert group.size == size and group.columns == 3 and group.largest == np.inf
    power = 9
    start = np.array(KOWALEWSKI.momentum)

    def compute_states(scene, times):
        states = np.zeros((len(times), 8))
        states[:, 0], states[:, 1] = times, 1.0
        x = (np.array(scene.momentum) - start) / size
        states[:, 2:5] = factor * (x + x**power)  # half the rotation
        states[:, 5:8] = factor * units * (x + x**power)
        return states

    times = np.array((0.0, 5.0))
    states = compute_states(KOWALEWSKI, times)
    best, miss = torus_tangents._compute_central_differences(
        KOWALEWSKI, states, group, step, compute_states
    )
    h = 2.0 ** np.floor(np.log2(step * size)) / size
    k = np.arange(1, 5)
    quotients = factor * (1.0 + (k * h) ** (power - 1))
    expected, other = find_weights(8) @ quotients, find_weights(6) @ quotients[:3]
    assert np.allclose(best[:, 3:], expected * units / size * np.eye(3), rtol=1e-10)
    assert np.allclose(best[:, :3], 2.0 * expected / size * np.eye(3), rtol=1e-10)
    expected, other = np.sqrt(5.0) * expected, np.sqrt(5.0) * other
    error = abs(expected - other) / max(abs(expected), 1.0)
    assert np.allclose(miss, error, rtol=1e-6, atol=1e-12 * factor)


def test_attitudes_change_by_twice_the_vector_of_their_quotient():
    rng = np.random.default_rng(0)
    one = rng.normal(size=(5, 4))
    one /= np.linalg.norm(one, axis=1)[:, None]
    small = 1e-3 * rng.normal(size=(5, 3))
    turns = np.column_stack((np.sqrt(1.0 - (small**2).sum(axis=1)), small))
    other = np.array(kr.quaternion.multiply(tuple(one.T), tuple(turns.T))).T
    other[::2] *= -1.0
    found = torus_tangents._compute_rotation_between(one, other)
    assert np.allclose(found, 2.0 * small, atol=1e-15)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_starts_and_gravity_are_changed_by_known_amounts(axis):
    one = torus_tangents._change_attitude(KOWALEWSKI, axis, -0.01)
    other = torus_tangents._change_attitude(KOWALEWSKI, axis, 0.02)
    turn = torus_tangents._subtract_attitudes_of_scenes(one, other)
    assert np.allclose(turn, 2.0 * np.sin(0.015) * np.eye(3)[axis], atol=1e-15)
    one = torus_tangents._change_momentum(KOWALEWSKI, axis, 0.25)
    change = torus_tangents._subtract_momenta_of_scenes(KOWALEWSKI, one)
    assert np.allclose(change, 0.25 * np.eye(3)[axis], atol=1e-15)
    one = torus_tangents._change_gravity(KOWALEWSKI, axis, 0.5)
    assert one.gravity == 1.5
    assert torus_tangents._subtract_gravities_of_scenes(KOWALEWSKI, one).tolist() == [0.5]


@pytest.mark.parametrize("gravity", [9.81, -9.81])
def test_steps_of_gravity_keep_its_sign(gravity):
    body = kr.Body(2.0, (3.0, 3.0, 1.5), (0.3, 0.4, 0.0), unphysical=True)
    scene = kr.Scene(body, (0.3, 1.1, 0.8), ATTITUDE, gravity=gravity)
    [group] = torus_tangents._list_parameter_perturbations(scene, "gravity")
    assert group.size == pytest.approx(scene._rotation_rate**2 * 3.0 / (2.0 * 0.5))
    assert group.largest == 9.81 / 8.0 and group.columns == 1
    attitude, momentum = torus_tangents._list_parameter_perturbations(LEVEL, "start")
    assert (attitude.size, attitude.largest, attitude.columns) == (1.0, np.inf, 3)
    assert momentum.size == LEVEL._rotation_rate * 4.0 and momentum.columns == 2


def test_steps_shrink_with_time(monkeypatch):
    """Check that states at larger rotation angles use smaller difference steps."""
    calls = []

    def differentiate(scene, states, group, step, compute_states):
        calls.append((step, states[:, 0].tolist()))
        return np.full((len(states), 6, 3), step), states[:, 0] ** 2

    monkeypatch.setattr(torus_tangents, "_differentiate_with_best_steps", differentiate)
    monkeypatch.setattr(torus_tangents, "_MOST", 2)
    group = torus_tangents._list_parameter_perturbations(KOWALEWSKI, "start")[0]
    unit = 1.0 / KOWALEWSKI._rotation_rate
    times = unit * np.array((0.0, 7.9, -0.9, 8.1, 1.1, 0.5, -500.0, -63.0))
    states = np.zeros((8, 8))
    states[:, 0] = times
    compute = torus_tangents._compute_tangent_matrix_columns
    columns, rest = compute(KOWALEWSKI, states, group, None)
    first = 2.0**-3.5
    expected = [
        (first, times[[0, 2]]),
        (first, times[[5]]),
        (first / 8.0, times[[1, 4]]),
        (first / 64.0, times[[3, 7]]),
        (first / 512.0, times[[6]]),
    ]
    assert len(calls) == 5 and rest == pytest.approx((500.0 * unit) ** 2)
    for (step, part), (size, members) in zip(calls, expected, strict=True):
        assert step == pytest.approx(size) and part == members.tolist()
    powers = np.array((0, 1, 0, 2, 1, 0, 3, 2))
    assert np.allclose(columns, (first * 8.0**-powers)[:, None, None] * np.ones((6, 3)))
    empty, rest = compute(KOWALEWSKI, states[:0], group, None)
    assert empty.shape == (0, 6, 3) and rest < 1e-10


@pytest.mark.parametrize(
    ("misses", "steps", "rest"),
    [
        # errors at two times for each step; in the first case, the first step is accurate enough
        ([(1e-12, 1e-11)], 1, (1e-12, 1e-11)),
        ([(1e-12, 1e-9), (1e-13,)], 2, (1e-12, 1e-13)),
        ([(1e-9, 1e-9), (1e-8, 1e-10), (1e-10,), (1e-9,)], 3, (1e-9, 1e-10)),
        ([(1e-9, 1e-9), (1e-9, 1e-9)], 2, (1e-9, 1e-9)),
        ([(9e-2, 8e-3), (7e-3, 6e-4), (5e-4, 4e-5), (1e-5, 1e-6)], 4, (1e-5, 1e-6)),
        ([None, (1e-12, 1e-12)], 2, (1e-12, 1e-12)),
        ([(1e-4, 1e-12), None, (1e-3,)], 3, (1e-4, 1e-12)),
        ([(1.1e-4, 1e-12), (1e-3,)], 2, "do not change smoothly"),
        ([None, None, None, None], 4, "no closed form here"),
    ],
)
def test_the_most_accurate_of_several_steps_counts(monkeypatch, misses, steps, rest):
    calls = []

    def differentiate(scene, states, group, step, compute_states):
        calls.append(step)
        miss = misses[len(calls) - 1]
        if miss is None:
            raise ValueError("no closed form here")
        assert len(miss) == len(states)
        return np.full((len(states), 6, 3), step), np.array(miss)

    monkeypatch.setattr(torus_tangents, "_compute_central_differences", differentiate)
    group = torus_tangents._list_parameter_perturbations(KOWALEWSKI, "start")[0]
    states = np.zeros((2, 8))
    words = torus_tangents._differentiate_with_best_steps, KOWALEWSKI, states, group, 0.5, None
    if isinstance(rest, str):
        with pytest.raises(ValueError, match=f"neighbouring tops.*{rest}"):
            words[0](*words[1:])
    else:
        columns, found = words[0](*words[1:])
        assert tuple(found) == rest
        for row in range(2):
            number = next(
                k for k, miss in enumerate(misses) if miss is not None and rest[row] in miss
            )
            assert (columns[row] == 0.5 * 0.25**number).all()
    assert calls == [0.5 * 0.25**k for k in range(steps)]


@pytest.mark.parametrize("factor, is_refused", [(0.999, False), (1.001, True)])
def test_the_latest_time_is_a_thousand_million_radians(factor, is_refused):
    times = np.array((0.0, -factor * 1e9 / KOWALEWSKI._rotation_rate, 3.0))
    if not is_refused:
        return torus_tangents.check_tangent_times(KOWALEWSKI, times)
    limit = f"{1e9 / KOWALEWSKI._rotation_rate:.3g}"
    with pytest.raises(ValueError, match=f"at most {re.escape(limit)} in size"):
        torus_tangents.check_tangent_times(KOWALEWSKI, times)
