"""The stiff needle, watched: a spin of 1e4 times the precession, and steps that resolve the precession only.

The implicit midpoint rule keeps <m,p> but not <m,a>: with V the velocity at the midpoint, v = V / |V|, a_ the axis there and
theta = 2 atan(h |V| / 4) half the turn of a step, (<m,a>)' - <m,a> = h (1 - cos theta) <v,a_> <M g p x a_, v>: small as h^2
where the spin is resolved, and of the size of the torque's part along V where it is not, whatever the step.
"""

import csv

import kreisel as kr
import numpy as np

from ..peers.contenders import steered
from ..truth.problems import attitude_error
from .atlas import TOL
from .atlas_cases import stiff
from .budget import Task

CASE, TURNS, LOOKS = "needle, 64 a turn of precession", 2, 64
KINDS = {
    "closed form": lambda m: m.exact,
    "fixed step, implicit": lambda m: m.implicit and not m.adaptive,
    "fixed step, explicit": lambda m: not m.adaptive and not m.exact,
    "adaptive": lambda m: m.adaptive,
}


def kind(method):
    return next(words for words, within in KINDS.items() if within(method))


def setting(method, step):
    return (
        {"tol": TOL, "max_steps": 1_000_000}
        if steered(method) == "tol"
        else {"step": step}
        if steered(method)
        else {}
    )


def watched(scene, method, times, step, true):
    try:
        path, message = kr.solve(scene, times, method.name, **setting(method, step)), ""
    except kr.Error as error:
        path, message = error.path, str(error)
    except ValueError as error:
        return {
            "method": method.name,
            "kind": kind(method),
            "message": str(error),
            "t": [],
            "attitude": [],
            "energy": [],
            "axial": [],
        }
    size = np.abs(true.kinetic).max() + abs(scene.body.mass * scene.gravity) * np.linalg.norm(
        scene.body.com
    )
    finite = np.isfinite(path.q).all(axis=1)
    return {
        "method": method.name,
        "kind": kind(method),
        "message": message,
        "t": path.t[finite].tolist(),
        "attitude": [attitude_error(q, p) for q, p in zip(path.q[finite], true.q)],
        "energy": (np.abs(path.energy - true.energy[0])[finite] / size).tolist(),
        "axial": np.abs(path.axial_momentum[finite] / true.axial_momentum[0] - 1).tolist(),
    }


def examine():
    case = next(case for case in stiff() if case.name == CASE)
    scene, step = case.scene(), 2 * np.pi / case.rate / case.steps
    count = int(TURNS * case.steps)
    times = step * np.arange(0, count + 1, max(1, count // LOOKS))
    true = kr.solve(scene, times, "exact")
    return [
        watched(scene, method, times, step, true)
        for method in kr.methods.values()
        if method.suits(scene)
    ]


def tasks(plan):
    if not plan.quick:
        yield Task("stiff/needle", examine, 10.0, until=1.0)


def lines(store):
    return [line for found in store.under("stiff/") for line in found]


def write_csv(file, found):
    with file.open("w", newline="") as out:
        writer = csv.writer(out)
        writer.writerow(
            ("method", "kind", "t", "attitude_error", "energy_error", "axial_error", "message")
        )
        for line in found:
            rows = zip(line["t"], line["attitude"], line["energy"], line["axial"])
            writer.writerows(
                (line["method"], line["kind"], *(f"{x:.6g}" for x in row), line["message"])
                for row in rows
            )
