"""What comes out, as a table in the terminal, in Markdown, in HTML and as CSV; all from the same rows."""

import csv

from rich.table import Table

from ..parts.workprecision import by_method, reaching

TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)  # of the attitude error [rad]
REFERENCES = {"heyoka": "heyoka", "gsl_rk8pd": "GSL rk8pd", "scipy_dop853": "SciPy DOP853"}
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


def milliseconds(seconds):
    """Three digits."""
    if seconds is None:
        return "–"
    ms = 1e3 * seconds
    return (
        f"{ms:.0f}"
        if ms >= 100
        else f"{ms:.1f}"
        if ms >= 10
        else f"{ms:.2f}"
        if ms >= 1
        else f"{ms:.3f}"
    )


def power(target):
    return f"{target:.0e}".replace("e-0", "e-")


def times(rows, scene):
    """For each method of a scene: milliseconds to each target (the fastest marked), and its smallest error."""
    reached = {
        name: [reaching(own, target) for target in TARGETS]
        for name, own in by_method(rows, scene).items()
    }
    seconds = {
        name: [row.seconds if row else None for row in hits] for name, hits in reached.items()
    }
    fastest = [min((s for s in column if s), default=None) for column in zip(*seconds.values())]
    for name, own in by_method(rows, scene).items():
        errors = [row.attitude_error for row in own if not row.failure]
        yield {
            "method": name,
            "smallest": f"{min(errors):.0e}" if errors else "–",
            "cells": [
                {"text": milliseconds(s), "fastest": s is not None and s == least}
                for s, least in zip(seconds[name], fastest)
            ],
        }


def references(rows):
    """Those to compare with, where they ran: name and what to call it."""
    ran = {row.method for row in rows}
    return {name: title for name, title in REFERENCES.items() if name in ran}


def fastest_of(rows, scene, target, wanted):
    hits = [
        hit
        for own in by_method(rows, scene).values()
        if wanted(own[0]) and (hit := reaching(own, target))
    ]
    return min(hits, key=lambda row: row.seconds, default=None)


def summary(rows, scenes):
    """For each scene and target the fastest method of kreisel, beside those to compare with."""
    for scene in scenes:
        for target in TARGETS:
            own = fastest_of(rows, scene, target, lambda row: not row.peer)
            others = [
                fastest_of(rows, scene, target, lambda row: row.method == name)
                for name in references(rows)
            ]
            yield {
                "scene": scene,
                "target": power(target),
                "own": milliseconds(own and own.seconds),
                "method": own.method if own else "",
                "others": [milliseconds(hit and hit.seconds) for hit in others],
            }


def terminal(rows, scene, end):
    table = Table(
        title=f"{scene} to t = {end:g}: run time \\[ms] for an attitude error of",
        title_justify="left",
    )
    table.add_column("method")
    for target in TARGETS:
        table.add_column(f"{power(target)} rad", justify="right")
    table.add_column("smallest", justify="right")
    for line in times(rows, scene):
        cells = [
            f"[bold]{cell['text']}[/]" if cell["fastest"] else cell["text"]
            for cell in line["cells"]
        ]
        table.add_row(line["method"], *cells, line["smallest"])
    return table


def markdown(rows, scenes):
    """The README's table."""
    others = [f"{title} [ms]" for title in references(rows).values()]
    titles = ["scene", "attitude error [rad]", "kreisel [ms]", *others]
    lines = [titles, ["---"] + ["---:"] * (len(titles) - 1)]
    for line in summary(rows, scenes):
        own = f"{line['own']} ({line['method']})" if line["method"] else line["own"]
        lines.append([line["scene"], line["target"], own, *line["others"]])
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def write_csv(path, rows, about):
    def number(value):
        return "" if value is None else f"{value:.6g}" if isinstance(value, float) else value

    with path.open("w", newline="") as file:
        file.writelines(f"# {key}: {value}\n" for key, value in about.items())
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for row in rows:
            known = {
                **vars(row),
                "seconds": row.seconds,
                "seconds_median": row.middle,
                "seconds_spread": row.spread,
                "rounds": len(row.samples),
            }
            writer.writerow(number(known[name]) for name in COLUMNS)
