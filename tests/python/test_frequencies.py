"""Tests of mean rates and spectral lines against closed forms, counted turns and known spectra."""

import math

import kreisel as kr
import numpy as np
import pytest
from kreisel import quaternion
from tops import FREE, LAGRANGE, TILT, unit


def analyse(scene, end=200.0, states=4001, method="taylor", **words):
    return kr.frequencies(kr.solve(scene, np.linspace(0.0, end, states), method, **words))


def list_rates(found):
    nutation = found.nutation if hasattr(found, "nutation") else math.tau / found.period
    return [found.precession_rate, found.spin_angle_rate, nutation]


def find_largest_error(found, exact):
    """Return the largest relative error of the rates."""
    pairs = zip(list_rates(found), list_rates(exact), strict=True)
    return max(abs(one / other - 1.0) if other else abs(one) for one, other in pairs)


def assert_rates_near(found, expected, tolerance, precession=0.0):
    """Assert that rates agree, after a change of the precession."""
    one, other = list_rates(found), list_rates(expected)
    other[0] += precession
    assert one == pytest.approx(other, abs=tolerance, nan_ok=True)


# Tops whose mean rates have a closed form


@pytest.mark.parametrize("name", ["cusps", "thesis", "fast", "strong_gravity", "sleeping"])
def test_frequencies_agree_with_the_closed_form(name):
    """Check a motion with cusps, curves through the pole, and a pendulum through both poles."""
    scene = kr.scenes.get_scene(name)
    exact = kr.exact(scene)
    end = 60.0 * min(exact.period, 40.0)
    found = analyse(scene, end, 4096)
    assert not found.exact and find_largest_error(found, exact) < 1e-12
    back = analyse(scene, -end, 4096)
    assert find_largest_error(back, exact) < 1e-12


def draw_top(rng, gravity):
    i1 = rng.uniform(0.5, 2)
    height = rng.choice([1, -1]) * rng.uniform(0.1, 1)
    body = kr.Body.symmetric(1, i1, rng.uniform(0.1, 2 * i1), height, unphysical=True)
    return kr.Scene(body, 2.0 * rng.normal(size=3), unit(rng.normal(size=4)), gravity=gravity)


@pytest.mark.parametrize("gravity", [1.0, -0.4, 0.0])
def test_frequencies_of_random_tops(gravity):
    rng = np.random.default_rng(3)
    for _ in range(8):
        scene = draw_top(rng, gravity)
        exact = kr.exact(scene)
        found = analyse(scene, 40.0 * min(exact.period, 40.0), 4096)
        assert find_largest_error(found, exact) < 1e-12
        # a start near a pole
        lean = 10 ** rng.uniform(-7, -0.83)
        angles = (rng.uniform(0, 6), rng.choice([lean, math.pi - lean]), rng.uniform(0, 6))
        start = kr.Scene.from_euler(scene.body, angles=angles, gravity=gravity)
        beside = start.replace(body_velocity=rng.normal(size=3) * (1, 1, 2))
        exact, found = kr.exact(beside), analyse(beside, 300.0)
        assert_rates_near(found, exact, 1e-10)


def test_a_path_whose_errors_hide_the_side_of_the_pole_has_no_mean_rates():
    scene, exact = kr.scenes.thesis, kr.exact(kr.scenes.thesis)
    end = 60 * exact.period
    accurate, rough = (
        kr.frequencies(kr.solve(scene, end, method, step=0.01, every=5))
        for method in ("strang", "rk4")
    )
    assert find_largest_error(accurate, exact) < 1e-5
    assert math.isnan(rough.precession_rate) and math.isnan(rough.spin_angle_rate)
    assert rough.nutation == pytest.approx(math.tau / exact.period, rel=1e-5)


def test_frequencies_of_free_bodies_with_and_without_a_rotor():
    body = kr.Body(1, (1, 2, 2.5), (0, 0, 0))
    for momentum in ((3, 0.5, 0.4), (0.4, 0.5, -3), (-2, 1, 1), (0.5, -1, 2)):
        scene = kr.Scene(body, momentum, unit((0.8, 0.4, -0.2, 0.4)), gravity=1)
        assert find_largest_error(analyse(scene, 200, 4096), kr.exact(scene)) < 1e-12
    # with a rotor along its symmetry axis, the body precesses at the rate |m| / I2
    for rotor, (m1, *rest) in ((1.5, (3.0, 0.5, 0.4)), (-1.5, (-2.0, 1.0, 1.0))):
        body = kr.Body(1.0, (1.0, 2.0, 2.0), (0, 0, 0), rotor=(rotor, 0.0, 0.0))
        found = analyse(kr.Scene(body, body_momentum=(m1, *rest), attitude=TILT), 200, 4096)
        size = math.hypot(m1, *rest)
        assert found.precession_rate == pytest.approx(size / 2.0, rel=1e-12)
        spin = math.copysign(1.0, m1) * (m1 - rotor - m1 / 2.0)
        assert found.spin_angle_rate == pytest.approx(spin, rel=1e-12)
    body = kr.Body(1.0, (1.0, 2.0, 2.0), (0, 0, 0), rotor=(0.5, 0.1, 0.0))
    with pytest.raises(ValueError, match="rotor"):
        analyse(kr.Scene(body, (3.0, 0.5, 0.4)), 20.0, 100)


def test_lines_sum_to_the_motion_of_the_apex():
    scene = kr.scenes.cusps
    exact, t = kr.exact(scene), np.linspace(0.0, 60.0 * kr.exact(scene).period, 4096)
    path = kr.solve(scene, t, "taylor")
    found = kr.frequencies(path)
    way = np.exp(1j * np.multiply.outer(t, found.lines)) @ found.amplitudes
    assert np.abs(way - (path.apex[:, 0] + 1j * path.apex[:, 1])).max() < 1e-11
    assert found.rest < 1e-11 and "12 lines" in repr(found)
    of_form = kr.frequencies(exact(t), 20)
    assert of_form.exact and find_largest_error(of_form, exact) == 0.0
    spaced = (of_form.lines - exact.precession_rate) / (math.tau / exact.period)
    assert np.abs(spaced - spaced.round())[:9].max() < 1e-8 and len(of_form.lines) == 20
    assert (np.diff(np.abs(of_form.amplitudes)) < 1e-12).all()


# Motions without mean rates, and at rest


def test_chaotic_paths_have_a_large_remainder():
    t = np.linspace(0, 1000, 8001)
    scene = kr.scenes.asymmetric_regular.replace(attitude=(0.8, 0.6, 0, 0))
    regular, chaotic = (
        kr.frequencies(kr.solve(top, t), 40) for top in (scene, kr.scenes.asymmetric)
    )
    assert regular.rest < 1e-4 < 0.1 < chaotic.rest
    half = kr.frequencies(kr.solve(scene, t[:4001]), 40)
    assert list_rates(half) == pytest.approx(list_rates(regular), rel=1e-9)
    # its apex passes a pole on irregularly alternating sides
    undetermined = analyse(kr.scenes.asymmetric_regular, 2000, 16001, "auto")
    assert math.isnan(undetermined.precession_rate) and math.isnan(undetermined.spin_angle_rate)
    assert undetermined.nutation > 1.0 and undetermined.rest < 1e-3


def test_steady_and_resting_axes_have_no_nutation():
    steady = analyse(kr.scenes.steady_precession, 100, 2001)
    assert steady.nutation == 0.0 and steady.precession_rate == pytest.approx(1.0, abs=1e-12)
    still = analyse(kr.Scene(LAGRANGE.body, (0, 0, 9.0), gravity=1), 9, 100)
    assert math.isnan(still.precession_rate) and math.isnan(still.spin_angle_rate)
    assert still.nutation == 0.0
    rest = analyse(FREE.replace(momentum=(0, 0, 0)), 9, 100)
    assert rest.nutation == 0.0 and rest.lines.shape == (12,)


def test_a_top_released_at_rest_has_the_frequency_of_a_slow_one():
    body = kr.Body(1.0, (1.0, 1.5, 2.0), (0.5, 0.0, 0.0))
    lying = (math.cos(0.6), 0.0, math.sin(0.6), 0.0)
    rest, slow = (
        analyse(kr.Scene(body, (0, 0, m), attitude=lying, gravity=1), 100) for m in (0.0, 1e-12)
    )
    assert rest.nutation == pytest.approx(slow.nutation, rel=1e-9) and rest.nutation > 1.0
    assert rest.precession_rate == pytest.approx(0.0, abs=1e-12)


# Supports


@pytest.mark.parametrize("end", [200.0, -200.0])
@pytest.mark.parametrize("name", ["cusps", "thesis", "kowalewski"])
def test_a_turntable_is_subtracted_from_the_precession(name, end):
    scene, rate = getattr(kr.scenes, name), 0.37
    for method in ("taylor", "exact"):
        rest, found = (
            analyse(scene.replace(turning=(0, 0, r)), end, 4001, method) for r in (0, rate)
        )
        assert found.exact == rest.exact == (method == "exact")
        assert_rates_near(found, rest, 1e-11, precession=-rate)
        assert np.abs(found.lines[:4] - (rest.lines[:4] - rate)).max() < 1e-9


@pytest.mark.parametrize(
    "words, word",
    [
        ({"turning": (0.1, 0, 0)}, "turning"),
        ({"shaking": (0.1, 3.0, 0)}, "shaken"),
        ({"friction": 0.1}, "friction"),
        ({"damping": 0.1}, "damped"),
        ({"turning": (0, 0, 0.1), "gravity": 0}, "turning"),
    ],
)
def test_tops_without_constant_rates_are_refused(words, word):
    with pytest.raises(ValueError, match=word):
        analyse(kr.scenes.cusps.replace(**words), 10, 100)


# Kowalewski and Goryachev-Chaplygin tops

KOWALEWSKI, CHAPLYGIN = 2.0, 4.0  # ratios of the moments


def make_scene(ratio, momentum, attitude, gravity=1.0, axes=(0, 1, 2), lever=1.0):
    moments = np.array((ratio, ratio, 1.0))[list(axes)]
    com = lever * np.eye(3)[0][list(axes)]
    body = kr.Body(1.0, tuple(moments), tuple(com), unphysical=True)
    return kr.Scene(body, momentum, unit(attitude), gravity=gravity)


FAR_FROM_THE_POLE = [
    make_scene(KOWALEWSKI, (2.4, 0.0, -3.3), (1.2, -1.8, -1.5, 1.4), -1.5, (2, 0, 1), -1.0),
    make_scene(KOWALEWSKI, (0.3, 3.0, 2.8), (-1.3, 0.4, -0.7, 0.2), -1.5, (0, 1, 2), -1.0),
    make_scene(KOWALEWSKI, (1.3, -1.6, 0.7), (0.1, -0.9, -2.7, -2.8), -1.5, (1, 2, 0), -1.0),
]
OVER_THE_POLE = [
    make_scene(KOWALEWSKI, (1.8, 1.9, 2.8), (0.8, -0.1, 0.9, 1.5), -1.5, (1, 2, 0), -1.0),
    make_scene(KOWALEWSKI, (1.0, 0.5, -0.7), (0.1, -0.6, 0.3, 0.7), 1.0, (0, 2, 1)),
    make_scene(CHAPLYGIN, (0.9, 2.1, 0.0), (0.8, 0.4, -0.2, 0.4)),
    make_scene(CHAPLYGIN, (2.0, 4.0, 0.0), (0.1, -0.6, 0.3, 0.7), 0.5),
]


@pytest.mark.parametrize("scene", FAR_FROM_THE_POLE)
def test_rates_of_closed_forms_agree_with_the_frequency_analysis(scene):
    rates, found = analyse(scene, 600.0, 6001, "exact"), analyse(scene, 600.0, 6001)
    assert rates.exact and not found.exact
    assert_rates_near(rates, found, 1e-9)


def test_known_rates_agree_with_the_closed_form_and_others_are_nan():
    rng, known = np.random.default_rng(1), []
    for _ in range(40):
        momentum = (2.0, 2.0, 1.0) * rng.normal(size=3) * rng.choice((0.3, 1.5, 4.0))
        scene = make_scene(KOWALEWSKI, momentum, rng.normal(size=4))
        found = analyse(scene, 300.0, 3001)
        assert math.isnan(found.precession_rate) == math.isnan(found.spin_angle_rate)
        if not math.isnan(found.precession_rate):
            assert_rates_near(found, analyse(scene, 300.0, 3001, "exact"), 0.02 / 300.0)
            known.append(scene)
    assert 3 < len(known) < 20


def count_turns(t, signal):
    return float(np.angle(signal[1:] * signal[:-1].conj()).sum()) / (t[-1] - t[0])


@pytest.mark.parametrize("scene", OVER_THE_POLE)
def test_mean_rates_agree_with_counted_turns(scene):
    """Compare with the turns that are counted over a long time, right up to a few turns."""
    t = np.linspace(0.0, 8000.0, 320001)
    path, found = kr.exact(scene)(t), analyse(scene, 20.0, 101, "exact")
    axis = np.array(scene.body.com)
    first = np.roll(axis, 1)
    q = tuple(path.q.T)
    apex, one, two = (quaternion.turn(q, tuple(v)) for v in (axis, first, np.cross(axis, first)))
    assert (
        found.exact and abs(found.precession_rate - count_turns(t, apex[0] + 1j * apex[1])) < 5e-3
    )
    assert abs(found.spin_angle_rate - count_turns(t, two[2] + 1j * one[2])) < 5e-3
    if scene.body.kind == "goryachev_chaplygin":
        assert abs(found.precession_rate) < 1e-9


@pytest.mark.parametrize("scene", FAR_FROM_THE_POLE + OVER_THE_POLE)
def test_rates_do_not_depend_on_the_start_or_the_direction_of_time(scene):
    found, later = analyse(scene, 20.0, 101, "exact"), kr.exact(scene)(777.7)
    moved = scene.replace(momentum=later.m[0], attitude=later.q[0])
    for other in (analyse(scene, -20.0, 101, "exact"), analyse(moved, 20.0, 101, "exact")):
        assert other.exact
        assert_rates_near(other, found, 1e-11)


@pytest.mark.parametrize("scene", OVER_THE_POLE)
def test_successive_quasi_periods_return_closer_to_the_start(scene):
    top = kr.exact(scene)
    rows = top.find_quasi_periods(8)
    assert rows.shape == (8, 3) and (np.diff(rows[:, 2]) > 0.0).all()
    first, second, _ = top.frequencies
    miss = np.abs(rows[:, 2] * first - math.tau * rows[:, 0])
    assert (np.diff(miss) < 0.0).all()
    assert np.abs(miss - np.abs(rows[:, 2] * second - math.tau * rows[:, 1])).max() < 1e-9
    path = top([0.0, *rows[:, 2]])
    distances = np.linalg.norm(path.body_momentum[1:] - path.body_momentum[0], axis=1)
    assert distances[-1] < 1e-2 * distances[0] and (distances < 30.0 * miss).all()


def test_quasi_periods_end_where_rounding_errors_begin():
    near_rest = make_scene(KOWALEWSKI, (1e-3, 2e-3, 1e-3), (0.5, 0.5, 0.5, 0.49))
    for scene in (OVER_THE_POLE[0], near_rest):
        top = kr.exact(scene)
        rows = top.find_quasi_periods(1000)
        assert 8 < len(rows) < 60 and np.isfinite(rows).all()
        assert len(top(rows[:, 2])) == len(rows)
