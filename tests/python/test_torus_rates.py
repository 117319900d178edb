"""Tests of the mean rates of Kowalewski and Goryachev-Chaplygin tops."""

import math

import kreisel as kr
import numpy as np
import pytest
from kreisel import quaternion
from kreisel._analysis import torus_rates
from tops import unit

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


def exact_path(scene, t):
    return kr.solve(scene, t, method="exact")


def turn_rows(q, v):
    return quaternion.turn(tuple(q.T), tuple(v))


def count_turns(t, signal):
    return float(np.angle(signal[1:] * signal[:-1].conj()).sum()) / (t[-1] - t[0])


@pytest.mark.parametrize("scene", FAR_FROM_THE_POLE)
def test_rates_agree_with_the_frequency_analysis(scene):
    path = kr.solve(scene, np.linspace(0.0, 600.0, 6001), method="taylor")
    rates, analysis = kr.frequencies(exact_path(scene, path.t)), kr.frequencies(path)
    assert rates.exact and not analysis.exact
    for rate in ("precession_rate", "nutation", "spin_angle_rate"):
        assert abs(getattr(rates, rate) - getattr(analysis, rate)) < 1e-9


def test_rates_that_the_states_do_not_determine_are_nan():
    """Check a top whose apex passes both poles at distances of 0.01 rad to 0.02 rad."""
    body = kr.Body(1.0, (2, 2, 1), (0.05410227877154389, 0.27279133916445375, 0), unphysical=True)
    attitude = (0.12742985, 0.41096882, -0.89214323, 0.13764700)
    scene = kr.Scene(body, (1.7119621469, 2.9386153769, -0.5646954459), unit(attitude), gravity=1)
    for t in (300.0, -300.0):
        found = kr.frequencies(kr.solve(scene, np.linspace(0.0, t, 9001), "taylor"))
        assert math.isnan(found.precession_rate) and math.isnan(found.spin_angle_rate)
        assert found.nutation == pytest.approx(2.0626, abs=1e-4)


def test_known_rates_agree_with_the_closed_form_and_others_are_nan():
    rng, t, known = np.random.default_rng(1), np.linspace(0.0, 300.0, 3001), []
    for _ in range(40):
        momentum = (2.0, 2.0, 1.0) * rng.normal(size=3) * rng.choice((0.3, 1.5, 4.0))
        scene = make_scene(KOWALEWSKI, momentum, rng.normal(size=4))
        found = kr.frequencies(kr.solve(scene, t, "taylor"))
        assert math.isnan(found.precession_rate) == math.isnan(found.spin_angle_rate)
        if not math.isnan(found.precession_rate):
            truth = kr.frequencies(exact_path(scene, t))
            differences = (
                found.precession_rate - truth.precession_rate,
                found.spin_angle_rate - truth.spin_angle_rate,
            )
            known.append(300.0 * max(map(abs, differences)))
    assert 3 < len(known) < 20 and max(known) < 0.02


def test_slow_rates_are_means_if_the_angles_vary_smoothly():
    scene = make_scene(KOWALEWSKI, (-0.2, -0.4, -2.2), (0.0, -0.4, 1.2, 0.7), 0.1)
    t = np.linspace(0.0, 300.0, 9001)
    found, truth = (kr.frequencies(kr.solve(scene, t, method)) for method in ("taylor", "exact"))
    assert found.precession_rate == pytest.approx(truth.precession_rate, abs=2e-5)
    assert abs(truth.spin_angle_rate) < 1e-9 and abs(found.spin_angle_rate) < 1e-5
    assert np.abs(found.lines - found.precession_rate).min() > 1e-6


@pytest.mark.parametrize("scene", OVER_THE_POLE)
def test_mean_precession_agrees_with_counted_turns(scene):
    """Compare the mean rates with the number of turns counted over a long interval of time.

    The number of counted turns is wrong by at most a few turns, whatever the length of the path.
    """
    t = np.linspace(0.0, 20000.0, 800001)
    path = kr.exact(scene)(t)
    frequencies = kr.frequencies(exact_path(scene, t[:101]))
    assert frequencies.exact
    axis = np.array(scene.body.com)
    first = np.roll(axis, 1)
    apex, one, two = (turn_rows(path.q, v) for v in (axis, first, np.cross(axis, first)))
    precession, spin = apex[0] + 1j * apex[1], two[2] + 1j * one[2]
    assert abs(frequencies.precession_rate - count_turns(t, precession)) < 2e-3
    assert abs(frequencies.spin_angle_rate - count_turns(t, spin)) < 2e-3
    first, second, heading = kr.exact(scene).frequencies
    if scene.body.kind == "goryachev_chaplygin":
        assert abs(frequencies.precession_rate) < 1e-9
    else:  # no small integers give the mean rate
        n = np.arange(-6, 7)
        sums = heading + n[:, None] * first + n * second
        assert np.abs(sums - frequencies.precession_rate).min() > 2e-2 * first


@pytest.mark.parametrize("scene", FAR_FROM_THE_POLE + OVER_THE_POLE)
def test_rates_do_not_depend_on_the_start_or_the_direction_of_time(scene):
    t = np.linspace(0.0, 20.0, 101)
    frequencies = kr.frequencies(exact_path(scene, t))
    later = kr.exact(scene)(777.7)
    later_scene = scene.replace(momentum=later.m[0], attitude=later.q[0])
    for other in (exact_path(scene, -t), exact_path(later_scene, t)):
        again = kr.frequencies(other)
        assert again.exact and again.nutation == pytest.approx(frequencies.nutation, rel=1e-12)
        assert abs(again.precession_rate - frequencies.precession_rate) < 1e-11
        assert abs(again.spin_angle_rate - frequencies.spin_angle_rate) < 1e-11


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
    top = kr.exact(OVER_THE_POLE[0])
    rows = top.find_quasi_periods(1000)
    assert 8 < len(rows) < 60 and np.isfinite(rows).all()
    near_rest = make_scene(KOWALEWSKI, (1e-3, 2e-3, 1e-3), (0.5, 0.5, 0.5, 0.49))
    for one in (top, kr.exact(near_rest)):
        times = one.find_quasi_periods(1000)[:, 2]
        assert len(one(times)) == len(times)
    for wrong in (0, -1, 1.5, "2", math.nan):
        with pytest.raises((TypeError, ValueError), match="n must be"):
            top.find_quasi_periods(wrong)


@pytest.mark.parametrize("name", ["_GRIDS", "_refine_zero_by_newton"])
def test_motions_whose_zeros_are_not_found_are_analysed_by_frequency(monkeypatch, name):
    scene = OVER_THE_POLE[0]
    path = exact_path(scene, np.linspace(0.0, 600.0, 6001))
    found = kr.frequencies(path)
    values = {"_GRIDS": (64,), "_refine_zero_by_newton": lambda *_: np.full(2, np.nan)}
    monkeypatch.setattr(torus_rates, name, values[name])
    seen = kr.frequencies(path)
    assert found.exact and not seen.exact
    assert seen.nutation == pytest.approx(found.nutation, rel=1e-3)


@pytest.mark.parametrize(
    "signal, is_found",
    [
        (lambda a, b: (a - 0.5) + 1j * (b - 0.51), True),
        (lambda a, b: a - 0.5 + 0.0 * b, False),  # zero along a curve
        (lambda a, b: (a - 0.6) + 1j * (b - 0.6), False),  # in another cell
        (lambda a, b: (a - 0.5) ** 3 + 1j * (b - 0.51), False),  # slow convergence
    ],
)
def test_zeros_are_found_in_their_cell(monkeypatch, signal, is_found):
    class Axis:
        def __init__(self, form, turns):
            self.z = signal(*turns.T)

    monkeypatch.setattr(torus_rates, "_compute_body_axis_at_torus_angles", Axis)
    zero = torus_rates._refine_zero_by_newton(None, np.array([0.505, 0.505]), 64)
    assert np.allclose(zero, [0.5, 0.51], atol=1e-9) if is_found else np.isnan(zero).all()


@pytest.mark.parametrize("slope", [(3.0 + 1.0j, -2.0 + 4.0j), (1.0j, 5.0 + 0.0j)])
def test_few_newton_steps_find_the_zero_of_a_linear_function(monkeypatch, slope):
    """Check the number of Newton steps, and the points at which the derivatives are measured."""
    calls = []

    class Axis:
        def __init__(self, form, turns):
            calls.append(turns)
            self.z = (turns - (0.5, 0.51)) @ np.array(slope)

    monkeypatch.setattr(torus_rates, "_compute_body_axis_at_torus_angles", Axis)
    zero = torus_rates._refine_zero_by_newton(None, np.array([0.505, 0.505]), 64)
    assert np.allclose(zero, [0.5, 0.51], atol=1e-13) and len(calls) <= 3
    first = calls[0] - (0.505, 0.505)
    assert np.allclose(first * 1e6, [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)], atol=1e-8)


@pytest.mark.parametrize("distance, is_found", [(1.4, True), (1.6, False)])
def test_zeros_farther_than_one_and_a_half_cells_are_refused(monkeypatch, distance, is_found):
    class Axis:
        def __init__(self, form, turns):
            x, y = (turns - 0.5).T
            self.z = x - distance / 64.0 + 1j * y

    monkeypatch.setattr(torus_rates, "_compute_body_axis_at_torus_angles", Axis)
    zero = torus_rates._refine_zero_by_newton(None, np.array([0.5, 0.5]), 64)
    assert np.isfinite(zero).all() == is_found


def evaluate_waves(waves, n=40, offset=0.3):
    """Evaluate a Fourier sum, given as {(k, l): amplitude}, at grid points on the torus."""
    a, b = np.meshgrid(*[(np.arange(n) + offset) / n] * 2, indexing="ij")
    return sum(c * np.exp(2j * np.pi * (k * a + m * b)) for (k, m), c in waves.items())


@pytest.mark.parametrize(
    ("waves", "windings"),
    [
        ({(2, -1): 1.0, (0, 3): 0.4}, (2.0, -1.0)),  # no zeros
        ({(0, 0): 1.0, (5, 2): 0.9}, (0.0, 0.0)),
        ({(1, 0): 1.0, (0, 1): 1.0, (0, 0): 1.0}, (1 / 3, 1 / 3)),  # by symmetry
        ({(2, 1): 1.0, (1, 2): 1.0, (1, 1): 1.0}, (4 / 3, 4 / 3)),
        ({(2, 0): 1.0, (0, -1): 1.0, (0, 0): 1.0}, (2 / 3, -1 / 3)),
        # In the triangle with sides 3, 4 and 5, a wave's weight is its angle / pi (Bohl, Weyl).
        (
            {(1, 0): 3.0, (0, 1): 4.0j, (0, 0): 5.0},
            (np.arcsin(0.6) / np.pi, np.arcsin(0.8) / np.pi),
        ),
    ],
)
def test_mean_windings_of_three_waves_agree_with_the_angles_of_their_triangle(waves, windings):
    """Compare with Bohl's theorem on the mean motion of a sum of three waves."""
    cells, index = torus_rates._find_grid_cells_with_zeros(evaluate_waves(waves))
    assert index.sum() == 0 and set(np.abs(index)) <= {1.0}
    assert bool(len(cells)) == (not float(windings[0]).is_integer())
    zeros = []
    for cell in cells:
        angles = (cell + 0.8) / 40.0
        for _ in range(20):
            z = sum(c * np.exp(2j * np.pi * np.dot(k, angles)) for k, c in waves.items())
            one, two = (
                sum(
                    2j * np.pi * k[i] * c * np.exp(2j * np.pi * np.dot(k, angles))
                    for k, c in waves.items()
                )
                for i in range(2)
            )
            matrix = np.array(((one.real, two.real), (one.imag, two.imag)))
            angles = angles - np.linalg.solve(matrix, (z.real, z.imag))
        assert (np.abs(angles - (cell + 0.8) / 40.0) < 0.8 / 40.0).all()
        zeros.append(angles - 0.3 / 40.0)
    found = torus_rates._compute_mean_windings(
        evaluate_waves(waves), np.reshape(zeros, (-1, 2)), index
    )
    assert np.allclose(found, windings, atol=1e-12)


@pytest.mark.parametrize(
    ("orders", "rate"),
    [((2, 1), 7.0), ((2, -1), 1.0), ((-3, 1), 3.0), ((0, 3), 9.0), ((4, 0), 8.0), ((3, -3), 3.0)],
)
def test_the_nutation_is_the_strongest_harmonic_of_the_height(orders, rate):
    height = 3.0 + evaluate_waves({orders: 1.0, (1, 1): 0.3}, 8).real
    signals = torus_rates._BodyAxisAtTorusAngles(None, None, height)
    found = torus_rates._find_rate_of_strongest_harmonic(signals, np.array((2.0, 3.0, 50.0)))
    assert found == pytest.approx(rate)
