"""Tests of the Taylor method and its error estimates."""

from fractions import Fraction

import kreisel as kr
import numpy as np
import pytest
from tops import GENERAL


def angle(a, b):
    """Return the angle between the final attitudes of two paths, using rational arithmetic."""
    p, q = (
        [
            Fraction(float(x)) + Fraction(float(y))
            for x, y in zip(path.q[-1], path.q_low[-1], strict=True)
        ]
        for path in (a, b)
    )
    vec = [
        p[0] * q[i] - p[i] * q[0] - p[j] * q[k] + p[k] * q[j]
        for i, j, k in ((1, 2, 3), (2, 3, 1), (3, 1, 2))
    ]
    return 2 * float(sum(x * x for x in vec)) ** 0.5


def test_runs_are_accurate_to_the_requested_digits():
    plain, twenty, thirty = (kr.solve(GENERAL, 10, digits=digits) for digits in (16, 20, 30))
    assert 1e-17 < angle(plain, thirty) < 1e-13
    assert 1e-23 < angle(twenty, thirty) < 1e-18
    assert not plain.q_low.any() and not plain.m_low.any()
    assert plain.q_low.shape == (2, 4) and plain.m_low.shape == (2, 3)
    norm = sum(
        (Fraction(x) + Fraction(y)) ** 2
        for x, y in zip(thirty.q[-1].tolist(), thirty.q_low[-1].tolist(), strict=True)
    )
    assert abs(float(norm - 1)) < 1e-30
    assert abs(thirty.m[-1, 2] - 1.46 + thirty.m_low[-1, 2]) < 1e-28
    assert thirty.digits == 30 and thirty.tol is None and "digits=30" in repr(thirty)
    with pytest.raises(ValueError, match="read-only"):
        thirty.q_low[0, 0] = 1


@pytest.mark.parametrize(
    "digits, expected", [(1, 16), (16, 16), (17, 20), (20, 20), (21, 30), (30, 30)]
)
def test_digits_are_rounded_up(digits, expected):
    path, same = kr.solve(GENERAL, 2, digits=digits), kr.solve(GENERAL, 2, digits=expected)
    assert path.digits == expected
    assert np.array_equal(path.states, same.states) and np.array_equal(path.q_low, same.q_low)


def test_sixteen_digits_are_the_default():
    assert np.array_equal(kr.solve(GENERAL, 5).states, kr.solve(GENERAL, 5, digits=16).states)


@pytest.mark.parametrize(
    "options, error, message",
    [
        ({"digits": 31}, ValueError, "digits must be at most 30, not 31"),
        ({"digits": 0}, ValueError, "digits must be at least 1"),
        ({"digits": 20.0}, TypeError, "digits must be a whole number, not 20.0"),
        ({"digits": 20, "tol": 1e-9}, ValueError, "give either digits or tol, not both"),
        (
            {"digits": 20, "method": "extrap"},
            ValueError,
            "'extrap' has a fixed precision: digits need method='taylor'",
        ),
    ],
)
def test_invalid_digits_are_refused(options, error, message):
    with pytest.raises(error, match=message):
        kr.solve(GENERAL, 1, **options)


@pytest.mark.parametrize(
    "options, low, high",
    [
        ({}, 1e-16, 1e-13),
        ({"tol": 1e-6}, 1e-8, 1e-4),
        ({"digits": 20}, 1e-22, 1e-18),
        ({"digits": 30}, 1e-33, 1e-28),
        ({"method": "strang", "step": 0.01}, 1e-7, 1e-2),
    ],
)
def test_a_path_estimates_its_error(options, low, high):
    path = kr.solve(GENERAL, [1, 5, 10], **options)
    assert low < path.error < high
    if path.digits != 30:
        truth = kr.solve(GENERAL, [1, 5, 10], digits=30)
        assert path.error == pytest.approx(angle(path, truth), rel=1e-3)


def test_paths_of_zero_duration_have_no_error():
    assert kr.solve(GENERAL, []).error == 0.0
    assert kr.solve(GENERAL, [0.0]).error < 1e-15


def test_dense_output_needs_no_extra_steps():
    many, one = kr.solve(GENERAL, np.linspace(0, 10, 5001)), kr.solve(GENERAL, 10)
    assert many.stats == one.stats and many.stats.steps < 30
    assert np.array_equal(many.states[-1], one.states[-1])
    assert np.ptp(many.energy) < 1e-14 * many.kinetic.max()


def test_integration_backward_returns_to_the_start():
    for digits, bound in ((16, 1e-12), (20, 1e-12)):
        path = kr.solve(GENERAL, 8, digits=digits)
        back = kr.solve(path.end, -8, digits=digits)
        assert kr.attitude_error(back.q[-1], GENERAL.attitude) < bound


def test_compare_uses_twenty_digits_for_the_reference():
    true = kr.solve(GENERAL, 10, digits=30)
    table = kr.compare(GENERAL, 10, ["taylor"], tols=[1e-6, 1e-12], repeats=1)
    for row, bound in zip(table, (1e-6, 2e-13), strict=True):
        error = kr.attitude_error(kr.solve(GENERAL, 10, "taylor", tol=row.tol).q, true.q).max()
        assert row.attitude_error == pytest.approx(error, rel=1e-3, abs=0.0) and 0.0 < error < bound
    [row] = kr.compare(GENERAL, 10, ["taylor"], repeats=1)  # a reference of 16 digits has no error
    error = kr.attitude_error(kr.solve(GENERAL, 10, "taylor").q, true.q).max()
    assert row.attitude_error == pytest.approx(error, rel=1e-3, abs=0.0) and 0.0 < error < 1e-14


def test_max_steps_keeps_the_low_words():
    with pytest.raises(kr.Error) as failure:
        kr.solve(GENERAL, [1, 2, 50], digits=30, max_steps=5)
    path = failure.value.path
    assert len(path) == len(path.q_low) >= 2 and path.q_low[-1].any()


def test_auto_with_digits_chooses_a_method_that_supports_them():
    path = kr.solve(kr.scenes.thesis, 2, digits=30)
    assert path.method == "taylor" and path.q_low.any()


def test_the_error_of_fifty_tops_is_estimated_within_a_factor_of_three():
    random, errors = np.random.default_rng(5), []
    for i in range(50):
        half, pivot, attitude = (
            random.uniform(0.5, 1.5, 3),
            random.uniform(-1.5, 1.5, 3),
            random.normal(size=4),
        )
        if i % 3 == 0:
            # a Lagrange top, whose closed form provides the estimate of a large error
            half[1], pivot[:2] = half[0], 0.0
        scene = kr.Scene(
            kr.Body.cuboid(half=half, pivot=pivot),
            momentum=random.normal(scale=5, size=3),
            attitude=attitude / np.linalg.norm(attitude),
            gravity=1,
        )
        path = kr.solve(
            scene,
            5,
            method="taylor",
            **({"tol": 10.0 ** -random.integers(4, 12)} if i % 5 else {"digits": 16}),
        )
        true = angle(path, kr.solve(scene, 5, method="taylor", digits=30))
        assert 1e-17 < true < 1e-2 and true / 3 < path.error < true * 3, (i, true, path.error)
        errors.append(true)
    assert min(errors) < 1e-13 and max(errors) > 1e-6
