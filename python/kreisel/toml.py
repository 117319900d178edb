"""Scenes as TOML files: the keys are the words of the constructors, the numbers are written with all their digits."""
from __future__ import annotations

import inspect
import os
import tomllib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar

from . import errors
from .body import Body
from .scene import Scene

_Made = TypeVar("_Made")
_MAKERS: dict[str, Callable[..., Body]] = {"cuboid": Body.cuboid, "symmetric": Body.symmetric, "from_com": Body.from_com}


def read(path: str | os.PathLike[str]) -> Scene:
    """A TypeError or ValueError begins with the name of the file."""
    try:
        return parse(Path(path).read_text(encoding="utf-8"))
    except (TypeError, ValueError) as error:
        kind = TypeError if isinstance(error, TypeError) else ValueError
        raise kind(f"{os.fspath(path)}: {error}") from None


def parse(text: str) -> Scene:
    table = tomllib.loads(text)
    if "body" not in table:
        raise ValueError("the table [body] is missing")
    return _call(Scene, "a scene", {**table, "body": _body(table["body"])})


def _body(table: Any) -> Body:
    if not isinstance(table, dict):
        raise TypeError(f"body must be a table, not {table!r}")
    makers = _MAKERS.keys() & table.keys()
    if not makers:
        return _call(Body, "[body]", table, others=_MAKERS.keys())
    if len(table) > 1:
        raise ValueError(f"[body] must be described in one way, not by {', '.join(table)}")
    (name, words), = table.items()
    if not isinstance(words, dict):
        raise TypeError(f"{name} must be a table, not {words!r}")
    return _call(_MAKERS[name], f"[body] {name}", words)


def _call(make: Callable[..., _Made], where: str, words: dict[str, Any], others: Iterable[str] = ()) -> _Made:
    parameters = inspect.signature(make).parameters
    for word in words:
        if word not in parameters:
            raise ValueError(errors.unknown(f"key in {where}:", word, [*parameters, *others]))
    for name, parameter in parameters.items():
        if parameter.default is parameter.empty and name not in words:
            raise ValueError(f"{where} has no {name}")
    return make(**words)


def write(scene: Scene, path: str | os.PathLike[str] | None) -> str:
    scene_words = {"momentum": scene.momentum, "attitude": scene.attitude, "gravity": scene.gravity}
    body = scene.body
    body_words = {"mass": body.mass, "inertia": body.inertia, "com": body.com}
    text = _lines(scene_words) + "\n[body]\n" + _lines(body_words)
    if path is not None:
        Path(path).write_text(text, encoding="utf-8")
    return text


def _lines(words: dict[str, Any]) -> str:
    return "".join(f"{name} = {_value(value)}\n" for name, value in words.items())


def _value(value: Any) -> str:
    return f"[{', '.join(map(_value, value))}]" if isinstance(value, tuple) else repr(value)
