"""Tests of the reference solutions by independent recomputation."""

import math

import kreisel as kr
import mpmath as mp
import numpy as np
import pytest

from validation.benchmarks import agreement
from validation.competitors import single_runs
from validation.references import multiprecision, radau, reference
from validation.references.problems import (
    HORIZONS,
    SHORT,
    attitude_error,
    load_problem,
    problem_of_scene,
)

TIMES = [(name, t) for name, end in HORIZONS.items() for t in (SHORT, end)]


def numbers(texts):
    with mp.workdps(reference.DIGITS):
        return [mp.mpf(x) for x in texts]


def test_recomputed_references_equal_stored_ones():
    problem = load_problem("thesis")
    entry = reference.load_truth("thesis", SHORT)
    (state,) = reference.integrate_states(problem, [SHORT])
    assert reference.rotation_angle(state, numbers(entry["attitude"])) < 1e-31
    with mp.workdps(reference.DIGITS):
        assert (
            max(abs(a - b) for a, b in zip(state[4:], numbers(entry["body_momentum"]), strict=True))
            < 1e-30
        )


@pytest.mark.parametrize("name, t", TIMES)
def test_references_conserve_the_integrals_of_a_top(name, t):
    problem, entry = load_problem(name), reference.load_truth(name, t)
    state = numbers(entry["attitude"] + entry["body_momentum"])
    with mp.workdps(reference.DIGITS):
        w, x, y, z = state[:4]
        up = [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]
        assert abs(sum(c * c for c in state[:4]) - 1) < 1e-32, "unit quaternion"
        assert (
            abs(
                sum(m * u for m, u in zip(state[4:], up, strict=True)) - mp.mpf(problem.momentum[2])
            )
            < 1e-30
        ), "<m, e3>"
    assert reference.energy_error(problem, state) < 1e-31
    assert 0 < entry["agreement"] < 1e-28
    assert 1e-15 < entry["conditioning"] < 1e-10


@pytest.fixture(scope="module")
def exactly():
    return multiprecision.MultiprecisionIntegrator()


def test_references_of_60_digits_agree_with_all_others(exactly):
    for name in HORIZONS:
        (attitude,) = exactly(load_problem(name).to_scene(), [SHORT])
        entry = reference.load_truth(name, SHORT)
        angle = reference.rotation_angle(numbers(map(str, attitude)), numbers(entry["attitude"]))
        assert angle < 1e-31, name
    described_anyhow = kr.scenes.kowalewski.replace(
        body=kr.scenes.kowalewski.body.turn((0.1, 0.7, -0.5, 0.5)), gravity=9.81
    )
    path = kr.solve(described_anyhow, [-1.0, -2.0], digits=30)
    truth = exactly(described_anyhow, path.t)
    assert (
        0.0
        < multiprecision.rotation_angles(multiprecision.path_attitudes(path), truth).max()
        < 3e-31
    )


@pytest.fixture(scope="module")
def exact_attitudes(exactly):
    """Return a scene, times and the attitudes at these times with 60 digits."""
    scene, times = kr.scenes.asymmetric, [2.0, 5.0, 10.0]
    return scene, times, exactly(scene, times)


@pytest.mark.parametrize(
    "method, options",
    [
        ("auto", {}),
        ("strang", {"step": 0.01}),
        ("kahan_li8", {"step": 0.02}),
        ("extrap", {"tol": 1e-7}),
        ("geometric", {"error": 1e-6}),
        ("taylor", {}),
        ("taylor", {"digits": 20}),
        ("taylor", {"digits": 30}),
    ],
)
def test_error_estimates_of_paths_are_near_the_true_error(method, options, exact_attitudes):
    scene, times, truth = exact_attitudes
    path = kr.solve(scene, times, method, **options)
    error = multiprecision.rotation_angles(multiprecision.path_attitudes(path), truth).max()
    most = 10 if path.digits == 30 else 3  # for 30 digits, the estimate is a bound
    assert error / 3 < path.error < most * error
    assert error <= options.get("error", math.inf)


@pytest.mark.parametrize("name", HORIZONS)
def test_all_computations_agree_within_the_conditioning(name):
    entry = reference.load_truth(name, SHORT)
    angles = dict(reference.compare_computations(load_problem(name), SHORT, entry))
    assert angles.pop("heyoka, 128 bit, momentum") < 1e-28
    assert angles.pop("heyoka, 128 bit, spin apart", 0.0) < 1e-28
    assert angles.pop("heyoka, 80 bit") < entry["conditioning"] / 10
    for way, angle in angles.items():
        assert angle < 10 * entry["conditioning"], way


def test_the_conditioning_agrees_with_a_perturbed_scene():
    problem, size = load_problem("asymmetric"), 1e-8
    neighbour = kr.Scene(
        problem.to_scene().body,
        [m * (1 + size) for m in problem.momentum],
        problem.attitude,
        gravity=1,
    )
    ends = [
        kr.solve(scene, 30.0, method="extrap", tol=1e-13).q[-1]
        for scene in (problem.to_scene(), neighbour)
    ]
    expected = reference.load_truth("asymmetric", 30.0)["conditioning"] * size / reference.ROUNDING
    assert 0.01 * expected < attitude_error(*ends) < expected, (
        "the momentum is only part of the data"
    )


def test_computed_references_do_not_depend_on_units_or_frame():
    scene = kr.scenes.thesis
    truth = reference.compute_truth(problem_of_scene("here", scene), SHORT)
    assert (
        attitude_error(truth["attitude"], reference.load_truth("thesis", SHORT)["attitude"]) < 1e-18
    )
    other = kr.Scene(
        kr.Body(
            2.0**-60,
            [x * 2.0**-100 for x in scene.body.inertia],
            [z * 2.0**-20 for z in scene.body.com],
            unphysical=True,
        ),
        [m * 2.0**-90 for m in scene.momentum],
        gravity=1.0,
    )
    with_rate = reference.compute_truth(problem_of_scene("far", other), SHORT * 2.0**-10)
    assert attitude_error(truth["attitude"], with_rate["attitude"]) < 1e-18


@pytest.mark.parametrize("name, t", TIMES)
def test_heyoka_in_double_agrees_with_the_reference(name, t):
    entry = reference.load_truth(name, t)
    run = single_runs.HeyokaRun(load_problem(name), t, single_runs.Setting(tol=single_runs.EPS))
    assert attitude_error(run.solve(), entry["attitude"]) < 100 * entry["conditioning"]


@pytest.mark.parametrize("name", HORIZONS)
def test_extrap_agrees_with_the_reference(name):
    problem = load_problem(name)
    path = kr.solve(problem.to_scene(), t=SHORT, method="extrap", tol=1e-12)
    assert attitude_error(path.q[-1], reference.load_truth(name, SHORT)["attitude"]) < 1e-8


@pytest.mark.parametrize("name", HORIZONS)
def test_energies_agree_with_kreisel(name):
    problem = load_problem(name)
    path = kr.solve(problem.to_scene(), t=[0, 1, 2, 3])
    kinetic, potential = problem.energies(path.q, path.m)
    assert (kinetic + potential).astype(float) == pytest.approx(path.energy, rel=1e-14)
    assert problem.energy_error(path.q, path.m) < 1e-8


@pytest.mark.parametrize("damping", [(0.0, 0.0, 0.0), (0.2, 0.5, 1.0), (10.0, 30.0, 0.0)])
def test_collocation_agrees_with_heyoka_in_128_bits(damping):
    body = kr.Body(1, (1, 1.2, 1.7), (0.1, 0.2, 1), unphysical=True)
    top = kr.Scene(
        body, momentum=(0.3, 0.4, 1.0), attitude=(0.8, 0.6, 0, 0), damping=damping, gravity=1
    )
    problem = problem_of_scene("damped", top)
    (q,), (m,) = radau.integrate(problem, [5.0])
    (truth,) = reference.integrate_states(problem, [5.0])
    assert attitude_error(q, [np.longdouble(mp.nstr(x, 22)) for x in truth[:4]]) < 1e-17
    assert max(abs(float(x) - float(y)) for x, y in zip(m, truth[4:], strict=True)) < 1e-15


def test_collocation_resolves_decay_at_any_rate():
    free = kr.Scene(kr.Body(1, (1, 1, 1), (0, 0, 0)), velocity=(0, 0, 3), damping=1e9)
    q, m = radau.integrate(problem_of_scene("free", free), [1e-9, 1.0])
    assert m[0, 2] == pytest.approx(3 / math.e, rel=1e-15) and abs(m[1, 2]) < 1e-15
    assert 2 * math.atan2(q[1, 3], q[1, 0]) == pytest.approx(3e-9, rel=1e-14)


def test_attitude_error_is_an_angle_to_the_last_digit():
    for angle in (1e-15, 1e-9, 1e-3, 3.0):
        q = [mp.cos(angle / 2), 0, mp.sin(angle / 2), 0]
        assert attitude_error(list(map(float, q)), [1, 0, 0, 0]) == pytest.approx(angle, rel=1e-14)
    assert attitude_error([-1, 0, 0, 0], [1, 0, 0, 0]) == 0


def test_every_function_agrees_with_20_digits_on_random_tops(capsys):
    assert agreement.main(["--tops", "120", "--seed", "8"]) == 0
    assert capsys.readouterr().out.endswith("\n0 disagreements\n")
