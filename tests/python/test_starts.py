"""Tests of starts by Euler's angles, steady precession, or energy and vertical momentum."""

import math
import re

import kreisel as kr
import numpy as np
import pytest
from tops import CORNER, TILT, matrix

TOP, THESIS = kr.scenes.asymmetric, kr.scenes.thesis
CONE = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1.5)
I1, _, I3 = CONE.moments
TORQUE = 1.5 * 9.81 * 1.5
ANGLES, RATES = (0.7, 1.1, -0.4), (0.3, -0.8, 5.0)
NAMES = ("precession_angle", "nutation", "spin_angle")
WATER = kr.Body(1, (0.345, 0.653, 1.0), (0, 0, 0), inertia_rtol=0.0021)


def get_angles(scene, t=0.0):
    path = kr.solve(scene, [t])
    return [float(getattr(path, name)[0]) for name in NAMES]


def get_precession(scene):
    """Return the initial precession rate."""
    path = kr.solve(scene, [0.0])
    velocity, apex = path.velocity[0], path.apex[0]
    across = velocity - (velocity @ apex) * apex
    return float(np.cross(apex, [0, 0, 1]) @ np.cross(apex, across)) / (1 - apex[2] ** 2)


def make_symmetric_body(axis, rotor=0.0, height=0.6):
    along = np.eye(3)[axis]
    return kr.Body(1.3, 1.7 - 0.9 * along, height * along, rotor=rotor * along, unphysical=True)


# Integrals of motion


@pytest.mark.parametrize("body", [make_symmetric_body(0), make_symmetric_body(1, -0.7),
    make_symmetric_body(2, 0.4, -0.8), make_symmetric_body(2, 0.3, 0.0)])  # fmt: skip
@pytest.mark.parametrize("gravity", [2.0, -3.0, 0.0])
@pytest.mark.parametrize("tilt", [0.0, 1e-9, 0.7, 2.9, np.pi])
def test_starts_by_integrals_are_turning_points_of_the_motion(body, gravity, tilt):
    for rates in (0.5, 2.0, -1.5), (3.0, 0.0, 4.0), (0.0, 0.3, 0.0):
        nodding = kr.Scene.from_euler(body, (0.3, tilt, 0.2), rates, gravity=gravity)
        path = kr.solve(nodding, np.linspace(0, 40, 4001))
        names = "energy", "vertical_momentum", "axial_momentum"
        integrals = np.array([getattr(path, name)[0] for name in names])
        for lower, end in (False, path.nutation.min()), (True, path.nutation.max()):
            scene = kr.Scene.from_integrals(body, *integrals, lower=lower, gravity=gravity)
            start = kr.solve(scene, [0.0])
            found = [getattr(start, name)[0] for name in names]
            np.testing.assert_allclose(found, integrals, rtol=0, atol=1e-13)
            side = 1.0 if lower else -1.0
            assert -1e-7 < side * (start.nutation[0] - end) < 2e-2
            after = kr.solve(scene, np.linspace(0, 1, 20)).nutation
            assert (side * (after - start.nutation[0])).max() < 1e-7
            many = nodding.vary(lower=lower, energy=[integrals[0], integrals[0] + 0.5])
            assert many[0] == scene and many.axes == ("energy",)


@pytest.mark.parametrize("fast", [False, True])
def test_the_spin_of_a_wanted_precession_gives_this_precession(fast):
    slow = kr.Scene.spinning(CONE, [[20.0], [-30.0]], [0.5, 2.0], steady=True, fast=fast, gravity=1)
    rate = kr.exact(slow).precession_rate
    wanted = kr.Scene.spinning(CONE, tilt=[0.5, 2.0], precession=rate, steady=True, gravity=1)
    np.testing.assert_allclose(kr.exact(wanted).precession_rate, rate, rtol=1e-12)
    path = kr.solve(wanted, [0.0, 3.0])
    np.testing.assert_allclose(path.spin[..., 0], [[20.0] * 2, [-30.0] * 2], rtol=1e-12)
    assert np.ptp(path.nutation, axis=-1).max() < 1e-13
    varied = slow.vary(precession=rate, steady=True)
    np.testing.assert_allclose(varied.momentum, wanted.momentum, rtol=1e-12, atol=1e-13)


# Euler's angles


def test_the_attitude_agrees_with_scipy():
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    scene = kr.Scene.from_euler(CONE, ANGLES, gravity=1)
    expected = Rotation.from_euler("ZXZ", ANGLES).as_matrix()
    np.testing.assert_allclose(matrix(scene.attitude), expected, rtol=0, atol=1e-15)
    assert scene.momentum == (0, 0, 0)


@pytest.mark.parametrize("body", [CONE, CORNER, CORNER.turn(TILT), CONE.turn((0, 1, 0, 0)), WATER])
@pytest.mark.parametrize("angles", [ANGLES, (-3, 0.01, 3), (2, 3.1, -2), (0.3, 1.5, 0)])
def test_paths_start_with_the_given_angles_and_rates(body, angles):
    """Check bodies whose apex lies along different body axes."""
    scene = kr.Scene.from_euler(body, angles, RATES, gravity=2.0)
    np.testing.assert_allclose(get_angles(scene), angles, rtol=0, atol=2e-13)
    if 0.5 < angles[1] < 2.5:  # far from the poles
        h = 1e-4
        before, after = (np.array(get_angles(scene, t)) for t in (-h, h))
        np.testing.assert_allclose((after - before) / (2 * h), RATES, rtol=0, atol=2e-6)


# Spinning and steady precession


def test_spinning_starts_with_or_without_precession():
    free = kr.Scene.spinning(CONE, 30.0, 1.0, gravity=9.81)
    path = kr.solve(free, 1)
    np.testing.assert_allclose(path.velocity[0], 30.0 * path.apex[0], rtol=0, atol=1e-13)
    assert path.nutation[0] == path.nutation.min() == pytest.approx(1.0, abs=1e-15)
    precessing = kr.Scene.spinning(CONE, 30.0, 1.0, precession=2.0, gravity=9.81)
    assert get_precession(precessing) == pytest.approx(2.0, rel=1e-13)
    assert kr.solve(precessing, [0.0]).spin[0] == pytest.approx(30.0, rel=1e-15)
    damped = kr.Scene.spinning(CONE, 30.0, 1.0, gravity=9.81, damping=0.1)
    assert damped == free.replace(damping=0.1) and kr.solve(damped, 1).spin[-1] < 29.9


@pytest.mark.parametrize("fast", [False, True])
@pytest.mark.parametrize("gravity", [9.81, -9.81, 0.0])
@pytest.mark.parametrize("spin", [60.0, -60.0])
def test_a_steady_precession_stays_steady(spin, gravity, fast):
    for tilt in (1e-3, 0.4, 1.0, 2.0, 3.1):
        words = {"steady": True, "fast": fast, "gravity": gravity}
        path = kr.solve(kr.Scene.spinning(CONE, spin, tilt, **words), np.linspace(0, 3, 31))
        assert abs(path.nutation - tilt).max() < 1e-12
        np.testing.assert_allclose(path.spin, spin, rtol=1e-14)
        many = kr.Scene.spinning(CONE, [spin], tilt, **words)
        np.testing.assert_allclose(many.momentum[0], path.scene.momentum, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("fast", [False, True])
def test_a_nodding_scene_can_be_varied_to_steady_precessions(fast):
    scene = kr.Scene.from_euler(CONE, (0.1, 0.8, 0.3), rates=(0.2, 0.9, 20.0), gravity=1)
    words = {"spin": [30.0, -40.0], "steady": True, "fast": fast}
    source = kr.Source.grid(scene, **words)
    tops = [*scene.vary(tilt=0.7, **words), *scene.vary(tilt=[0.2, 2.0], steady=True, fast=fast)]
    for top in [*tops, source[0], source[1]]:
        for end in (5.0, -5.0):
            assert np.ptp(kr.solve(top, np.linspace(0, end, 50)).nutation) < 1e-13
    steady = {"steady": True, "fast": fast}
    one, other = (
        scene.vary(tilt=0.7, **steady),
        scene.vary(tilt=np.degrees(0.7), degrees=True, **steady),
    )
    np.testing.assert_allclose(other.momentum, one.momentum, rtol=1e-13)
    nodding = scene.vary(tilt=[0.7], precession=0.1)[0]
    assert np.ptp(kr.solve(nodding, np.linspace(0, 5, 50)).nutation) > 0.1


@pytest.mark.parametrize("spin", [60.0, 1e3, -1e4])
@pytest.mark.parametrize("tilt", [0.5, 1.5, 2.5])
def test_slow_and_fast_are_the_roots_of_the_quadratic(spin, tilt):
    words = {"steady": True, "gravity": 9.81}
    slow, fast = (kr.Scene.spinning(CONE, spin, tilt, fast=fast, **words) for fast in (False, True))
    a, b, root = I1 * math.cos(tilt), I3 * spin, 0.0
    for _ in range(200):  # the slow precession, by a fixed-point iteration without cancellation
        root = (TORQUE + a * root * root) / b
    rounding = 1e-15 * abs(spin)  # rounding error of a velocity
    assert get_precession(slow) == pytest.approx(root, rel=1e-13, abs=rounding)
    assert get_precession(fast) == pytest.approx(TORQUE / a / root, rel=1e-13, abs=rounding)


def test_steady_precession_of_a_horizontal_axis_and_without_spin():
    level = kr.Scene.spinning(CONE, 60.0, math.pi / 2, steady=True, gravity=9.81)
    assert get_precession(level) == pytest.approx(TORQUE / (I3 * 60.0), rel=1e-13)
    conical = kr.Scene.spinning(CONE, 0.0, 2.5, steady=True, gravity=9.81)  # a conical pendulum
    assert abs(kr.solve(conical, 5).nutation - 2.5).max() < 1e-13
    rate = math.sqrt(-TORQUE / (I1 * math.cos(2.5)))
    assert abs(get_precession(conical)) == pytest.approx(rate)


@pytest.mark.parametrize("gravity, tilt", [(9.81, 1.0), (9.81, 0.1), (-9.81, 2.0)])
@pytest.mark.parametrize("degrees", [False, True])
def test_the_reported_least_spin_allows_steady_precession(gravity, tilt, degrees):
    words = {"tilt": np.degrees(tilt) if degrees else tilt, "gravity": gravity}
    words |= {"degrees": degrees, "steady": True}
    with pytest.raises(ValueError, match="no steady precession at this tilt") as error:
        kr.Scene.spinning(CONE, 0.01, **words)
    least = float(re.search(r"one is ([-+.\de]+)$", str(error.value))[1])
    expected = 2 * math.sqrt(I1 * abs(math.cos(tilt)) * TORQUE) / I3
    assert (math.radians(least) if degrees else least) == pytest.approx(expected, rel=1e-14)
    path = kr.solve(kr.Scene.spinning(CONE, -least, **words), 1)
    # near a double root, the error is about the square root of a rounding error
    assert abs(path.nutation - tilt).max() < 1e-6
    with pytest.raises(ValueError, match="no steady precession"):
        kr.Scene.spinning(CONE, least * (1 - 1e-9), **words)


@pytest.mark.parametrize("tilt", [0, 180])
@pytest.mark.parametrize("gravity", [9.81, 0])
def test_at_a_pole_every_spin_is_steady(tilt, gravity):
    for spin in (0, 3.0, -200):
        words = {"tilt": tilt, "degrees": True, "steady": True, "gravity": gravity}
        momentum = (0, 0, I3 * math.radians(spin) * (1 if tilt == 0 else -1))
        for scene in (kr.Scene.spinning(CONE, spin, **words),
                      kr.Scene.spinning(CONE, [spin], **words)[0]):  # fmt: skip
            np.testing.assert_allclose(scene.momentum, momentum, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    "body",
    [
        CONE.turn(TILT),
        CONE.turn((0, 1, 0, 0)),
        kr.Body(1, (2, 2, 2), (0.3, -0.4, 1.2), unphysical=True),
        kr.Body(1, (2, 1, 2), (0, -0.5, 0)),
        kr.Body(1, (2, 2, 1), (0, 0, 0)),
    ],
)
def test_the_axis_may_have_any_direction(body):
    path = kr.solve(kr.Scene.spinning(body, 30.0, 0.6, steady=True, gravity=1), 3)
    assert abs(path.nutation - 0.6).max() < 1e-12 and abs(path.spin - 30.0).max() < 1e-12


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_symmetry_does_not_depend_on_the_units(scale):
    moments, lever = np.array([1.0, 1.0 + 1e-11, 0.5]) * scale, 0.5 * scale**0.5
    unlike = kr.Body(1.0, tuple(moments), (0, 0, lever))
    symmetric = kr.Body(1.0, (scale, scale, 0.5 * scale), (0, 0, lever))
    words = {"tilt": 0.5, "spin": 10.0, "steady": True, "gravity": 1}
    assert kr.Scene.spinning(symmetric, 10.0, 0.5, gravity=1).body == symmetric
    with pytest.raises(ValueError, match="symmetric"):
        kr.Scene.spinning(unlike, **words)
    both = kr.Scene.stack([THESIS.replace(body=unlike), THESIS.replace(body=symmetric)]).body
    with pytest.raises(ValueError, match=r"^body\[0\]: "):
        kr.Scene.spinning(both, **words)


# Starts of given energy and vertical momentum

TURNED = kr.Body(1.5, [[2, 0.3, 0.1], [0.3, 1.5, -0.2], [0.1, -0.2, 1]], (0.1, 0.2, 0.6))
BALL = kr.Body(2.0, (1.0, 1.0, 1.0), (0, 0, 0))
ROUND = kr.Body.symmetric(1.0, 0.782, 0.783, 0.21)


def compute_potential(body, gravity, vertical, P):
    """Return the energy of a body that rotates only about the vertical.

    Each row of `P` is the vertical unit vector in the body frame.
    """
    inertia = np.array(body.inertia)
    inertia = np.diag(inertia) if inertia.ndim == 1 else inertia
    about_vertical = np.einsum("ni,ij,nj->n", P, inertia, P)
    return body.mass * gravity * P @ body.com + vertical**2 / (2 * about_vertical)


@pytest.mark.parametrize("body", [TOP.body, TURNED, CONE, WATER, BALL])
@pytest.mark.parametrize("energy, vertical, gravity", [(5.0, 1.0, 0.7), (4, -2, -1.3), (7, 0, 0)])
def test_starts_have_the_energy_and_the_vertical_momentum(body, energy, vertical, gravity):
    words = {"energy": energy, "vertical": vertical, "gravity": gravity}
    for options in ({"n": 40}, {"grid": (5, 6, 3)}, {"grid": (5, 6)}):
        tops = kr.starts(body, **words, **options)
        rows = np.concatenate([tops.momentum, tops.attitude], axis=1).round(9)
        assert len(np.unique(rows, axis=0)) == len(rows) > 10
        path = kr.solve(tops, [0.0])
        np.testing.assert_allclose(path.energy[:, 0], energy, rtol=2e-14)
        np.testing.assert_allclose(path.vertical_momentum[:, 0], vertical, rtol=0, atol=3e-14)


def test_the_ith_start_depends_only_on_the_seed_and_i():
    words = {"energy": 2.0, "vertical": 1.0, "gravity": 1}
    many = kr.starts(TOP.body, n=20, seed=7, **words)
    assert kr.starts(TOP.body, n=5, seed=7, **words) == many[:5]
    assert not set(kr.starts(TOP.body, n=20, seed=4, **words)) & set(many)
    assert kr.starts(TOP.body, n=0, **words).shape == (0,)
    # in every version
    first = [0.9115183727699853, 0.1931344077567047, -0.3630886346929978, 0.0]
    assert many.attitude[0] == pytest.approx(first, abs=1e-12)
    second = [-3.7700409266300934, 5.73886832164318, 1.0]
    assert many.momentum[1] == pytest.approx(second, abs=1e-12)


def test_random_starts_are_uniform_on_the_energy_surface():
    """Check the heights z of a Lagrange top: their density is 1 / sqrt(I1 (1 - z^2) + I3 z^2)."""
    body = kr.Body.symmetric(1, 1, 0.1, 0.2)
    tops = kr.starts(body, energy=100.0, vertical=0.5, n=2000, seed=1, gravity=1)
    heights = np.sort(kr.solve(tops, [0.0]).apex[:, 0, 2])
    z = np.linspace(-1, 1, 20001)
    density = 1 / np.sqrt((1 - z * z) + 0.1 * z * z)
    integral = np.concatenate(([0], np.cumsum(0.5 * (density[1:] + density[:-1]))))
    expected = np.interp(heights, z, integral / integral[-1])
    distance = abs(expected - (np.arange(2000) + 0.5) / 2000).max()
    assert 0.005 < distance < 1.63 / math.sqrt(2000)  # Kolmogorov-Smirnov test, level 1 %


def test_the_grid_contains_exactly_the_possible_starts():
    tops = kr.starts(TURNED, grid=(8, 10, 4), energy=0.6, vertical=0.8, gravity=1)
    h = np.repeat(-1 + (2 * np.arange(8) + 1) / 8, 10)
    a = np.tile(2 * np.pi * (np.arange(10) + 0.5) / 10, 8)
    P = np.stack([np.sqrt(1 - h * h) * np.cos(a), np.sqrt(1 - h * h) * np.sin(a), h], axis=-1)
    can_be = compute_potential(TURNED, 1.0, 0.8, P) <= 0.6
    assert 0 < can_be.sum() < 80 and len(tops) == 4 * can_be.sum()
    verticals = np.array([matrix(scene.attitude).T @ (0, 0, 1) for scene in tops])
    np.testing.assert_allclose(verticals, np.repeat(P[can_be], 4, axis=0), rtol=0, atol=1e-15)


@pytest.mark.parametrize("energy, vertical", [(3.0, 1.0), (-0.6, 0.1), (20.0, -2.0)])
def test_a_two_dimensional_grid_starts_at_turning_points_of_the_apex(energy, vertical):
    tops = kr.starts(TURNED, energy=energy, vertical=vertical, grid=(7, 9), gravity=1)
    start = kr.solve(tops, [0.0])
    rate = np.cross(start.velocity[:, 0], start.apex[:, 0])[:, 2]
    assert len(tops) >= 8 and np.abs(rate).max() < 1e-14 * np.abs(start.velocity).max()
    heights = np.unique(start.apex[:, 0, 2].round(12))
    assert set(heights) <= {round((2 * k + 1) / 7 - 1, 12) for k in range(7)}
    differences = np.abs(np.diff(start.m[:, 0].reshape(-1, 2, 3), axis=1)).max(axis=2)
    assert differences.min() > 1e-6  # the two momenta at one position differ


def find_least_energy(body, **words):
    with pytest.raises(ValueError, match=r"no start has energy = -100\.0") as error:
        kr.starts(body, energy=-100, n=3, **words)
    return float(re.search(r"this value is ([-+.\de]+)$", str(error.value))[1])


@pytest.mark.parametrize("body", [TOP.body, TURNED, CONE, WATER, ROUND])
@pytest.mark.parametrize("vertical, gravity", [(0.0, 1.0), (1.5, 0.7), (7.2, 1.0), (30.0, -1.3)])
def test_impossible_energies_raise_with_the_least_energy(body, vertical, gravity):
    words = {"vertical": vertical, "gravity": gravity}
    least = find_least_energy(body, **words)
    P = np.random.default_rng(8).normal(size=(200000, 3))
    P /= np.linalg.norm(P, axis=1)[:, None]
    minimum = compute_potential(body, gravity, vertical, P).min()
    size = max(abs(minimum), body.mass * abs(gravity) * np.linalg.norm(body.com), 0.01)
    assert least <= minimum + 1e-14 * size and minimum - least < 1e-3 * size
    assert len(kr.starts(body, energy=least + 0.01 * size, n=3, **words)) == 3
    assert kr.starts(body, energy=least, n=0, **words).shape == (0,)
    with pytest.raises(ValueError, match="no start has energy"):
        kr.starts(body, energy=math.nextafter(least, -99.0), n=0, **words)
    for unit in (1e-3, 1e3):  # of length
        inertia, com = np.array(body.inertia) * unit**2, np.array(body.com) * unit
        options = {"inertia_rtol": body.inertia_rtol, "unphysical": body.unphysical}
        other = kr.Body(body.mass, inertia.tolist(), com.tolist(), **options)
        energy = find_least_energy(other, vertical=vertical * unit, gravity=gravity / unit)
        assert energy == pytest.approx(least, rel=1e-13, abs=1e-13)


def test_the_least_energy_is_the_lower_of_two_minima():
    for side in (1.0, -1.0):
        body = kr.Body(1.0, (1.0, 2.0, 2.5), (0.0, 0.0, side * 1e-5))
        least = find_least_energy(body, vertical=1.0, gravity=1)
        assert least == pytest.approx(0.2 - 1e-5, abs=1e-12)


@pytest.mark.parametrize("body", [TOP.body, TURNED, CONE])
def test_starts_are_found_close_to_the_least_energy(body):
    least = -body.mass * np.linalg.norm(body.com)
    for excess in (1e-3, 1e-6, 1e-9, 1e-12):
        tops = kr.starts(body, energy=least * (1.0 - excess), vertical=0.0, n=50, gravity=1)
        energy = kr.solve(tops, [0.0]).energy[:, 0]
        assert np.abs(energy - least * (1.0 - excess)).max() < 2e-15 * abs(least)
        hanging = 1.0 + kr.solve(tops, [0.0]).apex[:, 0, 2]
        assert hanging.max() < 1.001 * excess + 1e-15 and hanging.min() < 0.5 * excess
