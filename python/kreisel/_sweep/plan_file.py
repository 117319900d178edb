"""Sweep plans in TOML: the arguments of kreisel.sweep, and a table that describes the tops.

    t = 100                          # or a list, or { from = 0, to = 100, n = 101 }
    scene = "sleeping"               # the name of a scene, or a file; or a table [scene]
    [reduce]
    nutation = ["min", "max"]
    [grid]                           # or [random], [scatter], [columns]: constructors of Source
    spin = { from = 0, to = 20, n = 1000 }
    tilt = { from = 0, to = 1, n = 1000 }

File names are relative to the folder of the plan file. In each table [[events]], `event` is the
name of a function of kreisel.events, and the other entries are the arguments of this function. If
task = "section", the entry t is omitted, and a single table [event] replaces [[events]]. If task =
"lyapunov", "megno" or "oli", the plan contains the arguments of the kreisel function with that
name.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._model.scene import Scene, build_scene_from_table
from .._model.toml import parse_toml_tables, parse_toml_text_or_file, require_toml_table
from .._utils.errors import suggest_name, unknown_name_message
from .._utils.validation import as_float, as_int, short_repr
from ..events import MAKERS, Event
from ..scenes import about, get_scene
from .source import Source
from .sweep_plan import SweepPlan, make_sweep_plan
from .task import ARGUMENTS, build_task_from_arguments

_CONSTRUCTORS: dict[str, Callable[..., Source]] = {
    "grid": Source.grid,
    "random": Source.random,
    "scatter": Source.scatter,
    "columns": Source.columns,
}
_KEYS = ["task", *ARGUMENTS, "part_size"]


def read_sweep_plan(file: Path) -> SweepPlan:
    """Read a plan from a file.

    Raises TypeError or ValueError if the plan is invalid; the message states the file name.
    """
    return parse_toml_text_or_file(
        file, lambda text: _build_plan_from_tables(parse_toml_tables(text), file.parent)
    )


def _build_plan_from_tables(tables: dict[str, Any], folder: Path) -> SweepPlan:
    for name in tables:
        if name not in (*_KEYS, *_CONSTRUCTORS, "scene"):
            raise ValueError(
                unknown_name_message("key in a plan:", name, [*_KEYS, *_CONSTRUCTORS, "scene"])
            )
    arguments = {name: tables[name] for name in ARGUMENTS if name in tables}
    if "t" in arguments:
        arguments["t"] = _expand_range_to_values("t", arguments["t"])
    if "events" in arguments:
        arguments["events"] = [
            _build_event_from_table(row) for row in _validate_event_tables(arguments["events"])
        ]
    if "event" in arguments:
        arguments["event"] = _build_event_from_table(
            dict(require_toml_table("event", arguments["event"]))
        )
    if "reduce" in arguments:
        require_toml_table("reduce", arguments["reduce"])
    task = build_task_from_arguments(tables.get("task", "solve"), arguments)
    return make_sweep_plan(
        _build_sweep_source_from_tables(tables, folder), task, tables.get("part_size")
    )


def _build_sweep_source_from_tables(tables: dict[str, Any], folder: Path) -> Source:
    names = [name for name in _CONSTRUCTORS if name in tables]
    if len(names) != 1:
        finding = f"not {' and '.join(names)}" if names else "and there is none"
        raise ValueError(
            f"a plan must have exactly one of the tables {', '.join(_CONSTRUCTORS)}, {finding}"
        )
    if "scene" not in tables:
        raise ValueError("a plan needs a scene: a name, a file, or a table [scene]")
    scene, name = _build_scene_of_plan(tables["scene"], folder), names[0]
    table = require_toml_table(name, tables[name])
    arguments = {key: _expand_range_to_values(key, value) for key, value in table.items()}
    if name == "columns" and "file" in arguments:
        arguments["file"] = folder / str(arguments["file"])
    constructor = _CONSTRUCTORS[name]
    parameters = inspect.signature(constructor).parameters
    if not any(each.kind is each.VAR_KEYWORD for each in parameters.values()):
        _check_argument_names(name, arguments, [key for key in parameters if key != "scene"])
    for key, each in parameters.items():
        is_needed = each.default is each.empty and each.kind is each.POSITIONAL_OR_KEYWORD
        if is_needed and key not in ("scene", *arguments):
            raise ValueError(f"[{name}] has no {key}")
    return constructor(scene, **arguments)


def _check_argument_names(name: str, arguments: Mapping[str, Any], candidates: list[str]) -> None:
    for key in arguments:
        if key not in candidates:
            raise ValueError(unknown_name_message(f"key in [{name}]:", key, candidates))


def _build_scene_of_plan(value: object, folder: Path) -> Scene:
    if isinstance(value, str):
        try:
            return get_scene(value) if value in about else Scene.from_toml(folder / value)
        except FileNotFoundError:
            raise ValueError(
                f"there is no file or named scene {value!r}; {suggest_name(value, about)}"
            ) from None
    return build_scene_from_table(dict(require_toml_table("scene", value)))


def _expand_range_to_values(name: str, value: object) -> Any:
    """Return the given values, or evenly spaced values if `value` is a table { from, to, n }."""
    if not isinstance(value, dict):
        return value
    _check_argument_names(name, value, ["from", "to", "n"])
    missing_keys = {"from", "to", "n"} - value.keys()
    if missing_keys:
        raise ValueError(
            f"{name} has no {sorted(missing_keys)[0]}: give the first and the last value"
        )
    ends = (np.asarray(value[end], dtype=np.float64) for end in ("from", "to"))
    begin, end = (as_float(name, one[()]) if not one.ndim else one for one in ends)
    return np.linspace(begin, end, as_int(f"n of {name}", value["n"], 1))


def _validate_event_tables(value: object) -> list[dict[str, Any]]:
    if not isinstance(value, list):
        raise TypeError(f"events must be tables [[events]], not {short_repr(value)}")
    return [dict(require_toml_table("events", row)) for row in value]


def _build_event_from_table(row: dict[str, Any]) -> Event:
    name = row.pop("event", None)
    if name not in MAKERS:
        raise ValueError(unknown_name_message("event", str(name), MAKERS))
    try:
        return MAKERS[name](**row)
    except (TypeError, ValueError) as error:
        text = str(error).replace(f"{name}()", "it")
        raise ValueError(f"event {name}: {text}") from None
