"""The report: error against run time, truths, stability, ensembles and published problems: a page and its tables.

kreisel report [scene.toml ...] [--quick | --full | --thesis] [--out report]   or   python -m validation.report
"""

import argparse
import statistics
import time
from pathlib import Path

import kreisel as kr
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ..parts import (
    atlas,
    atlas_cases,
    ensemble,
    left_out,
    omissions,
    published,
    stiff,
    workprecision,
)
from ..parts.budget import PLANS, Task, work_through
from ..parts.store import Store
from ..peers import machine
from ..truth import reference as truth
from ..truth.problems import HORIZONS, SHORT, described, load
from . import page, tables

BUSY = 0.25  # from this spread of the times on they are not to be quoted
TURNS = 16  # to which a user's own scene is run
PARTS = ("workprecision", "atlas", "ensemble", "published", "left_out")


def parts(words):
    chosen = words.split(",")
    for word in chosen:
        if word not in PARTS:
            raise argparse.ArgumentTypeError(f"{word!r} is none of {', '.join(PARTS)}")
    return chosen


def arguments(argv):
    parser = argparse.ArgumentParser(prog="kreisel report", description=__doc__.splitlines()[0])
    parser.add_argument(
        "scenes",
        nargs="*",
        type=Path,
        metavar="scene.toml",
        help=f"your own scenes, to about {TURNS} turns; without: those of the report",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("report"), help="the folder to write to (default: report)"
    )
    parser.add_argument(
        "--only",
        type=parts,
        metavar="PART[,...]",
        help=f"of {', '.join(PARTS)} (default: all; for your own scenes workprecision)",
    )
    size = parser.add_mutually_exclusive_group()
    size.add_argument(
        "--quick",
        action="store_const",
        dest="plan",
        const="quick",
        default="default",
        help=f"few settings, to t = {SHORT:g}: shows that all works, no figures to quote",
    )
    size.add_argument(
        "--full", action="store_const", dest="plan", const="full", help="as long as it takes"
    )
    size.add_argument(
        "--thesis",
        action="store_true",
        help="the chapter on the thesis alone, thesis.html: its figures, sentences and errata",
    )
    return parser.parse_args(argv)


def progress_bar(console):
    return Progress(
        TextColumn("{task.description:44}"),
        BarColumn(bar_width=30),
        TextColumn("{task.percentage:3.0f} %"),
        TimeElapsedColumn(),
        console=console,
    )


def chosen_problems(files, plan):
    """Each with where it ends."""
    if not files:
        return [(load(name), SHORT if plan.quick else end) for name, end in HORIZONS.items()]
    found = [described(file.stem, kr.Scene.from_toml(file)) for file in files]
    for file, problem in zip(files, found):
        if not problem.rate:
            raise ValueError(
                f"{file}: this top rests for ever: it has neither angular momentum nor weight; give it one of them"
            )
        if [other.name for other in found].count(problem.name) > 1:
            raise ValueError(
                f"{file}: there are two scenes of the name {problem.name!r}; the report calls them by their files' names"
            )
    return [(problem, TURNS * workprecision.turn_length(problem)) for problem in found]


def tasks(problems, only, plan, store):
    """All that is to be found, in order."""
    if "workprecision" in only:
        for problem, end in problems:

            def true(key=f"truth/{problem.name}"):
                return store.known[key]

            yield Task(
                f"truth/{problem.name}",
                lambda problem=problem, end=end: truth.of(problem, end),
                0.2,
            )
            yield from workprecision.tasks(problem, end, true, plan, store)
            yield Task(
                f"ways/{problem.name}",
                lambda problem=problem, end=end, true=true: list(truth.ways(problem, end, true())),
                1.0,
            )
    if "atlas" in only:
        yield from atlas.tasks(atlas_cases.cases(plan.quick))
        yield from stiff.tasks(plan)
    if "ensemble" in only:
        yield from ensemble.tasks(plan)
    if "published" in only:
        yield from published.tasks(plan)
    if "left_out" in only:
        yield from left_out.tasks(plan)
        yield from omissions.tasks(problems, plan)


def timing(rows):
    """How often the runs were timed, and how far that scattered."""
    counts = sorted({len(row.samples) for row in rows if row.samples})
    spreads = [row.spread for row in rows if row.samples]
    middle = statistics.median(spreads) if spreads else 0.0
    note = " (the machine was busy: do not quote these times)" if middle > BUSY else ""
    return {"rounds": " .. ".join(map(str, counts)) or "no", "spread": f"{middle:.1%}{note}"}


def collected(store, problems, about):
    """All that was found so far, as the page and the tables take it."""
    rows = workprecision.rows(store, [problem.name for problem, _ in problems])
    ran = {row.scene for row in rows}
    return {
        "rows": rows,
        "problems": [(problem, end) for problem, end in problems if problem.name in ran],
        "about": about | timing(rows),
        "truths": {
            problem.name: store.known.get(f"truth/{problem.name}") for problem, _ in problems
        },
        "ways": {
            problem.name: store.known.get(f"ways/{problem.name}", []) for problem, _ in problems
        },
        "cells": atlas.cells(store),
        "stiff": stiff.lines(store),
        "ensemble": ensemble.runs(store),
        "published": published.rows(store),
        "left_out": left_out.rows(store)
        + [row for scene in omissions.scenes(store) for row in scene["rows"]],
        "omissions": omissions.scenes(store),
    }


def write(out, found):
    """The page, and a CSV file for each table; the names of the files."""
    files = {
        "stability.csv": (atlas.write_csv, found["cells"]),
        "ensemble.csv": (ensemble.write_csv, found["ensemble"]),
        "published.csv": (published.write_csv, found["published"]),
        "left_out.csv": (left_out.write_csv, found["left_out"]),
        "stiff.csv": (stiff.write_csv, found["stiff"]),
        "truths.csv": (truth.write_csv, list(page.truth_part(found))),
    }
    written = [name for name, (_, rows) in files.items() if rows]
    for name in written:
        save, rows = files[name]
        save(out / name, rows)
    if found["rows"]:
        tables.write_csv(out / "workprecision.csv", found["rows"], found["about"])
        (out / "readme_table.md").write_text(
            tables.markdown(found["rows"], [p.name for p, _ in found["problems"]])
        )
        written = ["workprecision.csv", "readme_table.md", *written]
    (out / "index.html").write_text(page.render(found, written))
    return ["index.html", *written]


def show(console, found):
    for problem, end in found["problems"]:
        console.print(tables.terminal(found["rows"], problem.name, end))
    silent = [cell for cell in found["cells"] if cell["verdict"] == "silent"]
    if found["cells"]:
        console.print(f"atlas: {len(found['cells'])} cells, wrong in silence: {len(silent)}")
    for cell in silent:
        console.print(
            f"  {cell['method']}: {cell['family']}, {cell['case']}: {cell['attitude_error']:.0e} rad"
        )
    if not machine.has_gsl():
        console.print(f"GSL is {machine.GSL_MISSING}")


def main(argv=None):
    args = arguments(argv)
    if args.thesis:
        from ..thesis import chapter

        return chapter.main(args.out)
    console, begin, plan = Console(), time.perf_counter(), PLANS[args.plan]
    try:
        problems = chosen_problems(args.scenes, plan)
    except (OSError, TypeError, ValueError) as error:
        console.print(f"Error: {error}", markup=False)
        return 2
    only = args.only or (["workprecision"] if args.scenes else PARTS)
    with_scenes = machine.fingerprint(*(problem for problem, _ in problems if problem.user))
    store = Store(args.out / f"findings-{plan.name}.jsonl", with_scenes)
    with progress_bar(console) as bar:
        missing = work_through(list(tasks(problems, only, plan, store)), store, plan, bar)
    about = machine.described() | {"plan": "; ".join(filter(None, (plan.name, missing)))}
    found = collected(store, problems, about)
    written = write(args.out, found)
    show(console, found)
    console.print(
        f"quartiles of the times apart by {found['about']['spread']}, median over the runs"
    )
    if missing:
        console.print(missing)
    console.print(
        f"{', '.join(str(args.out / name) for name in written)} in {time.perf_counter() - begin:.0f} s"
    )
    return 130 if missing.startswith("interrupted") else 0
