"""Tests of kreisel.exact, and of the use of closed forms by method="auto"."""

import copy
import math
import pickle
from dataclasses import replace

import kreisel as kr
import mpmath as mp
import numpy as np
import pytest
from ensembles import same_bits
from tops import unit

TOP, FREE, THESIS = kr.scenes.asymmetric, kr.scenes.dzhanibekov, kr.scenes.thesis
MANY = THESIS.vary(spin=[1.0, 2.0, 3.0], tilt=[[0.2], [0.4]])

TILT = np.array([0.8, 0.4, -0.2, 0.4])
TILTED = THESIS.replace(attitude=TILT / np.linalg.norm(TILT), momentum=(1, 2, 30))
PLATE = kr.Body(mass=1.0, inertia=(1.0, 2.0, 3.0), com=(0.1, 0.2, 0.3), unphysical=True)
SCENES = {
    "thesis": THESIS,
    "tilted": TILTED,
    "hanging": TILTED.replace(gravity=-3.0),
    "turned": kr.Scene(
        kr.Body(2.0, [[2, 0, 0.5], [0, 2.5, 0], [0.5, 0, 2]], (1, 0, -1), unphysical=True),
        (1, 2, 3),
        TILTED.attitude,
        gravity=1,
    ),
    "spherical": kr.Scene(
        kr.Body(1.0, (2, 2, 2), (0.3, -0.4, 1.2), unphysical=True),
        (1, 2, 3),
        TILTED.attitude,
        gravity=1,
    ),
    "free": kr.Scene(PLATE, (1.0, 2.0, 3.0), TILTED.attitude, gravity=0.0),
    "at its centre of mass": kr.Scene(
        kr.Body(1.0, (1, 2, 2.5), (0, 0, 0)), (1.0, 2.0, 3.0), TILTED.attitude
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_closed_forms_agree_with_integration(name):
    scene = SCENES[name]
    path = kr.exact(scene)([2.0, -3.0, 0.0])
    assert path.method == "exact" and path.step is None and list(path.t) == [2.0, -3.0, 0.0]
    assert kr.attitude_error(path.q[2], scene.attitude) < 1e-15
    for i, t in enumerate((2.0, -3.0)):
        truth = kr.solve(scene, t, method="extrap", tol=1e-13)
        assert kr.attitude_error(path.q[i], truth.q[-1]) < 1e-10
        assert np.abs(path.m[i] - truth.m[-1]).max() < 1e-9
    assert np.abs(path.energy - path.energy[2]).max() < 1e-13 * np.abs(path.energy).max()


@pytest.mark.parametrize("name", SCENES)
def test_auto_chooses_the_closed_form(name):
    path = kr.solve(SCENES[name], [1.0, 1e6])
    assert (path.method, path.step, path.tol) == ("exact", None, None)
    assert np.array_equal(path.t, [1.0, 1e6])
    assert kr.attitude_error(path.q, kr.exact(SCENES[name])([1.0, 1e6]).q).max() < 2e-15


def test_a_single_time_gives_one_state_with_the_same_bits():
    top = kr.exact(TILTED)
    many = top(np.linspace(-50.0, 1e5, 200))
    for t in (
        np.linspace(-50.0, 1e5, 600)[::3],
        np.linspace(-50, 1e5, 200).tolist(),
        np.array([7], dtype=int),
    ):
        assert np.array_equal(top(t).t, t)
        assert same_bits(top(t).states, np.vstack([top(float(x)).states for x in t]))
    for i in (0, 3, 199):
        assert same_bits(top(many.t[i]).states[0], many.states[i])
    assert len(top([])) == 0


@pytest.mark.parametrize("name", ["tilted", "hanging"])
def test_rates_agree_with_the_motion_of_the_axis(name):
    """Check the height and the azimuth of the apex after one nutation period."""
    scene = SCENES[name]
    top = kr.exact(scene)
    axis = top(np.linspace(0.0, top.period, 2001)).apex
    azimuth = np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))
    assert abs(axis[-1, 2] - axis[0, 2]) < 1e-13
    assert azimuth[-1] - azimuth[0] == pytest.approx(top.precession_rate * top.period, rel=1e-12)


SPHERE = (1.1, 1.1, 1.1)
BODIES_WITH_APEX = {
    "third axis": kr.Body(1.2, (1.3, 1.3, 0.7), (0, 0, 0.4), unphysical=True),
    "first axis": kr.Body(1.2, (0.7, 1.3, 1.3), (0.4, 0, 0), unphysical=True),
    "second axis": kr.Body(1.2, (1.3, 0.7, 1.3), (0, 0.4, 0), unphysical=True),
    "rotor": kr.Body(1.2, (1.3, 1.3, 0.7), (0, 0, 0.4), unphysical=True, rotor=(0, 0, 0.6)),
    "tensor": SCENES["turned"].body,
    "spherical": kr.Body(1.2, SPHERE, (0.3, 0.2, -0.1), unphysical=True),
    "spherical, one axis": kr.Body(1.2, SPHERE, (0, 0, 0.4), unphysical=True),
}


def test_the_angular_velocity_about_the_axis_is_the_only_rate_named_spin():
    scene = kr.Scene.spinning(BODIES_WITH_APEX["third axis"], 9.0, 1.0, steady=True, gravity=1.0)
    top, path = kr.exact(scene), kr.solve(scene, np.linspace(0.0, 9.0, 64))
    rates = top, kr.exact([scene]), kr.exact(scene, map="bobenko_suris", step=1e-4)
    for found in (*rates, kr.frequencies(path)):
        assert not hasattr(found, "spin") and not hasattr(found, "precession")
        spin = found.spin_angle_rate + found.precession_rate * np.cos(1.0)
        assert spin == pytest.approx(path.spin[-1], rel=1e-6) and path.spin[-1] == pytest.approx(
            9.0
        )


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("gravity", [1.3, -1.3])
@pytest.mark.parametrize("name", BODIES_WITH_APEX)
def test_spin_angle_rate_is_the_mean_rate_of_the_spin_angle(name, gravity, side):
    body = BODIES_WITH_APEX[name]
    body = replace(body, com=tuple(side * x for x in body.com))
    scene = kr.Scene(
        body, body_velocity=(0.9, 0.4, -1.5), attitude=TILTED.attitude, gravity=gravity
    )
    top = kr.exact(scene)
    t = np.linspace(0.0, 20.0 * top.period, 40001)
    spun, turned = (
        (np.unwrap(angles)[-1] - angles[0]) / t[-1]
        for angles in (top(t).spin_angle, top(t).precession_angle)
    )
    assert (top.spin_angle_rate, top.precession_rate) == (
        pytest.approx(spun),
        pytest.approx(turned),
    )
    assert kr.exact([scene, scene]).spin_angle_rate[1] == top.spin_angle_rate
    back = np.linspace(0.0, -40.0 * top.period, 8001)
    for times, method in ((back, "taylor"), (back, "exact"), (-back, "taylor")):
        assert kr.frequencies(kr.solve(scene, times, method)).spin_angle_rate == pytest.approx(spun)
    turntable = kr.solve(scene.replace(turning=(0, 0, 0.3)), -back, "taylor")
    assert kr.frequencies(turntable).spin_angle_rate == pytest.approx(spun)
    if not any(body.rotor):
        map_spin = kr.exact(scene, map="bobenko_suris", step=1e-4).spin_angle_rate
        assert map_spin == pytest.approx(spun, rel=1e-3)


def test_closed_forms_take_no_steps():
    for exact in kr.exact(THESIS), kr.exact(THESIS, map="bobenko_suris", step=0.1):
        assert exact([3, 5]).stats == (0, 0, 0, 0)


def test_a_path_of_a_closed_form_has_its_method_and_step():
    closed, of_map = kr.exact(TILTED), kr.exact(TILTED, map="bobenko_suris", step=-0.1)
    for path, method, step in ((closed(2.0), "exact", None), (of_map([1]), "bobenko_suris", -0.1)):
        assert (path.method, path.step, path.tol, path.digits) == (method, step, None, None)
        assert path.scene is TILTED and not path.states.flags.writeable
        assert path.plan.method == method and path.energy_error < 1e-2


def test_several_scenes_equal_single_scenes():
    scenes = list(SCENES.values())
    many, alone = kr.exact(scenes), [kr.exact(scene) for scene in scenes]
    times = [0.0, -7.5, 1e5]
    assert len(many) == len(scenes) and many.scenes == tuple(scenes)
    for name in ("period", "precession_rate", "spin_angle_rate"):
        assert np.array_equal(getattr(many, name), [getattr(top, name) for top in alone])
    assert np.array_equal(many(times), [top(times).states for top in alone])
    assert np.array_equal(many(3.0), [top(3.0).states[0] for top in alone])
    assert many([]).shape == (len(scenes), 0, 8)


def test_rates_of_the_map_converge_to_those_of_the_top():
    top, coarse, fine = (
        kr.exact(TILTED),
        *(kr.exact(TILTED, map="bobenko_suris", step=h) for h in (0.04, 0.01)),
    )
    for name in ("period", "precession_rate", "spin_angle_rate"):
        coarse_error, fine_error = (
            abs(getattr(map, name) - getattr(top, name)) for map in (coarse, fine)
        )
        assert 0 < fine_error < coarse_error / 4 < 2e-3


def test_a_sleeping_top_has_no_period():
    top = kr.exact(THESIS.replace(momentum=(0, 0, 5)))
    assert top.period == math.inf and top.precession_rate == 0
    assert top.spin_angle_rate == pytest.approx(5 / THESIS.body.moments[2], rel=1e-15)


@pytest.mark.parametrize("step", [0.1, -0.1])
@pytest.mark.parametrize("name", ["thesis", "tilted", "hanging", "turned", "spherical"])
def test_the_closed_form_of_the_map_gives_its_steps(name, step):
    scene = SCENES[name]
    closed = kr.exact(scene, map="bobenko_suris", step=step)
    steps = kr.solve(scene, 50 * step, method="bobenko_suris", step=abs(step), every=1)
    path = closed(np.arange(51))
    assert (path.method, path.step) == ("bobenko_suris", step)
    assert np.abs(path.t - steps.t).max() < 1e-13
    assert kr.attitude_error(path.q, steps.q).max() < 1e-11
    assert np.abs(path.m - steps.m).max() < 1e-10
    assert np.array_equal(closed(7).states[0], path.states[7])


PENDULUM = kr.Body(1.0, (1.0, 1.0, 0.5), (0.0, 0.0, 1.0), unphysical=True)


@pytest.mark.parametrize("step", [0.01, 0.1, -0.1, 0.5, 1.5, 3.0, 3.2])
def test_the_map_swings_in_a_plane_that_stands_still(step):
    """Check tops that are let go from rest after up to 1e15 steps: axis and body do not turn."""
    random = np.random.default_rng(5)
    for attitude in random.normal(size=(8, 4)):
        scene = kr.Scene(PENDULUM, (0.0, 0.0, 0.0), unit(attitude), gravity=1.0)
        closed = kr.exact(scene, map="bobenko_suris", step=step)
        half_turns = np.array((closed.precession_rate, closed.spin_angle_rate)) * step / np.pi
        assert np.abs(half_turns - np.rint(half_turns)).max() < 1e-12
        assert abs(step) > 1.0 or not half_turns.any()
        apex = kr.solve(scene, [0.0]).apex[0]
        x, y = np.array((-apex[1], apex[0])) / np.hypot(*apex[:2])
        for k in 10 ** np.arange(2, 16):
            q = closed(np.arange(k, k + 20)).q
            turn = kr.quaternion.multiply(
                tuple(q.T), kr.quaternion.conjugate(tuple(np.outer(scene.attitude, np.ones(20))))
            )
            assert np.abs((turn[1] * y - turn[2] * x, turn[3])).max() < 1e-14


@pytest.mark.parametrize("speed", [0.7, 2.0, 3.0])
def test_a_swing_through_both_poles_has_the_rates_of_the_motion(speed):
    scene = kr.Scene(PENDULUM, (0.0, speed, 0.0), unit((1.0, 0.0, 1.0, 0.0)), gravity=1.0)
    closed, top = kr.exact(scene, map="bobenko_suris", step=0.05), kr.exact(scene)
    assert (closed.precession_rate, closed.spin_angle_rate) == (0.0, 0.0)
    assert (top.precession_rate, top.spin_angle_rate) == (0.0, 0.0)


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


@pytest.mark.parametrize("lean", [1e-7, 1e-8, 1e-9, 1e-10, 1e-12])
def test_the_map_near_the_upright_separatrix_is_right_or_refused(lean):
    attitude = unit((1.0, 0.3 * lean, -0.4 * lean, 0.0))
    scene = kr.Scene(PENDULUM, (0.7 * lean, 0.2 * lean, 0.6), attitude, gravity=1.0)
    try:
        closed = kr.exact(scene, map="bobenko_suris", step=0.1)
    except ValueError as error:
        assert lean < 1e-8 and "separatrix" in str(error)
        return
    heights = iterate_map(scene, 0.1, 600)
    assert np.abs(closed(np.arange(600)).apex[:, 2] - heights).max() < 1e-12


def test_scenes_without_a_closed_form_are_refused():
    with pytest.raises(
        ValueError,
        match="no closed form is known for this body of kind 'general' under gravity",
    ):
        kr.exact(kr.scenes.asymmetric)
    with pytest.raises(
        ValueError,
        match=r"'exact' does not apply to this body of kind 'general'.*torque; these",
    ):
        kr.solve(kr.scenes.asymmetric, 1, method="exact")
    assert kr.exact(kr.scenes.asymmetric.replace(gravity=0.0))(1e6).q.shape == (1, 4)
    with pytest.raises(
        ValueError, match=r"no known closed form for the step 0.1 .* of a separatrix"
    ):
        kr.exact(
            THESIS.replace(attitude=(1, 1e-14, 0, 0), momentum=(0, 0, 0)),
            map="bobenko_suris",
            step=0.1,
        )
    with pytest.raises(ValueError, match="'bobenko_suris' does not apply"):
        kr.exact(SCENES["free"], map="bobenko_suris", step=0.1)


def test_refusals_describe_tops_with_a_closed_form_only_if_the_body_has_none():
    tops_of_closed_forms = "closed forms are known for bodies with two equal moments"
    with pytest.raises(ValueError, match=tops_of_closed_forms):
        kr.exact(kr.scenes.asymmetric)
    with pytest.raises(ValueError, match=tops_of_closed_forms):
        kr.exact(kr.scenes.asymmetric.replace(turning=(0, 0, 1)))
    with pytest.raises(ValueError, match=tops_of_closed_forms):
        kr.exact([kr.scenes.asymmetric.replace(turning=(0, 0, 1))])
    asymmetric, turning = kr.scenes.asymmetric, THESIS.replace(turning=(0, 1, 0))
    rotor = asymmetric.body.with_rotor(spin=1.0, inertia=0.1, axis=(1, 0, 0))
    for tops in (
        turning,
        [turning, turning],
        THESIS.vary(friction=[0.1, 0.2]),
        THESIS.replace(attitude=(1, 1e-80, 0, 0), momentum=(0, 0, 0)),
        asymmetric.replace(body=rotor),
    ):
        with pytest.raises(ValueError, match="no closed form") as error:
            kr.exact(tops)
        assert tops_of_closed_forms not in str(error.value)


@pytest.mark.parametrize(
    "call, error, match",
    [
        (lambda: kr.exact(3), TypeError, "scene must be"),
        (lambda: kr.exact(THESIS, step=0.1), ValueError, "step needs map"),
        (
            lambda: kr.exact(THESIS, map="rk4", step=0.1),
            ValueError,
            "the only map with a closed form",
        ),
        (lambda: kr.exact(THESIS, map="bobenko_suris"), TypeError, "step must be a number"),
        (
            lambda: kr.exact(THESIS, map="bobenko_suris", step=0.0),
            ValueError,
            "step must not be zero",
        ),
        (lambda: kr.exact(THESIS)(math.nan), ValueError, "t must be finite"),
        (lambda: kr.exact(THESIS)(1e300), ValueError, "cannot resolve"),
        (lambda: kr.exact(THESIS)([[1.0]]), ValueError, "shape"),
        (lambda: kr.exact(THESIS)(np.ones((2, 2))), ValueError, "shape"),
        (lambda: kr.exact(THESIS)("1"), TypeError, "t must be a number or a list of times"),
        (lambda: kr.exact([]), ValueError, "must not be empty"),
        (lambda: kr.exact([THESIS, 3]), TypeError, r"scene\[1\] must be a kreisel.Scene, not 3"),
        (
            lambda: kr.exact([THESIS, kr.scenes.asymmetric]),
            ValueError,
            r"scene\[1\]: no closed form is known for this body",
        ),
        (lambda: kr.exact([THESIS], step=0.1), TypeError, "scene must be a kreisel.Scene"),
        (lambda: kr.exact([THESIS])([math.inf]), ValueError, "t must be finite"),
        (lambda: kr.exact([THESIS])([1e300]), ValueError, "cannot resolve"),
        (
            lambda: kr.exact(THESIS, map="bobenko_suris", step=0.1)(0.5),
            ValueError,
            "k must be whole",
        ),
        (lambda: kr.exact(THESIS, map="bobenko_suris", step=0.1)(2**60), ValueError, "below 2"),
        (lambda: kr.solve(THESIS, 1, method="exact", every=2), ValueError, "exact has none"),
    ],
)
def test_invalid_arguments_are_refused(call, error, match):
    with pytest.raises(error, match=match):
        call()


def test_unresolvable_times_are_refused_for_one_and_many_tops():
    """Check that t = 2^54 is refused, because a double cannot resolve the heading at this time."""
    slow = kr.Scene(kr.Body(1.0, (1.0, 1.0, 0.5), (0.0, 0.0, 0.0)), momentum=(0.0, 0.0, 0.25))
    for top in kr.exact(slow), kr.exact([slow]):
        top(math.nextafter(2.0**54, 0.0))
        with pytest.raises(ValueError, match="cannot resolve"):
            top(2.0**54)


def test_the_rotation_of_a_slender_body_limits_the_times_of_all_calls():
    """Check a slender body, whose spin is about a million times the rate of its precession."""
    body = kr.Body(1.0, (1.0, 1.0, 1e-6), (0.0, 0.0, 0.0))
    slender = kr.Scene(body, momentum=(1e-3, 0.0, 1.0), gravity=1.0)
    for t, is_resolved in ((9.0e9, True), (9.1e9, False), (1e12, False)):
        for call in (
            lambda t=t: kr.solve(slender, [t]),
            lambda t=t: kr.exact(slender)(t),
            lambda t=t: kr.exact([slender])(t),
            lambda t=t: kr.solve(slender.vary(gravity=[1.0, 2.0]), [t]).check(),
            lambda t=t: kr.solve(slender, [-t]),
        ):
            if is_resolved:
                call()
            else:
                with pytest.raises((ValueError, kr.Error), match=r"can(not)? resolve"):
                    call()


def test_copies_of_closed_forms_are_equal():
    top = kr.exact(THESIS)
    for other in (copy.deepcopy(top), pickle.loads(pickle.dumps(top))):
        assert other == top and np.array_equal(other(3.0).states, top(3.0).states)


def test_the_body_momentum_of_a_free_body_returns_after_two_periods():
    form = kr.exact(kr.scenes.dzhanibekov)
    states = form(np.array([0.3, 0.3 + form.period, 0.3 + 2.0 * form.period]))
    first, half, whole = states.body_velocity
    assert whole == pytest.approx(first, abs=1e-12)
    assert np.abs(half) == pytest.approx(np.abs(first), abs=1e-12)
    assert np.abs(half - first).max() > 0.1


# Boundary values


def test_step_numbers_of_a_map_are_limited():
    closed_form = kr.exact(THESIS, map="bobenko_suris", step=0.1)
    assert (
        len(closed_form([0, 2**53 - 1])) == 2
        and len(closed_form([])) == 0
        and len(closed_form(-3)) == 1
    )
    for wrong in (2**53, -(2**53), 0.5, [1, 2.5]):
        with pytest.raises(ValueError, match=r"k must be whole and below 2\*\*53"):
            closed_form(wrong)


def test_closed_forms_of_an_ensemble_equal_single_ones():
    ensemble = kr.exact(MANY)
    assert len(ensemble) == 2 and len(ensemble.scenes) == 6 and ensemble([]).shape == (2, 3, 0, 8)
    own = np.arange(12.0).reshape(2, 3, 2) - 5.0
    states, at_once = ensemble(own), ensemble([0.5, -0.5, 0.0])
    for i in np.ndindex(2, 3):
        one = kr.exact(MANY[i])
        assert np.array_equal(states[i], one(own[i]).states)
        assert np.array_equal(at_once[i], one([0.5, -0.5, 0.0]).states)
        assert np.array_equal(ensemble(-1.5)[i], one(-1.5).states[0])
        assert ensemble.t_least[i] == one.t_least and ensemble.motion_type[i] == one.motion_type
    assert not ensemble.motion_type.flags.writeable and not ensemble.period.flags.writeable
    assert repr(ensemble) == "<kreisel.ExactEnsemble: scenes of shape (2, 3)>"
    assert repr(kr.exact([THESIS, FREE])) == "<kreisel.ExactEnsemble: 2 scenes>"
    with pytest.raises(ValueError, match=r"^top\[0, 0\]: by t = 1e\+17 this top turns"):
        ensemble([1.0, -1e17])
    late = own.copy()
    late[1, 1, 0] = 1e17
    with pytest.raises(ValueError, match=r"^top\[1, 1\]: by t = 1e\+17"):
        ensemble(late)


def test_scenes_without_closed_form_are_counted():
    mixed = [THESIS, TOP, FREE, TOP]
    with pytest.raises(ValueError, match=r"^scene\[1\], the first of 2 such: no closed form"):
        kr.exact(mixed)
    with pytest.raises(ValueError, match=r"^scene\[1\]: no closed form"):
        kr.exact(mixed[:3])
    with pytest.raises(ValueError, match="must not be empty"):
        kr.exact([])


def test_closed_forms_of_an_ensemble_refuse_unresolvable_times():
    many = kr.exact([THESIS, THESIS])
    with pytest.raises(ValueError, match=r"^scene\[0\]: .* cannot resolve its attitude"):
        many(1e300)


def test_invalid_steps_and_step_numbers_of_maps_are_refused():
    steps = kr.exact(THESIS, map="bobenko_suris", step=0.01)
    with pytest.raises(ValueError, match="not an array of shape"):
        steps([[1, 2], [3, 4]])
    with pytest.raises(ValueError, match=r"out of range: step 1e\+200"):
        kr.exact(THESIS, map="bobenko_suris", step=1e200)
