"""Tests of event detection, terminal events and invalid event arguments."""

import os
import pickle
import threading

import kreisel as kr
import numpy as np
import pytest
from internals import QUANTITIES
from kreisel import events
from toolbox import python
from tops import CORNER, GENERAL, LAGRANGE


def random_scene(rng):
    half = rng.uniform(0.3, 1.2, 3)
    body = kr.Body.cuboid(half=tuple(half), pivot=tuple(rng.uniform(-1, 1, 3) * half))
    q = rng.normal(size=4)
    momentum = rng.normal(size=3) * body.mass * rng.choice([0.3, 1, 3])
    return kr.Scene(
        body,
        momentum=momentum,
        attitude=q / np.linalg.norm(q),
        gravity=rng.choice([1.0, -1.0, 0.2]),
    )


def make_all_events(scene):
    return [
        events.nutation(),
        events.loop(),
        events.plane((1, 0.3, -0.2)),
        events.plane((0, 1, 0), of="m"),
        events.crossing({"q_w": 1, "q_y": 0.3}),
        events.crossing({"m_x*apex_y": 1, "m_y*apex_x": -1}),
        events.kinetic(float(kr.solve(scene, 0.7123, "taylor").kinetic[-1])),
        events.extremum({"body_velocity_y": 1, "spin*apex_x": 0.5}),
        events.extremum({"m_x*m_x": 1, "body_momentum_z": 2, "1": 7}),
        events.crossing({"body_momentum_z * q_x": 1}, 0.3),
    ]


def changes(values, times):
    """Return the start time of each interval in which `values` changes sign, and the new sign."""
    indices = np.flatnonzero(values[1:] * values[:-1] < 0)
    return times[indices], np.sign(values[indices + 1])


@pytest.mark.parametrize("damping", [None, (0.04, 0.01, 0.02)], ids=["free", "damped"])
@pytest.mark.parametrize("seed", range(12))
def test_no_event_is_missed_or_found_twice(seed, damping):
    """Compare events with the sign changes on a very dense time grid."""
    scene = random_scene(np.random.default_rng(seed)).replace(damping=damping)
    end = 20.0 if seed % 3 else -20.0
    specifications = make_all_events(scene)
    path = kr.solve(scene, end, events=specifications)
    times = np.linspace(0, end, 1000 * path.stats.steps)
    dense = kr.solve(scene, times, "taylor")
    found = path.events
    assert len(found) > 15
    for i, event in enumerate(specifications):
        values = event.value(dense)
        if event.extremum:
            change_times, directions = changes(np.diff(values), times[1:])
        else:
            change_times, directions = changes(values, times)
            directions = directions * np.sign(end)
        mine = found.t[found.which == i]
        assert len(mine) == len(change_times), i
        assert np.abs(mine - change_times).max(initial=0) <= 2.1 * abs(times[1]), i
        assert np.array_equal(found.direction[found.which == i], directions), i


def test_events_do_not_change_the_path():
    times = np.linspace(0, 30, 301)
    for options in ({}, {"tol": 1e-5}, {"digits": 20}, {"digits": 30}):
        plain = kr.solve(GENERAL, times, "taylor", **options)
        watched = kr.solve(GENERAL, times, events=make_all_events(GENERAL), **options)
        assert np.array_equal(plain.states, watched.states) and plain.stats == watched.stats
        assert np.array_equal(plain.q_low, watched.q_low)
        at_events = kr.solve(GENERAL, watched.events.t, "taylor", **options)
        assert np.array_equal(at_events.states, watched.events.states)
        assert np.array_equal(at_events.q_low, watched.events.path.q_low)


@pytest.mark.parametrize("digits", [16, 20, 30])
def test_nutation_of_a_lagrange_top_has_its_period(digits):
    period = kr.exact(LAGRANGE).period
    path = kr.solve(LAGRANGE, 12.6 * period, digits=digits, events=[events.nutation(direction=1)])
    turns = np.diff(path.events.t) / period
    assert len(turns) == 12 and np.abs(turns - 1).max() < 1e-12
    assert np.all(path.events.direction == 1) and path.events.path.apex[:, 2].std() < 1e-13


def top_with_push(precession):
    """Return a fast top that starts at its highest point with a given precession rate."""
    body = kr.Body.symmetric(mass=1, i1=1, i3=0.5, height=1, unphysical=True)
    tilt = (np.cos(0.4), np.sin(0.4), 0, 0)
    axis = np.array([0, -np.sin(0.8), np.cos(0.8)])
    return kr.Scene(
        body, velocity=20 * axis + precession * np.array([0, 0, 1]), attitude=tilt, gravity=1
    )


@pytest.mark.parametrize("precession, loops, cusps", [(-0.3, 2, 0), (0.0, 0, 1), (0.05, 0, 0)])
def test_loops_cusps_and_waves(precession, loops, cusps):
    scene = top_with_push(precession)
    nutations = 10
    path = kr.solve(
        scene,
        (nutations + 0.25) * kr.exact(scene).period,
        events=[events.loop(), events.cusp(), events.nutation(direction=-1)],
    )
    count = np.bincount(path.events.which, minlength=3).tolist()
    assert count[2] == nutations
    assert count[1] == cusps * nutations
    if not cusps:  # at a cusp the precession touches zero, so its sign is due to rounding
        assert abs(count[0] - loops * nutations) <= 1


def test_plane_events_form_a_section():
    for vector, values in (("apex", "apex"), ("m", "m")):
        path = kr.solve(GENERAL, 100, events=[events.plane((1, 2, 0), 0.1, vector, direction=1)])
        section = getattr(path.events.path, values)
        assert len(section) > 3 and np.abs(section @ (1, 2, 0) - 0.1).max() < 1e-13


def test_separatrix_events_occur_when_the_top_flips_over():
    body = kr.Body.cuboid(half=(0.3, 0.6, 1.0), pivot=(0, 0, 0))
    tumbling = kr.Scene(body, body_velocity=(1e-6, 1.0, 1e-6), gravity=1)
    path = kr.solve(tumbling, 300, events=[events.separatrix(tumbling)])
    event_path = path.events.path
    middle = int(np.argsort(body.moments)[1])
    share = np.abs(
        (event_path.velocity * event_path.frame[:, middle]).sum(axis=1)
    ) / np.linalg.norm(event_path.velocity, axis=1)
    assert len(event_path) > 3 and share.min() > 1 - 1e-9
    up = events.separatrix(GENERAL)
    highest = kr.solve(GENERAL, 30, events=[up]).events
    dense = kr.solve(GENERAL, np.linspace(0, 30, 30001), "taylor").apex[:, 2]
    assert len(highest) == np.sum((dense[1:-1] > dense[:-2]) & (dense[1:-1] > dense[2:]))
    with pytest.raises(ValueError, match="has no separatrix: two are equal"):
        events.separatrix(
            kr.Scene(kr.Body.cuboid(half=(1, 1, 2), pivot=(0, 0, 0)), momentum=(1, 2, 3))
        )


def test_a_terminal_event_ends_the_path():
    times = np.linspace(0, 50, 501)
    whole = kr.solve(GENERAL, times, events=[events.nutation(), events.loop()])
    third = np.flatnonzero(whole.events.which == 0)[2]
    short_path = kr.solve(
        GENERAL, times, events=[events.nutation(max_count=3, terminal=True), events.loop()]
    )
    assert np.array_equal(short_path.events.states, whole.events.states[: third + 1])
    end = short_path.events.t[-1]
    assert short_path.t[-1] == end and np.array_equal(
        short_path.states[-1], short_path.events.states[-1]
    )
    assert np.array_equal(short_path.states[:-1], whole.states[times < end])
    later_events = kr.solve(short_path.end, 50 - end, events=[events.nutation()]).events
    rest = whole.events.t[(whole.events.which == 0) & (whole.events.t > end)]
    assert len(later_events) == len(rest) and np.abs(later_events.t + end - rest).max() < 1e-11


def test_max_count_limits_the_events():
    path = kr.solve(
        GENERAL, 50, events=[events.nutation(max_count=2), events.nutation(direction=-1)]
    )
    assert (
        (path.events.which == 0).sum() == 2
        and (path.events.which == 1).sum() > 5
        and path.t[-1] == 50
    )


def test_where_selects_events():
    high = {"apex_z": 1, "1": 0.4}
    both = kr.solve(
        GENERAL, 60, events=[events.plane((1, 0, 0)), events.plane((1, 0, 0), where=high)]
    ).events
    selection = both.path.apex[:, 2] > -0.4
    assert 0 < (both.which == 1).sum() == selection[both.which == 0].sum() < (both.which == 0).sum()


def test_a_constant_of_motion_has_no_events():
    vertical = {f"body_vertical_{i}*body_momentum_{i}": 1 for i in "xyz"}
    specifications = [
        events.crossing({"m_z": 1}, 1.46),
        events.extremum({"m_z": 1}),
        events.extremum(vertical),
    ]
    assert len(kr.solve(GENERAL, 100, events=specifications).events) == 0
    assert len(kr.solve(GENERAL, 10, events=[]).events) == len(kr.solve(GENERAL, 10).events) == 0


def test_docstring_examples_run():
    scope = {"kr": kr, "scene": GENERAL}
    lines = [line.strip() for line in events.__doc__.splitlines() if "kr." in line]
    exec("\n".join(lines), scope)
    assert len(scope["path"].events) > 10 and 0 < scope["half"] < 10


@pytest.mark.parametrize(
    "make, error, message",
    [
        (
            lambda: events.crossing({"mx": 1}),
            ValueError,
            "unknown quantity 'mx'; did you mean 'm_x'",
        ),
        (lambda: events.crossing({"m_x*m_y*m_z": 1}), ValueError, "a quantity or a product of two"),
        (
            lambda: events.crossing({3: 1}),
            ValueError,
            "a quantity or a product of two, as in 'm_x[*]m_y', not 3",
        ),
        (
            lambda: events.crossing({"m_x": np.nan}),
            ValueError,
            "the factor of 'm_x' must be finite",
        ),
        (lambda: events.crossing({"m_x": "1"}), TypeError, "the factor of 'm_x' must be a number"),
        (lambda: events.crossing({}), ValueError, "the function is constant"),
        (lambda: events.crossing({"m_x": 0, "1": 3}), ValueError, "the function is constant"),
        (lambda: events.crossing(7), TypeError, "function must be a component, as 'apex_z', or"),
        (lambda: events.crossing({"m_x": 1}, np.inf), ValueError, "value must be finite"),
        (lambda: events.crossing(len), TypeError, "the polynomial of .*len"),
        (lambda: events.nutation(direction=2), ValueError, "direction must be 1, -1 or 0, not 2"),
        (lambda: events.nutation(max_count=0), ValueError, "max_count must be at least 1"),
        (lambda: events.nutation(terminal=1), TypeError, "terminal must be True or False, not 1"),
        (lambda: events.nutation(where={"m_x": 0}), ValueError, "where is zero"),
        (lambda: events.plane((0, 0, 0)), ValueError, "the function is constant"),
        (lambda: events.plane((1, 0)), ValueError, "normal must be 3 numbers"),
        (lambda: events.plane((1, 0, 0), of="axis"), ValueError, "unknown vector 'axis'"),
        (
            lambda: events.cusp(within=1e-9),
            ValueError,
            "within must be at least 1e-7, .* 1e-09",
        ),
        (lambda: events.separatrix(CORNER), TypeError, "scene must be a kreisel.Scene"),
        (
            lambda: kr.solve(GENERAL, 1, "rk4", step=0.1, events=[]),
            ValueError,
            "of method=.taylor.; .rk4. computes none",
        ),
        (
            lambda: kr.solve(LAGRANGE, 1, "exact", events=[events.loop()]),
            ValueError,
            "'exact' computes none",
        ),
        (
            lambda: kr.solve(LAGRANGE, 1, "geometric", error=1e-3, events=[events.loop()]),
            ValueError,
            "leave events out",
        ),
        (
            lambda: kr.solve(GENERAL, 1, events=["loop"]),
            TypeError,
            "events must be an event of kreisel.events",
        ),
        (lambda: events.crossing("apexz"), ValueError, "did you mean 'apex_z'"),
        (lambda: events.crossing("omega_y"), ValueError, "did you mean 'body_velocity_y'"),
        (lambda: events.crossing("theta", 1), ValueError, "did you mean 'nutation'"),
        (lambda: events.crossing({"omega*spin": 1}), ValueError, "did you mean 'body_velocity_"),
        (
            lambda: events.extremum("apex"),
            ValueError,
            "'apex' has several components: 'apex_x', 'apex_y' and 'apex_z'",
        ),
        (
            lambda: events.crossing("velocity_y"),
            ValueError,
            "no series of 'velocity'.* 'body_velocity_y'",
        ),
        (
            lambda: events.crossing("frame_Tz"),
            ValueError,
            "no series of 'frame', .* these have: q, m,",
        ),
        (lambda: events.crossing("nutation", 0.3), ValueError, "'apex_z', which is its cosine"),
        (lambda: events.extremum("energy"), ValueError, "'energy', .* constant"),
        (lambda: events.crossing("kinetic", 1), ValueError, "kreisel.events.kinetic"),
        (
            lambda: kr.solve(GENERAL, 1, events=[events.crossing({"m_x": 1e308, "m_y": 1e308})]),
            ValueError,
            "range",
        ),
    ],
)
def test_invalid_events_are_refused(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_a_failure_keeps_the_events_found():
    with pytest.raises(kr.Error) as failure:
        kr.solve(GENERAL, 100, events=[events.nutation()], max_steps=20)
    path = failure.value.path
    full = kr.solve(GENERAL, path.t[-1], events=[events.nutation()])
    assert path.t[-1] > 0 and np.array_equal(path.events.states, full.events.states)
    again = pickle.loads(pickle.dumps(failure.value))
    assert np.array_equal(again.path.events.which, path.events.which)


@pytest.mark.skipif(os.name == "nt", reason="needs signals to a process")
def test_ctrl_c_keeps_the_events_found():
    code = """
import os, signal, threading, kreisel as kr
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    events = [kr.events.nutation(max_count=5), kr.events.loop(max_count=5)]
    kr.solve(kr.scenes.asymmetric, 1e7, events=events)
except kr.Interrupted as stopped:
    print(len(stopped.path.events), stopped.path.t[-1])
"""
    result = python(code)
    assert result.returncode == 0, result.stderr
    count, end = map(float, result.stdout.split())
    assert count == 10 and 0 < end < 1e7


def test_events_do_not_depend_on_threads():
    scenes = [GENERAL.replace(momentum=(0.1 * i, 1, 2)) for i in range(4)]
    alone = [kr.solve(scene, 100, events=make_all_events(scene)).events.states for scene in scenes]
    parallel = {}

    def run(i):
        parallel[i] = kr.solve(scenes[i], 100, events=make_all_events(scenes[i])).events.states

    threads = [threading.Thread(target=run, args=(i,)) for i in range(4)]
    for go in (threading.Thread.start, threading.Thread.join):
        list(map(go, threads))
    assert all(np.array_equal(parallel[i], alone[i]) for i in range(4))


@pytest.mark.parametrize("want", [("nutation",), ("energy", "apex"), ("m",)])
def test_events_do_not_depend_on_wanted_quantities(want):
    specifications = [events.nutation(), events.crossing({"apex_x": 1.0})]
    times = np.linspace(0, 20, 11)
    whole = kr.solve(GENERAL, times, events=specifications)
    path = kr.solve(GENERAL, times, events=specifications, want=want)
    assert len(whole.events) > 4 and path.want == want
    assert np.array_equal(path.events.states, whole.events.states)
    assert np.array_equal(path.events.which, whole.events.which)
    for name in ("t", *want):
        assert np.array_equal(getattr(path, name), getattr(whole, name))
    first = kr.solve(GENERAL, 20.0, events=[events.nutation(terminal=True)], want=want)
    assert first.t[-1] == first.events.t[0]


@pytest.mark.parametrize("name", sorted(events.components))
def test_components_are_events_by_name(name):
    if name == "1":
        with pytest.raises(ValueError, match="the function is constant"):
            events.crossing(name)
        return
    assert events.crossing(name, 0.25) == events.crossing({name: 1.0}, 0.25)
    assert events.extremum(name, where="apex_z") == events.extremum({name: 1}, where={"apex_z": 1})
    quantity = next(q for q in QUANTITIES.values() if name in q.components)
    values = kr.solve(GENERAL, [0.0, 0.9], want=(quantity.name,))
    column = quantity.components.index(name)
    level = getattr(values, quantity.name).reshape(2, -1)[:, column].mean()
    found = kr.solve(GENERAL, 0.9, events=events.crossing(name, level)).events
    if name == "m_z":  # a constant has no events
        assert len(found) == 0
        return
    assert len(found) >= 1 and found.which.tolist() == [0] * len(found)
    level_values = getattr(found.path, quantity.name).reshape(len(found), -1)[:, column]
    np.testing.assert_allclose(level_values, level, rtol=0, atol=1e-13)


def test_a_single_event_counts_as_a_list():
    one, several = (kr.solve(GENERAL, 9, events=e) for e in (events.loop(), [events.loop()]))
    assert np.array_equal(one.events.states, several.events.states) and len(one.events) == 2


@pytest.mark.parametrize("least", [1.0, 1e-6, 1e-12, 1e-14])
def test_thin_bodies_have_all_energy_crossings(least):
    """Check that no false events are found if one moment of inertia is very small."""
    body = kr.Body.symmetric(1, 1, least, 1, unphysical=True)
    scene = kr.Scene(body, momentum=(0, 0, 0), attitude=(0.6, 0.8, 0, 0), gravity=1)
    twice = {f"body_momentum_{i}*body_velocity_{i}": 0.5 for i in "xyz"}
    specifications = events.kinetic(0.1), events.extremum(twice)
    path = kr.solve(scene, 40, "taylor", events=specifications)
    kinetic = kr.solve(scene, np.linspace(0, 40, 4001)).kinetic
    crossings, extrema = (
        int(np.count_nonzero(np.diff(np.sign(g)))) for g in (kinetic - 0.1, np.diff(kinetic))
    )
    assert (
        list(np.bincount(path.events.which, minlength=2)) == [crossings, extrema] and extrema > 20
    )
