"""Comparison of the run times of kreisel and heyoka for one top at equal error.

Two uses of kreisel are timed: calling kr.solve, and resetting an existing kr.Run. The run times of
heyoka do not include the compilation of its integrator. Processor times are measured, because
other programs hardly affect them.

Run times at equal error are interpolated linearly in the logarithms of time and error. For each
order of its Taylor series, heyoka is run with only one tolerance.
"""

import time
from functools import partial
from math import exp
from statistics import median

import kreisel as kr
import numpy as np

from ..competitors import equal_error, machine, timing
from ..competitors.single_runs import EPS, HeyokaRun, KreiselRun, Setting
from ..references import reference
from ..references.problems import attitude_error, load_problem
from .formatting import format_power
from .part import write_csv
from .tasks import Task

ENDS = {  # scene: end of the run [T]
    "thesis": 100.0,
    "kowalewski": 100.0,
    "goryachev_chaplygin": 30.0,
    "asymmetric": 30.0,
    "fast": 10.0,
}
QUICK = {"goryachev_chaplygin": 30.0}
TARGETS = (1e-3, 1e-6, 1e-9, 0.0)  # attitude errors [rad]; 0 is the smallest that both reach
METHOD = "taylor"
TOLERANCES = (*(10.0 ** (-k / 4) for k in range(8, 63)), 2.0**-53)
ORDERS = range(4, 20)  # orders of heyoka's series, below that of its tightest tolerance
LATEST = 1e4  # a run begins anew at this time, so that its times have enough digits [T]
SOLVE, RUN, HEYOKA = "kr.solve", "kr.Run", "heyoka"


def make_solve_call(scene, end, tol):
    return lambda: kr.solve(scene, [end], METHOD, tol=tol)


def make_reused_call(scene, end, tol):
    """Return a function that resets a run and integrates it for the duration `end`."""
    run = kr.start(scene, METHOD, tol=tol)
    momentum, attitude = scene.momentum, scene.attitude

    def call():
        nonlocal run
        if run.t > LATEST:
            run = kr.start(scene, METHOD, tol=tol)
        run.reset(momentum, attitude)
        return run.to([run.t + end])

    return call


def make_heyoka_call(run):
    """Return a function that integrates with heyoka and reuses the compiled integrator."""
    top, start, end = run.top, np.array(run.start), run.end

    def call():
        top.time = 0.0
        top.state[:] = start
        top.propagate_until(end)
        return top.state

    return call


def processor_time(call, number=1):
    """Return the mean processor time [s] of a function."""
    begin = time.thread_time()
    for _ in range(number):
        call()
    return (time.thread_time() - begin) / number


def sample_in_turn(calls, rounds):
    """Return the processor times [s] of several functions, which are called alternately."""
    samples = [[] for _ in calls]
    with timing.pause_gc():
        numbers = [
            max(1, round(timing.SAMPLE / min(processor_time(call, 3) for _ in range(3))))
            for call in calls
        ]
        for _ in range(rounds):
            for call, number, times in zip(calls, numbers, samples, strict=True):
                times.append(processor_time(call, number))
    return samples


def make_ladder(runs, truth):
    """Return pairs of a run and its error, in order of decreasing tolerance."""
    errors = [attitude_error(run.solve(), truth) for run in runs]
    return list(zip(runs, np.maximum.accumulate(errors[::-1])[::-1].tolist(), strict=True))


def select_bracket(ladder, target):
    """Return the runs whose errors are just above and just below `target`."""
    i = next((i for i, (_, error) in enumerate(ladder) if error <= target), len(ladder) - 1)
    previous = ladder[i - 1][1] if i else None
    return [*[step for step in ladder if step[1] == previous][:1], ladder[i]]


def interpolate(bracket, samples, target):
    """Return the run time [s] at the error `target` in each round, by interpolation."""
    runs = [
        equal_error.Run("", "", 1, error, error, error, seconds)
        for (_, error), seconds in zip(bracket, samples, strict=True)
    ]
    return equal_error.seconds_at(target, runs)


def list_heyoka_runs(problem, end, orders):
    tolerances = (*(1.001 * exp(2 * (1 - order)) for order in orders), EPS)
    return [HeyokaRun(problem, end, Setting(tol=tol)) for tol in tolerances]


def measure_scene(name, rounds, targets=TARGETS, quick=False):
    """Return the run times of all programs for one scene and several errors."""
    end, problem = ENDS[name], load_problem(name)
    (state,) = reference.integrate_states(problem, [end], fp=reference.FINER)
    truth = np.array(state[:4], np.longdouble)
    peers = make_ladder(list_heyoka_runs(problem, end, ORDERS[::5] if quick else ORDERS), truth)
    own = make_ladder(
        [KreiselRun(METHOD, problem, end, Setting(tol=tol)) for tol in TOLERANCES], truth
    )
    tightest = equal_error.NEAR * max(peers[-1][1], own[-1][1])
    bands = [
        measure_band(own, peers, target or tightest, rounds) | {"tightest": not target}
        for target in targets
        if not target or target > tightest
    ]
    return {
        "scene": name,
        "end": end,
        "rounds": rounds,
        "processor": f"{machine.processor_name()}, {machine.describe_cores()}",
        "bands": bands,
    }


def measure_band(own, peers, target, rounds):
    """Return the run times of kr.solve, kr.Run and heyoka at the same error."""
    ours, theirs = select_bracket(own, target), select_bracket(peers, target)
    calls = {
        HEYOKA: [make_heyoka_call(run) for run, _ in theirs],
        SOLVE: [make_solve_call(run.scene, run.end, run.words["tol"]) for run, _ in ours],
        RUN: [make_reused_call(run.scene, run.end, run.words["tol"]) for run, _ in ours],
    }
    samples = iter(sample_in_turn([call for each in calls.values() for call in each], rounds))
    seconds = {
        name: interpolate(theirs if name == HEYOKA else ours, [next(samples) for _ in each], target)
        for name, each in calls.items()
    }
    return {"error": target, "seconds": seconds, "compiling": theirs[-1][0].setup}


def compare(band, name):
    """Return the median ratio of heyoka's to kreisel's run times, and the ratio of the shortest."""
    own, peer = band["seconds"][name], band["seconds"][HEYOKA]
    return median(b / a for a, b in zip(own, peer, strict=True)), min(peer) / min(own)


def count_paying_runs(band):
    """Return the number of runs after which heyoka's compilation pays off, or None if never."""
    gain = median(band["seconds"][SOLVE]) - median(band["seconds"][HEYOKA])
    return band["compiling"] / gain if gain > 0 else None


def list_tasks(problems, size, store):
    rounds = 3 * size.rounds
    for name in QUICK if size.quick else ENDS:
        measure = partial(measure_scene, name, rounds, quick=size.quick)
        yield Task(f"calls/{name}/{rounds}", measure, 2.0 if size.quick else 6.0)


def load_findings(problems, store):
    return store.under("calls/")


def format_band(scene, band):
    """Return a row of the tables of run times and of compilation."""
    seconds = band["seconds"]
    form = ".1e" if band["tightest"] else ".0e"
    return {
        "scene": scene["scene"],
        "end": f"{scene['end']:g}",
        "error": format_power(band["error"], form),
        "times": [1e6 * median(seconds[name]) for name in (SOLVE, RUN, HEYOKA)],
        "ratios": [compare(band, name) for name in (SOLVE, RUN)],
        "compiling": band["compiling"],
        "paid": count_paying_runs(band),
    }


def build_context(findings):
    rows = [format_band(scene, band) for scene in findings for band in scene["bands"]]
    first = findings[0]
    return {
        "rows": rows,
        "ratios": {
            title: [row["ratios"][i][0] for row in rows]
            for i, title in enumerate(("kr.solve", "a kr.Run used again"))
        },
        "compiling": [row["compiling"] for row in rows],
        "paying": [row["paid"] for row in rows if row["paid"] is not None],
        "processor": first["processor"],
        "rounds": first["rounds"],
    }


def list_rows(scene, band):
    """Yield the rows of the CSV file for one scene and one error."""
    columns = {"scene": scene["scene"], "end": scene["end"], "error": f"{band['error']:.3g}"}
    for name, seconds in band["seconds"].items():
        yield columns | {
            "program": name,
            "seconds_median": f"{median(seconds):.4g}",
            "seconds_least": f"{min(seconds):.4g}",
            **({"compiling": f"{band['compiling']:.3g}"} if name == HEYOKA else {}),
        }


def list_files(findings, metadata):
    rows = [row for scene in findings for band in scene["bands"] for row in list_rows(scene, band)]
    yield "calls.csv", write_csv(rows)
