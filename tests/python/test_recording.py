"""Tests of the output times, error estimates and derived quantities of paths."""

import copy
import os
import pickle
import threading
import time

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits
from internals import QUANTITIES, state_quantities
from tops import CORNER, FIXED, GENERAL, matrix, scene_for

TOP = kr.scenes.asymmetric

COMPUTED = {name: quantity.shape for name, quantity in QUANTITIES.items() if name not in ("q", "m")}


@pytest.mark.parametrize(
    "t, every, expected",
    [
        (1, None, [0, 1]),
        ([0.3, 0.3, 1.0], None, [0.3, 0.3, 1.0]),
        (1, 3, [0, 3 * 0.1, 6 * 0.1, 9 * 0.1]),
        (-0.35, 1, [0, -0.1, -0.2, -3 * 0.1]),
        (3 * 0.1, 1, [0, 0.1, 0.2, 3 * 0.1]),
        (0.3, 1, [0, 0.1, 0.2, 3 * 0.1]),
        (0, 1, [0]),
        (np.float32(0.5), None, [0, 0.5]),
    ],
)
def test_states_are_recorded_at_the_requested_times(t, every, expected):
    words = {} if every is None else {"every": every}
    path = kr.solve(GENERAL, t, "strang", step=0.1, **words)
    assert path.t.tolist() == expected and len(path) == len(expected)


def test_an_empty_list_of_times_gives_an_empty_path():
    path = kr.solve(GENERAL, [])
    assert (
        len(path) == 0
        and path.t.shape == (0,)
        and path.q.shape == (0, 4)
        and path.energy_error == 0
    )
    for name, shape in COMPUTED.items():
        assert getattr(path, name).shape == (0, *shape)
    assert "0 states" in repr(path)
    with pytest.raises(IndexError):
        _ = path.end


def test_the_initial_state_is_recorded_as_given():
    path = kr.solve(GENERAL, 1)
    assert tuple(path.q[0]) == GENERAL.attitude and tuple(path.m[0]) == GENERAL.momentum


@pytest.mark.parametrize("name", ["auto", *FIXED])
def test_states_do_not_depend_on_other_requests(name):
    scene = kr.scenes.thesis if name == "auto" else scene_for(name)
    options = {} if name == "auto" else {"step": 0.07}
    alone = kr.solve(scene, 2.0, name, **options)
    dense = kr.solve(scene, np.linspace(0, 2.0, 57), name, **options)
    assert np.array_equal(alone.states[-1], dense.states[-1])


def test_auto_is_taylor():
    path = kr.solve(GENERAL, 3)
    assert (path.method, path.tol, path.step) == ("taylor", None, None)
    assert np.array_equal(path.states, kr.solve(GENERAL, 3, method="taylor").states)
    assert kr.solve(GENERAL, 3, tol=1e-6).tol == 1e-6


def test_integration_backward_returns_to_the_start():
    path = kr.solve(GENERAL, 4, tol=1e-12)
    back = kr.solve(path.end, [-1, -4], tol=1e-12)
    assert kr.attitude_error(back.q[-1], GENERAL.attitude) < 1e-8
    assert kr.solve(GENERAL, -4, "rk4", step=0.01).step == -0.01


def test_states_are_views_and_quantities_are_cached_and_read_only():
    path = kr.solve(GENERAL, np.linspace(0, 1, 5))
    for view, shape in ((path.t, (5,)), (path.q, (5, 4)), (path.m, (5, 3))):
        assert np.shares_memory(view, path.states) and view.shape == shape
    assert np.array_equal(path.q_xyzw, np.roll(path.q, -1, axis=1))
    for name, shape in COMPUTED.items():
        values = getattr(path, name)
        assert values.shape == (5, *shape) and values is getattr(path, name)
        with pytest.raises(ValueError, match="read-only"):
            values[...] = 0
    with pytest.raises(ValueError, match="read-only"):
        path.q[0] = 0


def test_quantities_agree_with_their_definitions():
    path = kr.solve(GENERAL, [0, 0.7, 1.9])
    tensor, mass, com = np.array(CORNER.inertia), CORNER.mass, np.array(CORNER.com)
    for i, q in enumerate(matrix(tuple(q)) for q in path.q):
        m, a = path.m[i], q @ com
        velocity = np.linalg.solve(q @ tensor @ q.T, m)
        np.testing.assert_allclose(path.velocity[i], velocity, rtol=1e-13)
        np.testing.assert_allclose(path.torque[i], mass * np.cross((0, 0, 1), a), atol=1e-14)
        np.testing.assert_allclose(path.apex[i], a / np.linalg.norm(a), atol=1e-15)
        np.testing.assert_allclose(path.frame[i], (q @ matrix(CORNER.axes)).T, atol=1e-14)
        np.testing.assert_allclose(path.energy[i], 0.5 * velocity @ m + mass * a[2], rtol=1e-13)
        np.testing.assert_allclose(path.axial_momentum[i], m @ a / np.linalg.norm(a), rtol=1e-13)
        assert path.vertical_momentum[i] == m[2]
    assert np.isnan(path.kowalewski).all() and np.isnan(path.modified_energy(0.1)).all()
    size = path.kinetic.max() + mass * np.linalg.norm(com)
    assert path.energy_error == pytest.approx(
        np.abs(path.energy - path.energy[0]).max() / size, rel=1e-6
    )


@pytest.mark.parametrize("name", COMPUTED)
def test_quantities_are_computed_on_first_access(name, monkeypatch):
    calls, original = [], state_quantities.values
    monkeypatch.setattr(
        state_quantities,
        "values",
        lambda word, *words: calls.append(word) or original(word, *words),
    )
    path = kr.solve(GENERAL, 1, "strang", step=0.1, every=1)
    repr(path), len(path), path.t, path.q, path.m, path.end
    assert calls == []
    getattr(path, name), getattr(path, name)
    assert calls == [name]


def test_unknown_names_get_a_hint():
    path = kr.solve(GENERAL, [1.0])
    with pytest.raises(AttributeError, match="did you mean 'velocity'"):
        _ = path.velocty
    with pytest.raises(AttributeError, match=r"known are .*energy"):
        _ = path.nothing_like_it
    assert not hasattr(path, "plane")


def test_a_path_is_pickled_with_its_scene():
    path = kr.solve(GENERAL, 1)
    _ = path.energy
    again = pickle.loads(pickle.dumps(path))
    assert (
        np.array_equal(again.states, path.states)
        and again.scene == GENERAL
        and again.stats == path.stats
    )


def test_scene_at_continues_the_motion():
    path = kr.solve(GENERAL, 2, "strang", step=0.125, every=8)
    next_path = kr.solve(path.scene_at(1), 1, "strang", step=0.125)
    assert kr.attitude_error(next_path.q[-1], path.q[-1]) < 1e-13
    assert path.end == path.scene_at(-1) and path.end.body == CORNER
    with pytest.raises(IndexError):
        path.scene_at(3)


def test_rotations_equal_those_of_scipy():
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    path = kr.solve(GENERAL, [0, 1, 2])
    np.testing.assert_allclose(
        path.rotation.apply(CORNER.com), path.apex * np.linalg.norm(CORNER.com), atol=1e-14
    )
    rotation = Rotation.from_rotvec((0.1, -0.7, 0.4))
    np.testing.assert_allclose(matrix(kr.from_rotation(rotation)), rotation.as_matrix(), atol=1e-15)
    with pytest.raises(ValueError, match="rotation must be a single rotation"):
        kr.from_rotation(path.rotation)


def test_parallel_threads_give_the_same_bits():
    scenes = [GENERAL.replace(momentum=(0.1 * i, 1, 2)) for i in range(8)]
    alone = [kr.solve(scene, 200, "rk4", step=1e-3, every=1000).states for scene in scenes]
    parallel = {}

    def run(i):
        parallel[i] = kr.solve(scenes[i], 200, "rk4", step=1e-3, every=1000).states

    threads = [threading.Thread(target=run, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    ticks = 0
    while any(thread.is_alive() for thread in threads):
        time.sleep(1e-3)
        ticks += 1
    assert ticks > 3, "the main thread was blocked while the other threads ran"
    assert all(same_bits(parallel[i], alone[i]) for i in range(8))


def list_nearly_symmetric_tops():
    yield (
        "beside the axis",
        kr.Body(1, (1, 1, 0.5), (0.8e-12, 0, 1), unphysical=True),
        (0, 0, 1.0),
        1.0,
        30.0,
    )
    yield (
        "almost symmetric",
        kr.Body(1, (1, 1 + 7e-13, 0.6), (0, 0, 1), unphysical=True),
        (0.3, 0.1, 2.0),
        1.0,
        50.0,
    )
    body = kr.Body(1, (1, 1 + 6e-13, 1 - 2e-13), (0.6, 0.5, 0.4), unphysical=True)
    yield "almost spherical", body, (0.3, -0.9, 1.1), 0.0, 1000.0
    yield (
        "of its kind",
        kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True),
        (0.3, 0, 1.0),
        1.0,
        40.0,
    )
    yield "upright", kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True), (1e-7, 0, 1.0), 1.0, 60.0


@pytest.mark.parametrize("case", list(list_nearly_symmetric_tops()), ids=lambda case: case[0])
@pytest.mark.parametrize(
    "method, step",
    [("bobenko_suris4", 0.01), ("kahan_li8", 0.05), ("strang", 0.01), ("taylor", None)],
)
def test_the_error_of_a_path_is_within_a_factor_of_3(case, method, step):
    _, body, momentum, gravity, end = case
    scene = kr.Scene(body, momentum=momentum, gravity=gravity)
    times = np.linspace(0, end, 41)
    if not kr.methods[method].suits(scene):
        pytest.skip("not for this body")
    path = kr.solve(scene, times, method, step=step)
    true = kr.attitude_error(path.q, kr.solve(scene, times, digits=30).q).max()
    assert true / 3 <= path.error <= 3 * true + 1e-16


def test_closed_forms_do_not_overestimate_their_error():
    """Check the error estimate of the closed form for a free body that flips over."""
    body = kr.Body(1.0, (4.483167597121757, 3.657682742032973, 1.0048569934661162), (0, 0, 0))
    momentum = -1.8363240592035863e-08, 8.840258465238069, -1.3362217851799154e-08
    times = np.linspace(0, 28, 41)
    path, short, long = (
        kr.solve(kr.Scene(body, momentum=momentum, gravity=0.0), times, digits=digits)
        for digits in (None, 20, 30)
    )
    true = kr.attitude_error(path.q, long.q).max()
    assert path.method == "exact" and kr.attitude_error(short.q, long.q).max() > 100 * true
    assert true / 3 <= path.error <= 3 * true + 1e-16


def test_the_error_of_30_digits_is_at_least_their_rounding():
    for scene in (kr.scenes.asymmetric, kr.scenes.thesis, kr.scenes.kowalewski):
        assert kr.solve(scene, 20.0, digits=30).error > 1e-32
    lingering = kr.Scene(
        kr.Body(1, (1, 2, 2.5), (0, 0, 0)), momentum=(1e-5, 2.7, -1.6e-5), gravity=0.0
    )
    assert kr.solve(lingering, 80.0, digits=30).error > 5e-28


@pytest.mark.parametrize("want", [None, ("energy", "apex")])
@pytest.mark.parametrize(
    "make_copy", [copy.copy, copy.deepcopy, lambda path: pickle.loads(pickle.dumps(path))]
)
def test_a_copy_of_a_path_is_read_only(want, make_copy):
    path = kr.solve(kr.scenes.asymmetric, [0.0, 1.0, 2.0], want=want)
    twin = make_copy(path)
    for name in ("t", "energy", "apex") + (() if want else ("states", "q", "m")):
        assert np.array_equal(getattr(twin, name), getattr(path, name))
        with pytest.raises(ValueError, match="read-only"):
            getattr(twin, name)[0] = 7.0


def test_the_energy_error_is_the_largest_along_the_path():
    path = kr.solve(kr.scenes.asymmetric, 20.0, "strang", step=0.1, every=1)
    scene = path.scene
    lever = scene.body.mass * abs(scene.gravity) * np.linalg.norm(scene.body.com)
    change = np.abs(path.energy - path.energy[0])
    assert change.max() > 100 * change[change > 0].min()
    largest = change.max() / (path.kinetic.max() + lever)
    assert path.energy_error == pytest.approx(largest, rel=1e-12)


def test_the_viewer_refuses_gsl_auto_and_steps_that_it_cannot_represent():
    for methods in ("auto", "gsl_rk8pd", ["strang", "auto"]):
        with pytest.raises(
            ValueError, match=r"viewer has no '(auto|gsl_rk8pd)'|'gsl_rk8pd' is not in this build"
        ):
            kr.view(kr.scenes.asymmetric, methods=methods, open=False)
    for step in (2e-7, 2148.0, 1.5e-6):
        with pytest.raises(ValueError, match="whole millionths"):
            kr.view(kr.scenes.asymmetric, step=step, open=False)
    assert kr.view(kr.scenes.asymmetric, step=2147.0, open=False)


TOPS = kr.scenes.asymmetric.scatter(3, seed=1, momentum=0.1)
RESULTS = {
    "path": lambda: kr.solve(GENERAL, [1.0, 2.0], events=kr.events.nutation()),
    "tangents": lambda: kr.solve(GENERAL, [1.0, 2.0], tangents="start"),
    "paths": lambda: kr.solve(TOPS, [1.0, 2.0]),
    "events": lambda: kr.solve(TOPS, [9.0], events=kr.events.nutation()).events,
    "reduced": lambda: kr.reduce(TOPS, [1.0], {"nutation": "max"}),
    "section": lambda: kr.section(TOPS, n=3),
    "indicator": lambda: kr.lyapunov(TOPS, 5.0),
    "frequencies": lambda: kr.frequencies(kr.solve(GENERAL, np.linspace(0, 9, 99))),
}
FRESH = "failed", "q_xyzw"  # computed anew at each access


@pytest.mark.parametrize("name", RESULTS)
@pytest.mark.parametrize(
    "make_copy", [lambda one: one, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))]
)
def test_arrays_of_a_result_and_of_its_copies_are_read_only(name, make_copy):
    result = make_copy(RESULTS[name]())
    names = [n for n in {*dir(type(result)), *vars(result)} if n[0] != "_" and n not in FRESH]
    arrays = {n: value for n in names if isinstance(value := getattr(result, n, None), np.ndarray)}
    assert arrays and not [n for n, value in arrays.items() if value.flags.writeable]


# Boundary values


def test_unknown_memory_size_counts_as_enough(monkeypatch):
    def raise_value_error(_):
        raise ValueError("unrecognized configuration name")

    with monkeypatch.context() as broken:
        broken.setattr(os, "sysconf", raise_value_error)
        assert len(kr.solve(TOP, 1.0, "rk4", step=0.01, every=10)) == 11
