"""The command `kreisel`: its commands, lists and pages."""

from __future__ import annotations

import errno
import importlib
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
from .._analysis.compare import format_methods_page
from .._core import version
from .._model.scene import Scene
from .._options.methods import Method, unknown_method_message
from .._options.methods import methods as known
from .._options.options import RECORDABLE, TIME
from .._results.results import Error, Interrupted
from .._utils.arguments import unknown_name_message
from .._utils.processes import replace_signal_handlers
from .._view import open_viewer
from .._view import view as open_view
from ..scenes import about, get_scene
from .fit import fit
from .options import (
    METHOD,
    SCENE,
    Command,
    Name,
    OutputFile,
    T,
    TimeSequence,
    UsageError,
    parse_number_list,
)
from .outputs import print_table, write_bytes
from .solve import resume, solve
from .sweep import sweep


@click.command(cls=Command)
@click.argument("name", required=False, type=Name(known))
@click.option(
    "--markdown",
    is_flag=True,
    help="Print a Markdown table with measured costs of a step (METHODS.md).",
)
def methods(name: str | None, markdown: bool) -> None:
    """List the methods available in this build, or describe a single method."""
    if markdown:
        click.echo(format_methods_page(known), nl=False)
    elif name is None:
        rows = [
            (m.name, _format_method_order(m), _format_method_properties(m), m.text)
            for m in known.values()
        ]
        print_table(("method", "order", "kind", "description"), rows)
    elif name not in known:
        raise UsageError(unknown_method_message(name))
    else:
        method, console = known[name], Console(markup=False, highlight=False)
        tops = {
            "rotors": method.rotors,
            "damping": method.damped,
            "friction": method.friction,
            "turning supports": method.turning,
            "shaken supports": method.shaking,
        }
        for word, value in {
            "name": method.name,
            "text": method.text,
            "order": _format_method_order(method),
            "kind": _format_method_properties(method),
            "conserves": method.conserves,
            "for": method.tops,
            "with": ", ".join(name for name, is_known in tops.items() if is_known),
            "reference": method.reference,
        }.items():
            console.print(f"{word:<10} {value}")


def _format_method_order(method: Method) -> str:
    return str(method.order) if method.order else "varies"


def _format_method_properties(method: Method) -> str:
    if method.exact:
        return "closed form"
    kinds = ("adaptive", "symplectic", "reversible", "implicit", "algebraic")
    return ", ".join(kind for kind in kinds if getattr(method, kind))


@click.command(cls=Command)
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


@click.command(cls=Command)
@click.argument("scene", type=SCENE, default="thesis")
@click.option(
    "--save",
    type=OutputFile(".html", ".htm"),
    help="Write the viewer to a file instead of opening it.",
)
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


@click.command(cls=Command)
@click.argument("scene", type=SCENE)
@T
@click.option(
    "--methods",
    type=Name(known, is_list=True),
    help="Names of methods; default: all that apply to the scene.",
)
@click.option(
    "--steps",
    type=parse_number_list,
    metavar="NUMBER[,...]",
    help="The step of fixed-step methods.",
)
@click.option(
    "--tols",
    type=parse_number_list,
    metavar="NUMBER[,...]",
    help="The tolerance of adaptive methods.",
)
@click.option(
    "--truth",
    type=METHOD,
    default="taylor",
    show_default=True,
    help="The method of the reference solution, with 20 digits, tol 1e-13 or a fine step.",
)
@click.option(
    "--repeats",
    type=int,
    default=5,
    show_default=True,
    help="Number of runs of each method; the fastest is used.",
)
@click.option("--csv", type=OutputFile(".csv"), help="Write the table with all digits.")
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


_CODES = """\b
Exit codes
  0    done
  1    a run failed, or a file could not be written; results so far are kept;
       or a package that the command needs is not installed
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
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "kreisel"
        code, message = 2, f"{error.format_message()} (see {command} --help)"
    except click.ClickException as error:
        code, message = error.exit_code, error.format_message()
    except Error as error:
        code, message = 1, str(error)
    except KeyboardInterrupt as error:
        code, message = 130, str(error) or "interrupted"
    except OSError as error:
        if error.errno == errno.EPIPE:
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


for _command in solve, resume, compare, sweep, fit, methods, scenes, quantities, view, report:
    main.add_command(_command)
