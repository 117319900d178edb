"""Error against run time: every method on the scenes of the report, or on a user's own."""

import statistics
from dataclasses import dataclass

import numpy as np

from ..competitors.method_families import group_methods
from ..drawing import cost_curves
from . import fastest, scene_runs, scene_table
from .formatting import brief, count, counted, in_a_row, listed, power
from .part import Part, csv_text

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
YARDSTICK = ("heyoka",)  # the peers in the small figures
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
        yield from scene_runs.tasks(problem, end, budget, store)


def found(problems, store):
    known = {problem.name: scene_runs.measured(store, problem.name) for problem, _ in problems}
    ran = [(problem, end) for problem, end in problems if known[problem.name]]
    truths = {problem.name: store.known[scene_runs.truth_key(problem)] for problem, _ in ran}
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
    groups = scene_runs.by_method(rows, problem.name)
    floors = {"attitude_error": comparison.truths[problem.name]["conditioning"]}
    main, *others = ((name, cost) for cost in cost_curves.COSTS for name in QUANTITIES)
    own = [name for family, _ in groups_of.values() for name in family]
    named = cost_curves.leading(groups, own, others)

    def drawn(how, name, cost, *which):
        return how(groups, *which, name, QUANTITIES[name], cost, floors.get(name))

    return scene_table.drawn(problem, end) | {
        "advice": advice(rows, problem.name),
        "panels": [
            {"label": title, "svg": svg}
            for title, svg in drawn(cost_curves.by_family, *main, groups_of)
        ],
        "overviews": [
            {
                "label": f"{QUANTITIES[name]} against {cost_curves.COSTS[cost]}",
                "svg": drawn(cost_curves.overview, name, cost, named, YARDSTICK),
            }
            for name, cost in others
        ],
        "times": list(fastest.times(rows, problem.name)),
    }


def shown(comparison):
    rows, groups_of = comparison.rows, group_methods()
    return {
        "references": fastest.references({row.method for row in rows}),
        "summary": list(fastest.summary(rows, comparison.scenes)),
        "targets": [power(target) for target in fastest.TARGETS],
        "scenes": [scene_shown(comparison, *each, groups_of) for each in comparison.problems],
        "timing": timing(rows),
        "luck": f"{fastest.LUCK:g}",
        "setup": setup_times(rows),
        "failures": [row for row in rows if row.failure],
    }


def advice(rows, scene):
    """Says which method to take on one scene."""
    hits = [(target, own) for _, target, own, _ in fastest.races(rows, [scene]) if own]
    if not hits:
        return "No method reached any of the errors in the table within the time allowed."
    best = listed(f"{stretch} rad" for stretch in stretches(hits, "<strong>{}</strong>"))
    fixed = [
        (target, hit) for target in fastest.TARGETS if (hit := best_fixed(rows, scene, target))
    ]
    return in_a_row(
        f"Take {best}.", f"With fixed steps, {listed(stretches(fixed))}." if fixed else ""
    )


def best_fixed(rows, scene, target):
    def is_fixed(row):
        return not row.peer and row.step is not None

    return fastest.fastest_of(rows, scene, target, is_fixed)


def stretches(hits, form="{}"):
    """Words for which errors each method is the fastest: 'strang for 1e-3 and 1e-6'."""
    for name in dict.fromkeys(hit.method for _, hit in hits):
        errors = listed(power(target) for target, hit in hits if hit.method == name)
        yield f"{form.format(name)} for {errors}"


def concluded(comparison):
    races = list(fastest.races(comparison.rows, comparison.scenes))
    if not any(own for *_, own, _ in races):
        return ""
    return in_a_row(won(races), tied(races), ahead(races), lost(races), unreached(races))


def is_faster(one, other):
    """Whether `one` reached the error and took clearly less time than `other`."""
    return bool(one and (not other or fastest.TIE * one.seconds < other.seconds))


def is_tie(own, peer):
    return bool(own and peer) and not is_faster(own, peer) and not is_faster(peer, own)


def cases(races):
    """Return the number of cases in words: '28 cases (7 scenes, 4 accuracies)'."""
    scenes, targets = ({one[i] for one in races} for i in (0, 1))
    return f"{len(races)} cases ({len(scenes)} scenes, {len(targets)} accuracies)"


def won(races):
    winners = [own.method for *_, own, peer in races if is_faster(own, peer)]
    if not winners:
        return f"In none of {cases(races)} kreisel is fastest."
    return f"In {len(winners)} of {cases(races)} kreisel is fastest: {counted(winners)}."


def tied(races):
    places = [
        f"{scene} at {power(target)} rad ({own.method} and {peer.method})"
        for scene, target, own, peer in races
        if is_tie(own, peer)
    ]
    if not places:
        return ""
    ties = "One case is a tie" if len(places) == 1 else f"{len(places)} cases are ties"
    return f"{ties}: {listed(places)}."


def ahead(races):
    ratios = [peer.seconds / own.seconds for *_, own, peer in races if own and peer]
    alone = sum(own is not None and peer is None for *_, own, peer in races)
    if not ratios:
        return ""
    beside = "a peer reaches the error in each of them"
    if alone:
        beside = f"in {count(alone)} of the cases no peer reaches the error"
    return (
        f"The fastest peer takes {brief(statistics.median(ratios))} times as long in the median, "
        f"between {brief(min(ratios))} and {brief(max(ratios))} times in all cases; {beside}."
    )


def lost(races):
    places = [
        f"{scene} at {power(target)} rad ({peer.method})"
        for scene, target, own, peer in races
        if is_faster(peer, own)
    ]
    return f"A peer is faster for {listed(places)}." if places else ""


def unreached(races):
    places = [
        f"{scene} at {power(target)} rad"
        for scene, target, own, peer in races
        if not own and not peer
    ]
    return f"No program reaches {listed(places)}." if places else ""


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
    yield "readme_table.md", fastest.markdown(comparison.rows, comparison.scenes)


def told(comparison):
    for problem, end in comparison.problems:
        yield fastest.terminal(comparison.rows, problem.name, end)
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
