"""Tests of step sizes near and beyond the limit of each method."""

import re

import kreisel as kr
import numpy as np
import pytest

STEPS = 10


def random_bodies(number, kinds, seed):
    """Yield `number` random scenes, each with a step size."""
    rng = np.random.default_rng(seed)
    for _ in range(number):
        half = np.exp(rng.normal(0.0, 0.3, 3))
        kind = rng.choice(kinds)
        half[1] = half[0] if kind == "lagrange" else half[1]
        half[:2] = (3**0.5 * 2 * half[2], 2 * half[2]) if kind == "kowalewski" else half[:2]
        pivot = half * (rng.uniform(-1, 1, 3) if kind == "asymmetric" else (0, 0, -1))
        body = kr.Body.cuboid(half=tuple(half), pivot=tuple(pivot))
        q = rng.normal(size=4)
        momentum = rng.normal(size=3) * max(body.moments) * np.exp(rng.normal(0.0, 0.7))
        yield (
            kr.Scene(body, momentum=momentum, attitude=q / np.linalg.norm(q), gravity=1),
            float(np.exp(rng.uniform(-2.5, 1.0))),
        )


def lever(scene):
    return scene.body.mass * abs(scene.gravity) * np.linalg.norm(scene.body.com)


def error(scene, method, step):
    """Return the largest attitude error [rad] in ten steps, or None if the step is rejected."""
    try:
        path = kr.solve(scene, STEPS * step, method=method, step=step, every=1)
    except ValueError as refusal:
        smaller = re.search(r"where (\S+) would suffice", str(refusal))
        kr.solve(scene, STEPS * step, method=method, step=float(smaller[1]))
        return None
    return kr.attitude_error(path.q, kr.solve(scene, path.t, tol=1e-12, method="taylor").q).max()


def test_bobenko_suris4_refuses_steps_beyond_its_series():
    """Check that a step h is refused if h^2 * 2 |E| or h^2 times the largest torque exceeds 1.

    The modified energy E excludes the spin energy and differs from the energy by a few per cent. In
    this test, E and the torque are divided by the transverse moment of inertia I1.
    """
    count = 0
    for scene, step in random_bodies(100, ["lagrange"], 1):
        i1, i3 = scene.body.moments[0], scene.body.moments[2]
        start = kr.solve(scene, [0.0])
        energy = start.energy[0] / i1 - 0.5 * (1 / i3 - 1 / i1) * start.axial_momentum[0] ** 2 / i1
        torque, size = step**2 * lever(scene) / i1, step**2 * 2 * abs(energy)
        attitude_error = error(scene, "bobenko_suris4", step)
        if attitude_error is None:
            assert max(torque, size) > 0.8
        else:
            assert max(torque, size) < 1.3 and attitude_error < 0.3
        count += attitude_error is not None
    assert 25 < count < 75


@pytest.mark.parametrize(
    "method, kinds, most",
    [
        ("takahashi_imada4", ["kowalewski", "asymmetric"], 2.5),
        ("veselov4", ["lagrange", "kowalewski", "asymmetric"], 1.25),
    ],
)
def test_modified_kicks_and_rotations_have_a_largest_step(method, kinds, most):
    """Check that excessively large step sizes are rejected.

    A step size h is rejected if h^2 times the largest torque exceeds twice the smallest moment of
    inertia. A step size is also rejected if the body might turn by more than `most` radians per
    step.
    """
    count = 0
    for scene, step in random_bodies(100, kinds, 2):
        least, energy = min(scene.body.moments), kr.solve(scene, [0.0]).energy[0]
        turn = step * np.sqrt(2 * (energy + lever(scene)) / least)
        heavy = step**2 * lever(scene) / least
        attitude_error = error(scene, method, step)
        assert (attitude_error is None) == (turn > most or heavy > 2), (turn, heavy, attitude_error)
        assert attitude_error is None or attitude_error < 1.0, (turn, heavy)
        count += attitude_error is not None
    assert 25 < count < 90


def test_takahashi_imada4_allows_large_steps_of_a_fast_lagrange_top():
    """Check that a splitting method with exact free rotation stays accurate at large steps."""
    scene = kr.scenes.thesis.replace(momentum=(20.0, -40.0, 400.0))
    assert error(scene, "takahashi_imada4", 0.1) < 1e-3
    assert error(scene, "takahashi_imada4", 0.5) < 0.2
    with pytest.raises(ValueError, match="step is too large"):
        kr.solve(kr.scenes.thesis, 100, method="takahashi_imada4", step=20.0)


@pytest.mark.parametrize("method", ["strang", "suzuki4", "kahan_li8"])
def test_steps_of_many_turns_stay_finite(method):
    """Check that attitudes remain normalized even if the results are inaccurate."""
    for scene, step in random_bodies(30, ["asymmetric"], 3):
        path = kr.solve(scene, 3000 * step, method=method, step=10 * step, every=1)
        assert np.abs(np.linalg.norm(path.q, axis=1) - 1).max() < 1e-14
