"""Tests of conversions to the scaled units of Bobenko and Suris."""

import kreisel as kr
import numpy as np
import pytest

from validation.thesis.scaled_units import h_eps, scaled_units

THESIS = kr.scenes.thesis
CUBOID = THESIS.body


def test_scaled_units_of_the_cuboid_differ_from_the_thesis():
    """Check the corrected values of section 4.2.1 of the thesis (errata 4 and 5)."""
    n, t = 0.8, 1.0
    units = scaled_units(CUBOID)
    scaled = units.into(THESIS)
    assert scaled.body.moments == pytest.approx((1, 1, 2 * n * n / (n * n + 4 * t * t)), rel=1e-15)
    assert scaled.body.com == (0, 0, 1)
    assert scaled.body.mass * scaled.gravity == pytest.approx(
        3 * t * t / (n * n + 4 * t * t), rel=1e-15
    )


def test_scaled_units_do_not_change_times_and_attitudes():
    body = kr.Body.cuboid(half=(0.3, 0.3, 2.5), pivot=(0, 0, -2.5), density=3.0)
    scene = kr.Scene(body, momentum=(10, 3, 1), gravity=9.81)
    scaled = scaled_units(body).into(scene)
    one, other = (kr.solve(s, 2.0, method="strang", step=0.01) for s in (scene, scaled))
    assert kr.attitude_error(one.q[-1], other.q[-1]) < 1e-12


def test_h_eps_equals_the_formula_of_the_thesis():
    scaled = scaled_units(CUBOID).into(THESIS)
    step = 0.2
    path = kr.solve(scaled, 100, method="bobenko_suris", step=step, every=1)
    p = np.array((0, 0, scaled.body.mass * scaled.gravity))
    text = (path.m**2).sum(-1) / 2 + path.apex @ p + step / 2 * np.cross(path.apex, path.m) @ p
    assert h_eps(path, step) == pytest.approx(text, abs=1e-13)
    assert np.ptp(text) < 1e-13
    assert h_eps(kr.solve(THESIS, 1, method="rk4", step=0.1, every=1), step)[0] == pytest.approx(
        text[0], abs=1e-14
    )


def test_scaled_units_are_for_lagrange_tops():
    with pytest.raises(ValueError, match="for Lagrange tops, not for a body of kind 'kowalewski'"):
        scaled_units(kr.scenes.kowalewski.body)
