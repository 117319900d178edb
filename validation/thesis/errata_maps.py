"""Errata of chapter 4: the Bobenko-Suris discretization and its units."""

import kreisel as kr
import numpy as np

from . import su2
from .scaled_units import scaled_units
from .trajectories import HALF, SCENE, solve_theorem42, solve_truth

UNITS = scaled_units(SCENE.body)
SCALED = UNITS.into(SCENE)
# The scene is tilted by 0.6 rad, because no torque acts on an upright start.
TILTED = SCALED.replace(attitude=(np.cos(0.3), np.sin(0.3), 0.0, 0.0))
STEP, END = 0.02, 20.0


def attitude_error_at(q, scene, end):
    return kr.attitude_error(q, su2.exact_attitude(scene, end))


def third_integral():
    return (
        attitude_error_at(su2.run_theorem42(TILTED, STEP, END, c_of=c), TILTED, END) for c in "pa"
    )


def second_form():
    m, a = np.array(TILTED.momentum), np.array((0.0, -np.sin(0.6), np.cos(0.6)))
    alpha, g = TILTED.body.moments[2], TILTED.body.mass * TILTED.gravity
    m, b = su2.make_step(m, a, STEP, g)
    c = m @ a
    first = su2.compute_xi(1, m, a, b, c, alpha, STEP)
    for factor in (2 / c, 2 / STEP):
        second = su2.compute_xi(2, m, a, b, c, alpha, STEP, factor)
        yield np.linalg.norm(second - first) / np.linalg.norm(first)


def which_rotation():
    return (
        attitude_error_at(su2.run_theorem42(TILTED, STEP, END, side=side), TILTED, END)
        for side in ("inverse", "left")
    )


def integrate_alpha():
    """Return I3 / I1 about the centre of the lower face, by a Gauss quadrature that is exact."""
    nodes = np.array((-1.0, 1.0)) / 3**0.5
    x, y, z = np.meshgrid(HALF[0] * nodes, HALF[1] * nodes, HALF[2] * (nodes + 1))
    return (x**2 + y**2).sum() / (y**2 + z**2).sum()


def moments():
    n, _, t = HALF
    alpha = integrate_alpha()
    return (abs(2 * n * n / (n * n + k * t * t) / alpha - 1) for k in (1, 4))


def scale_scene(i1, alpha, p):
    """Return the Lagrange top studied in the thesis, in dimensionless units."""
    body = kr.Body(1.0, (1.0, 1.0, alpha), (0.0, 0.0, p), unphysical=True)
    return kr.Scene(
        body, momentum=np.array(SCENE.momentum) / i1, attitude=SCENE.attitude, gravity=1.0
    )


def gravity():
    n, _, t = HALF
    mass, i1 = SCENE.body.mass, SCENE.body.moments[0]
    text = scale_scene(mass / 3 * (n * n + t * t), 2 * n * n / (n * n + t * t), 1 / t)
    right = scale_scene(i1, SCENE.body.moments[2] / i1, mass * t / i1)
    return (
        0.5 * attitude_error_at(solve_truth(scene, [1.0]).path.q[-1], SCENE, 1.0)
        for scene in (text, right)
    )


def unit_of_momentum():
    faster = SCENE.replace(gravity=4 * SCENE.gravity)
    for factor in (4, 2):
        scene = faster.replace(momentum=factor * np.array(SCENE.momentum))
        yield attitude_error_at(solve_truth(scene, [0.5]).path.q[-1], SCENE, 1.0)


def fit_order(scene, steps=(0.02, 0.01, 0.005), end=4.0):
    """Return the observed order of convergence of the attitude."""
    paths = [solve_theorem42(scene, h, end).path for h in steps]
    errors = [attitude_error_at(path.q[-1], scene, end) for path in paths]
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


def first_order():
    return (abs(fit_order(scene) - 1) for scene in (SCALED, TILTED))
