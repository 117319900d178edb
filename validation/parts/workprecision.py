"""Error against run time: every method on the scenes of the report, or on a user's own."""

import statistics
from dataclasses import dataclass

import numpy as np

from ..drawing import cost_curves
from ..drawing.look import COLOURS
from ..peers.families import families
from . import race, runs, scenes_told
from .part import Part, csv_text
from .words import brief, count, counted, in_a_row, is_or_are, listed, power

COLUMNS = (
    "scene",
    "t",
    "method",
    "step",
    "tol",
    "seconds",
    "seconds_median",
    "seconds_spread",
    "rounds",
    "steps",
    "evaluations",
    "attitude_error",
    "energy_error",
    "setup_seconds",
    "failure",
)
QUANTITIES = {
    "attitude_error": "attitude error at the end [rad]",
    "energy_error": "energy error, relative",
}
BUSY = 0.25  # from this spread of the times on they are not to be quoted


@dataclass(frozen=True)
class Comparison:
    """What was found: of each scene its problem, where it ends, its truth and its runs."""

    problems: list  # with their ends
    truths: dict  # by scene
    rows: list

    @property
    def scenes(self):
        return [problem.name for problem, _ in self.problems]


def tasks(problems, budget, store):
    for problem, end in problems:
        yield from runs.tasks(problem, end, budget, store)


def found(problems, store):
    known = {problem.name: runs.measured(store, problem.name) for problem, _ in problems}
    ran = [(problem, end) for problem, end in problems if known[problem.name]]
    truths = {problem.name: store.known[runs.truth_key(problem)] for problem, _ in ran}
    return (
        Comparison(ran, truths, [row for rows in known.values() for row in rows]) if ran else None
    )


def timing(rows):
    """Tells how often the runs were timed, and how far that scattered."""
    counts = sorted({len(row.samples) for row in rows if row.samples})
    spreads = [row.spread for row in rows if row.samples]
    middle = statistics.median(spreads) if spreads else 0.0
    note = " (the machine was busy: do not quote these times)" if middle > BUSY else ""
    return {"rounds": " .. ".join(map(str, counts)) or "no", "spread": f"{middle:.1%}{note}"}


def setup_times(rows):
    """Gives what heyoka takes to compile its integrator, at loose and tight tolerances [s]."""
    known = [row.setup_seconds for row in rows if row.setup_seconds is not None]
    if not known:
        return None
    return {"least": min(known), "middle": float(np.median(known)), "most": max(known)}


def scene_shown(comparison, problem, end, groups_of):
    rows = comparison.rows
    groups = runs.by_method(rows, problem.name)
    floors = {"attitude_error": comparison.truths[problem.name]["conditioning"]}
    main, *others = ((name, cost) for cost in cost_curves.COSTS for name in QUANTITIES)

    def drawn(how, name, cost):
        return how(groups, groups_of, name, QUANTITIES[name], cost, floors.get(name))

    return scenes_told.drawn(problem, end) | {
        "advice": advice(rows, problem.name),
        "panels": [
            {"label": title, "svg": svg} for title, svg in drawn(cost_curves.by_family, *main)
        ],
        "overviews": [
            {
                "label": f"{QUANTITIES[name]} against {cost_curves.COSTS[cost]}",
                "svg": drawn(cost_curves.overview, name, cost),
            }
            for name, cost in others
        ],
        "times": list(race.times(rows, problem.name)),
    }


def shown(comparison):
    rows, groups_of = comparison.rows, families()
    return {
        "references": race.references({row.method for row in rows}),
        "summary": list(race.summary(rows, comparison.scenes)),
        "targets": [power(target) for target in race.TARGETS],
        "colours": dict(zip(groups_of, COLOURS, strict=False)),
        "scenes": [scene_shown(comparison, *each, groups_of) for each in comparison.problems],
        "timing": timing(rows),
        "luck": f"{race.LUCK:g}",
        "setup": setup_times(rows),
        "failures": [row for row in rows if row.failure],
    }


def advice(rows, scene):
    """Says which method to take on one scene."""
    hits = [(target, own) for _, target, own, _ in race.races(rows, [scene]) if own]
    if not hits:
        return "No method reached any of the errors in the table within the time allowed."
    best = listed(f"{stretch} rad" for stretch in stretches(hits, "<strong>{}</strong>"))
    fixed = [(target, hit) for target in race.TARGETS if (hit := best_fixed(rows, scene, target))]
    return in_a_row(
        f"Take {best}.", f"With fixed steps, {listed(stretches(fixed))}." if fixed else ""
    )


def best_fixed(rows, scene, target):
    def is_fixed(row):
        return not row.peer and row.step is not None

    return race.fastest_of(rows, scene, target, is_fixed)


def stretches(hits, form="{}"):
    """Words for which errors each method is the fastest: 'strang for 1e-3 and 1e-6'."""
    for name in dict.fromkeys(hit.method for _, hit in hits):
        errors = listed(power(target) for target, hit in hits if hit.method == name)
        yield f"{form.format(name)} for {errors}"


def concluded(comparison):
    races = list(race.races(comparison.rows, comparison.scenes))
    if not any(own for *_, own, _ in races):
        return ""
    return in_a_row(won(races), ahead(races), lost(races), unreached(races))


def is_won(own, peer):
    return own and (not peer or own.seconds < peer.seconds)


def won(races):
    winners = [own.method for *_, own, peer in races if is_won(own, peer)]
    if not winners:
        return "No method of kreisel is the fastest anywhere."
    return (
        f"Of {len(races)} pairs of a scene and an error, a method of kreisel is the fastest in "
        f"{len(winners)}: {counted(winners)}."
    )


def ahead(races):
    ratios = [peer.seconds / own.seconds for *_, own, peer in races if own and peer]
    alone = sum(own is not None and peer is None for *_, own, peer in races)
    if not ratios:
        return ""
    beside = "a peer reaches each of these errors"
    if alone:
        beside = f"{count(alone)} of these errors {is_or_are(alone)} reached by no peer"
    return (
        f"The fastest peer takes {brief(statistics.median(ratios))} times as long at the median, "
        f"and between {brief(min(ratios))} and {brief(max(ratios))} times; {beside}."
    )


def lost(races):
    places = [
        f"{scene} at {power(target)} rad ({peer.method})"
        for scene, target, own, peer in races
        if peer and not is_won(own, peer)
    ]
    return f"A peer is the faster one for {listed(places)}." if places else ""


def unreached(races):
    places = [
        f"{scene} at {power(target)} rad"
        for scene, target, own, peer in races
        if not own and not peer
    ]
    return f"Nobody reaches {listed(places)}." if places else ""


def table(comparison, about):
    """Writes all runs with all their numbers, and what they were measured with above them."""

    def known(row):
        values = vars(row) | {
            "seconds": row.seconds,
            "seconds_median": row.middle,
            "seconds_spread": row.spread,
            "rounds": len(row.samples),
        }
        return {
            name: f"{value:.6g}" if isinstance(value, float) else value
            for name, value in values.items()
        }

    head = (f"# {key}: {value}\n" for key, value in (about | timing(comparison.rows)).items())
    return "".join(head) + csv_text(COLUMNS, map(known, comparison.rows))


def files(comparison, about):
    yield "workprecision.csv", table(comparison, about)
    yield "readme_table.md", race.markdown(comparison.rows, comparison.scenes)


def told(comparison):
    for problem, end in comparison.problems:
        yield race.terminal(comparison.rows, problem.name, end)
    spread = timing(comparison.rows)["spread"]
    yield f"quartiles of the times apart by {spread}, median over the runs"


def methods(comparison):
    return {row.method for row in comparison.rows}


PART = Part(
    "workprecision",
    "Error against run time",
    "Error against run time, in short",
    tasks,
    found,
    shown,
    concluded,
    short="Time",
    files=files,
    told=told,
    methods=methods,
    takes_own_scenes=True,
)
