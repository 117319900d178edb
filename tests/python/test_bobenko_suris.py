"""Tests of the Bobenko-Suris maps."""

import kreisel as kr
import numpy as np
import pytest
from tilted_tops import BODIES, TILT
from tilted_tops import tilt_scene as scene


def find_modified_energy(method, path, step):
    """Return the quantity that a map conserves in place of the energy."""
    if method == "bobenko_suris":
        return path.modified_energy(step)
    if method == "bobenko_suris4":
        return path.modified_energy4(step)
    square = (path.torque**2).sum(axis=1)
    return path.energy - step**2 * square / (8 * path.scene.body.moments[0])


@pytest.mark.parametrize("gravity", [1.0, -3.0])
@pytest.mark.parametrize(
    "method, step, limit, change",
    [
        ("bobenko_suris", 0.1, 1e-11, 1e-3),
        ("bobenko_suris", 0.5, 1e-11, 1e-3),
        ("bobenko_suris2", 0.1, 1e-11, 1e-5),
        ("bobenko_suris2", 0.5, 1e-11, 1e-5),
        ("bobenko_suris4", 0.05, 3e-12, 1e-7),
        ("bobenko_suris4", 0.2, 3e-12, 1e-7),
    ],
)
def test_the_integrals_are_conserved_over_many_steps(method, step, limit, change, gravity):
    top = scene("lagrange", gravity=gravity)
    path = kr.solve(top, 3e5 * step, method=method, step=step, every=300)
    assert np.ptp(path.vertical_momentum) == 0 and np.ptp(path.axial_momentum) < limit
    size = np.abs(path.kinetic + path.potential).max()
    assert np.ptp(find_modified_energy(method, path, step)) < limit * size
    assert np.ptp(path.energy) > change * np.abs(path.energy).max()


def test_the_energy_of_bobenko_suris4_has_no_trend():
    """Check that the energy has no statistically significant drift."""
    top = kr.scenes.thesis.replace(attitude=TILT)
    path = kr.solve(top, 3e5, method="bobenko_suris4", step=0.1, every=97)
    values = path.modified_energy4(0.1)
    assert np.ptp(values) <= 1e-12 * np.abs(values).max()
    means = [part.mean() for part in np.array_split(path.energy - path.energy[0], 100)]
    (slope, _), covariance = np.polyfit(np.arange(100), means, 1, cov=True)
    assert abs(slope) <= 3.0 * covariance[0, 0] ** 0.5


@pytest.mark.parametrize("step, times", [(1 / 5, 140), (1 / 20, 2500), (1 / 160, 1e5)])
def test_bobenko_suris4_is_more_accurate_than_bobenko_suris(step, times):
    top = kr.scenes.thesis
    t = np.linspace(90, 100, 11)
    truth = kr.solve(top, t, method="exact").q
    one, four = (
        kr.attitude_error(kr.solve(top, t, method=name, step=step).q, truth).max()
        for name in ("bobenko_suris", "bobenko_suris4")
    )
    assert one > times * four


def test_bobenko_suris4_refuses_large_steps():
    top = scene("lagrange", momentum=(8.0, 0.0, 0.0))  # |m| / I1 is about 1
    kr.solve(top, 10, method="bobenko_suris4", step=0.6)
    with pytest.raises(ValueError, match="step is too large"):
        kr.solve(top, 10, method="bobenko_suris4", step=1.2)
    assert np.isnan(kr.solve(top, [0.0]).modified_energy4(1.2)).all()


def test_the_maps_are_conjugate():
    """Check that the two Bobenko-Suris maps differ only by a shift of the momentum."""
    top, h = scene("lagrange"), 0.1
    start = kr.solve(top, [0.0])
    early = top.replace(momentum=start.m[0] - 0.5 * h * start.torque[0])
    one = kr.solve(early, 100 * h, method="bobenko_suris", step=h, every=1)
    two = kr.solve(top, 100 * h, method="bobenko_suris2", step=h, every=1)
    assert np.abs(one.apex - two.apex).max() < 1e-12
    assert np.abs(one.m + 0.5 * h * one.torque - two.m).max() < 1e-12


def test_spin_is_exact_for_fast_tops():
    """Check the rotation angle of a fast top, for which the Cayley map alone is inaccurate."""
    top = kr.Scene(BODIES["lagrange"], momentum=(0.0, 0.0, 80.0), gravity=1)
    path = kr.solve(top, 10, method="bobenko_suris", step=0.1)
    angle = 80.0 / BODIES["lagrange"].moments[2] * 10 / 2
    assert kr.attitude_error(path.q[-1], (np.cos(angle), 0, 0, np.sin(angle))) < 1e-12
