"""A wide ensemble: random tops of each kind, the methods against each other at equal time.

Each method gets the setting with which it takes, on the first tops, about the time that all are
given; then it moves all of them, each in units of time in which it turns at a rate of one, to as
many turns. The truth is heyoka in 80 bit, beyond what is told apart here.
"""

from functools import partial
from math import pi
from statistics import median

import kreisel as kr
import mpmath as mp
import numpy as np

from ..drawing.distributions import distributions
from ..peers import measure
from ..peers.contenders import Setting, steered
from ..peers.families import families
from ..truth import reference
from ..truth.problems import attitude_error, described
from .budget import Task
from .part import Part, csv_text
from .words import in_a_row, number

SEED, TURNS = 6, 10.0
END = TURNS * 2 * pi
GIVEN = 0.4e-3  # of one run [s]
SOME, TRIALS = 16, 3  # tops to find the setting with; a disturbance only ever adds
FAR = 3.0  # beyond this multiple of the given time it is no disturbance
PIECE = 50  # tops that a method moves before it is another's turn
STEPS = 2000  # to find the time of a step with
TOLERANCES = [10.0**-k for k in range(2, 15)]
COLUMNS = ("kind", "top", "method", "setting", "seconds", "attitude_error", "failure")
KOWALEWSKI = (1.0, 2.0, 2.0)
KINDS = {
    "Lagrange": "two equal moments, the centre of mass on the third axis",
    "Euler": "any body, turning about its centre of mass",
    "Kowalewski": "moments 1 : 2 : 2, the centre of mass in the plane of the equal ones' axes",
    "general": "any body, any centre of mass",
}


def body(kind, random):
    """Makes a body of the kind, with moments between 0.2 and 1 and its centre of mass within about
    1."""
    if kind == "Lagrange":
        i1 = random.uniform(0.5, 1.0)
        i3, height = random.uniform(0.2, 2 * i1), random.uniform(0.1, 1.0)
        return kr.Body.symmetric(1.0, i1, i3, height, made_up=True)
    if kind == "Kowalewski":
        return kr.Body(1.0, KOWALEWSKI, (0.0, *random.normal(0.0, 0.5, 2)), made_up=True)
    a, b = random.uniform(0.5, 1.0, 2)
    com = random.normal(0.0, 0.5, 3) * (kind != "Euler")
    return kr.Body(1.0, (a, b, random.uniform(abs(a - b) + 0.05, a + b)), com, made_up=True)


def scene(kind, random):
    """Makes a top that turns at a rate of one: gravity and momentum are measured in that unit of
    time."""
    q = random.normal(size=4)
    made = body(kind, random)
    momentum = random.normal(0.0, 1.5, 3) * max(made.moments)
    top = kr.Scene(made, momentum, q / np.linalg.norm(q))
    rate = described(kind, top).rate
    return top.replace(momentum=np.array(top.momentum) / rate, gravity=top.gravity / rate**2)


def tops(kind, members):
    random = np.random.default_rng([SEED, list(KINDS).index(kind)])
    return [described(kind, scene(kind, random)) for _ in range(members)]


def timed(problems, name, setting):
    """Gives the seconds of a run, and the paths of all."""
    ensemble = kr.Ensemble.of([problem.user for problem in problems])
    with measure.undisturbed():
        begin = measure.perf_counter()
        paths = kr.solve(ensemble, [END], name, threads=1, **setting.words)
        return (measure.perf_counter() - begin) / len(problems), paths


def fitted(method, some):
    """Finds a setting with which the method takes the given time."""

    def seconds(setting):
        return min(timed(some, method.name, setting)[0] for _ in range(TRIALS))

    if not steered(method):
        return Setting()
    if steered(method) == "step":
        count = max(1, round(GIVEN / (seconds(Setting(step=END / STEPS)) / STEPS)))
        return Setting(step=END / count)
    fit = TOLERANCES[0]
    for tol in TOLERANCES:
        took = seconds(Setting(tol=tol))
        fit = tol if took <= GIVEN else fit
        if took > FAR * GIVEN:
            break
    return Setting(tol=fit)


def told(setting):
    return f"{END / TURNS / setting.step:.0f} steps a turn" if setting.step else str(setting)


def outcomes(problems, truths, name, setting):
    """Gives what became of each top."""
    try:
        seconds, paths = timed(problems, name, setting)
    except ValueError as error:
        return [{"failure": str(error)}] * len(problems)
    return [
        {"seconds": seconds, "attitude_error": attitude_error(problem.principal(q), true)}
        if status == 0
        else {"failure": paths.message(i)}
        for i, (problem, true, q, status) in enumerate(
            zip(problems, truths, paths.q[:, -1], paths.status, strict=True)
        )
    ]


def true_attitude(problem):
    (state,) = reference.states(problem, [END], fp=reference.FINER)
    return [mp.nstr(x, 25) for x in state[:4]]


def examine(kind, members):
    """Runs every method on all tops, a piece of them at a time, so that what disturbs, disturbs all
    alike."""
    problems = tops(kind, members)
    methods = [method for method in kr.methods.values() if method.suits(problems[0].user)]
    settings = {method.name: fitted(method, problems[:SOME]) for method in methods}
    truths, runs = [true_attitude(problem) for problem in problems], []
    for first in range(0, members, PIECE):
        piece = slice(first, first + PIECE)
        for name, setting in settings.items():
            known = {"kind": kind, "method": name, "setting": told(setting)}
            found = outcomes(problems[piece], truths[piece], name, setting)
            runs += [known | {"top": first + i} | each for i, each in enumerate(found)]
    return runs


def tasks(problems, budget, store):
    for kind in KINDS:
        key, weight = f"ensemble/{kind}/{budget.members}", budget.members * 0.01
        yield Task(key, partial(examine, kind, budget.members), weight, until=1.0)


def found(problems, store):
    return [run for runs in store.under("ensemble/") for run in runs]


def by_method(runs, kind):
    """Gives the runs of each method on one kind of top, and their errors, sorted; a failed run errs
    by pi."""
    groups = {}
    for run in runs:
        if run["kind"] == kind:
            groups.setdefault(run["method"], []).append(run)
    return {
        name: (own, np.sort([run.get("attitude_error", pi) for run in own]))
        for name, own in groups.items()
    }


def line(kind, name, own, sizes):
    return {
        "kind": kind,
        "method": name,
        "setting": own[0]["setting"],
        "ms": 1e3 * median(run.get("seconds", np.nan) for run in own),
        "middle": float(np.median(sizes)),
        "bad": float(np.quantile(sizes, 0.95)),
        "worst": float(sizes[-1]),
        "failed": sum("failure" in run for run in own),
    }


def summary(runs, kind):
    """Gives a line for each method: typical, bad and worst error, and the time taken; the best
    first."""
    groups = by_method(runs, kind)
    order = sorted(groups, key=lambda name: float(np.median(groups[name][1])))
    return [line(kind, name, *groups[name]) for name in order]


def kinds_shown(runs):
    for kind, about in KINDS.items():
        errors = {name: sizes for name, (_, sizes) in by_method(runs, kind).items()}
        if errors:
            yield {
                "kind": kind,
                "about": about,
                "panels": panels(errors),
                "tops": len(next(iter(errors.values()))),
                "lines": summary(runs, kind),
            }


def panels(errors):
    return [
        {"label": title, "svg": distributions(errors, family, peers)}
        for title, (family, peers) in families().items()
        if any(name in errors for name in family)
    ]


def shown(runs):
    return {"kinds": list(kinds_shown(runs)), "given": 1e3 * GIVEN, "turns": f"{TURNS:g}"}


def concluded(runs):
    known = {kind: lines for kind in KINDS if (lines := summary(runs, kind))}
    best = "; for ".join(f"{kind}: {of_kind(lines)}" for kind, lines in known.items())
    failed = sum("failure" in run for run in runs)
    return in_a_row(
        f"The smallest error in the given time has, for {best}.",
        f"{number(failed).capitalize() if failed else 'None'} of {len(runs)} runs failed.",
    )


def of_kind(lines):
    first, *others = lines
    said = f"{first['method']} (median {first['middle']:.0e} rad, 95 % below {first['bad']:.0e})"
    then = [f"then {other['method']} ({other['middle']:.0e})" for other in others[:1]]
    return ", ".join([said, *then])


PART = Part(
    "ensemble",
    "Random tops",
    "Random tops, at equal time",
    tasks,
    found,
    shown,
    concluded,
    short="Random tops",
    files=lambda runs, about: [("ensemble.csv", csv_text(COLUMNS, runs))],
    methods=lambda runs: {run["method"] for run in runs},
)
