"""Options and arguments of commands."""

from __future__ import annotations

import bisect
import inspect
import math
import os
import re
import sys
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any, BinaryIO, NamedTuple

import click
import numpy as np
from click.shell_completion import CompletionItem
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Grid

from .._model.scene import Scene, parse_scene_toml
from .._model.toml import call_with_error_prefix, read_limited_text
from .._options.methods import methods, unknown_method_message
from .._options.quantities import RECORDABLE
from .._utils.arguments import Array, suggest_name
from .._utils.files import check_file_is_writable
from ..events import MAKERS, Event
from ..scenes import about, get_scene

Completion = list[CompletionItem[str]]
Completer = Callable[[click.Context, click.Parameter, str], Completion]

SEVERAL = "NUMBER[,...]"
_AUTO = ("auto", "geometric")


class UsageError(click.ClickException):
    """Exception for an invalid argument, raised before any computation starts."""

    exit_code = 2


def parse_number_list(words: str) -> list[float]:
    """Parse a comma-separated list of numbers."""
    try:
        return [float(word) for word in words.split(",")]
    except ValueError:
        raise click.BadParameter(
            f"{words!r} is not a number or a list of numbers separated by commas"
        ) from None


def parse_name_list(words: str) -> list[str]:
    """Parse a comma-separated list of names."""
    return words.split(",")


def find_or_read_scene(word: str) -> Scene:
    """Return a named scene, or read a scene from a file or from standard input."""
    if word in about:
        return get_scene(word)
    with warnings.catch_warnings(record=True) as warning_list:
        scene = _read_scene_argument(word)
    for warning in warning_list:
        click.echo(f"Warning: {warning.message}", err=True)
    return scene


def _read_scene_argument(word: str) -> Scene:
    try:
        if word == "-":
            return call_with_error_prefix(
                "standard input", lambda: parse_scene_toml(read_limited_text(get_binary_stdin()))
            )
        return Scene.from_toml(word)
    except FileNotFoundError:
        raise click.BadParameter(
            f"there is no file or named scene {word!r}; {suggest_name(word, about)}",
            ctx=click.get_current_context(silent=True),
            param_hint="SCENE",
        ) from None
    except (OSError, TypeError, ValueError) as error:
        raise click.BadParameter(
            str(error), ctx=click.get_current_context(silent=True), param_hint="SCENE"
        ) from None


def get_binary_stdin() -> BinaryIO:
    """Return standard input as a stream of bytes.

    Raises OSError if the process was started without a standard input.
    """
    if sys.stdin is None:
        raise OSError("standard input is closed")
    return sys.stdin.buffer


def method(name: str) -> str:
    """Return `name`; raise BadParameter if no method has this name."""
    if name in methods or name in _AUTO:
        return name
    raise click.BadParameter(unknown_method_message(name))


def parse_method_list(words: str) -> list[str]:
    """Parse a comma-separated list of method names."""
    return [method(name) for name in parse_name_list(words)]


def make_name_completer(names: Iterable[str], files: bool = False) -> Completer:
    """Return a function that completes one of the `names` or, optionally, a file name."""
    words = list(names)

    def complete_word(_: click.Context, __: click.Parameter, prefix: str) -> Completion:
        items = [CompletionItem(word) for word in words if word.startswith(prefix)]
        return [CompletionItem(prefix, type="file"), *items] if files else items

    return complete_word


def make_list_completer(names: Iterable[str]) -> Completer:
    """Return a function that completes the last name in a comma-separated list."""
    words = list(names)

    def complete_word(_: click.Context, __: click.Parameter, prefix: str) -> Completion:
        head, comma, last = prefix.rpartition(",")
        return [CompletionItem(head + comma + word) for word in words if word.startswith(last)]

    return complete_word


A_METHOD = make_name_completer([*_AUTO, *methods])
METHODS = make_list_completer(methods)
QUANTITIES = make_list_completer(RECORDABLE)
A_SCENE = make_name_completer(about, files=True)


@contextmanager
def convert_missing_package_errors() -> Iterator[None]:
    """Return a context manager that converts the error for a missing package to one line."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise click.ClickException(str(error)) from None


@contextmanager
def convert_errors_to_usage_errors(options: Collection[str]) -> Iterator[None]:
    """Return a context manager that converts exceptions to command-line errors.

    In the messages of errors and warnings, Python arguments are replaced by command-line options.
    """
    try:
        with _replace_arguments_in_warnings(options):
            yield
    except (TypeError, ValueError) as error:
        raise UsageError(replace_arguments_by_options(str(error), options)) from None
    except MemoryError as error:
        raise UsageError(
            replace_arguments_by_options(str(error), options) or "it needs more memory"
        ) from None


@contextmanager
def _replace_arguments_in_warnings(options: Collection[str]) -> Iterator[None]:
    with warnings.catch_warnings():
        show = warnings.showwarning

        def show_with_options(message: Warning | str, *words: Any, **more: Any) -> None:
            show(replace_arguments_by_options(str(message), options), *words, **more)

        warnings.showwarning = show_with_options
        yield


def replace_arguments_by_options(message: str, options: Collection[str]) -> str:
    """Replace arguments in an error message by options: step=0.01 becomes --step 0.01."""
    if not options:
        return message
    alternatives = "|".join(sorted(options, key=len, reverse=True))
    value = r"\[[^]]*\]|\([^)]*\)|'[^']*'|[^\s,;:)]+"

    def format_assignment_as_option(match: re.Match[str]) -> str:
        plain = re.sub(r"[\[\]()' ]", "", match[2]).rstrip(",")
        return f"--{match[1].replace('_', '-')} {plain}"

    def format_argument_as_option(match: re.Match[str]) -> str:
        return f"{match[1]}--{match[2].replace('_', '-')}"

    text = re.sub(rf"(?<![\w.])({alternatives})=({value})", format_assignment_as_option, message)
    text = text.replace("give t as a list", "give --t as a grid, as in --t 0:10:0.01")
    text = re.sub(
        rf"\b(give |raise |leave out |leave )({alternatives})\b", format_argument_as_option, text
    )
    return re.sub(
        rf"^()({alternatives})(?= (?:is|needs|must|and) )", format_argument_as_option, text
    )


HELP = "The final time, or the times to record: comma-separated numbers and grids start:end:step."
METAVAR = "TIME[,...]"
_COUNTABLE = 2.0**53


@dataclass(frozen=True)
class TimeGrid:
    """The times start + (skip + k) * step for 0 <= k < count.

    Each time is computed directly from its index, so rounding errors do not accumulate. The later
    times of a grid are bitwise equal to those in the whole grid.
    """

    start: float
    step: float
    count: int
    skip: int = 0

    def __getitem__(self, k: int) -> float:
        return self.start + (self.skip + k) * self.step

    def to_array(self) -> Array:
        """Return the times as an array."""
        return self.start + (self.skip + np.arange(self.count, dtype=np.float64)) * self.step

    def select_later_times(self, t: float) -> TimeGrid:
        """Return the part of the grid whose times exceed |t| in absolute value."""
        k = bisect.bisect_right(range(self.count), abs(t), key=lambda k: abs(self[k]))
        return TimeGrid(self.start, self.step, self.count - k, self.skip + k)


@dataclass(frozen=True)
class TimeSequence:
    """Requested times, given as one or more grids."""

    grids: tuple[TimeGrid, ...]
    one: bool  # True if the user gave a single number, the time to reach

    def __len__(self) -> int:
        return sum(grid.count for grid in self.grids)

    def __iter__(self) -> Iterator[float]:
        return (grid[k] for grid in self.grids for k in range(grid.count))

    @property
    def end(self) -> float:
        """The last time."""
        return self.grids[-1][self.grids[-1].count - 1]

    def to_array(self) -> Array:
        """Return the times as an array. Raises MemoryError if the times do not fit in memory."""
        return np.concatenate([grid.to_array() for grid in self.grids])

    def to_solve_argument(self) -> float | Array:
        """Return the times in the form that kreisel.solve accepts."""
        return self.end if self.one else self.to_array()

    def select_later_times(self, t: float) -> TimeSequence:
        """Return the requested times whose absolute value exceeds |t|."""
        grids = (grid.select_later_times(t) for grid in self.grids)
        return TimeSequence(tuple(grid for grid in grids if grid.count), self.one)


def parse_times(words: str) -> TimeSequence:
    """Parse comma-separated times, each given as a number or as a grid start:end:step."""
    grids = tuple(map(_parse_time_grid, words.split(",")))
    _refuse_unordered_time_grids([t for grid in grids for t in (grid[0], grid[grid.count - 1])])
    return TimeSequence(grids, len(grids) == 1 and ":" not in words)


def _parse_time_grid(word: str) -> TimeGrid:
    try:
        numbers = [float(part) for part in word.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3):
        raise click.BadParameter(
            f"{word!r} is not a number or a grid start:end:step such as 0:10:0.01"
        )
    if not all(map(math.isfinite, numbers)):
        raise click.BadParameter(f"t must be finite, not {word!r}")
    if len(numbers) == 1:
        return TimeGrid(numbers[0], 0.0, 1)
    return _build_time_grid(word, *numbers)


def _build_time_grid(word: str, start: float, end: float, step: float) -> TimeGrid:
    """Return the grid of times from start to end."""
    length = end - start
    if step == 0.0 or (step < 0.0 < length):
        raise click.BadParameter(f"{word!r} cannot go from {start:g} to {end:g} with this step")
    steps = abs(length / step)
    if not steps < _COUNTABLE:
        raise click.BadParameter(f"{word!r} has too many times: use larger steps")
    step_count = math.floor(steps + 0.5)
    slack = 2.0 * np.finfo(float).eps * max(abs(start), abs(end))
    count = step_count + 1 if step_count * abs(step) - abs(length) <= slack else step_count
    return TimeGrid(start, math.copysign(step, length), count)


def _refuse_unordered_time_grids(ends: Sequence[float]) -> None:
    is_back = ends[-1] < 0.0
    last = 0.0
    for t in ends:
        if (t > last) if is_back else (t < last):
            raise click.BadParameter(
                f"times must move away from 0 in one direction, but {t!r} goes back from {last!r}"
            )
        last = t


_SPACE = 3  # largest width of the padding and the border of a column


def print_text_grid(grid: Grid) -> None:
    """Print a table, which is wider than the terminal if a number or a word needs this."""
    least_width = 2
    for column in grid.columns:
        texts = [str(column.header), *map(str, column.cells)]
        parts = texts if column.no_wrap else [word for text in texts for word in text.split()]
        column.min_width = max(map(cell_len, parts), default=0)
        least_width += column.min_width + _SPACE
    console = Console(markup=False, highlight=False)
    console.width = max(console.width, least_width)
    console.print(grid, crop=False)


_TERM = re.compile(r"([+-]*)((?:(?<=[\d.])[eE][+-]\d|[^+-])+)")


def parse_event_option(scene: Scene, words: tuple[str, ...]) -> list[Event] | None:
    """Return the events specified by the values of --events, or None if there are none."""
    return [_parse_event_text(scene, word) for word in words] or None


def _parse_event_text(scene: Scene, word: str) -> Event:
    name, *fields = word.split(":")
    if name not in MAKERS:
        raise UsageError(f"unknown event {name!r}; {suggest_name(name, MAKERS)}")
    maker = MAKERS[name]
    arguments: dict[str, object] = {}
    positional = _list_positional_arguments(maker)
    if "scene" in positional:
        positional.remove("scene")
        arguments["scene"] = scene
    try:
        for field in fields:
            key, equals, value = field.partition("=")
            if not equals and field != "terminal":
                if not positional:
                    raise ValueError(f"{field!r} is an unexpected argument")
                key, value = positional.pop(0), field
            if key in arguments:
                raise ValueError(f"{key} is already given")
            arguments[key] = _parse_value_of_event_argument(key, value)
        return maker(**arguments)
    except (TypeError, ValueError) as error:
        message = str(error).replace(f"{name}()", "it")
        raise UsageError(f"--events {word}: {message}") from None


def _list_positional_arguments(maker: Callable[..., Event]) -> list[str]:
    """Return the names of the positional arguments of a function."""
    parameters = inspect.signature(maker).parameters.values()
    return [word.name for word in parameters if word.kind is word.POSITIONAL_OR_KEYWORD]


def _parse_value_of_event_argument(key: str, value: str) -> object:
    if key == "terminal":
        if value:
            raise ValueError("terminal takes no value")
        return True
    if key in ("direction", "max_count"):
        return _parse_number(key, value, int, "a whole number")
    if key in ("value", "offset", "within"):
        return _parse_number(key, value, float, "a number")
    if key == "normal":
        return parse_number_list(value)
    return _parse_event_polynomial(value) if key in ("function", "where") else value


def _parse_number(key: str, value: str, kind: type[int | float], form: str) -> float:
    try:
        return kind(value)
    except ValueError:
        raise ValueError(f"{key} must be {form}, not {value!r}") from None


def _parse_event_polynomial(text: str) -> dict[str, float]:
    """Parse a sum such as 2*m_x+apex_z*apex_z-0.5 into a mapping of products to factors."""
    terms: dict[str, float] = {}
    compact = text.replace(" ", "")
    products = _TERM.findall(compact)
    is_complete = all(all(product.split("*")) for _, product in products)
    if not products or not is_complete or "".join(map("".join, products)) != compact:
        raise ValueError(f"{text!r} is not a sum of products such as 2*m_x*m_y-0.5")
    for signs, product in products:
        factor, names = (-1.0) ** signs.count("-"), []
        for word in product.split("*"):
            try:
                factor *= float(word)
            except ValueError:
                names.append(word)
        key = "*".join(names) or "1"
        terms[key] = terms.get(key, 0.0) + factor
    return terms


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
