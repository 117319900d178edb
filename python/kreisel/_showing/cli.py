"""The command line: the words of the Python package."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as File
from typing import TypedDict, Unpack

import click
from rich import box
from rich.console import Console, JustifyMethod
from rich.progress import Progress
from rich.table import Table as Grid

from .._analysis.compare import CompareInterrupted, Table
from .._analysis.compare import compare as compared
from .._analysis.costs import page
from .._core import version
from .._ground.files import refuse_no_place
from .._ground.names import MethodName, QuantityName
from .._model.scene import Scene
from .._recording.path import Error, Interrupted, Path
from .._recording.tables import as_csv, columns
from .._request.methods import Method, unknown
from .._request.methods import methods as known
from .._verbs.solve import solve as solved
from ..scenes import about, named
from .view import view as viewed

_FILE = click.Path(dir_okay=False, allow_dash=True)
_SEVERAL = "NUMBER[,...]"
_REPORT = "validation.__main__"


class _Words(TypedDict):
    """The words of kreisel.solve that the command line has."""

    method: MethodName
    step: float | None
    tol: float | None
    error: float | None
    every: int | None
    max_steps: int
    want: list[QuantityName] | None


def _numbers(words: str) -> list[float]:
    try:
        return [float(word) for word in words.split(",")]
    except ValueError:
        raise click.BadParameter(
            f"{words!r} is not a number, nor numbers with commas between them"
        ) from None


def _names(words: str) -> list[str]:
    return words.split(",")


def _scene(word: str) -> Scene:
    if word in about:
        return named(word)
    try:
        with warnings.catch_warnings(record=True) as said:
            scene = Scene.from_toml(word)
        for warning in said:
            click.echo(f"Warning: {warning.message}", err=True)
        return scene
    except FileNotFoundError:
        names = ", ".join(about)
        raise click.BadParameter(
            f"there is no file {word!r}, nor a scene of that name; the scenes are {names}"
        ) from None
    except (OSError, TypeError, ValueError) as error:
        raise click.BadParameter(str(error)) from None


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(version, prog_name="kreisel")
def main() -> None:
    """The motion of spinning tops. A SCENE is a TOML file, or the name of one of kreisel's own."""


def _one_or_more(t: list[float]) -> float | list[float]:
    return t[0] if len(t) == 1 else t


@contextmanager
def _one_line() -> Iterator[None]:
    """What a disk refuses, said in one line."""
    try:
        yield
    except OSError as error:
        raise click.ClickException(str(error)) from None


def _refuse_no_place(*files: str | None) -> None:
    """A file that could not be written is refused before anything runs."""
    with _one_line():
        for file in files:
            if file and file != "-":
                refuse_no_place(file)


def _save(path: Path, csv_file: str | None, npz_file: str | None) -> None:
    if csv_file == "-":
        click.echo(as_csv(columns(path)), nl=False)
    elif csv_file:
        path.to_csv(csv_file)
    if npz_file:
        path.save(npz_file if npz_file.endswith(".npz") else f"{npz_file}.npz")


def _show(path: Path) -> None:
    stats = path.stats
    click.echo(
        f"{len(path)} states by {path.method}: {stats.steps} steps, {stats.evaluations} evaluations"
    )
    if not len(path):
        return
    grid = Grid("", "first", "last", box=box.SIMPLE_HEAD)
    for name, values in columns(path).items():
        grid.add_row(name, f"{values[0]: .15g}", f"{values[-1]: .15g}")
    Console().print(grid)
    if path.want is None:
        click.echo(f"energy error {path.energy_error:.2g}")
    if path.plan.choice:
        click.echo(str(path.plan.choice))


def _solved(scene: Scene, t: list[float], how: _Words) -> Path:
    """The path; how far it has come is shown where somebody watches."""
    console = Console(stderr=True)
    if not console.is_terminal:
        return solved(scene, _one_or_more(t), **how)
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task("t", total=abs(t[-1]))
        return solved(
            scene, _one_or_more(t), progress=lambda at: bar.update(task, completed=abs(at)), **how
        )


@main.command()
@click.argument("scene", type=_scene)
@click.option(
    "--t",
    type=_numbers,
    required=True,
    metavar=_SEVERAL,
    help="The time to reach, or the times wanted.",
)
@click.option("--method", default="auto", show_default=True, help="See `kreisel methods`.")
@click.option("--step", type=float, help="For methods of fixed step.")
@click.option("--tol", type=float, help="For adaptive methods.")
@click.option(
    "--error", type=float, help="For the method geometric: the attitude error allowed [rad]."
)
@click.option("--every", type=int, help="Record each so many steps.")
@click.option("--max-steps", type=int, default=0, help="Give up after so many steps.")
@click.option(
    "--want",
    type=_names,
    metavar="NAME[,...]",
    help="Quantities instead of states, as nutation,energy.",
)
@click.option(
    "--csv",
    "csv_file",
    type=_FILE,
    help="Write the states, or what is wanted; - for standard output.",
)
@click.option(
    "--npz",
    "npz_file",
    type=_FILE,
    help="Write the path, for kreisel.load; numpy.load reads its arrays by their names.",
)
def solve(
    scene: Scene, t: list[float], csv_file: str | None, npz_file: str | None, **how: Unpack[_Words]
) -> None:
    """The motion of a scene. What a failed or interrupted run has reached is written too."""
    stopped: Error | Interrupted | None = None
    _refuse_no_place(csv_file, npz_file)
    try:
        path = _solved(scene, t, how)
    except (Error, Interrupted) as error:
        path, stopped = error.path, error
    except (MemoryError, TypeError, ValueError) as error:
        raise click.ClickException(str(error)) from None
    with _one_line():
        _save(path, csv_file, npz_file)
    if csv_file != "-":
        _show(path)
    if stopped:
        click.echo(f"Error: {stopped}", err=True)
        sys.exit(130 if isinstance(stopped, Interrupted) else 1)


@main.command()
@click.argument("scene", type=_scene)
@click.option(
    "--t",
    type=_numbers,
    required=True,
    metavar=_SEVERAL,
    help="The time to reach, or the times wanted.",
)
@click.option(
    "--methods",
    type=_names,
    metavar="NAME[,...]",
    help="Which; all that apply to the body if left out.",
)
@click.option("--steps", type=_numbers, metavar=_SEVERAL, help="For methods of fixed step.")
@click.option("--tols", type=_numbers, metavar=_SEVERAL, help="For adaptive methods.")
@click.option(
    "--truth",
    default="taylor",
    show_default=True,
    help="A method, taken with 20 digits, tol 1e-13 or a fine step.",
)
@click.option("--repeats", type=int, default=5, show_default=True, help="The fastest counts.")
@click.option("--csv", "csv_file", type=_FILE, help="Write the table with all digits.")
def compare(
    scene: Scene,
    t: list[float],
    methods: list[MethodName] | None,
    steps: list[float] | None,
    tols: list[float] | None,
    truth: MethodName,
    repeats: int,
    csv_file: str | None,
) -> None:
    """Error against run time, method by method. What an interrupted comparison has is shown too."""
    stopped: CompareInterrupted | None = None
    _refuse_no_place(csv_file)
    try:
        table = compared(scene, _one_or_more(t), methods, steps or (), tols or (), truth, repeats)
    except CompareInterrupted as error:
        table, stopped = error.table, error
    except (Error, MemoryError, TypeError, ValueError) as error:
        raise click.ClickException(str(error)) from None
    if csv_file:
        with _one_line():
            table.to_csv(csv_file)
    Console().print(_in_columns(table))
    if stopped:
        click.echo(f"Error: {stopped}", err=True)
        sys.exit(130)


_LEFT = ("method", "")  # the columns of words
_COLUMNS = ("method", "step", "tol", "ms", "steps", "attitude error [rad]", "energy error", "")


def _in_columns(table: Table) -> Grid:
    grid = Grid(box=box.SIMPLE_HEAD)
    for name in _COLUMNS:
        justify: JustifyMethod = "left" if name in _LEFT else "right"
        grid.add_column(name, justify=justify, no_wrap=name == "method")
    for row in table:
        setting = ("" if x is None else f"{x:g}" for x in (row.step, row.tol))
        errors = f"{row.attitude_error:.1e}", f"{row.energy_error:.1e}"
        grid.add_row(
            row.method, *setting, f"{1e3 * row.seconds:.3g}", str(row.steps), *errors, row.failure
        )
    return grid


@main.command()
@click.argument("name", required=False)
@click.option(
    "--markdown", is_flag=True, help="METHODS.md: a table with the cost of a step, measured now."
)
def methods(name: str | None, markdown: bool) -> None:
    """The methods of this build, or all that is known of one."""
    console = Console()
    if markdown:
        click.echo(page(known), nl=False)
        return
    if name is not None:
        if name not in known:
            raise click.ClickException(unknown(name))
        method = known[name]
        for word, value in {
            "name": name,
            "text": method.text,
            "order": _order(method),
            "kind": _kind(method),
            "conserves": method.conserves,
            "for": method.tops,
            "reference": method.reference,
        }.items():
            console.print(f"{word:<10} {value}", highlight=False)
        return
    grid = Grid(box=box.SIMPLE_HEAD)
    for column in ("method", "order", "kind", "what it is"):
        grid.add_column(column, no_wrap=column == "method")
    for method in known.values():
        grid.add_row(method.name, _order(method), _kind(method), method.text)
    console.print(grid)


def _order(method: Method) -> str:
    return str(method.order) if method.order else "varies"


def _kind(method: Method) -> str:
    kinds = ("adaptive", "symplectic", "reversible", "implicit", "algebraic")
    return ", ".join(kind for kind in kinds if getattr(method, kind))


@main.command()
@click.argument("scene", type=_scene, default="thesis")
@click.option(
    "--save",
    "file",
    type=click.Path(dir_okay=False),
    help="Write the page to a file, and open nothing.",
)
def view(scene: Scene, file: str | None) -> None:
    """The top in a browser: to turn, to change, to compare methods on."""
    try:
        page = viewed(scene, open=file is None)
    except FileNotFoundError as error:
        raise click.ClickException(str(error)) from None
    if file:
        with _one_line():
            page.save(file)


@main.command(
    add_help_option=False,
    options_metavar="[OPTIONS] [SCENE.toml ...]",
    context_settings={"ignore_unknown_options": True},
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
def report(arguments: tuple[str, ...]) -> None:
    """Accuracy, speed and stability of every method, on the report's scenes or on SCENE.toml files;
    --help says more. Its machinery is validation/, in the source tree."""
    here = File.cwd()
    if not (here / "validation/__main__.py").is_file():
        raise click.ClickException(
            "the report is made in the top folder of the source tree, which has validation/; "
            f"{here} has not. Get the source, and run `make report` there"
        )
    sys.path.insert(0, str(here))
    try:
        machinery = importlib.import_module(_REPORT)
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("validation"):
            raise
        raise click.ClickException(
            f"the report needs {error.name}: pip install 'kreisel[report]'"
        ) from None
    sys.exit(machinery.main(list(arguments)))
