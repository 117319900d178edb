"""Tests of scenes: starts in every frame, attitudes, gravity, named scenes."""

import dataclasses
import math
import pickle
from functools import partial

import kreisel as kr
import numpy as np
import pytest
from tops import CORNER, GENERAL, MOMENTUM, TILT, matrix

NAMES = {"Scene": kr.Scene, "Body": kr.Body}  # in the repr of a scene


def test_momentum_and_velocity_agree_in_space_and_body_frames():
    q, velocity = matrix(TILT), np.array([0.3, -0.2, 1.1])
    in_space = q @ np.array(CORNER.inertia) @ q.T @ velocity
    words = {
        "momentum": in_space,
        "velocity": velocity,
        "body_momentum": q.T @ in_space,
        "body_velocity": q.T @ velocity,
    }
    for word, value in words.items():
        scene = kr.Scene(CORNER, attitude=TILT, gravity=1, **{word: value})
        np.testing.assert_allclose(scene.momentum, in_space, rtol=1e-14, err_msg=word)
        start = kr.solve(scene, [0.0])
        np.testing.assert_allclose(start.velocity[0], velocity, rtol=1e-14, err_msg=word)
        changed = GENERAL.replace(**{word: value}).momentum
        np.testing.assert_allclose(changed, in_space, rtol=1e-14, err_msg=word)
    simple = kr.Scene(kr.Body.symmetric(1, 3, 1, 1), velocity=(0.1, 0.7, 0.3), gravity=1)
    assert simple.momentum == (3 * 0.1, 3 * 0.7, 0.3)


# Attitudes


def test_an_attitude_may_be_scalar_last_or_a_rotation_of_scipy():
    w, x, y, z = TILT
    scene = kr.Scene(CORNER, momentum=MOMENTUM, attitude_xyzw=(x, y, z, w), gravity=1)
    assert scene == GENERAL and scene.attitude_xyzw == (x, y, z, w)
    Rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    rotation = Rotation.from_quat((x, y, z, w))
    np.testing.assert_allclose(GENERAL.replace(attitude=rotation).attitude, TILT, rtol=1e-15)
    two = kr.Scene(CORNER, MOMENTUM, Rotation.concatenate([rotation, rotation]), gravity=1)
    assert two.shape == (2,) and two[1] == kr.Scene(CORNER, MOMENTUM, rotation, gravity=1)
    with pytest.raises(TypeError, match="attitude must be 4"):
        kr.Scene(CORNER, MOMENTUM, rotation.as_rotvec, gravity=1)


@pytest.mark.parametrize("dtype", [np.float64, np.float32, np.float16])
def test_an_attitude_off_by_rounding_is_normalized_in_double(dtype):
    rng = np.random.default_rng(5)
    for _ in range(20):
        q = rng.normal(size=4).astype(dtype)
        q /= np.linalg.norm(q)
        for words in ({"attitude": q}, {"attitude_xyzw": q}, {"attitude": list(q)}):
            scene = kr.Scene(CORNER, MOMENTUM, gravity=1, **words)
            assert abs(math.hypot(*scene.attitude) - 1) < 4e-16
        np.testing.assert_allclose(
            scene.attitude, q.astype(float), rtol=0, atol=4 * np.finfo(dtype).eps
        )
    for wrong in (q.astype(float) * (1 + 1e-7), q * dtype(1.1)):
        with pytest.raises(ValueError, match="divide by it"):
            kr.Scene(CORNER, MOMENTUM, wrong, gravity=1)


# Scenes as values


def test_scenes_and_bodies_can_be_compared_copied_and_replaced():
    body = kr.Body(CORNER.mass, CORNER.inertia, CORNER.com)
    again = kr.Scene(body, GENERAL.momentum, GENERAL.attitude, 1)
    assert again == GENERAL and hash(again) == hash(GENERAL) and again.body == CORNER
    assert pickle.loads(pickle.dumps(GENERAL)) == GENERAL == eval(repr(GENERAL), NAMES)
    assert dataclasses.replace(GENERAL, gravity=2).gravity == 2.0
    assert dataclasses.replace(CORNER, mass=2).mass == 2.0
    slow = GENERAL.replace(body_velocity=(0, 0, 1), attitude_xyzw=(0, 0, 0, 1))
    assert slow == kr.Scene(CORNER, body_velocity=(0, 0, 1), gravity=1)
    for thing in (GENERAL, CORNER):
        with pytest.raises(dataclasses.FrozenInstanceError):
            thing.mass = 2.0


# Named scenes


def test_named_scenes_move_as_described():
    t = np.linspace(0, 60, 1201)
    path = {name: kr.solve(getattr(kr.scenes, name), t) for name in kr.scenes.about}
    height = {name: path[name].apex[:, 2] for name in path}
    kinds = {name: path[name].scene.body.kind for name in path}
    assert kinds["sleeping"] == "lagrange" and 0.99 < height["sleeping"].min() < 0.9999
    steady = height["steady_precession"]
    assert np.ptp(steady) < 1e-7 and abs(steady[0] - 0.6) < 1e-15
    cusps = path["cusps"]
    assert np.ptp(height["cusps"]) > 0.1 and abs(height["cusps"].max() - 0.6) < 1e-8
    top = height["cusps"].argmax()
    across = np.cross(cusps.velocity[top], cusps.apex[top])
    assert np.linalg.norm(across) < 0.05 * np.linalg.norm(cusps.velocity[top])
    middle = path["dzhanibekov"].frame[:, 1, 1]
    assert middle.min() < -0.99 and middle.max() > 0.99
    assert (np.diff(np.sign(middle)) != 0).sum() >= 2
    assert {name for name in path if kinds[name] == "general"} == {
        "asymmetric",
        "asymmetric_regular",
    }
    for name in ("kowalewski", "goryachev_chaplygin"):
        assert kinds[name] == name and np.ptp(getattr(path[name], name)) < 1e-7
    assert kr.scenes.name_of(cusps.scene) == "cusps" and kr.scenes.name_of(GENERAL) == ""


# Gravity

HEAVY = kr.Body.symmetric(1.0, 1.0, 0.5, 0.8, unphysical=True)
HEAVY_TOML = "[body.symmetric]\nmass = 1\ni1 = 1\ni3 = 0.5\nheight = 0.8\nunphysical = true\n"
WEIGHTLESS = kr.Body(1.0, (1.0, 1.0, 1.5), (0.0, 0.0, 0.0))
FLOATING = kr.Scene(WEIGHTLESS, momentum=(0.1, 0.2, 3.0))
ROW = kr.Body(1, (1, 1, 1), [(0, 0, 0), (0, 0, 0.3)])


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
    "many": partial(kr.Scene, HEAVY, momentum=[(0, 0, 1)]),
    "many bodies": partial(kr.Scene, ROW, momentum=(0, 0, 1)),
    "many, spinning": partial(kr.Scene.spinning, HEAVY, [9.0, 8.0]),
    "many, steady": partial(kr.Scene.spinning, HEAVY, [20.0], steady=True),
    "many, from_euler": partial(kr.Scene.from_euler, HEAVY, [(0, 1, 0)]),
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
    with pytest.raises(TypeError, match="gravity is required"):
        make()
    tops = make(gravity=9.81)
    assert tops is None or np.all(tops.gravity == 9.81)


@pytest.mark.parametrize("gravity", [None, 0.0, 9.81])
def test_a_body_supported_at_its_centre_of_mass_needs_no_gravity(gravity):
    scene = kr.Scene.spinning(WEIGHTLESS, 3.0, 0.4, gravity=gravity)
    assert scene.gravity == (gravity or 0.0)
    assert eval(repr(scene), NAMES) == scene == kr.Scene.from_toml(scene.to_toml())
    tops = kr.Scene.spinning(WEIGHTLESS, [3.0], 0.4, gravity=gravity)
    assert tops[0] == scene and scene.vary(spin=[3.0]).gravity == scene.gravity
    path, pulled = kr.solve(scene, 2.0), kr.solve(scene.replace(gravity=1), 2.0)
    assert path.states.tobytes() == pulled.states.tobytes()


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_a_given_gravity_is_kept(gravity):
    scene = kr.Scene(HEAVY, momentum=(0.1, 0.2, 3.0), gravity=gravity)
    assert f"gravity={gravity}" in repr(scene) and f"gravity = {gravity}" in scene.to_toml()
    assert scene.replace(body=kr.scenes.cusps.body, damping=0.1).gravity == gravity
    for words in ({"spin": [1, 2]}, {"com": [(0, 0, 0.1)]}):
        assert (scene.vary(**words).gravity == gravity).all()
    assert (scene.scatter(3, attitude=0.1).gravity == gravity).all()
