"""kreisel view and kreisel report: commands that write HTML for the browser."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path as File

import click

from .._view import open_viewer
from .._view import view as open_view
from .output_files import FILE, parse_output_files
from .parsers import A_SCENE, UsageError, convert_errors_to_usage_errors
from .parsers import find_or_read_scene as a_scene

_REPORT = "validation.__main__"


@click.command()
@click.argument("scene", type=str, default="thesis", shell_complete=A_SCENE)
@click.option("--save", "file", type=FILE, help="Write the viewer to a file instead of opening it.")
def view(scene: str, file: str | None) -> None:
    """Open an interactive viewer of the scene in a browser.

    The viewer shows the moving top, lets you change it, and compares methods. The viewer is a
    single, self-contained HTML file. Its location is printed. If no browser is available, save the
    page with --save and open it on another computer.
    """
    top = a_scene(scene)
    parse_output_files([("view --save", file)], (scene,))
    with convert_errors_to_usage_errors(()):
        page = open_view(top, open=False)
    text = page.html
    if file == "-":
        click.echo(text, nl=False)
    elif file:
        page.save(file)
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
        machinery = importlib.import_module(_REPORT)
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
