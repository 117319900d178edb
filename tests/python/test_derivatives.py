"""Derivatives of states and of quantities, compared with differences of runs with 30 digits."""

import itertools

import kreisel as kr
import numpy as np
import pytest
from scene_numbers import change_number, list_columns, states_of

ALL = ("start", "moments", "com", "gravity", "mass", "damping")
TIMES = [0.75, 2.0]
COM, DAMPING = (0.2, -0.1, 0.9), (0.1, 0.25, 0.4)
START = {"momentum": (0.3, -0.7, 1.5), "attitude": (0.8, 0.6, 0.0, 0.0), "gravity": 1.25}
# Central differences of eighth order.
WEIGHTS = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}


def scene_of(moments, com=COM, damping=DAMPING):
    return kr.Scene(kr.Body(1.5, moments, com=com, unphysical=True), damping=damping, **START)


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
}


def differences(scene, name, component, values_at, step=2.0**-9):
    """Return the derivative of `values_at(block, states, low)` by a number of the scene."""
    total = 0.0
    for k, weight in WEIGHTS.items():
        ahead, behind = (change_number(scene, name, component, by * k * step) for by in (1, -1))
        total = total + weight * (
            values_at(ahead[0], *states_of(*ahead, TIMES))
            - values_at(behind[0], *states_of(*behind, TIMES))
        )
    return total / step


def state_changes(reference):
    """Return a function of states: their rotation vectors from `reference`, and their momenta."""
    w, v = reference[:, 1:2], reference[:, 2:5]

    def values_at(block, states, low):
        other = states[:, 1:5] + low[:, 1:5]
        apart = w * other[:, 1:] - other[:, :1] * v - np.cross(v, other[:, 1:])
        half = np.linalg.norm(apart, axis=1)  # the sine of half the angle
        size = 2.0 * np.arcsin(half) / np.where(half > 0.0, half, 1.0)
        sign = np.sign((reference[:, 1:5] * other).sum(axis=1))
        return np.hstack([(sign * size)[:, None] * apart, states[:, 5:]])

    return values_at


@pytest.mark.parametrize("name", SCENES)
def test_tangents_by_every_number_are_differences_for_every_order_of_axes(name):
    scene = SCENES[name]
    fine = kr.solve(scene, TIMES, digits=30, tangents=ALL)
    values_at = state_changes(fine.states)
    size = np.abs(fine.tangents).max()
    for column, (word, component) in enumerate(list_columns()):
        if word == "damping" and not any(scene.damping):
            continue  # no damping below zero
        told = differences(scene, word, component, values_at)
        assert np.abs(told - fine.tangents[:, :, column]).max() < 1e-10 * size
    for digits in (None, 16, 20):
        path = kr.solve(scene, TIMES, "taylor", digits=digits, tangents=ALL)
        assert np.abs(path.tangents - fine.tangents).max() < 1e-13 * size
