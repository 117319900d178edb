"""The command `kreisel`: its commands, lists and pages."""

from __future__ import annotations

import errno
import importlib
import io
import os
import re
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path as File
from typing import Any

import click
from rich.console import Console

from .._analysis.compare import compare as compare_methods
from .._core import version
from .._fit.fit import fit as estimate
from .._fit.records import Record
from .._fit.result import Fit
from .._model.scene import Scene
from .._options.methods import Method, unknown_method_message
from .._options.methods import methods as known
from .._options.options import RECORDABLE, TIME
from .._results.results import Error, Interrupted
from .._score.score import score as score_results
from .._utils.arguments import spell_as_options, unknown_name_message
from .._utils.processes import replace_signal_handlers
from .._view import open_viewer
from .._view import view as open_view
from ..scenes import about, get_scene
from .options import (
    PICTURES,
    SCENE,
    InputFile,
    Name,
    TimeSequence,
    UsageError,
    command,
    print_table,
    write_bytes,
)
from .solve import resume, solve
from .sweep import sweep


@command()
@click.argument("name", required=False, type=Name(known))
def methods(name: str | None) -> None:
    """List the methods available in this build, or describe a single method."""
    if name is None:
        rows = [(m.name, *_describe_order_and_kind(m), m.text) for m in known.values()]
        print_table(("method", "order", "kind", "description"), rows)
    elif name not in known:
        raise UsageError(unknown_method_message(name))
    else:
        method, console = known[name], Console(markup=False, highlight=False)
        order, kind = _describe_order_and_kind(method)
        words = {"name": name, "text": method.text, "order": order, "kind": kind}
        words |= {"conserves": method.conserves, "for": method.tops}
        tops = {"rotors": method.rotors, "damping": method.damped, "friction": method.friction}
        tops |= {"turning supports": method.turning, "shaken supports": method.shaking}
        tops |= {"a gravity gradient": method.gradient}
        words["with"] = ", ".join(word for word, is_possible in tops.items() if is_possible)
        for word, value in {**words, "reference": method.reference}.items():
            console.print(f"{word:<10} {value}")


def _describe_order_and_kind(method: Method) -> tuple[str, str]:
    kinds = ("adaptive", "symplectic", "reversible", "implicit", "algebraic")
    properties = ", ".join(kind for kind in kinds if getattr(method, kind))
    order = str(method.order) if method.order else "varies"
    return order, "closed form" if method.exact else properties


@command()
@click.argument("name", required=False, type=Name(about))
def scenes(name: str | None) -> None:
    """List all named scenes, or print the one called NAME in TOML format."""
    if name is None:
        print_table(("scene", "description"), list(about.items()))
    elif name not in about:
        raise UsageError(unknown_name_message("scene", name, about))
    else:
        click.echo(f"# {about[name]}\n{get_scene(name).to_toml()}", nl=False)


@click.command()
def quantities() -> None:
    """List the quantities accepted by --want."""
    rows = [(q.name, q.dimension, q.text) for q in (TIME, *RECORDABLE.values())]
    print_table(("quantity", "unit", "description"), rows)


@command("view cusps --save top.html")
@click.argument("scene", type=SCENE, default="thesis")
def view(scene: Scene, save: str | None) -> None:
    """Open an interactive viewer of the scene in a browser.

    The viewer shows the moving top, lets you change it, and compares methods. The viewer is a
    single, self-contained HTML file. Its location is printed. If no browser is available, save the
    page with --save and open it on another computer.
    """
    page = open_view(scene, open=False)
    if save is not None:
        write_bytes(save, page.html.encode())
    else:
        place, is_open = open_viewer(page)
        click.echo(f"wrote {place}" + ("" if is_open else "; no browser was found to open it"))


@click.command(
    add_help_option=False,
    options_metavar="[OPTIONS] [SCENE.toml ...]",
    context_settings={"ignore_unknown_options": True},
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED, metavar="")
@click.pass_context
def report(ctx: click.Context, arguments: tuple[str, ...]) -> None:
    """Report the accuracy, speed and stability of all methods.

    The measurements use standard scenes unless SCENE.toml files are given. Run this command in the
    root folder of the source tree, which contains the programs that it needs. The report takes
    minutes. In the source tree, --help describes these options in full:

    \b
    --quick, --full     fewer runs, or more runs
    --thesis            only the chapter on the thesis
    --only PART[,...]   only these parts
    --out FOLDER        the output folder; default: report/
    """
    folder = File.cwd()
    has_help_option = not {"-h", "--help"}.isdisjoint(arguments)
    if not (folder / "validation/__main__.py").is_file():
        if has_help_option:
            click.echo(ctx.get_help())
            return
        raise UsageError(
            f"the report needs the source tree, but {folder} has no folder validation/: run `make "
            "report` in the top folder of the source"
        )
    sys.path.insert(0, str(folder))
    try:
        machinery = importlib.import_module("validation.__main__")
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("validation"):
            raise
        if has_help_option:
            click.echo(ctx.get_help())
            return
        raise click.ClickException(
            f"the report needs {error.name}: pip install 'kreisel[report]'"
        ) from None
    ctx.exit(machinery.main(list(arguments)) or 0)


@command("compare thesis --t 10 --steps 0.01 --tols 1e-9")
@click.argument("scene", type=SCENE)
def compare(
    scene: Scene,
    t: TimeSequence,
    steps: list[float] | None,
    tols: list[float] | None,
    csv: str | None,
    **words: Any,
) -> None:
    """Compare the errors and run times of integration methods for one scene.

    If the comparison is interrupted, the results obtained so far are printed.
    """
    interruption: Interrupted | None = None
    try:
        table = compare_methods(
            scene, t.to_solve_argument(), steps=steps or (), tols=tols or (), **words
        )
    except Interrupted as error:
        table, interruption = error.result, error
    if csv is not None:
        write_bytes(csv, table.to_csv().encode())
    if csv != "-":
        head = ("method", "step", "tol", "ms", "steps", "attitude error [rad]", "energy error", "")
        rows = []
        for row in table:
            setting = ("" if x is None else f"{x:g}" for x in (row.step, row.tol))
            errors = f"{row.attitude_error:.1e}", f"{row.energy_error:.1e}"
            cost = f"{1e3 * row.seconds:.3g}", str(row.steps)
            rows.append((row.method, *setting, *cost, *errors, row.failure))
        print_table(head, rows, head[1:-1])
    if interruption:
        raise interruption


def _parse_assignments(option: str, texts: tuple[str, ...]) -> dict[str, str]:
    """Parse the values QUANTITY=VALUE of a repeated option."""
    values: dict[str, str] = {}
    for text in texts:
        name, _, value = text.partition("=")
        if not (name and value):
            raise UsageError(f"{option} {text}: write QUANTITY=VALUE")
        if name in values:
            raise UsageError(f"{option} {text}: {name} is already given")
        values[name] = value
    return values


def _check_picture(plot: str | None) -> str:
    """Return the format of a picture; refuse others, and fail early if matplotlib is missing."""
    if plot is None:
        return ""
    importlib.import_module("kreisel._plot.charts")
    ending = File(plot).suffix.lower()
    if ending in PICTURES:
        return ending[1:]
    if plot != "-" and not (File(plot).exists() and not File(plot).is_file()):
        raise UsageError(f"--plot writes .png, .svg or .pdf, not {plot}")
    return "png"


def _write_picture(plot: str, form: str, axes: Any) -> None:
    picture = io.BytesIO()  # savefig would leave an incomplete file on a full disk
    axes.figure.savefig(picture, format=form)
    write_bytes(plot, picture.getvalue())


@command("fit record.csv top.toml --sigma 0.01 --plot fit.png")
@click.argument("record", type=InputFile())
@click.argument("scene", type=SCENE)
def fit(
    record: str,
    scene: Scene,
    column: tuple[str, ...],
    time: str,
    sigma: tuple[str, ...],
    instrument: Any,
    point: list[float] | None,
    degrees: bool | None,
    save: str | None,
    csv: str | None,
    plot: str | None,
    **words: Any,
) -> None:
    """Estimate a body and its initial state from the CSV file RECORD, starting from SCENE.

    If the motion of SCENE disagrees with the record, the initial guess is computed from the record.
    If the fit is interrupted, the best fit found so far is printed.
    """
    form = _check_picture(plot)
    columns: dict[str, str | list[str]] = {
        name: value.split(",") if "," in value else value
        for name, value in _parse_assignments("--column", column).items()
    }
    deviations: float | dict[str, float] | None = None
    try:
        if len(sigma) == 1 and "=" not in sigma[0]:
            deviations = float(sigma[0])
        elif sigma:
            pairs = _parse_assignments("--sigma", sigma).items()
            deviations = {name: float(value) for name, value in pairs}
    except ValueError:
        raise UsageError(f"--sigma {' '.join(sigma)}: the value must be a number") from None
    try:
        given = record, columns or None, time, deviations, instrument or ()
        with spell_as_options({"columns": "--column", "free": "--instrument"}):
            measurements = Record.from_csv(*given, degrees=degrees, point=point)
    except OSError as error:
        raise UsageError(str(error)) from None
    interruption: Interrupted | None = None
    try:
        result: Fit | None = estimate(scene, measurements, **words)
    except Interrupted as error:
        result, interruption = error.result, error
    if result is not None:
        if "-" not in (save, csv, plot):
            click.echo(str(result))
        if save is not None:
            write_bytes(save, result.to_toml().encode())
        if csv is not None:
            rows = [
                f"{name},{result.values[name]!r},{result.error[name]!r},{unit}\n"
                for name, unit in zip(result.names, result.units, strict=True)
            ]
            write_bytes(csv, ("parameter,value,error,unit\n" + "".join(rows)).encode())
        if plot is not None:
            _write_picture(plot, form, result.plot())
    if interruption:
        raise interruption
    if result is not None and not result.has_converged:
        raise click.exceptions.Exit(1)


@command("score tumble.csv --plot score.png")
@click.argument("results", type=InputFile(), nargs=-1, required=True)
def score(
    results: tuple[str, ...],
    case: str | None,
    scene: Scene | None,
    level: str,
    plot: str | None,
    **words: Any,
) -> None:
    """Compare the motion that another program wrote to the CSV file RESULTS with the true one.

    Several files, computed with different steps, also give the order of convergence. The columns
    are t, qw, qx, qy, qz, wx, wy, wz, or have similar names; wx, wy, wz may be missing. The exit
    code is 1 if the attitude error exceeds the level.
    """
    if case is not None and scene is not None:
        raise UsageError("give either --case or --scene, not both")
    form = _check_picture(plot)
    limit: str | float = level
    with suppress(ValueError):
        limit = float(level)
    try:
        found = score_results(
            results if len(results) > 1 else results[0], case or scene, level=limit, **words
        )
    except OSError as error:
        raise UsageError(str(error)) from None
    if plot != "-":
        click.echo(str(found))
    if plot is not None:
        _write_picture(plot, form, found.plot())
    if not found.is_within:
        raise click.exceptions.Exit(1)


_CODES = """\b
Exit codes
  0    done
  1    a run failed, or a file could not be written; results so far are kept;
       or a package that the command needs is not installed;
       or a score is above its level
  2    invalid arguments; nothing was computed
  130  stopped by Ctrl-C or SIGTERM; results so far are kept"""


class _MainCommandGroup(click.Group):
    def make_context(self, *args: Any, **more: Any) -> click.Context:
        with print_errors_on_one_line():
            return super().make_context(*args, **more)

    def invoke(self, ctx: click.Context) -> None:
        stop = signal.default_int_handler  # an ignored SIGTERM stays ignored
        with print_errors_on_one_line(), replace_signal_handlers([signal.SIGTERM], stop, True):
            super().invoke(ctx)


@contextmanager
def print_errors_on_one_line() -> Iterator[None]:
    """Return a context manager that prints an exception as a single line and sets the exit code."""
    try:
        yield
    except click.exceptions.NoArgsIsHelpError:
        raise
    except click.ClickException as error:
        code, message = error.exit_code, error.format_message()
        if isinstance(error, click.UsageError):
            command = error.ctx.command_path if error.ctx else "kreisel"
            message += f" (see {command} --help)"
    except KeyboardInterrupt as error:
        code, message = 130, str(error) or "interrupted"
    except (Error, OSError) as error:
        if isinstance(error, OSError) and error.errno == errno.EPIPE:
            raise
        code, message = 1, str(error)
    else:
        return
    if sys.stdout is not None:
        try:
            sys.stdout.flush()
        except OSError:  # the interpreter would report the same error again on exit
            with suppress(OSError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    message = re.sub(r"\[Errno \d+\] ", "", message)
    click.echo(f"Error: {message}", err=True)
    raise click.exceptions.Exit(code)


@click.group(
    "kreisel",
    cls=_MainCommandGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=_CODES,
)
@click.version_option(version, prog_name="kreisel")
def main() -> None:
    """Compute the motion of spinning tops.

    A SCENE is a TOML file, the name of a scene (see `kreisel scenes`), or - for TOML from standard
    input. Use - as the file name to write to standard output.
    """


for _command in (
    solve,
    resume,
    compare,
    sweep,
    fit,
    score,
    methods,
    scenes,
    quantities,
    view,
    report,
):
    main.add_command(_command)
