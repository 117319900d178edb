"""Tests of tangents and derivatives of quantities against differences of 30-digit paths."""

import itertools
import typing
from concurrent.futures import ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from kreisel.types import QuantityName

ALWAYS = {"start": 6, "moments": 3, "com": 3, "gravity": 1, "mass": 1}
EFFECTS = {"damping": 3, "rotor": 3, "turning": 3, "shaking": 3, "friction": 1, "gradient": 1}
TIMES = np.array([0.75, 2.0])
COM, DAMPING = (0.2, -0.1, 0.9), (0.1, 0.25, 0.4)
START = {"momentum": (0.3, -0.7, 1.5), "attitude": (0.8, 0.6, 0.0, 0.0), "gravity": 1.25}
ANGLES = ("precession_angle", "nutation", "spin_angle")
OF_THE_APEX = ("apex", "spin", "axial_momentum", *ANGLES)
QUANTITIES = [name for name in typing.get_args(QuantityName) if name not in ("t", "q_low", "m_low")]
MOTION, POINT = ("position", "point_velocity", "point_acceleration"), (0.3, -0.2, 0.5)
# Central differences of eighth order.
WEIGHTS, STEP = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}, 2.0**-9


def make_scene(moments, com=COM, rotor=(0.0, 0.0, 0.0), turn=None, **effects):
    """Return a top whose principal axes are turned in its frame of description."""
    if turn:
        axes = np.array([kr.quaternion.turn(turn, e) for e in np.eye(3)]).T
        moments = axes @ np.diag(moments) @ axes.T
    body = kr.Body(1.5, moments, com=com, rotor=rotor, unphysical=True)
    return kr.Scene(body, **START, **{"damping": DAMPING, **effects})


TURN = (0.6, 0.48, 0.0, 0.64)
MOVED = {"turning": (0.3, -0.2, 0.5), "shaking": (0.1, 5.0, 0.3)}
ORDERS = itertools.permutations((0.9, 1.0, 1.7))
SCENES = {
    **{f"moments {moments}": make_scene(moments) for moments in ORDERS},
    "symmetric about the first axis": make_scene((0.7, 1.2, 1.2)),
    "Lagrange about the second axis": make_scene((1.2, 0.7, 1.2), (0.0, 0.8, 0.0)),
    "Lagrange about the third axis": make_scene((1.2, 1.2, 0.7), (0.0, 0.0, -0.8)),
    "Kowalewski": make_scene((2.0, 1.0, 2.0), (0.6, 0.0, -0.8), damping=None),
    "Goryachev-Chaplygin": make_scene((1.0, 4.0, 4.0), (0.0, 0.6, 0.8), damping=None),
    "spherical": make_scene((1.2, 1.2, 1.2), (0.3, -0.4, 0.5)),
    "spherical with equal damping": make_scene((1.2, 1.2, 1.2), (0.3, -0.4, 0.5), damping=0.2),
    "free": make_scene((0.9, 1.7, 1.0), (0.0, 0.0, 0.0)),
    "turned": make_scene((0.9, 1.7, 1.0), turn=TURN),
    "turned with a rotor": make_scene((0.9, 1.7, 1.0), rotor=(0.5, -0.9, 0.7), turn=TURN),
    "symmetric with a rotor on its axis": make_scene(
        (0.7, 1.2, 1.2), (0.8, 0.0, 0.0), (-0.9, 0.0, 0.0), damping=None
    ),
    "in a gradient": make_scene((0.9, 1.7, 1.0), turn=TURN, gradient=0.4, turning=(0.3, 0, 0.5)),
    "moved": make_scene((0.9, 1.7, 1.0), turn=TURN, **MOVED),
    "sliding": make_scene((0.9, 1.7, 1.0), friction=0.05, **MOVED),
    "stopped": make_scene((1.0, 1.7, 0.9), friction=1.5),
    "moved, stopped": make_scene((0.9, 1.7, 1.0), friction=2.0, **MOVED),
}
RUNS = [(name, 1) for name in SCENES]
RUNS += [(name, -1) for name in ("turned with a rotor", "moved", "sliding")]


def list_parameters(scene):
    """Return the tangents of a scene and their numbers of components."""
    values = {
        "rotor": scene.body.rotor,
        **{name: getattr(scene, name) for name in EFFECTS if name != "rotor"},
    }
    return ALWAYS | {name: n for name, n in EFFECTS.items() if np.any(values[name])}


def change_scene(scene, name, component, change):
    """Return a scene in which one number has changed, at the same momentum in space."""
    body, unit = scene.body, change * np.eye(3)[component % 3]
    words = {"momentum": scene.momentum, "attitude": scene.attitude, "gravity": scene.gravity}
    words |= {key: getattr(scene, key) for key in EFFECTS if key != "rotor"}
    if name == "start" and component < 3:
        turned = kr.quaternion.multiply(scene.attitude, (1.0, *(0.5 * unit)))
        words["attitude"] = np.array(turned) / np.linalg.norm(turned)
    elif name == "start" or name in words:
        key = "momentum" if name == "start" else name
        words[key] = words[key] + (change if np.ndim(words[key]) == 0 else unit)
    else:
        axes = np.array([kr.quaternion.turn(body.axes, e) for e in np.eye(3)]).T
        moments = np.array(body.moments) + unit * (name == "moments")
        is_turned = np.ndim(body.inertia) == 2
        inertia = axes @ np.diag(moments) @ axes.T if is_turned else moments
        com, rotor = (
            np.array(getattr(body, key)) + axes @ unit * (name == key) for key in ("com", "rotor")
        )
        mass = body.mass + change * (name == "mass")
        body = kr.Body(mass, inertia, com, rotor=rotor, unphysical=True)
    return kr.Scene(body, **words)


def differentiate(scene, t, name, component, measure):
    """Return the numerical derivative, by a number of the scene, of what `measure` finds."""
    total = 0.0
    for k, weight in WEIGHTS.items():
        ends = (change_scene(scene, name, component, sign * k * STEP) for sign in (1, -1))
        ahead, behind = (measure(kr.solve(end, t, "taylor", digits=30)) for end in ends)
        total = total + weight * (ahead - behind)
    return total / STEP


def measure_from(reference):
    """Return a function that measures the rotation and the momentum relative to a path."""
    w, v = reference.q[:, :1], reference.q[:, 1:]

    def measure(path):
        other = path.q + path.q_low
        rotation = w * other[:, 1:] - other[:, :1] * v - np.cross(v, other[:, 1:])
        half = np.linalg.norm(rotation, axis=1)  # the sine of half the angle
        size = 2.0 * np.arcsin(half) / np.where(half > 0.0, half, 1.0)
        sign = np.sign((reference.q * other).sum(axis=1))
        return np.hstack([(sign * size)[:, None] * rotation, path.m])

    return measure


def measure_quantity(name, reference):
    """Return a function that finds a quantity; angles are next to those of the reference."""
    targets = getattr(reference, name)

    def measure(path):
        values = getattr(path, name)
        if name in ANGLES:
            return values + 2.0 * np.pi * np.round((targets - values) / (2.0 * np.pi))
        return values

    return measure


@pytest.mark.parametrize("name, sign", RUNS)
def test_tangents_agree_with_differences(name, sign):
    scene, t = SCENES[name], sign * TIMES
    parameters = list_parameters(scene)
    columns = [(name, i) for name, n in parameters.items() for i in range(n)]
    fine = kr.solve(scene, t, digits=30, tangents=tuple(parameters))
    measure, size = measure_from(fine), np.abs(fine.tangents).max()
    for column, key in enumerate(columns):
        expected = differentiate(scene, t, *key, measure)
        assert np.abs(expected - fine.tangents[:, :, column]).max() < 1e-10 * size, key
    for digits in (None, 16, 20):
        path = kr.solve(scene, t, "taylor", digits=digits, tangents=tuple(parameters))
        assert np.abs(path.tangents - fine.tangents).max() < 1e-13 * size
        plain = kr.solve(scene, t, "taylor", digits=digits)
        assert np.array_equal(path.states, plain.states)
    assert 1e-17 < path.conditioning[-1] < 1e-13


@pytest.mark.parametrize("name", SCENES)
def test_derivatives_of_every_quantity_agree_with_differences(name):
    scene = SCENES[name]
    parameters = list_parameters(scene)
    path = kr.solve(scene, TIMES, "taylor", tangents=tuple(parameters))
    assert np.array_equal(path.derivative("q"), path.tangents[:, :3])
    names = [quantity for quantity in QUANTITIES if quantity != "q"]
    finders = [measure_quantity(quantity, path) for quantity in names]
    own = {quantity: path.derivative(quantity) for quantity in names}
    own |= {name: getattr(path, name)(POINT, tangents=True) for name in MOTION}
    finders += [lambda one, name=name: getattr(one, name)(POINT) for name in MOTION]

    def measure_all(one):
        values = [find(one).reshape(len(TIMES), -1) for find in finders]
        return np.hstack(values)

    columns = [(word, i) for word, n in parameters.items() for i in range(n)]
    for column, (word, component) in enumerate(columns):
        rest = differentiate(scene, TIMES, word, component, measure_all)
        for quantity in own:
            mine = own[quantity][..., column].reshape(len(TIMES), -1)
            expected, rest = rest[:, : mine.shape[1]], rest[:, mine.shape[1] :]
            if word == "com" and not any(scene.body.com) and quantity in OF_THE_APEX:
                assert np.isnan(mine).all()  # the apex jumps
                continue
            # K and G have no derivative if the change makes the body one of another kind
            assert np.array_equal(np.isnan(expected), np.isnan(mine)), (quantity, word)
            exists = np.isfinite(expected)
            limit = 1e-11 + 1e-10 * np.abs(mine)[exists].max(initial=0.0)
            assert np.abs(expected - mine)[exists].max(initial=0.0) < limit, (quantity, word)


@pytest.mark.parametrize("name", ["turned", "moved", "sliding"])
def test_points_of_the_body_move_with_their_velocities(name):
    steps = STEP * np.arange(-4, 5)
    path = kr.solve(SCENES[name], 1.0 + steps, "taylor")
    for place, rate in itertools.pairwise(MOTION):
        values, expected = (getattr(path, each)(POINT) for each in (place, rate))
        change = sum(w * (values[4 + k] - values[4 - k]) for k, w in WEIGHTS.items()) / STEP
        assert np.abs(change - expected[4]).max() < 1e-11


def test_angles_have_no_derivative_at_a_vertical_apex():
    path = kr.solve(kr.scenes.sleeping, [0.0, 1.0], tangents=("start", "com"))
    for name in ANGLES:
        own = path.derivative(name)
        assert np.isnan(own[0]).all() and np.isfinite(own[1]).all()
    assert np.isfinite(path.derivative("apex")).all()


def test_derivatives_have_the_shape_of_the_quantity():
    path = kr.solve(kr.scenes.thesis, [0.0, 1.0], tangents="start")
    assert not path.derivative("apex").flags.writeable
    assert path[:0].derivative("frame").shape == (0, 3, 3, 6)
    assert np.array_equal(path[1].derivative("spin"), path.derivative("spin")[1:])


def vary_members():
    """Return an ensemble of damped tops that differ in gravity and mass."""
    return SCENES["turned"].vary(gravity=[[0.0], [0.5], [1.25]], mass=[1.0, 1.5])


def test_ensemble_tangents_go_with_executors_and_memory_of_the_caller():
    tops, options = vary_members(), {"tangents": ["gravity"]}
    times = np.linspace(-0.5, -1.0, 6).reshape(3, 2, 1)
    back = kr.solve(tops, times, executor=ThreadPoolExecutor(2), **options)
    alone = kr.solve(tops[2, 1], times[2, 1], **options)
    assert np.array_equal(back[2, 1].tangents, alone.tangents)
    out = np.empty((3, 2, 2, 8))
    assert np.shares_memory(kr.solve(tops, TIMES, out=out, **options).states, out)
    empty = kr.solve(tops[:0], TIMES, **options)
    assert empty.tangents.shape == (0, 2, 2, 6, 1)
    assert empty.derivative("nutation").shape == (0, 2, 2, 1)


def test_a_failed_top_of_an_ensemble_keeps_its_valid_tangents():
    paths = kr.solve(vary_members(), np.linspace(0.0, 40.0, 50), tangents="start", max_steps=9)
    counts = paths.state_counts
    assert (paths.status == "ERR_LIMIT").all() and (counts > 0).all() and (counts < 50).all()
    finite = np.isfinite(paths.tangents).all(axis=(-1, -2))
    assert np.array_equal(finite, np.arange(50) < counts[..., None])
    assert np.array_equal(finite, np.isfinite(paths.derivative("spin")).all(axis=-1))
    one = paths[1, 1]
    assert len(one) == counts[1, 1] == len(one.tangents) == len(one.derivative("q"))
    with pytest.raises(kr.Error) as error:
        paths.check()
    assert len(error.value.path.tangents) == counts[0, 0]
    upright = kr.scenes.sleeping.replace(momentum=(0.0, 0.0, 0.0)).vary(gravity=[1.0, 2.0])
    unstable = kr.solve(upright, np.arange(0.0, 4000.0, 10.0), tangents="start")
    assert (unstable.status == "ERR_TANGENT").all() and len(unstable[0].tangents) > 10


PATH = kr.solve(kr.scenes.thesis, [0.0, 1.0], tangents="start")
KOWALEWSKI = SCENES["Kowalewski"].vary(mass=[1.0])


@pytest.mark.parametrize(
    "call, word",
    [
        *[(lambda x=x: PATH.derivative(x), "quantity") for x in ("t", "q_low", None, 3, ["apex"])],
        (lambda: PATH.derivative("nutatio"), "nutation"),
        (lambda: kr.solve(kr.scenes.thesis, [0.0, 1.0]).derivative("apex"), "tangents"),
        (lambda: kr.solve(vary_members(), TIMES).tangents, "tangents"),
        *[
            (lambda words=words: kr.solve(vary_members(), TIMES, tangents="mass", **words), word)
            for word, words in (
                ("want", {"want": ["q"]}),
                ("events", {"events": []}),
                ("error", {"error": 1e-6}),
            )
        ],
        (lambda: kr.solve(KOWALEWSKI, TIMES, "rk4", step=0.1, tangents="mass"), "tangents"),
        (lambda: kr.solve(vary_members(), TIMES, tangents="moment"), "tangents"),
    ],
)
def test_bad_derivatives_are_refused(call, word):
    with pytest.raises((ValueError, AttributeError), match=word):
        call()
