"""Saved paths."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, fields, replace
from typing import Any, BinaryIO

import numpy as np

from .._core import tangents as TANGENTS
from .._core import version
from .._model.scene import Ensemble, parse_scene_toml
from .._options.options import (
    LOW,
    QUANTITIES,
    RECORDABLE,
    Options,
    QuantityDescription,
    validate_requested_quantities,
)
from .._options.plan import StepChoice
from .._utils.arguments import Array, as_float, as_int, short_repr
from .._utils.files import ArchiveReader, Integers, pack_archive
from .buffers import STATUSES, EnsembleBuffers, EventColumns
from .error import NO_STATES, RunStart, Stats, TangentData

_FORMAT = 1  # version of the archive's layout: the header's entries and the names of the arrays
_EVENTS = "events_"
_MET = "which", "direction"


PathArguments = dict[str, Any]  # keyword arguments of kreisel.Path


def encode_as_archive(path: Any) -> bytes:
    """Return the archive of a kreisel.Path, as described in Path.save."""
    head = {"kreisel": version, "format": _FORMAT, **path._options.to_json()}
    if path._is_many:
        return _encode_many(head, path.scene, path._t, path._buffers)
    data, events, choice = path._tangent_data, path._events, path._choice
    head |= {
        "step": path.step,
        "low": path._low is not None,
        "start": path._origin.to_json(),
        "stats": path.stats,
        "choice": choice and asdict(choice),
        "tangents": data and {"by": data.by, "rest": data.truncation},
        "events": None
        if events is None
        else {"want": events.path.want, "low": events.path._low is not None},
    }
    arrays: dict[str, Array | Integers] = dict(_get_state_arrays_by_name(path, ""))
    if data:
        arrays |= {"tangents": data.high, "tangents_low": data.low}
    if events is not None:
        arrays |= _get_state_arrays_by_name(events.path, _EVENTS)
        arrays |= {_EVENTS + name: getattr(events, name) for name in _MET}
    return pack_archive({"head": json.dumps(head), "scene": path.scene.to_toml()}, arrays)


SavedEnsemble = tuple[Ensemble, Array, Options, EnsembleBuffers]


def _encode_many(head: dict[str, Any], tops: Ensemble, t: Array, buffers: EnsembleBuffers) -> bytes:
    events = [np.concatenate(column) for column in zip(*buffers.events, strict=True)]
    given = {f"given_{name}": np.asarray(values) for name, values in tops.coords.items()}
    head |= {
        "shape": tops.shape,
        "scenes": [scene.to_toml() for scene in tops.ravel()],
        "names": tops._names,
        "given": {name: values.shape for name, values in given.items()},
        "in_degrees": tops._in_degrees,
        "times": t.shape,
        "last": [[i, *states.shape] for i, states in buffers.last.items()],
        "chosen": [[i, asdict(choice)] for i, choice in buffers.chosen.items()],
        "messages": list(buffers.messages.items()),
        "event_count": len(events[0]) if events else 0,
    }
    arrays: dict[str, Any] = {"t": t, **buffers.get_allocated_arrays_by_name(), **given}
    arrays |= {f"column_{name}": column for name, column in buffers.columns.items()}
    arrays |= {f"last_{i}": states for i, states in buffers.last.items()}
    if events:
        names = [_EVENTS + name for name in EventColumns._fields]
        arrays |= zip(names, events, strict=True)
    # Doubles hold the integers of all arrays exactly.
    doubles = {name: np.asarray(array, np.float64) for name, array in arrays.items()}
    return pack_archive({"head": json.dumps(head)}, doubles)


def _read_saved_ensemble(archive: ArchiveReader, head: dict[str, Any]) -> SavedEnsemble:
    scenes = [parse_scene_toml(text) for text in head["scenes"]]
    tops, options = Ensemble.of(scenes).reshape(tuple(head["shape"])), Options.from_json(head)
    varied = {
        name.removeprefix("given_"): archive.read_archive_doubles(name, *shape)
        for name, shape in head["given"].items()
    }
    if len(head["names"]) != tops.ndim:
        raise ValueError("its dimensions have no names")
    vars(tops).update(_names=tuple(head["names"]), _varied=varied)
    vars(tops)["_in_degrees"] = bool(head["in_degrees"])
    t = archive.read_archive_doubles("t", *head["times"])
    if t.ndim not in (1, 2) or (t.ndim == 2 and len(t) != tops.size):
        raise ValueError("its times have the wrong shape")
    buffers = EnsembleBuffers.allocate_buffers(tops.size, t.shape[-1], options)
    arrays = buffers.get_allocated_arrays_by_name()
    arrays |= {f"column_{name}": column for name, column in buffers.columns.items()}
    for name, array in arrays.items():
        array[...] = archive.read_archive_doubles(name, *array.shape)
    is_known = (buffers.status >= 0) & (buffers.status < len(STATUSES))
    if not (is_known & (buffers.done >= 0) & (buffers.done <= t.shape[-1])).all():
        raise ValueError("the statuses of its tops are damaged")
    for i, *shape in head["last"]:
        if shape not in ([1, 8], [2, 8]):
            raise ValueError("its last states have the wrong shape")
        buffers.last[int(i)] = archive.read_archive_doubles(f"last_{i}", *shape)
    for i, choice in head["chosen"]:
        buffers.chosen[int(i)] = _build_step_choice_from_dict(choice)
    buffers.messages = {int(i): str(text) for i, text in head["messages"]}
    k = as_int("event_count", head["event_count"], 0)
    if options.requests_events:
        integers: Any = (
            archive.read_archive_doubles(_EVENTS + name, k).astype(kind)
            for name, kind in (("top", np.int64), ("which", np.intc), ("direction", np.intc))
        )
        top, which, direction = integers
        if k and not (top.min() >= 0 and top.max() < tops.size and which.min() >= 0):
            raise ValueError("its events are damaged")
        states, low = (
            archive.read_archive_doubles(_EVENTS + name, k, 8) for name in ("states", "low")
        )
        buffers.events = [EventColumns(top, states, low, which, direction)]
    return tops, t, options, buffers


def _get_state_arrays_by_name(path: Any, prefix: str) -> dict[str, Array]:
    if path._columns is not None:
        arrays = path._columns
    else:
        arrays = {name: getattr(path, name) for name in ("t", "q", "m")}
        if path._low is not None:
            arrays |= {name: getattr(path, name) for name in LOW}
    return {prefix + name: array for name, array in arrays.items()}


def read_saved_path_arguments(
    file: BinaryIO, size: int
) -> SavedEnsemble | tuple[PathArguments, tuple[PathArguments, Integers, Integers] | None]:
    """Read a path with its events (path, indices, directions), or the results of an ensemble."""
    archive = ArchiveReader(file, size)
    try:
        head = _require_json_object(json.loads(archive.read_archive_text("head")))
        if as_int("format", head["format"], 1) != _FORMAT:
            raise ValueError(f"its format {head['format']} belongs to a later version of kreisel")
        if "scenes" in head:
            return _read_saved_ensemble(archive, head)
        scene = parse_scene_toml(archive.read_archive_text("scene"))
        if not isinstance(head["stats"], list):
            raise TypeError("stats must be a list of numbers")
        step = None if head["step"] is None else as_float("step", head["step"])
        recorded = {"step": step and abs(step), "want": None, "events": None, "tangents": None}
        options = Options.from_json(head | recorded).with_heading(scene)
        choice, events = head["choice"], head["events"]
        words: PathArguments = {
            "scene": scene,
            "stats": Stats(*(as_int("a number of the stats", n, 0) for n in head["stats"])),
            "_options": options if events is None else replace(options, events=()),
            "_is_back": step is not None and step < 0.0,
            "_choice": None if choice is None else _build_step_choice_from_dict(choice),
            "_origin": RunStart.from_json(head.get("start")),
        }
        path = words | _read_path_arrays(archive, "", words["_options"], head)
        if head.get("tangents") is not None:
            path["_tangent_data"] = _read_tangents_from_archive(
                archive, len(path["states"]), head["tangents"]
            )
        if events is None:
            return path, None
        rows = _read_path_arrays(archive, _EVENTS, words["_options"], _require_json_object(events))
    except (KeyError, RecursionError, TypeError) as error:
        raise ValueError(f"its header is damaged: {error}") from None
    n = len(rows["_columns"]["t"] if "_columns" in rows else rows["states"])
    which, direction = (archive.read_archive_integers(_EVENTS + name, n) for name in _MET)
    if not (np.abs(direction) == 1).all() or which.min(initial=0) < 0:
        raise ValueError("its events are damaged")
    return path, (words | rows, which, direction)


def _require_json_object(value: object) -> dict[str, object]:
    if not isinstance(value, dict):
        raise TypeError(f"{short_repr(value)} is not a table")
    return value


def _build_step_choice_from_dict(head: object) -> StepChoice:
    words = _require_json_object(head)
    for field in fields(StepChoice):
        if type(words[field.name]).__name__ != field.type:
            raise TypeError(
                f"choice.{field.name} = {short_repr(words[field.name])} is not a {field.type}"
            )
    make: Callable[..., StepChoice] = StepChoice
    return make(**words)


def _read_tangents_from_archive(archive: ArchiveReader, n: int, head: object) -> TangentData:
    words = _require_json_object(head)
    names, rest = words["by"], as_float("rest", words["rest"])
    if (
        not isinstance(names, list)
        or not names
        or names != [name for name in TANGENTS if name in names]
    ):
        raise ValueError(f"its tangents have the invalid columns {short_repr(names)}")
    shape = n, 6, sum(TANGENTS[name][1] for name in names)
    high, low = (
        archive.read_archive_doubles(name, *shape) for name in ("tangents", "tangents_low")
    )
    return TangentData.from_flat_arrays(high, low, rest, tuple(names))


def _read_path_arrays(
    archive: ArchiveReader, prefix: str, options: Options, head: dict[str, object]
) -> PathArguments:
    def read(t: Array, quantities: Iterable[QuantityDescription]) -> list[Array]:
        return [
            archive.read_archive_doubles(prefix + each.name, len(t), *each.shape)
            for each in quantities
        ]

    want, is_low = head["want"], head["low"]
    if not isinstance(is_low, bool):
        raise TypeError(f"low must be true or false, not {short_repr(is_low)}")
    t = archive.read_archive_doubles(f"{prefix}t", None)
    if want is not None:
        names = validate_requested_quantities(want) or ()
        columns = {"t": t} | dict(
            zip(names, read(t, [RECORDABLE[name] for name in names]), strict=True)
        )
        options = replace(options, want=names)
        return {"states": NO_STATES, "_options": options, "_columns": columns}
    low = np.column_stack([np.zeros(len(t)), *read(t, LOW.values())]) if is_low else None
    states = np.column_stack([t, *read(t, [QUANTITIES["q"], QUANTITIES["m"]])])
    return {"states": states, "_low": low}
