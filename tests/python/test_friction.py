"""Tests of dry friction against closed-form solutions, and of tangents with friction."""

import itertools
import math

import kreisel as kr
import numpy as np
import pytest

LAGRANGE = kr.Body(1.2, (1.3, 1.3, 1.7), (0, 0, 0.4), unphysical=True)
GENERAL = kr.Body(1.2, (1.3, 1.7, 2.1), (0.1, -0.2, 0.4))
INERTIA = [[1.3, 0.1, 0.2], [0.1, 1.8, -0.1], [0.2, -0.1, 2.0]]
TENSOR = kr.Body(1.2, INERTIA, (0.2, -0.3, 0.4))
SPUN = kr.Scene.spinning(LAGRANGE, spin=2.0, tilt=0.7, precession=0.3, gravity=1.3)
SLIDING = kr.Scene(GENERAL, gravity=1.3, body_velocity=(0.4, 0.3, 1.0), friction=0.3)
# A body whose spin friction ends three times, and lets go twice.
SLIPPING = kr.Scene(
    kr.Body(1.0, (3.0, 2.0, 4.0), (0.5, 0.0, 0.6), unphysical=True),
    momentum=(0.8, -2.0, 1.5),
    gravity=2.0,
    friction=1.0,
)
# Because the damping is unequal, gravity drives the spin. Shaking reverses gravity, so friction
# holds the top at some times and lets it slip at others.
STRONG = kr.Scene(
    kr.Body(1, (1, 1.2, 1.7), (0.1, 0.2, 1), unphysical=True),
    momentum=(0.3, 0.4, 1.0),
    attitude=(0.8, 0.6, 0, 0),
    gravity=1,
    damping=(1e4, 2e3, 3e4),
    friction=0.3,
    shaking=(0.5, 3.0, 0.2),
)
stopped = kr.events.stopped


def subtract(one, other, name="q"):
    """Return the difference of the last attitudes or momenta of two paths, to all their digits."""
    high, low = ((getattr(one, x) - getattr(other, x))[-1] for x in (name, f"{name}_low"))
    return high + low


@pytest.mark.parametrize("damping", [0.0, 0.2])
@pytest.mark.parametrize("tilt", [0.0, 0.7, math.pi])
def test_the_spin_of_a_symmetric_top_in_closed_form(damping, tilt):
    top = kr.Scene.spinning(
        LAGRANGE, spin=-2.0, tilt=tilt, gravity=1.3, friction=0.1, damping=damping
    )
    rate = damping / 1.7
    stop = math.log1p(2.0 * damping / 0.1) / rate if damping else 1.7 * 2.0 / 0.1
    path = kr.solve(top, np.linspace(0.0, 1.5 * stop, 301))
    decay = np.exp(-rate * path.t)
    loss = 0.1 * (1.0 - decay) / damping if damping else 0.1 * path.t / 1.7
    assert np.abs(path.spin + np.maximum(2.0 * decay - loss, 0.0)).max() < 1e-12
    found = kr.solve(top, 1.5 * stop, events=[stopped()]).events
    assert found.t == pytest.approx([stop], rel=1e-13)
    end = kr.solve(top, 1.5 * stop, events=[stopped(terminal=True)])
    assert end.t[-1] == pytest.approx(stop, rel=1e-13) and abs(end.spin[-1]) < 1e-14


def test_a_stopped_top_is_a_spherical_pendulum():
    top = SPUN.replace(friction=0.5)
    stop = kr.solve(top, 20.0, events=[stopped(terminal=True)])
    path = kr.solve(top, [stop.t[-1] + 5.0])
    still = kr.solve(stop.end.replace(friction=0.0), [5.0])
    assert kr.attitude_error(path.q[-1], still.q[-1]) < 1e-13 and abs(path.spin[-1]) < 1e-15


@pytest.mark.parametrize("friction", [1e3, 1e16, 1e150, 1e308])
def test_friction_at_rest_does_not_shorten_the_steps(friction):
    path = kr.solve(SPUN.replace(friction=friction), [0, 1, 5], max_steps=200)
    assert np.all(np.abs(path.spin[1:]) < 1e-15) and np.ptp(path.energy[1:]) < 1e-14


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
    path = kr.solve(SLIPPING, 20, digits=digits, events=stopped(where={"1": 1.0}))
    assert path.events.t == pytest.approx(stops_and_releases[0], abs=1e-3)
    directions = np.sign([kr.solve(SLIPPING, [t - 1e-3]).spin[0] for t in path.events.t])
    assert np.array_equal(path.events.direction, -directions)
    for direction in (1, -1):
        chosen = kr.solve(SLIPPING, 20, digits=digits, events=stopped(direction=direction))
        assert np.array_equal(chosen.events.t, path.events.t[path.events.direction == direction])
    end = kr.solve(SLIPPING, 30, digits=digits, events=stopped(max_count=3, terminal=True))
    assert end.t[-1] == path.events.t[2]
    members = kr.solve(kr.Scene.stack([SLIPPING] * 2), [20.0], digits=digits, events=stopped())
    assert np.array_equal(members[1].events.t, path.events.t)
    section = kr.section(SLIPPING, stopped(), n=3, digits=digits)
    assert np.array_equal(np.ravel(section.t), path.events.t)


def test_events_of_a_continued_motion_equal_those_of_the_whole_motion(stops_and_releases):
    stops, releases = stops_and_releases
    whole = kr.solve(SLIPPING, 20, events=stopped()).events.t
    begins = np.sort(np.concatenate((0.5 * (stops[:2] + releases), releases + 0.2)))
    states = kr.solve(SLIPPING, begins)
    for i, begin in enumerate(begins):
        rest = kr.solve(states.scene_at(i), 20.0 - begin, events=stopped()).events.t
        assert rest + begin == pytest.approx(whole[whole > begin], abs=1e-9)
        run = kr.start(SLIPPING, events=stopped())
        run.to([begin])
        run.change(gravity=SLIPPING.gravity)
        assert run.to(20.0).events.t == pytest.approx(whole[whole > begin], abs=1e-9)


def test_a_push_ends_the_rest():
    top = SPUN.replace(friction=1.0)
    stop = kr.solve(top, 20.0, events=[stopped()]).events.t[0]
    run = kr.start(top)
    run.to([2.0 * stop])
    run.push((0.0, 0.0, 2.0))
    again = kr.resume(run.checkpoint)
    assert abs(run.to([2.0 * stop]).spin[-1]) > 0.05
    rest, copy = run.to([10.0 * stop]), again.to([2.0 * stop, 10.0 * stop])
    assert abs(rest.spin[-1]) < 1e-14 and np.array_equal(rest.states[-1], copy.states[-1])


def normalize(q):
    return np.array(q) / np.linalg.norm(q)


GYROSTAT = kr.Scene(
    kr.Body(0.286, (2, 2, 1), (-0.263, 0.826, 0), unphysical=True, rotor=(-0.124, -0.456, -0.938)),
    momentum=(0.723, -0.26, -0.328),
    attitude=normalize((0.453, 0.089, 0.686, 0.563)),
    gravity=1.409,
    friction=1.304,
)


@pytest.mark.parametrize("scene", [SLIPPING, GYROSTAT])
def test_a_loose_tolerance_does_not_end_the_motion_at_a_release(scene):
    accurate = kr.solve(scene, 8.0, "taylor").q[-1]
    for tol in np.geomspace(1e-6, 1e-3, 60):
        path = kr.solve(scene, 8.0, "taylor", tol=tol)
        assert kr.attitude_error(path.q[-1], accurate) < 50.0 * tol
    members = kr.solve(kr.Scene.stack([scene] * 2), [8.0], "taylor", tol=1e-4)
    assert not members.failed.size


def test_the_spin_grows_backward_and_a_held_top_has_no_unique_past():
    fast = SPUN.replace(friction=0.1)
    back = kr.solve(fast, [0.0, -3.0])
    assert np.abs(back.spin - (2.0 + 0.1 / 1.7 * 3.0))[-1] < 1e-13
    assert kr.attitude_error(kr.solve(back.end, [3.0]).q[-1], fast.attitude) < 1e-13
    for held, t in ((fast, 60.0), (STRONG.replace(friction=7.0), 1.0)):
        with pytest.raises((kr.Error, ValueError), match="stopped"):
            kr.solve(kr.solve(held, [t]).end, [-1e-3])


@pytest.mark.parametrize("digits", [None, 20, 30])
@pytest.mark.parametrize("turning", [(0, 0, 0), (0, 4.7e-5, 5.5e-5), (1, 2, 30)])
@pytest.mark.parametrize("rate", [0, 50, 5e5])
def test_a_held_top_with_a_rotor_on_a_turning_support_has_no_unique_past(rate, turning, digits):
    wheel = kr.Body.disk(0.05, (0, 0, -0.06), mass=0.5)
    wheel = wheel.with_rotor(spin=rate, inertia=1e-5, axis=(0, 0, 1))
    losses = {"damping": 1e-2, "friction": 0.2, "turning": turning}
    top = kr.Scene.spinning(wheel, spin=100, tilt=2.5, gravity=9.81, **losses)
    for end in (10.0, 20.0):
        held = kr.solve(top, [end], digits=digits).end
        with pytest.raises(kr.Error, match="stopped"):
            kr.solve(held, [-1e-3], digits=digits)


@pytest.mark.parametrize("friction", [0.05, 0.2, 2.0])
def test_a_strongly_damped_top_moves_as_if_it_had_no_inertia(friction):
    """Compare with the velocity u that solves D u = T - f a sign <u, a>.

    D is the damping, T the torque of the weight and a the apex. Friction holds the spin <u, a> at
    zero if a torque of at most f suffices.
    """
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    damping, com = np.array((1e6, 3e6, 2e5)), np.array(STRONG.body.com)
    apex = com / np.linalg.norm(com)

    def rates(_, q):
        torque = np.cross(kr.quaternion.turn_back(tuple(q), (0, 0, 1)), com)
        hold = -(apex @ (torque / damping)) / (apex @ (apex / damping))
        velocity = (torque + np.clip(hold, -friction, friction) * apex) / damping
        return 0.5 * np.array(kr.quaternion.multiply(tuple(q), (0, *velocity)))

    truth = solve_ivp(rates, (0, 5e5), STRONG.attitude, "DOP853", rtol=1e-12, atol=1e-14)
    scene = STRONG.replace(damping=damping, friction=friction, shaking=None)
    path = kr.solve(scene.replace(body_velocity=(0, 0, 0)), [5e5], max_steps=150)
    assert kr.attitude_error(path.q[0], normalize(truth.y[:, -1])) < 1e-10


@pytest.mark.parametrize("damping", [(2e3, 1e4, 300.0), (0.0, 1e4, 1e4), (1e4, 0.0, 0.0)])
@pytest.mark.parametrize("body", [STRONG.body, TENSOR, LAGRANGE])
def test_short_steps_give_the_same_path(body, damping):
    """Compare with a path that has tangents, and therefore steps as short as the fast motion."""
    both = {"turning": (0.1, 0.2, 0.3), "shaking": (0.1, 3.0, 0.2)}
    for friction, words, digits in ((0.3, {}, 16), (0.02, both, 30), (0.1, both, 20)):
        words = {"damping": damping, "friction": friction, "body": body, "shaking": None, **words}
        scene = STRONG.replace(**words, momentum=STRONG.momentum)
        path = kr.solve(scene, [0.1], "taylor", digits=digits)
        short = kr.solve(scene, [0.1], "taylor", digits=digits, tangents="damping")
        limit = {16: 2e-15, 20: 1e-19, 30: 1e-28}[digits]
        assert np.abs(subtract(path, short)).max() < limit


def test_a_stop_at_which_the_spin_changes_slowly():
    """Check a spin that reaches zero with a slope far below that of the friction."""
    body = kr.Body(1, (0.43, 0.43, 0.24), (0, 0, 0.5), unphysical=True, rotor=(0.1, -0.9, 0.2))
    words = {"body": body, "damping": (22.0, 10.0, 7900.0), "friction": 1.4e-3, "shaking": None}
    scene = STRONG.replace(**words, momentum=STRONG.momentum)
    stop = kr.solve(scene, 0.3, events=[stopped()]).events.t[-1]
    path = kr.solve(scene, [stop + 0.01], "taylor", digits=30)
    short = kr.solve(scene, [stop + 0.01], "taylor", digits=30, tangents="damping")
    assert np.abs(subtract(path, short)).max() < 1e-28


@pytest.mark.parametrize("damping", [1e6, 1e10, (1e6, 1e6, 0.0), (1e4, 1e9, 3e5)])
@pytest.mark.parametrize("shaking", [None, (0.1, 3.0, 0.2)])
def test_few_steps_suffice_beside_strong_damping(damping, shaking):
    for friction, turning in itertools.product((1e-6, 0.1, 100.0), (None, (0.1, 0.2, 0.3))):
        words = {"friction": friction, "turning": turning, "shaking": shaking}
        scene = STRONG.replace(damping=damping, momentum=STRONG.momentum, **words)
        path = kr.solve(scene, [1.0], max_steps=150)
        deep = kr.solve(scene, [1.0], digits=30, max_steps=300)
        assert kr.attitude_error(path.q[0], deep.q[0]) < 2e-15


def test_a_slow_spin_is_kept_beside_strong_damping():
    body = kr.Body(1, (1, 1, 1.7), (0, 0, 1), unphysical=True)
    losses = {"gravity": 1, "damping": (1e10, 1e10, 0), "friction": 1e-6}
    top = kr.Scene(body, body_velocity=(0, 0, 1e-4), attitude=(0.8, 0.6, 0, 0), **losses)
    stop = 1.7 * 1e-4 / 1e-6
    path = kr.solve(top, [0.5 * stop, 2 * stop], max_steps=200, events=[stopped()])
    assert path.spin == pytest.approx([0.5e-4, 0.0], abs=1e-17)
    assert path.events.t == pytest.approx([stop], rel=1e-12)


def test_stops_and_slips_are_found_beside_strong_damping():
    found = kr.solve(STRONG, 6.0, events=[stopped()], max_steps=1500).events
    assert len(found) > 2 and np.abs(kr.solve(STRONG, found.t).spin).max() < 1e-15
    deep = kr.solve(STRONG, 6.0, digits=30, events=[stopped()]).events
    assert found.t == pytest.approx(deep.t, abs=1e-9)
    spins = kr.solve(STRONG, np.linspace(0.1, 6.0, 200)).spin
    assert spins.min() < -1e-7 and spins.max() > 1e-7 and np.any(np.abs(spins) < 1e-15)


@pytest.mark.parametrize("digits", [20, 30])
def test_slips_at_times_that_do_not_resolve_the_transient(digits):
    """Check transients that are shorter than the distance between doubles near their time."""
    scene = STRONG.replace(damping=(1e10, 2e9, 3e10), shaking=(4e18, 1e-9, 0.2))
    scene, times = scene.replace(body_velocity=(0, 0, 0)), [1e9, 4e9, 2e10, 6e10]
    path = kr.solve(scene, times, digits=digits, max_steps=600, events=[stopped()])
    plain = kr.solve(scene, times, max_steps=300)
    assert len(path.events) > 4 and kr.attitude_error(path.q, plain.q).max() < 1e-12
    assert np.abs(path.m - plain.m).max() < 1e-12 * np.abs(plain.m).max()


def test_the_derivatives_of_a_spin_in_closed_form():
    top = kr.Scene.spinning(LAGRANGE, spin=-2.0, tilt=0.7, gravity=1.3, friction=0.1)
    stop = 1.7 * 2.0 / 0.1
    path = kr.solve(top, [0.5 * stop, 1.5 * stop], tangents=("start", "friction"))
    slopes = path.derivative("spin")
    assert slopes[:, -1] == pytest.approx([0.5 * stop / 1.7, 0.0], abs=1e-10)
    assert np.abs(slopes[1]).max() < 1e-10
    for digits in (16, 30):
        words = {"gravity": 1.3, "attitude": (0.6, 0.8, 0.0, 0.0), "friction": 0.2}
        held = kr.Scene(LAGRANGE, momentum=(0, 0, 0), **words)
        names = ("start", "gravity", "turning")
        path = kr.solve(held, [0.0, 3.0], "taylor", tangents=names, digits=digits)
        assert np.abs(path.derivative("spin")).max() < 1e-13


def test_a_start_that_friction_cannot_hold_has_no_tangents():
    top = SLIDING.replace(friction=1e-3, body_velocity=np.cross(GENERAL.com, (1.0, -2.0, 0.3)) * 9)
    with pytest.raises(kr.Error, match="tangent"):
        kr.solve(top, [0.0, 1.0], tangents="start")
    assert np.isfinite(kr.solve(top, [0.0, 1.0], tangents="gravity").tangents).all()


FREE = kr.Scene(kr.Body(1, (1, 2, 2.5), (0, 0, 0)), momentum=(0, 0, 1), friction=0.1)


@pytest.mark.parametrize(
    "call",
    [
        *[lambda x=x: SLIDING.replace(friction=x) for x in (math.nan, math.inf, -0.1, "x")],
        lambda: kr.Scene.from_euler(GENERAL, (0, 1, 0), friction=-1, gravity=1),
        lambda: kr.start(SLIDING).change(friction=-1),
        lambda: SLIDING.vary(friction=[0.0, math.nan]),
        lambda: kr.exact(SPUN.replace(friction=0.1)),
        lambda: kr.solve(SLIDING, 1.0, "exact"),
        lambda: kr.solve(SLIDING, 1.0, "strang", step=0.1),
        lambda: kr.solve(SLIDING, 1.0, "geometric", error=1e-3),
        lambda: kr.chaos(SLIDING, 10.0),
        lambda: kr.chaos(SLIDING.vary(mass=[1.0, 2.0]), 10.0),
        lambda: kr.rod(kr.solve(SLIDING, np.linspace(0, 10, 101))),
        lambda: kr.frequencies(kr.solve(SLIDING, np.linspace(0, 10, 101))),
        lambda: kr.Scene.spinning(
            LAGRANGE, spin=9.0, tilt=0.3, steady=True, friction=0.1, gravity=1
        ),
        lambda: kr.solve(SLIDING.replace(friction=0), 1.0, tangents="friction"),
        lambda: kr.solve(SLIDING.vary(friction=[0.0, 0.1]), 1.0, tangents="friction"),
        lambda: kr.solve(FREE, 1.0, tangents=("start", "com")),
    ],
)
def test_bad_friction_and_functions_without_friction_are_refused(call):
    with pytest.raises((TypeError, ValueError), match="friction"):
        call()
