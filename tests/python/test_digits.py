"""Tests of 20-digit and 30-digit arithmetic against solutions that are elementary functions.

If the solution is an elementary function of time, the last Taylor terms are a poor estimate of the
truncation error.
"""

import kreisel as kr
import mpmath as mp
import numpy as np
import pytest
from kreisel._options import solve_options
from tops import unit

from validation.references.quadrature import product

TOP = kr.scenes.asymmetric

TIMES = (1.5, 8.0)


def exact(numbers):
    return [mp.mpf(float(x)) for x in numbers]


def rotation_quaternion(vector, angle):
    """Return the quaternion of a rotation by `angle` * |vector| about `vector`."""
    size = mp.sqrt(sum(x * x for x in vector))
    sine = mp.sin(size * angle / 2) / size if size else mp.mpf(0)
    return [mp.cos(size * angle / 2), *(x * sine for x in vector)]


def free_symmetric(scene, t):
    """Return the attitude of a free symmetric body from its closed-form solution."""
    attitude, axes, m = exact(scene.attitude), exact(scene.body.axes), exact(scene.momentum)
    both = product(attitude, axes)
    norm = mp.sqrt(sum(x * x for x in both))
    q = [x / norm for x in both]
    one, _, lone = exact(scene.body.moments)
    axis = product(product(q, [0, 0, 0, 1]), [q[0], -q[1], -q[2], -q[3]])[1:]
    axial = sum(x * y for x, y in zip(m, axis, strict=True))
    spin = [mp.mpf(0), mp.mpf(0), axial * (1 / lone - 1 / one)]
    principal = product(
        product(rotation_quaternion([x / one for x in m], t), q), rotation_quaternion(spin, t)
    )
    result = product(principal, [axes[0], *(-x for x in axes[1:])])
    norm = mp.sqrt(sum(x * x for x in axes))
    return [x / norm for x in result]


def largest_attitude_error(path):
    """Return the largest angle [rad] between the attitudes of a path and the exact solution."""
    worst = mp.mpf(0)
    for t, high, low in zip(path.t, path.q, path.q_low, strict=True):
        q = [a + b for a, b in zip(exact(high), exact(low), strict=True)]
        w, x, y, z = free_symmetric(path.scene, mp.mpf(float(t)))
        vector = product([w, -x, -y, -z], q)[1:]
        worst = max(worst, 2 * mp.sqrt(sum(x * x for x in vector)))
    return float(worst)


def free_tops():
    random = np.random.default_rng(2)
    yield kr.Scene(
        kr.Body(1.0, (1, 1, 0.25), (0, 0, 1), unphysical=True),
        momentum=(0, 0, 1),
        attitude=(0.8, 0.6, 0, 0),
        gravity=0,
    )
    for upright in (True, False) * 6:
        yield kr.Scene(
            kr.Body(1.0, (1, 1, random.uniform(0.2, 1.8)), (0, 0, 1), unphysical=True),
            momentum=random.normal(size=3) * ((0, 0, 1) if upright else (1, 1, 1)),
            attitude=unit(random.normal(size=4)),
            gravity=0,
        )


@pytest.mark.parametrize("digits, bound", [(20, 1e-19), (30, 1e-29)])
@pytest.mark.parametrize("end", [1.0, -1.0])
def test_a_sum_of_few_exponentials_is_accurate_to_all_digits(digits, bound, end):
    with mp.workdps(60):
        for scene in free_tops():
            path = kr.solve(scene, [end * t for t in TIMES], "taylor", digits=digits)
            assert largest_attitude_error(path) < bound, scene


def test_a_steady_precession_is_accurate_to_all_digits():
    scene = kr.scenes.steady_precession
    paths = [kr.solve(scene, 20, "taylor", digits=digits) for digits in (20, 30)]
    low, high = ((path.m[-1, 2] - scene.momentum[2]) + path.m_low[-1, 2] for path in paths)
    assert abs(low) < 1e-18 and abs(high) < 1e-28
    assert paths[0].error < 1e-18


def draw_thin_bodies(lone, has_rotation):
    """Yield random free bodies with one small moment of inertia."""
    random = np.random.default_rng(5)
    for _ in range(8):
        body = kr.Body(1.0, (1, 1, lone), (0, 0, 1), unphysical=True)
        if has_rotation:
            body = body.turn(unit(random.normal(size=4)))
        push = kr.quaternion.turn(body.axes, tuple(random.normal(size=3) * (1, 1, lone)))
        yield kr.Scene(body, body_momentum=push, attitude=unit(random.normal(size=4)), gravity=0)


@pytest.mark.parametrize("has_rotation", [False, True])
@pytest.mark.parametrize("lone", [1e-2, 1e-5, 1e-7])
def test_thin_bodies_are_accurate_to_30_digits_with_right_error_estimates(lone, has_rotation):
    """Check the error estimates of 30-digit solutions for thin bodies.

    A small moment of inertia amplifies rounding errors of the momentum.
    """
    ratios = []
    with mp.workdps(60):
        for end, scene in zip((8.0, -8.0) * 4, draw_thin_bodies(lone, has_rotation), strict=True):
            path = kr.solve(scene, [end], "taylor", digits=30)
            true = largest_attitude_error(path)
            assert true < 3e-30
            ratios.append(path.error / true)
    assert min(ratios) > 1 and np.median(ratios) < 10 and max(ratios) < 60


def test_the_error_estimate_of_30_digits_is_not_below_the_true_error():
    with mp.workdps(60):
        paths = [kr.solve(scene, list(TIMES), "taylor", digits=30) for scene in free_tops()]
        ratios = sorted(path.error / largest_attitude_error(path) for path in paths)
    assert ratios[0] > 1 and ratios[-1] < 60
    assert ratios[len(ratios) // 2] < 10
    # The attitude error of the asymmetric top is proved (interval arithmetic with 144 bits).
    assert 1.97e-24 < kr.solve(kr.scenes.asymmetric, [100.0], "taylor", digits=30).error < 2e-23


def test_the_error_of_thirty_digits_is_at_most_pi():
    free = kr.Scene(
        kr.Body(1.0, (1.0, 1.5, 2.0), (0.0, 0.0, 0.0)), body_momentum=(1e-200, 1, 0), gravity=0.0
    )
    path = kr.solve(free, np.linspace(0.0, 1900.0, 20), digits=30)
    assert path.error == np.pi
    short_path = kr.solve(free, [20.0], digits=30)
    assert short_path.error < 1e-20


# Boundary values


def test_digits_are_rounded_up_to_a_supported_number():
    taylor = kr.methods["taylor"]
    expected = {1: 16, 16: 16, 17: 20, 20: 20, 21: 30, 30: 30}
    assert {n: solve_options.validate_digits(taylor, n, None) for n in expected} == expected
    assert [
        solve_options.validate_solve_options(TOP, "taylor", digits=n).has_extended_precision
        for n in (16, 17)
    ] == [False, True]
    for wrong, message in ((31, "at most 30, not 31"), (0, "digits must be")):
        with pytest.raises(ValueError, match=message):
            solve_options.validate_digits(taylor, wrong, None)
