"""Tests of kreisel.exact for Lagrange tops and free bodies."""

import copy
import math
import pickle
from dataclasses import replace

import kreisel as kr
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


def test_the_angular_velocity_about_the_axis_is_the_only_rate_named_spin():
    scene = kr.Scene.spinning(BODIES_WITH_APEX["third axis"], 9.0, 1.0, steady=True, gravity=1.0)
    top, path = kr.exact(scene), kr.solve(scene, np.linspace(0.0, 9.0, 64))
    assert path.spin[-1] == pytest.approx(9.0)
    for found in (top, kr.exact([scene]), kr.frequencies(path)):
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


PENDULUM = kr.Body(1.0, (1.0, 1.0, 0.5), (0.0, 0.0, 1.0), unphysical=True)


@pytest.mark.parametrize("speed", [0.7, 2.0, 3.0])
def test_a_swing_through_both_poles_has_the_rates_of_the_motion(speed):
    scene = kr.Scene(PENDULUM, (0.0, speed, 0.0), unit((1.0, 0.0, 1.0, 0.0)), gravity=1.0)
    closed = kr.exact(scene)
    assert (closed.precession_rate, closed.spin_angle_rate) == (0.0, 0.0)
