"""Chapter 5.6.6, the fourth integrals; and the claim of chapter 3.4, both forms of the equations in one integrator."""

from dataclasses import dataclass

import kreisel as kr
import numpy as np

from ..peers import measure
from .runs import SCENE, restarted, truth

KOWALEWSKI_STEP, KOWALEWSKI_END = 0.1, 300.0
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
FORMS = ("extrap", "extrap_kirchhoff")


def adjusted(kind, half=0.8):
    """The cuboid at startup, adjusted to C_B = half by the program's checkbox (5.6.6)."""
    stretched = {"kowalewski": 3**0.5, "goryachev_chaplygin": 7**0.5}[kind]
    body = kr.Body.cuboid((stretched * half, half, half / 2), (0.0, 0.0, -half / 2))
    x, y, z = SCENE.momentum
    return kr.Scene(body, momentum=(x, y, z if kind == "kowalewski" else 0.0), gravity=1.0)


@dataclass(frozen=True)
class Fourth:
    """An integral, and its change along Extrap's run."""

    t: np.ndarray
    start: float
    change: np.ndarray


def fourth(kind):
    """Figure 5.5 and its like for G: Extrap, begun anew each 0.1, over 300 units."""
    run = restarted(adjusted(kind), KOWALEWSKI_STEP, KOWALEWSKI_END)
    values = getattr(run.path, kind)
    return Fourth(run.t, float(values[0]), values - values[0])


def values_of_k():
    """K at the start, {(C_B, units): K}: the text's H has I1 = 1, and a unit of time that it leaves open."""
    found = {}
    for half in (0.8, 1.0):
        scene = adjusted("kowalewski", half)
        body = scene.body
        found[half, "I1 = 1"] = k = float(kr.solve(scene, [0.0]).kowalewski[0])
        found[half, "|p| = 1"] = (
            k / (body.mass * scene.gravity * np.linalg.norm(body.com) / max(body.moments)) ** 2
        )
    return found


@dataclass(frozen=True)
class Form:
    """One form of the equations at one tolerance."""

    scene: str
    form: str
    tol: float
    error: float
    evaluations: int
    seconds: float


def forms(scenes=(("thesis", 100.0), ("asymmetric", 30.0)), rounds=7):
    """Chapter 3.4: rest frame against body, both with the whole frame, twelve equations each."""
    rows = []
    for name, end in scenes:
        scene = getattr(kr.scenes, name)
        q = truth(scene, [end]).path.q[-1]
        hows = [(form, tol) for form in FORMS for tol in TOLERANCES]
        calls = [
            lambda form=form, tol=tol: kr.solve(scene, [end], method=form, tol=tol)
            for form, tol in hows
        ]
        samples, _ = measure.interleaved(calls, [measure.once(call) for call in calls], rounds)
        for (form, tol), call, own in zip(hows, calls, samples):
            path = call()
            rows.append(
                Form(
                    name,
                    form,
                    tol,
                    float(kr.attitude_error(path.q[-1], q)),
                    path.stats.evaluations,
                    min(own),
                )
            )
    return rows


def frozen_frame(interval, end=100.0, scene=SCENE):
    """The disadvantage that the text sees: M and P exact, but the frame turned on by the angular velocity at the begin of
    each interval. The attitude error at the end [rad]."""
    exact = truth(scene, np.arange(round(end / interval) + 1) * interval).path
    q = np.array(exact.q[0])
    for w, x, y, z in turns(in_body(exact)[:-1] * interval):
        a, b, c, d = q
        q = np.array(
            [
                a * w - b * x - c * y - d * z,
                a * x + b * w + c * z - d * y,
                a * y - b * z + c * w + d * x,
                a * z + b * y - c * x + d * w,
            ]
        )
    return float(kr.attitude_error(q / np.linalg.norm(q), exact.q[-1]))


def in_body(path):
    """Angular velocity along N, B, T."""
    return np.einsum("nij,nj->ni", path.frame, path.velocity)


def turns(angles):
    """Quaternions of rotation vectors in rows."""
    size = np.linalg.norm(angles, axis=1, keepdims=True)
    return np.hstack([np.cos(size / 2), 0.5 * np.sinc(size / (2 * np.pi)) * angles])
