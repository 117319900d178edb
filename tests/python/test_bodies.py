"""Tests of bodies: shapes, sums, turns, arrays of bodies, kinds, bodies that cannot exist."""

import copy
import dataclasses
import pickle
import re
import warnings
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tops import CORNER, TILT, matrix, unit, words_for

EPS = 2.0**-52
PIVOT = (0.3, -0.2, 0.7)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)
TURN = (0, 2 * np.pi)
WATER = (0.345, 0.653, 1.0)
MISTAKE = {"mass": 0.5, "inertia": (2e-4, 2e-4, 1e-4), "com": (0, 0, 0.1)}  # about that centre
MISTAKE_TOML = "momentum = [0, 0, 1]\ngravity = 1\n[body]\nmass = 0.5\ncom = [0, 0, 0.1]\n"
TOLD = "no body has this inertia about the fixed point"


def fill(place, density, *ranges):
    """Return points of a body and their volumes, by Gauss quadrature over its parameters."""
    grids = [0.5 * (a + b) + 0.5 * (b - a) * NODES for a, b in ranges]
    sizes = [0.5 * (b - a) * WEIGHTS for a, b in ranges]
    u = np.stack(np.meshgrid(*grids, indexing="ij")).reshape(len(ranges), -1)
    volumes = np.prod(np.stack(np.meshgrid(*sizes, indexing="ij")).reshape(len(ranges), -1), axis=0)
    points = np.stack(np.broadcast_arrays(*place(*u)), axis=-1)
    return points, volumes * density(*u)


def round_place(r, phi, z=0.0):
    return r * np.cos(phi), r * np.sin(phi), z


def ball_place(cos, phi, r=1.0):
    rho = r * np.sqrt(1 - cos * cos)
    return rho * np.cos(phi), rho * np.sin(phi), r * cos


HALF = (0.5, 1.5, 2.0)
CORNERS = np.array([(0, 1, 0), (2, 1, 0), (0, 3, 0), (0, 1, 1.5)])
TETRAHEDRON = CORNERS[[(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]]
BALL = (-1, 1), TURN, (0, 1)
# A constructor, its lengths, points with their volumes, and whether the body has a volume
SHAPES = {
    "cuboid": ("cuboid", {"half": HALF}, True,
        fill(lambda x, y, z: (x, y, z), lambda *_: 1.0, *((-h, h) for h in HALF))),
    "cylinder": ("cylinder", {"radius": 0.5, "height": 2}, True,
        fill(round_place, lambda r, *_: r, (0, 0.5), TURN, (-1, 1))),
    "tube": ("tube", {"inner": 0.3, "outer": 0.5, "height": 2}, True,
        fill(round_place, lambda r, *_: r, (0.3, 0.5), TURN, (-1, 1))),
    "cone": ("cone", {"radius": 0.5, "height": 2}, True,
        fill(lambda r, phi, z: round_place(r * z, phi, z), lambda r, _, z: r * z * z,
            (0, 0.25), TURN, (0, 2))),
    "sphere": ("sphere", {"radius": 1}, True, fill(ball_place, lambda *u: u[2] ** 2, *BALL)),
    "ellipsoid": ("ellipsoid", {"half": HALF}, True,
        fill(lambda *u: [h * x for h, x in zip(HALF, ball_place(*u), strict=True)],
            lambda *u: np.prod(HALF) * u[2] ** 2, *BALL)),
    "shell": ("sphere", {"radius": 1, "shell": True}, False,
        fill(ball_place, lambda *_: 1.0, *BALL[:2])),
    "disk": ("disk", {"radius": 0.5}, False, fill(round_place, lambda r, _: r, (0, 0.5), TURN)),
    "rod": ("rod", {"length": 3}, False,
        fill(lambda z: (0 * z, 0 * z, z), lambda z: 1.0, (-1.5, 1.5))),
    "profile": ("from_profile", {"profile": [(0.2, 1), (0.7, 3), (0.7, 1)]}, True,
        fill(lambda z, phi, u: round_place(0.7 + 0.25 * u * (z - 3), phi, z),
            lambda z, _, u: (0.7 + 0.25 * u * (z - 3)) * 0.25 * (3 - z), (1, 3), TURN, (0, 1))),
    "mesh": ("from_mesh", {"mesh": TETRAHEDRON, "scale": 0.5}, True,
        fill(lambda s, u, v: (s * (1 - u), 0.5 + s * u * (1 - v), 0.75 * s * u * v),
            lambda s, u, _: 0.75 * s * s * u, (0, 1), (0, 1), (0, 1))),
}  # fmt: skip


def make(name, **words):
    return getattr(kr.Body, SHAPES[name][0])(**SHAPES[name][1], **words)


def get_tensor(body):
    tensor = np.array(body.inertia)
    return np.diag(tensor) if tensor.ndim == 1 else tensor


def compute_inertia(masses, points):
    """Return the inertia tensor and the centre of mass of points."""
    products = np.einsum("n,ni,nj->ij", masses, points, points)
    return np.eye(3) * products.trace() - products, masses @ points / masses.sum()


# Shapes


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("pivot", [PIVOT, (0, 1.0, 0)])
def test_a_shape_has_the_inertia_and_the_mass_of_the_integral(name, pivot):
    points, volumes = SHAPES[name][3]
    body = make(name, pivot=pivot, mass=2.5)
    inertia, com = compute_inertia(2.5 * volumes / volumes.sum(), points - pivot)
    np.testing.assert_allclose(get_tensor(body), inertia, rtol=0, atol=1e-13)
    np.testing.assert_allclose(body.com, com, rtol=0, atol=1e-14)
    assert body.mass == 2.5 and not body.unphysical
    if SHAPES[name][2]:
        dense = make(name, pivot=pivot, density=3.0)
        assert dense.mass == pytest.approx(3.0 * volumes.sum(), rel=1e-13)
        again = make(name, pivot=pivot, mass=dense.mass)
        np.testing.assert_allclose(dense.inertia, again.inertia, rtol=1e-13)


@pytest.mark.parametrize(
    "maker, sizes, moments",
    [
        ("tube", {"inner": 2, "outer": 2, "height": 6}, (5, 5, 4)),
        ("tube", {"inner": 0, "outer": 2, "height": 6}, (4, 4, 2)),
        ("tube", {"inner": 2, "outer": 2, "height": 0}, (2, 2, 4)),
        ("cone", {"radius": 2, "height": 4}, (0.6 * 17, 0.6 * 17, 1.2)),  # Landau and Lifshitz, 32
    ],
)
def test_moments_agree_with_textbooks(maker, sizes, moments):
    body = getattr(kr.Body, maker)(**sizes, pivot=(0, 0, 0), mass=1)
    np.testing.assert_allclose(body.moments, moments, rtol=1e-15)


@pytest.mark.parametrize("is_text", [False, True])
def test_an_stl_file_is_read_in_both_forms(is_text, tmp_path):
    file = tmp_path / "part.STL"
    if is_text:
        rows = ["vertex " + " ".join(map(str, corner)) for corner in TETRAHEDRON.reshape(-1, 3)]
        facets = ["\n".join(rows[i : i + 3]) for i in range(0, 12, 3)]
        file.write_text("solid part\nfacet\n" + "\nendfacet\nfacet\n".join(facets))
    else:
        facets = b"".join(bytes(12) + one.astype("<f4").tobytes() + bytes(2) for one in TETRAHEDRON)
        file.write_bytes(b"solid".ljust(80) + (4).to_bytes(4, "little") + facets)
    assert kr.Body.from_mesh(file, PIVOT, mass=2, scale=0.5) == make("mesh", pivot=PIVOT, mass=2)
    inside_out = kr.Body.from_mesh(TETRAHEDRON[:, ::-1], PIVOT, mass=2, scale=0.5)
    np.testing.assert_allclose(inside_out.inertia, make("mesh", pivot=PIVOT, mass=2).inertia)
    file.write_bytes(file.read_bytes()[:-30])
    with pytest.raises(ValueError, match=r"STL|closed"):
        kr.Body.from_mesh(file, PIVOT, mass=2)


@pytest.mark.parametrize(
    ("root", "link", "inertial", "turn"),
    [
        ("robot", "link", '<origin xyz="0 .2 .1" rpy=".3 .2 -.5"/><mass value="2"/><inertia '
            'ixx=".02" iyy=".03" izz=".015" ixy=".001" ixz="0" iyz="-.002"/>',
            Rotation.from_euler("xyz", [0.3, 0.2, -0.5])),
        ("mujoco", "body", ' pos="0 .2 .1" mass="2" diaginertia=".02 .03 .015" quat="1 .5 -.5 .7"',
            Rotation.from_quat([0.5, -0.5, 0.7, 1])),
        ("mujoco", "body", ' pos="0 .2 .1" mass="2" fullinertia=".02 .03 .015 .001 0 -.002"',
            Rotation.identity()),
    ],
)  # fmt: skip
def test_model_files_give_the_inertia_of_a_link(root, link, inertial, turn, tmp_path):
    text = f"<inertial{'' if link == 'body' else '>'}{inertial}"
    text += "/>" if link == "body" else "</inertial>"
    file = tmp_path / "model.xml"
    file.write_text(f'<{root}><{link} name="top">{text}</{link}><{link} name="base"/></{root}>')
    given = np.array([(0.02, 0.001, 0), (0.001, 0.03, -0.002), (0, -0.002, 0.015)])
    given = np.diag(given.diagonal()) if "diag" in inertial else given
    matrix = turn.as_matrix()
    expected = kr.Body.from_com(2, matrix @ given @ matrix.T, (0, 0.2, 0.1), PIVOT)
    body = kr.Body.from_model(file, pivot=PIVOT)
    np.testing.assert_allclose(body.inertia, expected.inertia, atol=1e-15)
    assert body.com == expected.com and kr.Body.from_model(file, "top", pivot=PIVOT) == body
    for wrong, word in {"base": "no inertial", "tp": "did you mean 'top'"}.items():
        with pytest.raises(ValueError, match=word):
            kr.Body.from_model(file, wrong)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("<robot>", "neither"),
        ("<sdf/>", "its root is sdf"),
        ("<robot/>", "0 bodies with inertial data"),
        (
            '<robot><link name="top"><inertial><mass/></inertial></link></robot>',
            "value must have 1",
        ),
        ('<mujoco><body name="top"><inertial euler="0 0 1"/></body></mujoco>', "as quat"),
        ('<mujoco><body><inertial mass="1" pos="0 0 0" quat="0 0 0 0"/></body></mujoco>', "zero"),
    ],
)
def test_model_files_without_inertial_data_are_refused(text, word, tmp_path):
    file = tmp_path / "model.xml"
    file.write_text(text)
    with pytest.raises(ValueError, match=word):
        kr.Body.from_model(file)


# Sums, shifts, turns


def test_parts_add_up_to_the_whole_body():
    whole = kr.Body.cuboid((1, 0.5, 2), (0.2, 0.3, -2), density=1.5)
    parts = [kr.Body.cuboid((0.5, 0.5, 2), (0.2 + x, 0.3, -2), density=1.5) for x in (0.5, -0.5)]
    np.testing.assert_allclose((parts[0] + parts[1]).inertia, whole.inertia, rtol=1e-14)
    np.testing.assert_allclose((parts[0] + parts[1]).com, whole.com, rtol=1e-14)
    pivot = (0, 0, -0.06)
    top = kr.Body.disk(0.05, pivot, mass=0.5) + kr.Body.rod(0.12, pivot, mass=0.02)
    across = 0.5 * (0.05**2 / 4 + 0.06**2) + 0.02 * 0.12**2 / 3
    np.testing.assert_allclose(top.moments, (across, across, 0.5 * 0.05**2 / 2), rtol=1e-15)
    assert top.mass == 0.52 and top.kind == "lagrange" and top.com == pytest.approx((0, 0, 0.06))
    with pytest.raises(TypeError, match="unsupported operand"):
        whole + 1


@pytest.mark.parametrize("name", SHAPES)
def test_a_shift_moves_the_body_and_a_turn_rotates_it(name):
    body, by = make(name, pivot=PIVOT, mass=2), np.array((-0.4, 0.9, 0.25))
    expected = make(name, pivot=PIVOT - by, mass=2)
    np.testing.assert_allclose(body.shift(by).inertia, expected.inertia, rtol=0, atol=2e-14)
    np.testing.assert_allclose(body.shift(by).com, expected.com, rtol=0, atol=1e-15)
    turned, axes = body.turn(TILT), matrix(TILT)
    np.testing.assert_allclose(turned.inertia, axes @ get_tensor(body) @ axes.T, rtol=0, atol=4e-14)
    np.testing.assert_allclose(turned.com, axes @ body.com, rtol=0, atol=1e-15)
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    again = body.turn(Rotation.from_quat((*TILT[1:], TILT[0])))
    np.testing.assert_allclose(again.inertia, turned.inertia, rtol=0, atol=4e-14)


def test_sums_and_turns_keep_options_and_rotors():
    water = kr.Body(1, (0.345, 0.653, 1.0), (0, 0, 0), inertia_rtol=0.0021)
    lever = kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True, rotor=(0, 0, 2.0))
    for body in (water + lever, lever + water):
        assert body.inertia_rtol == 0.0021 and body.unphysical and body.rotor == (0, 0, 2.0)
    assert lever.turn(TILT).unphysical and lever.shift((0, 0, 1)).unphysical
    assert lever.turn(TILT).rotor == pytest.approx(tuple(matrix(TILT) @ (0, 0, 2.0)))
    assert water.turn(TILT).inertia_rtol == 0.0021


def test_a_rod_on_its_own_line_is_only_a_part_of_a_body():
    line, disk = kr.Body.rod(0.12, (0, 0, -0.06), mass=0.02), kr.Body.disk(0.05, (0, 0, 0), mass=1)
    tilted, longer = line.turn(TILT), line + line.shift((0, 0, 0.12))
    rotating = line.with_rotor(spin=2.0, inertia=0.5, axis=(1, 0, 2))
    for part in (line, tilted, longer, rotating, line.shift((0, 0, 5))):
        for use in (lambda part=part: part.moments, lambda part=part: part.kind):
            with pytest.raises(ValueError, match="thin rod whose fixed point lies on its own line"):
                use()
        assert pickle.loads(pickle.dumps(part)) == part and hash(part) == hash(part)
        assert repr(part).startswith("ThinRods(mass=")
        assert (part + disk).mass == part.mass + 1
    assert longer.mass == 0.04 and longer.com == pytest.approx((0, 0, 0.12), rel=1e-15)
    assert min(line.shift((0.1, 0, 0)).moments) > 1e-5 and min((line + tilted).moments) > 1e-6
    assert (rotating + disk).rotor == rotating.shift((0, 0, 1)).rotor == rotating.rotor
    assert rotating + disk == (line + disk).with_rotor(spin=2.0, inertia=0.5, axis=(1, 0, 2))
    with pytest.raises(AttributeError, match="no attribute 'mas'"):
        _ = line.mas


# Inertia and axes


@pytest.mark.parametrize("scale", [1e-40, 1, 1e40])
def test_the_axes_diagonalise_the_inertia(scale):
    rng = np.random.default_rng(3)
    for _ in range(20):
        half, pivot = rng.uniform(0.1, 1, 3), rng.uniform(-1, 1, 3)
        body = kr.Body.cuboid(half=half * scale, pivot=pivot * scale, density=scale**-2)
        axes, tensor = matrix(body.axes), np.array(body.inertia)
        error = axes.T @ tensor @ axes - np.diag(body.moments)
        assert np.abs(error).max() < 2e-15 * np.abs(tensor).max()
        np.testing.assert_allclose(axes @ body.principal_com, body.com, rtol=0, atol=2e-15 * scale)


def test_the_inertia_may_be_given_about_the_centre_of_mass():
    half, mass = np.array((0.6, 0.8, 1.0)), 8 * 0.48
    about_com = mass / 3 * ((half**2).sum() - half**2)
    body = kr.Body.from_com(mass, about_com, com=(5, 6, 7), pivot=(5.1, 5.8, 6))
    np.testing.assert_allclose(body.inertia, CORNER.inertia, rtol=1e-14)
    np.testing.assert_allclose(body.com, CORNER.com, rtol=1e-14)
    named = kr.Body(mass, inertia_about_com=about_com, com=(5 - 5.1, 6 - 5.8, 1))
    np.testing.assert_allclose(named.inertia, body.inertia, rtol=1e-14)
    central = kr.Scene.from_toml(MISTAKE_TOML + "inertia_about_com = [2e-4, 2e-4, 1e-4]").body
    np.testing.assert_allclose(central.moments, (0.0052, 0.0052, 1e-4), rtol=1e-15)
    assert dataclasses.replace(central, mass=0.4).inertia == central.inertia


def test_principal_axes_of_symmetric_bodies_are_the_given_axes():
    body = kr.Body.symmetric(mass=2, i1=3, i3=1, height=0.5)
    assert body == kr.Body(mass=2, inertia=(3, 3, 1), com=(0, 0, 0.5))
    assert body.kind == "lagrange" and body.axes == (1, 0, 0, 0) and body.moments == (3, 3, 1)
    diagonal = kr.Body(mass=1, inertia=np.diag([3, 1, 2.5]), com=(0.1, 0.2, 0.3))
    assert diagonal.inertia == diagonal.moments == (3, 1, 2.5)
    turn = matrix(TILT)
    turned = kr.Body(1, turn @ np.diag([2, 2, 1.5]) @ turn.T, turn @ (0, 0, 0.7))
    np.testing.assert_allclose(turned.moments, (2, 2, 1.5), rtol=1e-15)
    np.testing.assert_allclose(turned.principal_com, (0, 0, 0.7), rtol=0, atol=1e-15)
    for inertia in ((2, 2, 2), turn @ (2 * np.eye(3)) @ turn.T):
        assert kr.Body(mass=1, inertia=inertia, com=(0.1, 0.2, 0.3)).axes == (1, 0, 0, 0)


# Kinds


def make_turned_body(moments, com, rng):
    """Return a body whose inertia tensor is given in randomly turned axes."""
    turn = matrix(unit(rng.normal(size=4)))
    tensor = turn @ np.diag(moments) @ turn.T
    return kr.Body(1, 0.5 * (tensor + tensor.T), turn @ com, unphysical=True)


@pytest.mark.parametrize(
    "kind, moments, com",
    [
        *(("lagrange", (1 + s * d, 1 + s * d, 1), (0, 0, s * 0.7))
          for d in (0.4, 1e-4, 1e-7, 1e-11) for s in (1, -1)),
        ("lagrange", (1, 1, 1), (0.3, -0.2, 0.9)),
        ("kowalewski", (2, 2, 1), (0.3, 0, 0)),
        ("goryachev_chaplygin", (4, 4, 1), (0.3, 0, 0)),
        ("euler", (1, 2, 1.5), (0, 0, 0)),
        ("general", (1, 2, 1.5), (0.3, 0, 0)),
    ],
)  # fmt: skip
def test_kinds_are_recognized_in_turned_axes(kind, moments, com):
    rng = np.random.default_rng(3)
    for _ in range(60):
        body = make_turned_body(moments, com, rng)
        assert body.kind == kind and body.is_symmetric == (len({*moments}) < 3)
        assert np.linalg.norm(body.principal_com) == pytest.approx(np.linalg.norm(com), rel=4 * EPS)


# Arrays of bodies

RNG = np.random.default_rng(5)
# three values, because an array of length three could be mistaken for a vector
R, H, SIDES = RNG.uniform(0.5, 2, (4, 1)), RNG.uniform(0.5, 2, 3), RNG.uniform(0.5, 2, (4, 1, 3))
PLACES = RNG.uniform(-1, 1, (3, 3))
PIVOTS = {"pivot": PLACES}
MATRICES = np.array([kr.Body.cuboid((1, 2, 3), pivot).inertia for pivot in PLACES])
MAKERS = [  # a constructor, and its arguments; those of the last dictionary are vectors or matrices
    ("cuboid", {}, {"half": SIDES, **PIVOTS}),
    ("ellipsoid", {"mass": H}, {"half": SIDES, **PIVOTS}),
    ("cylinder", {"radius": R, "height": H, "density": 0.3}, PIVOTS),
    ("tube", {"inner": 0.4, "outer": R, "height": H, "density": H}, PIVOTS),
    ("cone", {"radius": R, "height": H, "mass": 2}, {"pivot": np.array([(0, 0, -1.0)] * 3)}),
    ("disk", {"radius": R + H, "mass": 2}, PIVOTS),
    ("sphere", {"radius": R + H, "mass": 2, "shell": True}, PIVOTS),
    ("rod", {"length": R + H, "mass": 3}, PIVOTS),
    ("from_com", {"mass": R}, {"inertia_about_com": (1, 2, 2.5), "com": PLACES, **PIVOTS}),
    ("symmetric", {"mass": 0.1, "i1": R, "i3": 0.5 * H, "height": -0.2, "inertia_rtol": 0.5,
                   "unphysical": True}, {}),
    ("", {"mass": R * H}, {"inertia": RNG.uniform(2, 3, (4, 1, 3)), "com": 0.1 * PLACES}),
    ("", {"mass": R * H, "matrix": "inertia_about_com"}, {"com": 0.1 * PLACES}),
]  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*no body has this inertia")
@pytest.mark.parametrize("name, scalars, vectors", MAKERS)
def test_members_equal_single_bodies_bitwise(name, scalars, vectors):
    scalars = dict(scalars)
    matrices = {scalars.pop("matrix"): MATRICES} if "matrix" in scalars else {}
    one = getattr(kr.Body, name) if name else kr.Body
    bodies = one(**scalars, **vectors, **matrices)
    assert bodies.shape == (4, 3)
    for i in np.ndindex(4, 3):
        words = {word: np.broadcast_to(x, (4, 3))[i].item() for word, x in scalars.items()}
        words |= {word: np.broadcast_to(x, (4, 3, 3))[i] for word, x in vectors.items()}
        words |= {word: np.broadcast_to(x, (4, 3, 3, 3))[i] for word, x in matrices.items()}
        body = one(**words)
        assert bodies[i] == body and tuple(bodies.moments[i]) == body.moments
        assert tuple(bodies.axes[i]) == body.axes and tuple(bodies.com[i]) == body.com
        assert tuple(bodies.principal_com[i]) == body.principal_com
        assert (bodies.mass[i], bodies.inertia_rtol[i]) == (body.mass, body.inertia_rtol)
        assert bodies.unphysical[i] == body.unphysical


def test_shared_values_are_stored_once():
    n = 10**5
    bodies = kr.Body.symmetric(1.0, i1=np.linspace(2, 3, n), i3=1.0, height=0.5)
    assert bodies.mass.strides == (0,) and bodies.com.strides[0] == 0
    assert len(pickle.dumps(bodies)) < 60 * n
    assert not any(x.flags.writeable for x in (bodies.mass, bodies.inertia, bodies.unphysical))


def test_slices_are_bodies_and_compare_by_members():
    bodies = kr.Body.cylinder(R, H, PLACES, mass=2)
    assert bodies[1:, 2][0] == bodies[1, 2] and bodies.ravel()[7] == bodies[2, 1]
    assert bodies[[3, 0]][1, 1] == bodies[0, 1] and pickle.loads(pickle.dumps(bodies)) == bodies
    assert bodies != bodies[::-1] and bodies != 3 and bodies[:2] != bodies and len(bodies) == 4
    assert repr(bodies).startswith("<Body of shape (4, 3): radius ")
    assert [*bodies.coords] == ["radius", "height", "pivot"]


# Bodies that no mass distribution has


@pytest.mark.parametrize(
    "make",
    [
        lambda: kr.Body(**MISTAKE),
        lambda: kr.Body.symmetric(0.5, 2e-4, 1e-4, 0.1),
        lambda: kr.Body(1, matrix(TILT) @ np.diag((1, 1, 0.5)) @ matrix(TILT).T, (0.3, 0, 1.0)),
        lambda: kr.Body(1, (1, 2, 3), (0.1, 0.2, 0.01)),
        lambda: kr.Body(1, (1, 2, 2), (1e200, 1e200, 0)),
        lambda: kr.Body.from_com(1, (1, 1, 2.1), (0, 0, 1), (0, 0, 0)),
        lambda: dataclasses.replace(kr.Body.cone(1, 2, (0, 0, 0), mass=1), mass=2),
        lambda: kr.Scene.from_toml(MISTAKE_TOML + "inertia = [2e-4, 2e-4, 1e-4]").body,
        lambda: kr.Body(1, (1, 1, 1), [(0, 0, 0.1), (0, 0, 3), (0, 3, 0)])[1],
    ],
)
def test_unphysical_bodies_warn_once_at_the_calling_line(make):
    with pytest.warns(UserWarning, match=TOLD) as warned:
        body = make()
    assert len(warned) == 1 and Path(warned[0].filename) == Path(__file__) and body.unphysical
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = kr.Scene(body, (0, 0, 1e-3), gravity=1)
        run = kr.start(scene, "rk4", step=0.01)
        for again in (
            body,
            dataclasses.replace(body, mass=2 * body.mass),
            scene.replace(gravity=2).body,
            kr.Scene.from_toml(scene.to_toml()).body,
            kr.resume(run.checkpoint).scene.body,
            pickle.loads(pickle.dumps(run)).scene.body,
            copy.deepcopy(scene).body,
            eval(repr(body), {"Body": kr.Body}),
        ):
            assert again.unphysical and again.inertia == body.inertia


@pytest.mark.parametrize("scale", [1e-30, 1, 1e30])
def test_bodies_of_points_do_not_warn(scale):
    rng = np.random.default_rng(11)
    for _ in range(100):
        points = rng.normal(size=(rng.integers(3, 6), 3)) * scale
        points[:, 2] *= rng.choice([1.0, 1e-9, 0.0])
        points += rng.normal(size=3) * scale * 10 ** rng.uniform(-3, 3)
        masses = rng.uniform(0.1, 1, len(points))
        assert not kr.Body(masses.sum(), *compute_inertia(masses, points)).unphysical


def test_bodies_passed_as_unphysical_do_not_warn_and_keep_the_flag():
    body = kr.Body(1, (1, 1, 0.5), (0, 0, 1), unphysical=True)
    assert repr(body).endswith("com=(0.0, 0.0, 1.0), unphysical=True)")
    assert kr.Body.symmetric(1, 1, 0.5, 1, unphysical=True) == body
    one = dataclasses.replace(kr.Body(1, (3, 3, 1), (0, 0, 0.5)), unphysical=True)
    assert one.unphysical and dataclasses.replace(one, com=(0, 0, 5)).unphysical
    assert kr.Scene.from_toml(kr.Scene(one, (0, 0, 1), gravity=1).to_toml()).body == one
    mixed = kr.Body(1, (1, 1, 1), [(0, 0, 0.1), (0, 0, 3)], unphysical=[False, True])
    assert mixed[1].unphysical and not mixed[0].unphysical
    made_up = [name for name in kr.scenes.about if kr.scenes.get_scene(name).body.unphysical]
    assert len(made_up) == 10 and "dzhanibekov" not in made_up


# Rounded moments


def test_published_moments_are_not_changed():
    body = kr.Body(1, WATER, (0, 0, 0), inertia_rtol=0.0021)
    assert body.moments == WATER and not body.unphysical
    assert dataclasses.replace(body, mass=2).inertia_rtol == 0.0021
    scene = kr.Scene(body, (0.1, 0.2, 1.0), gravity=1)
    assert eval(repr(scene), {"Body": kr.Body, "Scene": kr.Scene}) == scene
    assert kr.Scene.from_toml(scene.to_toml()) == scene == pickle.loads(pickle.dumps(scene))
    assert kr.resume(kr.start(scene, "rk4", step=0.01).checkpoint).scene == scene
    tensor = matrix(TILT) @ np.diag(WATER) @ matrix(TILT).T
    turned = kr.Body(1, tensor, (0, 0, 0), inertia_rtol=0.0021)
    np.testing.assert_allclose(sorted(turned.moments), WATER, rtol=1e-15)
    with pytest.raises(ValueError, match="the viewer does not support a tolerance"):
        kr.view(scene, open=False)


@pytest.mark.parametrize("inertia_rtol", [0, 0.002])
def test_moments_beyond_the_tolerance_are_refused_with_a_hint(inertia_rtol):
    with pytest.raises(ValueError, match=re.escape("1.0 > 0.345 + 0.653")) as error:
        kr.Body(1, WATER, (0, 0, 0), inertia_rtol=inertia_rtol)
    hint = float(re.search(r"inertia_rtol=([\d.]+) would accept it", str(error.value))[1])
    assert kr.Body(1, WATER, (0, 0, 0), inertia_rtol=hint).moments == WATER


ROUNDED = [
    kr.Body(1, WATER, (0, 0, 0), inertia_rtol=0.0021),
    kr.Body(1, WATER, (0.1, 0.2, 0.3), inertia_rtol=0.0021, unphysical=True),
    kr.Body(1, (0.4, 0.4, 0.81), (0, 0, 0.3), inertia_rtol=0.02, unphysical=True),
]


@pytest.mark.parametrize("body", ROUNDED, ids=["water", "heavy", "lagrange"])
def test_every_method_solves_or_refuses_rounded_bodies(body):
    scene = kr.Scene(body, (0.1, 0.2, 1.0), attitude=(0.8, 0.6, 0, 0), gravity=1)
    true = kr.solve(scene, [1.0], "taylor", digits=20)
    for name, method in kr.methods.items():
        if not method.suits(scene):
            with pytest.raises(ValueError, match="does not apply to this body"):
                kr.solve(scene, 1, name, **words_for(name))
            continue
        accuracy = (
            1e-9 if method.adaptive else {1: 1e-3, 2: 5e-5, 4: 1e-10}.get(method.order, 3e-15)
        )
        limit = 3e-15 if name in ("exact", "taylor") else accuracy
        step = {} if method.adaptive or name == "exact" else {"step": 2**-9}
        path = kr.solve(scene, [1.0], name, **step)
        assert kr.attitude_error(path.q[-1], true.q[-1]) < limit, name
        assert path.energy[0] == pytest.approx(true.energy[0], abs=0.1 * limit + 3e-15), name
