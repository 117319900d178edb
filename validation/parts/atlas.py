"""The stability atlas: every method and every peer on every stiff or extreme case, and what becomes of it.

Each cell is run twice, as asked and finer, and judged by what these two show and by the truth (judge.py).
"""

import csv
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import pi

import kreisel as kr
import numpy as np

from ..peers import contenders
from ..peers.contenders import steered
from ..truth import reference as truth
from ..truth.problems import attitude_error, described
from . import judge
from .budget import Task

TOL, FINER_TOL = 1e-9, 1e-11
LOOKS = 16
LONGEST = {
    "heyoka": 1e5,
    "scipy_dop853": 600.0,
}  # [rad] for more, a peer takes more than about a second
COLUMNS = (
    "family",
    "case",
    "method",
    "step",
    "tol",
    "end",
    "turns",
    "verdict",
    "shown_by",
    "mark",
    "attitude_error",
    "second_run",
    "shown",
    "promised",
    "rounding",
    "energy_error",
    "conditioning",
    "truth_bits",
    "agreement",
    "steps",
    "evaluations",
    "message",
)


@dataclass(frozen=True)
class How:
    """Who makes a cell: `run` takes problem, scene, times and a setting, and returns attitudes in the principal axes,
    momenta in space, and how many steps and evaluations it took."""

    name: str
    steered: str  # by "step", "tol" or nothing
    order: int
    run: Callable
    longest: float = float("inf")  # [rad] not asked beyond this


def ours(method):
    def run(problem, scene, times, setting):
        path = kr.solve(scene, times, method.name, **setting)
        return problem.principal(path.q), path.m, path.stats.steps, path.stats.evaluations

    return How(method.name, steered(method), method.order, run)


def peer(name):
    def run(problem, scene, times, setting):
        return contenders.RECORDERS[name](problem, times, setting["tol"])

    return How(name, "tol", 0, run, LONGEST[name])


def everybody(scene, radians):
    """Every method that suits the scene, and the peers."""
    found = [ours(method) for method in kr.methods.values() if method.suits(scene)]
    return found + [how for how in map(peer, contenders.RECORDERS) if radians <= how.longest]


def settings(case, how, step):
    """As asked, and finer."""
    if how.steered == "tol":
        more = {"max_steps": case.most} | ({"step": step} if case.begin else {})
        return [{"tol": tol} | more for tol in (TOL, FINER_TOL)]
    return [{"step": step}, {"step": step / 2}] if how.steered else [{}, {}]


def drifts(energies):
    """Whether the energy departs from that at the start in one direction, rather than to swing about."""
    half = len(energies) // 2
    apart = abs(energies[half:].mean() - energies[:half].mean())
    return bool(energies.max() > 1e-6 and apart > 0.4 * np.ptp(energies))


def looked_at(problem, scene, how, times, setting, true):
    q, m, steps, evaluations = how.run(problem, scene, times, setting)
    energies = problem.energy_errors(q, m)
    return {
        "attitude_error": attitude_error(q[-1], true["attitude"]),
        "energy_error": float(energies.max()),
        "drift": len(times) > LOOKS and drifts(energies),
        "steps": steps,
        "evaluations": evaluations,
        "q": q[-1],
    }


def judged(case, problem, scene, how, true, end, step):
    """One cell."""
    first, second = settings(case, how, step)
    cell = {"method": how.name, "step": first.get("step"), "tol": first.get("tol"), "end": end}
    count = round(case.turns * case.steps)
    times = step * np.unique(np.linspace(0, count, LOOKS + 1).round())
    try:
        cell |= looked_at(problem, scene, how, times, first, true)
        again = looked_at(problem, scene, how, times, second, true)
    except kr.Error as error:
        status = {"ERR_NOT_FINITE": judge.BLOW_UP, "ERR_CONVERGENCE": judge.NOT_CONVERGED}.get(
            error.status, judge.STOPPED
        )
        return plain(cell) | {"verdict": "stopped", "mark": status, "message": str(error)}
    except ArithmeticError as error:  # of a peer
        return plain(cell) | {"verdict": "stopped", "mark": judge.STOPPED, "message": str(error)}
    except ValueError as error:
        return plain(cell) | {"verdict": "refused", "mark": judge.REFUSED, "message": str(error)}
    cell["second_run"] = attitude_error(again["q"], cell["q"])
    return plain(judge.judge(cell, again["attitude_error"], problem, true, how))


def plain(cell):
    return {key: value for key, value in cell.items() if key != "q"}


def examine(case, who=everybody):
    """All cells of a case, one a method; where the scene itself is refused, the one that says so."""
    about = {"family": case.family, "case": case.name, "turns": case.turns}
    try:
        scene = case.scene()
    except ValueError as error:
        return [
            {
                **about,
                "method": name,
                "verdict": "refused",
                "mark": judge.REFUSED,
                "message": str(error),
            }
            for name in kr.methods
        ]
    problem = described(case.key, scene)
    step = 2 * pi / (case.rate or problem.rate) / case.steps
    end = step * round(case.turns * case.steps)
    true = truth.closed_form(problem, end) if case.closed else truth.on_the_way(problem, end)
    about |= {
        "conditioning": true["worst"],
        "truth_bits": true["bits"],
        "agreement": true["agreement"],
    }
    return [
        about | judged(case, problem, scene, how, true, end, step)
        for how in who(scene, problem.rate * end)
    ]


def tasks(cases):
    for case in cases:
        yield Task(case.key, partial(examine, case), 6.0 if case.closed else 0.4, until=1.0)


def cells(store):
    return [cell for found in store.under("atlas/") for cell in found]


def write_csv(file, found):
    with file.open("w", newline="") as out:
        writer = csv.DictWriter(out, COLUMNS, extrasaction="ignore")
        writer.writeheader()
        for cell in found:
            writer.writerow(
                {
                    key: f"{value:.4g}" if isinstance(value, float) else value
                    for key, value in cell.items()
                }
            )
