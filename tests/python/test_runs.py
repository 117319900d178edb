"""Tests of streams and runs beyond the laws: saved, stopped, pushed, reset and changed."""

import copy
import itertools
import math
import pickle
import threading
import zlib

import kreisel as kr
import numpy as np
import pytest
from drawn_tops import assert_same_bits, assert_same_path
from tops import CORNER, LAGRANGE, TILT, scene_for, words_for

TOP = kr.scenes.asymmetric
IMPULSE = (0.25, -0.125, 0.5)
AFTER = np.array([0.0, 0.5, 0.75, 2.0])


def start(name):
    """Start a run with the method and number of digits given by a name such as "taylor 30"."""
    method, _, digits = name.partition(" ")
    words = words_for(method) | ({"digits": int(digits)} if digits else {})
    return kr.start(scene_for(method), method, **words)


# Streams and saved runs


def test_streams_may_be_endless_and_refuse_times_that_go_back():
    grid = kr.stream(TOP, math.inf, "strang", step=0.01, every=10, chunk=100)
    states = np.concatenate([path.states for path in itertools.islice(grid, 5)])
    grid.close()
    whole = kr.solve(TOP, 49.9, "strang", step=0.01, every=10)
    assert np.array_equal(states, whole.states)
    back = next(kr.stream(TOP, -math.inf, "strang", step=0.01, every=10, chunk=3))
    assert back.t.tolist() == [0, -0.1, -0.2]
    times = kr.stream(TOP, iter([1.0, 2.0, 3.0, 2.5]), chunk=2)
    assert next(times).t.tolist() == [1, 2]
    with pytest.raises(ValueError, match="goes back"):
        next(times)


def test_a_run_advances_in_one_direction_up_to_its_largest_number_of_steps():
    run = kr.start(TOP, "strang", step=0.01, max_steps=210)
    assert (run.t, tuple(run.stats)) == (0.0, (0, 0, 0, 0)) and run.to([]).stats == run.stats
    assert run.to(1).t.tolist() == [0, 1] and run.to(2).t.tolist() == [1, 2] and run.t == 2
    assert run.to(2.1, every=5).t.tolist() == [205 * 0.01, 210 * 0.01]
    for t in ([1.0], -3):
        with pytest.raises(ValueError, match="goes back"):
            run.to(t)
    with pytest.raises(kr.Error, match="steps"):
        run.to(3)
    rest = kr.resume(run.checkpoint, max_steps=0).to(3)
    assert np.array_equal(rest.states[-1], kr.solve(TOP, 3, "strang", step=0.01).states[-1])
    assert "strang at t = 2.1" in repr(run) and run.stats.steps == 210
    run.push(IMPULSE)  # counts the steps anew
    assert run.stats.steps == 0 and run.to(3.0).stats.steps == 90


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ArithmeticError])
@pytest.mark.parametrize(
    "method, words", [("rk4", {"step": 1e-3}), ("taylor", {"digits": 30}), ("extrap", {})]
)
def test_a_stopped_run_continues_with_the_same_bits(method, words, stop):
    def tell(t):
        raise stop

    run = kr.start(TOP, method, **words)
    with pytest.raises((kr.Interrupted, ArithmeticError)):
        run.to(1e6, progress=tell)
    assert 0 < run.t < 1e6
    times = [run.t + 0.5, run.t + 3]
    whole = kr.solve(TOP, times, method, **words)
    assert_same_bits(kr.resume(run.checkpoint).to(times).states, whole.states)
    assert_same_bits(run.to(times).states, whole.states)


def sign_checkpoint(body):
    return b"kreisel run\n%08x\n" % zlib.crc32(body) + body


def test_damaged_checkpoints_are_refused(tmp_path):
    run = kr.start(TOP, want=("energy",))
    run.to(5)
    whole, random = run.checkpoint, np.random.default_rng(3)
    bad = [b"", whole[:-1], whole[:100], whole + b"x", random.bytes(len(whole))]
    for i in [*range(200), *random.integers(0, len(whole), 300)]:
        bad.append(bytearray(whole))
        bad[-1][i] ^= 1 << random.integers(0, 8)
    starts = (b"3", b"[1.0]", b"[1.0, [1.0]]", b'["a", null]', b"[1e300, null]")
    bad += [sign_checkpoint(whole[21:].replace(b"gravity = 1.0", b"gravity = 2.0"))]
    bad += [sign_checkpoint(whole[21:].replace(b'"start": null', b'"start": ' + x)) for x in starts]
    for data in bad:
        with pytest.raises(ValueError, match="checkpoint"):
            kr.resume(bytes(data))
    (tmp_path / "odd").write_bytes(b"kreisel run\nnothing of the kind")
    with pytest.raises(ValueError, match="odd"):
        kr.resume(tmp_path / "odd")
    with pytest.raises(FileNotFoundError):
        kr.resume(tmp_path / "none")


def test_resuming_with_another_kernel_warns():
    run = kr.start(TOP)
    run.to(5)
    whole, own = run.checkpoint, run.plan.kernel.encode()
    other = b"avx512" if own == b"base" else b"base"
    body = whole[21:].replace(b'"kernel": "' + own, b'"kernel": "' + other)
    with pytest.warns(UserWarning, match="rounding"):
        kr.resume(sign_checkpoint(body))
    assert kr.resume(whole).t == 5


def test_assignment_to_results_and_runs_raises():
    path, tops = kr.solve(kr.scenes.cusps, [0.0, 1.0]), TOP.scatter(3, momentum=0.1)
    for one in (kr.start(TOP), path, kr.solve(tops, [1.0]), kr.exact(kr.scenes.cusps)):
        for name in ("momentum", "t", "gravty"):
            with pytest.raises(AttributeError):
                setattr(one, name, 1.0)


# Changes of a motion


def test_a_reset_changes_only_the_given_values():
    run = kr.start(TOP, digits=30)
    state = run.to([2.0])
    run.reset(attitude=TILT)
    path = run.to([2.0])
    assert run.scene.attitude == TILT and run.scene.momentum == tuple(state.m[0])
    assert not path.q_low.any() and np.array_equal(path.m_low, state.m_low) and path.m_low.any()
    run.reset(velocity=(0.5, 0.25, -1.0))
    assert np.abs(run.to([2.0]).velocity - (0.5, 0.25, -1.0)).max() < 1e-15
    run.reset(body_momentum=(1.0, 2.0, 3.0), attitude_xyzw=(1, 0, 0, 0))
    assert run.scene.attitude == (0, 1, 0, 0) and run.scene.momentum == (1.0, -2.0, -3.0)


TENSOR = ((3.0, -0.25, 0.5), (-0.25, 2.5, 0.125), (0.5, 0.125, 1.5))
TURNED = kr.Body(mass=2.0, inertia=TENSOR, com=(0.2, -0.3, 0.25))


def test_changes_of_momentum_and_body_keep_30_digits():
    """Apply an impulse and its opposite, and replace the body and restore it."""
    scene = kr.Scene(CORNER, momentum=(1, 2, 3), attitude=TILT, gravity=1)
    run, other = (kr.start(scene, digits=30) for _ in range(2))
    before = run.to([2.0])
    other.to([2.0])
    run.change(body=TURNED)
    other.push(IMPULSE)
    other.push(tuple(-x for x in IMPULSE))
    for body in (TURNED, CORNER):
        other.change(body=body, keep="velocity")
        after, speed = other.to([2.0]), np.linalg.norm(before.velocity)
        assert np.abs(after.velocity - before.velocity).max() < 1e-15 * speed
    for after, most in ((run.to([2.0]), 0.0), (other.to([2.0]), 1e-29)):
        error = (after.m - before.m) + (after.m_low - before.m_low)
        assert np.abs(error).max() <= most and np.array_equal(after.q_low, before.q_low)
        assert before.m_low.any()


def test_a_changed_run_uses_its_new_body_gravity_and_damping(tmp_path):
    run = kr.start(TOP, "taylor")
    changes = {"body": TURNED}, {"gravity": -2.0}, {"damping": 0.25}, {"body": CORNER, "damping": 0}
    for change in changes:
        end = run.to(run.t + 1.0).end
        run.change(**change)
        run = kr.resume(run.checkpoint)
        path = run.to(run.t + AFTER)
        assert path.scene == run.scene == end.replace(**change)
        fresh = kr.solve(path.scene, AFTER, "taylor")
        assert np.array_equal(path.states[:, 1:], fresh.states[:, 1:])
        assert np.array_equal(path.energy, fresh.energy) and path.error == fresh.error
    path.save(tmp_path / "path")
    for one in (path, kr.load(tmp_path / "path"), path[1:]):
        assert one.start_time == run.start_time and np.array_equal(one(path.t).states, path.states)
        with pytest.raises(ValueError, match="times"):
            one(run.start_time - 1.0)
    run = kr.start(kr.scenes.cusps, "exact")  # the kind of the closed form changes
    run.reset(momentum=(0.4, -0.3, 0.7), attitude=TILT)
    for body in (kr.scenes.kowalewski.body, kr.scenes.cusps.body):
        run.change(body=body)
        path, fresh = run.to(run.t + AFTER), kr.solve(run.scene, AFTER, "exact")
        assert np.array_equal(path.states[:, 1:], fresh.states[:, 1:])


@pytest.mark.parametrize("end", [4.0, -4.0, math.inf, -math.inf])
def test_the_grid_begins_at_the_time_of_the_change(end):
    sign = math.copysign(1.0, end)
    run = kr.start(TOP, "strang", step=0.125, back=end < 0.0)
    run.to(0.3 * sign)
    run.push(IMPULSE)
    stream = run.stream(end, every=2, chunk=3)
    times = [t for _ in range(2) for t in next(stream).t.tolist()]
    assert times == [0.3 * sign + sign * 0.25 * k for k in range(6)]


def test_a_top_can_be_pushed_at_each_terminal_event():
    """Check that a top conserves its energy when it bounces off an obstacle at a given height."""
    floor = kr.events.crossing("apex_z", 0.5, direction=-1, terminal=True)
    top = kr.Scene.spinning(LAGRANGE.body, spin=0.0, tilt=0.5, gravity=1)
    run, times = kr.start(top, events=[floor]), []
    for _ in range(4):
        path = run.to(100.0)
        assert run.ended and abs(path.apex[-1, 2] - 0.5) < 1e-13
        assert len(path.events) == 1 and path.events.path.scene == path.scene
        times.append(run.t)
        run.push(-2.0 * path.m[-1])
        assert not run.ended and abs(run.to([run.t]).energy[0] - path.energy[-1]) < 1e-13
    assert np.abs(np.diff(times) - 2.0 * times[0]).max() < 1e-12


# Refusals leave a run as it was


@pytest.mark.parametrize(
    "name, call, kind, word",
    [
        ("taylor", lambda run: run.push((1, math.nan, 0)), ValueError, "impulse"),
        ("taylor", lambda run: run.reset(), TypeError, "momentum"),
        ("taylor", lambda run: run.reset(IMPULSE, (2.0, 0, 0, 0)), ValueError, "unit"),
        ("taylor", lambda run: run.reset(IMPULSE, velocity=(1, 0, 0)), ValueError, "one of"),
        ("taylor", lambda run: run.change(), TypeError, "body"),
        ("taylor", lambda run: run.change(damping=-1.0), ValueError, "damping"),
        ("taylor", lambda run: run.change(gravity=1, keep="spin"), ValueError, "keep"),
        ("exact", lambda run: run.change(damping=0.1), ValueError, "damping"),
        ("bobenko_suris", lambda run: run.change(body=CORNER), ValueError, "apply"),
        ("strang", lambda run: run.push((1e18, 0, 0)), ValueError, "precision"),
    ],
)
def test_a_refused_change_does_not_change_the_run(name, call, kind, word):
    run, twin = start(name), start(name)
    run.to(2.0), twin.to(2.0)
    before = run.checkpoint
    with pytest.raises(kind, match=word):
        call(run)
    assert run.checkpoint == before and run.start_time == 0.0
    assert np.array_equal(run.to(5.0).states, twin.to(5.0).states) and run.stats == twin.stats


def test_a_run_without_heading_refuses_changes_that_need_it():
    run, whole = kr.start(TOP, want=["energy"]), kr.start(TOP)
    run.to(2.0), whole.to(2.0)
    before = run.checkpoint
    for call in (
        lambda: run.push((0.1, 0.0, 1.0)),
        lambda: run.reset(momentum=(0.0, 0.0, 1.0)),
        lambda: run.reset(attitude=TILT),
        lambda: run.change(turning=(0.1, 0.0, 0.2)),
    ):
        with pytest.raises(ValueError, match="heading"):
            call()
    assert run.checkpoint == before
    for one in (run, whole):
        one.push((0.0, 0.0, 1.0))
    np.testing.assert_allclose(run.to(3.0).energy, whole.to(3.0).energy, rtol=1e-13)


def test_a_run_cannot_be_changed_during_a_call():
    """Change a run from its progress function, in the same thread and in another one."""
    run = kr.start(TOP, "rk4", step=1e-4)

    def push():
        with pytest.raises(RuntimeError, match="under way"):
            run.push(IMPULSE)

    def progress(t):
        push()
        thread = threading.Thread(target=push)
        thread.start(), thread.join()
        raise KeyError(t)

    with pytest.raises(KeyError):
        run.to(1e6, progress=progress)
    assert run.scene == TOP and run.start_time == 0.0


# Numbers of any type


class NotPlain(float):
    """A subclass of float that takes another way through the code."""


TYPES = [tuple, list, np.array, lambda row: [NotPlain(x) for x in row]]


@pytest.mark.parametrize("method", list(kr.methods))
@pytest.mark.parametrize("want", [None, ("nutation", "q", "energy")])
def test_numbers_of_every_type_give_the_same_bits(method, want):
    scene, words = scene_for(method), words_for(method)
    for sign in (1.0, -1.0):
        times = [sign * t for t in (0.1, 0.3, 0.30000000000000004, 2.0)]
        whole = kr.solve(scene, times, method, want=want, **words)
        for as_type in TYPES:
            momentum, attitude = as_type(scene.momentum), as_type(scene.attitude)
            (gravity,) = as_type([scene.gravity])
            own = kr.Scene(scene.body, momentum, attitude=attitude, gravity=gravity)
            assert own == scene and type(own.momentum[0]) is float
            run = kr.start(own, method, back=sign < 0, want=want, **words)
            path = kr.solve(own, as_type(times), method, want=want, **words)
            for one in (path, run.to(as_type(times))):
                assert_same_path([one], whole)


def test_arguments_and_results_are_kept_apart():
    times = np.array([0.1, 0.5])
    path = kr.solve(TOP, times)
    assert times.flags.writeable and not np.shares_memory(times, path.states)
    assert not any(getattr(path, name).flags.writeable for name in ("t", "q", "m"))
    run = kr.start(TOP)
    twins = copy.copy(run), pickle.loads(pickle.dumps(run))
    states = run.to(2.0).states
    assert all(twin.t == 0.0 and np.array_equal(twin.to(2.0).states, states) for twin in twins)


def test_the_number_of_steps_and_turns_is_limited():
    with pytest.raises(ValueError, match="steps"):
        kr.solve(TOP, 2.0**53, "strang", step=1.0)
    fast = TOP.replace(momentum=(0, 0, 1e18))
    for more in ({}, {"tangents": "start"}):
        assert len(kr.solve(fast, [], **more)) == 0
        with pytest.raises(ValueError, match="turns"):
            kr.solve(fast, [-1.0], **more)
    grid = kr.solve(TOP, 0.3, "strang", step=0.1, every=1)
    assert len(grid) == 4 and len(kr.solve(TOP, 0.2999, "strang", step=0.1, every=1)) == 3


# Refusals: callable, valid arguments, argument, bad value, exception, word

SOLVE = {"scene": TOP, "t": [0.0, 1.0]}
GRID = {"scene": TOP, "t": 1.0, "method": "strang", "step": 0.1}
REFUSALS = [
    (kr.stream, SOLVE, "t", 5.0, ValueError, "times"),
    (kr.stream, GRID | {"every": 1}, "t", math.nan, ValueError, "finite"),
    (kr.stream, GRID | {"every": 1}, "t", iter([1.0]), ValueError, "every"),
    (kr.stream, SOLVE, "t", iter("abc"), TypeError, "iterator"),
    (kr.stream, SOLVE, "chunk", 0, ValueError, "chunk"),
    (kr.start, {"scene": TOP}, "back", 1, TypeError, "back"),
    (kr.start, {"scene": TOP}, "method", "geometric", ValueError, "solve"),
    (kr.solve, GRID, "step", True, TypeError, "step"),
    (kr.solve, SOLVE, "tol", 1.0, ValueError, "tol"),
    (kr.solve, SOLVE, "digits", 31, ValueError, "30"),
    (kr.solve, SOLVE, "max_steps", False, TypeError, "max_steps"),
    (kr.solve, SOLVE, "want", "energy", TypeError, "want"),
    (kr.solve, SOLVE, "method", "tailor", ValueError, "taylor"),
    (kr.solve, SOLVE, "progress", 1, TypeError, "progress"),
    (kr.solve, SOLVE, "t", [1.0, 0.5], ValueError, "goes back"),
    (kr.solve, SOLVE, "t", [1.0, math.nan], ValueError, "finite"),
    (kr.solve, SOLVE, "t", 1e300, ValueError, "precision"),
    *(
        (kr.Body.cuboid, {"half": (1, 1, 1)}, "pivot", (0, x, -1), (TypeError, ValueError), "pivot")
        for x in (10**400, math.nan, None, 1j)
    ),
]


@pytest.mark.parametrize(("call", "valid", "name", "bad", "error", "word"), REFUSALS)
def test_bad_arguments_are_refused(call, valid, name, bad, error, word):
    for _ in range(2):  # the second call, too, must not find the arguments among known ones
        with pytest.raises(error, match=word):
            call(**valid | {name: bad})
