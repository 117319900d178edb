"""The motion of a stiff top that spins 1e4 times faster than it precesses.

The implicit midpoint rule conserves the vertical momentum <m,p>, but not the axial momentum <m,a>.
Let V be the angular velocity at the midpoint, v = V / |V|, and a_ the symmetry axis at the
midpoint. In a step of size h, the midpoint rule rotates the top by the angle 2 theta, where theta =
2 atan(h |V| / 4). A step changes <m,a> by

    (<m,a>)' - <m,a> = h (1 - cos theta) <v,a_> <M g p x a_, v>

The change of <m,a> per unit of time is of order h^2 if the step size resolves the spin. If the step
size does not resolve the spin, the change of <m,a> per unit of time is independent of the step
size, and of the same order as the component of the torque along V.
"""

import kreisel as kr
import numpy as np

from ..competitors.single_runs import choose_setting
from ..drawing.curves import draw_curves, last_point
from ..drawing.style import COLOURS, LEAST, MARKERS
from ..references.problems import attitude_error
from .atlas_cases import stiff_cases
from .atlas_cells import TOL
from .tasks import Task
from .verdicts import LOST

CASE, TURNS, LOOKS = "needle, 64 a turn of precession", 2, 64
QUANTITIES = "attitude", "energy", "axial"
ERRORS = ("t", *(f"{name}_error" for name in QUANTITIES))
COURSES = {"attitude": "attitude error [rad]", "energy": "energy error, relative"}
KINDS = {
    "closed form": lambda m: m.exact,
    "fixed step, implicit": lambda m: m.implicit and not m.adaptive,
    "fixed step, explicit": lambda m: not m.adaptive and not m.exact,
    "adaptive": lambda m: m.adaptive,
}
KEPT = 1e-3  # relative energy error that counts as conservation


def kind_of(method):
    return next(words for words, is_member in KINDS.items() if is_member(method))


def solve_or_stop(scene, times, method, step):
    """Return the computed path, and the error message if the integration failed."""
    words = choose_setting(method, step, TOL).keywords
    limit = {"max_steps": 1_000_000} if "tol" in words else {}
    try:
        return kr.solve(scene, times, method.name, **words, **limit), ""
    except kr.Error as error:
        return error.path, str(error)
    except ValueError as error:
        return None, str(error)


def measure_line(scene, method, times, step, true):
    path, message = solve_or_stop(scene, times, method, step)
    line = {"method": method.name, "kind": kind_of(method), "message": message}
    if path is None:
        return line | {key: [] for key in ("t", *QUANTITIES)}
    body = scene.body
    weight = abs(body.mass * scene.gravity) * np.linalg.norm(body.com)
    size = np.abs(true.kinetic).max() + weight
    finite = np.isfinite(path.q).all(axis=1)
    return line | {
        "t": path.t[finite].tolist(),
        "attitude": [attitude_error(q, p) for q, p in zip(path.q[finite], true.q, strict=False)],
        "energy": (np.abs(path.energy - true.energy[0])[finite] / size).tolist(),
        "axial": np.abs(path.axial_momentum[finite] / true.axial_momentum[0] - 1).tolist(),
    }


def measure_needle():
    case = next(case for case in stiff_cases() if case.name == CASE)
    scene, step = case.scene(), 2 * np.pi / case.rate / case.steps
    count = int(TURNS * case.steps)
    times = step * np.arange(0, count + 1, max(1, count // LOOKS))
    true = kr.solve(scene, times, "exact")
    return [
        measure_line(scene, method, times, step, true)
        for method in kr.methods.values()
        if method.suits(scene)
    ]


def list_tasks(size):
    if not size.quick:
        yield Task("stiff/needle", measure_needle, 2.0)


def load_findings(store):
    return [line for lines in store.under("stiff/") for line in lines]


def build_context(lines):
    """Name the methods that keep energy and attitude, lose the attitude, or stop before the end."""
    if not lines:
        return {"courses": []}
    kinds = dict.fromkeys(line["kind"] for line in lines)
    looks = {
        kind: {"color": colour, "marker": marker}
        for kind, colour, marker in zip(kinds, COLOURS, MARKERS, strict=False)
    }
    styles = {line["method"]: looks[line["kind"]] for line in lines}
    end = max(line["t"][-1] for line in lines if line["t"])
    complete = [line for line in lines if line["t"] and line["t"][-1] == end]
    is_lost = {line["method"]: line["attitude"][-1] >= LOST for line in complete}
    energy = {line["method"]: max(line["energy"]) for line in complete}
    return {
        "kinds": {kind: look["color"] for kind, look in looks.items()},
        "courses": [
            (label, draw_course(lines, quantity, label, styles))
            for quantity, label in COURSES.items()
        ],
        "kept": [name for name in energy if not is_lost[name] and energy[name] < KEPT],
        "turned": [name for name in energy if is_lost[name] and energy[name] < LOST],
        "incomplete": [line["method"] for line in lines if line not in complete],
    }


def draw_course(lines, quantity, label, styles):
    """Plot an error against time, with one line for each run."""
    return draw_curves(
        {
            line["method"]: (line["t"][1:], np.maximum(line[quantity][1:], LEAST))
            for line in lines
            if len(line["t"]) > 1
        },
        styles,
        last_point,
        (4.9, 4.2),
        xscale="linear",
        xlabel="time; one turn of the precession is 2 pi",
        ylabel=label,
        ylim=(LEAST, 10),
    )


def list_rows(lines):
    """Return the results as rows of a table, one for each method and time."""
    return [
        {"method": line["method"], "kind": line["kind"]}
        | {name: f"{x:.6g}" for name, x in zip(ERRORS, numbers, strict=True)}
        | {"message": line["message"]}
        for line in lines
        for numbers in zip(*(line[key] for key in ("t", *QUANTITIES)), strict=True)
    ]
