"""Tests of dry friction against SciPy and closed-form solutions."""

import math

import kreisel as kr
import numpy as np
import pytest
from moving_tops import (
    BODIES,
    check_members,
    check_resumed,
    compare_methods,
    integral_of,
    integrate_with_stops,
    list_unsupported_calls,
    make_scene,
)
from tops import unit

FRICTION = 0.05
LAGRANGE = kr.Body(1.2, (1.3, 1.3, 1.7), (0, 0, 0.4), unphysical=True)
HEAVY = make_scene("general", friction=FRICTION)
SPUN = kr.Scene.spinning(LAGRANGE, spin=2.0, tilt=0.7, precession=0.3, gravity=1.3)


@pytest.mark.parametrize("name", BODIES)
def test_taylor_agrees_with_scipy(name):
    for friction in (0.05, 0.5):
        for words in ({}, {"damping": (0.1, 0.2, 0.3), "turning": (0.3, -0.2, 0.5)}):
            scene = make_scene(name, friction=friction, shaking=(0.1, 5.0, 0.3), **words)
            q, m, stop_times = integrate_with_stops(scene, 6.0)
            path = kr.solve(scene, [0.0, 6.0])
            assert kr.attitude_error(path.q[-1], q) < 1e-8, (name, friction, stop_times)
            assert np.abs(path.m[-1] - m).max() < 1e-8


@pytest.mark.parametrize("name", BODIES)
def test_methods_agree_with_scipy_before_the_first_stop(name):
    scene = make_scene(name, friction=FRICTION, shaking=(0.1, 5.0, 0.3))
    assert integrate_with_stops(scene, 1.3)[2] == []
    compare_methods(scene, 1.3, {"taylor"})


@pytest.mark.parametrize("damping", [0.0, 0.2])
def test_the_spin_of_a_symmetric_top_in_closed_form(damping):
    for tilt in (0.0, 0.7, math.pi):
        top = kr.Scene.spinning(
            LAGRANGE, spin=-2.0, tilt=tilt, gravity=1.3, friction=0.1, damping=damping
        )
        rate = damping / 1.7
        stop = math.log1p(2.0 * damping / 0.1) / rate if damping else 1.7 * 2.0 / 0.1
        path = kr.solve(top, np.linspace(0.0, 1.5 * stop, 301))
        decay = np.exp(-rate * path.t)
        loss = 0.1 * (1.0 - decay) / damping if damping else 0.1 * path.t / 1.7
        expected = -np.maximum(2.0 * decay - loss, 0.0)
        assert np.abs(path.spin - expected).max() < 1e-12
        found = kr.solve(top, 1.5 * stop, events=[kr.events.stopped()]).events
        assert found.t == pytest.approx([stop], rel=1e-13)
        end = kr.solve(top, 1.5 * stop, events=[kr.events.stopped(terminal=True)])
        assert end.t[-1] == pytest.approx(stop, rel=1e-13) and abs(end.spin[-1]) < 1e-14


SLIPPING = kr.Scene(
    kr.Body(1.0, (3.0, 2.0, 4.0), (0.5, 0.0, 0.6), unphysical=True),
    momentum=(0.8, -2.0, 1.5),
    gravity=2.0,
    friction=1.0,
)


@pytest.fixture(scope="module")
def stops_and_releases():
    """The times at which the spin of SLIPPING ends, to 0.001, and at which friction lets it go."""
    path = kr.solve(SLIPPING, np.linspace(0.0, 20.0, 20001))
    is_held = np.abs(path.spin) < 1e-13
    stops = path.t[1:][~is_held[:-1] & is_held[1:]]
    releases = path.t[:-1][is_held[:-1] & ~is_held[1:]]
    assert len(stops) == 3 and len(releases) == 2
    spins = np.interp((stops[1] - 0.1, releases[1] + 0.1), path.t, path.spin)
    assert np.all(spins < 0.0)  # after the second release, the top slides as before its stop
    return stops, releases


@pytest.mark.parametrize("digits", [None, 20, 30])
def test_a_release_by_friction_is_no_event(stops_and_releases, digits):
    stops = pytest.approx(stops_and_releases[0], abs=1e-3)
    stopped = kr.events.stopped
    path = kr.solve(SLIPPING, 20, digits=digits, events=stopped(where={"1": 1.0}))
    assert path.events.t == stops
    directions = np.sign([kr.solve(SLIPPING, [t - 1e-3]).spin[0] for t in path.events.t])
    assert np.array_equal(path.events.direction, -directions)
    for direction in (1, -1):
        chosen = kr.solve(SLIPPING, 20, digits=digits, events=stopped(direction=direction))
        assert np.array_equal(chosen.events.t, path.events.t[path.events.direction == direction])
    end = kr.solve(SLIPPING, 30, digits=digits, events=stopped(max_count=3, terminal=True))
    assert end.t[-1] == path.events.t[2]
    members = kr.solve(kr.Ensemble.of([SLIPPING] * 2), [20.0], digits=digits, events=stopped())
    assert np.array_equal(members[1].events.t, path.events.t)
    section = kr.section(SLIPPING, stopped(), n=3, digits=digits)
    assert np.array_equal(np.ravel(section.t), path.events.t)


def test_events_of_a_continued_motion_equal_those_of_the_whole_motion(stops_and_releases):
    stops, releases = stops_and_releases
    whole = kr.solve(SLIPPING, 20, events=kr.events.stopped()).events.t
    begins = np.sort(np.concatenate((0.5 * (stops[:2] + releases), releases + 0.2)))
    states = kr.solve(SLIPPING, begins)
    for i, begin in enumerate(begins):
        rest = kr.solve(states.scene_at(i), 20.0 - begin, events=kr.events.stopped()).events.t
        assert rest + begin == pytest.approx(whole[whole > begin], abs=1e-9)
        run = kr.start(SLIPPING, events=kr.events.stopped())
        run.to([begin])
        run.change(gravity=SLIPPING.gravity)
        assert run.to(20.0).events.t == pytest.approx(whole[whole > begin], abs=1e-9)


SHAKEN_SPHEROID = kr.Scene(
    kr.Body(0.731, (0.857, 0.857, 1.713), (-0.315, -0.436, -0.763), unphysical=True),
    momentum=(0.196, 0.512, 0.315),
    attitude=unit((-0.113, -0.589, -0.789, 0.133)),
    gravity=1.15,
    shaking=(0.05, 1.22, -0.482),
    friction=0.173,
)
GYROSTAT = kr.Scene(
    kr.Body(0.286, (2, 2, 1), (-0.263, 0.826, 0), unphysical=True, rotor=(-0.124, -0.456, -0.938)),
    momentum=(0.723, -0.26, -0.328),
    attitude=unit((0.453, 0.089, 0.686, 0.563)),
    gravity=1.409,
    friction=1.304,
)


@pytest.mark.parametrize("scene", [SHAKEN_SPHEROID, GYROSTAT])
def test_a_loose_tolerance_does_not_end_the_motion_at_a_release(scene):
    accurate = kr.solve(scene, 8.0, "taylor").q[-1]
    for tol in np.geomspace(1e-6, 1e-3, 200):
        path = kr.solve(scene, 8.0, "taylor", tol=tol)
        assert kr.attitude_error(path.q[-1], accurate) < 50.0 * tol
    members = kr.solve(kr.Ensemble.of([scene] * 2), [8.0], "taylor", tol=1e-4)
    assert not members.status.any()


def test_a_stopped_top_is_a_spherical_pendulum():
    top = SPUN.replace(friction=0.5)
    stop = kr.solve(top, 20.0, events=[kr.events.stopped(terminal=True)])
    path = kr.solve(top, [stop.t[-1] + 5.0])
    still = kr.solve(stop.end.replace(friction=0.0), [5.0])
    assert kr.attitude_error(path.q[-1], still.q[-1]) < 1e-13
    assert abs(path.spin[-1]) < 1e-15


@pytest.mark.parametrize("friction", [1e3, 1e16, 1e150, 1e308])
def test_friction_at_rest_does_not_shorten_the_steps(friction):
    path = kr.solve(SPUN.replace(friction=friction), [0, 1, 5], max_steps=200)
    assert np.all(np.abs(path.spin[1:]) < 1e-15)
    assert np.ptp(path.energy[1:]) < 1e-14


def test_the_power_balance():
    scene = make_scene("tensor", friction=FRICTION, damping=(0.02, 0.03, 0.05))
    scene = scene.replace(body_velocity=(1.0, -2.0, 2.5))
    t = np.linspace(0, 3, 2001)
    path = kr.solve(scene, t)
    axes = np.array([kr.quaternion.turn(scene.body.axes, e) for e in np.eye(3)])
    power = -((path.body_velocity @ axes.T) ** 2 @ np.array(scene.damping))
    power -= FRICTION * np.abs(path.spin)
    assert np.abs(path.spin).min() > 1e-3  # no kink in the integrand
    assert path.energy[-1] - path.energy[0] == pytest.approx(integral_of(power, t), abs=1e-10)
    assert math.isnan(path.energy_error)


def test_digits_agree_with_each_other_across_a_stop():
    scene = make_scene("lagrange", friction=0.5)
    paths = [kr.solve(scene, [0.0, 4.0], "taylor", digits=digits) for digits in (16, 20, 30)]
    assert kr.solve(scene, 4.0, events=[kr.events.stopped()]).events.t.size
    assert kr.attitude_error(paths[0].q[-1], paths[2].q[-1]) < 1e-14
    low = (paths[1].q[-1] - paths[2].q[-1]) + (paths[1].q_low[-1] - paths[2].q_low[-1])
    assert np.abs(low).max() < 1e-18


def test_backward_in_time_a_stopped_top_has_no_unique_past():
    fast = SPUN.replace(friction=0.1)
    back = kr.solve(fast, [0.0, -3.0])
    assert np.abs(back.spin - (2.0 + 0.1 / 1.7 * 3.0))[-1] < 1e-13
    assert kr.attitude_error(kr.solve(back.end, [3.0]).q[-1], fast.attitude) < 1e-13
    path = kr.solve(fast, 60.0)
    with pytest.raises((kr.Error, ValueError), match="stopped"):
        kr.solve(path.end, [-1.0])


@pytest.mark.parametrize("digits", [None, 20, 30])
@pytest.mark.parametrize("turning", [(0, 0, 0), (0, 4.7e-5, 5.5e-5), (1, 2, 30)])
@pytest.mark.parametrize("rate", [0, 50, 5e5])
def test_a_stopped_top_with_a_rotor_on_a_turning_support_has_no_unique_past(rate, turning, digits):
    wheel = kr.Body.disk(0.05, (0, 0, -0.06), mass=0.5)
    wheel = wheel.with_rotor(spin=rate, inertia=1e-5, axis=(0, 0, 1))
    losses = {"damping": 1e-2, "friction": 0.2, "turning": turning}
    top = kr.Scene.spinning(wheel, spin=100, tilt=2.5, gravity=9.81, **losses)
    for end in (10.0, 20.0):
        stopped = kr.solve(top, [end], digits=digits).end
        with pytest.raises(kr.Error, match="stopped"):
            kr.solve(stopped, [-1e-3], digits=digits)


def test_runs_are_resumed_across_a_stop():
    top = SPUN.replace(friction=1.0)
    stop = kr.solve(top, 20.0, events=[kr.events.stopped()]).events.t[0]
    for t in ((0.5 * stop, 1.5 * stop), (1.2 * stop, 2.0 * stop)):
        check_resumed(top, [{"method": "taylor"}, {"method": "taylor", "digits": 20}], t)
    check_resumed(HEAVY, [{"method": "taylor"}])
    run = kr.start(top)
    run.to([2.0 * stop])
    run.push((0.0, 0.0, 2.0))
    assert abs(run.to([2.0 * stop]).spin[-1]) > 0.05
    assert abs(run.to([10.0 * stop]).spin[-1]) < 1e-14


def test_members_of_an_ensemble_equal_single_tops():
    tops = HEAVY.vary(friction=[1e-3, 0.05, 0.7])
    assert kr.Ensemble.of([tops[0], tops[1]])[1] == tops[1] == kr.Source.of(tops)[1]
    assert tops.axes == ("friction",) and tops.coords["friction"].tolist() == [1e-3, 0.05, 0.7]
    check_members(tops, [0.0, 5.0])
    check_members(tops, [0.0, 5.0], digits=20)
    paths = kr.solve(tops, [0.0, 5.0], events=[kr.events.stopped()])
    assert not paths.status.any()
    assert kr.Scene.from_toml(HEAVY.to_toml()) == HEAVY and "friction=0.05" in repr(HEAVY)


@pytest.mark.parametrize("friction", [math.nan, math.inf, -0.1, "x", (1, 2, 3)])
def test_invalid_friction_is_refused(friction):
    for make in (
        lambda: HEAVY.replace(friction=friction),
        lambda: kr.Scene.from_euler(HEAVY.body, (0, 1, 0), friction=friction, gravity=1),
        lambda: kr.start(HEAVY).change(friction=friction),
    ):
        with pytest.raises((TypeError, ValueError), match="friction"):
            make()
    if friction != (1, 2, 3):
        with pytest.raises((TypeError, ValueError), match="friction"):
            HEAVY.vary(friction=[0.0, friction])


def test_functions_without_friction_refuse_it():
    path = kr.solve(HEAVY, np.linspace(0, 10, 101))
    for call in (
        *list_unsupported_calls(HEAVY, path),
        lambda: kr.exact(SPUN.replace(friction=0.1)),
        lambda: kr.solve(SPUN.replace(friction=0.1), 1.0, "exact"),
        lambda: kr.Scene.spinning(
            LAGRANGE, spin=9.0, tilt=0.3, steady=True, friction=0.1, gravity=1
        ),
        lambda: kr.solve(make_scene("general"), 1.0, tangents="friction"),
        lambda: kr.solve(HEAVY.vary(friction=[0.0, 0.1]), 1.0, tangents="friction"),
        lambda: kr.solve(make_scene("free", friction=0.1), 1.0, tangents=("start", "com")),
    ):
        with pytest.raises(ValueError, match="friction"):
            call()
