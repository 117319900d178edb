"""TOML: tables of words for the makers of bodies and scenes, and text of all their digits."""

from __future__ import annotations

import inspect
import os
import tomllib
from collections.abc import Callable, Iterable, Mapping
from typing import BinaryIO, TypeVar

from .._ground.refusals import unknown

_T = TypeVar("_T")


_LONGEST = 1 << 20  # bytes: no text of a scene comes near, a device that never ends goes beyond


def read(path: str | os.PathLike[str], parse: Callable[[str], _T]) -> _T:
    """What parse makes of a file. A TypeError or ValueError begins with the name of the file."""
    with open(path, "rb") as file:
        return worded(os.fspath(path), lambda: parse(bounded(file)))


def bounded(file: BinaryIO) -> str:
    """The text of a file, which may be a device or a pipe; ValueError where it is no text, or goes
    on and on."""
    data = file.read(_LONGEST + 1)
    if len(data) > _LONGEST:
        raise ValueError(f"more than {_LONGEST} bytes are no scene")
    return data.decode("utf-8").replace("\r\n", "\n")


def worded(name: str, make: Callable[[], _T]) -> _T:
    """What is made; a TypeError or ValueError begins with this name."""
    try:
        return make()
    except (TypeError, ValueError) as error:
        kind = TypeError if isinstance(error, TypeError) else ValueError
        raise kind(f"{name}: {error}") from None


def tables(text: str) -> dict[str, object]:
    """The tables and values of a text."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("its tables are nested too deep to be a scene") from None


def a_table(name: str, value: object) -> dict[str, object]:
    """The value, where it is a table; TypeError where it is not."""
    if not isinstance(value, dict):
        raise TypeError(f"{name} must be a table, not {value!r}")
    return value


def made(
    make: Callable[..., _T], where: str, words: dict[str, object], others: Iterable[str] = ()
) -> _T:
    """What a maker makes of a table of its words; `others` could stand there too."""
    parameters = inspect.signature(make).parameters
    for word in words:
        if word not in parameters:
            raise ValueError(unknown(f"key in {where}:", word, [*parameters, *others]))
    for name, parameter in parameters.items():
        if parameter.default is parameter.empty and name not in words:
            raise ValueError(f"{where} has no {name}")
    return make(**words)


def lines(words: Mapping[str, object]) -> str:
    """A line for each word, its numbers with all their digits."""
    return "".join(f"{name} = {_value(value)}\n" for name, value in words.items())


def _value(value: object) -> str:
    return f"[{', '.join(map(_value, value))}]" if isinstance(value, tuple) else repr(value)
