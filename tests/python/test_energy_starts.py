"""Tests of kreisel.starts: starts of given energy and vertical momentum, random or on a grid."""

import itertools
import math
import re

import kreisel as kr
import numpy as np
import pytest
from kreisel._model import starts
from tops import matrix

TOP, THESIS, FREE = kr.scenes.asymmetric, kr.scenes.thesis, kr.scenes.dzhanibekov
BALL = kr.Body(2.0, (0.5, 0.5, 0.5), (0, 0, 0))

CONE = kr.Body.cone(radius=1, height=2, pivot=(0, 0, 0), mass=1.5)
WATER = kr.Body(1, (0.345, 0.653, 1.0), (0, 0, 0), inertia_rtol=0.0021)
ASYMMETRIC = kr.scenes.asymmetric.body
TURNED = kr.Body(1.5, [[2, 0.3, 0.1], [0.3, 1.5, -0.2], [0.1, -0.2, 1]], (0.1, 0.2, 0.6))
ROUND = kr.Body.symmetric(1.0, 0.782, 0.783, 0.21)
NEEDLE = kr.Body(1.0, (1.0, 1.0, 1e-14), (0, 0, 0.1), unphysical=True)


def effective_potential(body, gravity, vertical, P):
    """Return the energy of a body that rotates only about the vertical.

    Each row of `P` is the vertical unit vector in the body frame.
    """
    inertia = np.array(body.inertia)
    inertia = np.diag(inertia) if inertia.ndim == 1 else inertia
    vertical_inertia = np.einsum("ni,ij,nj->n", P, inertia, P)
    return body.mass * gravity * P @ body.com + vertical**2 / (2 * vertical_inertia)


@pytest.mark.parametrize("body", [ASYMMETRIC, TURNED, CONE, WATER])
@pytest.mark.parametrize("energy, vertical, gravity", [(5.0, 1.0, 0.7), (4, -2, -1.3), (7, 0, 0)])
@pytest.mark.parametrize("options", [{"n": 40}, {"grid": (5, 6, 3)}, {"grid": (5, 6)}])
def test_starts_have_the_energy_and_the_vertical_momentum(body, energy, vertical, gravity, options):
    words = {"energy": energy, "vertical": vertical, "gravity": gravity}
    tops = kr.starts(body, **words, **options)
    assert len(set(tops)) == len(tops) > 10
    for scene in tops:
        path = kr.solve(scene, [0.0])
        assert path.energy[0] == pytest.approx(energy, abs=2e-14 * energy)
        assert path.vertical_momentum[0] == pytest.approx(vertical, abs=2e-14)


def test_the_ith_start_depends_only_on_the_seed_and_i():
    words = {"energy": 2.0, "vertical": 1.0, "gravity": 1}
    many = kr.starts(ASYMMETRIC, n=20, seed=3, **words)
    assert kr.starts(ASYMMETRIC, n=5, seed=3, **words) == many[:5]
    assert not set(kr.starts(ASYMMETRIC, n=20, seed=4, **words)) & set(many)
    assert kr.starts(ASYMMETRIC, n=0, **words).shape == (0,)


def test_a_seed_gives_the_same_starts_in_every_version():
    tops = kr.starts(ASYMMETRIC, energy=2.0, vertical=1.0, n=2, seed=7, gravity=1)
    first = [0.9115183727699853, 0.1931344077567047, -0.3630886346929978, 0.0]
    assert tops.attitude[0] == pytest.approx(first, abs=1e-12)
    second = [-3.7700409266300934, 5.73886832164318, 1.0]
    assert tops.momentum[1] == pytest.approx(second, abs=1e-12)


def test_random_starts_are_uniform_on_the_energy_surface():
    """Check the heights z of a Lagrange top: their density is 1 / sqrt(I1 (1 - z^2) + I3 z^2)."""
    body = kr.Body.symmetric(1, 1, 0.1, 0.2)
    tops = kr.starts(body, energy=100.0, vertical=0.5, n=2000, seed=1, gravity=1)
    heights = np.sort([float(kr.solve(scene, [0.0]).apex[0, 2]) for scene in tops])
    z = np.linspace(-1, 1, 20001)
    density = 1 / np.sqrt((1 - z * z) + 0.1 * z * z)
    integral = np.concatenate(([0], np.cumsum(0.5 * (density[1:] + density[:-1]))))
    expected = np.interp(heights, z, integral / integral[-1])
    distance = abs(expected - (np.arange(2000) + 0.5) / 2000).max()
    assert 0.005 < distance < 1.63 / math.sqrt(2000)  # Kolmogorov-Smirnov test, level 1 %


def test_the_grid_contains_exactly_the_possible_starts():
    words = {"energy": 0.6, "vertical": 0.8, "gravity": 1}
    tops = kr.starts(TURNED, grid=(8, 10, 4), **words)
    z = -1 + (2 * np.arange(8) + 1) / 8
    angle = 2 * np.pi * (np.arange(10) + 0.5) / 10
    P = np.array(
        [
            (np.sqrt(1 - h * h) * np.cos(a), np.sqrt(1 - h * h) * np.sin(a), h)
            for h in z
            for a in angle
        ]
    )
    can_be = effective_potential(TURNED, 1.0, 0.8, P) <= 0.6
    assert 0 < can_be.sum() < 80 and len(tops) == 4 * can_be.sum()
    verticals = np.array([matrix(scene.attitude).T @ (0, 0, 1) for scene in tops])
    np.testing.assert_allclose(verticals, np.repeat(P[can_be], 4, axis=0), atol=1e-15)


def least_energy(body, **words):
    with pytest.raises(ValueError, match=r"no start has energy = -100\.0") as error:
        kr.starts(body, energy=-100, n=3, **words)
    return float(re.search(r"this value is ([-+.\de]+)$", str(error.value))[1])


@pytest.mark.parametrize("body", [ASYMMETRIC, TURNED, CONE, WATER, ROUND])
@pytest.mark.parametrize("vertical, gravity", [(0.0, 1.0), (1.5, 0.7), (7.2, 1.0), (30.0, -1.3)])
def test_impossible_energies_raise_with_the_least_energy(body, vertical, gravity):
    words = {"vertical": vertical, "gravity": gravity}
    least = least_energy(body, **words)
    rng = np.random.default_rng(8)
    P = rng.normal(size=(200000, 3))
    P /= np.linalg.norm(P, axis=1)[:, None]
    minimum = effective_potential(body, gravity, vertical, P).min()
    size = max(abs(minimum), body.mass * abs(gravity) * np.linalg.norm(body.com), 0.01)
    assert least <= minimum + 1e-14 * size and minimum - least < 1e-3 * size
    assert len(kr.starts(body, energy=least + 0.01 * size, n=3, **words)) == 3


def test_the_least_energy_is_the_same_in_any_unit_of_length():
    for vertical in (0.5, 1.5, 6.0):
        least = least_energy(TURNED, vertical=vertical, gravity=0.7)
        for unit in (1e-3, 1e3):
            inertia, com = np.array(TURNED.inertia) * unit**2, np.array(TURNED.com) * unit
            other = kr.Body(TURNED.mass, inertia.tolist(), com.tolist())
            energy = least_energy(other, vertical=vertical * unit, gravity=0.7 / unit)
            assert energy == pytest.approx(least, rel=1e-13)


@pytest.mark.parametrize("body", [ASYMMETRIC, TURNED, CONE])
def test_starts_are_found_close_to_the_least_energy(body):
    least = -body.mass * np.linalg.norm(body.com)
    for excess in (1e-3, 1e-6, 1e-9, 1e-12):
        tops = kr.starts(body, energy=least * (1.0 - excess), vertical=0.0, n=50, gravity=1)
        energy = kr.solve(tops, [0.0]).energy[:, 0]
        assert np.abs(energy - least * (1.0 - excess)).max() < 2e-15 * abs(least)
        hanging = 1.0 + kr.solve(tops, [0.0]).apex[:, 0, 2]
        assert hanging.max() < 1.001 * excess + 1e-15 and hanging.min() < 0.5 * excess


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
        ({"grid": (1, 1, 1), "energy": -3.9}, ValueError, "use a finer grid"),
        ({"n": 3, "vertical": 1e200}, ValueError, r"vertical = 1e\+200 is too large"),
        ({"n": 3, "vertical": -1e90}, ValueError, r"vertical = -1e\+90 is too large"),
        ({"n": 3, "energy": 1e308}, ValueError, r"energy = 1e\+308 is too large"),
        ({"grid": (2, 2), "gravity": 1e200}, ValueError, r"mass gravity \|com\| .* is too large"),
        ({"n": 30, "body": NEEDLE}, ValueError, "or the body is nearly a line"),
    ],
)
def test_invalid_arguments_are_refused(words, exception, message):
    with pytest.raises(exception, match=message):
        kr.starts(**{"body": ASYMMETRIC, "energy": 2.0, "vertical": 0.1, "gravity": 1, **words})


def test_a_start_with_exactly_the_least_energy_exists():
    arguments = {"body": TOP.body, "vertical": 1.0, "gravity": 1, "n": 0}
    with pytest.raises(ValueError, match="the smallest energy with this value is") as error:
        kr.starts(energy=-5.0, **arguments)
    least = float(str(error.value).split()[-1])
    assert kr.starts(energy=least, **arguments).shape == (0,)
    with pytest.raises(ValueError, match="no start has energy"):
        kr.starts(energy=math.nextafter(least, -9.0), **arguments)
    level = kr.starts(BALL, energy=1.0 + 1e-12, vertical=1.0, n=3)
    np.testing.assert_allclose(level.momentum, [(0, 0, 1)] * 3, atol=2e-6)


def test_zero_starts_may_be_requested():
    assert kr.starts(TOP.body, energy=2.0, vertical=1.0, n=0, gravity=1).shape == (0,)
    for wrong in ({"n": -1}, {"n": 3, "seed": -1}, {"grid": (0, 3)}, {"grid": (1, 2, 0)}):
        *_, name = wrong
        with pytest.raises(ValueError, match=rf"^{name} must be at least \d and less than 2\*\*63"):
            kr.starts(TOP.body, energy=2.0, vertical=1.0, gravity=1, **wrong)


def test_starts_do_not_depend_on_the_block_size(monkeypatch):
    arguments = {"energy": 2.0, "vertical": 1.0, "gravity": 1, "n": 11, "seed": 6}
    whole = kr.starts(TOP.body, **arguments)
    monkeypatch.setattr(starts, "_ROWS", 4)
    parts = kr.starts(TOP.body, **arguments)
    assert np.array_equal(parts.momentum, whole.momentum)
    assert np.array_equal(parts.attitude, whole.attitude)


@pytest.mark.parametrize("grid", [(3, 4), (2, 3, 1), (2, 3, 2), (2, 3, 5)])
@pytest.mark.parametrize("body", [TOP.body, THESIS.body, FREE.body, BALL])
def test_grid_starts_are_distinct_and_on_the_energy_surface(grid, body):
    tops = kr.starts(body, energy=6.0, vertical=-0.5, grid=grid, gravity=-0.5)
    assert len(tops) == math.prod(grid) * (2 if len(grid) == 2 else 1)
    rows = np.concatenate([tops.momentum, tops.attitude], axis=1).round(9)
    assert len(np.unique(rows, axis=0)) == len(rows)
    path = kr.solve(tops, [0.0])
    np.testing.assert_allclose(path.energy[:, 0], 6.0, rtol=1e-13)
    np.testing.assert_allclose(path.vertical_momentum[:, 0], -0.5, rtol=1e-12)


def test_verticals_are_rotated_by_the_smallest_angle():
    ways = np.array([(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0), (0.6, 0, -0.8), (0, 0.6, 0.8)])
    turns = starts._compute_rotations_to_vertical(ways.astype(float))
    expected = np.array(
        [
            (1, 0, 0, 0),
            (0, 1, 0, 0),
            (math.sqrt(0.5), 0, -math.sqrt(0.5), 0),
            (math.sqrt(0.5), -math.sqrt(0.5), 0, 0),
            (math.sqrt(0.1), 0, -math.sqrt(0.9), 0),
            (math.sqrt(0.9), math.sqrt(0.1), 0, 0),
        ]
    )
    np.testing.assert_allclose(turns, expected, atol=1e-15)
    attitudes = starts._compute_rotations_to_vertical(np.array([[3e-9, 4e-9, -1.0]]))
    np.testing.assert_allclose(attitudes, [(2.5e-9, 0.8, -0.6, 0)], rtol=1e-7)


def test_cells_cover_a_sphere_and_are_halved_across_their_longer_side():
    cover = starts._SphereCells(*(np.array([x]) for x in (-1.0, 0.0, 1.0, 0.5 * math.pi)))
    whole = cover
    for _ in range(5):
        whole = whole.halve_sphere_cells()
    assert len(whole.height) == 32
    assert (whole.tall * whole.wide).sum() == pytest.approx(0.5 * math.pi, rel=1e-14)
    centres, reach = whole.compute_cell_centres_and_radii()
    corners = np.stack(
        [
            starts._convert_to_sphere_points(
                whole.height + a * whole.tall, whole.angle + b * whole.wide
            )
            for a, b in itertools.product((0.0, 0.5, 1.0), repeat=2)
        ]
    )
    angles = np.arccos(np.clip((corners * centres).sum(axis=-1), -1.0, 1.0))
    assert (angles <= reach + 1e-7).all() and reach.max() < 0.75
    tall = starts._SphereCells(
        *(np.array([x]) for x in (-0.5, 0.0, 1.0, 0.25))
    ).halve_sphere_cells()
    assert tall.tall.tolist() == [0.5, 0.5] and tall.height.tolist() == [-0.5, 0.0]
    wide = starts._SphereCells(*(np.array([x]) for x in (-0.1, 1.0, 0.2, 2.0))).halve_sphere_cells()
    assert wide.wide.tolist() == [1.0, 1.0] and wide.angle.tolist() == [1.0, 2.0]


def test_the_least_energy_is_the_lower_of_two_minima():
    for side in (1.0, -1.0):
        body = kr.Body(1.0, (1.0, 2.0, 2.5), (0.0, 0.0, side * 1e-5))
        with pytest.raises(ValueError, match="the smallest energy with this value is") as error:
            kr.starts(body, energy=-5.0, vertical=1.0, n=1, gravity=1)
        least = float(str(error.value).split()[-1])
        assert least == pytest.approx(0.2 - 1e-5, abs=1e-12)


def test_few_cells_give_starts_on_the_energy_surface_too(monkeypatch):
    monkeypatch.setattr(starts, "_HALVINGS", 1)
    tops = kr.starts(kr.scenes.asymmetric.body, energy=2.0, vertical=1.0, n=5, seed=2, gravity=1)
    path = kr.solve(tops, [0.0])
    assert np.allclose(path.energy, 2.0, rtol=1e-12)
    assert np.allclose(path.vertical_momentum, 1.0, rtol=1e-12)
