"""Output files and printed summary of a run."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import TypedDict, TypeVar

import click

from .output_files import FILE, parse_output_files
from .outputs import (
    CsvOutput,
    EventCollector,
    PathCollector,
    PathPieceReceiver,
    RunSummaryPrinter,
    encode_path_as_json,
    encode_path_as_npz,
    write_bytes,
)
from .parsers import UsageError
from .progress import RunOutcome
from .table import AngleOptions

_Command = TypeVar("_Command", bound=Callable[..., object])


class OutputFileOptions(TypedDict):
    """Options that select the output files and the output format."""

    csv_file: str | None
    json_file: str | None
    npz_file: str | None
    events_file: str | None
    save_file: str | None
    degrees: bool
    unwrap: bool
    all_rows: bool


_OPTIONS = (
    click.option(
        "--csv", "csv_file", type=FILE, help="Write the states, or the quantities of --want."
    ),
    click.option(
        "--json",
        "json_file",
        type=FILE,
        help="Write the states, the scene and the options as one JSON object.",
    ),
    click.option(
        "--npz",
        "npz_file",
        type=FILE,
        help="Write the path for kreisel.load; numpy.load can also read its arrays.",
    ),
    click.option("--events-csv", "events_file", type=FILE, help="Write the events."),
    click.option(
        "--save",
        "save_file",
        type=FILE,
        help="Write the state of the run when it ends or is stopped, for `kreisel resume`.",
    ),
    click.option(
        "--degrees", is_flag=True, help="Write angles and rates in degrees, except in .npz."
    ),
    click.option(
        "--unwrap",
        is_flag=True,
        help="Write continuous angles, without jumps of whole turns, except in .npz and at "
        "events; successive states must be less than half a turn apart.",
    ),
    click.option("--all-rows", is_flag=True, help="Print all rows of the table of states."),
)


def add_output_options(command: _Command) -> _Command:
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


class RunOutputs:
    """The outputs of a run, to which the path is written in chunks.

    `file` is the name of the file from which the scene or the run is read.
    """

    def __init__(
        self,
        options: OutputFileOptions,
        file: str,
        events: tuple[str, ...],
        options_that_may_replace_file: tuple[str, ...] = (),
    ) -> None:
        if options["events_file"] and not events:
            raise UsageError("--events-csv needs --events")
        places = parse_output_files(
            [
                ("--csv", options["csv_file"]),
                ("--json", options["json_file"]),
                ("--npz", options["npz_file"]),
                ("--events-csv", options["events_file"]),
                ("--save", options["save_file"]),
            ],
            (file,),
            options_that_may_replace_file,
        )
        self.files = {place.option: place.file for place in places}
        self._shows = not any(place.is_stdout for place in places)
        self._open, self._where = ExitStack(), options
        self._summary, self._collector = (
            RunSummaryPrinter(self._build_angle_output_options(), options["all_rows"]),
            PathCollector(),
        )
        self._met = EventCollector(events, options["degrees"]) if events else None

    def _build_angle_output_options(self) -> AngleOptions:
        return AngleOptions(self._where["degrees"], self._where["unwrap"])

    @property
    def needs_whole_path(self) -> bool:
        """True if the whole path must be kept in memory."""
        return not {"--json", "--npz"}.isdisjoint(self.files)

    def create_path_outputs(self) -> list[PathPieceReceiver]:
        """Create the output objects to which the states of the run are written.

        The CSV file is the first output, because only it can fail to receive a piece; all other
        outputs must then end with the same piece as the CSV file.
        """
        outputs: list[PathPieceReceiver] = []
        if "--csv" in self.files:
            outputs.append(
                CsvOutput(self.files["--csv"], self._build_angle_output_options(), self._open)
            )
        if self._met:
            outputs.append(self._met)
        if self._shows:
            outputs.append(self._summary)
        if self.needs_whole_path:
            outputs.append(self._collector)
        return outputs

    def discard_output_files(self) -> None:
        """Discard the output, and leave existing files unchanged."""
        error = ValueError()
        self._open.__exit__(ValueError, error, None)

    def finish_outputs(self, end: RunOutcome) -> None:
        """Finish all outputs, even if an error occurs in one of them, and save the run.

        The saved state is the last one that has been written to all outputs. The run is not saved
        if an output cannot be finished. Raises the exception that stopped the run or, if there is
        none, the first error that occurred while writing an output.
        """
        failures = [end.stopped] if end.stopped else []
        for write in (self._open.close, lambda: self._write_whole_path(end), self._write_events):
            try:
                write()
            except OSError as error:
                failures.append(error)
        save = self.files.get("--save")
        if save and end.checkpoint and failures == ([end.stopped] if end.stopped else []):
            write_bytes(save, end.checkpoint)
        if self._shows:
            self._summary.print_output()
            if self._met:
                self._met.print_output()
        if failures:
            raise failures[0]

    def _write_whole_path(self, end: RunOutcome) -> None:
        if not self._collector.pieces:
            return
        path = self._collector.whole_path
        reason = str(end.stopped) if end.stopped else None
        if "--npz" in self.files:
            write_bytes(self.files["--npz"], encode_path_as_npz(path))
        if "--json" in self.files:
            write_bytes(
                self.files["--json"],
                encode_path_as_json(path, self._met, self._build_angle_output_options(), reason),
            )

    def _write_events(self) -> None:
        if self._met and self._met.parts and "--events-csv" in self.files:
            write_bytes(self.files["--events-csv"], self._met.encode_as_csv())
