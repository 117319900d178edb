"""What to conclude, a paragraph a section, made from what was found."""

from collections import Counter
from statistics import median

import numpy as np

from ..parts import ensemble, judge, published
from . import tables

NUMBERS = (
    "no",
    "one",
    "two",
    "three",
    "four",
    "five",
    "six",
    "seven",
    "eight",
    "nine",
    "ten",
    "eleven",
    "twelve",
)


def number(n):
    return NUMBERS[n] if n < len(NUMBERS) else str(n)


def figure(x):
    """Two digits, without an exponent."""
    return f"{x:.0f}" if x >= 10 else f"{x:.2g}"


def listed(words):
    words = list(words)
    if not words:
        return "none"
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def counted(names):
    """Names by how often: 'exact (12), taylor (8)'."""
    return listed(f"{name} ({often})" for name, often in Counter(names).most_common())


def race(rows, scenes):
    """For each scene and error: the fastest of kreisel, and the fastest peer."""
    for scene in scenes:
        for target in tables.TARGETS:
            yield (
                scene,
                target,
                tables.fastest_of(rows, scene, target, lambda row: not row.peer),
                tables.fastest_of(rows, scene, target, lambda row: row.peer),
            )


def of_workprecision(rows, scenes):
    races = list(race(rows, scenes))
    reached = [(own, peer) for *_, own, peer in races if own]
    if not reached:
        return ""
    won = [own for own, peer in reached if not peer or own.seconds < peer.seconds]
    lost = [
        (scene, target, peer)
        for scene, target, own, peer in races
        if peer and (not own or peer.seconds <= own.seconds)
    ]
    ratios = [peer.seconds / own.seconds for own, peer in reached if peer]
    alone = sum(own is not None and peer is None for *_, own, peer in races)
    text = (
        (
            f"Of {len(races)} pairs of a scene and an error, a method of kreisel is the fastest in {len(won)}: "
            f"{counted(row.method for row in won)}."
        )
        if won
        else "No method of kreisel is the fastest anywhere."
    )
    if ratios:
        text += (
            f" The fastest peer takes {figure(median(ratios))} times as long at the median, and between {figure(min(ratios))} and "
            f"{figure(max(ratios))} times; {'none' if not alone else number(alone)} of these errors {'is' if alone == 1 else 'are'} reached by no peer."
        )
    if lost:
        text += (
            " A peer is the faster one for "
            + listed(
                f"{scene} at {tables.power(target)} rad ({peer.method})"
                for scene, target, peer in lost
            )
            + "."
        )
    nobody = [
        f"{scene} at {tables.power(target)} rad"
        for scene, target, own, peer in races
        if not own and not peer
    ]
    return text + (f" Nobody reaches {listed(nobody)}." if nobody else "")


def of_scene(rows, scene):
    """Which method to take on one scene."""
    races = [(target, own, peer) for _, target, own, peer in race(rows, [scene]) if own]
    if not races:
        return "No method reached any of the errors in the table within the time allowed."
    names = [own.method for _, own, _ in races]
    stretches = [
        f"<strong>{name}</strong> for {listed(f'{tables.power(target)}' for target, own, _ in races if own.method == name)} rad"
        for name in dict.fromkeys(names)
    ]
    fixed = fixed_step_best(rows, scene)
    return f"Take {listed(stretches)}." + (f" With fixed steps, {fixed}." if fixed else "")


def fixed_step_best(rows, scene):
    found = [
        (target, hit.method)
        for target in tables.TARGETS
        if (
            hit := tables.fastest_of(
                rows, scene, target, lambda row: not row.peer and row.step is not None
            )
        )
    ]
    names = list(dict.fromkeys(name for _, name in found))
    return (
        listed(
            f"{name} for {listed(tables.power(target) for target, who in found if who == name)}"
            for name in names
        )
        if names
        else ""
    )


def agreement(truths):
    """For each scene: how far the 128-bit ways, and how far all others, are from the truth, in roundings of the data."""
    for line in truths:
        condition = line["conditioning"]
        many = [
            angle / condition
            for name, angle in line["ways"]
            if "128" in name or "30 digits" in name
        ]
        others = [
            (angle / condition, name)
            for name, angle in line["ways"]
            if not ("128" in name or "30 digits" in name)
        ]
        yield line["scene"], max(many, default=0.0), max(others, default=(0.0, ""))


def of_truths(truths):
    found = list(agreement(truths))
    if not found:
        return ""
    many = max(most for _, most, _ in found)
    apart = [scene for scene, most, _ in found if most > 1.0]
    scene, _, (worst, name) = max(found, key=lambda line: line[2][0])
    said = (
        f"On {'every scene' if not apart else f'all scenes but {listed(apart)}'} the truths of many digits agree within the conditioning: they "
        f"lie at most {many:.0e} of one rounding of the data apart."
    )
    return said + (
        f" Of what computes in 80 bits or in doubles, {name} is the furthest away: {figure(worst)} roundings, on {scene}."
        if name
        else ""
    )


def of_atlas(cells):
    ran = [cell for cell in cells if cell["verdict"] in ("right", "degraded", "lost", "silent")]
    if not ran:
        return ""
    counts = Counter(cell["verdict"] for cell in cells)
    silent = [
        f"{cell['method']} on {cell['case']}" for cell in cells if cell["verdict"] == "silent"
    ]
    shown = Counter(cell.get("shown_by") for cell in ran)
    plain = Counter(cell["method"] for cell in cells if cell["verdict"] == "right")
    (best, often), *_ = plain.most_common(1) or [("none", 0)]
    worst = Counter(
        cell["method"] for cell in cells if cell["verdict"] in ("lost", "stopped")
    ).most_common(3)
    broken = Counter(cell["method"] for cell in ran if cell["mark"] == judge.BEYOND)
    text = (
        f"Of {len(cells)} cells {number(len(silent)) if silent else 'none'} {'are' if len(silent) > 1 else 'is'} wrong in silence"
        f"{': ' + listed(silent) if silent else ''}. {counts['right']} are right, {counts['degraded']} degraded, {counts['lost']} "
        f"lost, {counts['stopped']} stopped with a message and {counts['refused']} refused with one. Of those that are not right the finer "
        f"run shows it in {shown['second run']}, the step beforehand in {shown['large step']}, and {shown['rounding']} are accumulated rounding. "
        f"Most often right is {best} ({often} cells); most often lost or stopped are {listed(f'{name} ({n})' for name, n in worst)}."
    )
    return text + (
        f" More than {judge.PROMISED:g} times off what the tolerance explains: {counted(broken.elements())}."
        if broken
        else ""
    )


def of_stiff(lines):
    """Who keeps what, by kind: the largest energy error and the attitude error at the end, of those that came to the end."""
    if not lines:
        return ""
    end = max(line["t"][-1] for line in lines if line["t"])
    here = [line for line in lines if line["t"] and line["t"][-1] == end]
    both = [
        line["method"]
        for line in here
        if line["attitude"][-1] < judge.LOST and max(line["energy"]) < 1e-3
    ]
    energy = [
        line["method"]
        for line in here
        if line["attitude"][-1] >= judge.LOST and max(line["energy"]) < judge.LOST
    ]
    stopped = [line["method"] for line in lines if line not in here]
    parts = [
        f"keep both energy and attitude: {listed(both)}" if both else "",
        f"keep the energy within {judge.LOST:g} of its size and lose the attitude: {listed(energy)}"
        if energy
        else "",
        f"do not get to the end: {listed(stopped)}" if stopped else "",
    ]
    return "In these runs " + "; ".join(filter(None, parts)) + "."


def of_ensemble(found):
    kinds = {}
    for line in ensemble.summary(found):
        kinds.setdefault(line["kind"], []).append(line)
    parts = [
        f"{kind}: {lines[0]['method']} (median {lines[0]['middle']:.0e} rad, 95 % below {lines[0]['bad']:.0e})"
        + (f", then {lines[1]['method']} ({lines[1]['middle']:.0e})" if len(lines) > 1 else "")
        for kind, lines in kinds.items()
    ]
    failed = sum(line["failed"] for lines in kinds.values() for line in lines)
    return (
        f"The smallest error in the given time has, for {'; for '.join(parts)}. {number(failed).capitalize() if failed else 'None'} of {len(found)} runs failed."
        if parts
        else ""
    )


def of_published(rows):
    parts = []
    for problem in published.problems():
        own = [
            row
            for row in rows
            if row["problem"] == problem.name and row.get("energy_error") is not None
        ]
        literature = [row for row in own if "published" in row["by"]]
        same = [
            row
            for row in own
            if row not in literature and row["setting"] in {row["setting"] for row in literature}
        ]
        if literature and same:
            best = min(same, key=lambda row: row["energy_error"])
            parts.append(
                f"{problem.name.replace('_', ' ')}: {best['by']} with {best['setting']} has an energy error of {best['energy_error']:.0e}, the published "
                f"method with the same step {min(row['energy_error'] for row in literature if row['setting'] == best['setting']):.0e}"
            )
    return "; ".join(parts).capitalize() + "." if parts else ""


def of_left_out(rows):
    by = {}
    for row in rows:
        if row["kind"] == "form":
            by.setdefault(row["name"], {})[row["case"]] = row["seconds"]
    saved = {
        what: [
            cases[before] / cases[after]
            for cases in by.values()
            if before in cases and after in cases
        ]
        for what, before, after in (
            ("a symmetric body's form", "general form", "symmetric form"),
            ("gravity", "symmetric form", "no gravity"),
        )
    }
    for row in rows:
        if row["kind"] == "scene" and row["case"] not in (
            "gravity",
            "the general form of the body",
        ):
            saved.setdefault(row["case"], []).append(row["seconds_with"] / row["seconds"])
    parts = [
        f"leaving out {what} makes a run {figure(np.median(ratios))} times as fast at the median ({figure(min(ratios))} to {figure(max(ratios))})"
        for what, ratios in saved.items()
        if ratios
    ]
    return f"{parts[0][0].upper()}{listed(parts)[1:]}." if parts else ""
