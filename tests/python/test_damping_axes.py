"""Tests of anisotropic damping against solutions in decimal arithmetic."""

import itertools
import math

import kreisel as kr
import numpy as np
import pytest
from decimal_series import Series, attitude_error, compute_states
from ensembles import same_bits

DAMPING, COM = (0.1, 0.25, 0.4), (0.2, -0.1, 0.9)
SPHERE = (1.2, 1.2, 1.2)


def body(moments, com=COM):
    return kr.Body(1, moments, com=com, unphysical=True)


def tensor(moments, turn=(0.6, 0.48, 0.0, 0.64)):
    axes = np.array([kr.quaternion.turn(turn, e) for e in np.eye(3)]).T
    return axes @ np.diag(moments) @ axes.T


BODIES = {
    **{
        f"moments {moments}": body(moments)
        for order in itertools.permutations(range(3))
        for moments in [tuple(np.array((0.9, 1.0, 1.7))[list(order)].tolist())]
    },
    "symmetric about the first axis": body((0.7, 1.2, 1.2)),
    "symmetric about the second axis": body((1.2, 0.7, 1.2)),
    "symmetric about the third axis": body((1.2, 1.2, 0.7)),
    "Lagrange about the first axis": body((0.7, 1.2, 1.2), (0.8, 0, 0)),
    "Lagrange about the second axis": body((1.2, 0.7, 1.2), (0, 0.8, 0)),
    "spherical, com aside": body(SPHERE, (0.3, -0.4, 0.5)),
    "spherical, com on the first axis": body(SPHERE, (0.8, 0, 0)),
    "spherical, com below": body(SPHERE, (0, 0, -0.8)),
    "turned": body(tensor((0.9, 1.7, 1.0))),
    "turned and symmetric": body(tensor((0.7, 1.2, 1.2))),
}
THREE = ["moments (1.0, 1.7, 0.9)", "symmetric about the first axis", "spherical, com aside"]


def scene_of(name):
    return kr.Scene(
        BODIES[name],
        momentum=(0.3, -0.7, 1.5),
        attitude=(0.8, 0.6, 0, 0),
        damping=DAMPING,
        gravity=1,
    )


def assert_agrees(path, states, tolerance):
    """Compare `path` with states computed in decimal arithmetic."""
    low = path.q_low if path.q_low is not None else np.zeros_like(path.q)
    for i, (q, m) in enumerate(states):
        assert attitude_error(q, path.q[i], low[i]) < tolerance
        assert np.abs(path.m[i] - np.array(m, float)).max() < max(3 * tolerance, 1e-14)


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("t", [2.0, -1.0])
def test_paths_agree_with_the_series_at_every_number_of_digits(name, t):
    scene, times = scene_of(name), [t / 4, t]
    truth = compute_states(scene, *times)
    for digits, tolerance in ((None, 1e-14), (16, 1e-14), (20, 1e-19), (30, 1e-29)):
        assert_agrees(kr.solve(scene, times, digits=digits), truth, tolerance)


@pytest.mark.parametrize("digits", [None, 16, 20, 30])
@pytest.mark.parametrize("t", [5.0, -2.0])
def test_a_spin_about_each_axis_decays_at_the_rate_of_that_axis(t, digits):
    for moments in [*itertools.permutations((1.0, 1.5, 2.0)), SPHERE]:
        for com, gravity in (((0, 0, 0), 1.0), ((0.2, 0.3, 0.4), 0.0)):
            for axis in range(3):
                spin = np.eye(3)[axis]
                scene = kr.Scene(
                    body(moments, com), velocity=spin, gravity=gravity, damping=DAMPING
                )
                path = kr.solve(scene, [t], digits=digits)
                factor = math.exp(-DAMPING[axis] / moments[axis] * t)
                assert np.abs(path.velocity[0] - factor * spin).max() < 1e-15 * max(1.0, factor)


@pytest.mark.parametrize("name", BODIES)
def test_one_number_equals_three_equal_numbers_bitwise(name):
    one, three = (scene_of(name).replace(damping=d) for d in (0.25, (0.25, 0.25, 0.25)))
    for digits in (None, 16, 20, 30):
        a, b = (kr.solve(s, [1.0, 4.0], digits=digits).states for s in (one, three))
        assert same_bits(a, b)


def test_ensembles_and_reductions_agree_with_the_series():
    names = list(BODIES)
    for times in ([0.5, 2.0], [-0.25, -1.0]):
        tops = kr.Ensemble.of([scene_of(name) for name in names])
        paths = kr.solve(tops, times)
        reductions = kr.reduce(tops, times, {"nutation": "max"})
        for i in range(len(names)):
            assert_agrees(paths[i], compute_states(tops[i], *times), 1e-14)
            assert abs(reductions["nutation"]["max"][i] - paths[i].nutation.max()) < 1e-15


@pytest.mark.parametrize("name", THREE)
def test_events_agree_with_the_series(name):
    scene = scene_of(name)
    event = kr.events.plane((0, 1, 0), of="body_velocity")
    found = kr.solve(scene, 8.0, events=[event]).events
    section = kr.section(scene, event, n=len(found), max_wait=20.0)
    assert np.allclose(section.t, found.path.t, rtol=0, atol=1e-12)
    series, rate = Series(scene), []
    axes = np.array([kr.quaternion.turn(scene.body.axes, e) for e in np.eye(3)]).T

    def velocity_at(t):
        series.to(t)
        return axes @ series.velocity()

    for t in found.path.t:
        rate.append(velocity_at(t)[1])
    assert np.abs(rate).max() < 1e-13
    series = Series(scene)
    signs = np.sign([velocity_at(t)[1] for t in np.linspace(0.0, 8.0, 81)])
    assert len(found) == np.count_nonzero(np.diff(signs)) > 0


def rotation_vector(q, other):
    """Return the rotation vector, accurate to first order, from the attitude `q` to `other`."""
    w, x, y, z = q
    p, r, s, u = other
    vector = (
        w * r - x * p - y * u + z * s,
        w * s - y * p - z * r + x * u,
        w * u - z * p - x * s + y * r,
    )
    return np.array([2.0 * float(c) for c in vector])


@pytest.mark.parametrize("name", THREE)
@pytest.mark.parametrize("digits", [None, 20])
def test_tangents_agree_with_differences_of_the_series(name, digits):
    scene, t = scene_of(name), 2.0
    tangents = kr.solve(scene, [t], digits=digits, tangents="start").tangents[0]
    middle, step = scene.momentum, 2.0**-40
    ((q, _),) = compute_states(scene, t)
    for axis in range(3):
        ends = []
        for sign in (1, -1):
            momentum = np.array(middle)
            momentum[axis] += sign * step
            ends += compute_states(scene.replace(momentum=tuple(momentum)), t)
        rotation = rotation_vector(q, ends[0][0]) - rotation_vector(q, ends[1][0])
        impulse = [float(a - b) for a, b in zip(ends[0][1], ends[1][1], strict=True)]
        truth = np.array([*rotation, *impulse]) / (2.0 * step)
        assert np.abs(truth - tangents[:, 3 + axis]).max() < 1e-13 * np.abs(tangents).max()


@pytest.mark.parametrize("name", THREE)
def test_streams_and_resumed_runs_equal_the_path_bitwise(name):
    scene, times = scene_of(name), [0.5, 1.0, 2.0]
    path = kr.solve(scene, times)
    assert_agrees(path, compute_states(scene, *times), 1e-14)
    run = kr.start(scene)
    run.to(times[0])
    assert same_bits(kr.resume(run.checkpoint).to(times[1:]).states, path.states[1:])
    states = np.concatenate([piece.states for piece in kr.stream(scene, times, chunk=1)])
    assert same_bits(states, path.states)


@pytest.mark.parametrize(
    "scene",
    [
        kr.scenes.kowalewski,
        kr.Scene(
            kr.Body.cuboid(half=(0.8, 0.5, 1), pivot=(0, 0, -1)), momentum=(1, 2, 3), gravity=1
        ),
    ],
)
def test_named_scenes_agree_with_the_series(scene):
    damped = scene.replace(damping=DAMPING)
    times = [1.0, 3.0]
    assert_agrees(kr.solve(damped, times), compute_states(damped, *times), 1e-14)
