"""The plan of a sweep in TOML: the words of kreisel.sweep, and a table that tells the tops.

    t = 100                          # or a list, or { from = 0, to = 100, n = 101 }
    scene = "sleeping"               # a scene with a name, or a file; or a table [scene]
    [reduce]
    nutation = ["min", "max"]
    [grid]                           # or [random], [scatter], [columns]: the makers of Source
    spin = { from = 0, to = 20, n = 1000 }
    tilt = { from = 0, to = 1, n = 1000 }

A name of a file is looked for beside the plan. Events are tables [[events]], with the name of their
maker as `event` and its words. With verb = "section" the plan has no t, and a table [event] of the
same kind; with "lyapunov", "megno" or "oli" it has the words of these.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._model.scene import Scene, build_from_table
from .._model.toml import check_table, parse_tables, read
from .._utils.errors import unknown_name_message
from .._utils.validation import as_float, as_int, short_repr
from ..events import MAKERS, Event
from ..scenes import about, get_scene
from .source import Source
from .sweep_plan import SweepPlan, make_plan
from .task import WORDS, parse_task

_MAKERS: dict[str, Callable[..., Source]] = {
    "grid": Source.grid,
    "random": Source.random,
    "scatter": Source.scatter,
    "columns": Source.columns,
}
_WORDS = ["verb", *WORDS, "part"]


def from_file(file: Path) -> SweepPlan:
    """The plan in a file; TypeError or ValueError, with the file's name, for what is none."""
    return read(file, lambda text: _plan(parse_tables(text), file.parent))


def _plan(told: dict[str, Any], beside: Path) -> SweepPlan:
    for name in told:
        if name not in (*_WORDS, *_MAKERS, "scene"):
            raise ValueError(
                unknown_name_message("key in a plan:", name, [*_WORDS, *_MAKERS, "scene"])
            )
    words = {name: told[name] for name in WORDS if name in told}
    if "t" in words:
        words["t"] = _values("t", words["t"])
    if "events" in words:
        words["events"] = [_event(row) for row in _rows(words["events"])]
    if "event" in words:
        words["event"] = _event(dict(check_table("event", words["event"])))
    if "reduce" in words:
        check_table("reduce", words["reduce"])
    asked = parse_task(told.get("verb", "solve"), words)
    return make_plan(_source(told, beside), asked, told.get("part"))


def _source(told: dict[str, Any], beside: Path) -> Source:
    chosen = [name for name in _MAKERS if name in told]
    if len(chosen) != 1:
        many = f"not {' and '.join(chosen)}" if chosen else "and there is none"
        raise ValueError(f"a plan has exactly one of the tables {', '.join(_MAKERS)}, {many}")
    if "scene" not in told:
        raise ValueError("a plan has a scene: a name, a file, or a table [scene]")
    scene, name = _scene(told["scene"], beside), chosen[0]
    words = {word: _values(word, value) for word, value in check_table(name, told[name]).items()}
    if name == "columns" and "file" in words:
        words["file"] = beside / str(words["file"])
    maker = _MAKERS[name]
    known = inspect.signature(maker).parameters
    if not any(each.kind is each.VAR_KEYWORD for each in known.values()):
        _refuse_unknown(name, words, [word for word in known if word != "scene"])
    for word, each in known.items():
        is_needed = each.default is each.empty and each.kind is each.POSITIONAL_OR_KEYWORD
        if is_needed and word not in ("scene", *words):
            raise ValueError(f"[{name}] has no {word}")
    return maker(scene, **words)


def _refuse_unknown(name: str, words: Mapping[str, Any], known: list[str]) -> None:
    for word in words:
        if word not in known:
            raise ValueError(unknown_name_message(f"key in [{name}]:", word, known))


def _scene(told: object, beside: Path) -> Scene:
    if isinstance(told, str):
        return get_scene(told) if told in about else Scene.from_toml(beside / told)
    return build_from_table(dict(check_table("scene", told)))


def _values(name: str, told: object) -> Any:
    """A value or a list of values, or the evenly spaced ones of a table from, to, n."""
    if not isinstance(told, dict):
        return told
    _refuse_unknown(name, told, ["from", "to", "n"])
    missing = {"from", "to", "n"} - told.keys()
    if missing:
        raise ValueError(f"{name} has no {sorted(missing)[0]}: it goes from one value to another")
    ends = (np.asarray(told[end], dtype=np.float64) for end in ("from", "to"))
    begin, end = (as_float(name, one[()]) if not one.ndim else one for one in ends)
    return np.linspace(begin, end, as_int(f"n of {name}", told["n"], 1))


def _rows(told: object) -> list[dict[str, Any]]:
    if not isinstance(told, list):
        raise TypeError(f"events are tables [[events]], not {short_repr(told)}")
    return [dict(check_table("events", row)) for row in told]


def _event(row: dict[str, Any]) -> Event:
    name = row.pop("event", None)
    if name not in MAKERS:
        raise ValueError(unknown_name_message("event", str(name), MAKERS))
    try:
        return MAKERS[name](**row)
    except (TypeError, ValueError) as error:
        said = str(error).replace(f"{name}()", "it")
        raise ValueError(f"event {name}: {said}") from None
