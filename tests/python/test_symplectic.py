"""Tests of symplecticity by finite differences."""

import kreisel as kr
import numpy as np
import pytest
from kreisel import quaternion
from tops import TILT

FIXED = [name for name, method in kr.methods.items() if not method.adaptive]
SCENE = kr.scenes.thesis.replace(attitude=TILT)
BODIES = {
    "lagrange": SCENE,
    "general": SCENE.replace(body=kr.Body(1, (7.9, 6.5, 2.2), (0.5, -1, 3), unphysical=True)),
    "free": kr.scenes.dzhanibekov,
}
NUDGE = 2e-5
CASES = [
    (name, body)
    for name in FIXED
    for body, scene in BODIES.items()
    if kr.methods[name].suits(scene)
]


def step_from(scene, name, step, rotation, impulse):
    """Return the state after one step from a perturbed attitude and momentum."""
    angle = np.linalg.norm(rotation)
    small = np.cos(angle / 2), *(np.sinc(angle / 2 / np.pi) * rotation / 2)
    attitude = quaternion.multiply(small, scene.attitude)
    start = scene.replace(attitude=attitude, momentum=np.array(scene.momentum) + impulse)
    path = kr.solve(start, step, name, step=step)
    return path.q[-1], path.m[-1]


def form(m):
    """Return the matrix of the symplectic form in the space frame.

    <dm, turn'> - <dm', turn> + <m, turn x turn'>
    """
    eye, cross = np.eye(3), np.array([[0, m[2], -m[1]], [-m[2], 0, m[0]], [m[1], -m[0], 0]])
    return np.block([[cross, -eye], [eye, np.zeros((3, 3))]])


def defect(scene, name, step):
    """Return the largest component of the change of the symplectic form in one step."""
    q, m = step_from(scene, name, step, np.zeros(3), np.zeros(3))
    columns = []
    for nudge in NUDGE * np.eye(6):
        column = np.zeros(6)
        # weights of the differences over one and over two nudges in either direction
        for weight in (8, -8, -1, 1):
            sign = np.sign(weight) * (1 if abs(weight) == 8 else -2)
            p, n = step_from(scene, name, step, sign * nudge[:3], sign * nudge[3:])
            turn = np.array(quaternion.multiply(p, quaternion.conjugate(tuple(q.tolist()))))
            vector = 2 * np.sign(turn[0]) * turn[1:]
            column += weight * np.concatenate([vector * (1 + vector @ vector / 24), n - m])
        columns.append(column / (12 * NUDGE))
    slope = np.array(columns).T
    return np.abs(slope.T @ form(m) @ slope - form(scene.momentum)).max()


@pytest.mark.parametrize("name, body", CASES)
def test_symplectic_methods_preserve_the_symplectic_form(name, body):
    scene, step = BODIES[body], 0.2
    change = defect(scene, name, step)
    if kr.methods[name].symplectic:
        assert change < 2e-9 * max(1, *scene.momentum)
    else:
        assert change > 1e-8 or not np.isfinite(change)


def test_bobenko_suris4_changes_the_form_by_terms_of_seventh_order():
    """Check that a step of bobenko_suris4 changes the symplectic form by terms of order step^7."""
    changes = [defect(SCENE, "bobenko_suris4", step) for step in (0.2, 0.4)]
    assert not kr.methods["bobenko_suris4"].symplectic
    assert 6.9 < np.log2(changes[1] / changes[0]) < 7.1
