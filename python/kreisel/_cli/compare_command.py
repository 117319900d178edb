"""kreisel compare: a table of the errors and run times of methods."""

from __future__ import annotations

import click
from rich import box
from rich.console import JustifyMethod
from rich.table import Table as Grid

from .._analysis.compare import CompareInterrupted, Table
from .._analysis.compare import compare as compare_methods
from .._utils.quantity_attributes import MethodName
from . import time_option
from .output_files import FILE, parse_output_files
from .parsers import (
    A_METHOD,
    A_SCENE,
    METHODS,
    SEVERAL,
    convert_errors_to_usage_errors,
    method,
    parse_method_list,
    parse_number_list,
)
from .parsers import find_or_read_scene as a_scene
from .text_grid import print_text_grid

_OPTIONS = ("t", "methods", "steps", "tols", "truth", "repeats")


@click.command()
@click.argument("scene", type=str, shell_complete=A_SCENE)
@click.option(
    "--t",
    type=time_option.parse_times,
    required=True,
    metavar=time_option.METAVAR,
    help=time_option.HELP,
)
@click.option(
    "--methods",
    type=parse_method_list,
    metavar="NAME[,...]",
    shell_complete=METHODS,
    help="Names of methods; default: all that apply to the scene.",
)
@click.option(
    "--steps", type=parse_number_list, metavar=SEVERAL, help="The step of fixed-step methods."
)
@click.option(
    "--tols", type=parse_number_list, metavar=SEVERAL, help="The tolerance of adaptive methods."
)
@click.option(
    "--truth",
    type=method,
    default="taylor",
    show_default=True,
    metavar="NAME",
    shell_complete=A_METHOD,
    help="The method of the reference solution, with 20 digits, tol 1e-13 or a fine step.",
)
@click.option(
    "--repeats",
    type=int,
    default=5,
    show_default=True,
    help="Number of runs of each method; the fastest is used.",
)
@click.option("--csv", "csv_file", type=FILE, help="Write the table with all digits.")
def compare(
    scene: str,
    t: time_option.TimeSequence,
    methods: list[MethodName] | None,
    steps: list[float] | None,
    tols: list[float] | None,
    truth: MethodName,
    repeats: int,
    csv_file: str | None,
) -> None:
    """Compare the errors and run times of integration methods for one scene.

    If the comparison is interrupted, the results obtained so far are printed.
    """
    interruption: CompareInterrupted | None = None
    top = a_scene(scene)
    parse_output_files([("--csv", csv_file)], (scene,))
    with convert_errors_to_usage_errors(_OPTIONS):
        words = methods, steps or (), tols or (), truth, repeats
        try:
            table = compare_methods(top, t.to_solve_argument(), *words)
        except CompareInterrupted as error:
            table, interruption = error.table, error
    if csv_file == "-":
        click.echo(table.to_csv(), nl=False)
    else:
        if csv_file:
            table.to_csv(csv_file)
        print_text_grid(_format_comparison_table(table))
    if interruption:
        raise interruption


_LEFT = ("method", "")  # the columns of text, which are aligned to the left
_COLUMNS = ("method", "step", "tol", "ms", "steps", "attitude error [rad]", "energy error", "")


def _format_comparison_table(table: Table) -> Grid:
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
