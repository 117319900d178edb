"""The command that generates the report."""

import argparse
import time
from pathlib import Path

import kreisel as kr
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ..competitors import machine
from ..parts.result_cache import ResultStore, write_atomic
from ..parts.scene_runs import turn_length
from ..parts.tasks import SIZES, estimate_minutes, run_tasks
from ..references.problems import BRIEF, HORIZONS, SHORT, load_problem, problem_of_scene
from . import page
from .contents import PARTS

TURNS = 16  # length of runs on scenes of a user, in turns
OF_OWN_SCENES = ",".join(part.name for part in PARTS if part.accepts_user_scenes)


def parse_parts(names):
    parts_by_name = {part.name: part for part in PARTS}
    for name in names.split(","):
        if name not in parts_by_name:
            raise argparse.ArgumentTypeError(
                f"unknown part {name!r}; parts are {', '.join(parts_by_name)}"
            )
    return [parts_by_name[name] for name in names.split(",")]


def make_parser():
    """Return the argument parser, and its group of mutually exclusive options."""
    parser = argparse.ArgumentParser(prog="kreisel report", description=__doc__.splitlines()[0])
    parser.add_argument(
        "scenes",
        nargs="*",
        type=Path,
        metavar="scene.toml",
        help="scenes of tops without rotors, friction and moving supports, to run for about "
        f"{TURNS} turns instead of the scenes of the report",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("report"), help="output folder (default: report)"
    )
    names = ", ".join(part.name for part in PARTS)
    parser.add_argument(
        "--only",
        type=parse_parts,
        metavar="PART[,...]",
        help=f"parts among {names} (default: all; for your own scenes {OF_OWN_SCENES})",
    )
    size = parser.add_mutually_exclusive_group()
    for name, text in (
        ("quick", f"few settings, to t = {SHORT:g}: a test of the report, not for quotation"),
        ("full", "more settings, rounds and tops"),
    ):
        size.add_argument(f"--{name}", action="store_const", dest="size", const=name, help=text)
    parser.set_defaults(size="default")
    return parser, size


class LineProgress(Progress):
    """A progress display for log files, which prints one line for each tenth of the work."""

    def advance(self, task_id, advance=1):
        (task,) = self.tasks
        before = task.percentage // 10
        super().advance(task_id, advance)
        if task.percentage // 10 > before:
            self.console.print(f"{task.percentage:3.0f} %  {task.description}", markup=False)


def make_progress(console):
    kind = Progress if console.is_terminal else LineProgress
    return kind(
        TextColumn("{task.description:44}"),
        BarColumn(bar_width=30),
        TextColumn("{task.percentage:3.0f} %"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
    )


def load_problem_of_user(file):
    """Load the scene in a file as a problem, and refuse a scene that the report cannot check."""
    scene = kr.Scene.from_toml(file)
    try:
        problem = problem_of_scene(file.stem, scene)
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from None
    if not problem.rate:
        raise ValueError(
            f"{file}: this top rests forever because it has neither angular momentum nor "
            "weight; give it one of them"
        )
    return problem


def load_problems(files, size):
    """Load the test problems in the given files, or by default the problems of the report."""
    if not files:
        ends = dict.fromkeys(BRIEF, SHORT) if size.quick else HORIZONS
        return [(load_problem(name), end) for name, end in ends.items()]
    problems = {}
    for file in files:
        if file.stem in problems:
            raise ValueError(f"{file}: two scenes have the name {file.stem!r}; rename one file")
        problems[file.stem] = load_problem_of_user(file)
    return [(problem, TURNS * turn_length(problem)) for problem in problems.values()]


def run_parts(out, problems, parts, size, console):
    """Run all tasks, and return their results."""
    own = [problem for problem, _ in problems if problem.user]
    store = ResultStore(out / f"findings-{size.name}.jsonl", machine.fingerprint(*own))
    tasks = [task for part in parts for task in part.list_tasks(problems, size, store)]
    console.print(f"The report takes about {estimate_minutes(tasks, store)} min on this machine.")
    with make_progress(console) as bar:
        run_tasks(tasks, store, bar)
    return store


def write_report(out, findings, metadata):
    """Write the HTML page and the tables, and return the names of all files."""
    texts = {"index.html": page.render_page(findings, metadata)}
    for part, part_findings in findings:
        texts |= dict(part.list_files(part_findings, metadata))
    for name, text in texts.items():
        write_atomic(out / name, text)
    return list(texts)


def print_summary(console, findings):
    for part, part_findings in findings:
        for line in part.terminal_lines(part_findings):
            console.print(line)
    if not machine.has_gsl():
        console.print(f"GSL is {machine.GSL_MISSING}")


def make_report(options):
    """Generate the report, and return the exit status of the program."""
    console, begin, size = Console(), time.perf_counter(), SIZES[options.size]
    try:
        problems = load_problems(options.scenes, size)
    except (OSError, TypeError, ValueError) as error:
        console.print(f"Error: {error}", markup=False)
        return 2
    parts = options.only or (parse_parts(OF_OWN_SCENES) if options.scenes else PARTS)
    try:
        store = run_parts(options.out, problems, parts, size, console)
    except KeyboardInterrupt:
        console.print("interrupted; run again to continue")
        return 130
    metadata = machine.describe_machine() | {"size": size.name}
    findings = [(part, own) for part in PARTS if (own := part.load_findings(problems, store))]
    files = write_report(options.out, findings, metadata)
    print_summary(console, findings)
    names = ", ".join(str(options.out / name) for name in files)
    console.print(f"{names} in {time.perf_counter() - begin:.0f} s")
    return 0
