"""Tests of the search for other spins that fit sparsely sampled measurements equally well."""

from dataclasses import replace

import kreisel as kr
import numpy as np
import pytest
from fit_sessions import make_record
from kreisel._fit import aliasing
from kreisel._fit.parameters import FreeParameters, expand_free_names

BODY = kr.Body(1.0, (1.0, 1.5, 1.25), com=(0.1, 0.2, 0.3), unphysical=True)
SYMMETRIC_BODY = kr.Body.symmetric(1.0, 1.0, 0.6, 0.4, unphysical=True)
TIMES = 2.0 * np.pi / 32.0 * np.arange(20)  # a turn between samples is 32 radians per unit of time


def list_aliases(rate, free="velocity", body=BODY, records=None):
    """Return the angular velocities of the aliases, and the factor that changes a moment."""
    scene = kr.Scene(body, body_velocity=rate, gravity=1)
    records = records or [make_record(TIMES), make_record(3.0 * TIMES)]
    parameters = FreeParameters(scene, expand_free_names(free), records)
    point = parameters.start
    found = []
    for alias in aliasing.list_spin_aliases_of_point(parameters, point, records):
        ratios = alias.moments / point.moments
        ratio = ratios[np.abs(ratios - 1.0).argmax()]
        found.append((*np.round(alias.rate, 9).tolist(), round(float(ratio), 9)))
    return sorted(set(found))


def assert_equal(found, expected):
    assert len(found) == len(expected) and np.allclose(found, expected, atol=1e-7)


@pytest.mark.parametrize(
    ("rate", "aliases"),
    [
        ((0.0, 0.0, 7.9), []),  # more than four samples per turn
        ((0.0, 0.0, 8.1), [-23.9]),
        ((0.0, 0.0, -8.1), [23.9]),
        ((0.0, 0.0, 15.9), [-16.1]),
        ((0.0, 0.0, 16.1), [-15.9, 48.1]),
        ((0.0, 0.0, -16.1), [-48.1, 15.9]),
        ((0.0, 0.0, 40.0), [8.0, 72.0]),
        ((0.0, 0.0, 32.0), [0.0, 64.0]),
    ],
)
def test_aliases_differ_by_a_turn_between_samples(rate, aliases):
    expected = [(0.0, 0.0, alias, 1.0) for alias in aliases]
    assert_equal(list_aliases(rate), expected)
    swapped = [(alias, 0.0, 0.0, 1.0) for alias in aliases]
    assert_equal(list_aliases(rate[::-1]), swapped)


def test_aliases_turn_about_the_axis_of_rotation_and_about_fast_principal_axes():
    rate = np.array((3.0, 0.0, 12.0))
    speed = np.sqrt(153.0)
    along = rate * (speed - 32.0) / speed
    expected = sorted([(*np.round(along, 9).tolist(), 1.0), (3.0, 0.0, -20.0, 1.0)])
    assert_equal(list_aliases(tuple(rate)), expected)
    slow = (5.0, 5.0, 5.0)  # fast only together
    along = np.array(slow) * (1.0 - 32.0 / np.sqrt(75.0))
    assert_equal(list_aliases(slow), [(*along.tolist(), 1.0)])


@pytest.mark.parametrize(
    ("free", "records", "is_ambiguous"),
    [
        ("velocity", None, True),
        ("attitude", None, False),
        ("velocity", [make_record([0.0])], False),
        ("velocity", [make_record([0.0]), make_record(TIMES)], True),
        ("velocity", [make_record(np.repeat(TIMES[:9], 2))], True),
        ("velocity", [make_record(TIMES), make_record(0.1 * TIMES)], False),
    ],
)
def test_aliases_need_a_free_velocity_and_sparse_times(free, records, is_ambiguous):
    assert bool(list_aliases((0.0, 0.0, 12.0), free, records=records)) == is_ambiguous


@pytest.mark.parametrize(
    ("rate", "body", "aliases"),
    [
        ((0.0, 0.0, 20.0), BODY, [(-12.0, 1.0), (52.0, 1.0)]),  # no body has such moments
        ((0.0, 0.0, 20.0), SYMMETRIC_BODY, [(-12.0, 1.0), (52.0, 1.0), (52.0, 20.0 / 52.0)]),
        ((0.0, 0.0, 32.0), BODY, [(0.0, 1.0), (64.0, 1.0), (64.0, 0.5)]),
        ((0.0, 0.0, 48.0), BODY, [(16.0, 1.0), (80.0, 1.0), (80.0, 0.6)]),  # no body has 3 I3
    ],
)
def test_aliases_with_free_moments_keep_the_momentum(rate, body, aliases):
    expected = sorted((0.0, 0.0, spin, round(ratio, 9)) for spin, ratio in aliases)
    assert_equal(list_aliases(rate, ("velocity", "moments"), body), expected)


@pytest.mark.parametrize(
    ("axis", "body", "factor", "ratio"),
    [
        ((0.0, 0.0, 1.0), BODY, 2.0, 2.0),  # the moments of a plate
        ((0.0, 0.0, 1.0), BODY, 2.01, None),
        ((0.0, -1.0, 0.0), BODY, 1.25, 1.25),
        ((0.6, 0.0, 0.8), BODY, 0.9, None),
        ((0.0, 0.0, 1.0), SYMMETRIC_BODY, 0.5, 0.5),
        ((1.0, 0.0, 0.0), SYMMETRIC_BODY, 0.9, None),  # the first two moments are equal
        ((0.0, 0.0, 1.0), BODY, 0.0, None),
        ((0.0, 0.0, 1.0), BODY, -0.5, None),
        ((0.0, 0.0, 1.0), BODY, np.inf, None),
    ],
)
def test_one_moment_is_scaled(axis, body, factor, ratio):
    scene = kr.Scene(body, (0, 0, 1), gravity=1)
    parameters = FreeParameters(scene, ("moments",), [])
    point = replace(parameters.start, rate=np.ones(3))
    found = aliasing._rescale_moment_for_same_momentum(parameters, point, np.array(axis), factor)
    assert len(found) == (ratio is not None)
    for one in found:
        expected = point.moments * np.where(np.abs(axis) == 1.0, ratio, 1.0)
        assert np.allclose(one.moments, expected, rtol=1e-12) and one.rate is point.rate
    fixed = FreeParameters(scene, ("velocity",), [])
    assert aliasing._rescale_moment_for_same_momentum(fixed, point, np.array(axis), factor) == []


def test_an_alias_is_described_by_its_speed():
    point = FreeParameters(kr.Scene(BODY, (0, 0, 1), gravity=1), ("velocity",), []).start
    one, other = (replace(point, rate=np.array(rate)) for rate in ((3.0, 0.0, 4.0), (0, 12.0, 5.0)))
    text = aliasing.describe_alternative_spin(one, other)
    assert "fewer than 4 samples per turn" in text and "velocity 13 instead of 5 fits" in text
