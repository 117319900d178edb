"""Errata of chapters 3 and 5: rotations, the Lagrangian, elastic rods and the fourth integrals."""

import kreisel as kr
import numpy as np

from . import su2
from .integrals import body_velocity, special_scene
from .trajectories import SCENE, solve_truth


def rotation_matrix():
    angle, axis, x = 0.7, np.array((2, -1, 2)) / 3, np.array((0.3, 0.5, -0.2))
    expected = (
        x * np.cos(angle)
        + np.cross(axis, x) * np.sin(angle)
        + axis * (axis @ x) * (1 - np.cos(angle))
    )
    text = np.cos(angle / 2) * su2.ID + np.sin(angle / 2) * su2.to_matrix(axis)
    return (
        np.linalg.norm(su2.rotate(Phi, x) - expected)
        for Phi in (text, su2.rotation_matrix(axis, -angle))
    )


def products():
    text, right = [], []
    for i in range(3):
        for j in range(3):
            k = 3 - i - j
            sign = 0 if i == j else (1 if (j - i) % 3 == 1 else -1)
            formula = 0.5 * sign * su2.BASIS[k % 3]
            product = su2.BASIS[i] @ su2.BASIS[j]
            text.append(abs(product - formula).max())
            right.append(abs(product - (-su2.ID / 4 if i == j else formula)).max())
    return max(text), max(right)


def moving(h=1e-4, t=3.0):
    """Return the matrix Phi, the body frame, and their time derivatives at the time `t`."""
    path = solve_truth(SCENE, [t - h, t, t + h]).path
    before, middle, after = (np.linalg.inv(su2.from_quaternion(q)) for q in path.q)
    return (
        middle,
        (after - before) / (2 * h),
        path.frame[1],
        (path.frame[2] - path.frame[0]) / (2 * h),
    )


def curvature():
    Phi, change, (n, b, _), rates = moving()
    back = np.linalg.inv(Phi)
    kappa1 = rates[2] @ n
    formula = su2.to_matrix((rates[2] @ b, -kappa1, -rates[0] @ b))
    values = [
        -2
        * np.trace(
            (back @ e @ change - back @ change @ back @ su2.E3 @ Phi) @ back @ su2.E1 @ Phi
        ).real
        for e in (su2.E2, su2.E3)
    ]
    return abs(values[0] - kappa1), max(abs(values[1] - kappa1), abs(change @ back - formula).max())


def slips():
    path = solve_truth(SCENE, [3.0]).path
    a, Phi = path.apex[0], np.linalg.inv(su2.from_quaternion(path.q[0]))
    text = np.array((0.0, a[0], a[1] + a[2]))
    return (
        max(np.linalg.norm(vector - a), np.linalg.norm(su2.rotate(Phi, axis) - path.frame[0, 0]))
        for vector, axis in ((text, (0, 1, 0)), (a, (1, 0, 0)))
    )


def rods():
    path = solve_truth(special_scene("kowalewski"), np.linspace(0, 20, 201)).path
    rod, lagrangian = kr.rod(path), path.kinetic - path.potential
    one, two, twist = rod.stiffness
    sizes = path.kinetic.max()
    text = 0.5 * (rod.curvature**2 @ (two, one) + twist * rod.torsion**2) + rod.frame[
        :, 2, 2
    ] * path.scene.gravity * np.linalg.norm(path.scene.body.com)
    return abs(text - lagrangian).max() / sizes, abs(
        rod.lagrangian_density - lagrangian
    ).max() / sizes


def action(angle, end, n=400):
    """Return the difference in action between a swinging and a hanging top."""
    i1, weight = SCENE.body.moments[0], SCENE.body.mass * SCENE.gravity * SCENE.body.com[2]
    phase = np.pi * (np.arange(n) + 0.5) / n
    speed = angle * np.pi / end * np.cos(phase)
    change = 0.5 * i1 * speed**2 - weight * (1 - np.cos(angle * np.sin(phase)))
    return change.mean() / (weight * angle**2)


def stationary():
    slope = (action(1e-3, 10.0) * 1e-3 - action(-1e-3, 10.0) * 1e-3) / 2
    return max(0.0, -action(0.1, 10.0)), abs(slope)


def kirchhoff():
    h = 1e-4
    scene = kr.scenes.asymmetric
    path = solve_truth(scene, [1 - h, 1, 1 + h]).path
    moments, lever = np.array(scene.body.moments), np.array(scene.body.principal_com)
    body = body_velocity(path) * moments
    change, up = (body[2] - body[0]) / (2 * h), path.frame[1, :, 2]
    kinetic, weight = (
        np.cross(body[1], body[1] / moments),
        scene.body.mass * scene.gravity * np.cross(up, lever),
    )
    return (
        np.linalg.norm(kinetic + sign * weight - change) / np.linalg.norm(change)
        for sign in (-1, 1)
    )


def integral_k():
    path = solve_truth(special_scene("kowalewski"), np.linspace(0, 20, 201)).path
    body, i1 = path.scene.body, max(path.scene.body.moments)
    weight = body.mass * path.scene.gravity * np.linalg.norm(body.com) / i1
    # N is the axis of the different moment, and com lies on T
    _, m2, m1 = (body_velocity(path) * body.moments / i1).T
    _, p2, p1 = (weight * path.frame[:, :, 2]).T
    values = [
        (m1**2 - m2**2 + 2 * sign * p1) ** 2 + 4 * (m1 * m2 + sign * p2) ** 2 for sign in (1, -1)
    ]
    return (np.ptp(value) for value in values)
