"""`kreisel fit`."""

from __future__ import annotations

import io
from importlib import import_module
from typing import cast

import click

from .._fit.fit import LOSSES, FitInterrupted
from .._fit.fit import fit as estimate
from .._fit.minimize import LossName
from .._fit.parameters import FREE, FreeName
from .._fit.records import INSTRUMENT, InstrumentName, Record
from .._fit.result import Fit
from .._model.scene import Scene
from .options import (
    A_SCENE,
    FILE,
    UsageError,
    choose_picture_format,
    convert_errors_to_usage_errors,
    convert_missing_package_errors,
    make_list_completer,
    parse_name_list,
    parse_number_list,
    parse_output_files,
)
from .options import find_or_read_scene as a_scene
from .outputs import write_bytes

_OPTIONS = ("degrees", "free", "sigma", "loss", "pieces", "point", "max_evaluations")
_NOT_CONVERGED = 1  # exit code


def _split_quantity_and_value(option: str, words: str) -> tuple[str, str]:
    name, equals, value = words.partition("=")
    if not (equals and name and value):
        raise UsageError(f"{option} {words}: write QUANTITY=VALUE")
    return name, value


def _parse_quantity_columns(options: tuple[str, ...]) -> dict[str, str | list[str]] | None:
    """Return a dict that maps quantities to column names, or None if --column is not given."""
    columns: dict[str, str | list[str]] = {}
    for words in options:
        quantity, value = _split_quantity_and_value("--column", words)
        if quantity in columns:
            raise UsageError(f"--column {words}: {quantity} is already given")
        columns[quantity] = value.split(",") if "," in value else value
    return columns or None


def _parse_sigma_options(options: tuple[str, ...]) -> float | dict[str, float] | None:
    """Return one standard deviation for all quantities, or a separate one for each."""
    try:
        if len(options) == 1 and "=" not in options[0]:
            return float(options[0])
        deviations: dict[str, float] = {}
        for words in options:
            quantity, value = _split_quantity_and_value("--sigma", words)
            if quantity in deviations:
                raise UsageError(f"--sigma {words}: {quantity} is already given")
            deviations[quantity] = float(value)
        return deviations or None
    except ValueError:
        raise UsageError(f"--sigma {' '.join(options)}: the value must be a number") from None


@click.command()
@click.argument("record", type=click.Path())
@click.argument("scene", type=str, shell_complete=A_SCENE)
@click.option(
    "--free",
    type=parse_name_list,
    default="start,moments",
    show_default=True,
    metavar="NAME[,...]",
    shell_complete=make_list_completer(FREE),
    help="The parameters to estimate.",
)
@click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="QUANTITY=NAME[,...]",
    help="The columns of a quantity; default: all columns, by the names of components.",
)
@click.option("--time", default="t", show_default=True, help="The column of times.")
@click.option(
    "--sigma",
    multiple=True,
    metavar="[QUANTITY=]NUMBER",
    help="Standard deviation of the measurements; default: estimated from the residuals.",
)
@click.option(
    "--instrument",
    type=parse_name_list,
    default="",
    metavar="NAME[,...]",
    shell_complete=make_list_completer(INSTRUMENT),
    help="Properties of the instrument to estimate: bias, scale, mounting, delay.",
)
@click.option(
    "--point",
    type=parse_number_list,
    metavar="X,Y,Z",
    help="Position of an accelerometer (specific_force) in the frame of the body.",
)
@click.option(
    "--degrees",
    is_flag=True,
    default=None,
    help="Angles and rates in RECORD are in degrees; default: as the heads of its columns say.",
)
@click.option("--loss", type=click.Choice(LOSSES), default="linear", help="soft: for outliers.")
@click.option(
    "--pieces", type=int, help="Number of pieces of a chaotic motion; default: as needed."
)
@click.option(
    "--max-evaluations",
    type=int,
    default=2000,
    show_default=True,
    help="The largest number of paths that the search computes.",
)
@click.option("--save", type=FILE, help="Write the fitted scene as TOML.")
@click.option("--csv", "csv_file", type=FILE, help="Write the parameters as a table.")
@click.option(
    "--plot", type=FILE, help="Draw data and residuals: .png, .svg or .pdf; standard output is PNG."
)
def fit(
    record: str,
    scene: str,
    free: list[str],
    columns: tuple[str, ...],
    time: str,
    sigma: tuple[str, ...],
    instrument: list[str],
    point: list[float] | None,
    degrees: bool | None,
    loss: LossName,
    pieces: int | None,
    max_evaluations: int,
    save: str | None,
    csv_file: str | None,
    plot: str | None,
) -> None:
    """Estimate a body and its initial state from the CSV file RECORD, starting from SCENE.

    If the motion of SCENE disagrees with the record, the initial guess is computed from the record.
    If the fit is interrupted, the best fit found so far is printed.
    """
    places = [("fit --save", save), ("--csv", csv_file), ("fit --plot", plot)]
    top = a_scene(scene)
    parse_output_files(places, (record, scene))
    if plot is not None:
        _check_plot_can_be_drawn(plot)
    with convert_errors_to_usage_errors(_OPTIONS):
        instrument_names = cast(list[InstrumentName], [word for word in instrument if word])
        measurements = _read_measurement_record(
            record, _parse_quantity_columns(columns), time, sigma, instrument_names, degrees, point
        )
        result, interruption = _fit_until_interrupted(
            top, measurements, cast(list[FreeName], free), loss, pieces, max_evaluations
        )
    if result is not None:
        _write_fit_results(result, save, csv_file, plot)
    if interruption:
        raise interruption
    if result is not None and not result.has_converged:
        raise click.exceptions.Exit(_NOT_CONVERGED)


def _fit_until_interrupted(
    scene: Scene,
    record: Record,
    free: list[FreeName],
    loss: LossName,
    pieces: int | None,
    max_evaluations: int,
) -> tuple[Fit | None, FitInterrupted | None]:
    """Return the fit and, if it was interrupted, also this exception."""
    try:
        return (
            estimate(
                scene, record, free, loss=loss, pieces=pieces, max_evaluations=max_evaluations
            ),
            None,
        )
    except FitInterrupted as error:
        return error.fit, error


def _check_plot_can_be_drawn(file: str) -> None:
    """Raise an error before the fit if the format is unknown, or matplotlib is not installed."""
    choose_picture_format(file)
    with convert_missing_package_errors():
        import_module("kreisel._plot.charts")


def _read_measurement_record(
    file: str,
    columns: dict[str, str | list[str]] | None,
    time: str,
    sigma: tuple[str, ...],
    instrument: list[InstrumentName],
    degrees: bool | None,
    point: list[float] | None,
) -> Record:
    try:
        return Record.from_csv(
            file,
            columns,
            time,
            _parse_sigma_options(sigma),
            instrument,
            degrees=degrees,
            point=point,
        )
    except OSError as error:
        raise UsageError(str(error)) from None


def _write_fit_results(
    result: Fit, save: str | None, csv_file: str | None, plot: str | None
) -> None:
    """Write the results to the given files; print a summary if none of them is standard output."""
    if "-" not in (save, csv_file, plot):
        click.echo(str(result))
    if save is not None:
        write_bytes(save, result.to_toml().encode())
    if csv_file is not None:
        rows = [
            f"{name},{result.values[name]!r},{result.error[name]!r},{unit}\n"
            for name, unit in zip(result.names, result.units, strict=True)
        ]
        write_bytes(csv_file, ("parameter,value,error,unit\n" + "".join(rows)).encode())
    if plot is not None:
        picture = io.BytesIO()  # savefig would leave an incomplete file on a full disk
        result.plot().figure.savefig(picture, format=choose_picture_format(plot))
        write_bytes(plot, picture.getvalue())
