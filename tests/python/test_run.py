"""Runs: the times asked for, paths that compute what is asked, failures, Ctrl-C, threads."""

import pickle
import signal
import subprocess
import sys
import threading
import time

import kreisel as kr
import numpy as np
import pytest
from kreisel import _core, quaternion

FIXED = [name for name, method in kr.methods.items() if not method.adaptive]
QUANTITIES = {
    "velocity": (3,),
    "torque": (3,),
    "frame": (3, 3),
    "apex": (3,),
    "kinetic": (),
    "potential": (),
    "energy": (),
    "vertical_momentum": (),
    "axial_momentum": (),
    "kowalewski": (),
    "goryachev_chaplygin": (),
}
CORNER = kr.Body.cuboid(half=(0.6, 0.8, 1), pivot=(0.1, -0.2, -1))
SCENE = kr.Scene(CORNER, momentum=(0.172, -1.862, 1.46), attitude=(0.8, 0.4, -0.2, 0.4))


def matrix(q):
    return np.array([quaternion.turn(q, e) for e in np.eye(3).tolist()]).T


def test_times():
    path = kr.solve(SCENE, 1, "strang", step=0.1)
    assert path.t.tolist() == [0, 1] and len(path) == 2
    assert kr.solve(SCENE, [0.3, 0.3, 1.0], "strang", step=0.1).t.tolist() == [0.3, 0.3, 1.0]
    assert kr.solve(SCENE, 1, "strang", step=0.1, every=3).t.tolist() == [
        0,
        3 * 0.1,
        6 * 0.1,
        9 * 0.1,
    ]
    assert kr.solve(SCENE, -0.35, "strang", step=0.1, every=1).t.tolist() == [
        0,
        -0.1,
        -0.2,
        -3 * 0.1,
    ]
    assert kr.solve(SCENE, 3 * 0.1, "strang", step=0.1, every=1).t.tolist() == [
        0,
        0.1,
        0.2,
        3 * 0.1,
    ]
    assert kr.solve(SCENE, 0.3, "strang", step=0.1, every=1).t.tolist() == [0, 0.1, 0.2, 3 * 0.1]
    assert kr.solve(SCENE, 0, "strang", step=0.1, every=1).t.tolist() == [0]
    assert kr.solve(SCENE, np.float32(0.5), "strang", step=0.25).t.tolist() == [0, 0.5]


def test_no_times_give_an_empty_path():
    path = kr.solve(SCENE, [])
    assert (
        len(path) == 0
        and path.t.shape == (0,)
        and path.q.shape == (0, 4)
        and path.energy_error == 0
    )
    for name, shape in QUANTITIES.items():
        assert getattr(path, name).shape == (0, *shape)
    assert "0 states" in repr(path)
    with pytest.raises(IndexError):
        path.end


def test_start_is_as_given():
    path = kr.solve(SCENE, 1)
    assert tuple(path.q[0]) == SCENE.attitude and tuple(path.m[0]) == SCENE.momentum


@pytest.mark.parametrize("name", ["auto", *FIXED])
def test_states_do_not_depend_on_what_else_was_asked_for(name):
    scene = kr.scenes.dzhanibekov if name == "hirota_kimura" else kr.scenes.thesis
    how = {} if name == "auto" else {"step": 0.07}
    alone = kr.solve(scene, 2.0, name, **how)
    among = kr.solve(scene, np.linspace(0, 2.0, 57), name, **how)
    assert np.array_equal(alone.states[-1], among.states[-1])


def test_auto_is_taylor():
    path = kr.solve(SCENE, 3)
    assert (path.method, path.tol, path.step) == ("taylor", None, None)
    assert np.array_equal(path.states, kr.solve(SCENE, 3, method="taylor").states)
    assert kr.solve(SCENE, 3, tol=1e-6).tol == 1e-6


def test_back_in_time():
    there = kr.solve(SCENE, 4, tol=1e-12)
    back = kr.solve(there.end, [-1, -4], tol=1e-12)
    assert kr.attitude_error(back.q[-1], SCENE.attitude) < 1e-8
    assert kr.solve(SCENE, -4, "rk4", step=0.01).step == -0.01


def test_shapes_and_views():
    path = kr.solve(SCENE, np.linspace(0, 1, 5))
    for view, shape in ((path.t, (5,)), (path.q, (5, 4)), (path.m, (5, 3))):
        assert np.shares_memory(view, path.states) and view.shape == shape
    assert np.array_equal(path.q_xyzw, np.roll(path.q, -1, axis=1))
    for name, shape in QUANTITIES.items():
        values = getattr(path, name)
        assert values.shape == (5, *shape) and values is getattr(path, name)
        with pytest.raises(ValueError, match="read-only"):
            values[...] = 0
    with pytest.raises(ValueError, match="read-only"):
        path.q[0] = 0


def test_quantities_from_their_definitions():
    path = kr.solve(SCENE, [0, 0.7, 1.9])
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


@pytest.mark.parametrize("name", [name for name in QUANTITIES if name != "energy"])
def test_nothing_is_computed_unasked(name, monkeypatch):
    called, values = [], _core.values
    monkeypatch.setattr(_core, "values", lambda name, *a: called.append(name) or values(name, *a))
    path = kr.solve(SCENE, 1, "strang", step=0.1, every=1)
    repr(path), len(path), path.t, path.q, path.m, path.end
    assert called == []
    getattr(path, name), getattr(path, name)
    assert called == [name]


def test_unknown_names_get_a_hint():
    path = kr.solve(SCENE, [1.0])
    with pytest.raises(AttributeError, match="did you mean 'velocity'"):
        path.velocty
    with pytest.raises(AttributeError, match="there are .*energy"):
        path.nothing_like_it
    assert not hasattr(path, "plane")


def test_path_is_pickled_with_its_scene():
    path = kr.solve(SCENE, 1)
    path.energy
    again = pickle.loads(pickle.dumps(path))
    assert (
        np.array_equal(again.states, path.states)
        and again.scene == SCENE
        and again.stats == path.stats
    )


def test_scene_at_goes_on():
    path = kr.solve(SCENE, 2, "strang", step=0.125, every=8)
    on = kr.solve(path.scene_at(1), 1, "strang", step=0.125)
    assert kr.attitude_error(on.q[-1], path.q[-1]) < 1e-13
    assert path.end == path.scene_at(-1) and path.end.body == CORNER
    with pytest.raises(IndexError):
        path.scene_at(3)


def test_rotations():
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    path = kr.solve(SCENE, [0, 1, 2])
    np.testing.assert_allclose(
        path.rotation.apply(CORNER.com), path.apex * np.linalg.norm(CORNER.com), atol=1e-14
    )
    rotation = Rotation.from_rotvec((0.1, -0.7, 0.4))
    np.testing.assert_allclose(matrix(kr.from_rotation(rotation)), rotation.as_matrix(), atol=1e-15)
    with pytest.raises(ValueError, match="rotation must be 4 numbers"):
        kr.from_rotation(path.rotation)


# Failures, interruption, threads


def test_limit_of_steps():
    with pytest.raises(
        kr.Error, match="largest number of steps.*rk4 got to t = 0.1 of 1 in 10 steps"
    ) as failure:
        kr.solve(SCENE, [0, 0.055, 1], "rk4", step=0.01, max_steps=10)
    error = failure.value
    assert error.status == "ERR_LIMIT" and isinstance(error, RuntimeError)
    assert error.path.t.tolist() == [0, 0.055, 0.1] and error.path.stats.steps == 10
    full = kr.solve(SCENE, [0, 0.055, 0.1], "rk4", step=0.01, max_steps=10)
    assert np.array_equal(error.path.states, full.states)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.status) == (kr.Error, str(error), error.status)
    assert np.array_equal(again.path.states, full.states)


@pytest.mark.parametrize("first, reached", [(0.0, [0, 1.5]), (1.0, [1, 1.5]), (50.0, [1.5])])
def test_a_state_that_stops_being_finite(first, reached):
    wild = SCENE.replace(momentum=(5, -10, 5), attitude=(1, 0, 0, 0))
    with pytest.raises(kr.Error, match="finite.* in 3 steps") as failure:
        kr.solve(wild, [first, 50.0], "rk4", step=0.5)
    path = failure.value.path
    assert failure.value.status == "ERR_NOT_FINITE" and path.t.tolist() == reached
    assert np.isfinite(path.states).all()
    assert np.array_equal(path.states[-1], kr.solve(wild, 1.5, "rk4", step=0.5).states[-1])


def test_tolerance_out_of_reach():
    with pytest.raises(kr.Error) as failure:
        kr.solve(SCENE, 1, tol=1e-300)
    assert failure.value.status == "ERR_STEP" and failure.value.path.t.tolist()[0] == 0


ENDLESS = {
    "fixed": 'method="rk4", step=1e-3',
    "adaptive": "tol=1e-12",
    "detours": 'method="strang", step=1e-3',
}


@pytest.mark.parametrize("kind", ENDLESS)
def test_ctrl_c_stops_a_run(kind):
    times = "np.arange(0, 400_000) * 0.1005" if kind == "detours" else "[0, 1e8]"
    code = f"""
import os, signal, threading, time, numpy as np, kreisel as kr
threading.Timer(0.5, lambda: (globals().update(sent=time.perf_counter()), os.kill(os.getpid(), signal.SIGINT))).start()
try:
    kr.solve(kr.scenes.asymmetric, {times}, {ENDLESS[kind]})
except kr.Interrupted as stopped:
    assert isinstance(stopped, KeyboardInterrupt) and stopped.status == "ERR_INTERRUPTED"
    print(time.perf_counter() - sent, len(stopped.path), stopped.path.t[-1])
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    seconds, states, reached = map(float, done.stdout.split())
    assert seconds < 2 and states >= 2 and reached > 0


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs a timer with a signal")
def test_other_signals_raise_what_their_handler_raises():
    def handler(*_):
        raise TimeoutError("enough")

    before = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, 0.1)
    try:
        with pytest.raises(TimeoutError, match="enough"):
            kr.solve(SCENE, 1e8, "rk4", step=1e-3)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_threads_run_side_by_side_with_the_bits_of_one():
    scenes = [SCENE.replace(momentum=(0.1 * i, 1, 2)) for i in range(8)]
    alone = [kr.solve(scene, 200, "rk4", step=1e-3, every=1000).states for scene in scenes]
    among = {}

    def run(i):
        among[i] = kr.solve(scenes[i], 200, "rk4", step=1e-3, every=1000).states

    threads = [threading.Thread(target=run, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    ticks = 0
    while any(thread.is_alive() for thread in threads):
        time.sleep(1e-3)
        ticks += 1
    assert ticks > 3, "Python did not go on while the threads ran"
    assert all(np.array_equal(among[i], alone[i]) for i in range(8))
