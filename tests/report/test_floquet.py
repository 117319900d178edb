"""Tests of tangents computed by Floquet's theorem."""

import kreisel as kr
import numpy as np
import pytest

from validation.references.floquet import floquet_tangents


def free(inertia, momentum=(0.3, 0.9, 1.2)):
    body = kr.Body(mass=1.0, inertia=inertia, com=(0.0, 0.0, 0.0))
    return kr.Scene(body, momentum=momentum, attitude=(0.8, 0.0, 0.6, 0.0), gravity=1)


def heavy(inertia, com, momentum=(0.3, 0.9, 1.2)):
    return kr.Scene(kr.Body(mass=1.0, inertia=inertia, com=com), momentum=momentum, gravity=1)


TOPS = {
    "thesis": kr.scenes.thesis,
    "cusps": kr.scenes.cusps,
    "sleeping": kr.scenes.sleeping,
    "steady": kr.scenes.steady_precession,
    "dzhanibekov": kr.scenes.dzhanibekov,
    "free": free((1.0, 1.6, 2.1)),
    "free_symmetric": free((1.0, 1.0, 1.6)),
    "free_about_an_axis": free((1.0, 1.6, 2.1), (0.0, 0.0, 1.2)),
    "free_oblique": free([[1.9, 0.2, 0.1], [0.2, 1.8, 0.15], [0.1, 0.15, 1.7]]),
    "spherical": heavy((1.5, 1.5, 1.5), (0.1, 0.2, 0.3)),
    "along_the_first_axis": heavy((1.5, 2.0, 2.0), (0.5, 0.0, 0.0)),
    "at_rest": heavy((2.0, 2.0, 1.0), (0.0, 0.0, 0.5), (0.0, 0.0, 0.0)),
}


@pytest.mark.parametrize("name", TOPS)
def test_tangents_agree_with_the_taylor_series(name):
    t = [0.0, 3.0, 60.0]
    tangents = floquet_tangents(TOPS[name], [60.0, 0.0, -20.0, 3.0])
    series = kr.solve(TOPS[name], t, digits=20, tangents="start").tangents
    back = kr.solve(TOPS[name], [-20.0], digits=20, tangents="start").tangents[0]
    pairs = [
        (tangents[0], series[2]),
        (tangents[1], series[0]),
        (tangents[2], back),
        (tangents[3], series[1]),
    ]
    for ours, theirs in pairs:
        assert np.abs(ours - theirs).max() <= 1e-12 * max(1.0, np.abs(theirs).max())


def test_tangents_are_accurate_at_late_times():
    for name in ("thesis", "cusps", "free", "steady", "sleeping"):
        tangents = floquet_tangents(TOPS[name], 2000.0)[0]
        series = kr.solve(TOPS[name], [2000.0], digits=30, tangents="start").tangents[0]
        assert np.abs(tangents - series).max() <= 4e-15 * np.abs(series).max()


def test_tangents_of_consecutive_intervals_multiply():
    for name in ("thesis", "free"):
        top = kr.exact(TOPS[name])
        first, product = floquet_tangents(top.scene, [5e5, 1e6])
        second = floquet_tangents(top([5e5]).end, [5e5])[0]
        both = second @ first
        assert np.abs(both - product).max() <= 1e-8 * np.abs(second).max() * np.abs(first).max()


def test_a_separatrix_has_no_period():
    body = kr.Body(mass=1.0, inertia=(1.0, 1.0, 0.5), com=(0.0, 0.0, 1.0), unphysical=True)
    falls = kr.Scene(body, attitude=(0.0, 1.0, 0.0, 0.0), momentum=(2.0, 0.0, 0.0), gravity=1)
    with pytest.raises(ValueError, match="lies on a separatrix"):
        floquet_tangents(falls, 1e4)
    with pytest.raises(ValueError, match="finite"):
        floquet_tangents(TOPS["thesis"], np.nan)


@pytest.mark.parametrize("tilt", [1e-13, 1e-14, 1e-15])
def test_a_top_that_leaves_the_vertical_at_once_has_no_period(tilt):
    body = kr.Body(mass=1.0, inertia=(1.0, 1.0, 0.5), com=(0.0, 0.0, 1.0), unphysical=True)
    leaves = kr.Scene(body, attitude=(1.0, tilt, 0.0, 0.0), momentum=(0.0, 0.0, 0.3), gravity=1)
    with pytest.raises(ValueError, match="lies on a separatrix"):
        floquet_tangents(leaves, 1e3)


@pytest.mark.parametrize("t", [1e5, -1e7])
def test_an_overflowing_tangent_is_refused(t):
    with pytest.raises(ValueError, match="a tangent has grown beyond what doubles hold"):
        floquet_tangents(TOPS["at_rest"], [1.0, t])


def test_a_free_body_at_rest_has_no_period():
    rest = kr.Scene(kr.scenes.dzhanibekov.body, momentum=(0.0, 0.0, 0.0))
    with np.errstate(invalid="ignore"), pytest.raises(ValueError, match=r"those of kreisel\.solve"):
        floquet_tangents(rest, [1.0])


def test_times_within_the_first_period_need_no_tangents_of_a_period():
    body = kr.Body(1.0, (1.2, 1.2, 1.1), (0.0, 0.0, 1.5), unphysical=True)
    slow = kr.Scene(body, momentum=(0.0, 0.0, -0.03), gravity=1)
    for t in (-0.43, 0.43, -3.0):
        path = kr.solve(slow, [t], digits=30, tangents="start")
        error = np.abs(floquet_tangents(slow, [t]) - path.tangents).max()
        assert error <= 1e-14 * np.abs(path.tangents).max()
    with pytest.raises(ValueError, match="grown beyond what doubles hold"):
        floquet_tangents(slow, [-1e4])
