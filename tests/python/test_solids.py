"""Tests of drawings of solids and of the scenery around them."""

import itertools

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from kreisel._plot import solids, stage
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

LIGHT = np.array([-0.4, -0.5, 0.77])
E20 = np.radians(20.0)


def make_axes():
    return Figure().add_subplot()


def eye_axes(elevation, azimuth):
    """Return unit vectors to the right, upward and towards the viewer as the rows of a matrix."""
    e, a = np.radians((elevation, azimuth))
    right = np.array([np.cos(a), np.sin(a), 0.0])
    towards = np.array([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)])
    return np.stack([right, np.cross(towards, right), towards])


@pytest.mark.parametrize("elevation, azimuth", [(0, 0), (20, 0), (35, 50), (-40, 170), (90, -30)])
def test_points_are_projected_onto_the_axes_of_the_eye(elevation, azimuth):
    points = np.random.default_rng(1).normal(size=(4, 5, 3))
    view = np.stack(solids.project_to_view(points, elevation, azimuth), axis=-1)
    assert view == pytest.approx(points @ eye_axes(elevation, azimuth).T)
    by_default = np.stack(solids.project_to_view(points), axis=-1)
    assert by_default == pytest.approx(points @ eye_axes(20, 0).T)


CUBE = solids.build_cuboid_faces(np.ones(3), np.zeros(3), np.eye(3))[0]


@pytest.mark.parametrize("elevation, azimuth", [(20, 30), (50, -120), (-60, 200)])
@pytest.mark.parametrize("edge", [0.0, 0.8])
def test_visible_faces_are_drawn_by_depth_and_shaded_by_the_light(elevation, azimuth, edge):
    axes = make_axes()
    base = np.linspace(0.1, 1.0, 18).reshape(6, 3)
    solid = solids.draw_solid_faces(axes, CUBE, base, elevation, azimuth, edge)
    view = eye_axes(elevation, azimuth)
    normals = CUBE.mean(axis=1)  # of a cube with edges of length 2
    depth = normals @ view[2]
    order = [k for k in np.argsort(depth) if depth[k] > 0.0]
    assert list(axes.collections) == [solid] and len(solid.get_paths()) == len(order) == 3
    for path, colour, outline, k in zip(
        solid.get_paths(), solid.get_facecolors(), solid.get_edgecolors(), order, strict=True
    ):
        assert path.vertices[:4] == pytest.approx(CUBE[k] @ view[:2].T)
        light = 0.45 + 0.55 * min(max(0.5 + 0.6 * float(normals[k] @ LIGHT), 0.0), 1.0)
        assert colour[:3] == pytest.approx(light * base[k])
        assert outline[:3] == pytest.approx((0.55 if edge else light) * base[k])
    assert list(solid.get_linewidth()) == [edge or 1.0]


@pytest.mark.parametrize(
    ("normal", "shade"),
    [((-0.4, -0.5, 0.77), 1.0), ((0.4, 0.5, -0.77), 0.45), ((0.5, -0.4, 0.0), 0.725)],
)
def test_the_light_has_a_brightest_and_a_darkest_shade(normal, shade):
    """Check the shades of faces turned towards the light, away from it, and edge-on to it."""
    across = np.cross(normal, (0.0, 0.0, 1.0))
    up = np.cross(normal, across)
    across, up = across / np.linalg.norm(across), up / np.linalg.norm(up)
    faces = np.array([[across, up, -across, -up]])
    elevation = np.degrees(np.arcsin(normal[2] / np.linalg.norm(normal)))
    azimuth = np.degrees(np.arctan2(normal[0], -normal[1]))
    solid = solids.draw_solid_faces(make_axes(), faces, "#ff8000", elevation, azimuth)
    assert solid.get_facecolors()[0, :3] == pytest.approx(shade * np.array([1.0, 128 / 255, 0.0]))


def test_a_scale_bar_is_short_enough_if_the_logarithm_is_rounded_up():
    curve = np.zeros((5, 3))
    curve[:, 0] = np.linspace(0.0, np.nextafter(400.0, 0.0), 5)
    axes = make_axes()
    solids.draw_start_and_scale_bar(curve, axes, "m", elevation=0.0)
    assert axes.texts[-1].get_text() == "50 m"


@pytest.mark.parametrize("thickness", [None, 0.4])
def test_a_tube_is_closed_and_its_ends_have_the_area_of_its_section(thickness, monkeypatch):
    face_lists = []
    monkeypatch.setattr(
        solids, "draw_solid_faces", lambda _, faces, *more: face_lists.append((faces, more))
    )
    centre = np.linspace((0.0, 0.0, 1.0), (0.0, 3.0, 5.0), 6)  # 5 long
    normals = np.tile([(1.0, 0.0, 0.0), (0.0, 0.8, -0.6)], (6, 1, 1))
    normals = normals[:, ::-1]  # the second direction of the section is across the picture
    axes = make_axes()
    solids.draw_tube(centre, normals, (1.0, 0.25), axes, thickness, "red", 10.0, 30.0)
    ((faces, more),) = face_lists
    assert more == ("red", 10.0, 30.0) and len(faces) == 5 * 24 + 2 * 12
    half = 0.5 * (4.0 / 30.0 if thickness is None else thickness)
    area = 0.5 * 24 * np.sin(2 * np.pi / 24) * half * (0.25 * half)  # of a polygon of 24 corners
    forward = np.array([0.0, 0.6, 0.8])
    sides, first, last = faces[:120], faces[120:132], faces[132:]
    vectors = [0.5 * np.cross(f[:, 2] - f[:, 0], f[:, 3] - f[:, 1]) for f in (sides, first, last)]
    turn = np.sign(vectors[2].sum(axis=0) @ forward)
    assert vectors[1].sum(axis=0) == pytest.approx(-turn * area * forward)
    assert vectors[2].sum(axis=0) == pytest.approx(turn * area * forward)
    assert vectors[0].sum(axis=0) == pytest.approx(0.0, abs=1e-12)
    points = sides.reshape(-1, 3)
    across = (points - centre[0]) @ normals[0].T / (half, 0.25 * half)
    assert np.hypot(*across.T) == pytest.approx(1.0)
    along = np.unique(np.round((points - centre[0]) @ forward, 9))
    assert along == pytest.approx(np.arange(6.0))
    assert np.sum(vectors[0] * (sides.mean(axis=1) - centre.mean(axis=0))) * turn > 0.0
    assert (first[:, 0] == centre[0]).all() and (last[:, 0] == centre[-1]).all()
    for end, point in (first, centre[0]), (last, centre[-1]):
        assert (end - point) @ forward == pytest.approx(0.0, abs=1e-12)


def test_a_tube_fills_its_axes():
    axes = make_axes()
    centre = np.linspace((0.0, 0.0, 100.0), (0.0, 0.0, 200.0), 3)
    solids.draw_tube(centre, np.tile(np.eye(3)[:2], (3, 1, 1)), (1.0, 1.0), axes)
    low, high = axes.get_ylim()
    assert (
        80.0 < low < 100.0 < 185.0 < high < 210.0 and axes.get_aspect() == 1.0 and not axes.axison
    )


@pytest.mark.parametrize(
    ("size", "length"),
    [(10.0, 2.0), (4.0, 1.0), (8.0, 2.0), (39.0, 5.0), (40.0, 10.0), (0.7, 0.1), (20.0, 5.0)],
)
@pytest.mark.parametrize("width", [0.5, 1.0])
def test_a_scale_bar_lies_below_the_end_of_its_curve(size, length, width):
    axes = make_axes()
    x = size * np.linspace(1.0, 1.0 + width, 3)
    curve = np.stack([x, np.zeros(3), size * np.array([3.0, 4.0, 3.5])], axis=-1)
    solids.draw_start_and_scale_bar(curve, axes, "km", elevation=0.0)
    dot, bar = axes.lines
    assert dot.get_xydata().tolist() == [[size, 3 * size]]
    assert (dot.get_color(), dot.get_marker(), dot.get_markersize()) == ("black", "o", 4)
    assert dot.get_zorder() == 4
    left, right, bottom = x[2] - length, x[2], 3 * size - 0.08 * size
    assert bar.get_xydata() == pytest.approx(np.array([[left, bottom], [right, bottom]]))
    assert (bar.get_color(), bar.get_linewidth(), bar.get_solid_capstyle()) == (
        "black",
        2.0,
        "butt",
    )
    start, label = axes.texts
    assert start.get_text() == "start" and label.get_text() == f"{length:g} km"
    assert label.xy == pytest.approx((0.5 * (left + right), bottom)) and label.xyann == (0, -4)
    assert (label.get_va(), label.get_ha()) == ("top", "center")
    assert start.xy == (size, 3 * size)
    assert {text.get_fontsize() for text in axes.texts} == {8}
    assert {text.get_color() for text in axes.texts} == {"black"}
    assert {text.anncoords for text in axes.texts} == {"offset points"}


@pytest.mark.parametrize(
    ("direction", "ha", "va"),
    [
        ((1, 0), "right", "center"),
        ((-1, 0), "left", "center"),
        ((0, 1), "center", "top"),
        ((0, -1), "center", "bottom"),
    ],
)
def test_the_word_start_is_written_beside_the_curve(direction, ha, va):
    axes = make_axes()
    x, z = np.outer(direction, np.linspace(0.0, 10.0, 21)) + 1.0
    solids.draw_start_and_scale_bar(np.stack([x, 0.0 * x, z], -1), axes, "m", elevation=0.0)
    start = axes.texts[0]
    assert (start.get_ha(), start.get_va()) == (ha, va)
    assert start.xyann == pytest.approx((-9 * direction[0], -9 * direction[1]))


@pytest.mark.parametrize(
    ("points", "direction"),
    [
        ([(1, 1), (4, 1), (1, 5)], (-1.0, 0.0)),
        ([(1, 1), (6, 1), (1, 4)], (0.0, -1.0)),  # the last point is exactly as far as the reach
        ([(1, 1), (1, 3), (3, 1)], (-(0.5**0.5), -(0.5**0.5))),
        ([(1, 1), (3, 1), (-1, 1)], (-1.0, 0.0)),  # no direction is better than another
    ],
)
def test_the_direction_away_from_a_curve_ignores_its_distant_points(points, direction):
    x, y = np.array(points, float).T
    assert solids._find_direction_away_from_curve(x, y, 3.0) == pytest.approx(direction)


@pytest.mark.parametrize("start", [(0.0, 0.0, 1.0), (0.36, 0.48, -0.8), (-0.8, 0.36, 0.48)])
def test_normals_turn_only_as_much_as_the_curve(start):
    rotation = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    step = np.eye(3) + 0.1 * (rotation - rotation.T)
    tangent = [np.array(start)]
    for _ in range(4):
        tangent.append(step @ tangent[-1] / np.linalg.norm(step @ tangent[-1]))
    normals = solids.compute_twist_free_normals(np.array(tangent))
    assert normals.shape == (5, 2, 3)
    axis = np.eye(3)[min(range(3), key=lambda k: abs(start[k]))]
    for t, (one, other) in zip(tangent, normals, strict=True):
        expected = axis - (axis @ t) * t
        axis = expected / np.linalg.norm(expected)
        assert one == pytest.approx(axis) and other == pytest.approx(np.cross(t, axis))


def test_drawings_are_seen_from_20_degrees_above_by_default():
    centre = np.linspace((0.0, 1.0, 2.0), (3.0, -1.0, 1.0), 4)
    normals = np.tile(np.eye(3)[:2], (4, 1, 1))
    pictures = []
    for words in ({}, {"elevation": 20.0, "azimuth": 0.0}):
        axes = make_axes()
        solids.draw_solid_faces(axes, CUBE, "red", **words)
        solids.draw_tube(centre, normals, (1.0, 1.0), axes, **words)
        solids.draw_start_and_scale_bar(centre, axes, "m", **words)
        outlines = [path.vertices for part in axes.collections for path in part.get_paths()]
        pictures.append(np.concatenate([*outlines, *(line.get_xydata() for line in axes.lines)]))
        body, tube = axes.collections
        assert list(body.get_linewidth()) == [1.0] and len(body.get_paths()) == 2
        assert tube.get_facecolors()[:, 0].max() == pytest.approx(to_rgb(solids.ORANGE)[0], rel=0.2)
    assert np.array_equal(*pictures)


# Cuboids with the inertia of a body


def moments_of_cuboid(mass, half, centre, axes):
    """Return the inertia matrix of a cuboid about the origin."""
    own = mass / 3.0 * (np.sum(half**2) - half**2)
    return axes.T @ np.diag(own) @ axes + mass * (
        centre @ centre * np.eye(3) - np.outer(centre, centre)
    )


@pytest.mark.parametrize("mass, com", [(3.0, (0.0, 0.0, 0.5)), (2.0, (0.3, -0.2, 0.4))])
def test_a_cuboid_has_the_mass_the_centre_and_the_inertia_of_its_body(mass, com):
    com = np.array(com)
    moments = np.array([2.0, 2.5, 1.5])
    half, centre, axes = solids.cuboid(mass, moments, com)
    assert centre == pytest.approx(com) and np.linalg.det(axes) == pytest.approx(1.0)
    assert moments_of_cuboid(mass, half, centre, axes) == pytest.approx(np.diag(moments), abs=1e-12)


@pytest.mark.parametrize("shift", list(itertools.product((0.2, -0.3), repeat=3)))
def test_the_axes_of_a_cuboid_are_right_handed(shift):
    axes = solids.cuboid(2.0, np.array([2.0, 2.5, 1.5]), np.array(shift))[2]
    assert np.linalg.det(axes) > 0.0 and axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize(
    ("mass", "moments", "com"),
    [
        (1.0, (1.0, 1.0, 0.1), (0.0, 0.0, 1.0)),  # moments too small for the distance of the centre
        (1.0, (0.3, 0.35, 0.1), (0.1, 0.0, 0.9)),
        (2.0, (2.0, 2.0, 0.0), (0.0, 0.0, 1.0)),  # a point mass
    ],
)
def test_a_body_without_cuboid_is_drawn_with_the_mass_of_the_largest_one(mass, moments, com):
    moments, com = np.array(moments), np.array(com)
    sizes = {}
    for k in range(1, 400):
        own_mass = mass * 1.05**k
        centre = mass * com / own_mass
        own = np.linalg.eigvalsh(
            np.diag(moments) - own_mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        )
        squares = 1.5 / own_mass * (own.sum() - 2.0 * own)
        if squares.min() >= -1e-9 * squares.max() and squares.max() > 0.0:
            edges = np.sqrt(np.maximum(squares, 1e-4 * squares.max()))
            sizes[k] = float(np.prod(edges)), np.sort(edges)
    largest = max(sizes, key=lambda k: sizes[k][0])
    half, centre, _ = solids.cuboid(mass, moments, com)
    assert centre == pytest.approx(com / 1.05**largest) and largest > 1
    assert np.sort(half) == pytest.approx(sizes[largest][1])


def test_an_impossible_body_is_drawn_by_the_ratios_of_its_moments():
    for com in np.zeros(3), np.array([0.0, 0.0, 0.1]):
        half, centre, axes = solids.cuboid(1.0, np.array([1.0, 0.25, 4.0]), com)
        assert half == pytest.approx([0.5, 0.25, 1.0]) and not centre.any()
        assert np.array_equal(axes, np.eye(3))


@pytest.mark.parametrize(
    ("moments", "ratios"),
    [
        ((0.5, 0.5, 1.0), (1.0, 1.0, 0.01)),  # a plate
        ((0.5, 0.5, 1.0 + 1e-10), (1.0, 1.0, 0.01)),
        ((0.0, 1.0, 1.0), (1.0, 0.01, 0.01)),  # a rod
        ((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)),
    ],
)
def test_a_plate_has_a_visible_thickness(moments, ratios):
    half = solids.cuboid(1.0, np.array(moments), np.zeros(3))[0]
    assert half / half.max() == pytest.approx(ratios)


@pytest.mark.parametrize("excess, is_plate", [(5e-10, True), (2e-9, False)])
def test_small_excesses_of_a_moment_count_as_rounding_errors(excess, is_plate):
    half = solids.cuboid(1.0, np.array([0.5, 0.5, 1.0 + excess]), np.zeros(3))[0]
    assert (half[2] == pytest.approx(0.01 * half[0])) == is_plate


def test_a_body_without_inertia_has_no_cuboid():
    assert solids._find_cuboid_of_same_inertia(1.0, np.zeros(3), np.zeros(3)) is None


def test_the_faces_of_a_cuboid_point_outwards_in_their_colours():
    half, centre = np.array([1.0, 2.0, 3.0]), np.array([0.5, -0.25, 1.0])
    axes = np.eye(3)[[1, 2, 0]]
    faces, colours = solids.build_cuboid_faces(half, centre, axes)
    expected = ["#c73237", "#c73237", "#d8575b", "#d8575b", "#a8262b", "#f7ecd2"]
    assert np.array_equal(colours, [to_rgb(colour) for colour in expected])
    for k, face in enumerate(faces):
        direction = (-1.0) ** (k + 1) * axes[k // 2]
        assert face.mean(axis=0) - centre == pytest.approx(direction * half[k // 2])
        area = 0.5 * np.cross(face[2] - face[0], face[3] - face[1])
        assert area == pytest.approx(direction * 4 * np.prod(half) / half[k // 2])


# Solids of revolution

BODY = [(0.62, 0.55), (0.93, 0.9), (1.0, 1.1), (0.95, 1.3), (0.7, 1.5), (0.2, 1.62)]
STEM = [(0.1, 1.68), (0.1, 2.15), (0.16, 2.2), (0.16, 2.35), (0.0, 2.4)]


@pytest.mark.parametrize(
    ("half", "height", "foot"),
    [
        (0.5, 0.25, [(0.0, -0.25)]),
        (0.5, 0.6, [(0.0, 0.0)]),
        (10.0, 13.0, [(0.0, 0.0)]),
        (0.5, 0.75, [(0.0, 0.0), (0.05, 0.01), (0.05, 0.25)]),
    ],
)
def test_a_top_has_a_foot_a_body_and_a_stem(half, height, foot):
    faces, colours = solids.build_faces_of_revolution(2.0, half, height, True)
    low = height - half
    body = [(r, low + z * half) for r, z in solids._compute_spline_points(BODY)]
    stem = [(r, low + z * half) for r, z in STEM]
    profile = np.array([*foot, *body, *stem])
    pieces = len(profile) - 1
    assert faces.shape == (96 * pieces, 4, 3) and colours.shape == (96 * pieces, 3)
    quads = faces.reshape(pieces, 96, 4, 3)
    turn = 2 * np.pi / 96 * np.arange(97)
    for corner, (up, on) in enumerate([(0, 0), (0, 1), (1, 1), (1, 0)]):
        radius, height = 2.0 * profile[up : up + pieces, :1], profile[up : up + pieces, 1:]
        angles = turn[on : on + 96]
        expected = [radius * np.cos(angles), radius * np.sin(angles), height + 0.0 * angles]
        assert np.abs(quads[:, :, corner] - np.stack(expected, axis=-1)).max() < 1e-12
    expected = np.array([to_rgb("#f7ecd2")] * 16 + [to_rgb("#c73237")] * 80)
    assert np.array_equal(colours.reshape(pieces, 96, 3), np.tile(expected, (pieces, 1, 1)))


def test_a_cylinder_is_closed_and_its_ends_have_the_area_of_a_polygon():
    faces, _ = solids.build_faces_of_revolution(2.0, 0.5, 0.3, False)
    areas = 0.5 * np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    assert faces.shape == (3 * 96, 4, 3) and np.abs(areas.sum(axis=0)).max() < 1e-12
    polygon = 0.5 * 96 * np.sin(2 * np.pi / 96) * 2.0**2
    top = areas[:, 2][faces[..., 2].min(axis=1) > 0.7]
    bottom = areas[:, 2][faces[..., 2].max(axis=1) < -0.1]
    assert (top.sum(), bottom.sum()) == pytest.approx((polygon, -polygon))
    assert (len(top), len(bottom)) == (96, 96)


def test_splines_are_bezier_curves_with_slopes_of_their_neighbours():
    knots = np.array([(0.1, 0.0), (0.3, 1.0), (0.35, 1.5), (0.8, 2.5), (0.6, 4.0)])
    curve = np.array(solids._compute_spline_points([tuple(knot) for knot in knots]))
    assert curve.shape == (17, 2) and curve[::4] == pytest.approx(knots)
    slopes = [knots[1] - knots[0], *(0.5 * (knots[2:] - knots[:-2])), knots[-1] - knots[-2]]
    for k, (p, q) in enumerate(itertools.pairwise(knots)):
        for i in range(4):
            points = [p, p + slopes[k] / 3.0, q - slopes[k + 1] / 3.0, q]
            while len(points) > 1:  # the algorithm of de Casteljau
                points = [a + i / 4.0 * (b - a) for a, b in itertools.pairwise(points)]
            assert curve[4 * k + i] == pytest.approx(points[0])


def test_splines_stay_within_the_radius_of_the_body():
    curve = np.array(
        solids._compute_spline_points([(0.5, 0.0), (1.0, 1.0), (1.0, 2.0), (0.5, 3.0)])
    )
    assert curve[:, 0].max() == 1.0 and curve[:, 1] == pytest.approx(np.arange(13) / 4.0)
    assert np.array_equal(curve[4:9, 0], np.ones(5)) and (curve[1:4, 0] < 1.0).all()


@pytest.mark.parametrize("apex", [0, 1, 2])
@pytest.mark.parametrize("height", [0.6, -0.6])
def test_a_symmetric_body_is_a_top_about_its_axis(apex, height):
    order = [(apex + 1) % 3, (apex + 2) % 3, apex]
    moments, com = np.empty(3), np.zeros(3)
    moments[order] = 1.5, 1.5, 0.5
    com[apex] = height
    faces, colours = solids.build_solid_faces(1.2, moments, com)
    half, centre, _ = solids.cuboid(1.2, moments, com)
    expected = solids.build_faces_of_revolution(
        2.0 * half[order[0]] / np.sqrt(3.0), half[apex], 0.6, True
    )
    assert centre[apex] == pytest.approx(height)
    sides = np.array([1.0, np.sign(height), np.sign(height)])
    assert np.abs(faces[..., order] - expected[0] * sides).max() < 1e-12
    assert np.array_equal(colours, expected[1])


def test_a_symmetric_body_without_a_lever_is_a_cylinder():
    faces, _ = solids.build_solid_faces(1.0, np.array([1.0, 1.0, 0.5]), np.zeros(3))
    x, y, z = faces.reshape(-1, 3).T
    assert np.hypot(x, y).max() == pytest.approx(1.0), "I3 = m R^2 / 2"
    assert np.abs(z).max() ** 2 == pytest.approx(3 * (1.0 - 0.25)), "I1 = m R^2 / 4 + m h^2 / 3"
    assert len(faces) == 3 * 96


@pytest.mark.parametrize(
    ("moments", "com", "is_round"),
    [
        ((1.0, 1.0 + 0.5e-9, 0.5), (0.0, 0.0, 0.5), True),
        ((1.0, 1.0 + 2e-9, 0.5), (0.0, 0.0, 0.5), False),
        ((1.0 + 2e-9, 1.0, 0.5), (0.0, 0.0, 0.5), False),
        ((1.0, 1.0, 0.5), (0.4e-9, 0.0, 0.5), True),
        ((1.0, 1.0, 0.5), (0.0, 2e-9, 0.5), False),
        ((1.0, 1.0, 0.5), (-2e-9, 0.0, -0.5), False),
        ((1.0, 1.1, 0.5), (0.0, 0.0, 0.0), False),
        ((0.5, 1.0, 1.0), (0.0, 0.0, 0.0), False),
    ],
)
def test_asymmetries_above_a_billionth_are_drawn(moments, com, is_round):
    faces, _ = solids.build_solid_faces(1.0, np.array(moments), np.array(com))
    assert (len(faces) > 6) == is_round


# The scenery


def unproject(points, height):
    """Return the horizontal coordinates of points of a picture that lie at a given height."""
    x, up = np.moveaxis(np.asarray(points), -1, 0)
    return np.stack([x, (up - height * np.cos(E20)) / np.sin(E20)], axis=-1)


@pytest.mark.parametrize(
    ("floor", "low"),
    [
        (0.0, -0.9 * np.sin(E20)),
        (-0.5, -0.5 * np.cos(E20) - 0.9 * np.sin(E20)),
        (-0.6, -1.08),
        (-1.0, -np.cos(E20) - 0.9 * np.sin(E20)),
    ],
)
def test_the_picture_is_a_square_around_the_sphere_and_the_floor(floor, low):
    axes = make_axes()
    stage._set_square_axis_limits(axes, floor)
    middle = 0.5 * (low + 1.3 * np.cos(E20))
    assert axes.get_xlim() == (-1.08, 1.08)
    assert axes.get_ylim() == pytest.approx((middle - 1.08, middle + 1.08))
    assert not axes.get_autoscale_on()


def test_the_floor_has_rings_and_spokes_that_fade_out():
    axes = make_axes()
    stage._draw_floor(axes, -0.4)
    (lines,) = axes.collections
    pieces = unproject(lines.get_segments(), -0.4)
    assert pieces.shape == (6 * 120 + 24 * 30, 2, 2)
    rings, spokes = pieces[:720].reshape(6, 120, 2, 2), pieces[720:].reshape(24, 30, 2, 2)
    turn = 2 * np.pi / 120 * np.arange(121)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    for k, ring in enumerate(rings):
        radius = 0.25 * (k + 1)
        assert ring[:, 0] == pytest.approx(radius * circle[:-1], abs=1e-12)
        assert ring[:, 1] == pytest.approx(radius * circle[1:], abs=1e-12)
    for k, spoke in enumerate(spokes):
        assert spoke[:, 0] == pytest.approx(
            0.05 * np.outer(np.arange(30), circle[5 * k]), abs=1e-12
        )
        assert spoke[:, 1] == pytest.approx(
            0.05 * np.outer(np.arange(1, 31), circle[5 * k]), abs=1e-12
        )
    colours = lines.get_colors()
    part = np.maximum(1.0 - np.linalg.norm(pieces.mean(axis=1), axis=-1) / 1.5, 0.0)
    assert colours[:, 3] == pytest.approx(0.35 * np.sqrt(part))
    assert (colours[:, :3] == to_rgb(stage.GRID)).all()
    assert lines.get_zorder() == 0.1 and set(lines.get_linewidth()) == {0.6}


@pytest.mark.parametrize("floor", [0.0, -0.6, -1.0])
def test_the_sphere_is_drawn_above_the_floor(floor):
    axes = make_axes()
    stage._draw_part_of_sphere_above_floor(axes, floor)
    outline, *rims = axes.lines
    turn = 2 * np.pi / 360 * np.arange(361)
    height = np.sin(turn) * np.cos(E20)
    x, y = outline.get_data()
    assert x == pytest.approx(np.cos(turn)) and np.isfinite(y[0])
    is_clear = np.abs(height - floor) > 1e-9
    assert np.array_equal(np.isfinite(y[is_clear]), height[is_clear] > floor)
    assert y[np.isfinite(y)] == pytest.approx(np.sin(turn[np.isfinite(y)]))
    assert (outline.get_linewidth(), outline.get_zorder()) == (0.8, 0.6)
    assert outline.get_color() == solids.FAINT and len(rims) == (floor > -1.0)
    for rim in rims:
        circle = unproject(rim.get_xydata(), floor)
        radius = np.sqrt(1 - floor**2)
        assert circle == pytest.approx(
            radius * np.stack([np.cos(turn), np.sin(turn)], -1), abs=1e-12
        )
        assert (rim.get_linewidth(), rim.get_alpha(), rim.get_zorder()) == (0.7, 0.7, 0.6)
    (arrow,) = axes.texts
    assert arrow.xyann == pytest.approx((0.0, np.cos(E20)))
    assert arrow.xy == pytest.approx((0.0, 1.22 * np.cos(E20)))
    assert arrow.arrowprops["color"] == solids.FAINT


def test_the_scenery_is_complete():
    axes = make_axes()
    stage.draw_floor_sphere_and_stand(axes, -0.5)
    assert len(axes.collections) == 1 and len(axes.lines) == 4 and len(axes.texts) == 1
    needle, point = axes.lines[2:]
    assert needle.get_xydata() == pytest.approx(np.array([[0, 0], [0, -0.5 * np.cos(E20)]]))
    assert (needle.get_linewidth(), needle.get_zorder()) == (2.0, 1.5)
    assert point.get_xydata().tolist() == [[0.0, 0.0]] and point.get_marker() == "o"
    assert (point.get_markersize(), point.get_zorder()) == (4.5, 1.6)
    assert needle.get_color() == point.get_color() == stage.STAND
    assert axes.get_xlim() == (-1.08, 1.08)


def test_each_point_of_the_lamp_casts_a_shadow():
    axes = make_axes()
    plate = np.array([[(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]]) * (0.1, 0.1, 1.5)
    shadow = stage.draw_body_shadow(axes, plate, -0.5)
    assert list(axes.collections) == [shadow] and shadow.get_zorder() == 0.4
    assert len(shadow.get_paths()) == 7 and list(shadow.get_linewidth()) == [0.0]
    for k, path in enumerate(shadow.get_paths()):
        middle = unproject(path.vertices[:4], -0.5).mean(axis=0)
        radius, turn = 0.05 * np.sqrt((k + 0.5) / 7), 2.39996 * k
        lamp = np.array([-0.25, -0.3]) + radius * np.array([np.cos(turn), np.sin(turn)])
        assert middle == pytest.approx(-2.0 * lamp), "the plate is 2 above the floor"
    opacity = shadow.get_facecolors()[0, 3]
    assert (1.0 - opacity) ** 7 == pytest.approx(0.7)
    assert shadow.get_facecolors()[0, :3] == pytest.approx(to_rgb(stage.SHADOW))


def test_a_shadow_consists_of_the_faces_towards_the_lamp():
    square = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)])
    kite = np.array([(1.0, 0.0), (3.0, 1.0), (1.0, 5.0), (0.0, 1.0)])
    edge = np.array([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (1.0, 1.0)])  # seen from the side
    outline = stage._join_faces_to_outline(np.array([square, square[::-1], edge, kite]))
    assert np.array_equal(outline.vertices[:5], [*square, square[0]])
    assert np.array_equal(outline.vertices[5:], [*kite, kite[0]])
    assert outline.codes.tolist() == 2 * [1, 2, 2, 2, 79]


def test_a_face_casts_a_shadow_if_its_corners_run_counterclockwise():
    faces = np.random.default_rng(5).normal(size=(60, 4, 2))
    x, y = np.moveaxis(faces, -1, 0)
    areas = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
    outline = stage._join_faces_to_outline(faces)
    assert np.array_equal(outline.vertices.reshape(-1, 5, 2)[:, :4], faces[areas > 0.0])
    solid = solids.draw_solid_faces(
        make_axes(), np.stack([x, 0.0 * x, y], axis=-1), "red", elevation=0.0
    )
    assert len(solid.get_paths()) == np.count_nonzero(areas > 0.0)
