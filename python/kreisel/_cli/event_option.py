"""Parsing of events given on the command line as NAME[:ARGUMENT...][:WORD=VALUE...]."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable

from .._model.scene import Scene
from .._utils.errors import suggest_name
from ..events import MAKERS, Event
from .parsers import UsageError, parse_number_list

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
