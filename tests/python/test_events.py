"""Tests of events and sections beyond the laws: known motions, ends of paths, interruption."""

import dataclasses
import itertools
import math
import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from kreisel import events
from tops import CORNER, FREE, GENERAL, LAGRANGE

TOP = kr.scenes.asymmetric
LAST = [events.nutation(max_count=3, terminal=True), events.loop()]

# Known motions


@pytest.mark.parametrize("digits", [16, 20, 30])
def test_nutation_of_a_lagrange_top_has_its_period(digits):
    period = kr.exact(LAGRANGE).period
    path = kr.solve(LAGRANGE, 12.6 * period, digits=digits, events=events.nutation(direction=1))
    turns = np.diff(path.events.t) / period
    assert len(turns) == 12 and np.abs(turns - 1).max() < 1e-12
    assert np.all(path.events.direction == 1) and path.events.path.apex[:, 2].std() < 1e-13
    again = kr.solve(LAGRANGE, path.events.t, "taylor", digits=digits)
    assert np.array_equal(again.states, path.events.states)
    assert np.array_equal(again.q_low, path.events.path.q_low)


@pytest.mark.parametrize("precession, loops, cusps", [(-0.3, 2, 0), (0.0, 0, 1), (0.05, 0, 0)])
def test_loops_cusps_and_waves(precession, loops, cusps):
    """Count the events of a fast top that starts at its highest point with a precession."""
    body = kr.Body.symmetric(mass=1, i1=1, i3=0.5, height=1, unphysical=True)
    axis = np.array([0, -np.sin(0.8), np.cos(0.8)])
    velocity = 20 * axis + precession * np.array([0, 0, 1])
    tilt = (np.cos(0.4), np.sin(0.4), 0, 0)
    scene = kr.Scene(body, velocity=velocity, attitude=tilt, gravity=1)
    kinds = [events.loop(), events.cusp(), events.nutation(direction=-1)]
    path = kr.solve(scene, 10.25 * kr.exact(scene).period, events=kinds)
    count = np.bincount(path.events.which, minlength=3).tolist()
    assert count[1:] == [10 * cusps, 10]
    if not cusps:  # at a cusp the precession touches zero, so its sign is due to rounding
        assert abs(count[0] - 10 * loops) <= 1


def test_a_constant_of_motion_has_no_events():
    vertical = {f"body_vertical_{i}*body_momentum_{i}": 1 for i in "xyz"}
    kinds = [
        events.crossing({"m_z": 1}, GENERAL.momentum[2]),
        events.extremum({"m_z": 1}),
        events.extremum(vertical),
    ]
    assert len(kr.solve(GENERAL, 100, events=kinds).events) == 0
    assert len(kr.solve(GENERAL, 10, events=[]).events) == len(kr.solve(GENERAL, 10).events) == 0


def pick_component(path, name):
    """Return the values of a component such as 'apex_z', whose name ends with its place."""
    quantity, _, end = name.rpartition("_")
    columns = {"q": "wxyz", "": "n"}.get(quantity, "xyz")
    values = getattr(path, quantity or name).reshape(len(path), -1)
    return values[:, columns.index(end if quantity else "n")]


def test_every_component_can_be_an_event():
    ends = kr.solve(GENERAL, [0.0, 0.9])
    for name in sorted(set(events.components) - {"1", "m_z"}):
        level = pick_component(ends, name).mean()
        assert events.crossing(name, level) == events.crossing({name: 1.0}, level)
        found = kr.solve(GENERAL, 0.9, events=events.crossing(name, level)).events
        assert len(found) >= 1, name
        assert np.abs(pick_component(found.path, name) - level).max() < 1e-13, name


# The end of a path


def test_a_terminal_event_ends_a_path_a_stream_and_a_run():
    times = np.linspace(0, 50, 501)
    whole = kr.solve(GENERAL, times, events=[events.nutation(), events.loop()])
    third = np.flatnonzero(whole.events.which == 0)[2]
    short = kr.solve(GENERAL, times, events=LAST)
    end = short.t[-1]
    assert np.array_equal(short.events.states, whole.events.states[: third + 1])
    assert end == short.events.t[-1] and np.array_equal(short.states[-1], short.events.states[-1])
    assert np.array_equal(short.states[:-1], whole.states[times < end])
    endless = kr.stream(GENERAL, (0.1 * k for k in itertools.count()), events=LAST, chunk=5)
    assert list(endless)[-1].t[-1] == end
    run = kr.start(GENERAL, events=LAST)
    run.to(50)
    for one in (run, kr.resume(run.checkpoint)):
        assert one.ended and one.t == end and list(one.stream([60.0, 70.0])) == []
        with pytest.raises(ValueError, match="ended"):
            one.to(60)
    run.reset((0.25, -0.5, 1.5))
    assert not run.ended and len(run.to(end + 50).events) > 2


@pytest.mark.parametrize("want", [None, ("energy",)])
def test_events_are_found_across_the_chunks_of_dense_times(want):
    times = np.linspace(0, 30, 40_000)
    whole = kr.solve(GENERAL, times[::1000], events=LAST[1:], want=want)
    dense = kr.solve(GENERAL, times, events=LAST[1:], want=want)
    assert len(whole.events) > 3 and np.array_equal(dense.events.states, whole.events.states)


def test_a_failure_keeps_the_events_found_and_the_run_finds_the_others():
    kinds = [events.nutation()]
    whole = kr.solve(GENERAL, 300.0, events=kinds)
    run = kr.start(GENERAL, events=kinds, max_steps=100)
    with pytest.raises(kr.Error) as failure:
        run.to(300.0)
    parts = [failure.value.path, kr.resume(run.checkpoint, max_steps=0).to(300.0)]
    states = np.concatenate([part.events.states for part in parts])
    assert len(parts[0].events) > 3 and np.array_equal(states, whole.events.states)
    again = pickle.loads(pickle.dumps(failure.value))
    assert np.array_equal(again.path.events.which, parts[0].events.which)


def test_ctrl_c_keeps_the_events_found():
    def stop(_):
        raise KeyboardInterrupt

    with pytest.raises(kr.Interrupted) as stopped:
        kr.solve(TOP, 1e7, events=events.nutation(max_count=5), progress=stop)
    assert 0 < stopped.value.path.t[-1] < 1e7 and len(stopped.value.path.events) == 5
    with pytest.raises(kr.Interrupted) as stopped:
        kr.section(TOP.vary(gravity=np.linspace(0.5, 1, 1000)), n=2000, progress=stop)
    section = stopped.value.result
    assert isinstance(section, kr.Section) and (section.status == "ERR_INTERRUPTED").any()
    assert np.isfinite(section.states).all() and len(section.states) == section.count.sum()


# Sections


@pytest.mark.parametrize("scene", [LAGRANGE, kr.scenes.cusps])
def test_the_section_of_a_lagrange_top_contains_its_lowest_points(scene):
    section, exact = kr.section(scene, n=50), kr.exact(scene)
    assert np.abs(section.t - exact.t_greatest - exact.period * np.arange(50)).max() < 1e-10
    assert np.abs(section.nutation - exact.greatest_nutation).max() < 1e-12
    turns = np.diff(section.precession_angle) - exact.precession_rate * exact.period
    # a passage through the pole does not count as a turn
    halves = 2.0 if exact.motion_type == "rosette" else 1.0
    assert np.abs(np.exp(1j * halves * turns) - 1.0).max() < 1e-10


def test_integrals_are_constant_on_sections():
    plane = events.plane((0, 0, 1), of="body_velocity", direction=1)
    section = kr.section(FREE, plane, n=40)
    energy = 0.5 * (section.body_velocity * section.body_momentum).sum(axis=1)
    assert np.abs(section.body_velocity[:, 2]).max() < 1e-12
    assert np.ptp(energy) < 1e-12 * energy[0] and np.ptp(section.m, axis=0).max() < 1e-11
    tops = kr.starts(kr.scenes.kowalewski.body, energy=1.0, vertical=0.5, n=4, gravity=1)
    section = kr.section(tops, events.loop(), n=100, max_wait=200)
    assert len(section.t) > 100
    for path in section:
        assert np.ptp(path.kowalewski) <= 1e-11 * max(1.0, path.kowalewski.max(initial=0.0))
    assert np.ptp(section.energy) < 1e-12 and np.ptp(section.vertical_momentum) < 1e-12


FIELDS = "states", "top", "count", "status", "reached", "stats", "max_wait"


def test_sections_do_not_depend_on_other_tops_threads_or_executors():
    momenta = np.random.default_rng(5).normal(size=(60, 3))
    tops = kr.Scene(CORNER, momentum=momenta, attitude=(0.8, 0.4, -0.2, 0.4), gravity=1)
    whole = kr.section(tops, n=8, max_wait=60)
    part = kr.section(tops[17:60:3], n=8, max_wait=60)
    pairs = [(part, whole[17:60:3]), (part[[2, 0]][1:], part[:1])]
    pairs += [(kr.section(tops, n=8, max_wait=60, threads=n), whole) for n in (1, 3)]
    for pool in (ThreadPoolExecutor(2), ProcessPoolExecutor(2)):
        with pool:
            pairs.append((kr.section(tops, n=8, max_wait=60, executor=pool), whole))
    for one, other in pairs:
        assert all(np.array_equal(getattr(one, f), getattr(other, f)) for f in FIELDS)
    square = kr.section(tops[:2].reshape(1, 2), n=8, max_wait=60)
    assert square.top.shape == (len(square.t), 2) and np.array_equal(
        square.states, whole[:2].states
    )
    assert whole.frame.shape == (len(whole.t), 3, 3) and isinstance(whole[1], kr.Path)
    assert kr.section(tops[:0], n=5).states.shape == (0, 8)
    assert np.array_equal(whole.apex[whole.top == 1], whole[1].apex) and not whole.t.flags.writeable


def test_a_top_without_events_is_reported():
    tops = kr.Scene.stack([kr.scenes.steady_precession, kr.scenes.thesis, kr.scenes.thesis])
    section = kr.section(tops, n=10, max_wait=[50, 50, 3])
    assert section.status.tolist() == ["ERR_EVENT", "OK", "ERR_EVENT"]
    assert section.count.tolist() == [0, 10, 0] and section.failed.tolist() == [0, 2]
    assert section.reached[0] == pytest.approx(50) and len(section.t) == 10 == len(section.energy)
    assert "0 of 10 events" in section.message(0)
    with pytest.raises(kr.Error, match=r"top\[0\]") as failure:
        section.check()
    assert failure.value.result is section and len(failure.value.path) == 0
    rest = kr.Scene(FREE.body, attitude=(1, 0, 0, 0), momentum=(0, 0, 0), gravity=0.0)
    assert kr.section(kr.Scene.stack([rest, TOP]), n=2).count.tolist() == [0, 2]
    first = kr.section(TOP, n=1).t[0]
    waits = [kr.section(TOP, n=1, max_wait=x * first).count for x in (0.999, 1.001)]
    assert waits == [0, 1]


def test_the_tolerance_of_cusps_has_a_lower_bound():
    assert events.cusp(within=1e-7)
    with pytest.raises(ValueError, match="within must be at least 1e-7"):
        events.cusp(within=math.nextafter(1e-7, 0.0))


def test_the_separatrix_without_gravity_is_that_of_the_free_body():
    free = TOP.replace(gravity=0.0)
    assert events.separatrix(free) == events.separatrix(
        TOP.replace(body=kr.Body(TOP.body.mass, TOP.body.inertia, (0, 0, 0)))
    )


def test_a_separatrix_under_gravity_has_its_own_direction():
    for gravity, direction in ((1.0, -1), (-1.0, 1)):
        scene = TOP.replace(gravity=gravity)
        assert events.separatrix(scene).direction == direction
        with pytest.raises(TypeError, match="leave direction out"):
            events.separatrix(scene, direction=1)


def test_an_event_cannot_be_changed():
    event = events.nutation()
    with pytest.raises(dataclasses.FrozenInstanceError):
        event.direction = 1


# Refusals: callable, valid arguments, argument, bad value, exception, word

SOLVE = {"scene": GENERAL, "t": 1.0, "events": events.loop()}
REFUSALS = [
    (events.crossing, {}, "function", {"mx": 1}, ValueError, "m_x"),
    (events.crossing, {}, "function", "omega_y", ValueError, "body_velocity_y"),
    (events.crossing, {}, "function", "nutation", ValueError, "apex_z"),
    (events.crossing, {"function": "m_x"}, "value", np.inf, ValueError, "finite"),
    (events.crossing, {}, "function", np.sin, TypeError, "polynomial"),
    (events.loop().value, {}, "path", GENERAL, TypeError, "kreisel.Path"),
    (events.extremum, {}, "function", "apex", ValueError, "apex_x"),
    (events.extremum, {}, "function", "energy", ValueError, "constant"),
    (events.nutation, {}, "direction", 2, ValueError, "direction"),
    (events.nutation, {}, "max_count", 0, ValueError, "max_count"),
    (events.nutation, {}, "terminal", 1, TypeError, "terminal"),
    (events.plane, {}, "normal", (1, 0), ValueError, "normal"),
    (events.plane, {"normal": (1, 0, 0)}, "of", "axis", ValueError, "axis"),
    (events.cusp, {}, "within", 1e-9, ValueError, "within"),
    (events.separatrix, {}, "scene", LAGRANGE.replace(gravity=0), ValueError, "separatrix"),
    (kr.solve, SOLVE, "events", events.crossing({"m_x": 1e308}), ValueError, "range"),
    (kr.section, {"scene": TOP}, "scene", [LAGRANGE], TypeError, "scene"),
    (kr.section, {"scene": TOP}, "event", "nutation", TypeError, "event"),
    (kr.section, {"scene": TOP}, "event", events.nutation(max_count=3), ValueError, "max_count"),
    (kr.section, {"scene": TOP}, "n", 0, ValueError, "n must"),
    (kr.section, {"scene": TOP}, "n", 2**50, MemoryError, "GB"),
    (kr.section, {"scene": TOP}, "threads", 0, ValueError, "threads"),
]


@pytest.mark.parametrize(("call", "valid", "name", "bad", "error", "word"), REFUSALS)
def test_bad_arguments_are_refused(call, valid, name, bad, error, word):
    with pytest.raises(error, match=word):
        call(**valid | {name: bad})
