"""Tests of kreisel.exact for Lagrange tops, free bodies and the Bobenko-Suris map."""

import copy
import math
import pickle
from dataclasses import replace

import kreisel as kr
import mpmath as mp
import numpy as np
import pytest
from ensembles import same_bits
from tops import TILT, unit

TOP, FREE, THESIS = kr.scenes.asymmetric, kr.scenes.dzhanibekov, kr.scenes.thesis
TILTED = THESIS.replace(attitude=TILT, momentum=(1, 2, 30))
TENSOR = kr.Body(2.0, [[2, 0, 0.5], [0, 2.5, 0], [0.5, 0, 2]], (1, 0, -1), unphysical=True)
SPHERE = kr.Body(1.0, (2, 2, 2), (0.3, -0.4, 1.2), unphysical=True)
PLATE = kr.Body(1.0, (1.0, 2.0, 3.0), (0.1, 0.2, 0.3), unphysical=True)
SCENES = {
    "thesis": THESIS,
    "tilted": TILTED,
    "hanging": TILTED.replace(gravity=-3.0),
    "turned": kr.Scene(TENSOR, (1, 2, 3), TILT, gravity=1),
    "spherical": kr.Scene(SPHERE, (1, 2, 3), TILT, gravity=1),
    "free": kr.Scene(PLATE, (1.0, 2.0, 3.0), TILT, gravity=0.0),
    "balanced": kr.Scene(kr.Body(1.0, (1, 2, 2.5), (0, 0, 0)), (1.0, 2.0, 3.0), TILT),
}
RATES = "period", "precession_rate", "spin_angle_rate"


def make_map(scene, step=0.1):
    return kr.exact(scene, map="bobenko_suris", step=step)


@pytest.mark.parametrize("name", SCENES)
def test_closed_forms_are_right_for_one_top_and_for_many(name):
    scene, t = SCENES[name], [2.0, -3.0, 0.0, 300.0]
    path = kr.exact(scene)(t)
    assert path.method == "exact" and path.step is None and list(path.t) == t
    assert kr.attitude_error(path.q[2], scene.attitude) < 1e-15
    for i in (0, 1, 3):
        truth = kr.solve(scene, [t[i]], digits=30)
        assert kr.attitude_error(path.q[i], truth.q[0]) < 1e-14 * (1 + abs(t[i]))
        assert np.abs(path.m[i] - truth.m[0]).max() < 3e-14 * np.abs(truth.m).max() * (
            1 + abs(t[i])
        )
    many = kr.exact([TILTED, scene])
    assert same_bits(many(t)[1].states, path.states) and many(2.0)[1].nutation == path.nutation[0]
    assert [getattr(many, r)[1] for r in RATES] == [getattr(kr.exact(scene), r) for r in RATES]


@pytest.mark.parametrize("name", SCENES)
def test_auto_chooses_the_closed_form_and_states_its_error(name):
    scene, t = SCENES[name], [1.0, 1e3]
    path = kr.solve(scene, t)
    assert (path.method, path.step, path.tol) == ("exact", None, None)
    assert kr.attitude_error(path.q, kr.exact(scene)(t).q).max() < 2e-15
    error = kr.attitude_error(path.q[-1], kr.solve(scene, t, digits=30).q[-1])
    assert error <= 2 * path.error + 1e-15 and 0 < path.error < 1e-9


def test_a_single_time_gives_one_state_with_the_same_bits():
    top, times = kr.exact(TILTED), np.linspace(-50.0, 1e5, 200)
    many = top(times)
    for t in (np.linspace(-50.0, 1e5, 598)[::3], times.tolist()):
        assert same_bits(top(t).states, np.vstack([top(float(x)).states for x in t]))
    assert same_bits(top(times[3]).states[0], many.states[3]) and len(top([])) == 0
    for other in (copy.deepcopy(top), pickle.loads(pickle.dumps(top))):
        assert other == top and same_bits(other(times).states, many.states)


BODIES_WITH_APEX = {
    "third axis": kr.Body(1.2, (1.3, 1.3, 0.7), (0, 0, 0.4), unphysical=True),
    "first axis": kr.Body(1.2, (0.7, 1.3, 1.3), (0.4, 0, 0), unphysical=True),
    "second axis": kr.Body(1.2, (1.3, 0.7, 1.3), (0, 0.4, 0), unphysical=True),
    "rotor": kr.Body(1.2, (1.3, 1.3, 0.7), (0, 0, 0.4), unphysical=True, rotor=(0, 0, 0.6)),
    "tensor": TENSOR,
    "spherical": kr.Body(1.2, (1.1, 1.1, 1.1), (0.3, 0.2, -0.1), unphysical=True),
    "spherical, one axis": kr.Body(1.2, (1.1, 1.1, 1.1), (0, 0, 0.4), unphysical=True),
}


@pytest.mark.parametrize("gravity", [1.3, -1.3])
@pytest.mark.parametrize("name", BODIES_WITH_APEX)
def test_rates_are_the_mean_rates_of_the_angles(name, gravity):
    for side in (1, -1):
        body = BODIES_WITH_APEX[name]
        body = replace(body, com=tuple(side * x for x in body.com))
        scene = kr.Scene(body, body_velocity=(0.9, 0.4, -1.5), attitude=TILT, gravity=gravity)
        top = kr.exact(scene)
        t = np.linspace(0.0, 20.0 * top.period, 8001)
        path = top(t)
        turned, spun = (
            (angle[-1] - angle[0]) / t[-1]
            for angle in (np.unwrap(path.precession_angle), np.unwrap(path.spin_angle))
        )
        assert abs(path.apex[-1, 2] - path.apex[0, 2]) < 1e-12
        assert top.precession_rate == pytest.approx(turned, rel=1e-12)
        assert top.spin_angle_rate == pytest.approx(spun, rel=1e-12)
        many = kr.exact([scene])
        assert many.t_least[0] == top.t_least and many.motion_type[0] == top.motion_type
        least, greatest = top.least_nutation, top.greatest_nutation
        assert least - 1e-12 < path.nutation.min() < path.nutation.max() < greatest + 1e-12
        for t, nutation in ((top.t_least, least), (top.t_greatest, greatest)):
            assert top(t).nutation[0] == pytest.approx(nutation, abs=1e-12)
        if not any(body.rotor):
            assert make_map(scene, 1e-4).spin_angle_rate == pytest.approx(spun, rel=1e-3)


def test_the_angular_velocity_about_the_axis_is_the_only_rate_named_spin():
    scene = kr.Scene.spinning(BODIES_WITH_APEX["third axis"], 9.0, 1.0, steady=True, gravity=1.0)
    top, path = kr.exact(scene), kr.solve(scene, np.linspace(0.0, 9.0, 64))
    assert path.spin[-1] == pytest.approx(9.0)
    for found in (top, kr.exact([scene]), make_map(scene, 1e-4), kr.frequencies(path)):
        assert not hasattr(found, "spin") and not hasattr(found, "precession")
        spin = found.spin_angle_rate + found.precession_rate * np.cos(1.0)
        assert spin == pytest.approx(9.0, rel=1e-6)


def test_a_sleeping_top_has_no_period_and_a_free_body_returns_after_two():
    top = kr.exact(THESIS.replace(momentum=(0, 0, 5)))
    assert top.period == math.inf and top.precession_rate == 0
    assert top.spin_angle_rate == pytest.approx(5 / THESIS.body.moments[2], rel=1e-15)
    form = kr.exact(FREE)
    first, half, whole = form(0.3 + form.period * np.arange(3)).body_velocity
    assert whole == pytest.approx(first, abs=1e-12) and np.abs(half - first).max() > 0.1
    assert np.abs(half) == pytest.approx(np.abs(first), abs=1e-12)


# The closed form of the map


@pytest.mark.parametrize("step", [0.1, -0.1])
@pytest.mark.parametrize("name", ["thesis", "tilted", "hanging", "turned", "spherical"])
def test_the_closed_form_of_the_map_gives_its_steps(name, step):
    scene = SCENES[name]
    closed = make_map(scene, step)
    steps = kr.solve(scene, 50 * step, method="bobenko_suris", step=abs(step), every=1)
    path = closed(np.arange(51))
    assert (path.method, path.step, path.scene) == ("bobenko_suris", step, scene)
    assert np.abs(path.t - steps.t).max() < 1e-13 and np.abs(path.m - steps.m).max() < 1e-10
    assert kr.attitude_error(path.q, steps.q).max() < 1e-11
    assert same_bits(closed(7).states[0], path.states[7])
    assert len(closed([0, 2**53 - 1])) == 2 and len(closed([])) == 0 and len(closed(-3)) == 1


def test_rates_of_the_map_converge_to_those_of_the_top():
    top, coarse, fine = kr.exact(TILTED), make_map(TILTED, 0.04), make_map(TILTED, 0.01)
    for name in RATES:
        errors = [abs(getattr(closed, name) - getattr(top, name)) for closed in (fine, coarse)]
        assert 0 < errors[0] < errors[1] / 4 < 2e-3


PENDULUM = kr.Body(1.0, (1.0, 1.0, 0.5), (0.0, 0.0, 1.0), unphysical=True)


@pytest.mark.parametrize("step", [0.01, -0.1, 0.5, 1.5, 3.0, 3.2])
def test_the_map_swings_in_a_plane_that_stands_still(step):
    """Check tops that are let go from rest after up to 1e15 steps: axis and body do not turn."""
    for attitude in np.random.default_rng(5).normal(size=(6, 4)):
        scene = kr.Scene(PENDULUM, (0.0, 0.0, 0.0), unit(attitude), gravity=1.0)
        closed = make_map(scene, step)
        half_turns = np.array((closed.precession_rate, closed.spin_angle_rate)) * step / np.pi
        assert np.abs(half_turns - np.rint(half_turns)).max() < 1e-12
        assert abs(step) > 1.0 or not half_turns.any()
        apex = kr.solve(scene, [0.0]).apex[0]
        x, y = np.array((-apex[1], apex[0])) / np.hypot(*apex[:2])
        start = kr.quaternion.conjugate(tuple(np.outer(scene.attitude, np.ones(20))))
        for k in 10 ** np.arange(3, 16, 3):
            q = closed(np.arange(k, k + 20)).q
            turn = kr.quaternion.multiply(tuple(q.T), start)
            assert np.abs((turn[1] * y - turn[2] * x, turn[3])).max() < 1e-14


@pytest.mark.parametrize("speed", [0.7, 2.0, 3.0])
def test_a_swing_through_both_poles_has_the_rates_of_the_motion(speed):
    scene = kr.Scene(PENDULUM, (0.0, speed, 0.0), unit((1.0, 0.0, 1.0, 0.0)), gravity=1.0)
    for closed in (make_map(scene, 0.05), kr.exact(scene)):
        assert (closed.precession_rate, closed.spin_angle_rate) == (0.0, 0.0)


def iterate_map(scene, step, steps):
    """Return the heights of the apex after each step of the Bobenko-Suris map, in 60 digits."""
    with mp.workdps(60):
        q, m = [mp.mpf(x) for x in scene.attitude], [mp.mpf(x) for x in scene.momentum]
        q, h, heights = [x / mp.norm(q) for x in q], mp.mpf(step), []
        for _ in range(steps):
            w, x, y, z = q
            heights.append(float(w * w + z * z - x * x - y * y))
            m[0] -= 2 * h * (y * z - w * x)
            m[1] += 2 * h * (x * z + w * y)
            turn = [mp.mpf(1), *(h * v / 2 for v in m)]
            q = kr.quaternion.multiply(tuple(turn), tuple(q))
            q = [v / mp.norm(q) for v in q]
    return np.array(heights)


@pytest.mark.parametrize("lean", [1e-3, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12])
def test_the_map_near_the_upright_separatrix_is_right_or_refused(lean):
    attitude = unit((1.0, 0.3 * lean, -0.4 * lean, 0.0))
    scene = kr.Scene(PENDULUM, (0.7 * lean, 0.2 * lean, 0.6), attitude, gravity=1.0)
    try:
        closed = make_map(scene)
    except ValueError as error:
        assert lean < 1e-8 and "separatrix" in str(error)
        return
    heights = iterate_map(scene, 0.1, 400)
    assert np.abs(closed(np.arange(400)).apex[:, 2] - heights).max() < 1e-12
