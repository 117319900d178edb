"""kreisel view and kreisel report: pages for the browser."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path as File

import click

from .._model.scene import Scene
from .._view import open_page
from .._view import view as viewed
from .output_files import FILE, check_outputs
from .parsers import A_SCENE, UsageError, translate_errors
from .parsers import scene as a_scene

_REPORT = "validation.__main__"


@click.command()
@click.argument("scene", type=a_scene, default="thesis", shell_complete=A_SCENE)
@click.option("--save", "file", type=FILE, help="Write the page to a file, and open nothing.")
def view(scene: Scene, file: str | None) -> None:
    """Open the scene in the browser page.

    The page turns and changes the top, and compares methods on it. It is one HTML file without
    further needs. Its place is printed; without a browser (or a display) open that file elsewhere,
    or write it to a place of your own with --save.
    """
    check_outputs([("view --save", file)])
    with translate_errors(()):
        page = viewed(scene, open=False)
    try:
        text = page.html
    except FileNotFoundError as error:
        raise click.ClickException(str(error)) from None
    if file == "-":
        click.echo(text, nl=False)
    elif file:
        page.save(file)
    else:
        place, shown = open_page(page)
        click.echo(f"the page is {place}" + ("" if shown else "; no browser was found to open it"))


@click.command(
    add_help_option=False,
    options_metavar="[OPTIONS] [SCENE.toml ...]",
    context_settings={"ignore_unknown_options": True},
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED, metavar="")
@click.pass_context
def report(ctx: click.Context, arguments: tuple[str, ...]) -> None:
    """Accuracy, speed and stability of all methods.

    They are measured on the report's scenes, or on SCENE.toml files. The report is made in the top
    folder of the source tree, by the machinery in validation/, and takes minutes; there --help
    tells these options in full:

    \b
    --quick, --full     fewer runs, or more
    --thesis            the chapter on the thesis alone
    --only PART[,...]   these parts alone
    --out FOLDER        where to, in place of report/
    """
    here = File.cwd()
    asks = not {"-h", "--help"}.isdisjoint(arguments)
    if not (here / "validation/__main__.py").is_file():
        if asks:
            click.echo(ctx.get_help())
            return
        raise UsageError(
            "the report is made in the top folder of the source tree, which has validation/; "
            f"{here} has not. Get the source, and run `make report` there"
        )
    sys.path.insert(0, str(here))
    try:
        machinery = importlib.import_module(_REPORT)
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("validation"):
            raise
        if asks:
            click.echo(ctx.get_help())
            return
        raise click.ClickException(
            f"the report needs {error.name}: pip install 'kreisel[report]'"
        ) from None
    ctx.exit(machinery.main(list(arguments)) or 0)
