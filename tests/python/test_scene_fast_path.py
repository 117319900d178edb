"""Tests that scenes do not depend on the numeric types of their arguments."""

import kreisel as kr
import numpy as np
import pytest
from internals import QUANTITIES, core
from kreisel import quaternion
from tops import CORNER, GENERAL, MOMENTUM, TILT, scene_for, words_for

WAYS = [tuple, list, np.array, lambda row: [np.float64(x) for x in row]]
TIMES = (0.1, 0.3, 0.30000000000000004, 2.0)


@pytest.mark.parametrize("word", ["momentum", "velocity", "body_momentum", "body_velocity"])
@pytest.mark.parametrize("way", WAYS)
def test_scenes_from_plain_numbers_equal_validated_ones(word, way):
    rng = np.random.default_rng(7)
    for _ in range(50):
        row, q = rng.normal(size=3), rng.normal(size=4)
        q /= np.linalg.norm(q)
        plain = kr.Scene(CORNER, **{word: way(row)}, attitude=way(q), gravity=1)
        other = {word: list(row), "attitude_xyzw": [*q[1:], q[0]]}
        validated = kr.Scene(CORNER, gravity=1, **other)
        assert plain == validated and plain._block == validated._block
        assert all(type(x) is float for x in (*plain.momentum, *plain.attitude, plain.gravity))


def test_numpy_numbers_are_plain_numbers():
    row = tuple(np.array(MOMENTUM))
    assert isinstance(row[0], np.float64)
    assert isinstance(core.scene(CORNER._block, row, None, np.float64(1.0), None), tuple)


@pytest.mark.parametrize("way", [*WAYS, lambda row: [1, *row[1:]]])
def test_bodies_from_plain_numbers_equal_validated_ones(way):
    row = (1.0, 1.25, 1.5)
    assert kr.Body.cuboid(way(row), way((1.0, 0.5, -1.0))) == kr.Body.cuboid(row, (1.0, 0.5, -1.0))


@pytest.mark.parametrize("wrong", [10**400, np.nan, None, 1j])
def test_invalid_components_are_refused(wrong):
    with pytest.raises((TypeError, ValueError), match=r"^pivot must be (3 numbers|finite), not "):
        kr.Body.cuboid((1.0, 1.0, 1.0), (0, wrong, -1.0))


def test_integers_are_accepted():
    scene = kr.Scene(CORNER, momentum=(1, 0, -2), attitude=(0, 1, 0, 0), gravity=2)
    assert scene == kr.Scene(CORNER, (1.0, 0.0, -2.0), np.array((0, 1, 0, 0)), np.float32(2))
    assert type(scene.momentum[0]) is float and type(scene.gravity) is float


def test_a_scene_copies_its_arguments():
    row = [*MOMENTUM]
    scene = kr.Scene(CORNER, momentum=row, attitude=TILT, gravity=1)
    row[0] = 7.0
    assert scene == GENERAL and scene.replace(momentum=np.array(MOMENTUM)) == GENERAL


@pytest.mark.parametrize("method", ["exact", "taylor", "strang"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("way", WAYS)
def test_plain_times_equal_validated_ones(method, sign, way):
    scene, words = scene_for(method), words_for(method)
    times = tuple(sign * t for t in TIMES)
    plain, other = (kr.solve(scene, t, method, **words) for t in (times, way(times)))
    assert np.array_equal(plain.states, other.states) and plain.step == other.step
    assert plain.stats == other.stats and plain.t.tolist() == list(times)
    alone, path = (
        kr.solve(scene, times[-1:], method, **words),
        kr.solve(scene, times[-1], method, **words),
    )
    assert np.array_equal(alone.states[-1], path.states[-1]) and path.t.tolist() == [0.0, times[-1]]


def test_arrays_of_times_are_not_shared():
    times = np.array(TIMES)
    path = kr.solve(GENERAL, times)
    assert times.flags.writeable and not np.shares_memory(times, path.states)


def test_equal_arguments_of_another_type_are_validated():
    assert kr.solve(GENERAL, 1, "strang", step=1.0).step == 1.0
    with pytest.raises(TypeError, match="step must be a number, not True"):
        kr.solve(GENERAL, 1, "strang", step=True)
    assert kr.solve(GENERAL, 1, "strang", step=np.array(1.0)).step == 1.0
    assert kr.solve(GENERAL, 1, want=iter(["spin"])).want == ("spin",)
    with pytest.raises(ValueError, match="contains no quantity"):
        kr.solve(GENERAL, 1, want=iter([]))


def test_the_core_refuses_invalid_scenes():
    body, zero = CORNER._block, (0.0, 0.0, 0.0)
    assert core.scene(body, zero, (2.0, 0.0, 0.0, 0.0), 1.0, None) == "ERR_ATTITUDE"
    assert core.scene(body, zero, None, float("nan"), None) == "ERR_ARGUMENT"
    assert core.scene(body, zero, None, 1.0, (0.0, -1.0, 0.0)) == "ERR_ARGUMENT"
    for row in (zero[:2], (0.0, 0.0, "0"), (0.0, 0.0, True), 1.0, None, np.zeros((3, 1))):
        assert core.scene(body, row, None, 1.0, None) is None
        if row is not None:
            assert core.scene(body, zero, None, 1.0, row) is None
    with pytest.raises(TypeError):
        core.scene(body[:-1], zero, None, 1.0, None)


def test_body_frame_quantities_are_rotated_space_frame_quantities():
    path = kr.solve(GENERAL, [0.0, 0.7, 1.9])
    for name, in_space in (("velocity", path.velocity), ("momentum", path.m)):
        expected = [
            quaternion.turn_back(tuple(q), tuple(v)) for q, v in zip(path.q, in_space, strict=True)
        ]
        np.testing.assert_allclose(getattr(path, f"body_{name}"), expected, atol=1e-14)
    up = [quaternion.turn_back(tuple(q), (0.0, 0.0, 1.0)) for q in path.q]
    np.testing.assert_allclose(path.body_vertical, up, atol=1e-15)
    np.testing.assert_allclose(path.spin, (path.velocity * path.apex).sum(axis=1), atol=1e-14)


def test_euler_angles_agree_with_the_apex():
    path = kr.solve(GENERAL, np.linspace(0.0, 5.0, 50))
    phi, theta = path.precession_angle, path.nutation
    axis = np.stack([np.sin(phi) * np.sin(theta), -np.cos(phi) * np.sin(theta), np.cos(theta)], -1)
    np.testing.assert_allclose(axis, path.apex, atol=1e-14)
    rates = np.gradient(np.unwrap(np.stack([phi, path.spin_angle])), path.t, axis=1, edge_order=2)
    whole = rates[0] * np.cos(theta) + rates[1]
    np.testing.assert_allclose(whole[2:-2], path.spin[2:-2], rtol=0.02, atol=0.02)


def test_every_quantity_has_a_docstring():
    for name, quantity in QUANTITIES.items():
        text = getattr(kr.Path, name).__doc__
        assert text and name in dir(kr.Path), name
        if quantity.dimension:
            assert text.rstrip(".").endswith(f"[{quantity.dimension}]") or name in ("q", "m")
