"""Tests of homogeneous bodies, and of sums, shifts and rotations of bodies."""

import dataclasses
import pickle

import kreisel as kr
import numpy as np
import pytest
from tops import TILT, matrix

PIVOT = (0.3, -0.2, 0.7)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PHI = np.arange(12) * np.pi / 6


def gauss_nodes(a, b):
    """Return the nodes and weights of Gauss quadrature on the interval from `a` to `b`."""
    return 0.5 * (a + b) + 0.5 * (b - a) * NODES, 0.5 * (b - a) * WEIGHTS


def round_solid(inner, outer, bottom, top):
    """Return quadrature points and weights for a solid of revolution."""
    points, weights = [], []
    for z, dz in zip(*gauss_nodes(bottom, top), strict=True):
        for r, dr in zip(*gauss_nodes(inner(z), outer(z)), strict=True):
            points += [(r * np.cos(phi), r * np.sin(phi), z) for phi in PHI]
            weights += [dz * dr * r * np.pi / 6] * len(PHI)
    return np.array(points), np.array(weights)


def to_arrays(points, weights):
    return np.array(points, dtype=float), np.array(weights, dtype=float)


def ball():
    return round_solid(lambda z: 0, lambda z: np.sqrt(1 - z * z), -1, 1)


def shell():
    z, dz = NODES, WEIGHTS
    rho = np.sqrt(1 - z * z)
    points = [(r * np.cos(p), r * np.sin(p), h) for r, h in zip(rho, z, strict=True) for p in PHI]
    return to_arrays(points, np.repeat(dz, len(PHI)))


def stretch_ball(factors):
    points, weights = ball()
    return points * factors, weights * np.prod(factors)


# A constructor and its lengths; quadrature points, weights; the volume, or 0 if thin.
SHAPES = {
    "cuboid": (
        {"half": (0.6, 0.8, 1.0)},
        to_arrays(
            [(a, b, c) for a in 0.6 * NODES for b in 0.8 * NODES for c in NODES],
            0.48 * np.multiply.outer(np.multiply.outer(WEIGHTS, WEIGHTS), WEIGHTS).ravel(),
        ),
        3.84,
    ),
    "cylinder": (
        {"radius": 0.5, "height": 2.0},
        round_solid(lambda z: 0, lambda z: 0.5, -1, 1),
        np.pi * 0.5,
    ),
    "tube": (
        {"inner": 0.3, "outer": 0.5, "height": 2.0},
        round_solid(lambda z: 0.3, lambda z: 0.5, -1, 1),
        np.pi * 0.32,
    ),
    "sphere": ({"radius": 1.0}, ball(), np.pi * 4 / 3),
    "ellipsoid": ({"half": (0.5, 1.5, 2.0)}, stretch_ball((0.5, 1.5, 2.0)), np.pi * 2),
    "cone": (
        {"radius": 0.5, "height": 2.0},
        round_solid(lambda z: 0, lambda z: z / 4, 0, 2),
        np.pi / 6,
    ),
    "disk": (
        {"radius": 0.5},
        to_arrays(
            [(r * np.cos(p), r * np.sin(p), 0) for r in gauss_nodes(0, 0.5)[0] for p in PHI],
            np.repeat(gauss_nodes(0, 0.5)[1] * gauss_nodes(0, 0.5)[0], len(PHI)),
        ),
        0,
    ),
    "rod": ({"length": 3.0}, to_arrays([(0, 0, z) for z in 1.5 * NODES], WEIGHTS), 0),
    "shell": ({"radius": 1.0, "shell": True}, shell(), 0),
}
MAKERS = {"shell": "sphere"}


def make(name, **words):
    return getattr(kr.Body, MAKERS.get(name, name))(**SHAPES[name][0], **words)


def integrate_inertia(points, weights, mass, pivot):
    """Return the inertia tensor and the centre of mass relative to `pivot`."""
    positions, portions = points - pivot, mass * weights / weights.sum()
    products = np.einsum("n,ni,nj->ij", portions, positions, positions)
    return np.eye(3) * products.trace() - products, portions @ positions / mass


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("pivot", [PIVOT, (0, 1.0, 0)])
def test_a_shape_has_the_inertia_of_the_integral(name, pivot):
    body = make(name, pivot=pivot, mass=2.5)
    inertia, com = integrate_inertia(*SHAPES[name][1], 2.5, pivot)
    tensor = np.array(body.inertia)
    np.testing.assert_allclose(np.diag(tensor) if tensor.ndim == 1 else tensor, inertia, atol=4e-14)
    np.testing.assert_allclose(body.com, com, atol=2e-15)
    assert body.mass == 2.5 and not body.unphysical


@pytest.mark.parametrize("name", [name for name in SHAPES if SHAPES[name][2]])
def test_the_mass_is_density_times_volume(name):
    _, (_, weights), volume = SHAPES[name]
    body = make(name, pivot=PIVOT, density=3.0)
    assert body.mass == pytest.approx(3.0 * volume, rel=1e-15)
    assert weights.sum() == pytest.approx(volume, rel=1e-13)
    again = make(name, pivot=PIVOT, mass=body.mass)
    np.testing.assert_allclose(again.inertia, body.inertia, rtol=1e-15)


@pytest.mark.parametrize(
    "maker, sizes, moments",
    [
        ("cylinder", {"radius": 2, "height": 6}, (4, 4, 2)),
        ("tube", {"inner": 2, "outer": 2, "height": 6}, (5, 5, 4)),
        ("tube", {"inner": 0, "outer": 2, "height": 6}, (4, 4, 2)),
        ("tube", {"inner": 2, "outer": 2, "height": 0}, (2, 2, 4)),
        ("tube", {"inner": 0, "outer": 2, "height": 0}, (1, 1, 2)),
        ("disk", {"radius": 2}, (1, 1, 2)),
        ("sphere", {"radius": 5}, (10, 10, 10)),
        ("sphere", {"radius": 3, "shell": True}, (6, 6, 6)),
        ("ellipsoid", {"half": (1, 2, 3)}, (13 / 5, 2, 1)),
    ],
)
def test_moments_agree_with_textbooks(maker, sizes, moments):
    body = getattr(kr.Body, maker)(**sizes, pivot=(0, 0, 0), mass=1)
    np.testing.assert_allclose(body.moments, moments, rtol=1e-15)


def test_a_cone_on_its_tip_has_the_textbook_moments():
    body = kr.Body.cone(radius=2, height=4, pivot=(0, 0, 0), mass=5)
    assert body.com == (0, 0, 3) and body.kind == "lagrange"
    transverse, axial = 0.6 * 5 * (2**2 / 4 + 4**2), 0.3 * 5 * 2**2  # Landau and Lifshitz, 32
    np.testing.assert_allclose(body.moments, (transverse, transverse, axial), rtol=1e-15)


# Sums, shifts, rotations


def test_a_disk_and_a_rod_form_a_gyroscope():
    pivot = (0, 0, -0.06)
    top = kr.Body.disk(0.05, pivot, mass=0.5) + kr.Body.rod(0.12, pivot, mass=0.02)
    transverse = 0.5 * (0.05**2 / 4 + 0.06**2) + 0.02 * 0.12**2 / 3
    np.testing.assert_allclose(top.moments, (transverse, transverse, 0.5 * 0.05**2 / 2), rtol=1e-15)
    assert top.mass == 0.52 and top.kind == "lagrange" and not top.unphysical
    np.testing.assert_allclose(top.com, (0, 0, 0.06), rtol=1e-15)


def test_two_halves_add_up_to_the_whole_body():
    whole = kr.Body.cuboid((1, 0.5, 2), (0.2, 0.3, -2), density=1.5)
    halves = [kr.Body.cuboid((0.5, 0.5, 2), (0.2 + x, 0.3, -2), density=1.5) for x in (0.5, -0.5)]
    both = halves[0] + halves[1]
    assert both.mass == pytest.approx(whole.mass, rel=1e-15)
    np.testing.assert_allclose(both.inertia, whole.inertia, rtol=1e-14)
    np.testing.assert_allclose(both.com, whole.com, rtol=1e-14)


@pytest.mark.parametrize("name", SHAPES)
def test_a_shift_changes_the_pivot(name):
    vector = np.array((-0.4, 0.9, 0.25))
    shifted = make(name, pivot=PIVOT, mass=2).shift(vector)
    expected = make(name, pivot=PIVOT - vector, mass=2)
    np.testing.assert_allclose(shifted.inertia, expected.inertia, atol=1e-14)
    np.testing.assert_allclose(shifted.com, expected.com, atol=1e-15)


def test_a_rotation_rotates_inertia_and_centre_of_mass():
    body = kr.Body.cuboid((0.6, 0.8, 1), PIVOT)
    axes = matrix(TILT)
    other_body = body.turn(TILT)
    np.testing.assert_allclose(
        other_body.inertia, axes @ np.array(body.inertia) @ axes.T, atol=4e-14
    )
    np.testing.assert_allclose(other_body.com, axes @ body.com, atol=1e-15)
    np.testing.assert_allclose(sorted(other_body.moments), sorted(body.moments), rtol=1e-14)
    back = other_body.turn((TILT[0], *(-x for x in TILT[1:])))
    np.testing.assert_allclose(back.inertia, body.inertia, atol=4e-14)


def test_a_rotation_may_be_given_by_scipy():
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    rotation = Rotation.from_rotvec((0.1, -0.7, 0.4))
    body = kr.Body.cone(1, 2, (0, 0, 0), mass=1)
    np.testing.assert_allclose(body.turn(rotation).com, rotation.apply(body.com), atol=1e-15)
    with pytest.raises(ValueError, match="a single rotation"):
        body.turn(Rotation.concatenate([rotation, rotation]))


def test_sums_keep_the_options_of_their_parts():
    water = kr.Body(1, (0.345, 0.653, 1.0), (0, 0, 0), inertia_rtol=0.0021)
    lever = kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True)
    for body in (water + lever, lever + water):
        assert body.inertia_rtol == 0.0021 and body.unphysical
    assert lever.turn(TILT).unphysical and lever.shift((0, 0, 1)).unphysical
    assert water.turn(TILT).inertia_rtol == 0.0021
    with pytest.raises(TypeError, match="unsupported operand"):
        water + 1


# Rods on a line through the fixed point, which are valid only as parts of a body


def line():
    return kr.Body.rod(0.12, (0, 0, -0.06), mass=0.02)


def test_a_rod_on_its_own_line_is_refused_as_a_body():
    for use in (
        lambda: kr.Scene(line(), (0, 0, 1), gravity=1),
        lambda: line().kind,
        lambda: kr.Scene.spinning(line(), 3.0, gravity=1),
        lambda: kr.Scene.from_toml(
            "momentum = [0, 0, 1]\n[body.rod]\nlength = 1\npivot = [0, 0, 0]\nmass = 1"
        ),
        lambda: kr.starts(line(), energy=1, vertical=0, n=1, gravity=1),
    ):
        with pytest.raises(ValueError, match="thin rod whose fixed point lies on its own line"):
            use()


def test_a_rod_on_its_own_line_can_be_compared_and_copied():
    assert pickle.loads(pickle.dumps(line())) == line() and hash(line()) == hash(line())
    assert repr(line()).startswith("ThinRods(mass=0.02")
    with pytest.raises(AttributeError, match="no attribute 'mas'"):
        _ = line().mas


def test_rods_on_their_own_line_are_only_parts_of_bodies():
    tilted, longer = line().turn(TILT), line() + line().shift((0, 0, 0.12))
    for part in (tilted, longer, line().shift((0, 0, 5))):
        with pytest.raises(ValueError, match="thin rod"):
            _ = part.moments
    assert longer.mass == 0.04 and longer.com == pytest.approx((0, 0, 0.12), rel=1e-15)
    assert min(line().shift((0.1, 0, 0)).moments) > 1e-5
    assert min((line() + tilted).moments) > 1e-6
    assert (tilted + kr.Body.disk(0.05, (0, 0, 0), mass=0.5)).mass == 0.52


def test_a_rotor_on_a_rod_becomes_part_of_the_whole_body():
    disk = kr.Body.disk(0.05, (0, 0, 0), mass=0.5)
    rotor = {"spin": 2.0, "inertia": 0.5, "axis": (1, 0, 2)}
    rod = line().with_rotor(**rotor)
    assert rod.rotor == disk.with_rotor(**rotor).rotor and rod != line()
    assert repr(rod).startswith("ThinRods(") and f"rotor={rod.rotor}" in repr(rod)
    assert pickle.loads(pickle.dumps(rod)) == rod
    assert (rod + disk) == (line() + disk).with_rotor(**rotor)
    assert (rod + line()).rotor == (line() + rod).rotor == rod.shift((0, 0, 1)).rotor == rod.rotor
    assert rod.turn(TILT).rotor == pytest.approx(disk.with_rotor(**rotor).turn(TILT).rotor)
    assert dataclasses.replace(rod, mass=3.0) == dataclasses.replace(
        line(), mass=3.0, rotor=rod.rotor
    )
    text = "momentum = [0, 0, 1]\n[body]\nrotor = [0, 0, 1]\n[body.rod]\nlength = 1\n"
    for use in (
        lambda: rod.moments,
        lambda: kr.Scene(rod, momentum=(0, 0, 1), gravity=1),
        lambda: kr.Scene.from_toml(text + "pivot = [0, 0, 0]\nmass = 1"),
    ):
        with pytest.raises(ValueError, match="thin rod whose fixed point lies on its own line"):
            use()
    with pytest.raises((TypeError, ValueError), match="rotor must be 3 numbers"):
        dataclasses.replace(rod, rotor=(1.0, 2.0))


# Refusals


@pytest.mark.parametrize(
    "name, words, exception, message",
    [
        ("cylinder", {}, ValueError, "exactly one of mass and density of the cylinder, not none"),
        ("cone", {"mass": 1, "density": 1}, ValueError, "mass and density of the cone, not both"),
        (
            "cuboid",
            {"mass": 1, "density": 1},
            ValueError,
            "mass or density of the cuboid, not both",
        ),
        ("shell", {"density": 1}, ValueError, "the shell is thin .*: give its mass"),
        ("sphere", {"density": -1}, ValueError, "density must be positive, not -1"),
        ("sphere", {"mass": "1"}, TypeError, "mass must be a number, not '1'"),
        ("disk", {"density": 1}, TypeError, "density"),
        ("rod", {"mass": 0}, ValueError, "mass must be positive, not 0"),
        ("ellipsoid", {"mass": 1, "pivot": (1, 2)}, ValueError, "pivot must be 3 numbers"),
    ],
)
def test_invalid_shapes_are_refused(name, words, exception, message):
    with pytest.raises(exception, match=message):
        make(name, **{"pivot": (0, 0, 0), **words})


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: kr.Body.cylinder(-1, 1, PIVOT, mass=1), "radius must be positive, not -1"),
        (lambda: kr.Body.cylinder(1, 0, PIVOT, mass=1), "height must be positive, not 0"),
        (lambda: kr.Body.tube(2, 1, 1, PIVOT, mass=1), "inner must lie between 0 and outer = 1.0"),
        (lambda: kr.Body.tube(1, 1, 1, PIVOT, density=1), "the tube is thin"),
        (lambda: kr.Body.tube(0.5, 1, 0, PIVOT, density=1), "the tube is thin"),
        (lambda: kr.Body.tube(1, 1, -1, PIVOT, mass=1), "height must not be negative, not -1"),
        (lambda: kr.Bodies.tube(1, 1, [0, -1], PIVOT, mass=1), r"height\[1\] = -1.0: height must"),
        (lambda: kr.Body.rod(1, (1e200, 0, 0), mass=1), "inertia must be finite"),
        (lambda: line().shift((1e200, 0, 0)), "inertia must be finite"),
        (lambda: kr.Body.disk(np.nan, PIVOT, mass=1), "radius must be finite"),
        (lambda: kr.Body.ellipsoid((1, 1, 0), PIVOT, mass=1), "half must be positive"),
        (lambda: kr.Body.sphere(1, (0, 0, 0), mass=1).shift((0, 1)), "by must be 3 numbers"),
        (
            lambda: kr.Body.sphere(1, PIVOT, mass=1).turn((1, 1, 0, 0)),
            "must be a unit quaternion",
        ),
    ],
)
def test_invalid_lengths_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


# Boundary values


def test_solids_with_a_zero_edge_are_refused():
    for make in (kr.Bodies.ellipsoid, kr.Bodies.cuboid):
        for half in ([[1.0, 1.0, 0.0]], [[0.0, 1.0, 1.0], [1.0, 1.0, 1.0]]):
            with pytest.raises(ValueError, match="half"):
                make(half, (0.0, 0.0, 0.5), mass=1.0)
        assert make([[1.0, 1.0, 5e-9]], (0.0, 0.0, 0.5), mass=1.0).shape == (1,)


def test_tubes_may_have_an_empty_hole_or_wall():
    many = kr.Bodies.tube([0.0, 1.0, 0.5], 1.0, 1.0, (0.0, 0.0, 0.0), mass=1.0)
    one = [kr.Body.tube(hole, 1.0, 1.0, (0.0, 0.0, 0.0), mass=1.0) for hole in (0.0, 1.0, 0.5)]
    assert np.allclose(many.moments, [body.moments for body in one], rtol=1e-15)
    with pytest.raises(ValueError, match="inner"):
        kr.Bodies.tube([0.5, 1.0000001], 1.0, 1.0, (0.0, 0.0, 0.0), mass=1.0)
