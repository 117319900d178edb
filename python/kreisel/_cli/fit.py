"""`kreisel fit`."""

from __future__ import annotations

import io
from importlib import import_module
from pathlib import Path as File
from typing import Any

import click

from .._fit.fit import LOSSES
from .._fit.fit import fit as estimate
from .._fit.parameters import FREE
from .._fit.records import INSTRUMENT, Record
from .._fit.result import Fit
from .._model.scene import Scene
from .._results.results import Interrupted
from .options import SCENE, Command, InputFile, Name, OutputFile, UsageError, parse_number_list
from .outputs import write_bytes

_NOT_CONVERGED = 1  # exit code
_PICTURES = ".png", ".svg", ".pdf"


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


def _parse_sigma_options(texts: tuple[str, ...]) -> float | dict[str, float] | None:
    """Return one standard deviation for all quantities, or a separate one for each."""
    try:
        if len(texts) == 1 and "=" not in texts[0]:
            return float(texts[0])
        sigma = _parse_assignments("--sigma", texts)
        return {name: float(value) for name, value in sigma.items()} or None
    except ValueError:
        raise UsageError(f"--sigma {' '.join(texts)}: the value must be a number") from None


@click.command(cls=Command)
@click.argument("record", type=InputFile())
@click.argument("scene", type=SCENE)
@click.option(
    "--free",
    type=Name(FREE, is_list=True),
    default="start,moments",
    show_default=True,
    help="The parameters to estimate.",
)
@click.option(
    "--column",
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
    type=Name(INSTRUMENT, is_list=True),
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
@click.option("--save", type=OutputFile(".toml"), help="Write the fitted scene as TOML.")
@click.option("--csv", type=OutputFile(".csv"), help="Write the parameters as a table.")
@click.option(
    "--plot",
    type=OutputFile(*_PICTURES),
    help="Draw data and residuals: .png, .svg or .pdf; standard output is PNG.",
)
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
    picture_format = "png"
    if plot is not None:
        ending = File(plot).suffix.lower()
        if ending in _PICTURES:
            picture_format = ending[1:]
        elif plot != "-" and not (File(plot).exists() and not File(plot).is_file()):
            raise UsageError(f"--plot writes .png, .svg or .pdf, not {plot}")
        import_module("kreisel._plot.charts")  # fail before the fit if matplotlib is missing
    columns: dict[str, str | list[str]] = {
        name: value.split(",") if "," in value else value
        for name, value in _parse_assignments("--column", column).items()
    }
    deviations = _parse_sigma_options(sigma)
    try:
        measurements = Record.from_csv(
            record,
            columns or None,
            time,
            deviations,
            instrument or (),
            degrees=degrees,
            point=point,
        )
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
            picture = io.BytesIO()  # savefig would leave an incomplete file on a full disk
            result.plot().figure.savefig(picture, format=picture_format)
            write_bytes(plot, picture.getvalue())
    if interruption:
        raise interruption
    if result is not None and not result.has_converged:
        raise click.exceptions.Exit(_NOT_CONVERGED)
