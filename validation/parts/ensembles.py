"""Comparison of run times per top at equal error, for large ensembles of tops."""

from dataclasses import asdict
from functools import partial
from math import isnan
from statistics import median

import kreisel as kr
import numpy as np

from ..competitors import ensemble_runs, equal_error, timing
from ..competitors.equal_error import Run
from ..drawing.curves import draw_curves
from ..drawing.fields import draw_field
from ..drawing.style import LEAST, choose_line_styles
from ..references.random_ensembles import SCENES, compute_truths, draw_tops
from . import advice
from .formatting import format_brief, format_digits
from .part import write_csv
from .tasks import Task

TARGETS = 1e-6, 1e-9  # targets for the median attitude error [rad]
SAMPLE, SIDE, SMALL = 200, 500, 100
FASTEST, LOWEST, LARGEST = 8.0, 1e-3, 1.0  # spin [T^-1], tilts [rad]
ABOUT = {
    "asymmetric": "a cuboid with three different sides; the motion is chaotic, so that a rounding "
    "grows to a visible angle for some tops",
    "Lagrange": "the top of the thesis, which has a closed form",
}


def compute_sleeping_map(side):
    """Return the largest nutation [rad] of symmetric tops by spin and initial tilt."""
    top = kr.Body.symmetric(mass=1.0, i1=1.0, i3=0.5, height=1.0, unphysical=True)
    spin, tilt = np.linspace(0.0, FASTEST, side), np.linspace(LOWEST, LARGEST, side)
    tops = kr.Scene.spinning(top, spin=0.0, gravity=1).vary(spin=spin[:, None], tilt=tilt)
    return kr.exact(tops).greatest_nutation


def measure_ensemble(kind, n, rounds, each):
    tops = draw_tops(kind, n)
    movers = ensemble_runs.select_movers(tops, each)
    runs = equal_error.measure_runs(
        tops, movers, compute_truths(tops.first(min(n, SAMPLE))), rounds
    )
    return {"kind": kind, "tops": n, "end": tops.end, "runs": [asdict(run) for run in runs]}


def time_sleeping_map(side):
    call = partial(compute_sleeping_map, side)
    return {"side": side, "map_seconds": min(timing.time_once(call) for _ in range(3))}


def list_tasks(problems, size, store):
    n, each = 10 * size.members, {"quick": 6, "default": 2}.get(size.name, 1)
    for kind in SCENES:
        measure = partial(measure_ensemble, kind, n, size.rounds, each)
        yield Task(f"many/{kind}/{n}", measure, 0.012 * n)
    side = SMALL if size.quick else SIDE
    yield Task("many tops mapped", partial(time_sleeping_map, side), 2.0)


def load_findings(problems, store):
    kinds = [
        each | {"groups": equal_error.group_by_mover([Run(**run) for run in each["runs"]])}
        for each in store.under("many/")
    ]
    mapped = store.known.get("many tops mapped")  # missing if the report was stopped before
    return {"kinds": kinds, "map": mapped} if kinds and mapped else None


def compare_at_equal_error(groups):
    """Yield the run time per top of every integrator at each target error."""
    own = groups[ensemble_runs.SERIES.name]
    peers = {name: runs for name, runs in groups.items() if name not in ensemble_runs.OWN}
    for target in (*TARGETS, equal_error.tightest_common_error(own, peers[ensemble_runs.HEYOKA])):
        ratios = [equal_error.time_ratio(runs, own, target) for runs in peers.values()]
        yield {
            "target": format_digits(target, ".1e"),
            "own": format_brief(1e6 * median(equal_error.seconds_at(target, own))),
            "others": [
                format_digits(None) if isnan(value) else format_brief(value) for value, *_ in ratios
            ],
        }


def draw_throughput(groups):
    """Draw the curves of kreisel in colour, and those of other integrators in the text colour."""
    lines = {
        name: (
            [1e6 * median(run.seconds) for run in runs],
            [max(run.middle, LEAST) for run in runs],
        )
        for name, runs in groups.items()
    }
    return draw_curves(
        lines,
        choose_line_styles(ensemble_runs.OWN, set(lines) - set(ensemble_runs.OWN)),
        size=(6.4, 3.6),
        xlabel="run time per top [us]",
        ylabel="median attitude error [rad]",
        ticks=(12, 9),
    )


def compare_movers(groups, own):
    """Return kreisel's method and tops per second, heyoka's relative run time, and their error.

    If kreisel or heyoka cannot reach the second target error, a larger error that both reach is
    chosen.
    """
    peer = groups[ensemble_runs.HEYOKA]
    target = max(TARGETS[1], equal_error.tightest_common_error(groups[own], peer))
    ratio, _, seconds = equal_error.time_ratio(peer, groups[own], target)
    return {"method": own, "rate": 1 / seconds, "ratio": ratio, "target": target}


def kind_context(each):
    groups = each["groups"]
    own = [name for name in ensemble_runs.OWN if name in groups]
    return {
        "kind": each["kind"],
        "about": ABOUT[each["kind"]],
        "tops": each["tops"],
        "end": f"{each['end']:g}",
        "svg": draw_throughput(groups),
        "peers": [name for name in groups if name not in ensemble_runs.OWN],
        "equal": list(compare_at_equal_error(groups)),
        "lines": [run.summarize() for runs in groups.values() for run in runs],
        "movers": {name: compare_movers(groups, name) for name in own},
        "closed_error": min(run.middle for run in groups[own[0]]),
    }


def build_context(findings):
    picture = draw_field(
        np.degrees(compute_sleeping_map(findings["map"]["side"])).T,
        (0.0, FASTEST, LOWEST, LARGEST),
        ("spin", "initial tilt [rad]", "greatest nutation [degrees]"),
    )
    return findings["map"] | {
        "kinds": [kind_context(each) for each in findings["kinds"]],
        "map": picture,
    }


def list_files(findings, metadata):
    rows = [
        {"kind": each["kind"]} | run.summarize()
        for each in findings["kinds"]
        for runs in each["groups"].values()
        for run in runs
    ]
    yield "ensembles.csv", write_csv(rows)


def list_answers(findings):
    """Yield the fastest run of each program for many tops, by kind of top and target error."""
    for each in findings["kinds"]:
        kind = advice.KINDS["lagrange" if each["kind"] == "Lagrange" else "general"]
        count, motion = (
            f"{each['tops']:,} tops, two threads",
            f"random tops, to t = {each['end']:g}",
        )
        for target in TARGETS:
            question = advice.describe_answer(kind, target, count, motion)
            times = {
                name: seconds
                for name, runs in each["groups"].items()
                if (seconds := median(equal_error.seconds_at(target, runs))) > 0.0
            }
            own = min((name for name in ensemble_runs.OWN if name in times), key=times.get)
            for name, seconds in times.items():
                answer = question | {"program": name, "ms": 1e3 * seconds}
                if name == own:
                    runs = each["groups"][name]
                    setting = next(run.setting for run in runs if run.middle <= target)
                    words = (
                        "" if name == "exact" else f', method="taylor", {setting.replace(" ", "=")}'
                    )
                    answer["code"] = f"kr.solve(tops, t={each['end']:g}{words})"
                if name == own or name not in ensemble_runs.OWN:
                    yield answer


def list_methods(findings):
    return {"heyoka", *(name for each in findings["kinds"] for name in each["groups"])}
