"""Tests of the reference solutions by independent recomputation, and of theory in the report."""

import kreisel as kr
import mpmath as mp
import numpy as np
import pytest

from validation.competitors import single_runs
from validation.competitors.curve_fitters import compute_velocities, read_parameters
from validation.parts import chaos, chaos_data, fits, late_states, published
from validation.references import kowalewski, melnikov, reference
from validation.references.problems import (
    HORIZONS,
    SHORT,
    attitude_error,
    load_problem,
    problem_of_scene,
)


@pytest.mark.parametrize(("name", "t"), reference.load_truths())
def test_stored_references_conserve_the_integrals_and_agree_with_heyoka(name, t):
    problem, entry = load_problem(name), reference.load_truths()[name, t]
    with mp.workdps(reference.DIGITS):
        state = [mp.mpf(x) for x in entry["attitude"] + entry["body_momentum"]]
        w, x, y, z = state[:4]
        up = [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]
        vertical = sum(m * u for m, u in zip(state[4:], up, strict=True))
        assert abs(sum(c * c for c in state[:4]) - 1) < 1e-32
        assert abs(vertical - mp.mpf(problem.momentum[2])) < 1e-30
    assert reference.energy_error(problem, state) < 1e-31
    assert 0 < entry["agreement"] < 1e-28 and 1e-15 < entry["conditioning"] < 1e-10
    run = single_runs.HeyokaRun(problem, t, single_runs.Setting(tol=single_runs.EPS))
    assert attitude_error(run.solve(), entry["attitude"]) < 100 * entry["conditioning"]


@pytest.mark.parametrize("name", HORIZONS)
def test_all_computations_agree_within_the_conditioning(name):
    entry = reference.load_truths()[name, SHORT]
    angles = dict(reference.compare_computations(load_problem(name), SHORT, entry))
    for way, angle in angles.items():
        exact = "128" in way
        assert angle < (1e-28 if exact else 10 * entry["conditioning"]), way


def test_a_recomputed_reference_equals_the_stored_one():
    (entry,) = reference.compute_entries(load_problem("thesis"), [SHORT])
    stored = reference.load_truths()["thesis", SHORT]
    for key in ("attitude", "body_momentum"):
        assert [float(x) for x in entry[key]] == [float(x) for x in stored[key]]
    assert entry["conditioning"] == pytest.approx(stored["conditioning"], rel=0.1)


def test_computed_references_do_not_depend_on_units():
    scene = kr.scenes.thesis
    mass, length, rate = 2.0**-60, 2.0**-20, 2.0**10
    moment = mass * length**2
    inertia = [x * moment for x in scene.body.inertia]
    com = [x * length for x in scene.body.com]
    far = kr.Scene(
        kr.Body(mass * scene.body.mass, inertia, com, unphysical=True),
        [m * moment * rate for m in scene.momentum],
        gravity=scene.gravity * length * rate**2,
    )
    truth = reference.compute_truth(problem_of_scene("far", far), SHORT / rate)
    stored = reference.load_truths()["thesis", SHORT]["attitude"]
    assert attitude_error(truth["attitude"], stored) < 1e-18


def test_attitude_errors_are_angles_to_the_last_digit():
    for angle in (1e-15, 1e-9, 1e-3, 3.0):
        q = [mp.cos(angle / 2), 0, mp.sin(angle / 2), 0]
        assert attitude_error(list(map(float, q)), [1, 0, 0, 0]) == pytest.approx(angle, rel=1e-14)
    assert attitude_error([-1, 0, 0, 0], [1, 0, 0, 0]) == 0


@pytest.mark.parametrize("case", published.load_problems(), ids=lambda case: case.name)
def test_published_references_are_reproduced(case):
    path = kr.solve(case.scene, case.end, method="extrap", tol=1e-13)
    assert attitude_error(path.q[-1], case.attitude) < 1e-9


@pytest.mark.parametrize("entry", published.TABLES["numbers"], ids=lambda entry: entry["case"])
def test_published_numbers_are_reproduced_to_the_last_printed_digit(entry):
    is_off = published.compare_number(entry)["units"] > entry.get("units", 1)
    assert is_off == entry.get("is_wrong", False)


@pytest.mark.parametrize("region", range(10))
def test_the_least_and_greatest_k_are_critical(region):
    g, h = kowalewski.REGIONS[region]
    words = {"energy": h, "vertical": kowalewski.vertical_momentum(g), "gravity": 1}
    tops = kr.starts(kowalewski.BODY, n=20000, **words)
    K = kr.solve(tops, [0.0], want=["kowalewski"]).kowalewski[:, 0]
    values = [value for value, _ in kowalewski.critical_values(g, h)]
    assert values[0] <= K.min() < values[0] + 0.01 * values[-1]
    assert 0.98 * values[-1] < K.max() <= values[-1]


def test_swings_change_the_momentum_as_melnikov_predicts():
    amplitude = melnikov.melnikov_amplitude()
    for row in chaos.measure_layer(60):
        assert row["kick"] == pytest.approx(amplitude, rel=2.0 * row["e"] + 2e-5)
        assert 0.2 < row["half_width"] / row["predicted"] < 4.0


def test_exponents_and_frequencies_separate_order_from_chaos():
    regular, chaotic = (
        chaos_data.summarize_exponents(name, 12) for name in ("a Lagrange top", "40 %")
    )
    assert regular["chaotic"] == 0 and chaotic["chaotic"] > 6 and 0.1 < chaotic["exponent"] < 0.25
    _, turns, change = chaos_data.measure_rotation(16, "moments 2 % apart")
    assert (np.abs(turns) <= 0.5).all() and np.median(change) < 1e-6
    assert chaos_data.largest_frequency_error(4) < 1e-12


def test_a_late_state_is_measured_for_tops_on_a_torus():
    forms = {name: late_states.make_closed_form(load_problem(name)) for name in HORIZONS}
    assert [name for name in forms if forms[name]] == ["kowalewski", "goryachev_chaplygin"]
    assert late_states.measure_late_state(load_problem("kowalewski"), True)["error"] < 1e-13


def test_other_programs_fit_the_same_motion():
    times, scene = fits.TIMES[: fits.SHORT], fits.make_scene(1.0)
    velocities = compute_velocities(times, scene.body.mass * scene.gravity, read_parameters(scene))
    noise = fits.make_record(times) - velocities
    assert 0.8 * fits.NOISE < noise.std() < 1.2 * fits.NOISE
