"""The stability atlas: every method on every stiff or extreme case, and what becomes of it.

Each cell is run twice: as asked, and at half the step or a hundredth of the tolerance, which is what a careful user does
who has no truth. It is
    right      off by no more than rounding explains: the conditioning, once per step in random directions
    degraded   off by less than 0.1 rad, and the second run or the tolerance says so
    lost       off by more, and the second run says so; or the step does not resolve the motion
    stopped    it gave up with a message; refused: it did not begin
    silent     wrong in silence: off by far more than is explained by an adaptive method's tolerance at every step, or by a
               fixed-step one's energy error, carried on as the data's roundings are; and the fixed step resolves the
               motion, and halved does not show it
"""
import csv
from math import pi, sqrt

import numpy as np

import kreisel as kr

from . import truth
from .contenders import steered
from .plan import Task
from .scenes import attitude_error, described

TOL, FINER_TOL = 1e-9, 1e-11
RESOLVED = 16       # steps a turn from which a step is said to resolve the motion
LOST = 0.1          # [rad]
SHOWN = 10.0        # the second run shows an error if it differs by this part of it
BEYOND = 100.0      # times what tolerance or rounding explain
MOST_STEPS = 100_000
LOOKS = 16
COLUMNS = ("family", "case", "method", "step", "tol", "end", "turns", "verdict", "mark", "attitude_error", "second_run",
           "energy_error", "conditioning", "explained", "truth_bits", "agreement", "steps", "message")
VERDICTS = ("right", "degraded", "lost", "stopped", "refused", "silent")
BLOW_UP, STOPPED, REFUSED, DRIFT, SILENT, NOT_CONVERGED = "×", "S", "R", "d", "!", "N"
MARKS = {BLOW_UP: "blew up: the state stopped being finite, or the energy grew beyond all that is there",
         NOT_CONVERGED: "an implicit step did not converge", STOPPED: "gave up, with a message",
         REFUSED: "refused before anything ran", DRIFT: "the energy drifts", SILENT: "wrong in silence"}


def settings(case, method, step):
    """As asked, and finer."""
    how = steered(method)
    if how == "tol":
        first = {"step": step} if case.begin else {}
        return [{"tol": tol, "max_steps": MOST_STEPS} | first for tol in (TOL, FINER_TOL)]
    return [{"step": step}, {"step": step / 2}] if how else [{}, {}]


def drifts(energies):
    """Whether the energy departs from that at the start in one direction, rather than to swing about."""
    half = len(energies) // 2
    apart = abs(energies[half:].mean() - energies[:half].mean())
    return bool(energies.max() > 1e-6 and apart > 0.4 * np.ptp(energies))


def run(problem, scene, method, times, setting, true):
    path = kr.solve(scene, times, method, **setting)
    energies = problem.energy_errors(problem.principal(path.q), path.m)
    q = problem.principal(path.q[-1])
    return {"attitude_error": attitude_error(q, true["attitude"]), "energy_error": float(energies.max()),
            "drift": len(times) > LOOKS and drifts(energies), "steps": path.stats.steps, "q": q}


def explained(problem, end, true, cell, how):
    """Up to what angle rounding explains an error [rad]; and up to what angle what else is known of the run: the
    tolerance of each of its steps, or its energy error, carried on as the data's roundings are."""
    condition = max(true["worst"], truth.ROUNDING)
    rounding = condition * max(10.0, sqrt(max(cell["steps"], problem.rate * end)))
    growth = condition / truth.ROUNDING
    return rounding, rounding + growth * (TOL * cell["steps"] if how == "tol" else cell["energy_error"])


def verdict(case, how, cell, rounding, tolerated):
    error, shown = cell["attitude_error"], cell["second_run"] >= cell["attitude_error"] / SHOWN
    if error <= rounding:
        return "right"
    resolved = how != "step" or case.steps >= RESOLVED and not case.rate
    beyond = error > BEYOND * tolerated
    if resolved and beyond and (how != "step" or not shown):
        return "silent"
    return "degraded" if error < LOST else "lost"


def mark(cell):
    if cell["verdict"] == "silent":
        return SILENT
    return BLOW_UP if cell["energy_error"] > 1 else DRIFT if cell["drift"] else ""


def judged(case, problem, scene, method, true, end, step):
    """One cell."""
    how = steered(method)
    first, second = settings(case, method, step)
    cell = {"method": method.name, "step": first.get("step"), "tol": first.get("tol"), "end": end}
    count = round(case.turns * case.steps)
    times = step * np.unique(np.linspace(0, count, LOOKS + 1).round())
    try:
        cell |= run(problem, scene, method.name, times, first, true)
        again = run(problem, scene, method.name, times, second, true)
    except kr.Error as error:
        status = {"ERR_NOT_FINITE": BLOW_UP, "ERR_CONVERGENCE": NOT_CONVERGED}.get(error.status, STOPPED)
        return {**plain(cell), "verdict": "stopped", "mark": status, "message": str(error)}
    except ValueError as error:
        return {**plain(cell), "verdict": "refused", "mark": REFUSED, "message": str(error)}
    cell["second_run"] = attitude_error(again["q"], cell["q"])
    rounding, tolerated = explained(problem, end, true, cell, how)
    cell |= {"explained": tolerated, "verdict": verdict(case, how, cell, rounding, tolerated)}
    return plain({**cell, "mark": mark(cell)})


def plain(cell):
    return {key: value for key, value in cell.items() if key != "q"}


def examine(case):
    """All cells of a case, one a method; where the scene itself is refused, the one that says so."""
    about = {"family": case.family, "case": case.name, "turns": case.turns}
    try:
        scene = case.scene()
    except ValueError as error:
        return [{**about, "method": name, "verdict": "refused", "mark": REFUSED, "message": str(error)} for name in kr.methods]
    problem = described(case.key, scene)
    step = 2 * pi / (case.rate or problem.rate) / case.steps
    end = step * round(case.turns * case.steps)
    true = truth.on_the_way(problem, end)
    about |= {"conditioning": true["worst"], "truth_bits": true["bits"], "agreement": true["agreement"]}
    return [about | judged(case, problem, scene, method, true, end, step)
            for method in kr.methods.values() if method.suits(scene)]


def tasks(cases):
    for case in cases:
        yield Task(case.key, lambda case=case: examine(case), .4, until=1.0)


def cells(store):
    return [cell for found in store.under("atlas/") for cell in found]


def write_csv(file, found):
    with file.open("w", newline="") as out:
        writer = csv.DictWriter(out, COLUMNS, extrasaction="ignore")
        writer.writeheader()
        for cell in found:
            writer.writerow({key: f"{value:.4g}" if isinstance(value, float) else value for key, value in cell.items()})
