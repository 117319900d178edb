"""What leaving out gravity, or the general form of a symmetric body, saves each method (omissions.py: what it saves each scene)."""

import csv
from dataclasses import replace

import kreisel as kr

from ..peers import measure
from ..peers.contenders import steered
from ..truth.problems import load
from .budget import Task

STEPS, STEP, TOL = 4000, 2.0**-6, 1e-9
LEAST = 5  # rounds of the timing
COLUMNS = ("kind", "name", "case", "seconds", "seconds_with", "bytes", "bytes_with")


def forms(problem):
    """The same top as a general body, as a symmetric one, and without gravity."""
    i1, i2, i3 = problem.inertia
    return {
        "general form": replace(problem, inertia=(i1, i2 * (1 + 1e-9), i3)).scene(),
        "symmetric form": problem.scene(),
        "no gravity": problem.scene().replace(gravity=0.0),
    }


def how(method):
    return {"tol": TOL} if steered(method) == "tol" else {"step": STEP} if steered(method) else {}


def by_form(rounds):
    """Seconds of each method, to the same end, on each form of the thesis' top."""
    calls, keys = [], []
    for form, scene in forms(load("thesis")).items():
        for method in kr.methods.values():
            if method.suits(scene):
                keys.append({"kind": "form", "name": method.name, "case": form})
                calls.append(
                    lambda scene=scene, method=method: kr.solve(
                        scene, STEPS * STEP, method.name, **how(method)
                    )
                )
    return [key | {"seconds": seconds} for key, seconds in zip(keys, best(calls, rounds))]


def best(calls, rounds):
    about = [min(measure.once(call) for _ in range(2)) for call in calls]
    samples, interrupted = measure.interleaved(calls, about, rounds)
    if interrupted:
        raise KeyboardInterrupt
    return [min(got) for got in samples]


def tasks(plan):
    yield Task("left out/form", lambda: by_form(max(LEAST, plan.rounds)), 1.0)


def rows(store):
    return [row for found in store.under("left out/") for row in found]


def table(found):
    """Microseconds of each method on each form."""
    lines = {}
    for row in found:
        if row["kind"] == "form":
            lines.setdefault(row["name"], {})[row["case"]] = row["seconds"]
    return lines


def write_csv(file, found):
    with file.open("w", newline="") as out:
        writer = csv.DictWriter(out, COLUMNS)
        writer.writeheader()
        writer.writerows(found)
