"""A wide ensemble: random tops of each kind, the methods against each other at equal time, as distributions.

Each method gets the setting with which it takes, on the first tops, about the time that all are given; then it runs on
every top to the same number of turns. The truth is heyoka in 80 bit, beyond what is told apart here.
"""

import csv
from math import pi
from statistics import median

import kreisel as kr
import numpy as np

from ..peers import measure
from ..peers.contenders import steered
from ..truth import reference as truth
from ..truth.problems import attitude_error, described
from .budget import Task

SEED, TURNS = 6, 10.0
GIVEN = 0.4e-3  # of one run [s]
SOME = 5  # tops to find the setting with
STEPS = 2000  # to find the time of a step with
TOLERANCES = [10.0**-k for k in range(2, 15)]
COLUMNS = ("kind", "top", "method", "setting", "seconds", "attitude_error", "failure")
KOWALEWSKI = (1.0, 2.0, 2.0)


def body(kind, random):
    """A body of the kind, with moments between 0.2 and 1 and its centre of mass within about 1."""
    if kind == "Lagrange":
        i1 = random.uniform(0.5, 1.0)
        return kr.Body.symmetric(1.0, i1, random.uniform(0.2, 2 * i1), random.uniform(0.1, 1.0))
    if kind == "Kowalewski":
        return kr.Body(1.0, KOWALEWSKI, (0.0, *random.normal(0.0, 0.5, 2)))
    a, b = random.uniform(0.5, 1.0, 2)
    com = random.normal(0.0, 0.5, 3) * (kind != "Euler")
    return kr.Body(1.0, (a, b, random.uniform(abs(a - b) + 0.05, a + b)), com)


def scene(kind, random):
    q = random.normal(size=4)
    made = body(kind, random)
    momentum = random.normal(0.0, 1.5, 3) * max(made.moments)
    return kr.Scene(made, momentum, q / np.linalg.norm(q))


KINDS = {
    "Lagrange": "two equal moments, the centre of mass on the third axis",
    "Euler": "any body, turning about its centre of mass",
    "Kowalewski": "moments 1 : 2 : 2, the centre of mass in the plane of the equal ones' axes",
    "general": "any body, any centre of mass",
}


def tops(kind, members):
    random = np.random.default_rng([SEED, list(KINDS).index(kind)])
    return [described(kind, scene(kind, random)) for _ in range(members)]


def end_of(problem):
    return TURNS * 2 * pi / problem.rate


def timed(problem, name, setting):
    """Seconds of a run, and its error."""
    with measure.undisturbed():
        begin = measure.perf_counter()
        path = kr.solve(problem.user, end_of(problem), name, **setting(problem))
        return measure.perf_counter() - begin, path.q[-1]


def by_count(count):
    return lambda problem: {"step": end_of(problem) / count}


def by_tolerance(tol):
    return lambda problem: {"tol": tol}


def fitted(method, some):
    """A setting with which the method takes the given time: of a top (a function), and in words."""
    if not steered(method):
        return lambda problem: {}, "closed form"
    if steered(method) == "step":
        each = median(timed(top, method.name, by_count(STEPS))[0] for top in some) / STEPS
        count = max(1, round(GIVEN / each))
        return by_count(count), f"{count / TURNS:.0f} steps a turn"
    fit = TOLERANCES[0]
    for tol in TOLERANCES:
        if median(timed(top, method.name, by_tolerance(tol))[0] for top in some) > GIVEN:
            break
        fit = tol
    return by_tolerance(fit), f"tol {fit:.0e}"


def outcome(problem, true, name, setting):
    try:
        seconds, q = timed(problem, name, setting)
    except (kr.Error, ValueError) as error:
        return {"failure": str(error)}
    return {"seconds": seconds, "attitude_error": attitude_error(problem.principal(q), true)}


def examine(kind, members):
    """Every method on every top, top by top, so that what disturbs, disturbs all alike."""
    problems = tops(kind, members)
    methods = [method for method in kr.methods.values() if method.suits(problems[0].user)]
    settings = {method.name: fitted(method, problems[:SOME]) for method in methods}
    found = []
    for i, problem in enumerate(problems):
        (state,) = truth.states(problem, [end_of(problem)], fp=truth.FINER)
        true = [str(x) for x in state[:4]]
        found += [
            {"kind": kind, "top": i, "method": name, "setting": words}
            | outcome(problem, true, name, setting)
            for name, (setting, words) in settings.items()
        ]
    return found


def tasks(plan):
    for kind in KINDS:
        yield Task(
            f"ensemble/{kind}/{plan.members}",
            lambda kind=kind: examine(kind, plan.members),
            plan.members * 0.01,
            until=1.0,
        )


def runs(store):
    return [run for found in store.under("ensemble/") for run in found]


def errors(found, kind):
    """The errors of each method on one kind of top, sorted; those of failed runs count as pi."""
    groups = {}
    for run in found:
        if run["kind"] == kind:
            groups.setdefault(run["method"], []).append(run)
    return {
        name: (own, np.sort([run.get("attitude_error", pi) for run in own]))
        for name, own in groups.items()
    }


def summary(found):
    """A line for each kind and method: typical, bad and worst error, and the time taken."""
    for kind in KINDS:
        for name, (own, sizes) in sorted(
            errors(found, kind).items(), key=lambda item: float(np.median(item[1][1]))
        ):
            yield {
                "kind": kind,
                "method": name,
                "setting": own[0]["setting"],
                "ms": 1e3 * median(run.get("seconds", np.nan) for run in own),
                "middle": float(np.median(sizes)),
                "bad": float(np.quantile(sizes, 0.95)),
                "worst": float(sizes[-1]),
                "failed": sum("failure" in run for run in own),
            }


def write_csv(file, found):
    with file.open("w", newline="") as out:
        writer = csv.DictWriter(out, COLUMNS)
        writer.writeheader()
        writer.writerows(found)
