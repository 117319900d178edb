"""The cells of the stability atlas: every method and every peer on every stiff or extreme case.

Each cell is run twice, as asked and finer, and judged by what these two show and by the truth.
"""

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
# For a horizon beyond these angles a peer takes more than about a second [rad].
LONGEST = {"heyoka": 1e5, "scipy_dop853": 600.0}
MARKS = {"ERR_NOT_FINITE": verdicts.BLOW_UP, "ERR_CONVERGENCE": verdicts.NOT_CONVERGED}


@dataclass(frozen=True)
class Candidate:
    """Who makes a cell: `run` takes problem, scene, times and a setting, and gives attitudes in the
    principal axes, momenta in space, and how many steps and evaluations it took."""

    name: str
    steered: str  # by "step", "tol" or nothing
    order: int
    run: Callable
    longest: float = float("inf")  # it is not asked beyond this angle [rad]


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
    """Gives every method that suits the scene, and the peers."""
    found = [make_method_candidate(method) for method in kr.methods.values() if method.suits(scene)]
    return found + [
        who for who in map(make_peer_candidate, single_runs.RECORDERS) if radians <= who.longest
    ]


def choose_settings(case, who, step):
    """Gives two settings: as asked, and finer."""
    if who.steered == "tol":
        more = {"max_steps": case.most} | ({"step": step} if case.begin else {})
        return [{"tol": tol} | more for tol in (TOL, FINER_TOL)]
    return [{"step": step}, {"step": step / 2}] if who.steered else [{}, {}]


def has_drift(energies):
    """Says whether the energy departs from that at the start in one direction, rather than to swing
    about."""
    half = len(energies) // 2
    apart = abs(energies[half:].mean() - energies[:half].mean())
    return bool(energies.max() > 1e-6 and apart > 0.4 * np.ptp(energies))


def measure_run(problem, scene, who, times, setting, true):
    q, m, steps, evaluations = who.run(problem, scene, times, setting)
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
    """Words a run that came to no end."""
    if isinstance(error, ValueError):
        return {"verdict": "refused", "mark": verdicts.REFUSED, "message": str(error)}
    status = getattr(error, "status", None)  # a peer's errors have none
    mark = MARKS.get(status, verdicts.STOPPED)
    return {"verdict": "stopped", "mark": mark, "message": str(error)}


def make_cell(case, problem, scene, who, true, end, step):
    """Makes one cell."""
    asked, finer = choose_settings(case, who, step)
    cell = {"method": who.name, "step": asked.get("step"), "tol": asked.get("tol"), "end": end}
    times = step * np.unique(np.linspace(0, round(case.turns * case.steps), LOOKS + 1).round())
    try:
        cell |= measure_run(problem, scene, who, times, asked, true)
        again = measure_run(problem, scene, who, times, finer, true)
    except (kr.Error, ArithmeticError, ValueError) as error:
        return drop_attitude(cell) | describe_failure(error)
    cell["second_run"] = attitude_error(again["q"], cell["q"])
    return drop_attitude(verdicts.judge_cell(cell, again["attitude_error"], problem, true, who))


def drop_attitude(cell):
    return {key: value for key, value in cell.items() if key != "q"}


def make_cells(case, who=list_candidates):
    """Makes all cells of a case, one a method; where the scene itself is refused, those that say
    so."""
    about = {"family": case.family, "case": case.name, "turns": case.turns}
    try:
        scene = case.scene()
    except ValueError as error:
        return [{**about, "method": name, **describe_failure(error)} for name in kr.methods]
    problem = problem_of_scene(case.key, scene)
    step = 2 * pi / (case.rate or problem.rate) / case.steps
    end = step * round(case.turns * case.steps)
    trusted = reference.truth_by_quadrature if case.closed else reference.compute_truth
    true = trusted(problem, end)
    about |= {
        "conditioning": true["worst"],
        "truth_bits": true["bits"],
        "agreement": true["agreement"],
    }
    return [
        about | make_cell(case, problem, scene, candidate, true, end, step)
        for candidate in who(scene, problem.rate * end)
    ]
