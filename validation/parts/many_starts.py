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
from ..drawing.curves import draw_bands
from ..references import reference
from ..references.problems import attitude_error, load_problem, rotate_to_space
from . import fastest
from .formatting import format_milliseconds, format_power
from .part import write_csv
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


def list_programs():
    """Return a dictionary that maps the name of each program to its title."""
    names = {*kr.methods, *(peer.name for peer in PEERS)}
    return {OWN: OWN} | fastest.list_references(names)


def rotate_start(problem, random):
    """Return a problem with a random start; a vertical momentum of zero remains zero."""
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
        if name == PEERS[0].name:
            yield name, [compiled_run.restart(start) for start in starts], compiled_run.setup
        elif name == OWN or name in kr.methods:
            method = "auto" if name == OWN else name
            yield name, [KreiselRun(method, start, end, setting) for start in starts], None
        elif tol >= SCIPY_LEAST:
            yield name, [ScipyRun(start, end, setting) for start in starts], None


def measure_run(run, truth):
    """Return the run time and the error of a run, or None if the run fails."""
    try:
        with timing.pause_gc():
            begin = timing.perf_counter()
            attitude = run.solve()
            seconds = timing.perf_counter() - begin
            if seconds < LONG:
                seconds = min(timing.time_once(run.solve) for _ in range(TRIALS))
        return {"seconds": seconds, "attitude_error": attitude_error(attitude, truth)}
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
                if measurement := measure_run(runs[i], truth):
                    run = {"scene": problem.name, "start": i, "program": name, "tol": tol}
                    results.append(run | measurement)
    findings = {"scene": problem.name, "starts": len(starts), "compiling": compiling}
    return findings | {"precise": precise, "runs": results}


def list_tasks(problems, size, store):
    for problem, _ in problems:
        key = f"starts/{problem.name}/{size.members}"
        yield Task(key, partial(measure_scene, problem, size), 1.0 if size.quick else 12.0)


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
        parts = (0.5, *BAND)
        milliseconds = [[1e3 * compute_quantile(own, part) for own in times] for part in parts]
        bands[title] = CURVE, *milliseconds
    return bands


def format_share(times):
    """Return the percentage of initial states for which a program reaches a given error."""
    return f"{100 * np.isfinite(times).mean():.0f} %"


def summarize_programs(findings):
    """Yield each target error with the median run time and the success of all programs."""
    for target in SHOWN:
        cells = []
        for name in list_programs():
            times = times_to_error(findings, name, target)
            middle = compute_quantile(times, 0.5)
            time = format_milliseconds(middle if np.isfinite(middle) else None)
            cells.append((time, format_share(times)))
        yield format_power(target), cells


def compare_medians(findings, target):
    """Return kreisel's median run time [s] or None, and the other programs' medians over it.

    A program is omitted if it misses the target error for at least a quarter of the starts.
    """
    medians = {}
    for program, title in list_programs().items():
        times = times_to_error(findings, program, target)
        if np.isfinite(compute_quantile(times, BAND[1])):
            medians[title] = compute_quantile(times, 0.5)
    own = medians.pop(list_programs()[OWN], None)
    return own, {title: middle / own for title, middle in medians.items()} if own else {}


def build_context(findings):
    groups, programs = group_starts(findings), list_programs()
    compiling = median(seconds for each in findings for seconds in each["compiling"])
    tolerances = {run["tol"] for each in findings for run in each["runs"]}
    precise = [error for each in findings for error in each.get("precise", ())]
    panels = {
        f"{title} ({count_starts(own)} starts)": make_bands(own) for title, own in groups.items()
    }
    own_time = compute_quantile(times_to_error(findings, OWN, SHOWN[2]), 0.5)
    return {
        "figure": draw_bands(panels, OWN, "attitude error at the end [rad]"),
        "programs": list(programs.values()),
        "groups": [
            (title, list(summarize_programs(own)), *compare_medians(own, SHOWN[2]))
            for title, own in groups.items()
        ],
        "compared": SHOWN[2],
        "least": SHOWN[3],
        "reached": {
            title: format_share(times_to_error(findings, program, SHOWN[3]))
            for program, title in programs.items()
        },
        "precise": precise
        and format_share([0.0 if error <= SHOWN[3] else np.inf for error in precise]),
        "starts": findings[0]["starts"],
        "number_of_scenes": len(findings),
        "tops": count_starts(findings),
        "digits": DIGITS,
        "turns": f"{TURNS:g}",
        "rotation": f"{ROTATION:g}",
        "tolerances": (max(tolerances), min(tolerances)),
        "scales": [f"{factor:g}" for factor in SCALES],
        "compiling": compiling,
        "runs_in_compiling": compiling / own_time,
    }


def list_files(findings, metadata):
    yield "many_starts.csv", write_csv(run for each in findings for run in each["runs"])
