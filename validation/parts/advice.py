"""The recommended method for each kind of top, shown at the top of the report."""

from collections import Counter

import kreisel as kr

from . import fastest, scene_table
from .formatting import (
    format_brief,
    format_large,
    format_milliseconds,
    format_power,
    join_words,
)

KINDS = {
    "lagrange": "symmetric tops",
    "euler": "free bodies",
    "kowalewski": "Kowalewski",
    "goryachev_chaplygin": "Goryachev-Chaplygin",
    "general": "asymmetric tops",
}


def describe_kinds(problems):
    kinds = dict.fromkeys(problem.to_scene().body.kind for problem in problems)
    text = join_words(KINDS[kind] for kind in kinds)
    return text[0].upper() + text[1:]


def find_winner(rows, scene):
    """Return the method of kreisel that is fastest for most target errors, or None."""
    wins = [own.method for _, _, own, _ in fastest.run_races(rows, [scene]) if own]
    return Counter(wins).most_common(1)[0][0] if wins else None


def group_scenes(comparison):
    """Return a dictionary that maps each method to the problems for which it is recommended."""
    groups = {}
    for problem, _ in comparison.problems:
        winner = find_winner(comparison.rows, problem.name)
        if winner:
            groups.setdefault(winner, []).append(problem)
    return groups


def describe_group(rows, method, problems):
    """Return a row of the table of recommended methods."""
    scenes = [problem.name for problem in problems]
    races = list(fastest.run_races(rows, scenes))
    wins = [own for *_, own, _ in races if own and own.method == method]
    ratios = [
        peer.seconds / own.seconds
        for *_, own, peer in races
        if own and peer and own.method == method
    ]
    rivals = dict.fromkeys(
        fastest.REFERENCES.get(peer.method, peer.method) for *_, own, peer in races if own and peer
    )
    missing = [
        f"{scene} at {format_power(target)} rad"
        for scene, target, own, peer in races
        if not own and not peer
    ]
    times = [format_milliseconds(bound(row.seconds for row in wins)) for bound in (min, max)]
    return {
        "kinds": describe_kinds(problems),
        "method": method,
        "scenes": join_words(scenes),
        "times": " to ".join(dict.fromkeys(times)),
        "wins": len(wins),
        "rivals": join_words(rivals),
        "unreached": join_words(missing) if missing else "",
        "cases": len(races),
        "ratios": " to ".join(dict.fromkeys(format_brief(bound(ratios)) for bound in (min, max)))
        if ratios
        else "",
    }


def list_fixed_steps(comparison):
    """Yield each target error and the fixed-step method that reaches it fastest on most scenes."""

    def has_step(row):
        return not row.peer and row.step is not None

    for target in fastest.TARGETS:
        hits = [
            hit.method
            for scene in comparison.scenes
            if (hit := fastest.fastest_row(comparison.rows, scene, target, has_step))
        ]
        if hits:
            method = Counter(hits).most_common(1)[0][0]
            yield {"target": format_power(target), "method": method}


def describe_late(comparison):
    """Return the range of run times for states at large times, or None if nothing was measured."""
    late = [findings for findings in comparison.late.values() if findings]
    if not late:
        return None

    def span(values, form):
        return " to ".join(dict.fromkeys(form(bound(values)) for bound in (min, max)))

    scenes = [scene for scene, findings in comparison.late.items() if findings]
    times = {
        name: span([findings[name] for findings in late], format_milliseconds)
        for name in ("exact", "taylor")
    }
    ratios = [findings["heyoka"] / findings["taylor"] for findings in late]
    return times | {
        "t": f"{late[0]['t']:g}".replace("e+0", "e"),
        "scenes": join_words(scenes),
        "ratios": span(ratios, format_brief),
    }


def build_lead(comparison):
    groups = group_scenes(comparison)
    turns = [
        scene_table.count_turns(scene_table.trace_path(problem, end), end)
        for problem, end in comparison.problems
    ]
    fixed = {}
    for line in list_fixed_steps(comparison):
        fixed.setdefault(line["method"], []).append(line)
    return {
        "groups": [describe_group(comparison.rows, *group) for group in groups.items()],
        "late": describe_late(comparison),
        "turns": " to ".join(format_large(bound(turns)) for bound in (min, max)),
        "accuracies": ", ".join(map(format_power, fastest.TARGETS[:-1]))
        + f" or {format_power(fastest.TARGETS[-1])}",
        "fixed": [
            {
                "method": method,
                "targets": join_words(line["target"] for line in lines),
                "symplectic": kr.methods[method].symplectic,
            }
            for method, lines in fixed.items()
        ],
    }
