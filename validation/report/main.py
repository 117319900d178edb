"""Accuracy, speed and stability of every method: a page and its tables, made of the parts.

python -m validation.report [scene.toml ...] [--quick | --full] [--only PART[,...]] [--out report]
"""

import argparse
import time
from pathlib import Path

import kreisel as kr
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ..competitors import machine
from ..parts.budget import BUDGETS, work_through
from ..parts.result_cache import Store, put_whole
from ..parts.scene_runs import turn_length
from ..references.problems import HORIZONS, SHORT, load_problem, problem_of_scene
from . import page
from .contents import PARTS

TURNS = 16  # to which a user's own scene is run
OF_OWN_SCENES = ",".join(part.name for part in PARTS if part.takes_own_scenes)


def named_parts(names):
    known = {part.name: part for part in PARTS}
    for name in names.split(","):
        if name not in known:
            raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(known)}")
    return [known[name] for name in names.split(",")]


def command_line():
    """Gives the parser, and the group of options of which only one may be given."""
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
    names = ", ".join(part.name for part in PARTS)
    parser.add_argument(
        "--only",
        type=named_parts,
        metavar="PART[,...]",
        help=f"of {names} (default: all; for your own scenes {OF_OWN_SCENES})",
    )
    size = parser.add_mutually_exclusive_group()
    for name, text in (
        ("quick", f"few settings, to t = {SHORT:g}: shows that all works, no figures to quote"),
        ("full", "as long as it takes"),
    ):
        size.add_argument(f"--{name}", action="store_const", dest="budget", const=name, help=text)
    parser.set_defaults(budget="default")
    return parser, size


class InLines(Progress):
    """The progress where no terminal shows a bar: a line for each tenth of the work."""

    def advance(self, task_id, advance=1):
        (task,) = self.tasks
        before = task.percentage // 10
        super().advance(task_id, advance)
        if task.percentage // 10 > before:
            self.console.print(f"{task.percentage:3.0f} %  {task.description}", markup=False)


def progress_bar(console):
    kind = Progress if console.is_terminal else InLines
    return kind(
        TextColumn("{task.description:44}"),
        BarColumn(bar_width=30),
        TextColumn("{task.percentage:3.0f} %"),
        TimeElapsedColumn(),
        console=console,
    )


def chosen_problems(files, budget):
    """Gives each problem with where it ends: those of the files, or those of the report."""
    if not files:
        return [
            (load_problem(name), SHORT if budget.quick else end) for name, end in HORIZONS.items()
        ]
    problems = [problem_of_scene(file.stem, kr.Scene.from_toml(file)) for file in files]
    names = [problem.name for problem in problems]
    for file, problem in zip(files, problems, strict=True):
        if not problem.rate:
            raise ValueError(
                f"{file}: this top rests for ever: it has neither angular momentum nor weight; "
                "give it one of them"
            )
        if names.count(problem.name) > 1:
            raise ValueError(
                f"{file}: there are two scenes of the name {problem.name!r}; the report calls them "
                "by their files' names"
            )
    return [(problem, TURNS * turn_length(problem)) for problem in problems]


def find(out, problems, parts, budget, console):
    """Makes the findings of the parts; gives the store that keeps them, and what is missing."""
    own = [problem for problem, _ in problems if problem.user]
    store = Store(out / f"findings-{budget.name}.jsonl", machine.fingerprint(*own))
    tasks = [task for part in parts for task in part.tasks(problems, budget, store)]
    with progress_bar(console) as bar:
        return store, work_through(tasks, store, budget, bar)


def write(out, findings, about):
    """Writes the page and the tables; gives the names of the files."""
    texts = {"index.html": page.render(findings, about)}
    for part, found in findings:
        texts |= dict(part.files(found, about))
    for name, text in texts.items():
        put_whole(out / name, text)
    return list(texts)


def show(console, findings):
    for part, found in findings:
        for line in part.told(found):
            console.print(line)
    if not machine.has_gsl():
        console.print(f"GSL is {machine.GSL_MISSING}")


def make(asked):
    """Makes the report that the command line asks for; the code to exit with."""
    console, begin, budget = Console(), time.perf_counter(), BUDGETS[asked.budget]
    try:
        problems = chosen_problems(asked.scenes, budget)
    except (OSError, TypeError, ValueError) as error:
        console.print(f"Error: {error}", markup=False)
        return 2
    parts = asked.only or (named_parts(OF_OWN_SCENES) if asked.scenes else PARTS)
    store, missing = find(asked.out, problems, parts, budget, console)
    about = machine.describe_machine() | {"budget": "; ".join(filter(None, (budget.name, missing)))}
    known = [(part, part.found(problems, store)) for part in PARTS]
    findings = [(part, found) for part, found in known if found]
    written = write(asked.out, findings, about)
    show(console, findings)
    if missing:
        console.print(missing)
    names = ", ".join(str(asked.out / name) for name in written)
    console.print(f"{names} in {time.perf_counter() - begin:.0f} s")
    return 130 if missing.startswith("interrupted") else 0


def main(argv=None):
    parser, _ = command_line()
    return make(parser.parse_args(argv))
