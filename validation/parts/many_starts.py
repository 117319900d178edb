"""Run time against error, for kreisel and other integrators on many random initial states.

Random initial states are obtained by rotating the initial state of a scene and scaling the
momentum. The resulting motions are of the same type as the motion from the original initial state.
Each program is run with many tolerances. The run time for a given error is the shortest run time of
all runs whose error is not larger. For kreisel, the method is chosen automatically.
"""

from dataclasses import replace
from functools import partial
from math import pi
from statistics import median

import kreisel as kr
import numpy as np

from ..competitors import timing
from ..competitors.single_runs import PEERS, HeyokaRun, KreiselRun, ScipyRun, Setting
from ..drawing.cost_bands import draw_cost_bands
from ..references import equations, reference
from ..references.problems import attitude_error, load_problem, rotate_to_space
from . import fastest
from .formatting import (
    format_brief,
    format_large,
    format_milliseconds,
    format_power,
    join_sentences,
    join_words,
    number_word,
)
from .part import Part, write_csv
from .tasks import Task

SEED, TURNS = 9, 10.0
ROTATION = 0.5  # largest angle by which a start is rotated [rad]
SCALES = (0.8, 1.2)  # range of the factors of the momentum
STARTS, LEAST_STARTS = 10, 3  # one start for this number of `members`; smallest number
TOLERANCES = [10.0**-k for k in range(2, 16)]
SCIPY_LEAST = 1e-13  # smallest tolerance of SciPy
DIGITS = 20  # of the runs that show which errors the starts allow
QUICK = [1e-4, 1e-8, 1e-12]
TRIALS, LONG = 3, 5e-3  # each run is timed this often, but only once if it takes this long [s]
OWN = "kreisel"
SYMMETRIC, OTHERS = "Symmetric tops, closed form", "Other tops, series"
CURVE = [10.0 ** (-k / 2) for k in range(4, 27)]  # errors of the figure [rad]
SHOWN = (1e-3, 1e-6, 1e-9, 1e-12)  # errors of the table [rad]
BAND = (0.25, 0.75)  # quantiles of the band
COLUMNS = ("scene", "start", "program", "tol", "seconds", "attitude_error")


def list_programs():
    """Return a dictionary that maps the name of each program to its title."""
    names = {*kr.methods, *(peer.name for peer in PEERS)}
    return {OWN: OWN} | fastest.list_references(names)


def rotate_start(problem, random):
    """Return a problem with a random initial state.

    If the vertical momentum of the given problem is zero, it remains zero.
    """
    axis = random.normal(size=3)
    half = random.uniform(0.0, ROTATION) / 2
    turn = np.array([np.cos(half), *(np.sin(half) * axis / np.linalg.norm(axis))])
    attitude = np.array(kr.quaternion.multiply(turn, problem.attitude))
    momentum = rotate_to_space(turn, np.array(problem.momentum)) * random.uniform(*SCALES)
    if problem.momentum[2] == 0:
        momentum[2] = 0.0
    attitude /= np.linalg.norm(attitude)
    start = {"attitude": tuple(map(float, attitude)), "momentum": tuple(map(float, momentum))}
    return replace(problem, user=None, **start)


def draw_starts(problem, number):
    random = np.random.default_rng([SEED, *problem.name.encode()])
    return [rotate_start(problem, random) for _ in range(number)]


def make_runs(starts, end, tol):
    """Yield each integrator with its runs for all initial states and its compile time [s]."""
    setting = Setting(tol=tol)
    compiled_run = HeyokaRun(starts[0], end, setting)
    for name in list_programs():
        if name == OWN:
            yield name, [KreiselRun("auto", start, end, setting) for start in starts], None
        elif name in kr.methods:
            yield name, [KreiselRun(name, start, end, setting) for start in starts], None
        elif name == PEERS[0].name:
            yield name, [restart(compiled_run, start) for start in starts], compiled_run.setup
        elif tol >= SCIPY_LEAST:
            yield name, [ScipyRun(start, end, setting) for start in starts], None


def restart(compiled_run, start):
    """Return a run that reuses the compiled integrator for another initial state."""
    run = object.__new__(HeyokaRun)
    vars(run).update(
        vars(compiled_run), start=equations.round_to(equations.start_state(start), float)
    )
    return run


def measure_run(run, truth):
    """Return the run time and the error of a run, or None if the run fails."""
    try:
        with timing.pause_gc():
            begin = timing.perf_counter()
            attitude = run.solve()
            seconds = timing.perf_counter() - begin
            if seconds < LONG:
                seconds = min(timing.time_once(run.solve) for _ in range(TRIALS))
        return seconds, attitude_error(attitude, truth)
    except (kr.Error, ArithmeticError, ValueError):
        return None


def measure_scene(problem, size):
    """Measure the run times of all programs for all initial states of a scene."""
    end = TURNS * 2 * pi / problem.rate
    starts = draw_starts(problem, max(LEAST_STARTS, size.members // STARTS))
    truths = [
        np.array(reference.integrate_states(start, [end], fp=reference.FINER)[0][:4], np.longdouble)
        for start in starts
    ]
    precise = [
        attitude_error(kr.solve(start.to_scene(), end, digits=DIGITS).q[-1], truth)
        for start, truth in zip(starts, truths, strict=True)
    ]
    results, compiling = [], []
    for tol in QUICK if size.quick else TOLERANCES:
        programs = list(make_runs(starts, end, tol))
        compiling += [setup for *_, setup in programs if setup is not None]
        for i, truth in enumerate(truths):
            for name, runs, _ in programs:
                if (measurement := measure_run(runs[i], truth)) is not None:
                    columns = dict(zip(COLUMNS, (problem.name, i, name, tol), strict=False))
                    seconds, error = measurement
                    results.append(columns | {"seconds": seconds, "attitude_error": error})
    header = {"scene": problem.name, "starts": len(starts)}
    return header | {"compiling": compiling, "precise": precise, "runs": results}


def list_tasks(problems, size, store):
    for problem, _ in problems:
        key = f"starts/{problem.name}/{size.members}"
        yield Task(key, partial(measure_scene, problem, size), 1.0 if size.quick else 9.0)


def load_findings(problems, store):
    return store.under("starts/")


def times_to_error(findings, program, target):
    """Return the run time [s] of one program for each initial state, or infinity if it fails."""
    times = {(each["scene"], i): np.inf for each in findings for i in range(each["starts"])}
    for run in (run for each in findings for run in each["runs"]):
        if run["program"] == program and run["attitude_error"] <= target:
            place = run["scene"], run["start"]
            times[place] = min(times[place], run["seconds"])
    return list(times.values())


def compute_quantile(times, part):
    """Return a quantile of run times, some of which may be infinite."""
    return float(np.quantile(times, part, method="higher"))


def group_starts(findings):
    """Return the results separately for symmetric tops and for all other tops."""
    groups = {SYMMETRIC: [], OTHERS: []}
    for each in findings:
        is_symmetric = load_problem(each["scene"]).symmetric
        groups[SYMMETRIC if is_symmetric else OTHERS].append(each)
    return {title: own for title, own in groups.items() if own}


def count_starts(findings):
    return sum(each["starts"] for each in findings)


def make_bands(findings):
    """Return the median and quantiles of each program's run time for several target errors."""
    bands = {}
    for program, title in list_programs().items():
        times = [times_to_error(findings, program, target) for target in CURVE]
        bands[title] = (
            CURVE,
            *(
                [1e3 * compute_quantile(each, part) for each in times]
                for part in (0.5, BAND[0], BAND[1])
            ),
        )
    return bands


def draw_groups(findings):
    panels = {
        f"{title} ({count_starts(own)} starts)": make_bands(own)
        for title, own in group_starts(findings).items()
    }
    return draw_cost_bands(panels, OWN, "attitude error at the end [rad]")


def summarize_programs(findings):
    """Yield a table row with the median run times of all programs for each target error."""
    for target in SHOWN:
        times = {name: times_to_error(findings, name, target) for name in list_programs()}
        yield {
            "target": format_power(target),
            "cells": [
                {
                    "time": format_milliseconds(finite_or_none(compute_quantile(own, 0.5))),
                    "reached": format_share(own),
                }
                for own in times.values()
            ],
        }


def format_share(times):
    """Return the percentage of initial states for which a program reaches a given error."""
    return f"{100 * np.isfinite(times).mean():.0f} %"


def finite_or_none(x):
    return x if np.isfinite(x) else None


def compare_medians(findings, target):
    """Return kreisel's median run time [s], and the other programs' medians relative to it.

    A program is omitted if it fails to reach the target error for at least a quarter of the initial
    states. The median run time of kreisel is None if it fails for at least a quarter of the initial
    states.
    """
    medians = {}
    for program, title in list_programs().items():
        times = times_to_error(findings, program, target)
        if np.isfinite(compute_quantile(times, BAND[1])):
            medians[title] = compute_quantile(times, 0.5)
    own = medians.pop(list_programs()[OWN], None)
    return own, {title: middle / own for title, middle in medians.items()} if own else {}


def describe_group(title, findings, target):
    """Compare in one sentence the run times of all programs at a given error."""
    own, ratios = compare_medians(findings, target)
    if own is None:
        return ""
    slower = [f"{name} {format_large(ratio)} times" for name, ratio in ratios.items()]
    return (
        f"{title}: kreisel takes {format_milliseconds(own)} ms for {format_power(target)} rad"
        + (f", {join_words(slower)} as long." if slower else ".")
    )


def describe_reached(findings, target):
    """Describe for which share of the initial states each program attains a given error."""
    shares = [
        f"{title} on {format_share(times_to_error(findings, program, target))}"
        for program, title in list_programs().items()
    ]
    return f"{format_power(target)} rad is reached by {join_words(shares)} of the starts."


def describe_digits(findings, target):
    """Describe how often kreisel reaches a given error in extended-precision arithmetic."""
    errors = [error for each in findings for error in each.get("precise", ())]
    if not errors:
        return ""
    times = [0.0 if error <= target else np.inf for error in errors]
    return f"With digits={DIGITS}, kreisel reaches it on {format_share(times)}."


def describe_scenes(findings):
    return "one scene" if len(findings) == 1 else f"{number_word(len(findings))} scenes"


def conclude(findings):
    return join_sentences(
        f"{count_starts(findings)} random starts of {describe_scenes(findings)}, "
        f"{TURNS:g} turns each.",
        *(describe_group(title, own, SHOWN[2]) for title, own in group_starts(findings).items()),
        "These are the medians of the figure and their ratios, for programs that reach the error "
        "on three quarters of the starts.",
        describe_reached(findings, SHOWN[3]),
        describe_digits(findings, SHOWN[3]),
    )


def find_tolerances(findings):
    """Return the largest and the smallest tolerance used."""
    tolerances = {run["tol"] for each in findings for run in each["runs"]}
    return max(tolerances), min(tolerances)


def build_context(findings):
    compiling = [seconds for each in findings for seconds in each["compiling"]]
    return {
        "figure": draw_groups(findings),
        "programs": list(list_programs().values()),
        "groups": [
            {"title": title, "starts": count_starts(own), "rows": list(summarize_programs(own))}
            for title, own in group_starts(findings).items()
        ],
        "starts": findings[0]["starts"],
        "scenes": describe_scenes(findings),
        "tops": count_starts(findings),
        "digits": DIGITS,
        "turns": f"{TURNS:g}",
        "rotation": f"{ROTATION:g}",
        "tolerances": [f"{tol:.0e}".replace("e-0", "e-") for tol in find_tolerances(findings)],
        "scales": [f"{factor:g}" for factor in SCALES],
        "compiling": f"{median(compiling):.2f}",
        "runs_in_compiling": format_brief(
            median(compiling) / compute_quantile(times_to_error(findings, OWN, SHOWN[2]), 0.5)
        ),
    }


PART = Part(
    "many_starts",
    "Many starts",
    "Run time over error, many starts",
    list_tasks,
    load_findings,
    build_context,
    conclude,
    list_files=lambda findings, metadata: [
        ("many_starts.csv", write_csv(COLUMNS, (run for each in findings for run in each["runs"])))
    ],
    build_lead=build_context,
)
