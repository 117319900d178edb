"""Error against run time for every method on several scenes."""

import statistics
from dataclasses import dataclass, field

from ..competitors.method_families import group_methods
from ..drawing.curves import draw_curves
from ..drawing.style import LEAST, choose_line_styles
from . import advice, fastest, late_states, scene_runs, scene_table
from .formatting import format_power
from .part import write_csv

QUANTITIES = {
    "attitude_error": "attitude error at the end [rad]",
    "energy_error": "energy error, relative",
}
COSTS = {"seconds": "run time [ms]", "evaluations": "evaluations of right-hand side or torque"}
MAIN, *OVERVIEWS = ((name, cost) for cost in COSTS for name in QUANTITIES)
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
    middle = statistics.median([row.spread for row in rows if row.samples] or [0.0])
    note = " (the machine was busy; do not quote these times)" if middle > BUSY else ""
    return {"rounds": " .. ".join(map(str, counts)) or "no", "spread": f"{middle:.1%}{note}"}


def collect_lines(groups, quantity, cost):
    """Return the costs and the errors of each method that has any."""
    lines = {}
    for name, rows in groups.items():
        factor = 1e3 if cost == "seconds" else 1
        good = [row for row in rows if not row.failure and getattr(row, cost)]
        if good:
            errors = [max(getattr(row, quantity), LEAST) for row in good]
            lines[name] = [factor * getattr(row, cost) for row in good], errors
    return lines


def draw_costs(groups, quantity, cost, styles, floor=None, **options):
    lines = collect_lines(groups, quantity, cost)
    if not lines:
        return ""
    x, y = ([value for points in lines.values() for value in points[i]] for i in (0, 1))
    return draw_curves(
        lines,
        styles,
        xlabel=COSTS[cost],
        ylabel=QUANTITIES[quantity],
        xlim=(min(x) / 1.5, max(x) * 1.5),
        ylim=(min(y) / 3, min(10.0, max(y) * 3)),
        floor=floor,
        **options,
    )


def find_leaders(groups, methods, figures):
    """Return the methods that are fastest at some error in one of the figures."""
    leaders = set()
    for figure in figures:
        lines = collect_lines(groups, *figure)
        points = [
            (x, y, name)
            for name in methods
            if name in lines and len(lines[name][0]) > 1
            for x, y in zip(*lines[name], strict=True)
        ]
        for _, target, _ in points:
            leaders.add(min((x, name) for x, y, name in points if y <= target)[1])
    return [name for name in methods if name in leaders]


def scene_context(comparison, problem, end, families):
    rows, late = comparison.rows, comparison.late.get(problem.name)
    groups = scene_runs.group_by_method(rows, problem.name)
    floors = {"attitude_error": comparison.truths[problem.name]["conditioning"]}
    own = [name for family, _ in families.values() for name in family]
    leaders = choose_line_styles(find_leaders(groups, own, OVERVIEWS), YARDSTICK)
    small = {"size": (4.6, 2.7), "ticks": (4, 9)}
    return scene_table.scene_context(problem, end) | {
        "panels": [
            (title, draw_costs(groups, *MAIN, choose_line_styles(*family), floors[MAIN[0]]))
            for title, family in families.items()
            if any(name in groups for name in family[0])
        ],
        "overviews": [
            (
                f"{QUANTITIES[name]} against {COSTS[cost]}",
                draw_costs(groups, name, cost, leaders, floors.get(name), **small),
            )
            for name, cost in OVERVIEWS
        ],
        "times": list(fastest.times_to_targets(rows, problem.name)),
        "late": late and late_states.late_context(late),
    }


def summarize_races(comparison):
    """Return who is fastest where, which is the conclusion of this part."""
    races = fastest.run_races(comparison.rows, comparison.scenes)

    def list_places(is_member, form="{scene} at {target} rad"):
        return [
            form.format(scene=scene, target=format_power(target), own=own, peer=peer)
            for scene, target, own, peer in races
            if is_member(own, peer)
        ]

    def is_tie(own, peer):
        is_won = fastest.is_faster(own, peer) or fastest.is_faster(peer, own)
        return bool(own and peer) and not is_won

    return {
        "races": races if any(own for *_, own, _ in races) else [],
        "winners": list_places(fastest.is_faster, "{own.method}"),
        "ties": list_places(is_tie, "{scene} at {target} rad ({own.method} and {peer.method})"),
        "ratios": [peer.seconds / own.seconds for *_, own, peer in races if own and peer],
        "alone": sum(own is not None and peer is None for *_, own, peer in races),
        "losses": list_places(
            lambda own, peer: fastest.is_faster(peer, own),
            "{scene} at {target} rad ({peer.method})",
        ),
        "missing": list_places(lambda own, peer: not own and not peer),
    }


def count_paying_runs(rows, races):
    """Return after how many runs heyoka's compilation pays off, or None where it never does."""
    counts = []
    for scene, target, own, _ in races:
        peer = fastest.fastest_row(rows, scene, target, lambda row: row.method == "heyoka")
        if own and peer and peer.setup_seconds is not None:
            gain = own.seconds - peer.seconds
            counts.append(peer.setup_seconds / gain if gain > 0 else None)
    return counts


def build_context(comparison):
    rows, families = comparison.rows, group_methods()
    setup = [row.setup_seconds for row in rows if row.setup_seconds is not None]
    races = summarize_races(comparison)
    return (
        advice.build_lead(comparison)
        | races
        | {
            "references": fastest.list_references({row.method for row in rows}),
            "summary": list(fastest.summarize_races(rows, comparison.scenes)),
            "targets": [format_power(target) for target in fastest.TARGETS],
            "scenes": [scene_context(comparison, *each, families) for each in comparison.problems],
            "timing": describe_timing(rows),
            "luck": fastest.LUCK,
            "compiling": setup and (min(setup), max(setup), statistics.median(setup)),
            "paid": count_paying_runs(rows, races["races"]),
            "failures": [row for row in rows if row.failure],
        }
    )


def write_table(comparison, metadata):
    """Format all runs as CSV, below a header with the conditions of the measurement."""
    conditions = metadata | describe_timing(comparison.rows)
    head = "".join(f"# {key}: {value}\n" for key, value in conditions.items())
    return head + write_csv([row.summarize() for row in comparison.rows])


def draw_readme_figure(comparison):
    """Draw the figure for README.md, with the best methods and other integrators."""
    scene = README_SCENE if README_SCENE in comparison.scenes else comparison.scenes[0]
    groups = scene_runs.group_by_method(comparison.rows, scene)
    peers = [name for name, rows in groups.items() if rows[0].peer]
    own = [name for name in groups if name not in peers]
    styles = choose_line_styles(find_leaders(groups, own, [MAIN]), peers)
    svg = draw_costs(groups, *MAIN, styles)
    return svg.replace("currentColor", "#777777")  # legible on light and on dark


def list_files(comparison, metadata):
    yield "workprecision.csv", write_table(comparison, metadata)
    yield "readme_figure.svg", draw_readme_figure(comparison)


def terminal_lines(comparison):
    for problem, end in comparison.problems:
        yield fastest.make_terminal_table(comparison.rows, problem.name, end)
    spread = describe_timing(comparison.rows)["spread"]
    yield f"quartiles of the times {spread} apart, median over the runs"


list_answers = advice.list_answers


def list_methods(comparison):
    return {row.method for row in comparison.rows}
