"""Tests that ensembles broadcast, follow NumPy's indexing, and have members equal to scenes."""

import copy
import dataclasses
import pickle
import tracemalloc

import kreisel as kr
import numpy as np
import pytest
from internals import core
from scipy.spatial.transform import Rotation
from tops import CORNER, FREE, GENERAL, LAGRANGE

THESIS = kr.scenes.thesis

RNG = np.random.default_rng(7)
M, G = RNG.normal(size=(4, 3, 3)), RNG.normal(size=(4, 1))
Q, D = RNG.normal(size=(3, 4)), RNG.uniform(size=(3, 3))
Q /= np.linalg.norm(Q, axis=-1)[:, None]
MANY = kr.Bodies.cuboid(RNG.uniform(0.5, 1, (3, 3)), (0.1, 0.2, -1))
CONES = kr.Bodies.cone(1, RNG.uniform(0.5, 1, 3), (0, 0, 0), mass=1)
SPIN, TILT, RATE = RNG.uniform(20, 40, (4, 1)), RNG.uniform(0, 3, 3), RNG.normal(size=3)
FULL = kr.Ensemble(MANY, M, Q, G, damping=D)


def block(tops, index):
    return tops._core_scenes.block(int(np.ravel_multi_index(index, tops.shape)) if index else 0)


def assert_same(tops, scene_at):
    """Assert that each member of an ensemble is bitwise equal to the corresponding scene."""
    assert tops._core_scenes.check() == ("OK", tops.size)
    for index in np.ndindex(tops.shape):
        scene = scene_at(index)
        assert tops[index] == scene
        assert tops[index]._block == scene._block == block(tops, index)


def body_at(body, j):
    return body[j] if isinstance(body, kr.Bodies) else body


@pytest.mark.parametrize("body", [CORNER, MANY], ids=["one body", "many"])
@pytest.mark.parametrize("word", ["momentum", "velocity", "body_momentum", "body_velocity"])
def test_members_equal_scenes_with_the_same_arguments(word, body):
    tops = kr.Ensemble(body, attitude=Q, gravity=G, damping=D, **{word: M})
    assert tops.shape == (4, 3) and tops.ndim == 2 and tops.size == 12 and len(tops) == 4
    assert_same(
        tops,
        lambda index: kr.Scene(
            body_at(body, index[1]),
            attitude=Q[index[1]],
            gravity=G[index[0], 0],
            damping=D[index[1]],
            **{word: M[index]},
        ),
    )


def test_attitudes_are_accepted_in_every_form():
    turns = Rotation.from_quat(Q)
    single = Q.astype(np.float32)
    assert_same(
        kr.Ensemble(CORNER, velocity=M, attitude=turns, gravity=1),
        lambda index: kr.Scene(CORNER, velocity=M[index], attitude=turns[index[1]], gravity=1),
    )
    assert_same(
        kr.Ensemble(CORNER, velocity=M, attitude_xyzw=Q, damping=0.3, gravity=1),
        lambda index: kr.Scene(
            CORNER, velocity=M[index], attitude_xyzw=Q[index[1]], damping=0.3, gravity=1
        ),
    )
    attitudes = kr.Ensemble(CORNER, momentum=M, attitude=single, gravity=1).attitude
    np.testing.assert_allclose(np.linalg.norm(attitudes, axis=-1), 1, rtol=0, atol=3e-16)
    np.testing.assert_allclose(attitudes[0], Q, rtol=0, atol=1e-7)


@pytest.mark.parametrize("n", [(), (3,), (2, 3), (3, 3), (4, 1, 3), (0,), (2, 0)])
def test_ensembles_may_have_any_shape(n):
    m = RNG.normal(size=(*n, 3))
    tops = kr.Ensemble(CORNER, momentum=m, damping=(0.1, 0.2, 0.3), gravity=1)
    assert tops.shape == n and tops.gravity.shape == n and tops.attitude.shape == (*n, 4)
    assert np.array_equal(tops.momentum, m) and tops.damping.shape == (*n, 3)
    assert_same(tops, lambda index: kr.Scene(CORNER, m[index], damping=(0.1, 0.2, 0.3), gravity=1))


@pytest.mark.parametrize("body", [LAGRANGE.body, CONES], ids=["one body", "many"])
def test_textbook_starts_equal_single_scenes_bitwise(body):
    angles, rates = RNG.uniform(-3, 3, (4, 3, 3)), RNG.normal(size=(3, 3))
    assert_same(
        kr.Ensemble.from_euler(body, 40 * angles, rates, degrees=True, gravity=G),
        lambda index: kr.Scene.from_euler(
            body_at(body, index[1]),
            40 * angles[index],
            rates[index[1]],
            degrees=True,
            gravity=G[index[0], 0],
        ),
    )
    assert_same(
        kr.Ensemble.spinning(body, SPIN, TILT, RATE, damping=D, gravity=1),
        lambda index: kr.Scene.spinning(
            body_at(body, index[1]),
            SPIN[index[0], 0],
            TILT[index[1]],
            RATE[index[1]],
            damping=D[index[1]],
            gravity=1,
        ),
    )
    assert_same(
        kr.Ensemble.spinning(body, 50 * SPIN, 50 * TILT, degrees=True, gravity=1),
        lambda index: kr.Scene.spinning(
            body_at(body, index[1]),
            50 * SPIN[index[0], 0],
            50 * TILT[index[1]],
            degrees=True,
            gravity=1,
        ),
    )


@pytest.mark.parametrize("fast", [True, False])
@pytest.mark.parametrize("body", [LAGRANGE.body, CONES], ids=["one body", "many"])
def test_steady_precessions_equal_single_scenes_bitwise(body, fast):
    assert_same(
        kr.Ensemble.spinning(body, SPIN, TILT, steady=True, fast=fast, gravity=G),
        lambda index: kr.Scene.spinning(
            body_at(body, index[1]),
            SPIN[index[0], 0],
            TILT[index[1]],
            steady=True,
            fast=fast,
            gravity=G[index[0], 0],
        ),
    )


def test_general_bodies_may_start_from_angles_of_the_apex():
    angles = RNG.uniform(-3, 3, (3, 3))
    tops = kr.Ensemble.from_euler(MANY, angles, (0, 0, 1), gravity=1)
    assert_same(
        tops, lambda index: kr.Scene.from_euler(MANY[index], angles[index], (0, 0, 1), gravity=1)
    )
    # without a lever, the third axis is used
    spheres = kr.Bodies.sphere([1, 2, 3], (0, 0, 0), mass=1)
    assert_same(
        kr.Ensemble.spinning(spheres, 2.0, 1.0, gravity=1),
        lambda index: kr.Scene.spinning(spheres[index], 2.0, 1.0, gravity=1),
    )


KEYS = [
    *(0, -1, np.int64(1), slice(1, 3), slice(None, None, -1), ..., None, ()),
    *((1, 2), (-1, -1), (slice(None), 1), (..., 1), (0, ...), (slice(None), None, slice(1, None))),
    *([0, 2], ([0, 2], [1, 1]), (slice(None), [2, 0]), ([3, 0], slice(1)), (0, [1, 2])),
    *(np.array([[0, 1], [2, 3]]), np.arange(12).reshape(4, 3) % 3 == 0, [True, False, True, True]),
    *((np.array([True, False, True, True]), 1), np.zeros((4, 3), bool), slice(2, 2), [], True),
]


@pytest.mark.parametrize("key", KEYS, ids=str)
def test_indexing_follows_numpy(key):
    order = np.arange(12).reshape(4, 3)
    expected, selection = order[key], FULL[key]
    if not isinstance(expected, np.ndarray):
        assert isinstance(selection, kr.Scene) and selection._block == FULL._core_scenes.block(
            int(expected)
        )
        return
    assert isinstance(selection, kr.Ensemble) and selection.shape == expected.shape
    assert selection._core_scenes.check() == ("OK", expected.size)
    blocks = [block(selection, index) for index in np.ndindex(selection.shape)]
    assert blocks == [FULL._core_scenes.block(int(i)) for i in expected.ravel()]
    assert (
        len(selection.axes) == selection.ndim and pickle.loads(pickle.dumps(selection)) == selection
    )


@pytest.mark.parametrize("key", [4, -5, (0, 3), (0, 0, 0), "x", 1.5, [7], [[0.5]], 10**30, {}])
def test_invalid_indices_raise_index_error(key):
    with pytest.raises(IndexError):
        FULL[key]


def test_rows_and_other_shapes():
    row = FULL[0]
    assert [scene.gravity for scene in row] == [G[0, 0]] * 3 and len(list(FULL)) == 4
    assert all(isinstance(part, kr.Ensemble) for part in FULL)
    assert FULL.reshape(2, 6)[1, 1] == FULL[2, 1] == FULL.reshape((-1, 2))[3, 1]
    assert FULL.ravel().shape == (12,) and row.ravel() is row
    alone = kr.Ensemble(CORNER, momentum=(0, 0, 1), gravity=1)
    assert alone.reshape(1)[0] == alone[()] == alone[True][0] and alone.ravel().shape == (1,)
    with pytest.raises(ValueError, match="cannot reshape"):
        FULL.reshape(5, 2)
    with pytest.raises(TypeError, match="no length"):
        len(FULL[0, ...][1, ...])
    with pytest.raises(TypeError, match="shape \\(\\)"):
        iter(kr.Ensemble(CORNER, momentum=(0, 0, 1), gravity=1))


def test_scenes_in_lists_are_an_ensemble():
    again = kr.Ensemble.of([[FULL[i, j] for j in range(3)] for i in range(4)])
    assert again == FULL and again.coords == {}
    assert_same(again, lambda index: FULL[index])
    mixed = [LAGRANGE, GENERAL, FREE, kr.scenes.kowalewski]
    assert_same(kr.Ensemble.of(mixed), lambda index: mixed[index[0]])
    ensemble = kr.Ensemble.of([LAGRANGE, LAGRANGE.replace(gravity=2)])
    assert ensemble.body is LAGRANGE.body
    twin = LAGRANGE.replace(body=copy.copy(LAGRANGE.body))
    assert twin.body is not LAGRANGE.body
    assert kr.Ensemble.of([LAGRANGE, twin]).body is LAGRANGE.body
    assert kr.Ensemble.of(list(kr.starts(CORNER, energy=3, vertical=1, n=3, gravity=1))).shape == (
        3,
    )


@pytest.mark.filterwarnings("error")
def test_bodies_in_lists_stay_unphysical():
    odd = kr.Scene(kr.Body(1, (1, 1, 1), (0, 0, 3), unphysical=True), momentum=(0, 0, 1), gravity=1)
    tops = kr.Ensemble.of([odd, GENERAL])
    assert [tops[0].body.unphysical, tops[1].body.unphysical] == [True, False]


def test_shared_values_are_stored_once():
    n = 10**5
    m = np.random.default_rng(1).normal(size=(n, 3))
    tracemalloc.start()
    tops = kr.Ensemble(CORNER, momentum=m, damping=(0.1, 0.1, 0.1), gravity=1)
    memory = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert memory < 30 * n and tops.attitude.strides[0] == tops.gravity.strides[0] == 0
    assert len(pickle.dumps(tops[::2])) < 15 * n
    drag = kr.Ensemble(CORNER, momentum=m, damping=[[0.1]], gravity=1)
    assert pickle.loads(pickle.dumps(drag)) == drag and drag.damping.strides == (0, 0)
    momentum = np.broadcast_to(np.ones(3), (n, 3))
    assert kr.Ensemble(CORNER, momentum=momentum, gravity=1).momentum.strides[0] == 0


def test_ensembles_are_immutable():
    momentum = M.copy()
    tops = kr.Ensemble(CORNER, momentum=momentum, gravity=1)
    momentum[:] = np.nan
    assert np.array_equal(tops.momentum, M)
    for field in (tops.momentum, tops.attitude, tops.gravity, tops.damping, FULL[[0]].momentum):
        with pytest.raises(ValueError, match="read-only"):
            field[...] = 0
    with pytest.raises(dataclasses.FrozenInstanceError, match="constructs a new ensemble"):
        tops.momentum = M
    with pytest.raises(TypeError):
        hash(tops)


def test_copies_are_equal():
    for other in (copy.copy(FULL), copy.deepcopy(FULL), pickle.loads(pickle.dumps(FULL))):
        assert other == FULL and other[1, 2]._block == FULL[1, 2]._block
        assert other.axes == FULL.axes and [*other.coords] == [*FULL.coords]
    assert FULL[::-1] != FULL and FULL[:3] != FULL and FULL != LAGRANGE
    assert kr.Ensemble(CORNER, momentum=M, gravity=1) != kr.Ensemble(MANY, momentum=M, gravity=1)


def test_the_core_refuses_columns_of_another_shape():
    widths = 1, 3, 3, 4, 1, 3, 1, 1, 4, 3, 3, 3, 3, 1
    columns = [np.ones((2, k)) if k > 1 else np.ones(2) for k in widths]
    tops = core.Tops((2,), columns)
    assert len(tops) == 2 and tops.check() == ("ERR_ARGUMENT", 0)
    with pytest.raises(IndexError):
        tops.block(2)
    with pytest.raises(KeyError):
        tops.values("nothing")
    with pytest.raises(ValueError, match="wrong shape"):
        core.Tops((3,), columns)


# Boundary values


def test_the_nesting_of_lists_is_limited():
    def nest_list(depth):
        nested_list = THESIS
        for _ in range(depth):
            nested_list = [nested_list]
        return nested_list

    assert kr.Ensemble.of(nest_list(32)).shape == (1,) * 32
    for depth in (33, 34):
        with pytest.raises(ValueError, match="must not contain themselves"):
            kr.Ensemble.of(nest_list(depth))


def test_unequal_bodies_are_not_merged():
    one, other = (kr.Body(1.0, (4.0, 4.5, 3.0), (0.0, 0.0, z)) for z in (1.0, 1.5))
    mixed = kr.Ensemble.of([THESIS.replace(body=b) for b in (one, one, other)])
    np.testing.assert_array_equal(mixed.body.com[:, 2], [1.0, 1.0, 1.5])
    same = kr.Ensemble.of([THESIS.replace(body=one)] * 3)
    assert same.body is one


def test_zeros_of_either_sign_are_accepted():
    plus, minus = (kr.Body(1.0, (2.0, 2.0, 1.0), (z, 0.0, 0.5)) for z in (0.0, -0.0))
    both = kr.Ensemble.of([THESIS.replace(body=body) for body in (plus, minus)])
    assert both.shape == (2,) and np.all(both.body.com == [0.0, 0.0, 0.5])


def test_indices_may_be_arrays_without_dimensions():
    grid = GENERAL.vary(spin=np.array([[1.0], [2.0]]), gravity=[1.0, 2.0, 3.0])
    assert grid[np.array(1), np.array(2)] == grid[1, 2] != grid[1, 1]
    assert grid[0][np.array(1)] == grid[0, 1]
