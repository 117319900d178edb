"""The recommended method for each kind of top, shown at the top of the report."""

from collections import Counter
from statistics import median

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
# The parts of a question, which are keys of an answer, and how the page asks for them.
QUESTION = {"top": "My top", "error": "error", "count": "how many", "motion": "motion"}


def name_kind(problem):
    return KINDS[problem.to_scene().body.kind]


def describe_answer(top, error, count, motion):
    return dict(zip(QUESTION, (top, f"{format_power(error)} rad", count, motion), strict=True))


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


def list_answers(comparison):
    """Yield the fastest run of kreisel and of each other program, by scene and target error.

    A step fits one motion alone, so kreisel's methods without a step come first.
    """
    problems = {problem.name: (problem, end) for problem, end in comparison.problems}
    for name, target, own, others in fastest.list_hits(comparison.rows, problems):
        problem, end = problems[name]
        turns = scene_table.count_turns(scene_table.trace_path(problem, end), end)
        motion = f"{name}, to t = {end:g}: about {format_large(turns)} turns"
        question = describe_answer(name_kind(problem), target, "one top", motion)
        rows = comparison.rows
        without_step = fastest.fastest_row(
            rows, name, target, lambda row: not row.peer and row.step is None
        )
        if own := without_step or own:
            words = {"method": own.method} | own.setting.keywords
            if own.method == "exact" and problem.symmetric:
                words = {}  # the default
            code = ", ".join(["scene", f"t={end:g}", *(f"{n}={x!r}" for n, x in words.items())])
            ms = 1e3 * own.seconds
            yield question | {"program": own.method, "ms": ms, "code": f"kr.solve({code})"}
        for other, hit in others.items():
            answer = question | {"program": fastest.REFERENCES[other], "ms": None}
            if hit:
                setup = 1e3 * (hit.setup_seconds or 0.0)
                answer |= {"ms": 1e3 * hit.seconds, "setup": setup}
            yield answer


def describe_group(rows, method, problems):
    """Return a row of the table of recommended methods."""
    races = fastest.run_races(rows, [problem.name for problem in problems])
    kinds = join_words(dict.fromkeys(name_kind(problem) for problem in problems))
    wins = [(own, peer) for *_, own, peer in races if own and own.method == method]
    peers = dict.fromkeys(peer.method for *_, own, peer in races if own and peer)
    return {
        "kinds": kinds[0].upper() + kinds[1:],
        "method": method,
        "times": format_span([own.seconds for own, _ in wins], format_milliseconds),
        "rivals": [fastest.REFERENCES.get(name, name) for name in peers],
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
    problems = [problem for problem, _ in comparison.problems if problem.name in late]
    return {
        "t": f"{next(iter(late.values()))['t']:g}".replace("e+0", "e"),
        "kinds": join_words(dict.fromkeys(map(name_kind, problems))),
        "ratios": [findings["heyoka"] / findings["exact"] for findings in late.values()],
    } | {
        name: format_span([findings[name] for findings in late.values()], format_milliseconds)
        for name in ("exact", "taylor")
    }


def describe_setup(rows):
    """Return heyoka's median time of compilation [s], and how often kreisel runs in this time.

    kreisel's run is the median of the fastest runs for the second smallest target error. None if
    heyoka did not run.
    """
    setup = [row.setup_seconds for row in rows if row.setup_seconds is not None]
    scenes = dict.fromkeys(row.scene for row in rows)
    races = fastest.run_races(rows, scenes)
    own = [run.seconds for _, target, run, _ in races if run and target == fastest.TARGETS[-2]]
    return (
        {"seconds": median(setup), "runs": median(setup) / median(own)} if setup and own else None
    )


def build_lead(comparison):
    groups = group_scenes(comparison)
    return {
        "groups": [describe_group(comparison.rows, *group) for group in groups.items()],
        "setup": describe_setup(comparison.rows),
        "late": describe_late(comparison),
        "fixed": [
            (name, targets, kr.methods[name].symplectic)
            for name, targets in list_fixed_steps(comparison).items()
        ],
    }
