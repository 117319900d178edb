"""Tests of frequency analysis against closed forms and known spectra."""

import math

import kreisel as kr
import numpy as np
import pytest
from kreisel._analysis import turns
from kreisel._analysis.frequencies import _find_strongest_spectral_lines
from tops import FREE, GENERAL, LAGRANGE

TOP = kr.scenes.asymmetric


def solve_periods(scene, periods=60, states=4096, method="taylor"):
    exact = kr.exact(scene)
    swing = min(exact.period, 40.0)
    return exact, kr.solve(scene, np.linspace(0.0, periods * swing, states), method)


def largest_relative_error(frequencies, exact):
    """Return the largest relative error of the frequencies."""
    pairs = [
        (frequencies.precession_rate, exact.precession_rate),
        (frequencies.spin_angle_rate, exact.spin_angle_rate),
    ]
    pairs.append((frequencies.nutation, math.tau / exact.period))
    return max(abs(one / other - 1.0) if other else abs(one) for one, other in pairs)


@pytest.mark.parametrize(
    "name", ["cusps", "thesis", "fast", "strong_gravity", "sleeping"]
)  # cusps, curves through the pole, a pendulum
def test_frequencies_agree_with_the_closed_form(name):
    exact, path = solve_periods(kr.scenes.get_scene(name))
    frequencies = kr.frequencies(path)
    assert not frequencies.exact and largest_relative_error(frequencies, exact) < 1e-12


def random_top(rng, gravity):
    i1 = rng.uniform(0.5, 2)
    height = rng.choice([1, -1]) * rng.uniform(0.1, 1)
    body = kr.Body.symmetric(1, i1, rng.uniform(0.1, 2 * i1), height, unphysical=True)
    q = rng.normal(size=4)
    momentum = 2.0 * rng.normal(size=3)
    return kr.Scene(body, momentum, q / np.linalg.norm(q), gravity=gravity)


@pytest.mark.parametrize("gravity", [1.0, -0.4, 0.0])
def test_frequencies_of_random_tops(gravity):
    rng = np.random.default_rng(3)
    for _ in range(15):
        exact, path = solve_periods(random_top(rng, gravity), 40)
        assert largest_relative_error(kr.frequencies(path), exact) < 1e-12


def top_near_a_pole(rng, side):
    """Return a random top whose apex passes close to a pole."""
    i1 = rng.uniform(0.5, 2)
    height = rng.choice([1, -1]) * rng.uniform(0.1, 1)
    body = kr.Body.symmetric(1, i1, rng.uniform(0.1, 2 * i1), height, unphysical=True)
    lean = 10 ** rng.uniform(-7, -0.83)
    tilt = lean if side > 0 else math.pi - lean
    angles = (rng.uniform(0, 6), tilt, rng.uniform(0, 6))
    start = kr.Scene.from_euler(body, angles=angles, rates=(0, 0, 0), gravity=1)
    return kr.Scene(
        body, body_velocity=rng.normal(size=3) * (1, 1, 2), attitude=start.attitude, gravity=1
    )


@pytest.mark.parametrize("side", [1, -1])
def test_frequencies_of_tops_that_pass_near_a_pole(side):
    rng = np.random.default_rng(17)
    for _ in range(15):
        scene = top_near_a_pole(rng, side)
        exact = kr.exact(scene)
        frequencies = kr.frequencies(kr.solve(scene, np.linspace(0, 300, 4001), "taylor"))
        assert abs(frequencies.precession_rate - exact.precession_rate) < 1e-10
        assert abs(frequencies.spin_angle_rate - exact.spin_angle_rate) < 1e-10
        assert abs(frequencies.nutation - math.tau / exact.period) < 1e-10


@pytest.mark.parametrize("states", [3001, 6001, 12001])
def test_mean_rates_do_not_depend_on_the_density_of_states(states):
    """Check the mean rates of a top whose apex passes a pole between two output times."""
    moments = (1.0907756121569128, 1.0907756121569128, 0.9995852256388432)
    scene = kr.Scene(
        kr.Body(1, moments, (0, 0, 0.5), unphysical=True),
        momentum=(3.0271208993064915, -1.8130228754576976, -0.4575879183085531),
        attitude=(
            -0.02831861256452627,
            0.28957114766611647,
            0.8804210978487045,
            -0.3744399779465734,
        ),
        gravity=1,
    )
    frequencies = kr.frequencies(kr.solve(scene, np.linspace(0, 300, states), "taylor"))
    assert largest_relative_error(frequencies, kr.exact(scene)) < 1e-12


def test_a_path_whose_errors_hide_the_side_of_the_pole_has_no_mean_rates():
    exact = kr.exact(kr.scenes.thesis)
    t = np.linspace(0, 60 * exact.period, 4001)
    series_rates = kr.frequencies(kr.solve(kr.scenes.thesis, t, "taylor"))
    assert largest_relative_error(series_rates, exact) < 1e-12
    strang_rates = kr.frequencies(kr.solve(kr.scenes.thesis, t[-1], "strang", step=0.01, every=5))
    assert largest_relative_error(strang_rates, exact) < 1e-5
    rk4_rates = kr.frequencies(kr.solve(kr.scenes.thesis, t[-1], "rk4", step=0.01, every=5))
    assert math.isnan(rk4_rates.precession_rate) and math.isnan(rk4_rates.spin_angle_rate)
    assert rk4_rates.nutation == pytest.approx(math.tau / exact.period, rel=1e-5)


def test_a_pendulum_through_both_poles_has_no_precession():
    t = np.linspace(0, 160, 3269)
    for method, words in (("taylor", {}), ("bobenko_suris2", {"step": 0.01})):
        frequencies = kr.frequencies(kr.solve(kr.scenes.strong_gravity, t, method, **words))
        assert abs(frequencies.precession_rate) < 1e-9 and abs(frequencies.spin_angle_rate) < 1e-9


def test_frequencies_of_free_bodies():
    body = kr.Body(1, (1, 2, 2.5), (0, 0, 0))
    for momentum in ((3, 0.5, 0.4), (0.4, 0.5, -3), (-2, 1, 1), (0.5, -1, 2)):
        exact, path = solve_periods(kr.Scene(body, momentum, (0.8, 0.4, -0.2, 0.4), gravity=1))
        assert largest_relative_error(kr.frequencies(path), exact) < 1e-12


@pytest.mark.parametrize("momentum", [(3.0, 0.5, 0.4), (-2.0, 1.0, 1.0)])
@pytest.mark.parametrize("rotor", [1.5, -1.5])
def test_frequencies_of_free_symmetric_bodies_with_a_rotor(rotor, momentum):
    """Compare with the precession rate |m| / I2 of a body with a rotor along its symmetry axis."""
    body = kr.Body(1.0, (1.0, 2.0, 2.0), (0, 0, 0), rotor=(rotor, 0.0, 0.0))
    scene = kr.Scene(body, body_momentum=momentum, attitude=(0.8, 0.4, -0.2, 0.4), gravity=1)
    path = kr.solve(scene, np.linspace(0.0, 200.0, 4096), "taylor")
    found, size = kr.frequencies(path), float(np.linalg.norm(momentum))
    assert found.precession_rate == pytest.approx(size / 2.0, rel=1e-12)
    spin = math.copysign(1.0, momentum[0]) * (momentum[0] - rotor - momentum[0] / 2.0)
    assert found.spin_angle_rate == pytest.approx(spin, rel=1e-12)


def test_a_free_body_with_a_tilted_rotor_has_no_mean_rates():
    body = kr.Body(1.0, (1.0, 2.0, 2.0), (0, 0, 0), rotor=(0.5, 0.1, 0.0))
    path = kr.solve(kr.Scene(body, (3.0, 0.5, 0.4), gravity=1), np.linspace(0.0, 20.0, 100))
    with pytest.raises(ValueError, match="if its rotor is not along its axis of symmetry"):
        kr.frequencies(path)


def test_frequencies_of_exact_paths_are_those_of_the_closed_form():
    exact, path = solve_periods(LAGRANGE, method="exact")
    frequencies = kr.frequencies(path, 20)
    assert frequencies.exact and largest_relative_error(frequencies, exact) == 0.0
    spaced = (frequencies.lines - exact.precession_rate) / (math.pi / exact.period)
    assert np.abs(spaced - spaced.round()).max() < 1e-9 and len(frequencies.lines) == 20
    assert (np.diff(np.abs(frequencies.amplitudes)) < 1e-12).all()


def test_spectral_lines_sum_to_the_motion_of_the_apex():
    _, path = solve_periods(kr.scenes.cusps)
    frequencies = kr.frequencies(path)
    way = np.exp(1j * np.multiply.outer(path.t, frequencies.lines)) @ frequencies.amplitudes
    assert np.abs(way - (path.apex[:, 0] + 1j * path.apex[:, 1])).max() < 1e-11
    assert frequencies.rest < 1e-11 and "12 lines" in repr(frequencies)


def test_known_lines_are_recovered():
    t = np.linspace(-3.0, 997.0, 5000)
    rates, parts = np.array([1.7, -0.31, 2.9]), np.array([0.5, 0.25j, -1e-9])
    lines, amplitudes, rest = _find_strongest_spectral_lines(
        t, np.exp(1j * np.multiply.outer(t, rates)) @ parts, 3
    )
    assert np.abs(lines - rates).max() < 1e-9 and np.abs(lines - rates)[:2].max() < 1e-15
    assert np.abs(amplitudes - parts).max() < 1e-13 and rest < 1e-13


TILTED = kr.scenes.asymmetric_regular.replace(attitude=(0.8, 0.6, 0, 0))


def test_chaotic_paths_have_a_large_remainder():
    t = np.linspace(0, 1500, 15001)
    paths = (kr.solve(scene, t) for scene in (TILTED, kr.scenes.asymmetric))
    regular, chaotic = (kr.frequencies(path, 40) for path in paths)
    assert regular.rest < 1e-4 < 0.1 < chaotic.rest
    half = kr.frequencies(kr.solve(TILTED, t[:7501]), 40)
    for rate in ("precession_rate", "nutation", "spin_angle_rate"):
        assert getattr(half, rate) == pytest.approx(getattr(regular, rate), rel=1e-9)


def test_undetermined_rates_are_nan():
    """Check that mean rates are NaN if the apex passes a pole on irregularly alternating sides."""
    frequencies = kr.frequencies(
        kr.solve(kr.scenes.asymmetric_regular, np.linspace(0, 2000, 20001))
    )
    assert (
        math.isnan(frequencies.precession_rate)
        and math.isnan(frequencies.spin_angle_rate)
        and frequencies.nutation > 1.0
    )
    assert np.isfinite(frequencies.lines).all() and frequencies.rest < 1e-3


def test_turns_that_halving_does_not_resolve_leave_the_rates_undetermined(monkeypatch):
    path = kr.solve(kr.scenes.cusps, np.linspace(0.0, 200.0, 100), "taylor")
    exact = kr.exact(kr.scenes.cusps)
    assert kr.frequencies(path).precession_rate == pytest.approx(exact.precession_rate, rel=1e-9)
    monkeypatch.setattr(turns, "_ROUNDS", 1)
    found = kr.frequencies(path)
    assert math.isnan(found.precession_rate) and math.isnan(found.spin_angle_rate)


def test_steady_and_resting_axes_have_no_nutation():
    steady = kr.scenes.steady_precession
    frequencies = kr.frequencies(kr.solve(steady, np.linspace(0, 100, 2001), "taylor"))
    assert frequencies.nutation == 0.0 and frequencies.precession_rate == pytest.approx(
        1.0, abs=1e-12
    )
    upright = kr.Scene(LAGRANGE.body, (0, 0, 9.0), gravity=1)
    still = kr.frequencies(kr.solve(upright, np.linspace(0, 9, 100), "taylor"))
    assert (
        math.isnan(still.precession_rate)
        and math.isnan(still.spin_angle_rate)
        and still.nutation == 0.0
    )
    rest = kr.frequencies(
        kr.solve(FREE.replace(momentum=(0, 0, 0)), np.linspace(0, 9, 100), "taylor")
    )
    assert rest.nutation == 0.0 and rest.lines.shape == (12,)


def test_a_top_released_at_rest_has_the_frequency_of_a_slow_one():
    t = np.linspace(0, 100, 4001)
    body = kr.Body(1.0, (1.0, 1.5, 2.0), (0.5, 0.0, 0.0))
    lying = (math.cos(0.6), 0.0, math.sin(0.6), 0.0)
    rest, slow = (
        kr.frequencies(kr.solve(kr.Scene(body, (0, 0, m), attitude=lying, gravity=1), t, "taylor"))
        for m in (0.0, 1e-12)
    )
    assert rest.nutation == pytest.approx(slow.nutation, rel=1e-9) and rest.nutation > 1.0
    assert rest.precession_rate == pytest.approx(0.0, abs=1e-12)
    # without a lever, gravity has no effect
    resting = kr.Scene(kr.Body(1.0, (1.0, 1.5, 2.0), (0, 0, 0)), (0, 0, 0))
    still = kr.frequencies(kr.solve(resting, t, "taylor"))
    assert math.isnan(still.precession_rate) and still.nutation == 0.0


def test_frequencies_do_not_depend_on_the_direction_of_time():
    ahead, back = (
        kr.frequencies(kr.solve(kr.scenes.cusps, sign * np.linspace(0, 150, 3001), "taylor"))
        for sign in (1, -1)
    )
    assert back.precession_rate == pytest.approx(ahead.precession_rate, rel=1e-12)
    assert back.spin_angle_rate == pytest.approx(ahead.spin_angle_rate, rel=1e-12)


EVEN = kr.solve(GENERAL, np.linspace(0, 10, 101))


@pytest.mark.parametrize(
    ("path", "n", "message"),
    [
        (EVEN.t, 12, "path must be a kreisel.Path"),
        (EVEN, 0, "n must be at least 1"),
        (EVEN, 2000, "n must be at most the number of states, 101"),
        (EVEN[:63], 2, "at least 64 states, not 63"),
        (kr.solve(GENERAL, np.linspace(1, 3, 80) ** 2), 2, "equally spaced in time"),
        (kr.solve(GENERAL, np.ones(80)), 2, "equally spaced in time"),
        (kr.solve(GENERAL.replace(damping=0.1), np.linspace(0, 1, 80)), 2, "damped"),
        (kr.solve(GENERAL, np.linspace(0, 1, 80), want=["energy"]), 2, "want"),
    ],
)
def test_invalid_arguments_are_refused(path, n, message):
    with pytest.raises((TypeError, ValueError, AttributeError), match=message):
        kr.frequencies(path, n)


# Boundary values


def test_frequencies_need_enough_states():
    t = np.linspace(0.0, 30.0, 64)
    path = kr.solve(TOP, t)
    kr.frequencies(path, 64)
    with pytest.raises(ValueError, match="n must be at most the number of states, 64, not 65"):
        kr.frequencies(path, 65)
    with pytest.raises(ValueError, match="the path must have at least 64 states, not 63"):
        kr.frequencies(kr.solve(TOP, t[:63]), 64)


@pytest.mark.parametrize("t", [np.linspace(0, 200, 4001), np.linspace(0, -200, 4001)])
@pytest.mark.parametrize("name", ["cusps", "thesis", "kowalewski"])
def test_a_turntable_is_subtracted_from_the_precession(name, t):
    scene, rate = getattr(kr.scenes, name), 0.37
    turning_scene = scene.replace(turning=(0, 0, rate))
    for method in ("taylor", "exact"):
        rest, frequencies = (
            kr.frequencies(kr.solve(top, t, method)) for top in (scene, turning_scene)
        )
        assert frequencies.exact == rest.exact
        precession = rest.precession_rate - rate
        assert frequencies.precession_rate == pytest.approx(precession, abs=1e-12, nan_ok=True)
        assert frequencies.nutation == pytest.approx(rest.nutation, rel=1e-11)
        assert frequencies.spin_angle_rate == pytest.approx(
            rest.spin_angle_rate, rel=1e-11, nan_ok=True
        )
        assert np.abs(frequencies.lines[:4] - (rest.lines[:4] - rate)).max() < 1e-9


@pytest.mark.parametrize(
    "words, message",
    [
        (
            {"turning": (0.1, 0, 0)},
            "turning support: its rates about the vertical are not constant",
        ),
        ({"shaking": (0.1, 3.0, 0)}, "shaken support: its rates about the vertical are not const"),
        ({"friction": 0.1}, "friction: the motion decays"),
        ({"turning": (0, 0, 0.1), "gravity": 0}, "replace.turning=None. gives the same motion"),
    ],
)
def test_supports_without_constant_rates_are_refused(words, message):
    path = kr.solve(kr.scenes.cusps.replace(**words), np.linspace(0, 10, 100))
    with pytest.raises(ValueError, match=message):
        kr.frequencies(path)
