"""Tests of Lyapunov exponents and other chaos indicators against analytic formulas."""

import kreisel as kr
import numpy as np
import pytest
from kreisel._solve import chaos

TOP = kr.scenes.asymmetric

UP = (1.0, 0.0, 0.0, 0.0)


def slope(scene, rate, period=None):
    """Return the asymptotic growth rate of a tangent vector, averaged over whole periods."""
    t = np.array([200.0, 300.0]) / rate
    if period:
        t = period * np.round(t / period)
    indicator = kr.lyapunov(scene, t)
    assert indicator.certificate < 1e-13
    first, last = indicator.curve * t
    return (last - first) / (t[1] - t[0])


def test_an_unstable_sleeping_top_falls_at_the_rate_of_the_formula():
    body = kr.Body(mass=1.3, inertia=(2.0, 2.0, 0.7), com=(0.0, 0.0, 0.8))
    for spin in (0.0, 1.1, 3.9):
        scene = kr.Scene(body, attitude=UP, momentum=(0.0, 0.0, 0.7 * spin), gravity=1.7)
        rate = np.sqrt(1.3 * 1.7 * 0.8 / 2.0 - (0.7 * spin / (2.0 * 2.0)) ** 2)
        assert abs(slope(scene, rate) - rate) <= 1e-10 * rate
    fast = kr.Scene(body, attitude=UP, momentum=(0.0, 0.0, 9.0), gravity=1.7)
    assert abs(kr.lyapunov(fast, 1e4).value) < 2e-3


def test_a_free_body_leaves_its_middle_axis_at_the_rate_of_the_formula():
    for one, two, three in ((1.0, 1.6, 2.1), (0.9, 1.0, 1.8)):
        body = kr.Body(mass=1.0, inertia=(one, two, three), com=(0.0, 0.0, 0.0))
        scene = kr.Scene(body, attitude=UP, momentum=(0.0, 1.3 * two, 0.0), gravity=1)
        rate = 1.3 * np.sqrt((three - two) * (two - one) / (one * three))
        assert abs(slope(scene, rate, 2.0 * np.pi / 1.3) - rate) <= 1e-10 * rate


INDICATORS = (kr.lyapunov, kr.megno, kr.oli)


def assert_regular(scene, t):
    """Assert that a tangent grows at most linearly in time."""
    exponent, mean, largest = (indicator(scene, t) for indicator in INDICATORS)
    bound = np.log(1.0 + abs(t)) + 5.0
    assert exponent.value * abs(t) < bound and largest.value < bound and mean.value < 3.0
    assert max(exponent.certificate, mean.certificate, largest.certificate) < 1e-12


@pytest.mark.parametrize("attitude", [UP, (0.0, 1.0, 0.0, 0.0)], ids=["sleeping", "hanging"])
@pytest.mark.parametrize("spin", [50.0, 200.0, 1000.0, -1000.0])
def test_fast_tops_about_the_vertical_are_regular(spin, attitude):
    body = kr.Body.symmetric(1.0, 1.0, 0.5, 0.5)
    scene = kr.Scene(body, attitude=attitude, velocity=(0.0, 0.0, spin), gravity=1.0)
    for t in (10.0, -10.0, 100.0):
        assert_regular(scene, t)


def test_the_fastest_sleeping_tops_are_regular():
    body = kr.Body.symmetric(1.0, 1.0, 0.5, 0.5)
    assert_regular(kr.Scene(body, velocity=(0.0, 0.0, 1e4), gravity=1.0), 10.0)
    toy = kr.Body.symmetric(0.1, 2.6e-4, 2.7e-5, 0.045)
    assert_regular(kr.Scene(toy, velocity=(0.0, 0.0, 300.0), gravity=9.81), 1.0)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("moments", [(1.11, 0.9375, 0.996), (1.0, 1.5, 2.0), (2.0, 1.0, 1.6)])
def test_tangents_of_permanent_rotations_grow_as_the_formula_predicts(moments, axis):
    own, one, other = np.roll(moments, -axis)
    square = 1.25**2 * (own - one) * (other - own) / (one * other)
    turns = ((1.0, 0.0, 0.0, 0.0), (0.5, 0.5, 0.5, 0.5), (0.5, -0.5, -0.5, -0.5))
    for attitude in turns:
        velocity = 1.25 * np.eye(3)[axis]
        body = kr.Body(mass=1.0, inertia=moments, com=(0.0, 0.0, 0.0))
        scene = kr.Scene(body, attitude=attitude, body_velocity=velocity, gravity=0.0)
        for sign in (1.0, -1.0):
            if square > 0.0:
                turn = 2.0 * np.pi / 1.25
                t = sign * turn * np.round(np.array([300.0, 900.0]) / turn)
                indicator = kr.lyapunov(scene, t)
                first, last = indicator.curve * np.abs(t)
                rate = (last - first) / abs(t[1] - t[0])
                assert abs(rate - np.sqrt(square)) < 1e-9 and indicator.certificate < 1e-12
            else:
                assert_regular(scene, sign * 1000.0)


def test_many_times_within_a_long_step_do_not_change_the_exponent():
    body = kr.Body.symmetric(1.0, 1.0, 0.5, 0.5)
    tops = kr.Ensemble(body, velocity=[(0.0, 0.0, s) for s in (3.0, 50.0, 400.0)], gravity=1.0)
    curve = kr.lyapunov(tops, np.linspace(0.1, 20.0, 200))
    for i in range(3):
        alone = kr.lyapunov(tops[i], [20.0])
        assert alone.value == curve.value[i] and curve.status[i] == "OK"


def test_staude_rotations_diverge_at_the_rate_of_their_biquadratic():
    one, two, three, height = 1.0, 1.6, 2.1, 0.5
    body = kr.Body(mass=1.0, inertia=(one, two, three), com=(0.0, 0.0, height))
    for spin in (0.4, 0.9):
        matrix = [
            [0.0, (two - three) * spin / one, 0.0, height / one],
            [(three - one) * spin / two, 0.0, -height / two, 0.0],
            [0.0, -1.0, 0.0, spin],
            [1.0, 0.0, -spin, 0.0],
        ]
        _, _, square, _, constant = np.poly(np.array(matrix))
        rate = np.sqrt(max(np.roots([1.0, square, constant]).real))
        scene = kr.Scene(body, attitude=UP, momentum=(0.0, 0.0, three * spin), gravity=1.0)
        assert abs(slope(scene, rate) - rate) <= 1e-10 * rate


def test_the_exponent_agrees_with_the_tangents_of_a_path():
    scene, t = kr.scenes.asymmetric, [20.0, 60.0]
    path = kr.solve(scene, t, tangents="start", digits=20)
    size = np.log(np.abs(path.tangents).max(axis=(1, 2)))
    indicator = kr.lyapunov(scene, t)
    assert np.all(np.abs(indicator.curve * t - size) < 4.0) and np.all(indicator.curve > 0.1)
    back = kr.lyapunov(scene, [-20.0, -60.0])
    assert np.all(back.curve > 0.1) and back.certificate < 1e-12


def test_megno_separates_order_from_chaos():
    rng = np.random.default_rng(5)
    q = rng.standard_normal((24, 4))
    q /= np.linalg.norm(q, axis=1)[:, None]
    m = rng.standard_normal((24, 3))
    bodies = {
        "kowalewski": kr.scenes.kowalewski.body,
        "lagrange": kr.scenes.thesis.body,
        "euler": kr.Body(mass=1.0, inertia=(1.0, 1.6, 2.1), com=(0.0, 0.0, 0.0)),
    }
    for body in bodies.values():
        indicator = kr.megno(kr.Ensemble(body, momentum=m, attitude=q, gravity=1), [1000.0])
        assert indicator.value.max() < 8.0 and indicator.failed.size == 0
    level = m.copy()
    level[:, 2] = 0.0
    ensemble = kr.Ensemble(
        kr.scenes.goryachev_chaplygin.body, momentum=level, attitude=q, gravity=1
    )
    assert kr.megno(ensemble, [1000.0]).value.max() < 8.0
    assert kr.megno(kr.scenes.asymmetric, [1000.0]).value > 70.0


def test_megno_of_regular_tops_approaches_two():
    for scene in (kr.scenes.thesis, kr.scenes.asymmetric_regular):
        indicator = kr.megno(scene, [300.0, 1e3, 3e3])
        deviation = np.abs(indicator.curve - 2.0)
        assert np.all(deviation < 30.0 * np.log(indicator.t) / indicator.t), deviation
        assert np.all(np.diff(deviation) < 0.0)


@pytest.mark.parametrize("name", ["asymmetric", "thesis", "kowalewski", "asymmetric_regular"])
def test_the_orthogonal_indicator_never_decreases(name):
    scene, t = kr.scenes.get_scene(name), np.linspace(0.05, 10.0, 400)
    for times in (t, -t):
        curve = kr.oli(scene, times).curve
        assert np.diff(curve).min() >= 0.0
        sizes = kr.lyapunov(scene, times).curve * t
        assert (curve - np.maximum.accumulate(sizes)).min() > -1e-12
        assert kr.oli(scene, times[-1:]).value == pytest.approx(curve[-1], rel=1e-3)


def test_the_indicators_of_a_top_do_not_depend_on_the_ensemble():
    tops = kr.scenes.asymmetric.vary(gravity=np.linspace(0.1, 1.0, 37))
    indicators = kr.lyapunov(tops, [5.0, 50.0], threads=2)
    for i in (0, 17, 36):
        alone = kr.lyapunov(tops[i], [5.0, 50.0])
        assert np.array_equal(alone.curve, indicators.curve[i])
        assert alone.certificate == indicators.certificate[i] and alone.value == indicators.value[i]
    indicator = kr.oli(tops[3], [1.0, 2.0, 3.0, 50.0])
    assert indicator.value == kr.oli(tops[3], [50.0]).value
    doubled = kr.scenes.asymmetric.replace(
        gravity=4.0, momentum=2.0 * np.array((0.172, -1.862, 1.46))
    )
    single = kr.scenes.asymmetric.replace(gravity=1.0, momentum=(0.172, -1.862, 1.46))
    assert kr.lyapunov(doubled, [25.0]).value == 2.0 * kr.lyapunov(single, [50.0]).value


def test_directions_are_used_as_given_up_to_length():
    scene = kr.scenes.asymmetric
    one = kr.lyapunov(scene, [10.0], direction=[0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    same = kr.lyapunov(scene, [10.0], direction=[0.2, 0.4, 0.6, 0.8, 1.0, 1.2])
    other = kr.lyapunov(scene, [10.0], direction=[-0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    assert abs(one.value - same.value) < 1e-12 < abs(one.value - other.value)
    start = kr.solve(scene, [0.0])
    flow = [*start.body_velocity[0].tolist(), *start.torque[0].tolist()]
    turn = [*start.body_vertical[0].tolist(), *np.cross((0, 0, 1), start.m[0]).tolist()]
    for direction in (flow, turn):
        with pytest.raises(ValueError, match="no tangent in the direction"):
            kr.lyapunov(scene, 5.0, direction=direction)


def test_invalid_arguments_are_refused():
    scene = kr.scenes.asymmetric
    for wrong, message in (
        ({"t": 0.0}, "and not 0"),
        ({"t": [0.0, 1.0]}, "and not 0"),
        ({"t": []}, "and not 0"),
        ({"t": float("nan")}, "finite"),
        ({"t": 1e300}, "double precision"),
        ({"t": 1.0, "tol": 2.0}, "below 1"),
        ({"t": 1.0, "direction": [1.0, 2.0]}, "six numbers"),
        ({"t": 1.0, "direction": [0.0] * 6}, "six numbers"),
        ({"t": 1.0, "threads": 0}, "threads"),
    ):
        with pytest.raises(ValueError, match=message):
            kr.lyapunov(scene, **wrong)
    with pytest.raises(TypeError, match=r"kreisel\.Scene or a kreisel\.Ensemble"):
        kr.megno(3, 1.0)
    with pytest.raises(ValueError, match="damped"):
        kr.oli(scene.replace(damping=0.1), 1.0)
    with pytest.raises(kr.Error, match="largest number of steps") as error:
        kr.megno(scene, 100.0, max_steps=3)
    assert error.value.status == "ERR_LIMIT" and np.isnan(error.value.paths.curve).all()
    tops = scene.vary(gravity=np.array([1.0, 1e30]))
    indicator = kr.megno(tops, [10.0], max_steps=2000)
    assert (
        indicator.failed.tolist() == [1]
        and indicator.status[1] != "OK"
        and np.isfinite(indicator.value[0])
    )


@pytest.mark.parametrize("verb", [kr.lyapunov, kr.megno, kr.oli])
def test_empty_ensembles_give_empty_indicators(verb):
    indicator = verb(kr.scenes.asymmetric.scatter(3, momentum=0.1)[:0], 5.0)
    assert indicator.curve.shape == (0, len(indicator.t)) and indicator.value.shape == (0,)
    assert indicator.certificate.shape == indicator.status.shape == (0,) and "0 tops" in repr(
        indicator
    )


# Boundary values


def test_a_single_time_gives_a_curve_over_three_decades():
    times = chaos._validate_indicator_times(20.0)
    assert times.size == 32 and times[-1] == 20.0 and times[0] == pytest.approx(0.02, rel=1e-12)
    np.testing.assert_allclose(times[1:] / times[:-1], 10 ** (3 / 31), rtol=1e-12)
    assert (chaos._validate_indicator_times(-20.0) == -times).all()
    assert chaos._validate_indicator_times([1.0, 2.0]).tolist() == [1.0, 2.0]


def test_curves_of_a_number_and_of_a_list_have_the_same_end():
    indicator, last = kr.lyapunov(TOP, 20.0), kr.lyapunov(TOP, [20.0])
    assert indicator.value == last.value and last.curve.shape == (1,)
    assert indicator.certificate.shape == indicator.status.shape == ()
    assert kr.lyapunov(TOP, 20.0, tol=1e-5).value == pytest.approx(indicator.value, rel=1e-2)
    assert kr.lyapunov(TOP, 20.0, tol=1e-5).certificate > indicator.certificate
