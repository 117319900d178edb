"""Tests of impulses, resets and other changes during a run."""

import copy
import math
import threading
from fractions import Fraction

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits
from kreisel import quaternion
from tops import CORNER, FREE, GENERAL, LAGRANGE, TILT, scene_for, words_for

TOP = kr.scenes.asymmetric
IMPULSE = (0.25, -0.125, 0.5)
AFTER = np.array([0.0, 0.5, 0.75, 2.0])
NAMES = [*kr.methods, "taylor 16", "taylor 20", "taylor 30"]


def start(name, **more):
    """Start a run with the method and number of digits given by a name such as "taylor 30"."""
    method, _, digits = name.partition(" ")
    words = words_for(method) | ({"digits": int(digits)} if digits else {}) | more
    return kr.start(scene_for(method), method, **words)


# The motion after a change


@pytest.mark.parametrize("back", [False, True], ids=["forth", "back"])
@pytest.mark.parametrize("name", list(kr.methods))
def test_a_pushed_run_equals_a_new_run_bitwise(name, back):
    sign, run = -1.0 if back else 1.0, start(name, back=back)
    before = run.to(4.0 * sign)
    run.push(IMPULSE)
    assert (run.t, run.start_time, tuple(run.stats)) == (4.0 * sign, 4.0 * sign, (0, 0, 0, 0))
    scene = before.end.replace(momentum=before.m[-1] + np.array(IMPULSE))
    assert run.scene == scene
    path = run.to(sign * (4.0 + AFTER))
    fresh = kr.start(scene, name, back=back, **words_for(name)).to(sign * AFTER)
    assert same_bits(path.states[:, 1:], fresh.states[:, 1:])
    assert path.t.tolist() == (sign * (4.0 + AFTER)).tolist() and path.stats == fresh.stats
    assert path.start_time == 4.0 * sign and fresh.start_time == 0.0


@pytest.mark.parametrize("name, most", [("exact", 1e-14), ("taylor", 1e-13), ("taylor 20", 1e-18)])
def test_a_push_by_zero_only_restarts_the_motion(name, most):
    run, whole = start(name), start(name).to([10.0])
    for t in (1.0, 2.5, 7.0):
        run.to(t)
        run.push((0.0, 0.0, 0.0))
    path = run.to([10.0])
    assert np.abs((path.q - whole.q) + (path.q_low - whole.q_low)).max() < most


@pytest.mark.parametrize("scene", [TOP, GENERAL, FREE, kr.scenes.thesis])
def test_opposite_pushes_keep_30_digits(scene):
    """Check that opposite impulses cancel in 30-digit arithmetic."""
    run, whole = kr.start(scene, digits=30), kr.solve(scene, [5.0], digits=30)
    for t in (0.7, 1.9, 3.1):
        run.to(t)
        state = run.to([t])
        run.push(IMPULSE)
        next_state = run.to([t])
        assert np.array_equal(state.q_low, next_state.q_low)
        run.push(tuple(-x for x in IMPULSE))
    path = run.to([5.0])
    for word in ("q", "m"):
        high, low = getattr(path, word), getattr(path, word + "_low")
        difference = (high - getattr(whole, word)) + (low - getattr(whole, word + "_low"))
        assert np.abs(difference).max() < 1e-27
    rounded_start = kr.start(run.scene, digits=30).to([5.0 - run.start_time])
    assert (
        np.abs(rounded_start.q - path.q).max() + np.abs(rounded_start.q_low - path.q_low).max()
        > 1e-19
    )


@pytest.mark.parametrize("name", ["exact", "taylor", "strang", "blanes_moan6", "taylor 30"])
def test_a_struck_free_body_precesses_about_its_new_momentum(name):
    """Compare the motion after an impulse with the closed form for a free symmetric body."""
    method, _, digits = name.partition(" ")
    body = kr.Body(mass=1.0, inertia=(2.0, 2.0, 0.5), com=(0, 0, 0))
    spinning = kr.Scene(body, momentum=(0.0, 0.0, 1.5), gravity=1)
    words = words_for(method) | ({"digits": int(digits)} if digits else {})
    run = kr.start(spinning, method, **words)
    assert run.to(2.0).apex[-1].tolist() == [0.0, 0.0, 1.0]
    run.push((0.75, 0.5, 0.0))
    path = run.to(2.0 + np.arange(0.0, 8.5, 0.5))
    m = np.array([0.75, 0.5, 1.5])
    size = np.linalg.norm(m)
    for t, axis in zip(path.t - 2.0, path.apex, strict=True):
        half = 0.5 * size * t / 2.0
        turn = (math.cos(half), *(math.sin(half) * m / size))
        assert np.abs(axis - quaternion.turn(turn, (0.0, 0.0, 1.0))).max() < 2e-14
    assert np.abs(path.m - m).max() < 1e-14


def test_an_impulse_does_the_work_of_the_mean_angular_velocity():
    run = kr.start(GENERAL)
    before = run.to(3.0)
    run.push(IMPULSE)
    after = run.to([3.0])
    work = 0.5 * (before.velocity[-1] + after.velocity[0]) @ np.array(IMPULSE)
    assert abs(after.energy[0] - before.energy[-1] - work) < 1e-14 * abs(before.energy[-1])


def test_a_reset_changes_only_the_given_values():
    run = kr.start(TOP)
    state = run.to(2.0)[-1]
    run.reset(attitude=TILT)
    assert run.scene.attitude == TILT and run.scene.momentum == tuple(state.m[0])
    run.reset(momentum=(1, 2, 3))
    assert run.scene.attitude == TILT and run.scene.momentum == (1.0, 2.0, 3.0)
    run.reset(velocity=(0.5, 0.25, -1.0))
    assert np.abs(run.to([2.0]).velocity - (0.5, 0.25, -1.0)).max() < 1e-15
    assert run.scene.attitude == TILT
    run.reset((0.0, 1.0, 0.0), attitude_xyzw=(1, 0, 0, 0))
    assert run.scene.attitude == (0, 1, 0, 0) and run.t == run.start_time == 2.0
    run.reset(body_momentum=(1.0, 2.0, 3.0))
    assert run.scene.attitude == (0, 1, 0, 0) and run.scene.momentum == (1.0, -2.0, -3.0)
    path = run.to([2.0, 3.0])
    fresh = kr.solve(run.scene, [0.0, 1.0])
    assert np.array_equal(path.states[:, 1:], fresh.states[:, 1:])


@pytest.mark.parametrize("part", ["attitude", "momentum"])
def test_a_reset_keeps_the_low_words_of_unchanged_values(part):
    run = kr.start(TOP, digits=30)
    state = run.to([2.0])
    if part == "attitude":
        run.reset(attitude=TILT)
        path = run.to([2.0])
        assert not path.q_low.any() and np.array_equal(path.m_low, state.m_low)
    else:
        run.reset(momentum=IMPULSE)
        path = run.to([2.0])
        assert not path.m_low.any() and np.array_equal(path.q_low, state.q_low)
    assert state.q_low.any() and state.m_low.any()


TURNED = kr.Body(
    mass=2.0,
    inertia=((3.0, -0.25, 0.5), (-0.25, 2.5, 0.125), (0.5, 0.125, 1.5)),
    com=(0.2, -0.3, 0.25),
)


def exact_matrix(q):
    """Return the exact rotation matrix of a quaternion, which need not be normalized."""
    w, x, y, z = q
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.array(rows, dtype=object) / (w * w + x * x + y * y + z * z)


def exact_sum(high, low):
    return np.array([Fraction(a) + Fraction(b) for a, b in zip(high, low, strict=True)])


def exact_momentum(old, new, state):
    """Return the exact momentum after the body is replaced without a change of angular velocity."""
    q = exact_matrix(exact_sum(state.q[0], state.q_low[0]))
    p, r = (q @ exact_matrix([Fraction(x) for x in body.axes]) for body in (old, new))
    first, second = (np.diag([Fraction(x) for x in body.moments]) for body in (old, new))
    rate = (p.T @ exact_sum(state.m[0], state.m_low[0])) / np.diag(first)
    return r @ second @ r.T @ p @ rate


@pytest.mark.parametrize("digits", [None, 20, 30])
@pytest.mark.parametrize("old", [CORNER, TURNED, LAGRANGE.body])
@pytest.mark.parametrize("new", [CORNER, TURNED, kr.Body(mass=1, inertia=(1, 3, 2), com=(1, 0, 0))])
def test_a_change_of_body_preserves_momentum_or_velocity(old, new, digits):
    run = kr.start(
        kr.Scene(old, momentum=(1, 2, 3), attitude=TILT, gravity=1), "taylor", digits=digits
    )
    last = run.to(2.0)[-1]
    other = copy.copy(run)
    run.change(body=new)
    assert run.scene.momentum == tuple(last.m[0]) and run.scene.attitude == tuple(last.q[0])
    assert np.array_equal(run.to([2.0]).m_low, last.m_low)
    other.change(body=new, keep="velocity")
    after = other.to([2.0])
    assert np.abs(after.velocity - last.velocity).max() < 1e-15 * np.linalg.norm(last.velocity)
    exact = exact_momentum(old, new, last)
    assert after.m[0].tolist() == [float(x) for x in exact]
    if digits:
        difference = exact_sum(after.m[0], after.m_low[0]) - exact
        assert max(map(abs, difference)) < Fraction(1, 2**104)
    assert np.array_equal(after.q_low, last.q_low)


def test_a_changed_run_uses_the_new_body_gravity_and_damping():
    run = kr.start(TOP, "taylor")
    for change in (
        {"body": CORNER},
        {"gravity": -2.0},
        {"damping": 0.25},
        {"body": TOP.body, "gravity": 1.0, "damping": 0.0},
    ):
        end = run.to(run.t + 1.0).end
        run.change(**change)
        path = run.to(run.t + AFTER)
        assert path.scene == run.scene == end.replace(**change)
        fresh = kr.solve(path.scene, AFTER, "taylor")
        assert np.array_equal(path.states[:, 1:], fresh.states[:, 1:])
        assert np.array_equal(path.energy, fresh.energy)
        assert path.start_time == run.start_time


def test_closed_forms_survive_a_change_of_kind():
    kowalewski = kr.scenes.kowalewski.body
    run = kr.start(kr.scenes.cusps, "exact")
    run.to(1.0)
    run.reset(momentum=(0.4, -0.3, 0.7), attitude=TILT)
    for body in (kowalewski, kr.scenes.cusps.body, kowalewski):
        run.change(body=body)
        path = run.to(run.t + AFTER)
        fresh = kr.solve(run.scene, AFTER, "exact")
        assert np.array_equal(path.states[:, 1:], fresh.states[:, 1:])


# Paths after a change


@pytest.mark.parametrize("name", ["exact", "taylor", "strang", "rk4", "taylor 20", "taylor 30"])
def test_a_path_after_a_change_refers_to_its_own_scene(name, tmp_path):
    run = start(name)
    before = run.to(3.0)
    run.push(IMPULSE)
    path = run.to([3.0, 4.0, 5.5])
    assert path.scene == run.scene != before.scene and path.start_time == 3.0
    path.save(tmp_path / "path")
    for one in (path, kr.load(tmp_path / "path"), path[1:]):
        assert one.start_time == 3.0
        assert np.array_equal(one(path.t).states, path.states)
        assert np.array_equal(one(path.t).q_low, path.q_low)
        assert one([5.25, 3.5]).t.tolist() == [5.25, 3.5]
        with pytest.raises(ValueError, match=r"times go from 3\.0 to 5\.5"):
            one(2.0)
    if run.digits:  # the error of the low words of the start is included
        assert 0.0 < path.error < {20: 2e-21, 30: 1e-30}[run.digits]
    else:
        fresh = kr.solve(path.scene, path.t - 3.0, before.method, **_words(run))
        assert path.error == fresh.error
    if name != "rk4":
        assert path.energy_error < 1e-3


def _words(run):
    return {"step": run.step, "digits": run.digits}


def test_the_error_of_30_digits_includes_the_low_words_of_the_start():
    run = kr.start(TOP, digits=30)
    run.to(3.0)
    run.push(IMPULSE)
    assert 0.0 < run.to([3.0, 5.0]).error < 1e-26


def test_the_energy_after_a_change_is_that_of_the_new_body():
    run = kr.start(TOP, "taylor")
    run.to(2.0)
    run.change(body=CORNER, gravity=3.0)
    path = run.to(2.0 + np.linspace(0.0, 5.0, 11))
    v = path.velocity
    kinetic = 0.5 * (v * path.m).sum(axis=1)
    heights = [quaternion.turn(tuple(q), CORNER.com)[2] for q in path.q.tolist()]
    energy = kinetic + 3.0 * CORNER.mass * np.array(heights)
    assert np.abs(path.energy - energy).max() < 1e-13 * np.abs(energy).max()
    assert path.energy_error < 1e-14


def test_events_of_a_saved_path_belong_to_its_scene(tmp_path):
    run = kr.start(TOP, events=[kr.events.crossing("apex_z", 0.0)])
    run.to(2.0)
    run.push(IMPULSE)
    path = run.to(15.0)
    path.save(tmp_path / "path")
    for found in (path.events, kr.load(tmp_path / "path").events):
        assert len(found) > 1 and found.path.start_time == 2.0 and found.path.scene == run.scene
        assert np.array_equal(found.path(path.events.t[:2]).t, path.events.t[:2])


# Times, grids, streams, counts


def test_the_grid_begins_at_the_time_of_the_change():
    run = kr.start(TOP, "strang", step=0.25)
    run.to(1.1)
    run.push(IMPULSE)
    path = run.to(2.7, every=2)
    assert path.t.tolist() == [1.1 + 0.5 * k for k in range(4)]
    assert run.to(3.2, every=1).t.tolist() == [1.1 + 0.25 * k for k in (7, 8)]
    fresh = kr.solve(run.scene, 1.5, "strang", step=0.25, every=2)
    assert np.array_equal(path.states[:, 1:], fresh.states[:, 1:])
    assert run.to(3.2, every=1).t.tolist() == []
    with pytest.raises(ValueError, match="goes back from the run's"):
        run.to([1.0])


@pytest.mark.parametrize("end", [2.0, -2.0, math.inf, -math.inf])
def test_a_stream_after_a_change_has_the_times_of_the_new_grid(end):
    sign = math.copysign(1.0, end)
    run = kr.start(TOP, "strang", step=0.125, back=end < 0.0)
    run.to(0.3 * sign)
    run.push(IMPULSE)
    stream = run.stream(end, every=2, chunk=3)
    times = [next(stream).t.tolist() for _ in range(2)]
    assert times == [[0.3 * sign + sign * 0.25 * k for k in ks] for ks in ((0, 1, 2), (3, 4, 5))]
    again = next(run.stream(4.0 * sign, every=2)).t.tolist()
    assert again[0] == 0.3 * sign + sign * 1.5 and len(again) == 9


def test_a_stream_keeps_its_times_after_a_push():
    run, times = kr.start(TOP), [1.0, 2.0, 3.0, 4.0]
    stream = run.stream(times, chunk=2)
    first = next(stream)
    run.push(IMPULSE)
    rest = next(stream)
    assert rest.t.tolist() == [3.0, 4.0] and rest.scene == run.scene != first.scene
    fresh = kr.solve(run.scene, [1.0, 2.0])
    assert np.array_equal(rest.states[:, 1:], fresh.states[:, 1:])


def test_counts_and_limits_restart_after_a_change():
    run = kr.start(TOP, "strang", step=0.5, max_steps=10)
    with pytest.raises(kr.Error, match="largest number of steps"):
        run.to(8.0)
    assert run.t == 5.0 and run.stats.steps == 10
    run.push(IMPULSE)
    assert run.stats.steps == 0 and "t = 5, 0 steps" in repr(run)
    assert run.to(8.0).stats.steps == 6 and run.stats.steps == 6


def test_a_run_can_be_pushed_before_it_moves():
    run = kr.start(TOP, "strang", step=0.125)
    run.push(IMPULSE)
    scene = TOP.replace(momentum=np.array(TOP.momentum) + IMPULSE)
    assert run.scene == scene and run.start_time == 0.0
    assert np.array_equal(run.to(3.0).states, kr.solve(scene, 3.0, "strang", step=0.125).states)


# Checkpoints


@pytest.mark.parametrize("back", [False, True], ids=["forth", "back"])
@pytest.mark.parametrize("name", NAMES)
def test_a_changed_run_is_resumed_with_the_same_bits(name, back):
    sign = -1.0 if back else 1.0
    whole, run_copy = (start(name, back=back) for _ in range(2))
    for t in (0.5, 1.25, 3.0):
        for run in (whole, run_copy):
            run.to([sign * t])
            run.push(IMPULSE)
        run_copy = kr.resume(run_copy.checkpoint)
        assert run_copy.scene == whole.scene and run_copy.start_time == whole.start_time == sign * t
        assert same_bits(run_copy.to([sign * t]).states, whole.to([sign * t]).states)
        one, other = (run.to(sign * (t + 0.125)) for run in (run_copy, whole))
        run_copy = copy.deepcopy(run_copy)
        assert same_bits(one.states, other.states)
        assert same_bits(one.q_low, other.q_low) and same_bits(one.m_low, other.m_low)
    one, other = run_copy.to([sign * 9.0]), whole.to([sign * 9.0])
    assert same_bits(one.states, other.states) and one.stats == other.stats


def test_a_checkpoint_holds_the_changed_body_gravity_and_damping():
    run = kr.start(TOP, "taylor")
    run.to(2.0)
    run.change(body=CORNER, gravity=2.0, damping=(0.1, 0.2, 0.3))
    again = kr.resume(run.checkpoint)
    assert again.scene == run.scene and again.scene.body == CORNER
    assert np.array_equal(again.to(4.0).states, run.to(4.0).states)


@pytest.mark.parametrize("start", ["3", [1.0], [1.0, [1.0]], ["a", None], [1e300, None]])
def test_a_damaged_start_of_a_checkpoint_is_refused(start):
    import json
    import zlib

    from kreisel._solve.run import MAGIC

    head, _, memory = kr.start(TOP).checkpoint[len(MAGIC) + 9 :].partition(b"\n")
    content = json.dumps(json.loads(head) | {"start": start}).encode() + b"\n" + memory
    with pytest.raises(ValueError, match="is not a checkpoint of a run"):
        kr.resume(MAGIC + b"%08x\n" % zlib.crc32(content) + content)


# Events


def test_events_after_a_push_are_found_once():
    level = kr.events.crossing("apex_z", 0.0)
    run = kr.start(TOP, events=[level])
    first = run.to(20.0).events.t[0]
    run = kr.start(TOP, events=[level])
    assert run.to(first).events.t.tolist() == [first]
    run.push(IMPULSE)
    after = run.to(first + 10.0).events
    fresh = kr.solve(run.scene, 10.0, events=[level]).events
    assert len(fresh) > 1 and np.abs(after.t - first - fresh.t).max() < 1e-12
    assert after.t[0] > first and np.abs(after.path.apex[:, 2]).max() < 1e-13


def test_a_top_can_be_pushed_at_each_terminal_event():
    """Check that a top conserves its energy when it bounces off an obstacle at a given height."""
    floor = kr.events.crossing("apex_z", 0.5, direction=-1, terminal=True)
    top = kr.Scene.spinning(LAGRANGE.body, spin=0.0, tilt=0.5, gravity=1)
    run, times = kr.start(top, events=[floor]), []
    for _ in range(4):
        path = run.to(100.0)
        assert run.ended and abs(path.apex[-1, 2] - 0.5) < 1e-13
        times.append(run.t)
        energy = path.energy[-1]
        run.push(-2.0 * path.m[-1])
        assert not run.ended and abs(run.to([run.t]).energy[0] - energy) < 1e-13
    gaps = np.diff(times)
    assert np.abs(gaps - 2.0 * times[0]).max() < 1e-12


def test_events_of_a_changed_body_follow_its_own_apex():
    level = kr.events.crossing("apex_z", 0.0)
    run = kr.start(TOP, events=[level], digits=20)
    run.to(1.0)
    run.change(body=TURNED)
    found = run.to(15.0).events
    assert len(found) > 2 and np.abs(found.path.apex[:, 2]).max() < 1e-14


# Refusals leave the run as it was


@pytest.mark.parametrize(
    "name, call, kind, message",
    [
        ("taylor", lambda run: run.push((1, 2)), ValueError, "impulse must be 3 numbers"),
        ("taylor", lambda run: run.push(1.0), (TypeError, ValueError), "impulse"),
        ("taylor", lambda run: run.push("abc"), TypeError, "impulse"),
        ("taylor", lambda run: run.push((1, math.nan, 0)), ValueError, "impulse"),
        ("taylor", lambda run: run.push((1.7e308,) * 3), ValueError, "."),
        ("taylor", lambda run: run.reset(), TypeError, "reset needs a momentum, an attitude"),
        ("taylor", lambda run: run.reset((1, 2, math.inf)), ValueError, "momentum"),
        ("taylor", lambda run: run.reset(attitude=(1, 1, 0, 0)), ValueError, "unit quaternion"),
        (
            "taylor",
            lambda run: run.reset(momentum=(1, 0, 0), velocity=(1, 0, 0)),
            ValueError,
            "exactly one of",
        ),
        ("taylor", lambda run: run.change(), TypeError, "change needs a body, gravity"),
        ("taylor", lambda run: run.change(body=TOP), TypeError, "body must be a kreisel.Body"),
        ("taylor", lambda run: run.change(gravity="g"), TypeError, "gravity"),
        ("taylor", lambda run: run.change(damping=-1.0), ValueError, "damping"),
        ("taylor", lambda run: run.change(gravity=1, keep="spin"), ValueError, "keep must be"),
        ("taylor", lambda run: run.change(body=CORNER, keep=1), ValueError, "keep must be"),
        ("exact", lambda run: run.change(damping=0.1), ValueError, "tops without damping"),
        ("exact", lambda run: run.change(body=CORNER), ValueError, "does not apply"),
        ("strang", lambda run: run.change(damping=0.1), ValueError, "tops without damping"),
        ("bobenko_suris", lambda run: run.change(body=CORNER), ValueError, "does not apply"),
        ("strang", lambda run: run.push((1e18, 0, 0)), ValueError, "double precision cannot"),
    ],
)
def test_a_refused_change_does_not_change_the_run(name, call, kind, message):
    run, twin = start(name), start(name)
    run.to(2.0), twin.to(2.0)
    before = run.checkpoint
    with pytest.raises(kind, match=message):
        call(run)
    assert run.checkpoint == before and run.start_time == 0.0
    assert np.array_equal(run.to(5.0).states, twin.to(5.0).states) and run.stats == twin.stats


def test_a_state_without_closed_form_is_refused():
    run = kr.start(kr.scenes.goryachev_chaplygin, "exact")
    run.to(1.0)
    before = run.checkpoint
    with pytest.raises(ValueError, match="vertical"):
        run.push((0.0, 0.0, 1.0))
    assert run.checkpoint == before


def test_a_run_without_heading_refuses_changes_that_need_it():
    run = kr.start(TOP, want=["energy"])
    whole = kr.start(TOP)
    for one in (run, whole):
        one.to(2.0)
    before = run.checkpoint
    for call in (
        lambda: run.push((0.1, 0.0, 1.0)),
        lambda: run.reset(momentum=(0.0, 0.0, 1.0)),
        lambda: run.reset(attitude=TILT),
        lambda: run.reset(velocity=(0.0, 0.0, 1.0)),
        lambda: run.change(turning=(0.1, 0.0, 0.2)),
    ):
        with pytest.raises(ValueError, match="the heading of this run is not computed"):
            call()
    assert run.checkpoint == before
    for change in (
        lambda one: one.push((0.0, 0.0, 1.0)),
        lambda one: one.reset(body_velocity=(0.3, 0.2, 1.0)),
        lambda one: one.change(body=CORNER),
        lambda one: one.change(body=TURNED, keep="velocity"),
        lambda one: one.reset(momentum=IMPULSE, attitude=TILT),
    ):
        for one in (run, whole):
            change(one)
        energy, expected = (one.to(one.t + AFTER).energy for one in (run, whole))
        assert np.abs(energy - expected).max() < 1e-13 * np.abs(expected).max()


def test_a_run_cannot_be_changed_during_a_call():
    run = kr.start(TOP, "rk4", step=1e-4)

    def progress(t):
        with pytest.raises(RuntimeError, match="under way"):
            run.push(IMPULSE)
        raise KeyError(t)

    with pytest.raises(KeyError):
        run.to(1e6, progress=progress)
    assert run.start_time == 0.0


def test_another_thread_cannot_change_a_run_during_a_call():
    run, has_begun, is_refused = (
        kr.start(TOP, "rk4", step=1e-4),
        threading.Event(),
        threading.Event(),
    )

    def progress(t):
        has_begun.set()
        if is_refused.is_set():
            raise KeyError(t)

    def advance():
        with pytest.raises(KeyError):
            run.to(1e9, progress=progress)

    thread = threading.Thread(target=advance)
    thread.start()
    has_begun.wait()
    try:
        with pytest.raises(RuntimeError, match="under way"):
            run.change(gravity=2.0)
    finally:
        is_refused.set()
        thread.join()
    assert run.scene == TOP


def test_a_momentum_beyond_the_range_of_doubles_is_refused():
    light = kr.Body(1e-3, (1e10,) * 3, (0, 0, 0), unphysical=True)
    run = kr.start(kr.Scene(light, (1e300, 0.0, 0.0), gravity=1))
    heavy = kr.Body(1.0, (1e20,) * 3, (0, 0, 0))
    with pytest.raises(ValueError, match="the momentum after the change exceeds the range"):
        run.change(body=heavy, keep="velocity")
    assert run.scene.body == light and run.scene.momentum == (1e300, 0.0, 0.0)
