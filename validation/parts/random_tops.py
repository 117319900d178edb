"""Errors of all methods at equal run time, for random tops of each kind.

Step sizes and tolerances are chosen so that all methods take about the same time. All tops are
scaled to the same angular velocity and are integrated over the same number of turns. The reference
solutions are computed by heyoka in 80-bit arithmetic, so that their errors are negligible.
"""

from functools import partial
from math import pi
from statistics import median

import kreisel as kr
import mpmath as mp
import numpy as np

from ..competitors import timing
from ..competitors.method_families import group_methods
from ..competitors.single_runs import Setting, control_of
from ..drawing.curves import draw_curves
from ..drawing.style import LEAST, choose_line_styles
from ..references import reference
from ..references.problems import attitude_error, problem_of_scene
from .part import write_csv
from .tasks import Task

SEED, TURNS = 6, 10.0
END = TURNS * 2 * pi
GIVEN = 0.4e-3  # run time of each method for one top [s]
SOME, TRIALS = 16, 3  # numbers of tops and of repetitions to find the setting
FAR = 3.0  # longer run times, as multiples of the given time, are not due to noise
PIECE = 50  # number of tops before the next method runs
STEPS = 2000  # number of steps to measure the time of a step
TOLERANCES = [10.0**-k for k in range(2, 15)]
NAMED_AT = 0.97  # height of the names of curves
KOWALEWSKI = (1.0, 2.0, 2.0)
KINDS = {
    "Lagrange": "two equal moments, the centre of mass on the third axis",
    "Euler": "any body, held at its centre of mass",
    "Kowalewski": "moments 1 : 2 : 2, the centre of mass in the plane of equal moments",
    "general": "any body, any centre of mass",
}


def draw_body(kind, random):
    """Draw a random body of the given kind, with moments of inertia between 0.05 and 2."""
    if kind == "Lagrange":
        i1 = random.uniform(0.5, 1.0)
        i3, height = random.uniform(0.2, 2 * i1), random.uniform(0.1, 1.0)
        return kr.Body.symmetric(1.0, i1, i3, height, unphysical=True)
    if kind == "Kowalewski":
        return kr.Body(1.0, KOWALEWSKI, (0.0, *random.normal(0.0, 0.5, 2)), unphysical=True)
    a, b = random.uniform(0.5, 1.0, 2)
    com = random.normal(0.0, 0.5, 3) * (kind != "Euler")
    return kr.Body(1.0, (a, b, random.uniform(abs(a - b) + 0.05, a + b)), com, unphysical=True)


def draw_scene(kind, random):
    """Draw a random top of one kind, scaled to a typical angular velocity of one."""
    q = random.normal(size=4)
    body = draw_body(kind, random)
    momentum = random.normal(0.0, 1.5, 3) * max(body.moments)
    top = kr.Scene(body, momentum, q / np.linalg.norm(q), gravity=1)
    rate = problem_of_scene(kind, top).rate
    return top.replace(momentum=np.array(top.momentum) / rate, gravity=top.gravity / rate**2)


def draw_problems(kind, members):
    random = np.random.default_rng([SEED, list(KINDS).index(kind)])
    return [problem_of_scene(kind, draw_scene(kind, random)) for _ in range(members)]


def time_solve(problems, name, setting):
    """Return the run time [s] per top and the paths of all tops."""
    ensemble = kr.Scene.stack([problem.user for problem in problems])
    with timing.pause_gc():
        begin = timing.perf_counter()
        paths = kr.solve(ensemble, [END], name, threads=1, **setting.keywords)
        return (timing.perf_counter() - begin) / len(problems), paths


def fit_setting(method, scenes):
    """Find a step size or tolerance for which a run takes about the intended time."""

    def seconds(setting):
        return min(time_solve(scenes, method.name, setting)[0] for _ in range(TRIALS))

    if not control_of(method):
        return Setting()
    if control_of(method) == "step":
        count = max(1, round(GIVEN / (seconds(Setting(step=END / STEPS)) / STEPS)))
        return Setting(step=END / count)
    fit = TOLERANCES[0]
    for tol in TOLERANCES:
        duration = seconds(Setting(tol=tol))
        fit = tol if duration <= GIVEN else fit
        if duration > FAR * GIVEN:
            break
    return Setting(tol=fit)


def describe_setting(setting):
    return f"{END / TURNS / setting.step:.0f} steps per turn" if setting.step else str(setting)


def measure_outcomes(problems, truths, name, setting):
    """Return the error and the run time of each top, or the reason for a failure."""
    try:
        seconds, paths = time_solve(problems, name, setting)
    except ValueError as error:
        return [{"failure": str(error)}] * len(problems)
    return [
        {"seconds": seconds, "attitude_error": attitude_error(problem.to_principal_axes(q), true)}
        if status == "OK"
        else {"failure": paths.message(i)}
        for i, (problem, true, q, status) in enumerate(
            zip(problems, truths, paths.q[:, -1], paths.status, strict=True)
        )
    ]


def compute_true_attitude(problem):
    (state,) = reference.integrate_states(problem, [END], fp=reference.FINER)
    return [mp.nstr(x, 25) for x in state[:4]]


def measure_kind(kind, members):
    """Integrate pieces of the tops by all methods in turn, so that load affects all equally."""
    problems = draw_problems(kind, members)
    methods = [method for method in kr.methods.values() if method.suits(problems[0].user)]
    settings = {method.name: fit_setting(method, problems[:SOME]) for method in methods}
    truths, runs = [compute_true_attitude(problem) for problem in problems], []
    for first in range(0, members, PIECE):
        piece = slice(first, first + PIECE)
        for name, setting in settings.items():
            columns = {"kind": kind, "method": name, "setting": describe_setting(setting)}
            outcomes = measure_outcomes(problems[piece], truths[piece], name, setting)
            runs += [columns | {"top": first + i} | each for i, each in enumerate(outcomes)]
    return runs


def list_tasks(problems, size, store):
    for kind in ("Lagrange", "general") if size.quick else KINDS:
        key, weight = f"ensemble/{kind}/{size.members}", size.members * 0.023
        yield Task(key, partial(measure_kind, kind, size.members), weight)


def load_findings(problems, store):
    return [run for runs in store.under("ensemble/") for run in runs]


def group_by_method(runs, kind):
    """Return the runs and the sorted errors of each method; the error of a failed run is pi."""
    groups = {}
    for run in runs:
        if run["kind"] == kind:
            groups.setdefault(run["method"], []).append(run)
    return {
        name: (own, np.sort([run.get("attitude_error", pi) for run in own]))
        for name, own in groups.items()
    }


def summarize_methods(groups):
    """Return a table with one row per method, in order of the median error."""
    rows = [
        {
            "method": name,
            "setting": own[0]["setting"],
            "ms": 1e3 * median(run.get("seconds", np.nan) for run in own),
            "middle": float(np.median(sizes)),
            "bad": float(np.quantile(sizes, 0.95)),
            "worst": float(sizes[-1]),
            "failed": sum("failure" in run for run in own),
        }
        for name, (own, sizes) in groups.items()
    ]
    return sorted(rows, key=lambda row: row["middle"])


def draw_distributions(groups):
    """Yield the error distributions of each family of methods that has runs, with its title."""
    lines = {
        name: (np.maximum(sizes, LEAST), np.arange(1, len(sizes) + 1) / len(sizes))
        for name, (_, sizes) in groups.items()
    }

    def find_end(line):
        return float(np.quantile(line[0], NAMED_AT)), NAMED_AT

    for title, (family, peers) in group_methods().items():
        if any(name in lines for name in family):
            yield (
                title,
                draw_curves(
                    lines,
                    choose_line_styles(family, peers),
                    find_end,
                    ticks=(7, None),
                    yscale="linear",
                    xlabel="attitude error at the end [rad]",
                    ylabel="fraction of tops with at most this error",
                    xlim=(3e-18, 10),
                    ylim=(0, 1),
                ),
            )


def kind_contexts(runs):
    for kind, description in KINDS.items():
        if groups := group_by_method(runs, kind):
            yield {
                "kind": kind,
                "about": description,
                "panels": list(draw_distributions(groups)),
                "tops": len(next(iter(groups.values()))[1]),
                "lines": summarize_methods(groups),
            }


def build_context(runs):
    return {
        "kinds": list(kind_contexts(runs)),
        "given": 1e3 * GIVEN,
        "turns": f"{TURNS:g}",
        "runs": len(runs),
        "failures": sum("failure" in run for run in runs),
    }


def list_files(runs, metadata):
    yield "random_tops.csv", write_csv(runs)


def list_methods(runs):
    return {run["method"] for run in runs}
