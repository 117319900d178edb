"""Tests of derivatives against finite differences in 30-digit arithmetic."""

import itertools
import pickle
from concurrent.futures import ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from kreisel._core import values
from kreisel._options.quantities import ANGLES, QUANTITIES
from scene_numbers import change_number, list_columns, states_of

ALL = ("start", "moments", "com", "gravity", "mass", "damping")
TIMES = [0.75, 2.0]
COM, DAMPING = (0.2, -0.1, 0.9), (0.1, 0.25, 0.4)
START = {"momentum": (0.3, -0.7, 1.5), "attitude": (0.8, 0.6, 0.0, 0.0), "gravity": 1.25}
OF_THE_APEX = ("apex", "spin", "axial_momentum", *sorted(ANGLES))
# Central differences of eighth order.
WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}


def scene_of(moments, com=COM, damping=DAMPING, rotor=(0.0, 0.0, 0.0)):
    body = kr.Body(1.5, moments, com=com, rotor=rotor, unphysical=True)
    return kr.Scene(body, damping=damping, **START)


def tensor(moments, turn=(0.6, 0.48, 0.0, 0.64)):
    axes = np.array([kr.quaternion.turn(turn, e) for e in np.eye(3)]).T
    return axes @ np.diag(moments) @ axes.T


ORDERS = [
    tuple(np.array((0.9, 1.0, 1.7))[list(order)].tolist())
    for order in itertools.permutations(range(3))
]
SCENES = {
    **{f"moments {moments}": scene_of(moments) for moments in ORDERS},
    "symmetric about the first axis": scene_of((0.7, 1.2, 1.2)),
    "Lagrange about the second axis": scene_of((1.2, 0.7, 1.2), (0.0, 0.8, 0.0)),
    "Lagrange about the third axis": scene_of((1.2, 1.2, 0.7), (0.0, 0.0, -0.8)),
    "Kowalewski": scene_of((2.0, 1.0, 2.0), (0.6, 0.0, -0.8), None),
    "Goryachev-Chaplygin": scene_of((1.0, 4.0, 4.0), (0.0, 0.6, 0.8), None),
    "spherical": scene_of((1.2, 1.2, 1.2), (0.3, -0.4, 0.5)),
    "spherical with equal damping": scene_of((1.2, 1.2, 1.2), (0.3, -0.4, 0.5), 0.2),
    "free": scene_of((0.9, 1.7, 1.0), (0.0, 0.0, 0.0)),
    "turned": scene_of(tensor((0.9, 1.7, 1.0))),
    "turned and symmetric": scene_of(tensor((0.7, 1.2, 1.2))),
    "turned with a rotor": scene_of(tensor((0.9, 1.7, 1.0)), rotor=(0.5, -0.9, 0.7)),
    "symmetric with a rotor on its axis": scene_of(
        (0.7, 1.2, 1.2), (0.8, 0.0, 0.0), None, (-0.9, 0.0, 0.0)
    ),
}


def differences(scene, name, component, values_at, step=2.0**-9):
    """Return the numerical derivative of `values_at` with respect to a parameter of the scene."""
    total = 0.0
    for k, weight in WEIGHTS.items():
        ahead, behind = (change_number(scene, name, component, sign * k * step) for sign in (1, -1))
        total = total + weight * (
            values_at(ahead[0], *states_of(*ahead, TIMES))
            - values_at(behind[0], *states_of(*behind, TIMES))
        )
    return total / step


def state_changes(reference):
    w, v = reference[:, 1:2], reference[:, 2:5]

    def values_at(block, states, low):
        other = states[:, 1:5] + low[:, 1:5]
        rotation = w * other[:, 1:] - other[:, :1] * v - np.cross(v, other[:, 1:])
        half = np.linalg.norm(rotation, axis=1)  # the sine of half the angle
        size = 2.0 * np.arcsin(half) / np.where(half > 0.0, half, 1.0)
        sign = np.sign((reference[:, 1:5] * other).sum(axis=1))
        return np.hstack([(sign * size)[:, None] * rotation, states[:, 5:]])

    return values_at


@pytest.mark.parametrize("name", SCENES)
def test_tangents_agree_with_differences_for_every_order_of_axes(name):
    scene = SCENES[name]
    fine = kr.solve(scene, TIMES, digits=30, tangents=ALL)
    values_at = state_changes(fine.states)
    size = np.abs(fine.tangents).max()
    for column, (word, component) in enumerate(list_columns()):
        if word == "damping" and not any(scene.damping):
            continue  # no damping below zero
        expected = differences(scene, word, component, values_at)
        assert np.abs(expected - fine.tangents[:, :, column]).max() < 1e-10 * size
    for digits in (None, 16, 20):
        path = kr.solve(scene, TIMES, "taylor", digits=digits, tangents=ALL)
        assert np.abs(path.tangents - fine.tangents).max() < 1e-13 * size


def continue_angles(values, targets):
    """Shift angles by multiples of 2 pi to the values closest to `targets`."""
    return values + 2.0 * np.pi * np.round((targets - values) / (2.0 * np.pi))


def quantity_changes(name, reference):
    """Return a function that computes the quantity `name` from states."""
    targets = getattr(reference, name)

    def values_at(block, states, low):
        changes = values(name, block, states)
        return continue_angles(changes, targets) if name in ANGLES else changes

    return values_at


@pytest.mark.parametrize("name", SCENES)
def test_derivatives_of_every_quantity_agree_with_differences(name):
    scene = SCENES[name]
    path = kr.solve(scene, TIMES, "taylor", tangents=ALL)
    for quantity in QUANTITIES:
        own = path.derivative(quantity)
        assert own.shape == (2, *(QUANTITIES[quantity].shape if quantity != "q" else (3,)), 17)
        if quantity == "q":
            assert np.abs(own - path.tangents[:, :3]).max() == 0.0
            continue
        values_at = quantity_changes(quantity, path)
        for column, (word, component) in enumerate(list_columns()):
            if word == "damping" and not any(scene.damping):
                continue
            if word == "com" and not any(scene.body.com) and quantity in OF_THE_APEX:
                assert np.isnan(own[..., column]).all()  # the apex jumps
                continue
            expected = differences(scene, word, component, values_at)
            # K and G have no derivative if the change makes the body one of another kind
            assert np.array_equal(np.isnan(expected), np.isnan(own[..., column]))
            exists = np.isfinite(expected)
            limit = 1e-11 + 1e-10 * np.abs(own[..., column])[exists].max(initial=0.0)
            assert np.abs(expected - own[..., column])[exists].max(initial=0.0) < limit


def test_angles_have_no_derivative_at_a_vertical_apex():
    path = kr.solve(kr.scenes.sleeping, [0.0, 1.0], tangents=("start", "com"))
    for name in ANGLES:
        own = path.derivative(name)
        assert np.isnan(own[0]).all() and np.isfinite(own[1]).all()
    assert np.isfinite(path.derivative("apex")).all()


def test_invalid_derivatives_are_refused_by_name():
    path = kr.solve(kr.scenes.thesis, [0.0, 1.0], tangents="start")
    with pytest.raises(ValueError, match="did you mean 'nutation'"):
        path.derivative("nutatio")
    for name in ("t", "q_low", None, 3, ["apex"]):
        with pytest.raises(ValueError, match="unknown quantity"):
            path.derivative(name)
    with pytest.raises(AttributeError, match="solve with tangents='start'"):
        kr.solve(kr.scenes.thesis, [0.0, 1.0]).derivative("apex")
    assert not path.derivative("apex").flags.writeable
    assert path[:0].derivative("frame").shape == (0, 3, 3, 6)
    assert np.array_equal(path[1].derivative("spin"), path.derivative("spin")[1:])


def members():
    """Return an ensemble of damped tops that differ in gravity and mass."""
    return SCENES["turned"].vary(gravity=[[0.0], [0.5], [1.25]], mass=[1.0, 1.5])


@pytest.mark.parametrize("digits", [None, 20])
@pytest.mark.parametrize("threads", [1, 3])
def test_ensemble_tangents_equal_those_of_single_tops(digits, threads):
    tops, names = members(), ("start", "damping", "com")
    paths = kr.solve(tops, TIMES, digits=digits, tangents=names, threads=threads).check()
    assert paths.tangents.shape == (3, 2, 2, 6, 12) == paths.tangents_low.shape
    derivatives = paths.derivative("body_acceleration")
    for index in np.ndindex(tops.shape):
        alone = kr.solve(tops[index], TIMES, "taylor", digits=digits, tangents=names)
        one = paths[index]
        for path in (paths.tangents[index], one.tangents):
            assert np.array_equal(path, alone.tangents)
        assert np.array_equal(paths.states[index], alone.states)
        assert np.array_equal(paths.tangents_low[index], alone.tangents_low)
        assert paths.tangents_rest[index] == alone.tangents_rest == one.tangents_rest
        assert np.array_equal(derivatives[index], alone.derivative("body_acceleration"))
    assert np.array_equal(paths[1:, 0].tangents, paths.tangents[1:, 0])
    assert np.array_equal(pickle.loads(pickle.dumps(paths)).tangents, paths.tangents)
    with pytest.raises(AttributeError, match="solve with tangents='start'"):
        _ = kr.solve(tops, TIMES).tangents
    with pytest.raises(ValueError, match="did you mean 'apex'"):
        paths.derivative("apexx")


def test_ensemble_tangents_accept_or_refuse_every_other_argument():
    tops, options = members(), {"tangents": ["gravity"]}
    times = np.linspace(-0.5, -1.0, 6).reshape(3, 2, 1)
    back = kr.solve(tops, times, executor=ThreadPoolExecutor(2), **options)
    assert np.array_equal(
        back[2, 1].tangents, kr.solve(tops[2, 1], times[2, 1], **options).tangents
    )
    out = np.empty((3, 2, 2, 8))
    assert np.shares_memory(kr.solve(tops, TIMES, out=out, **options).states, out)
    for word, value in {"want": ["q"], "events": [], "error": 1e-6}.items():
        with pytest.raises(ValueError, match=f"leave out {word}"):
            kr.solve(tops, TIMES, **{word: value}, **options)
    with pytest.raises(ValueError, match="computes no tangents"):
        kr.solve(SCENES["Kowalewski"].vary(mass=[1.0]), TIMES, "rk4", step=0.1, **options)
    with pytest.raises(ValueError, match="name in tangents"):
        kr.solve(tops, TIMES, tangents="moment")
    empty = kr.solve(tops[:0], TIMES, **options)
    assert empty.tangents.shape == (0, 2, 2, 6, 1)
    assert empty.derivative("nutation").shape == (0, 2, 2, 1)


def test_a_failed_top_of_an_ensemble_keeps_its_valid_tangents():
    tops = members()
    paths = kr.solve(tops, np.linspace(0.0, 40.0, 50), tangents="start", max_steps=9)
    counts = paths.state_counts
    assert (paths.status_names == "ERR_LIMIT").all() and (counts > 0).all() and (counts < 50).all()
    finite = np.isfinite(paths.tangents).all(axis=(-1, -2))
    assert np.array_equal(finite, np.arange(50) < counts[..., None])
    assert np.array_equal(finite, np.isfinite(paths.derivative("spin")).all(axis=-1))
    one = paths[1, 1]
    assert len(one) == counts[1, 1] == len(one.tangents) == len(one.derivative("q"))
    with pytest.raises(kr.Error) as error:
        paths.check()
    assert len(error.value.path.tangents) == counts[0, 0]
    upright = kr.scenes.sleeping.replace(momentum=(0.0, 0.0, 0.0)).vary(gravity=[1.0, 2.0])
    unstable_paths = kr.solve(upright, np.arange(0.0, 4000.0, 10.0), tangents="start")
    assert (unstable_paths.status_names == "ERR_TANGENT").all() and len(
        unstable_paths[0].tangents
    ) > 10
