"""Error against run time for every method on several scenes."""

import math
import statistics
from dataclasses import dataclass, field

import numpy as np

from ..competitors.method_families import group_methods
from ..drawing import cost_curves
from . import advice, fastest, late_states, scene_runs, scene_table
from .formatting import (
    count_word,
    format_brief,
    format_digits,
    format_power,
    join_counts,
    join_sentences,
    join_words,
)
from .part import Part, write_csv

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
README_SCENE = "asymmetric"
YARDSTICK = ("heyoka",)  # other integrators in the small figures
BUSY = 0.25  # if the spread of the times is larger than this, the times should not be quoted


@dataclass(frozen=True)
class Comparison:
    """Test problems with their end times, reference solutions and measured runs."""

    problems: list  # problems with their end times
    truths: dict  # truths by scene
    rows: list
    late: dict = field(default_factory=dict)  # times of late states by scene

    @property
    def scenes(self):
        return [problem.name for problem, _ in self.problems]


def list_tasks(problems, size, store):
    for problem, end in problems:
        yield from scene_runs.list_tasks(problem, end, size, store)
        yield from late_states.list_tasks(problem, size)


def load_findings(problems, store):
    rows_by_scene = {
        problem.name: scene_runs.load_measurements(store, problem.name) for problem, _ in problems
    }
    complete = [(problem, end) for problem, end in problems if rows_by_scene[problem.name]]
    truths = {problem.name: store.known[scene_runs.truth_key(problem)] for problem, _ in complete}
    late = {problem.name: store.known.get(late_states.late_key(problem)) for problem, _ in complete}
    rows = [row for rows in rows_by_scene.values() for row in rows]
    return Comparison(complete, truths, rows, late) if complete else None


def describe_timing(rows):
    """Describe how often the run times were measured, and how much they vary."""
    counts = sorted({len(row.samples) for row in rows if row.samples})
    spreads = [row.spread for row in rows if row.samples]
    middle = statistics.median(spreads) if spreads else 0.0
    note = " (the machine was busy; do not quote these times)" if middle > BUSY else ""
    return {"rounds": " .. ".join(map(str, counts)) or "no", "spread": f"{middle:.1%}{note}"}


def summarize_setup(rows):
    """Return the smallest, median and largest compile time [s] of heyoka."""
    seconds = [row.setup_seconds for row in rows if row.setup_seconds is not None]
    if not seconds:
        return None
    return {"least": min(seconds), "middle": float(np.median(seconds)), "most": max(seconds)}


def describe_payment(rows, scenes):
    """Describe after how many runs the compilation of heyoka's integrator pays off.

    Only scenes and target errors that both programs can reach are included.
    """
    runs = [
        peer.setup_seconds / (own.seconds - peer.seconds)
        if own.seconds > peer.seconds
        else math.inf
        for scene, target, own, _ in fastest.run_races(rows, scenes)
        for peer in [fastest.fastest_row(rows, scene, target, lambda row: row.method == "heyoka")]
        if own and peer and peer.setup_seconds is not None
    ]
    if not runs:
        return ""
    counts = [count for count in runs if math.isfinite(count)]
    if not counts:
        return f"It is paid in none of {len(runs)} rows of the summary: kreisel's runs are faster."
    least, most = (format_digits(count, ".2g") for count in (min(counts), max(counts)))
    return (
        f"It is paid in {len(counts)} of {len(runs)} rows of the summary, after {least} to {most} "
        "runs; in the others kreisel's runs are faster."
    )


def scene_context(comparison, problem, end, groups_of):
    rows = comparison.rows
    groups = scene_runs.group_by_method(rows, problem.name)
    floors = {"attitude_error": comparison.truths[problem.name]["conditioning"]}
    main, *others = ((name, cost) for cost in cost_curves.COSTS for name in QUANTITIES)
    own = [name for family, _ in groups_of.values() for name in family]
    leaders = cost_curves.select_leaders(groups, own, others)

    def draw(draw_panel, name, cost, *arguments):
        return draw_panel(groups, *arguments, name, QUANTITIES[name], cost, floors.get(name))

    return scene_table.scene_context(problem, end) | {
        "advice": recommend_methods(rows, problem.name),
        "panels": [
            {"label": title, "svg": svg}
            for title, svg in draw(cost_curves.draw_families, *main, groups_of)
        ],
        "overviews": [
            {
                "label": f"{QUANTITIES[name]} against {cost_curves.COSTS[cost]}",
                "svg": draw(cost_curves.draw_overview, name, cost, leaders, YARDSTICK),
            }
            for name, cost in others
        ],
        "times": list(fastest.times_to_targets(rows, problem.name)),
        "late": late_states.describe_late_state(comparison.late.get(problem.name)),
    }


def build_context(comparison):
    rows, groups_of = comparison.rows, group_methods()
    return {
        "references": fastest.list_references({row.method for row in rows}),
        "summary": list(fastest.summarize_races(rows, comparison.scenes)),
        "targets": [format_power(target) for target in fastest.TARGETS],
        "scenes": [scene_context(comparison, *each, groups_of) for each in comparison.problems],
        "timing": describe_timing(rows),
        "luck": f"{fastest.LUCK:g}",
        "setup": summarize_setup(rows),
        "paid": describe_payment(rows, comparison.scenes),
        "failures": [row for row in rows if row.failure],
    }


def recommend_methods(rows, scene):
    """Return text that recommends methods for one scene."""
    hits = [(target, own) for _, target, own, _ in fastest.run_races(rows, [scene]) if own]
    if not hits:
        return "No method reached any of the errors of the table in the time allowed."
    best = join_words(f"{stretch} rad" for stretch in describe_ranges(hits, "<strong>{}</strong>"))
    fixed = [
        (target, hit)
        for target in fastest.TARGETS
        if (hit := fastest_with_step(rows, scene, target))
    ]
    return join_sentences(
        f"Take {best}.", f"With fixed steps, {join_words(describe_ranges(fixed))}." if fixed else ""
    )


def fastest_with_step(rows, scene, target):
    def has_step(row):
        return not row.peer and row.step is not None

    return fastest.fastest_row(rows, scene, target, has_step)


def describe_ranges(hits, form="{}"):
    """Yield a phrase for each method with its target errors, such as 'strang for 1e-3 and 1e-6'."""
    for name in dict.fromkeys(hit.method for _, hit in hits):
        errors = join_words(format_power(target) for target, hit in hits if hit.method == name)
        yield f"{form.format(name)} for {errors}"


def conclude(comparison):
    races = list(fastest.run_races(comparison.rows, comparison.scenes))
    if not any(own for *_, own, _ in races):
        return ""
    return join_sentences(
        describe_wins(races),
        describe_ties(races),
        describe_ratios(races),
        describe_losses(races),
        describe_missing(races),
    )


def is_faster(one, other):
    """Return True if one run is clearly faster than the other."""
    return bool(one and (not other or fastest.TIE * one.seconds < other.seconds))


def is_tie(own, peer):
    return bool(own and peer) and not is_faster(own, peer) and not is_faster(peer, own)


def describe_cases(races):
    """Describe the number of cases, as in '28 cases (7 scenes, 4 accuracies)'."""
    scenes, targets = ({one[i] for one in races} for i in (0, 1))
    return f"{len(races)} cases ({len(scenes)} scenes, {len(targets)} accuracies)"


def describe_wins(races):
    winners = [own.method for *_, own, peer in races if is_faster(own, peer)]
    if not winners:
        return f"In none of {describe_cases(races)} kreisel is fastest."
    return (
        f"In {len(winners)} of {describe_cases(races)} kreisel is fastest: {join_counts(winners)}."
    )


def describe_ties(races):
    places = [
        f"{scene} at {format_power(target)} rad ({own.method} and {peer.method})"
        for scene, target, own, peer in races
        if is_tie(own, peer)
    ]
    if not places:
        return ""
    ties = "One case is a tie" if len(places) == 1 else f"{len(places)} cases are ties"
    return f"{ties}: {join_words(places)}."


def describe_ratios(races):
    ratios = [peer.seconds / own.seconds for *_, own, peer in races if own and peer]
    alone = sum(own is not None and peer is None for *_, own, peer in races)
    if not ratios:
        return ""
    comparison = "In each of these cases at least one other program reaches the error too"
    if alone:
        comparison = f"In {count_word(alone)} of the cases no other program reaches the error"
    return (
        f"The fastest other program takes {format_brief(min(ratios))} to "
        f"{format_brief(max(ratios))} times as long. {comparison}."
    )


def describe_losses(races):
    places = [
        f"{scene} at {format_power(target)} rad ({peer.method})"
        for scene, target, own, peer in races
        if is_faster(peer, own)
    ]
    return f"Another integrator is faster for {join_words(places)}." if places else ""


def describe_missing(races):
    places = [
        f"{scene} at {format_power(target)} rad"
        for scene, target, own, peer in races
        if not own and not peer
    ]
    return f"No program reaches {join_words(places)}." if places else ""


def write_table(comparison, metadata):
    """Format all runs as CSV, below a header with the conditions of the measurement."""

    def format_row(row):
        values = vars(row) | {
            "seconds": row.seconds,
            "seconds_median": row.median_seconds,
            "seconds_spread": row.spread,
            "rounds": len(row.samples),
        }
        return {
            name: f"{value:.6g}" if isinstance(value, float) else value
            for name, value in values.items()
        }

    head = (
        f"# {key}: {value}\n"
        for key, value in (metadata | describe_timing(comparison.rows)).items()
    )
    return "".join(head) + write_csv(COLUMNS, map(format_row, comparison.rows))


def list_files(comparison, metadata):
    yield "workprecision.csv", write_table(comparison, metadata)
    yield "readme_table.md", fastest.write_markdown(comparison.rows, comparison.scenes)
    yield "readme_figure.svg", draw_readme_figure(comparison)


def draw_readme_figure(comparison):
    """Draw the figure for README.md, with the best methods and other integrators."""
    scene = README_SCENE if README_SCENE in comparison.scenes else comparison.scenes[0]
    groups = scene_runs.group_by_method(comparison.rows, scene)
    peers = [name for name, rows in groups.items() if rows[0].peer]
    own = [name for name in groups if name not in peers]
    cost = ("attitude_error", "seconds")
    leaders = cost_curves.select_leaders(groups, own, [cost])
    lines, limits = cost_curves.collect_lines(groups, *cost)
    label = QUANTITIES["attitude_error"]
    svg = cost_curves.draw_family(lines, leaders, peers, label, None, limits, cost[1])
    return svg.replace("currentColor", "#777777")  # legible on light and on dark


def terminal_lines(comparison):
    for problem, end in comparison.problems:
        yield fastest.make_terminal_table(comparison.rows, problem.name, end)
    spread = describe_timing(comparison.rows)["spread"]
    yield f"quartiles of the times {spread} apart, median over the runs"


def list_methods(comparison):
    return {row.method for row in comparison.rows}


PART = Part(
    "workprecision",
    "Error against run time",
    "Error against run time, in short",
    list_tasks,
    load_findings,
    build_context,
    conclude,
    list_files=list_files,
    terminal_lines=terminal_lines,
    list_methods=list_methods,
    build_lead=advice.build_lead,
    accepts_user_scenes=True,
)
