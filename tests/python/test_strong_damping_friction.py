"""Tests of strongly damped tops with dry friction."""

import kreisel as kr
import numpy as np
import pytest
from moving_tops import TENSOR, check_members, check_resumed, integrate_with_stops

MOMENTS, COM = (1, 1.2, 1.7), (0.1, 0.2, 1)
START = {"momentum": (0.3, 0.4, 1.0), "attitude": (0.8, 0.6, 0, 0), "gravity": 1}
TURNING, SHAKING = (0.1, 0.2, 0.3), (0.1, 3.0, 0.2)
ROTOR = (0.3, -0.4, 0.8)
BODIES = {
    "general": kr.Body(1, MOMENTS, COM, unphysical=True),
    "tensor": kr.Body(1.2, TENSOR, (0.2, -0.3, 0.4), unphysical=True, rotor=ROTOR),
    "lagrange": kr.Body(1, (1, 1.7, 1), (0, 0.8, 0), unphysical=True, rotor=(0, 2, 0)),
    "free": kr.Body(1, MOMENTS, (0, 0, 0), rotor=ROTOR),
    "spherical": kr.Body(1, (1.2, 1.2, 1.2), COM, unphysical=True),
}
WORDS = (
    {},
    {"turning": TURNING},
    {"shaking": SHAKING},
    {"turning": TURNING, "shaking": SHAKING},
)
# Because the damping is unequal, gravity drives the spin. Shaking reverses gravity, so friction
# holds the top at some times and lets it slip at others.
SLIPS = kr.Scene(
    BODIES["general"], **START, damping=(1e4, 2e3, 3e4), friction=0.3, shaking=(0.5, 3.0, 0.2)
)


def make_scene(name="general", **words):
    return kr.Scene(BODIES[name], **START, **words)


def follow_torque(scene, t):
    """Return the attitude at time `t` of a top whose moments of inertia are neglected.

    Its velocity is determined by the damping D, the torque T of the weight and the friction f: D u
    = T - f a sign <u, a>, or <u, a> = 0 if a friction of at most f suffices.
    """
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    damping, com = np.array(scene.damping), np.array(scene.body.com)
    apex = com / np.linalg.norm(com)

    def rates(_, q):
        up = np.array(kr.quaternion.turn_back(tuple(q), (0, 0, 1)))
        torque = np.cross(up, com)
        hold = -(apex @ (torque / damping)) / (apex @ (apex / damping))
        friction = np.clip(hold, -scene.friction, scene.friction)
        velocity = (torque + friction * apex) / damping
        return 0.5 * np.array(kr.quaternion.multiply(tuple(q), (0, *velocity)))

    solution = solve_ivp(rates, (0, t), scene.attitude, "DOP853", rtol=1e-12, atol=1e-14)
    return solution.y[:, -1] / np.linalg.norm(solution.y[:, -1])


@pytest.mark.parametrize(
    "name, damping, friction, words",
    [
        ("general", 200.0, 0.02, {}),
        ("tensor", (40.0, 200.0, 90.0), 0.3, WORDS[1]),
        ("lagrange", (0.0, 200.0, 200.0), 0.02, WORDS[2]),
        ("free", (40.0, 200.0, 90.0), 5.0, WORDS[3]),
        ("spherical", (0.0, 200.0, 200.0), 0.02, WORDS[3]),
    ],
)
def test_paths_agree_with_scipy(name, damping, friction, words):
    scene = make_scene(name, damping=damping, friction=friction, **words)
    q, m, _ = integrate_with_stops(scene, 0.4)
    path = kr.solve(scene, [0.4])
    assert kr.attitude_error(path.q[0], q) < 1e-9
    assert np.abs(path.m[0] - m).max() < 1e-8


@pytest.mark.parametrize("friction", [0.05, 0.2, 2.0])
def test_the_limit_without_inertia(friction):
    scene = make_scene(damping=(1e6, 3e6, 2e5), friction=friction)
    path = kr.solve(scene.replace(body_velocity=(0, 0, 0)), [5e5], max_steps=150)
    assert kr.attitude_error(path.q[0], follow_torque(scene, 5e5)) < 1e-10


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("damping", [(2e3, 1e4, 300.0), (0.0, 1e4, 1e4), (1e4, 0.0, 0.0)])
def test_short_steps_give_the_same_path(name, damping):
    # A path with tangents does not use the slow manifold.
    for friction, words, digits in ((0.3, {}, 16), (0.02, WORDS[3], 30), (0.1, WORDS[3], 20)):
        scene = make_scene(name, damping=damping, friction=friction, **words)
        path = kr.solve(scene, [0.1], "taylor", digits=digits)
        short = kr.solve(scene, [0.1], "taylor", digits=digits, tangents="damping")
        difference = path.q - short.q
        if digits > 16:
            difference += path.q_low - short.q_low
        assert np.abs(difference).max() < {16: 2e-15, 20: 1e-19, 30: 1e-28}[digits]


def test_a_stop_at_which_the_spin_changes_slowly():
    # The spin reaches zero with a slope far below that of the friction.
    body = kr.Body(1, (0.43, 0.43, 0.24), (0, 0, 0.5), unphysical=True, rotor=(0.1, -0.9, 0.2))
    scene = kr.Scene(body, **START, damping=(22.0, 10.0, 7900.0), friction=1.4e-3)
    stop = kr.solve(scene, 0.3, events=[kr.events.stopped()]).events.t[-1]
    path = kr.solve(scene, [stop + 0.01], "taylor", digits=30)
    short = kr.solve(scene, [stop + 0.01], "taylor", digits=30, tangents="damping")
    difference = (path.q - short.q) + (path.q_low - short.q_low)
    assert np.abs(difference).max() < 1e-28


@pytest.mark.parametrize("damping", [1e6, 1e10, (1e6, 1e6, 0.0), (1e4, 1e9, 3e5)])
def test_few_steps_suffice(damping):
    for words in WORDS:
        for friction in (1e-6, 0.1, 100.0):
            scene = make_scene(damping=damping, friction=friction, **words)
            path = kr.solve(scene, [1.0], max_steps=150)
            deep = kr.solve(scene, [1.0], digits=30, max_steps=300)
            assert kr.attitude_error(path.q[0], deep.q[0]) < 2e-15


def test_a_slow_spin_is_kept_beside_strong_damping():
    body = kr.Body(1, (1, 1, 1.7), (0, 0, 1), unphysical=True)
    losses = {"gravity": 1, "damping": (1e10, 1e10, 0), "friction": 1e-6}
    top = kr.Scene(body, body_velocity=(0, 0, 1e-4), attitude=(0.8, 0.6, 0, 0), **losses)
    stop = 1.7 * 1e-4 / 1e-6
    path = kr.solve(top, [0.5 * stop, 2 * stop], max_steps=200)
    assert path.spin == pytest.approx([0.5e-4, 0.0], abs=1e-17)
    found = kr.solve(top, 2 * stop, events=[kr.events.stopped()], max_steps=200).events
    assert found.t == pytest.approx([stop], rel=1e-12)


def test_stops_and_slips_are_found_on_the_slow_manifold():
    found = kr.solve(SLIPS, 6.0, events=[kr.events.stopped()], max_steps=1500).events
    assert len(found) > 2
    assert np.abs(kr.solve(SLIPS, found.t).spin).max() < 1e-15
    deep = kr.solve(SLIPS, 6.0, digits=30, events=[kr.events.stopped()]).events
    assert found.t == pytest.approx(deep.t, abs=1e-9)
    spins = kr.solve(SLIPS, np.linspace(0.1, 6.0, 200)).spin
    assert spins.min() < -1e-7 and spins.max() > 1e-7 and np.any(np.abs(spins) < 1e-15)


def test_permuted_axes_give_the_same_path():
    cycle = np.array((0.5, 0.5, 0.5, 0.5))  # takes x to y, y to z and z to x
    body = kr.Body(1, np.roll(MOMENTS, 1), np.roll(COM, 1), unphysical=True)
    attitude = kr.quaternion.multiply(START["attitude"], kr.quaternion.conjugate(cycle))
    other = SLIPS.replace(body=body, attitude=attitude, damping=np.roll(SLIPS.damping, 1))
    other = other.replace(momentum=START["momentum"])
    times = np.linspace(0, 6, 7)
    one, same = kr.solve(SLIPS, times), kr.solve(other, times)
    assert np.abs(one.apex - same.apex).max() < 1e-13
    assert np.abs(one.m - same.m).max() < 1e-13


@pytest.mark.parametrize("damping", [1e5, (0, 1e5, 1e5), SLIPS.damping])
def test_runs_streams_and_ensembles_agree(damping):
    scene = SLIPS.replace(damping=damping)
    check_resumed(scene, [{}, {"digits": 20}])
    check_members(scene.vary(friction=[1e-3, 0.3, 7.0]), [0.0, 2.0])
    half = kr.solve(scene, [1.0])
    whole = kr.solve(scene, [2.0])
    assert kr.attitude_error(kr.solve(half.end, [1.0]).q[0], whole.q[0]) < 1e-14


def test_backward_in_time_a_held_top_is_refused():
    end = kr.solve(make_scene(damping=1e4, friction=0.1), [1.0]).end
    with pytest.raises((kr.Error, ValueError), match="stopped"):
        kr.solve(end, [-1e-3])


def test_the_error_of_the_path_is_estimated():
    scene = make_scene(damping=1e4, friction=0.1, turning=TURNING)
    path, deep = (kr.solve(scene, [1.0], "taylor", digits=digits) for digits in (16, 30))
    assert kr.attitude_error(path.q[0], deep.q[0]) <= 4 * path.error < 1e-14


@pytest.mark.parametrize("digits", [20, 30])
def test_slips_at_times_that_do_not_resolve_the_transient(digits):
    """Check transients that are shorter than the distance between doubles near their time."""
    scene = SLIPS.replace(damping=(1e10, 2e9, 3e10), shaking=(4e18, 1e-9, 0.2))
    scene, times = scene.replace(body_velocity=(0, 0, 0)), [1e9, 4e9, 2e10, 6e10]
    path = kr.solve(scene, times, digits=digits, max_steps=600, events=[kr.events.stopped()])
    assert len(path.events) > 4
    plain = kr.solve(scene, times, max_steps=300)
    assert kr.attitude_error(path.q, plain.q).max() < 1e-12
    assert np.abs(path.m - plain.m).max() < 1e-12 * np.abs(plain.m).max()
