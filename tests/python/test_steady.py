"""Tests of steady rotations: they are steady, and their exponents and stability are right."""

import math

import kreisel as kr
import numpy as np
import pytest
from tops import TILT

GENERAL = kr.Body(1.2, (0.9, 1.3, 1.1), (0.3, -0.5, 0.4), unphysical=True)
BODIES = {
    "general": GENERAL,
    "turned": GENERAL.turn(TILT),
    "plane of symmetry": kr.Body(1.2, (0.9, 1.3, 1.1), (0.3, 0, 0.4), unphysical=True),
    "axis": kr.Body(1.2, (0.9, 1.3, 1.1), (0, 0, 0.6), unphysical=True),
    "kowalewski": kr.Body(1, (2, 2, 1), (0.5, 0, 0), unphysical=True),
    "spherical": kr.Body(1, (1, 1, 1), (0.3, -0.2, 0.5), unphysical=True),
    "gyrostat": kr.Body(
        1.2, (0.9, 1.3, 1.1), (0.3, -0.5, 0.4), rotor=(0.4, 0.2, -0.7), unphysical=True
    ),
    "with wheels": kr.Scene(
        GENERAL.with_wheel(inertia=0.1, axis=(1, 2, 2), rate=20.0), momentum=(1, 2, 3), gravity=2.0
    ).body,
    "free": kr.Body(1, (0.9, 1.3, 1.1), (0, 0, 0)),
    "free gyrostat": kr.Body(1, (0.9, 1.3, 1.1), (0, 0, 0), rotor=(0.4, 0.2, -0.7)),
}
RATES = [0.0, 0.7, -2.5, 6.0]


@pytest.mark.parametrize("name", BODIES)
def test_the_rotations_are_steady_and_deviate_by_their_exponents(name):
    body = BODIES[name]
    found = kr.steady(body, RATES, gravity=2.0)
    assert {*np.abs(RATES)} == {*np.round(found.rate, 9)}
    for i, scene in enumerate(found.scene):
        turn = 2 * math.pi / found.rate[i] if found.rate[i] else 1.0
        path = kr.solve(scene, [0.0, turn], digits=20, tangents="start")
        growth = math.exp(turn * found.exponents[i].real.max())
        change = path.body_velocity - found.rate[i] * found.axis[i]
        assert np.abs(change).max() < 1e-12 * growth
        for quantity in ("energy", "axial_momentum"):
            own, expected = (getattr(x, quantity) for x in (found, path))
            np.testing.assert_allclose(own[i], expected[0], rtol=1e-14, atol=1e-14)
        if found.rate[i] and "free" not in name:  # after a turn the top is where it was
            factors = np.linalg.eigvals(path.tangents[1])
            for exponent in found.exponents[i]:
                least = np.abs(factors - np.exp(exponent * turn)).min()
                assert least < 1e-6 * max(growth, 1.0)


def test_axes_of_heavy_bodies_lie_on_the_cone_of_staude():
    found = kr.steady(GENERAL, np.linspace(-9, 9, 60), gravity=2.0)
    crosses = np.cross(found.axis * GENERAL.moments, found.axis)
    assert np.abs(crosses @ GENERAL.com).max() < 1e-12
    assert {len(kr.steady(GENERAL, rate, gravity=2.0)) for rate in (0.0, 0.7, 60.0)} == {2, 6}


@pytest.mark.parametrize("i3", [0.6, 1.3])
def test_a_sleeping_top_is_stable_from_the_known_spin(i3):
    body = kr.Body.symmetric(1.1, 1.0, i3, 0.5)
    critical = math.sqrt(4 * 1.0 * 1.1 * 2.0 * 0.5) / i3
    for rate, stability in (0.99 * critical, "unstable"), (1.01 * critical, "stable"):
        found = kr.steady(body, rate, gravity=2.0)
        upright = found.axis[:, 2] > 1 - 1e-12
        assert found.stability[upright].tolist() == [stability]
        assert (found.stability[found.axis[:, 2] < -1 + 1e-12] == "stable").all()


def test_a_free_body_is_unstable_about_its_middle_axis_alone():
    found = kr.steady(BODIES["free"], 3.0)
    assert dict(zip(np.abs(found.axis).argmax(axis=1), found.stability, strict=True)) == {
        0: "stable", 1: "stable", 2: "unstable",
    }  # fmt: skip
    rates = 3.0 * np.sqrt((1.3 - 1.1) * (1.1 - 0.9) / (0.9 * 1.3))
    np.testing.assert_allclose(found.exponents[found.stability == "unstable"], [[-rates, rates]])


@pytest.mark.parametrize("moments", [(0.9, 1.0, 0.4), (1.0, 0.4, 0.9)])
def test_a_satellite_librates_with_the_known_frequencies(moments):
    body = kr.Body(1, moments, (0, 0, 0))
    found = kr.steady(body, turning=(0, 1, 0), gradient=3.0)
    assert len(found) == 24 and np.allclose(found.rate, 1.0)
    path = kr.solve(found.scene, [0.0, 1e-3])
    assert np.abs(path.velocity).max() < 1e-14 and np.ptp(path.apex, axis=1).max() < 1e-14
    normal, vertical = (np.abs(v) @ moments for v in (found.axis, path.body_vertical[:, 0]))
    is_proved = np.isclose(normal, 1.0) & np.isclose(
        vertical, 0.4
    )  # least moment up, largest across the orbit
    assert is_proved.sum() == 4 and (found.stability[is_proved] == "stable").all()
    assert (found.stability[~is_proved] != "stable").all()
    roll, yaw = (1.0 - 0.4) / 0.9, (1.0 - 0.9) / 0.4
    half = 0.5 * (1 + 3 * roll + roll * yaw)
    squares = half + np.sqrt(half**2 - 4 * roll * yaw) * np.array((1, -1))
    rates = np.sort(np.sqrt([3 * (0.9 - 0.4) / 1.0, *squares]))
    for exponents in found.exponents[is_proved]:
        np.testing.assert_allclose(np.sort(exponents.imag)[3:], rates, rtol=1e-12)


def test_the_diagram_shows_energies_over_momenta():
    found = kr.steady(GENERAL, RATES, gravity=2.0)
    lines = found.plot().get_lines()
    assert sum(len(line.get_xdata()) for line in lines) == len(found)
    assert {line.get_label() for line in lines} == {*found.stability}
    assert f"{len(found)} rotations, {(found.stability == 'stable').sum()} stable" in repr(found)
