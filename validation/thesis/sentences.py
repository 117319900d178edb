"""The quantitative sentences of the thesis, with the numbers by which they are checked."""

import tomllib
from pathlib import Path

import jinja2
import kreisel as kr
import numpy as np

from ..parts.formatting import FILTERS
from . import su2
from .experiments import time_grid
from .figures import NAMES, compute_rod, describe_largest
from .integrals import FORMS, compute_k_values, special_scene
from .scaled_units import scaled_units
from .trajectories import (
    HALF,
    SCENE,
    fit_exponent,
    largest_until,
    solve_fixed_step,
    solve_theorem42,
    solve_truth,
)

DATA = Path(__file__).with_suffix(".toml")
HELPERS = {
    **{"abs": abs, "min": min, "max": max, "ptp": np.ptp, "degrees": np.degrees},
    "size": lambda values: np.abs(values).max(),
    "errors": describe_largest,
    "SEEN": 0.05,  # the smallest frame error that is visible in the pictures [rad]
}


def check_sentences(results):
    """Return the rows of sentences.toml with results, reasons and verdicts."""
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined)
    environment.filters |= FILTERS
    context = HELPERS | vars(results) | measure_numbers(results)
    sentences = tomllib.loads(DATA.read_text(encoding="utf-8"))["sentences"]
    for sentence in sentences:
        for part in ("found", "why"):
            text = environment.from_string(sentence.get(part, "")).render(context)
            sentence[part] = " ".join(text.split())
        condition = environment.compile_expression(sentence["holds"], undefined_to_none=False)
        sentence["holds"] = bool(condition(context))
    return sentences


def measure_numbers(results):
    """Return the numbers of all sentences, by the names that sentences.toml uses."""
    four, timed = results.four, results.timed
    numbers = measure_forms(results.forms) | measure_tops() | measure_map()
    numbers |= measure_experiment1(four) | explain_experiments(results)
    numbers |= measure_failing(results.failing, results.growth)
    numbers |= measure_experiment2(timed) | measure_steps(results.by_step)
    per_interval = four.green.evaluations / (len(four.t) - 1)
    return numbers | {"per_interval": per_interval, "k_values": compute_k_values()}


def explain_experiments(results, target=900.0):
    """Say which tolerances of Extrap would give the errors that the thesis quotes."""
    tol, error = max(results.loose.items())
    late = [tol for tol, t, _ in results.crossings if t is None or t > target]
    early = [tol for tol, t, _ in results.crossings if t is not None and t <= target]
    end = "the program's own Extrap is not available"
    return {
        "worse1": f"Extrap keeps its tolerance; with {tol:.0e} its error would be {error:.1g} rad. "
        f"{end[0].upper()}{end[1:]}",
        "worse2": f"this would hold for a tolerance between {max(late):.0e} and {min(early):.0e}; "
        f"{end}",
    }


def measure_forms(forms):
    at_tolerance = {row.form: row for row in forms if (row.scene, row.tol) == ("thesis", 1e-8)}
    return {"rest": at_tolerance[FORMS[0]], "body": at_tolerance[FORMS[1]]}


def measure_map(eps=0.2):
    """Return the deviation of the Bobenko-Suris method from theorem 4.1 as the thesis states it."""
    scaled = scaled_units(SCENE.body).into(SCENE)
    path = solve_fixed_step(scaled, "bobenko_suris", eps, 20.0).path
    g = scaled.body.mass * scaled.gravity
    before = zip(path.m[:-1], path.apex[:-1], strict=True)
    states = np.array([su2.make_step(m, a, eps, g) for m, a in before])
    difference = states - np.stack((path.m[1:], path.apex[1:]), axis=1)
    return {"residual": np.abs(difference).max()}


def measure_tops():
    """Measure the bodies, rods and traces of chapters 4 and 5."""
    body, (n, b, t) = SCENE.body, HALF
    rods = [compute_rod(special_scene(kind)) for kind in NAMES]
    apex = kr.apex(solve_truth(SCENE, np.linspace(0, 60, 6001)).path)
    height = apex.height
    is_low = (height[1:-1] < height[:-2]) & (height[1:-1] < height[2:])
    moments = {kind: special_scene(kind).body.moments for kind in NAMES}
    return {
        "alpha": body.moments[2] / body.moments[0],
        "printed_alpha": 2 * n * n / (n * n + t * t),
        "lever": body.mass * body.com[2] / body.moments[0],
        "transverse": (8 * n * b * t / 3 * (b**2 + 4 * t**2), body.moments[0]),
        "points": len(solve_theorem42(SCENE, 0.02, 1.0).t),
        "moments": {kind: (two / one, three / one) for kind, (one, two, three) in moments.items()},
        "discrete_rod": [measure_discrete_rod(eps) for eps in (0.05, 0.025)],
        "bending": [rod.stiffness[1] / rod.stiffness[0] for rod in rods],
        "thickness": [rod.section[1] for rod in rods],
        "period": apex.nutation().period,
        "intervals": np.diff(apex.t[1:-1][is_low]),
        "evaluations": count_evaluations(),
    }


def measure_discrete_rod(eps, end=20.0):
    """Return the distance of the ends of the discrete rod and of the continuous centre line.

    Between successive frames of the discrete rod, the centre line advances by the step size along
    the tangent T.
    """
    rod = kr.rod(solve_truth(SCENE, time_grid(eps, end)).path)
    return np.linalg.norm(eps * rod.frame[:-1, 2].sum(axis=0) - rod.centre[-1])


def count_evaluations(target=1e-3, end=100.0):
    """Return how many torque evaluations rk4 and extrap each need to reach the same accuracy."""
    true = solve_truth(SCENE, [end]).path.q[-1]
    settings = {
        "rk4": ({"step": end / round(500 * 1.1**k)} for k in range(50)),
        "extrap": ({"tol": 10.0**-k} for k in range(3, 12)),
    }
    counts = {}
    for method, choices in settings.items():
        paths = (kr.solve(SCENE, [end], method, **setting) for setting in choices)
        good = (path for path in paths if 0.5 * kr.attitude_error(path.q[-1], true) < target)
        counts[method] = next(good).stats.evaluations
    return counts


def measure_experiment1(four):
    late, energy = (four.t >= 200) & (four.t <= 300), four.blue.energy_error
    maxima = {name: np.maximum.accumulate(four.L[name]) for name in ("BS", "Ext")}
    return {
        "slopes": [np.polyfit(four.t[late], values[late], 1)[0] for values in maxima.values()],
        "powers1": [fit_exponent(four.t, four.L[name], 20) for name in maxima],
        "drift": four.green.axial_error,
        "range_ratio": np.ptp(energy) / np.ptp(four.red.energy_error),
        "step_ratio": four.eps2 / four.eps1,
        "correlation": correlate_errors(four),
        "halves": [np.ptp(energy[part]) for part in (four.t <= 300, four.t > 300)],
    }


def correlate_errors(four, end=200.0):
    """Return the correlation between the energy error and the oscillations of the frame error L.

    Returns the correlation at zero lag, the largest correlation, and the lag at which it occurs.
    On average, the frame error L grows linearly with time; its oscillations are therefore visible
    in L / t. Only time lags shorter than half a nutation period are considered.
    """
    selection = (four.t > 20) & (four.t <= end)
    swing = (four.L["BS"][1:] / four.t[1:])[selection[1:]]
    first = int(np.argmax(selection))
    later = [four.blue.energy_error[first + k : first + k + len(swing)] for k in range(21)]
    correlations = [np.corrcoef(energy, swing)[0, 1] for energy in later]
    best = int(np.argmax(correlations))
    return float(correlations[0]), float(correlations[best]), best * four.eps2


def measure_failing(four, rows):
    by_g = {g: rows[rows[:, 0] == g] for g in np.unique(rows[:, 0])}
    weak, usual, heavy = (by_g[g][:, 3] for g in (0.5, 1.0, 10.0))
    error, term = four.blue.energy_error, by_g[1.0][:, 2]
    return {
        "by_gravity": (weak[1], heavy[1]),
        "by_momentum": (usual[0], usual[-1]),
        "term_change": term[-1] / term[0] - 1,
        "errors_grow": (heavy > weak).all() and all(r[-1, 3] > r[0, 3] for r in by_g.values()),
        "failed": four.L,
        "failed_energy": (error.min(), error.max(), four.blue.path.energy[0]),
    }


def measure_experiment2(timed):
    intervals = len(timed.t) - 1
    return {
        "microseconds": [1e6 * timed.seconds[name] for name in ("BS", "Ext")],
        "steps": [timed.green.steps / intervals, timed.green.rejected / intervals],
        "powers2": [fit_exponent(timed.t, timed.L[name], 100) for name in ("BS", "Ext")],
        "energies": [largest_until(timed.t, abs(timed.green.energy_error), t) for t in (100, 1000)],
        "meet": find_overtaking(timed),
    }


def find_overtaking(timed):
    """Return from when `extrap` stays less accurate than Bobenko-Suris in equal time, or None."""
    ext, equal = (np.maximum.accumulate(timed.L[name]) for name in ("Ext", "equal"))
    last = int(np.flatnonzero(ext <= equal)[-1])
    return None if last == len(ext) - 1 else float(timed.t[last + 1])


def measure_steps(by_step):
    """Return the errors of Runge-Kutta beside Bobenko-Suris, and the time when they exceed 0.5."""
    equal = by_step[0.2]
    return {
        "equal": equal,
        "per_step": [run.evaluations / run.steps for run in (equal.rk4, equal.bs)],
        "step_ratios": [each.L["rk4"].max() / each.L["BS"].max() for each in by_step.values()],
        "wrong": {
            h: next((float(t) for t in each.t[each.L["rk4"] > 0.5]), None)
            for h, each in by_step.items()
        },
    }
