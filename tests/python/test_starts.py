"""Starts in the words of textbooks: Euler's angles, steady precession, given energies."""

import math
import re

import kreisel as kr
import numpy as np
import pytest
from tops import CORNER, MOMENTUM, TILT, matrix

CONE = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1.5)
I1, _, I3 = CONE.moments
TORQUE = 1.5 * 9.81 * 1.5
ANGLES, RATES = (0.7, 1.1, -0.4), (0.3, -0.8, 5.0)
NAMES = ("precession_angle", "nutation", "spin_angle")
WATER = kr.Body(1, (0.345, 0.653, 1.0), (0, 0, 0), rounded=0.0021)


def angles_of(scene, t=0.0):
    path = kr.solve(scene, [t])
    return [float(getattr(path, name)[0]) for name in NAMES]


# Euler's angles


def test_the_attitude_is_that_of_scipy():
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    scene = kr.Scene.from_euler(CONE, ANGLES)
    expected = Rotation.from_euler("ZXZ", ANGLES).as_matrix()
    np.testing.assert_allclose(matrix(scene.attitude), expected, atol=1e-15)
    assert scene.momentum == (0, 0, 0)


@pytest.mark.parametrize("body", [CONE, CORNER, CORNER.turned(TILT), CONE.turned((0, 1, 0, 0))])
@pytest.mark.parametrize("angles", [ANGLES, (-3, 0.01, 3), (2, 3.1, -2), (0.3, 1.5, 0)])
def test_paths_begin_with_these_angles(body, angles):
    """An apex below the third axis, and one beside it, are no exception."""
    scene = kr.Scene.from_euler(body, angles, RATES)
    np.testing.assert_allclose(angles_of(scene), angles, atol=2e-13)


@pytest.mark.parametrize("body", [CONE, CORNER, CORNER.turned(TILT), WATER])
def test_the_angles_begin_with_these_rates(body):
    scene = kr.Scene.from_euler(body, ANGLES, RATES, gravity=2.0)
    h = 1e-4
    before, after = (np.array(angles_of(scene, t)) for t in (-h, h))
    np.testing.assert_allclose((after - before) / (2 * h), RATES, atol=2e-6)


def test_degrees_are_said_by_name():
    there = kr.Scene.from_euler(CONE, np.degrees(ANGLES), np.degrees(RATES), degrees=True)
    here = kr.Scene.from_euler(CONE, ANGLES, RATES)
    np.testing.assert_allclose(there.attitude, here.attitude, atol=1e-15)
    np.testing.assert_allclose(there.momentum, here.momentum, rtol=1e-14)
    with pytest.raises(TypeError, match="positional"):
        kr.Scene.from_euler(CONE, ANGLES, RATES, True)


@pytest.mark.parametrize(
    "words, exception, message",
    [
        ({"angles": (1, 2)}, ValueError, "angles must be 3 numbers"),
        ({"rates": (1, 2, np.inf)}, ValueError, "rates must be finite"),
        ({"degrees": 1}, TypeError, "degrees must be True or False, not 1"),
        ({"body": TILT}, TypeError, "body must be a kreisel.Body"),
        ({"gravity": "g"}, TypeError, "gravity must be a number"),
    ],
)
def test_angles_that_are_none_are_refused(words, exception, message):
    with pytest.raises(exception, match=message):
        kr.Scene.from_euler(**{"body": CONE, "angles": ANGLES, **words})


# Attitudes


def test_an_attitude_may_be_a_rotation_of_scipy():
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    w, x, y, z = TILT
    rotation = Rotation.from_quat((x, y, z, w))
    scene = kr.Scene(CORNER, MOMENTUM, rotation)
    np.testing.assert_allclose(scene.attitude, TILT, rtol=1e-15)
    assert scene.replace(attitude=rotation) == scene
    for several in (Rotation.concatenate([rotation, rotation]), rotation.as_rotvec):
        with pytest.raises((TypeError, ValueError), match=r"a single one|attitude must be 4"):
            kr.Scene(CORNER, MOMENTUM, several)


@pytest.mark.parametrize("dtype", [np.float32, np.float16])
def test_an_attitude_in_single_precision_is_made_unit_in_double(dtype):
    rng = np.random.default_rng(5)
    for _ in range(50):
        q = rng.normal(size=4).astype(dtype)
        q /= np.linalg.norm(q)
        for words in ({"attitude": q}, {"attitude_xyzw": q}, {"attitude": list(q)}):
            scene = kr.Scene(CORNER, MOMENTUM, **words)
            assert abs(math.hypot(*scene.attitude) - 1) < 4e-16
        np.testing.assert_allclose(scene.attitude, q.astype(float), atol=4 * np.finfo(dtype).eps)
    with pytest.raises(ValueError, match="divide by it"):
        kr.Scene(CORNER, MOMENTUM, q.astype(float) * (1 + 1e-7))
    with pytest.raises(ValueError, match="divide by it"):
        kr.Scene(CORNER, MOMENTUM, q * dtype(1.1))


# Steady precession


@pytest.mark.parametrize("fast", [False, True])
@pytest.mark.parametrize("gravity", [9.81, -9.81, 0.0])
@pytest.mark.parametrize("tilt", [1e-3, 0.4, 1.0, 2.0, 3.1])
@pytest.mark.parametrize("spin", [60.0, -60.0])
def test_a_steady_precession_stays_steady(spin, tilt, gravity, fast):
    scene = kr.Scene.spinning(CONE, spin, tilt, steady=True, fast=fast, gravity=gravity)
    path = kr.solve(scene, np.linspace(0, 3, 31))
    assert abs(path.nutation - tilt).max() < 1e-12
    np.testing.assert_allclose(path.spin, spin, rtol=1e-14)


def rate_of(scene):
    """The precession of a tilted top: its velocity across the axis over the sine of the tilt."""
    path = kr.solve(scene, [0.0])
    velocity, apex = path.velocity[0], path.apex[0]
    across = velocity - (velocity @ apex) * apex
    return float(np.cross(apex, [0, 0, 1]) @ np.cross(apex, across)) / (1 - apex[2] ** 2)


@pytest.mark.parametrize("spin", [60.0, 1e3, -1e4])
@pytest.mark.parametrize("tilt", [0.5, 2.5])
def test_slow_and_fast_are_the_roots_of_the_quadratic(spin, tilt):
    words = {"steady": True, "gravity": 9.81}
    slow, fast = (kr.Scene.spinning(CONE, spin, tilt, fast=fast, **words) for fast in (False, True))
    a, b, root = I1 * math.cos(tilt), I3 * spin, 0.0
    for _ in range(200):  # the slow one, which 200 rounds of this find without cancellation
        root = (TORQUE + a * root * root) / b
    rounding = 1e-15 * abs(spin)  # of a velocity
    assert rate_of(slow) == pytest.approx(root, rel=1e-13, abs=rounding)
    assert rate_of(fast) == pytest.approx(TORQUE / a / root, rel=1e-13, abs=rounding)


def test_on_a_level_axis_the_slow_one_is_exact():
    scene = kr.Scene.spinning(CONE, 60.0, math.pi / 2, steady=True, gravity=9.81)
    assert rate_of(scene) == pytest.approx(TORQUE / (I3 * 60.0), rel=1e-13)
    level = {"tilt": 90, "degrees": True, "steady": True, "gravity": 9.81}
    with pytest.raises(ValueError, match="at one rate only"):
        kr.Scene.spinning(CONE, 60.0, fast=True, **level)
    with pytest.raises(ValueError, match="without spin falls"):
        kr.Scene.spinning(CONE, 0.0, **level)


def test_without_spin_it_is_the_conical_pendulum():
    scene = kr.Scene.spinning(CONE, 0.0, 2.5, steady=True, gravity=9.81)
    path = kr.solve(scene, 5)
    assert abs(path.nutation - 2.5).max() < 1e-13
    assert abs(rate_of(scene)) == pytest.approx(math.sqrt(-TORQUE / (I1 * math.cos(2.5))))


@pytest.mark.parametrize("gravity, tilt", [(9.81, 1.0), (9.81, 0.1), (-9.81, 2.0)])
@pytest.mark.parametrize("degrees", [False, True])
def test_the_least_spin_is_told_and_does(gravity, tilt, degrees):
    words = {"tilt": np.degrees(tilt) if degrees else tilt, "gravity": gravity}
    words |= {"degrees": degrees, "steady": True}
    with pytest.raises(ValueError, match="no precession is steady at this tilt") as caught:
        kr.Scene.spinning(CONE, 0.01, **words)
    least = float(re.search(r"do is ([-+.\de]+)$", str(caught.value))[1])
    expected = 2 * math.sqrt(I1 * abs(math.cos(tilt)) * TORQUE) / I3
    assert (math.radians(least) if degrees else least) == pytest.approx(expected, rel=1e-14)
    path = kr.solve(kr.Scene.spinning(CONE, -least, **words), 1)
    assert abs(path.nutation - tilt).max() < 1e-6  # at a double root a rounding grows to its root
    with pytest.raises(ValueError, match="no precession is steady"):
        kr.Scene.spinning(CONE, least * (1 - 1e-9), **words)


@pytest.mark.parametrize("tilt", [0, 180])
@pytest.mark.parametrize("gravity", [9.81, -9.81, 0])
@pytest.mark.parametrize("spin", [0, 3.0, -200])
def test_at_a_pole_every_spin_is_steady(tilt, gravity, spin):
    words = {"tilt": tilt, "degrees": True, "steady": True, "gravity": gravity}
    scene = kr.Scene.spinning(CONE, spin, **words)
    np.testing.assert_allclose(
        scene.momentum, (0, 0, I3 * math.radians(spin) * (1 if tilt == 0 else -1)), atol=1e-13
    )


# Spinning


def test_spinning_lets_go_or_pushes_along():
    free = kr.Scene.spinning(CONE, 30.0, 1.0, gravity=9.81)
    path = kr.solve(free, 1)
    np.testing.assert_allclose(path.velocity[0], 30.0 * path.apex[0], atol=1e-13)
    assert path.nutation[0] == path.nutation.min() == pytest.approx(1.0, abs=1e-15)
    pushed = kr.Scene.spinning(CONE, 30.0, 1.0, precession=2.0, gravity=9.81)
    assert rate_of(pushed) == pytest.approx(2.0, rel=1e-13)
    assert kr.solve(pushed, [0.0]).spin[0] == pytest.approx(30.0, rel=1e-15)
    turned = kr.Scene.spinning(
        CONE, np.degrees(30.0), np.degrees(1.0), np.degrees(2.0), degrees=True, gravity=9.81
    )
    np.testing.assert_allclose(turned.momentum, pushed.momentum, rtol=1e-14)


@pytest.mark.parametrize(
    "body",
    [
        CONE.turned(TILT),
        CONE.turned((0, 1, 0, 0)),
        kr.Body(1, (2, 2, 2), (0.3, -0.4, 1.2), made_up=True),
        kr.Body(1, (2, 1, 2), (0, -0.5, 0)),
        kr.Body(1, (2, 2, 1), (0, 0, 0)),
    ],
)
def test_the_axis_may_lie_anywhere(body):
    path = kr.solve(kr.Scene.spinning(body, 30.0, 0.6, steady=True), 3)
    assert abs(path.nutation - 0.6).max() < 1e-12 and abs(path.spin - 30.0).max() < 1e-12


@pytest.mark.parametrize(
    "words, exception, message",
    [
        ({"body": CORNER}, ValueError, "spinning is for a symmetric body"),
        ({"body": kr.Body(1, (1, 2, 2), (0, 0, 0))}, ValueError, "whose axis is the third"),
        ({"body": kr.Body(1, (2, 2, 1), (0.5, 0, 0))}, ValueError, "symmetric body"),
        ({"tilt": -0.1}, ValueError, "tilt must lie between 0 and pi, .* degrees=True, not -0.1"),
        ({"tilt": 181, "degrees": True}, ValueError, "between 0 and 180, not 181"),
        ({"spin": None}, TypeError, "spin must be a number"),
        ({"precession": "1"}, TypeError, "precession must be a number"),
        ({"fast": True}, ValueError, "say steady=True"),
        ({"steady": 1}, TypeError, "steady must be True or False"),
        ({"steady": True, "precession": 1}, ValueError, "neither precession nor damping"),
        ({"steady": True, "damping": (0, 0, 1)}, ValueError, "neither precession nor damping"),
        ({"steady": True, "gravity": (0, 0, -1)}, TypeError, "positive is down"),
    ],
)
def test_spinning_refuses(words, exception, message):
    with pytest.raises(exception, match=message):
        kr.Scene.spinning(**{"body": CONE, "spin": 3.0, "tilt": 0.3, **words})


def test_textbook_starts_may_be_damped():
    free, damped = (
        kr.Scene.spinning(CONE, 60.0, 1.0, gravity=9.81, damping=d) for d in (None, 0.1)
    )
    assert damped == free.replace(damping=0.1) and damped.damping == (0.1, 0.1, 0.1)
    assert kr.Scene.from_euler(CONE, ANGLES, RATES, damping=(1, 1, 2)).damping == (1, 1, 2)
    assert kr.solve(damped, 1).spin[-1] < 59.9
    assert kr.Scene.spinning(CONE, 60.0, 1.0, steady=True, damping=0.0).damping == (0, 0, 0)


# On an energy surface

ASYMMETRIC = kr.scenes.asymmetric.body
TURNED = kr.Body(1.5, [[2, 0.3, 0.1], [0.3, 1.5, -0.2], [0.1, -0.2, 1]], (0.1, 0.2, 0.6))
ROUND = kr.Body.symmetric(1.0, 0.782, 0.783, 0.21)
NEEDLE = kr.Body(1.0, (1.0, 1.0, 1e-14), (0, 0, 0.1), made_up=True)


def amended(body, gravity, vertical, P):
    """What is left of the energy where nothing moves but about the vertical P, seen from the frame
    of description (n, 3)."""
    inertia = np.array(body.inertia)
    inertia = np.diag(inertia) if inertia.ndim == 1 else inertia
    about = np.einsum("ni,ij,nj->n", P, inertia, P)
    return body.mass * gravity * P @ body.com + vertical**2 / (2 * about)


@pytest.mark.parametrize("body", [ASYMMETRIC, TURNED, CONE, WATER])
@pytest.mark.parametrize("energy, vertical, gravity", [(5.0, 1.0, 0.7), (4, -2, -1.3), (7, 0, 0)])
@pytest.mark.parametrize("how", [{"n": 40}, {"grid": (5, 6, 3)}, {"grid": (5, 6)}])
def test_starts_have_the_energy_and_the_vertical_momentum(body, energy, vertical, gravity, how):
    words = {"energy": energy, "vertical": vertical, "gravity": gravity}
    found = kr.starts(body, **words, **how)
    assert len(set(found)) == len(found) > 10
    for scene in found:
        path = kr.solve(scene, [0.0])
        assert path.energy[0] == pytest.approx(energy, abs=2e-14 * energy)
        assert path.vertical_momentum[0] == pytest.approx(vertical, abs=2e-14)


def test_start_number_i_depends_on_seed_and_i_alone():
    words = {"energy": 2.0, "vertical": 1.0}
    many = kr.starts(ASYMMETRIC, n=20, seed=3, **words)
    assert kr.starts(ASYMMETRIC, n=5, seed=3, **words) == many[:5]
    assert not set(kr.starts(ASYMMETRIC, n=20, seed=4, **words)) & set(many)
    assert kr.starts(ASYMMETRIC, n=0, **words).shape == (0,)


def test_a_seed_gives_the_same_starts_for_ever():
    tops = kr.starts(ASYMMETRIC, energy=2.0, vertical=1.0, n=2, seed=7)
    first = [0.9115183727699853, 0.1931344077567047, -0.3630886346929978, 0.0]
    assert tops.attitude[0] == pytest.approx(first, abs=1e-12)
    second = [-3.7700409266300934, 5.73886832164318, 1.0]
    assert tops.momentum[1] == pytest.approx(second, abs=1e-12)


def test_random_starts_are_even_in_the_volume_of_the_surface():
    """Of a Lagrange top the density of its height z is 1 / sqrt(I1 (1 - z^2) + I3 z^2)."""
    body = kr.Body.symmetric(1, 1, 0.1, 0.2)
    found = kr.starts(body, energy=100.0, vertical=0.5, n=2000, seed=1)
    heights = np.sort([float(kr.solve(scene, [0.0]).apex[0, 2]) for scene in found])
    z = np.linspace(-1, 1, 20001)
    density = 1 / np.sqrt((1 - z * z) + 0.1 * z * z)
    below = np.concatenate(([0], np.cumsum(0.5 * (density[1:] + density[:-1]))))
    expected = np.interp(heights, z, below / below[-1])
    apart = abs(expected - (np.arange(2000) + 0.5) / 2000).max()
    assert 0.005 < apart < 1.63 / math.sqrt(2000)  # Kolmogorov and Smirnov at 1 %


def test_the_grid_has_all_that_can_be_and_no_more():
    words = {"energy": 0.6, "vertical": 0.8}
    found = kr.starts(TURNED, grid=(8, 10, 4), **words)
    z = -1 + (2 * np.arange(8) + 1) / 8
    angle = 2 * np.pi * (np.arange(10) + 0.5) / 10
    P = np.array(
        [
            (np.sqrt(1 - h * h) * np.cos(a), np.sqrt(1 - h * h) * np.sin(a), h)
            for h in z
            for a in angle
        ]
    )
    can_be = amended(TURNED, 1.0, 0.8, P) <= 0.6
    assert 0 < can_be.sum() < 80 and len(found) == 4 * can_be.sum()
    seen = np.array([matrix(scene.attitude).T @ (0, 0, 1) for scene in found])
    np.testing.assert_allclose(seen, np.repeat(P[can_be], 4, axis=0), atol=1e-15)


def least_energy(body, **words):
    with pytest.raises(ValueError, match=r"no start has energy = -100\.0") as caught:
        kr.starts(body, energy=-100, n=3, **words)
    return float(re.search(r"there is ([-+.\de]+)$", str(caught.value))[1])


@pytest.mark.parametrize("body", [ASYMMETRIC, TURNED, CONE, WATER, ROUND])
@pytest.mark.parametrize("vertical, gravity", [(0.0, 1.0), (1.5, 0.7), (7.2, 1.0), (30.0, -1.3)])
def test_where_no_start_exists_the_least_energy_is_told(body, vertical, gravity):
    words = {"vertical": vertical, "gravity": gravity}
    least = least_energy(body, **words)
    rng = np.random.default_rng(8)
    P = rng.normal(size=(200000, 3))
    P /= np.linalg.norm(P, axis=1)[:, None]
    sampled = amended(body, gravity, vertical, P).min()
    size = max(abs(sampled), body.mass * abs(gravity) * np.linalg.norm(body.com), 0.01)
    assert least <= sampled + 1e-14 * size and sampled - least < 1e-3 * size
    assert len(kr.starts(body, energy=least + 0.01 * size, n=3, **words)) == 3


def test_the_least_energy_is_the_same_in_any_unit_of_length():
    for vertical in (0.5, 1.5, 6.0):
        least = least_energy(TURNED, vertical=vertical, gravity=0.7)
        for unit in (1e-3, 1e3):
            inertia, com = np.array(TURNED.inertia) * unit**2, np.array(TURNED.com) * unit
            other = kr.Body(TURNED.mass, inertia.tolist(), com.tolist())
            told = least_energy(other, vertical=vertical * unit, gravity=0.7 / unit)
            assert told == pytest.approx(least, rel=1e-13)


@pytest.mark.parametrize("body", [ASYMMETRIC, TURNED, CONE])
def test_starts_are_found_however_near_the_least_energy(body):
    least = -body.mass * np.linalg.norm(body.com)
    for above in (1e-3, 1e-6, 1e-9, 1e-12):
        tops = kr.starts(body, energy=least * (1.0 - above), vertical=0.0, n=50)
        energy = kr.solve(tops, [0.0]).energy[:, 0]
        assert np.abs(energy - least * (1.0 - above)).max() < 2e-15 * abs(least)
        hanging = 1.0 + kr.solve(tops, [0.0]).apex[:, 0, 2]
        assert hanging.max() < 1.001 * above + 1e-15 and hanging.min() < 0.5 * above


@pytest.mark.parametrize("energy, vertical", [(3.0, 1.0), (-0.6, 0.1), (20.0, -2.0)])
def test_a_grid_of_two_begins_where_the_apex_turns_back(energy, vertical):
    tops = kr.starts(TURNED, energy=energy, vertical=vertical, grid=(7, 9))
    start = kr.solve(tops, [0.0])
    rate = np.cross(start.velocity[:, 0], start.apex[:, 0])[:, 2]
    assert len(tops) >= 8 and np.abs(rate).max() < 1e-14 * np.abs(start.velocity).max()
    heights = np.unique(start.apex[:, 0, 2].round(12))
    assert set(heights) <= {round((2 * k + 1) / 7 - 1, 12) for k in range(7)}
    apart = np.abs(np.diff(start.m[:, 0].reshape(-1, 2, 3), axis=1)).max(axis=2)
    assert apart.min() > 1e-6  # the two momenta at each place


@pytest.mark.parametrize(
    "words, exception, message",
    [
        ({}, ValueError, "exactly one of n and grid, not none"),
        ({"n": 3, "grid": (1, 1, 1)}, ValueError, "exactly one of n and grid, not both"),
        ({"n": -1}, ValueError, "n must be at least 0"),
        ({"n": 3, "seed": -1}, ValueError, "seed must be at least 0"),
        ({"n": 2.5}, TypeError, "n must be a whole number"),
        ({"grid": (3, 3, 3, 3)}, ValueError, "grid must be 2 or 3 whole numbers"),
        ({"grid": (3, 3, 0)}, ValueError, "grid must be at least 1"),
        ({"grid": (3, 3, 1.5)}, TypeError, "grid must be a whole number"),
        ({"n": 3, "energy": np.nan}, ValueError, "energy must be finite"),
        ({"n": 3, "vertical": "1"}, TypeError, "vertical must be a number"),
        ({"n": 3, "body": kr.scenes.thesis}, TypeError, "body must be a kreisel.Body"),
        ({"n": 3, "gravity": (0, 0, 1)}, TypeError, "gravity must be a number"),
        ({"grid": (1, 1, 1), "energy": -3.9}, ValueError, "make it finer"),
        ({"n": 3, "vertical": 1e200}, ValueError, r"vertical = 1e\+200 is too large"),
        ({"n": 3, "vertical": -1e90}, ValueError, r"vertical = -1e\+90 is too large"),
        ({"n": 3, "energy": 1e308}, ValueError, r"energy = 1e\+308 is too large"),
        ({"grid": (2, 2), "gravity": 1e200}, ValueError, r"mass gravity \|com\| .* is too large"),
        ({"n": 30, "body": NEEDLE}, ValueError, "or the body is nearly a line"),
    ],
)
def test_starts_refuse(words, exception, message):
    with pytest.raises(exception, match=message):
        kr.starts(**{"body": ASYMMETRIC, "energy": 2.0, "vertical": 0.1, **words})
