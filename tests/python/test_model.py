"""Tests of bodies and scenes."""

import dataclasses
import json
import pickle
from functools import partial

import kreisel as kr
import numpy as np
import pytest
from kreisel import quaternion
from toolbox import ROOT
from tops import CORNER, FIXED, GENERAL, TILT, matrix, unit

RNG = np.random.default_rng(3)


# Bodies


def test_a_cuboid_about_its_corner_has_the_textbook_moments():
    a, b, c = 0.5, 1.0, 2.0
    body = kr.Body.cuboid(half=(a, b, c), pivot=(-a, -b, -c), density=3)
    mass = 24 * a * b * c
    np.testing.assert_allclose(body.com, (a, b, c), rtol=1e-15)
    expected = mass * np.array(
        [
            [4 / 3 * (b * b + c * c), -a * b, -c * a],
            [-a * b, 4 / 3 * (c * c + a * a), -b * c],
            [-c * a, -b * c, 4 / 3 * (a * a + b * b)],
        ]
    )
    np.testing.assert_allclose(body.inertia, expected, rtol=1e-15)


@pytest.mark.parametrize("scale", [1e-40, 1e-3, 1, 1e40])
def test_the_axes_diagonalise_the_inertia(scale):
    for _ in range(20):
        half, pivot = RNG.uniform(0.1, 1, 3), RNG.uniform(-1, 1, 3)
        body = kr.Body.cuboid(half=half * scale, pivot=pivot * scale, density=scale**-2)
        axes = matrix(body.axes)
        tensor = np.array(body.inertia)
        size = np.abs(tensor).max()
        np.testing.assert_allclose(
            axes.T @ tensor @ axes, np.diag(body.moments), rtol=0, atol=2e-15 * size
        )
        np.testing.assert_allclose(axes @ body.principal_com, body.com, rtol=0, atol=2e-15 * scale)


def test_from_com_agrees_with_the_cuboid():
    a, b, c = half = (0.6, 0.8, 1.0)
    mass = 8 * a * b * c
    about_com = mass / 3 * np.array([b * b + c * c, c * c + a * a, a * a + b * b])
    body = kr.Body.from_com(mass, about_com, com=(5, 6, 7), pivot=(5.1, 5.8, 6))
    np.testing.assert_allclose(
        body.inertia, kr.Body.cuboid(half, pivot=(0.1, -0.2, -1)).inertia, rtol=1e-14
    )
    np.testing.assert_allclose(body.com, CORNER.com, rtol=1e-14)


def test_a_symmetric_body_equals_a_body_with_three_moments():
    body = kr.Body.symmetric(mass=2, i1=3, i3=1, height=0.5)
    assert body == kr.Body(mass=2, inertia=(3, 3, 1), com=(0, 0, 0.5))
    assert body.kind == "lagrange" and body.axes == (1, 0, 0, 0) and body.moments == (3, 3, 1)


def test_diagonal_inertia_is_its_own_frame():
    body = kr.Body(mass=1, inertia=np.diag([3, 1, 2.5]), com=(0.1, 0.2, 0.3))
    assert body.inertia == body.moments == (3, 1, 2.5) and body.com == body.principal_com == (
        0.1,
        0.2,
        0.3,
    )


def test_a_rotated_lagrange_top_has_its_axis_as_third_principal_axis():
    turn = matrix(TILT)
    body = kr.Body(mass=1, inertia=turn @ np.diag([2, 2, 1.5]) @ turn.T, com=turn @ (0, 0, 0.7))
    assert body.kind == "lagrange"
    np.testing.assert_allclose(body.moments, (2, 2, 1.5), rtol=1e-15)
    np.testing.assert_allclose(body.principal_com, (0, 0, 0.7), atol=1e-15)


def test_equal_moments_keep_the_given_axes():
    body = kr.Body(mass=1, inertia=(2, 2, 2), com=(0.1, 0.2, 0.3))
    assert body.kind == "lagrange" and body.axes == (1, 0, 0, 0)
    other_body = kr.Body(
        mass=1, inertia=matrix(TILT) @ (2 * np.eye(3)) @ matrix(TILT).T, com=(0.1, 0.2, 0.3)
    )
    np.testing.assert_allclose(other_body.moments, (2, 2, 2), rtol=1e-15)
    assert other_body.kind == "lagrange" and other_body.axes == (1, 0, 0, 0)


# Scenes


NEAR, FAR = unit((0.9, -0.2, 0.3, 0.1)), unit((0.3, -0.5, 0.7, 0.1))


@pytest.mark.parametrize(
    "name, turn, atol", [*((name, NEAR, 1e-12) for name in FIXED), ("extrap", FAR, 1e-10)]
)
def test_motion_does_not_depend_on_the_frame_of_description(name, turn, atol):
    bodies = (
        kr.scenes.asymmetric.body,
        kr.scenes.thesis.body,
        kr.Body(2.0, (3.0, 2.5, 1.5), (0.0, 0.0, 0.0)),
    )
    body = next(body for body in bodies if kr.methods[name].applies_to(body))
    axes = matrix(turn)
    tensor = axes @ np.diag(body.inertia) @ axes.T
    other_body = kr.Body(body.mass, tensor, axes @ body.com, unphysical=body.unphysical)
    attitude = unit(quaternion.multiply(TILT, quaternion.conjugate(turn)))
    scenes = [
        kr.Scene(b, GENERAL.momentum, q, gravity=1)
        for b, q in ((body, TILT), (other_body, attitude))
    ]
    options = {"tol": 1e-13} if name == "extrap" else {"step": 0.01}
    own, other = (kr.solve(scene, [1, 2], name, **options) for scene in scenes)
    for quantity in ("m", "velocity", "torque", "apex", "energy"):
        np.testing.assert_allclose(
            getattr(other, quantity), getattr(own, quantity), rtol=0, atol=atol
        )
    back = [quaternion.multiply(tuple(q), turn) for q in other.q]
    assert kr.attitude_error(back, own.q).max() < atol


def test_momentum_and_velocity_agree_in_space_and_body_frames():
    q = np.array(matrix(TILT))
    tensor = np.array(CORNER.inertia)
    velocity = np.array([0.3, -0.2, 1.1])
    in_space = q @ tensor @ q.T @ velocity
    words = {
        "momentum": in_space,
        "velocity": velocity,
        "body_momentum": q.T @ in_space,
        "body_velocity": q.T @ velocity,
    }
    for word, value in words.items():
        scene = kr.Scene(CORNER, attitude=TILT, gravity=1, **{word: value})
        np.testing.assert_allclose(scene.momentum, in_space, rtol=1e-14, err_msg=word)
        np.testing.assert_allclose(
            kr.solve(scene, [0.0]).velocity[0], velocity, rtol=1e-14, err_msg=word
        )


def test_simple_starts_are_not_rounded():
    scene = kr.Scene(kr.Body.symmetric(1, 3, 1, 1), velocity=(0.1, 0.7, 0.3), gravity=1)
    assert scene.momentum == (3 * 0.1, 3 * 0.7, 0.3)
    assert kr.Scene(CORNER, body_momentum=(0.1, 0.7, 0.3), gravity=1).momentum == (0.1, 0.7, 0.3)


def test_the_attitude_can_be_given_scalar_last():
    w, x, y, z = TILT
    scene = kr.Scene(CORNER, momentum=GENERAL.momentum, attitude_xyzw=(x, y, z, w), gravity=1)
    assert scene == GENERAL and scene.attitude_xyzw == (x, y, z, w)


def test_scenes_and_bodies_can_be_compared_and_copied():
    again = kr.Scene(
        kr.Body(CORNER.mass, CORNER.inertia, CORNER.com), GENERAL.momentum, GENERAL.attitude, 1
    )
    assert again == GENERAL and hash(again) == hash(GENERAL) and again.body == CORNER
    assert pickle.loads(pickle.dumps(GENERAL)) == GENERAL
    assert eval(repr(GENERAL), {"Scene": kr.Scene, "Body": kr.Body}) == GENERAL
    with pytest.raises(dataclasses.FrozenInstanceError):
        GENERAL.gravity = 2.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        CORNER.mass = 2.0


def test_replace_changes_one_argument():
    assert dataclasses.replace(GENERAL, gravity=2).gravity == 2.0
    assert dataclasses.replace(CORNER, mass=2).mass == 2.0
    slow = GENERAL.replace(body_velocity=(0, 0, 1), attitude_xyzw=(0, 0, 0, 1))
    assert slow == kr.Scene(CORNER, body_velocity=(0, 0, 1), gravity=1)
    assert GENERAL.replace(momentum=GENERAL.momentum) == GENERAL


# Named scenes


def test_named_scenes_are_the_problems_of_the_report():
    problems = json.loads((ROOT / "validation/references/problems.json").read_text())["scenes"]
    assert set(problems) <= set(kr.scenes.about)
    for name, problem in problems.items():
        scene = getattr(kr.scenes, name)
        hexes = {
            key: tuple(map(float.fromhex, values)) for key, values in problem["principal"].items()
        }
        assert (scene.body.mass, scene.gravity) == (1.0, 1.0)
        assert (
            scene.body.moments == hexes["inertia"]
            and scene.body.principal_com == hexes["mass_g_com"]
        )
        assert scene.attitude == hexes["q0"] and scene.momentum == tuple(problem["momentum"])


def test_named_scenes_move_as_described():
    t = np.linspace(0, 60, 1201)
    path = {name: kr.solve(getattr(kr.scenes, name), t) for name in kr.scenes.about}
    height = {name: path[name].apex[:, 2] for name in path}
    assert (
        path["sleeping"].scene.body.kind == "lagrange" and 0.99 < height["sleeping"].min() < 0.9999
    )
    assert (
        np.ptp(height["steady_precession"]) < 1e-7
        and abs(height["steady_precession"][0] - 0.6) < 1e-15
    )
    cusps = path["cusps"]
    assert np.ptp(height["cusps"]) > 0.1 and abs(height["cusps"].max() - 0.6) < 1e-8
    top = height["cusps"].argmax()
    transverse = np.cross(cusps.velocity[top], cusps.apex[top])
    assert np.linalg.norm(transverse) < 0.05 * np.linalg.norm(cusps.velocity[top])
    middle = path["dzhanibekov"].frame[:, 1, 1]
    assert (
        middle.min() < -0.99 and middle.max() > 0.99 and (np.diff(np.sign(middle)) != 0).sum() >= 2
    )
    assert [name for name in path if path[name].scene.body.kind == "general"] == [
        "asymmetric",
        "asymmetric_regular",
    ]
    for name in ("kowalewski", "goryachev_chaplygin"):
        assert path[name].scene.body.kind == name and np.ptp(getattr(path[name], name)) < 1e-7
    assert kr.scenes.name_of(path["cusps"].scene) == "cusps" and kr.scenes.name_of(GENERAL) == ""


def test_a_least_moment_below_rounding_is_refused():
    """Check that a body is rejected if its smallest moment of inertia is below rounding errors."""
    half, mass = (0.6, 0.8, 1.0), 8 * 0.48
    for distance in (1.0, 1e2, 3e3):
        pivot = distance * np.array((0.3, -0.4, 0.5))
        body = kr.Body.cuboid(half=half, pivot=pivot)
        inertia = np.diag([mass / 3 * (1.0 + 0.64), mass / 3 * 1.36, mass / 3 * 1.0])
        direction = pivot / np.linalg.norm(pivot)
        # to first order, the axis of the least moment is the line to the centre of mass
        assert min(body.moments) == pytest.approx(
            direction @ inertia @ direction, rel=1e-6 + 0.5 / distance**2
        )
    for distance in (1e6, 3e7, 1e8):
        with pytest.raises(
            ValueError,
            match=r"the smallest principal moment, about .*, is less than 2e-10 times the largest",
        ):
            kr.Body.cuboid(half=half, pivot=distance * np.array((0.3, -0.4, 0.5)))
        straight = kr.Body.cuboid(half=half, pivot=(0, 0, -distance))
        assert min(straight.moments) == pytest.approx(mass / 3, rel=1e-15)


# Gravity

HEAVY = kr.Body.symmetric(1.0, 1.0, 0.5, 0.8, unphysical=True)
HEAVY_TOML = "[body.symmetric]\nmass = 1\ni1 = 1\ni3 = 0.5\nheight = 0.8\nunphysical = true\n"
WEIGHTLESS = kr.Body(1.0, (1.0, 1.0, 1.5), (0.0, 0.0, 0.0))
FLOATING = kr.Scene(WEIGHTLESS, momentum=(0.1, 0.2, 3.0))


def read_toml(text):
    return lambda gravity=None: kr.Scene.from_toml(
        ("" if gravity is None else f"gravity = {gravity}\n") + text + HEAVY_TOML
    )


WITHOUT_GRAVITY = {
    "Scene": partial(kr.Scene, HEAVY, momentum=(0, 0, 1)),
    "Scene, scalar last": partial(kr.Scene, HEAVY, (0, 0, 1), attitude_xyzw=(0, 0, 0, 1)),
    "Scene.spinning": partial(kr.Scene.spinning, HEAVY, 9.0, 0.3),
    "Scene.spinning, steady": partial(kr.Scene.spinning, HEAVY, 20.0, 0.3, steady=True),
    "Scene.from_euler": partial(kr.Scene.from_euler, HEAVY, (0, 1, 0)),
    "Ensemble": partial(kr.Ensemble, HEAVY, momentum=[(0, 0, 1)]),
    "Ensemble of bodies": partial(
        kr.Ensemble, kr.Bodies(1, (1, 1, 1), [(0, 0, 0), (0, 0, 0.3)]), momentum=(0, 0, 1)
    ),
    "Ensemble.spinning": partial(kr.Ensemble.spinning, HEAVY, [9.0, 8.0]),
    "Ensemble.spinning, steady": partial(kr.Ensemble.spinning, HEAVY, [20.0], steady=True),
    "Ensemble.from_euler": partial(kr.Ensemble.from_euler, HEAVY, [(0, 1, 0)]),
    "starts": partial(kr.starts, HEAVY, energy=9, vertical=1, n=3),
    "Scene.replace": partial(FLOATING.replace, body=HEAVY),
    "Scene.vary, body": partial(FLOATING.vary, body=HEAVY, momentum=[(0, 0, 1)]),
    "Scene.vary, com": partial(FLOATING.vary, com=[(0, 0, 0.1), (0, 0, 0.2)]),
    "Scene.vary, steady": partial(FLOATING.vary, body=HEAVY, spin=[20.0], tilt=1, steady=True),
    "Run.change": lambda **words: kr.start(FLOATING).change(body=HEAVY, **words),
    "TOML": read_toml("momentum = [0, 0, 1]\n"),
    "TOML, spinning": read_toml("spinning = { spin = 30, tilt = 60, degrees = true }\n"),
    "TOML, from_euler": read_toml("from_euler = { angles = [0, 1, 0] }\n"),
}


@pytest.mark.parametrize("entry", WITHOUT_GRAVITY)
def test_gravity_has_no_default_away_from_the_fixed_point(entry):
    make = WITHOUT_GRAVITY[entry]
    with pytest.raises(TypeError, match=r"gravity is required .* 9\.81 .* 1 in units"):
        make()
    tops = make(gravity=9.81)
    assert tops is None or np.all(tops.gravity == 9.81)


@pytest.mark.parametrize("gravity", [None, 0.0, 9.81])
def test_a_body_supported_at_its_centre_of_mass_needs_no_gravity(gravity):
    scene = kr.Scene.spinning(WEIGHTLESS, 3.0, 0.4, gravity=gravity)
    assert scene.gravity == (gravity or 0.0)
    assert eval(repr(scene), {"Scene": kr.Scene, "Body": kr.Body}) == scene
    assert kr.Scene.from_toml(scene.to_toml()) == scene
    tops = kr.Ensemble.spinning(WEIGHTLESS, [3.0], 0.4, gravity=gravity)
    assert tops[0] == scene and scene.vary(spin=[3.0]).gravity == scene.gravity
    path, pulled = kr.solve(scene, 2.0), kr.solve(scene.replace(gravity=1), 2.0)
    assert path.states.tobytes() == pulled.states.tobytes()


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_a_given_gravity_is_kept(gravity):
    scene = kr.Scene(HEAVY, momentum=(0.1, 0.2, 3.0), gravity=gravity)
    assert f"gravity={gravity}" in repr(scene) and f"gravity = {gravity}" in scene.to_toml()
    assert scene.replace(body=kr.scenes.cusps.body, damping=0.1).gravity == gravity
    for tops in (
        scene.vary(spin=[1, 2]),
        scene.vary(com=[(0, 0, 0.1)]),
        scene.scatter(3, attitude=0.1),
    ):
        assert (tops.gravity == gravity).all()
