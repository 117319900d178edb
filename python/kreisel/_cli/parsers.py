"""Parsing and completion of command-line arguments: scenes, numbers and names."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

import click
from click.shell_completion import CompletionItem

from .._model.scene import Scene, parse_scene_toml
from .._model.toml import call_with_error_prefix, read_limited_text
from .._options.methods import methods, unknown_method_message
from .._options.quantities import RECORDABLE
from .._utils.errors import suggest_name
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
