"""The fastest methods for given target errors, and tables of their run times."""

from rich.table import Table

from .formatting import format_digits, format_milliseconds, format_power
from .scene_runs import group_by_method

# The other integrators in the tables, with their titles.
REFERENCES = {"heyoka": "heyoka", "gsl_rk8pd": "GSL rk8pd", "scipy_dop853": "SciPy DOP853"}
TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)  # targets for the attitude error [rad]
# A method reaches a target if attitude and energy error meet it and the next tighter run
# is not much worse. Errors at one time change sign with the setting, and an accidental zero
# must not win.
LUCK = 3.0
# run times within this ratio count as equal, because neighbouring settings differ by 2 or 10
TIE = 4 / 3


def fastest_reaching(rows, target):
    """Return the fastest run of one method that reaches the target error, or None if there is none.

    The list `rows` is sorted by increasing accuracy.
    """
    tighter = rows[1:] if rows[0].step or rows[0].tol else rows  # a closed form has a single run
    good = [
        row
        for row, following in zip(rows, tighter, strict=False)
        if not row.failure
        and row.seconds
        and not following.failure
        and max(row.attitude_error, row.energy_error) <= target
        and following.attitude_error <= LUCK * target
    ]
    return min(good, key=lambda row: row.seconds, default=None)


def fastest_row(rows, scene, target, is_candidate):
    """Return the fastest run that reaches the target error and satisfies `is_candidate`."""
    hits = [
        hit
        for own in group_by_method(rows, scene).values()
        if is_candidate(own[0]) and (hit := fastest_reaching(own, target))
    ]
    return min(hits, key=lambda row: row.seconds, default=None)


def run_races(rows, scenes):
    """Yield the fastest runs of kreisel and other integrators for each scene and target error."""
    for scene in scenes:
        for target in TARGETS:
            own = fastest_row(rows, scene, target, lambda row: not row.peer)
            yield scene, target, own, fastest_row(rows, scene, target, lambda row: row.peer)


def times_to_targets(rows, scene):
    """Yield, for each method, its smallest error and its run times for the target errors.

    For each target error, the cell with the shortest run time is marked as the fastest.
    """
    groups = group_by_method(rows, scene)
    seconds = {
        name: [hit and hit.seconds for hit in (fastest_reaching(own, target) for target in TARGETS)]
        for name, own in groups.items()
    }
    columns = zip(*seconds.values(), strict=True)
    fastest = [min((s for s in column if s), default=None) for column in columns]
    for name, own in groups.items():
        errors = [row.attitude_error for row in own if not row.failure]
        yield {
            "method": name,
            "smallest": format_digits(min(errors, default=None)),
            "cells": [
                {"text": format_milliseconds(s), "fastest": s is not None and s == least}
                for s, least in zip(seconds[name], fastest, strict=True)
            ],
        }


def list_references(methods):
    """Return a dictionary from the names of the other integrators to their titles."""
    return {name: title for name, title in REFERENCES.items() if name in methods}


def summarize_races(rows, scenes):
    """Yield the run times of kreisel and other integrators for each scene and target error."""
    references = list_references({row.method for row in rows})

    def seconds(scene, target, name):
        hit = fastest_row(rows, scene, target, lambda row: row.method == name)
        return format_milliseconds(hit and hit.seconds)

    for scene, target, own, _ in run_races(rows, scenes):
        yield {
            "scene": scene,
            "target": format_power(target),
            "own": format_milliseconds(own and own.seconds),
            "method": own.method if own else "",
            "others": [seconds(scene, target, name) for name in references],
        }


def make_terminal_table(rows, scene, end):
    table = Table(
        title=f"{scene} to t = {end:g}: run time \\[ms] for an attitude error of",
        title_justify="left",
    )
    table.add_column("method")
    for target in TARGETS:
        table.add_column(f"{format_power(target)} rad", justify="right")
    table.add_column("smallest", justify="right")
    for line in times_to_targets(rows, scene):
        cells = [
            f"[bold]{cell['text']}[/]" if cell["fastest"] else cell["text"]
            for cell in line["cells"]
        ]
        table.add_row(line["method"], *cells, line["smallest"])
    return table


def write_markdown(rows, scenes):
    """Format the table of run times for README.md in Markdown."""
    titles = list_references({row.method for row in rows}).values()
    head = ["scene", "attitude error [rad]", "kreisel [ms]", *(f"{title} [ms]" for title in titles)]
    lines = [head, ["---"] + ["---:"] * (len(head) - 1)]
    for line in summarize_races(rows, scenes):
        own = f"{line['own']} ({line['method']})" if line["method"] else line["own"]
        lines.append([line["scene"], line["target"], own, *line["others"]])
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)
