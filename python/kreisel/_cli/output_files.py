"""Validation of the output files of a command."""

from __future__ import annotations

import os
import sys
from pathlib import Path as File
from typing import Any, NamedTuple

import click

from .._utils.atomic_io import check_file_is_writable
from .parsers import UsageError


class _FileName(click.Path):
    """The type of a file name; /dev/stdout is standard output, as - is."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> str | bytes | os.PathLike[str]:
        file = super().convert(value, param, ctx)
        return "-" if file == "/dev/stdout" else file


FILE = _FileName(allow_dash=True)
_ENDINGS = {
    "--csv": (".csv",),
    "--events-csv": (".csv",),
    "--json": (".json",),
    "--npz": (".npz",),
    "--save": (".kreisel",),
    "view --save": (".html", ".htm"),
    "fit --save": (".toml",),
    "fit --plot": (".png", ".svg", ".pdf"),
}
_FORMATS = {ending for endings in _ENDINGS.values() for ending in endings} | {
    ".gz",
    ".npy",
    ".parquet",
    ".toml",
    ".xlsx",
    ".zip",
}


class OutputDestination(NamedTuple):
    """A command-line option and the file name given with it (- for standard output)."""

    option: str
    file: str

    @property
    def is_stdout(self) -> bool:
        """True if the output is written to standard output."""
        return self.file == "-"


def parse_output_files(
    places: list[tuple[str, str | None]],
    inputs: tuple[str, ...],
    options_that_may_replace_inputs: tuple[str, ...] = (),
) -> list[OutputDestination]:
    """Validate the requested output files and return them.

    `places` lists each option with its file name, which is None if the option was not given.
    `inputs` are the names of the files that the command reads. Raises UsageError if a file cannot
    be written, if its extension belongs to another format, if the same file is used twice, or if it
    is an input that its option may not replace.
    """
    destinations = [
        _append_npz_extension(OutputDestination(option, file))
        for option, file in places
        if file is not None
    ]
    input_files = {_resolve_output_path(file): file for file in inputs if file != "-"}
    owners: dict[str, str] = {}
    for place in destinations:
        if place.is_stdout and sys.stdout is None:
            raise UsageError(f"{place.option.split()[-1]} -: standard output is closed")
        if not place.is_stdout:
            _check_output_is_writable(place.file)
        path = _resolve_output_path(place.file)
        owner = owners.get(path)
        if owner is None and place.option not in options_that_may_replace_inputs:
            owner = input_files.get(path)
        if owner is not None and not _is_device_file(place.file):
            option = place.option.split()[-1]
            raise UsageError(f"{option} {place.file}: {owner} is the same file")
        owners[path] = f"{place.option.split()[-1]} {place.file}"
    return destinations


def choose_picture_format(file: str) -> str:
    """Return the format of a picture, which is that of its file name, or "png" for a device.

    Raises UsageError if the file name does not end with a known format.
    """
    endings = _ENDINGS["fit --plot"]
    ending = File(file).suffix.lower()
    if ending in endings:
        return ending.removeprefix(".")
    if file == "-" or (File(file).exists() and not File(file).is_file()):
        return "png"
    raise UsageError(f"--plot writes {', '.join(endings[:-1])} or {endings[-1]}, not {file}")


def _append_npz_extension(place: OutputDestination) -> OutputDestination:
    """Add the extension .npz to the file name of an archive if it is missing.

    Raises UsageError if the extension of the file name belongs to a different format.
    """
    _check_output_extension(place)
    is_complete = place.option != "--npz" or place.is_stdout or place.file.endswith(".npz")
    return place if is_complete else OutputDestination(place.option, f"{place.file}.npz")


def _resolve_output_path(file: str) -> str:
    return "-" if file == "-" else os.path.realpath(file)


def _is_device_file(file: str) -> bool:
    """Return True for a device such as /dev/null, which several outputs may share."""
    return file != "-" and File(file).is_char_device()


def _check_output_is_writable(file: str) -> None:
    try:
        check_file_is_writable(file)
    except (OSError, ValueError) as error:
        raise UsageError(str(error)) from None


def _check_output_extension(place: OutputDestination) -> None:
    ending = File(place.file).suffix.lower()
    if ending in _FORMATS and ending not in _ENDINGS[place.option]:
        option = place.option.split()[-1]
        raise UsageError(f"{option} writes {_ENDINGS[place.option][0]}, not {ending}: {place.file}")
