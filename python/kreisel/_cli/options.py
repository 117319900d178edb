"""Commands, their options with the types of their values, and what they print."""

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
from typing import Any, BinaryIO

import click
import numpy as np
from click.shell_completion import CompletionItem
from rich import box
from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.progress import Progress
from rich.table import Table

from .._fit.fit import LOSSES
from .._fit.parameters import FREE
from .._fit.records import INSTRUMENT
from .._model.scene import Scene, parse_scene_toml, validate_one_top
from .._model.toml import call_with_error_prefix, read_limited_text
from .._options.methods import methods
from .._options.options import RECORDABLE
from .._score.suite import load_cases
from .._utils.arguments import Array, spell_as_options, suggest_name
from .._utils.files import atomic_write, check_file_is_writable
from ..events import MAKERS, Event
from ..scenes import about, get_scene


class UsageError(click.ClickException):
    """Exception for an invalid argument, raised before any computation starts."""

    exit_code = 2


class Command(click.Command):
    """A command that prints each warning, and reports invalid arguments as UsageError."""

    def invoke(self, ctx: click.Context) -> Any:
        options = {str(one.name): one.opts[0] for one in self.params if one.opts[0][0] == "-"}
        with warnings.catch_warnings(), spell_as_options(options):
            warnings.showwarning = lambda text, *_, **__: click.echo(f"Warning: {text}", err=True)
            try:
                return super().invoke(ctx)
            except ModuleNotFoundError as error:
                raise click.ClickException(str(error)) from None
            except (TypeError, ValueError, MemoryError) as error:
                raise UsageError(str(error) or "it needs more memory") from None


def parse_number_list(words: str) -> list[float]:
    try:
        return [float(word) for word in words.split(",")]
    except ValueError:
        raise click.BadParameter(
            f"{words!r} is not a number or a list of numbers separated by commas"
        ) from None


class Name(click.types.StringParamType):
    """A name, or several separated by commas; the shell completes the names in `known`."""

    def __init__(self, known: Iterable[str], is_list: bool = False) -> None:
        self._known, self._is_list = tuple(known), is_list
        self.name = "NAME[,...]" if is_list else "NAME"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return value.split(",") if self._is_list and isinstance(value, str) else value

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem[str]]:
        head, comma, last = incomplete.rpartition("," if self._is_list else "\0")
        names = [name for name in self._known if name.startswith(last)]
        return [CompletionItem(head + comma + name) for name in names]


class _SceneName(Name):
    """The name of a scene, or of a file from which it is read; - is standard input."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value in self._known:
            return get_scene(value)
        if param is None or ctx is None or ctx.resilient_parsing:
            return value
        _refuse_second_use_of_file(value, param, ctx)
        try:
            if value == "-":
                scene = call_with_error_prefix(
                    "standard input",
                    lambda: parse_scene_toml(read_limited_text(get_binary_stdin())),
                )
            else:
                scene = Scene.from_toml(value)
            return validate_one_top("scene", scene)
        except FileNotFoundError:
            hint = suggest_name(value, self._known)
            self.fail(f"there is no file or named scene {value!r}; {hint}", param, ctx)
        except (OSError, TypeError, ValueError) as error:
            self.fail(str(error), param, ctx)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem[str]]:
        names = super().shell_complete(ctx, param, incomplete)
        return [CompletionItem(incomplete, type="file"), *names]


SCENE, METHOD = _SceneName(about), Name(["auto", "geometric", *methods])


def get_binary_stdin() -> BinaryIO:
    """Return standard input, or raise OSError if the process was started without it."""
    if sys.stdin is None:
        raise OSError("standard input is closed")
    return sys.stdin.buffer


class InputFile(click.Path):
    """The name of a file that a command reads."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if param is not None and ctx is not None:
            _refuse_second_use_of_file(value, param, ctx)
        return super().convert(value, param, ctx)


_FORMATS = {
    *(".csv", ".gz", ".htm", ".html", ".json", ".kreisel", ".npy", ".npz", ".parquet", ".pdf"),
    *(".png", ".svg", ".toml", ".xlsx", ".zip"),
}


class OutputFile(click.Path):
    """The name of a file that a command writes; - and /dev/stdout are standard output.

    The file must be writable, and its extension must be in `endings` or of no other format. It may
    be the file of the argument `replaces`.
    """

    def __init__(self, *endings: str, replaces: str = "") -> None:
        super().__init__(allow_dash=True)
        self._endings, self.replaces = endings, replaces

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        file = os.fsdecode(super().convert(value, param, ctx))
        if param is None or ctx is None or ctx.resilient_parsing:
            return file
        option, ending = param.opts[0], File(file).suffix.lower()
        if file in ("-", "/dev/stdout"):
            file = "-"
            if sys.stdout is None:
                raise UsageError(f"{option} -: standard output is closed")
        else:
            if ending in _FORMATS and ending not in self._endings:
                raise UsageError(f"{option} writes {self._endings[0]}, not {ending}: {file}")
            if ".npz" in self._endings and not file.endswith(".npz"):
                file += ".npz"
            try:
                check_file_is_writable(file)
            except (OSError, ValueError) as error:
                raise UsageError(str(error)) from None
        _refuse_second_use_of_file(file, param, ctx)
        return file


def _refuse_second_use_of_file(file: str, param: click.Parameter, ctx: click.Context) -> None:
    """Raise UsageError if a file that a command writes is also another file of the command."""
    option = param.opts[0] if isinstance(param.type, OutputFile) else ""
    if (file == "-" and not option) or (file != "-" and File(file).is_char_device()):
        return  # standard input, or a device such as /dev/null, which several outputs may share
    owner = f"{option} {file}".lstrip()
    name = param.type.replaces if isinstance(param.type, OutputFile) else param.name
    path = "-" if file == "-" else os.path.realpath(file)
    if path in ctx.meta:
        other_option, other, other_name = ctx.meta[path]
        is_replaced = bool(option) != bool(other_option) and name == other_name
        if (option or other_option) and not is_replaced:
            output, file = (owner, other) if option else (other, owner)
            raise UsageError(f"{output}: {file} is the same file")
    ctx.meta[path] = option, owner, name


@dataclass(frozen=True)
class TimeSequence:
    """Requested times, given as one or more grids: start + k * step for each k of a range.

    Each time is computed directly from its index, so rounding errors do not accumulate. The later
    times of a grid are bitwise equal to those in the whole grid.
    """

    grids: tuple[tuple[float, float, range], ...]
    one: bool  # True if the user gave a single number, the time to reach

    def __len__(self) -> int:
        return sum(len(counts) for _, _, counts in self.grids)

    def __iter__(self) -> Iterator[float]:
        return (start + k * step for start, step, counts in self.grids for k in counts)

    @property
    def end(self) -> float:
        start, step, counts = self.grids[-1]
        return start + counts[-1] * step

    def to_solve_argument(self) -> float | Array:
        """Return the times for kreisel.solve; raise MemoryError if they do not fit in memory."""
        return self.end if self.one else np.fromiter(self, np.float64, len(self))

    def select_later_times(self, t: float) -> TimeSequence:
        """Return the requested times whose absolute value exceeds |t|."""
        grids = []
        for start, step, counts in self.grids:
            first = bisect.bisect_right(counts, abs(t), key=lambda k: abs(start + k * step))
            if counts[first:]:
                grids.append((start, step, counts[first:]))
        return TimeSequence(tuple(grids), self.one)


def parse_times(words: str) -> TimeSequence:
    """Parse comma-separated times, each given as a number or as a grid start:end:step."""
    grids = tuple(map(_parse_time_grid, words.split(",")))
    last, is_back = 0.0, TimeSequence(grids, False).end < 0.0
    for start, step, counts in grids:
        for t in (start, start + counts[-1] * step):
            if (t > last) if is_back else (t < last):
                raise click.BadParameter(
                    f"times must move away from 0, but {t!r} goes back from {last!r}"
                )
            last = t
    return TimeSequence(grids, len(grids) == 1 and ":" not in words)


def _parse_time_grid(word: str) -> tuple[float, float, range]:
    try:
        numbers = [float(part) for part in word.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3) or not all(map(math.isfinite, numbers)):
        raise click.BadParameter(
            f"{word!r} is not a number or a grid start:end:step of finite numbers, as 0:10:0.01"
        )
    if len(numbers) == 1:
        return numbers[0], 0.0, range(1)
    start, end, step = numbers
    length = end - start
    if step == 0.0 or (step < 0.0 < length):
        raise click.BadParameter(f"{word!r} cannot go from {start:g} to {end:g} with this step")
    steps = abs(length / step)
    if not steps < 2.0**53:
        raise click.BadParameter(f"{word!r} has too many times: use larger steps")
    count = math.floor(steps + 0.5)
    slack = 2.0 * np.finfo(float).eps * max(abs(start), abs(end))
    if count * abs(step) - abs(length) <= slack:
        count += 1
    return start, math.copysign(step, length), range(count)


_TERM = re.compile(r"([+-]*)((?:(?<=[\d.])[eE][+-]\d|[^+-])+)")


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


_READERS: dict[str, Callable[[str], object]] = {  # of arguments of events that are not texts
    **dict.fromkeys(["direction", "max_count"], int),
    **dict.fromkeys(["value", "offset", "within"], float),
    **dict.fromkeys(["function", "where"], _parse_event_polynomial),
    "normal": parse_number_list,
}


def parse_event(scene: Scene, text: str) -> Event:
    """Return the event that a value of --events describes, such as plane:0,1,0:of=m."""
    name, *fields = text.split(":")
    if name not in MAKERS:
        raise UsageError(f"unknown event {name!r}; {suggest_name(name, MAKERS)}")
    parameters = inspect.signature(MAKERS[name]).parameters
    arguments: dict[str, object] = {"scene": scene} if "scene" in parameters else {}
    positional = [
        word.name
        for word in parameters.values()
        if word.kind is word.POSITIONAL_OR_KEYWORD and word.name not in arguments
    ]
    try:
        for field in fields:
            key, equals, value = field.partition("=")
            if not equals and field != "terminal":
                if not positional:
                    raise ValueError(f"{field!r} is an unexpected argument")
                key, value = positional.pop(0), field
            if key in arguments:
                raise ValueError(f"{key} is already given")
            if key == "terminal" and value:
                raise ValueError("terminal takes no value")
            read = _READERS.get(key, str)
            try:
                arguments[key] = True if key == "terminal" else read(value)
            except ValueError:
                if read not in (int, float):
                    raise
                arguments[key] = value  # the constructor refuses a text
        return MAKERS[name](**arguments)
    except (TypeError, ValueError) as error:
        raise UsageError(f"--events {text}: {str(error).replace(f'{name}()', 'it')}") from None


def _parse_parts(word: str) -> range:
    first, colon, last = word.partition(":")
    if not (colon and first.isdecimal() and last.isdecimal() and int(first) <= int(last)):
        raise click.BadParameter(
            f"{word!r} is not a range of parts such as 0:100, which excludes 100"
        )
    return range(int(first), int(last))


PICTURES = ".png", ".svg", ".pdf"
# {the commands that have an option, and its name: the text of its help}
_OPTIONS = {
    "solve resume compare --t": "The final time, or the times to record [T]: comma-separated "
    "numbers and grids start:end:step.",
    "solve --method": "One of `kreisel methods`, auto, or geometric, which chooses a method that "
    "meets --error.",
    "solve --step": "The step of fixed-step methods [T].",
    "solve --tol": "The tolerance of adaptive methods.",
    "solve --digits": "The digits of taylor, instead of --tol: 16, 20 or 30.",
    "solve --error": "The largest attitude error for geometric [rad].",
    "solve resume --every": "Record the state after every N steps, up to the time --t.",
    "solve --max-steps": "Fail after this number of steps; 0: no limit.",
    "resume --max-steps": "A new limit on the number of steps.",
    "solve --want": "Quantities to record instead of states, such as nutation,energy (see `kreisel "
    "quantities`).",
    "solve --events": "An event to search for, as in kreisel.events; repeatable: nutation, "
    "plane:0,1,0:of=m, crossing:2*m_x+apex_z:0.5:direction=1, nutation:max_count=3:terminal.",
    "solve resume --csv": "Write the states, or the quantities of --want.",
    "solve resume --json": "Write the states, the scene and the options as one JSON object.",
    "solve resume --npz": "Write the path for kreisel.load; numpy.load can also read its arrays.",
    "solve resume --events-csv": "Write the events.",
    "solve resume --save": "Write the state of the run when it ends or is stopped, for `kreisel "
    "resume`.",
    "solve resume --degrees": "Write angles and rates in degrees, except in .npz.",
    "solve resume --unwrap": "Write continuous angles, without jumps of whole turns, except in "
    ".npz and at events; successive states must be less than half a turn apart.",
    "solve resume --all-rows": "Print all rows of the table of states.",
    "compare --methods": "Names of methods; default: all that apply to the scene.",
    "compare --steps": "The step of fixed-step methods [T].",
    "compare --tols": "The tolerance of adaptive methods.",
    "compare --truth": "The method of the reference solution, with 20 digits, tol 1e-13 or a fine "
    "step.",
    "compare --repeats": "Number of runs of each method; the fastest is used.",
    "compare --csv": "Write the table with all digits.",
    "fit --free": "The parameters to estimate.",
    "fit --column": "The columns of a quantity; default: all columns, by the names of components.",
    "fit --time": "The column of times [T].",
    "fit --sigma": "Standard deviation of the measurements; default: estimated from the residuals.",
    "fit --instrument": "Properties of the instrument to estimate: bias, scale, mounting, delay.",
    "fit --point": "Position of an accelerometer (specific_force) in the frame of the body [L].",
    "fit --degrees": "Angles and rates in RECORD are in degrees; default: as the heads of its "
    "columns say.",
    "fit --loss": "soft: for outliers.",
    "fit --pieces": "Number of pieces of a chaotic motion; default: as needed.",
    "fit --max-evaluations": "The largest number of paths that the search computes.",
    "fit --save": "Write the fitted scene as TOML.",
    "fit --csv": "Write the parameters as a table.",
    "fit --plot": "Draw data and residuals: .png, .svg or .pdf; standard output is PNG.",
    "score --case": "A case of the suite, as tumble; default: the case that begins the name of the "
    "file.",
    "score --scene": "A scene instead of a case.",
    "score --steps": "The step of each file [T]; default: the distance of its times.",
    "score --level": "The attitude error allowed: engine, science, or a number [rad].",
    "score --plot": "Draw the errors over time: .png, .svg or .pdf; standard output is PNG.",
    "run --folder": "The folder of the parts.",
    "run --parts": "Compute only these parts, for example in one of many jobs; 0:0 only writes the "
    "plan.",
    "run --workers": "Number of processes; each computes one part at a time.",
    "run --dask": "Compute on the workers of the Dask scheduler at this address.",
    "view --save": "Write the viewer to a file instead of opening it.",
}
_SETTINGS: dict[str, dict[str, Any]] = {  # of these options for click; others are of type int
    **{name: {"is_flag": True} for name in ("--degrees", "--unwrap", "--all-rows")},
    **{name: {"type": float} for name in ("--step", "--tol", "--error")},
    **{name: {"type": OutputFile(".csv")} for name in ("--csv", "--events-csv")},
    "--steps": {"type": parse_number_list, "metavar": "NUMBER[,...]"},
    "--tols": {"type": parse_number_list, "metavar": "NUMBER[,...]"},
    "--t": {"type": parse_times, "required": True, "metavar": "TIME[,...]"},
    "--method": {"type": METHOD, "default": "auto"},
    "solve --max-steps": {"default": 0, "type": int},
    "--want": {"type": Name(RECORDABLE, is_list=True)},
    "--events": {
        "type": Name(MAKERS),
        "multiple": True,
        "metavar": "NAME[:ARGUMENT...][:WORD=VALUE...]",
    },
    "--json": {"type": OutputFile(".json")},
    "--npz": {"type": OutputFile(".npz")},
    "--save": {"type": OutputFile(".kreisel", replaces="run")},
    "--methods": {"type": Name(methods, is_list=True)},
    "--truth": {"type": METHOD, "default": "taylor"},
    "--repeats": {"default": 5},
    "--free": {"type": Name(FREE, is_list=True), "default": "start,moments"},
    "--column": {"type": str, "multiple": True, "metavar": "QUANTITY=NAME[,...]"},
    "--time": {"type": str, "default": "t"},
    "--sigma": {"type": str, "multiple": True, "metavar": "[QUANTITY=]NUMBER"},
    "--instrument": {"type": Name(INSTRUMENT, is_list=True)},
    "--point": {"type": parse_number_list, "metavar": "X,Y,Z"},
    "fit --degrees": {"is_flag": True, "default": None},
    "--loss": {"type": click.Choice(LOSSES), "default": "linear"},
    "--max-evaluations": {"default": 2000},
    "fit --save": {"type": OutputFile(".toml")},
    "--plot": {"type": OutputFile(*PICTURES)},
    "--case": {"type": Name(load_cases())},
    "--scene": {"type": SCENE},
    "--level": {"type": str, "default": "engine"},
    "--folder": {"type": click.Path(), "required": True},
    "--parts": {"type": _parse_parts, "metavar": "A:B"},
    "--workers": {"type": click.IntRange(1)},
    "--dask": {"type": str, "metavar": "ADDRESS"},
    "view --save": {"type": OutputFile(".html", ".htm")},
}


def command(
    example: str = "", group: Any = click, epilog: str = ""
) -> Callable[[Callable[..., None]], click.Command]:
    """Return a decorator for the function of a command, with the options of the command's name."""

    def decorate(function: Callable[..., None]) -> click.Command:
        name = function.__name__
        for key, text in reversed(_OPTIONS.items()):
            *commands, option = key.split()
            if name in commands:
                more = _SETTINGS.get(f"{name} {option}") or _SETTINGS.get(option, {"type": int})
                add = click.option(option, help=text, show_default=True, **more)
                function = add(function)
        ending = f"Example: kreisel {example}\n\n{epilog}" if example else epilog
        made: click.Command = group.command(cls=Command, epilog=ending)(function)
        return made

    return decorate


def print_table(
    head: Sequence[str], rows: Iterable[Sequence[str]], right: Collection[str] = ()
) -> None:
    """Print a table, as wide as numbers, words and the first column need; align columns `right`."""
    grid = Table(box=box.SIMPLE_HEAD)
    for name in head:
        justify: JustifyMethod = "right" if name in right else "left"
        grid.add_column(name, justify=justify, no_wrap=name is head[0])
    for row in rows:
        grid.add_row(*row)
    for column in grid.columns:
        texts = [str(column.header), *map(str, column.cells)]
        parts = texts if column.no_wrap else [word for text in texts for word in text.split()]
        column.min_width = max(map(cell_len, parts), default=0)
    console = Console(markup=False, highlight=False)
    least_width = 2 + sum((column.min_width or 0) + 3 for column in grid.columns)
    console.width = max(console.width, least_width)
    console.print(grid, crop=False)


def write_bytes(file: str, data: bytes) -> None:
    if file != "-":
        atomic_write(file, data)
        return
    remainder = memoryview(data)
    while remainder:  # an unbuffered standard output may write only some of the bytes
        remainder = remainder[sys.stdout.buffer.write(remainder) :]
    sys.stdout.buffer.flush()


@contextmanager
def show_progress(total: float) -> Iterator[Callable[[float], object]]:
    """Show a progress bar if standard error is a terminal, and yield a function to update it."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda done: None
        return
    with Progress(console=console, transient=True, speed_estimate_period=1e9) as bar:
        task = bar.add_task("", total=total)
        yield lambda done: bar.update(task, completed=done)
