"""Computations with the fourth integral of motion and with two forms of the equations of motion."""

from dataclasses import dataclass
from functools import partial

import kreisel as kr
import numpy as np

from ..competitors import timing
from .trajectories import SCENE, solve_truth, solve_with_restarts

KOWALEWSKI_STEP, KOWALEWSKI_END = 0.1, 300.0
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
FORMS = ("extrap", "extrap_kirchhoff")
STRETCHED = {"kowalewski": 3**0.5, "goryachev_chaplygin": 7**0.5}  # C_N over C_B (5.6.6)


def special_scene(kind, half=0.8):
    """Return the initial state of the program in Bodack's thesis with the constant C_B = `half`."""
    body = kr.Body.cuboid((STRETCHED[kind] * half, half, half / 2), (0.0, 0.0, -half / 2))
    x, y, z = SCENE.momentum
    return kr.Scene(body, momentum=(x, y, z if kind == "kowalewski" else 0.0), gravity=1.0)


@dataclass(frozen=True)
class FourthIntegral:
    """The values of the fourth integral of motion along a path computed by the method `extrap`."""

    t: np.ndarray
    start: float
    change: np.ndarray


def measure_fourth_integral(kind):
    """Compute the data of figure 5.5 of the thesis, or those for the integral G."""
    course = solve_with_restarts(special_scene(kind), KOWALEWSKI_STEP, KOWALEWSKI_END)
    values = getattr(course.path, kind)
    return FourthIntegral(course.t, float(values[0]), values - values[0])


def compute_k_values():
    """Return the Kowalewski integral for two cuboids, as the thesis leaves the units open."""
    values = {}
    for half in (0.8, 1.0):
        scene = special_scene("kowalewski", half)
        body = scene.body
        values[half, "I1 = 1"] = k = float(kr.solve(scene, [0.0]).kowalewski[0])
        values[half, "|p| = 1"] = (
            k / (body.mass * scene.gravity * np.linalg.norm(body.com) / max(body.moments)) ** 2
        )
    return values


@dataclass(frozen=True)
class FormResult:
    """The error and the cost of one form of the equations of motion at one tolerance."""

    scene: str
    form: str
    tol: float
    error: float
    evaluations: int
    seconds: float


def compare_forms(scenes=(("thesis", 100.0), ("asymmetric", 30.0)), rounds=7):
    """Compare the equations of motion in the inertial frame and in the body frame (section 3.4)."""
    return [form for name, end in scenes for form in compare_forms_on(name, end, rounds)]


def compare_forms_on(name, end, rounds):
    scene = getattr(kr.scenes, name)
    q = solve_truth(scene, [end]).path.q[-1]
    settings = [(form, tol) for form in FORMS for tol in TOLERANCES]
    calls = [partial(kr.solve, scene, [end], method=form, tol=tol) for form, tol in settings]
    seconds = timing.best_times(calls, rounds)
    for (form, tol), call, best in zip(settings, calls, seconds, strict=True):
        path = call()
        error = float(kr.attitude_error(path.q[-1], q))
        yield FormResult(name, form, tol, error, path.stats.evaluations, best)


def frozen_frame_error(interval, end=100.0, scene=SCENE):
    """Return the attitude error [rad] if the exact velocity is kept for the rest of an interval."""
    exact = solve_truth(scene, np.arange(round(end / interval) + 1) * interval).path
    q = np.array(exact.q[0])
    for turn in rotation_quaternions(body_velocity(exact)[:-1] * interval):
        q = np.array(kr.quaternion.multiply(q, turn))
    return float(kr.attitude_error(q / np.linalg.norm(q), exact.q[-1]))


def body_velocity(path):
    """Return the components of the angular velocity along the body axes."""
    return np.einsum("nij,nj->ni", path.frame, path.velocity)


def rotation_quaternions(angles):
    """Convert rotation vectors to quaternions."""
    size = np.linalg.norm(angles, axis=1, keepdims=True)
    return np.hstack([np.cos(size / 2), 0.5 * np.sinc(size / (2 * np.pi)) * angles])
