"""The results of the stability atlas for all methods and test cases."""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import kreisel as kr
import numpy as np

from ..competitors import single_runs
from ..competitors.single_runs import control_of
from ..references import reference
from ..references.problems import attitude_error, problem_of_scene
from . import verdicts

TOL, FINER_TOL = 1e-9, 1e-11
LOOKS = 16
# Beyond these angles another integrator takes more than about a second [rad].
LONGEST = {"heyoka": 1e5, "scipy_dop853": 600.0}
MARKS = {"ERR_NOT_FINITE": verdicts.BLOW_UP, "ERR_CONVERGENCE": verdicts.NOT_CONVERGED}


@dataclass(frozen=True)
class Candidate:
    """A method of kreisel, or another integrator, that is tested in the stability atlas."""

    name: str
    steered: str  # control: "step", "tol" or ""
    order: int
    # (problem, scene, times, setting) -> attitudes of the principal axes, momenta in the space
    # frame, and the numbers of steps and evaluations
    run: Callable
    longest: float = float("inf")  # angle through which this candidate may follow a top [rad]


def make_method_candidate(method):
    def run(problem, scene, times, setting):
        path = kr.solve(scene, times, method.name, **setting)
        return problem.to_principal_axes(path.q), path.m, path.stats.steps, path.stats.evaluations

    return Candidate(method.name, control_of(method), method.order, run)


def make_peer_candidate(name):
    def run(problem, scene, times, setting):
        return single_runs.RECORDERS[name](problem, times, setting["tol"])

    return Candidate(name, "tol", 0, run, LONGEST[name])


def list_candidates(scene, radians):
    """Return all methods that can integrate a motion through a total angle of `radians`."""
    own = (make_method_candidate(method) for method in kr.methods.values() if method.suits(scene))
    candidates = [*own, *map(make_peer_candidate, single_runs.RECORDERS)]
    return [candidate for candidate in candidates if radians <= candidate.longest]


def choose_settings(case, candidate, step):
    """Return the requested accuracy setting and a more accurate one; none for closed forms."""
    if candidate.steered == "tol":
        more = {"max_steps": case.most} | ({"step": step} if case.begin else {})
        return [{"tol": tol} | more for tol in (TOL, FINER_TOL)]
    return [{"step": step}, {"step": step / 2}] if candidate.steered else [{}, {}]


def has_drift(energies):
    """Return True if the energy drifts in one direction instead of oscillating."""
    half = len(energies) // 2
    difference = abs(energies[half:].mean() - energies[:half].mean())
    return bool(energies.max() > 1e-6 and difference > 0.4 * np.ptp(energies))


def measure_run(problem, scene, candidate, times, setting, true):
    q, m, steps, evaluations = candidate.run(problem, scene, times, setting)
    energies = problem.energy_errors(q, m)
    return {
        "attitude_error": attitude_error(q[-1], true["attitude"]),
        "energy_error": float(energies.max()),
        "fastest": problem.highest_rate(np.asarray(q), np.asarray(m)),
        "drift": len(times) > LOOKS and has_drift(energies),
        "steps": steps,
        "evaluations": evaluations,
        "q": q[-1],
    }


def describe_failure(error):
    """Return the verdict and the message for an integration that failed with an exception."""
    if isinstance(error, ValueError):
        return {"verdict": "refused", "mark": verdicts.REFUSED, "message": str(error)}
    status = getattr(error, "status", None)  # errors of other integrators have no status
    mark = MARKS.get(status, verdicts.STOPPED)
    return {"verdict": "stopped", "mark": mark, "message": str(error)}


def make_cell(case, problem, scene, candidate, true, end, step):
    """Return the result of one method on one test case."""
    setting, finer = choose_settings(case, candidate, step)
    cell = {"method": candidate.name, "end": end}
    cell |= {"step": setting.get("step"), "tol": setting.get("tol")}
    times = step * np.unique(np.linspace(0, round(case.turns * case.steps), LOOKS + 1).round())
    try:
        cell |= measure_run(problem, scene, candidate, times, setting, true)
        again = measure_run(problem, scene, candidate, times, finer, true)
        cell["second_run"] = attitude_error(again["q"], cell["q"])
        cell = verdicts.judge_cell(cell, again["attitude_error"], problem, true, candidate)
    except (kr.Error, ArithmeticError, ValueError) as error:
        cell |= describe_failure(error)
    cell.pop("q", None)
    return cell


def make_cells(case, find_candidates=list_candidates):
    """Return the results of all methods on one test case, or the message that refuses its scene."""
    description = {"family": case.family, "case": case.name, "turns": case.turns}
    try:
        scene = case.scene()
    except ValueError as error:
        return [{**description, "method": name, **describe_failure(error)} for name in kr.methods]
    problem = problem_of_scene(case.key, scene)
    step = 2 * pi / (case.rate or problem.rate) / case.steps
    end = step * round(case.turns * case.steps)
    compute_reference = reference.truth_by_quadrature if case.closed else reference.compute_truth
    true = compute_reference(problem, end)
    description |= {
        "conditioning": true["worst"],
        "truth_bits": true["bits"],
        "agreement": true["agreement"],
    }
    return [
        description | make_cell(case, problem, scene, candidate, true, end, step)
        for candidate in find_candidates(scene, problem.fastest_rate * end)
    ]
