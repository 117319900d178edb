"""Scenes as TOML."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, BinaryIO, TypeVar

import numpy as np

from .._utils.arguments import short_repr, unknown_name_message
from .body import Body
from .parameters import BODIES, BODY, WHEEL, Words

_T = TypeVar("_T")


_MAX_BYTES = 1 << 20  # far larger than any scene; limits the data read from a device


def parse_toml_text_or_file(source: str | os.PathLike[str], parse: Callable[[str], _T]) -> _T:
    """Parse `source`, which is TOML text if it has several lines, and a file name otherwise."""
    if isinstance(source, str) and "\n" in source:
        return parse(source)
    name = os.fspath(source)  # refuses an integer, which open would use as a file descriptor
    with open(name, "rb") as file:
        return call_with_error_prefix(name, lambda: parse(read_limited_text(file)))


def read_limited_text(file: BinaryIO) -> str:
    """Read the text of a file, device or pipe; raise ValueError if it is too long or not UTF-8."""
    data = file.read(_MAX_BYTES + 1)
    if len(data) > _MAX_BYTES:
        raise ValueError(f"a scene has at most {_MAX_BYTES} bytes")
    return data.decode("utf-8").replace("\r\n", "\n")


def call_with_error_prefix(name: str, make: Callable[[], _T]) -> _T:
    """Call `make`, and put `name` in front of the message of a TypeError or ValueError."""
    try:
        return make()
    except (TypeError, ValueError) as error:
        kind = TypeError if isinstance(error, TypeError) else ValueError
        raise kind(f"{name}: {error}") from None


def parse_toml_tables(text: str) -> dict[str, object]:
    """Parse a TOML text, and return its tables and values."""
    import tomllib  # imported here to keep `import kreisel` fast

    try:
        return tomllib.loads(text.removeprefix("\ufeff"))  # a byte order mark
    except RecursionError:
        raise ValueError("the tables are nested too deeply") from None


def require_toml_table(name: str, value: object) -> dict[str, object]:
    """Return `value` if it is a table; raise TypeError otherwise."""
    if not isinstance(value, dict):
        raise TypeError(f"{name} must be a table, not {short_repr(value)}")
    return value


def call_constructor_with_table(
    make: Callable[..., _T],
    place: str,
    words: Mapping[str, object],
    known: Words,
    locations: Mapping[str, str],
    others: Iterable[str] = (),
) -> _T:
    """Call the constructor `make` with the entries of a table as keyword arguments.

    Raises ValueError for missing and unknown keys. The message says where a key in `locations`
    belongs, and may suggest one of `others`.
    """
    names = [*itertools.chain(*known)]
    for word in words:
        if word not in names:
            if word in locations:
                raise ValueError(f"{word} belongs {locations[word]}")
            raise ValueError(unknown_name_message(f"key in {place}:", word, [*names, *others]))
    for name in known[0]:
        if name not in words:
            raise ValueError(f"{place} has no {name}")
    return make(**words)


def format_toml_entries(words: Mapping[str, object]) -> str:
    """Return key-value pairs as TOML text, with numbers in full precision."""
    return "".join([f"{name} = {_format_toml_value(value)}\n" for name, value in words.items()])


def _format_toml_value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, np.ndarray):
        return _format_toml_value(value.tolist())
    if not isinstance(value, tuple | list):
        return repr(value)
    texts = map(repr if set(map(type, value)) == {float} else _format_toml_value, value)
    return f"[{', '.join(texts)}]"


def build_body_from_table(table: object, locations: Mapping[str, str]) -> Body:
    """Build the body described by a TOML table.

    It has the parameters of Body, or a table with those of one constructor and perhaps a rotor. The
    key "wheel" has the arguments of with_wheel, or a list of them. `locations` says where keys of
    other tables belong.
    """
    words = dict(require_toml_table("body", table))
    if "wheel" in words:
        given = words.pop("wheel")
        body = build_body_from_table(words, locations)
        for one in given if isinstance(given, list) else [given]:
            wheel = require_toml_table("wheel", one)
            body = call_constructor_with_table(body.with_wheel, "[body.wheel]", wheel, WHEEL, {})
        return body
    if not BODIES.keys() & words.keys():
        return call_constructor_with_table(Body, "[body]", words, BODY, locations, BODIES)
    rotor: Any = words.pop("rotor", None)
    keys = [word for word in words if word in locations]
    if len(words) > 1 and not keys:
        raise ValueError(f"[body] must be described in one way, not by {', '.join(words)}")
    if keys:
        raise ValueError(f"{keys[0]} belongs {locations[keys[0]]}")
    ((name, value),) = words.items()
    table = require_toml_table(name, value)
    make: Callable[..., Body] = getattr(Body, name)
    body = call_constructor_with_table(make, f"[body] {name}", table, BODIES[name], locations)
    return body if rotor is None else replace(body, rotor=rotor)
