"""The recommended method for each kind of top, shown at the top of the report."""

from collections import Counter

import kreisel as kr

from . import fastest, scene_table
from .formatting import format_large, format_milliseconds, format_power, format_span, join_words

KINDS = {
    "lagrange": "symmetric tops",
    "euler": "free bodies",
    "kowalewski": "Kowalewski",
    "goryachev_chaplygin": "Goryachev-Chaplygin",
    "general": "asymmetric tops",
}


def find_most_frequent(names):
    """Return the most frequent name, or None if there is none."""
    return next((name for name, _ in Counter(names).most_common(1)), None)


def group_scenes(comparison):
    """Return a dictionary that maps each method to the problems for which it is recommended.

    A method is recommended if it is kreisel's fastest for most target errors.
    """
    groups = {}
    for problem, _ in comparison.problems:
        races = fastest.run_races(comparison.rows, [problem.name])
        if winner := find_most_frequent(own.method for *_, own, _ in races if own):
            groups.setdefault(winner, []).append(problem)
    return groups


def describe_group(rows, method, problems):
    """Return a row of the table of recommended methods."""
    scenes = [problem.name for problem in problems]
    races = fastest.run_races(rows, scenes)
    kinds = join_words(dict.fromkeys(KINDS[problem.to_scene().body.kind] for problem in problems))
    wins = [(own, peer) for *_, own, peer in races if own and own.method == method]
    peers = dict.fromkeys(peer.method for *_, own, peer in races if own and peer)
    return {
        "kinds": kinds[0].upper() + kinds[1:],
        "method": method,
        "scenes": scenes,
        "times": format_span([own.seconds for own, _ in wins], format_milliseconds),
        "wins": len(wins),
        "rivals": [fastest.REFERENCES.get(name, name) for name in peers],
        "unreached": [
            f"{scene} at {format_power(target)} rad"
            for scene, target, own, peer in races
            if not own and not peer
        ],
        "cases": len(races),
        "ratios": [peer.seconds / own.seconds for own, peer in wins if peer],
    }


def list_fixed_steps(comparison):
    """Return the best fixed-step methods, each with the errors that it reaches fastest."""
    methods = {}
    for target in fastest.TARGETS:
        hits = (
            fastest.fastest_with_step(comparison.rows, scene, target) for scene in comparison.scenes
        )
        if method := find_most_frequent(hit.method for hit in hits if hit):
            methods.setdefault(method, []).append(format_power(target))
    return methods


def describe_late(comparison):
    """Return the range of run times for states at large times, or None if nothing was measured."""
    late = {scene: findings for scene, findings in comparison.late.items() if findings}
    if not late:
        return None
    return {
        "t": f"{next(iter(late.values()))['t']:g}".replace("e+0", "e"),
        "scenes": list(late),
        "ratios": [findings["heyoka"] / findings["taylor"] for findings in late.values()],
    } | {
        name: format_span([findings[name] for findings in late.values()], format_milliseconds)
        for name in ("exact", "taylor")
    }


def build_lead(comparison):
    turns = [
        scene_table.count_turns(scene_table.trace_path(problem, end), end)
        for problem, end in comparison.problems
    ]
    *targets, last = map(format_power, fastest.TARGETS)
    return {
        "groups": [
            describe_group(comparison.rows, *group) for group in group_scenes(comparison).items()
        ],
        "late": describe_late(comparison),
        "turns": format_span(turns, format_large),
        "accuracies": f"{', '.join(targets)} or {last}",
        "fixed": [
            (name, targets, kr.methods[name].symplectic)
            for name, targets in list_fixed_steps(comparison).items()
        ],
    }
