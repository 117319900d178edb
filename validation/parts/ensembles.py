"""Comparison of run times per top at equal error, for large ensembles of tops.

kreisel is compared with heyoka, GSL and SciPy.
"""

from dataclasses import asdict
from functools import partial
from math import isnan
from statistics import median

import kreisel as kr
import numpy as np

from ..competitors import ensemble_runs, equal_error, timing
from ..competitors.equal_error import Run
from ..drawing.field import draw_field
from ..drawing.throughput import draw_throughput
from ..references.random_ensembles import SCENES, compute_truths, draw_tops
from .formatting import (
    format_brief,
    format_digits,
    format_large,
    format_power,
    join_sentences,
)
from .part import Part, write_csv
from .tasks import Task

TARGETS = 1e-6, 1e-9  # targets for the median attitude error [rad]
SAMPLE, SIDE = 200, 500
FASTEST, LEAST, LARGEST = 8.0, 1e-3, 1.0  # spin [T^-1], tilts [rad]
COLUMNS = ("kind", "mover", "setting", "tops", "middle", "bad", "worst", "microseconds")
ABOUT = {
    "asymmetric": "a cuboid with three different sides; the motion is chaotic, so that a rounding "
    "grows to a visible angle for some tops",
    "Lagrange": "the top of the thesis, which has a closed form",
}


def compute_sleeping_map(side):
    """Return the largest nutation [rad] of symmetric tops, as a function of spin and initial tilt.

    An upright top of the given shape is stable if its spin exceeds 4 [T^-1].
    """
    top = kr.Body.symmetric(mass=1.0, i1=1.0, i3=0.5, height=1.0, unphysical=True)
    spin, tilt = np.linspace(0.0, FASTEST, side), np.linspace(LEAST, LARGEST, side)
    tops = kr.Scene.spinning(top, spin=0.0, gravity=1).vary(spin=spin[:, None], tilt=tilt)
    return kr.exact(tops).greatest_nutation


def measure_ensemble(kind, n, rounds, each):
    tops = draw_tops(kind, n)
    movers = ensemble_runs.select_movers(tops, each)
    runs = equal_error.measure_runs(
        tops, movers, compute_truths(tops.first(min(n, SAMPLE))), rounds
    )
    return {"kind": kind, "tops": n, "end": tops.end, "runs": [asdict(run) for run in runs]}


def time_sleeping_map():
    return min(timing.time_once(partial(compute_sleeping_map, SIDE)) for _ in range(3))


def list_tasks(problems, size, store):
    n, each = 10 * size.members, {"quick": 6, "default": 2}.get(size.name, 1)
    for kind in SCENES:
        measure = partial(measure_ensemble, kind, n, size.rounds, each)
        yield Task(f"many/{kind}/{n}", measure, 0.008 * n)
    yield Task("many tops mapped", time_sleeping_map, 2.0)


def load_findings(problems, store):
    kinds = [
        each | {"groups": equal_error.group_by_mover([Run(**run) for run in each["runs"]])}
        for each in store.under("many/")
    ]
    return {"kinds": kinds, "map": store.known.get("many tops mapped")} if kinds else None


def compare_at_equal_error(groups):
    """Yield the run time per top of every integrator at each target error.

    The run time of kreisel is given in microseconds. The run times of other integrators are given
    relative to that of kreisel.
    """
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


def table_row(run):
    return asdict(run) | {"microseconds": 1e6 * median(run.seconds)}


def kind_context(each):
    groups = each["groups"]
    return {
        "kind": each["kind"],
        "about": ABOUT[each["kind"]],
        "tops": each["tops"],
        "end": f"{each['end']:g}",
        "svg": draw_throughput(groups, ensemble_runs.OWN),
        "peers": [name for name in groups if name not in ensemble_runs.OWN],
        "equal": list(compare_at_equal_error(groups)),
        "lines": [table_row(run) for own in groups.values() for run in own],
    }


def build_context(findings):
    picture = draw_field(
        np.degrees(compute_sleeping_map(SIDE)).T,
        (0.0, FASTEST, LEAST, LARGEST),
        ("spin", "initial tilt [rad]", "greatest nutation [degrees]"),
    )
    return {
        "kinds": [kind_context(each) for each in findings["kinds"]],
        "map": picture,
        "side": SIDE,
        "map_seconds": findings["map"],
    }


def conclude(findings):
    return join_sentences(*(describe_kind(each) for each in findings["kinds"]))


def compare_movers(groups, own, target):
    """Return the target error, kreisel's run time [s] per top, and heyoka's relative run time.

    If kreisel or heyoka cannot reach the target error, a larger error that both reach is chosen.
    """
    peer = groups[ensemble_runs.HEYOKA]
    target = max(target, equal_error.tightest_common_error(groups[own], peer))
    ratio, _, seconds = equal_error.time_ratio(peer, groups[own], target)
    return target, seconds, ratio


def describe_kind(each):
    """Describe the throughput of kreisel, and compare it with that of heyoka."""
    groups, kind = each["groups"], each["kind"]
    target, seconds, ratio = compare_movers(groups, ensemble_runs.SERIES.name, TARGETS[1])
    text = (
        f"In one second, {ensemble_runs.SERIES.name} moves {format_large(1 / seconds)} {kind} tops "
        f"from t = 0 to {each['end']:g} with a median error of {format_power(target)} rad, "
        f"{format_brief(ratio)} times as many as heyoka in batches of eight."
    )
    if ensemble_runs.CLOSED.name not in groups:
        return text
    target, seconds, ratio = compare_movers(groups, ensemble_runs.CLOSED.name, TARGETS[1])
    smallest = groups[ensemble_runs.CLOSED.name][0].middle
    return join_sentences(
        text,
        f"The closed form moves {format_large(1 / seconds)}, {format_brief(ratio)} times as many "
        f"as heyoka with {format_power(target)} rad; its own error is {format_power(smallest)} "
        "rad.",
    )


def build_lead(findings):
    """Return the recommended methods for ensembles, and a comparison with heyoka."""
    lines = []
    for each in findings["kinds"]:
        own = next(name for name in ensemble_runs.OWN if name in each["groups"])
        target, seconds, ratio = compare_movers(each["groups"], own, TARGETS[1])
        lines.append(
            {
                "kind": each["kind"],
                "method": own,
                "rate": format_large(1 / seconds),
                "target": format_power(target),
                "ratio": format_brief(ratio),
            }
        )
    return {"lines": lines, "end": f"{findings['kinds'][0]['end']:g}"}


def table_rows(findings):
    for each in findings["kinds"]:
        for runs in each["groups"].values():
            yield from ({"kind": each["kind"]} | table_row(run) for run in runs)


PART = Part(
    "ensembles",
    "Many tops",
    "Many tops at once",
    list_tasks,
    load_findings,
    build_context,
    conclude,
    list_files=lambda findings, metadata: [
        ("ensembles.csv", write_csv(COLUMNS, table_rows(findings)))
    ],
    list_methods=lambda findings: {
        name for each in findings["kinds"] for name in (*each["groups"], "heyoka")
    },
    build_lead=build_lead,
    is_lead_row=True,
)
