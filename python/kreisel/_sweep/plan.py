"""Plans of sweeps, their tasks, and the tables of their parts."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path as File
from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

from .._model.parameters import BatchParameter
from .._model.scene import Ensemble, Scene, build_scene_from_table
from .._model.toml import parse_toml_tables, parse_toml_text_or_file, require_toml_table
from .._options.options import ARGUMENTS as OPTIONS
from .._options.options import (
    RECORDABLE,
    TIME,
    Options,
    get_total_memory,
    make_options,
    validate_times,
)
from .._results.buffers import LANES
from .._results.path import Events, Path
from .._results.paths import Reductions, run_ensemble
from .._results.tables import TableColumn, list_quantity_columns
from .._solve.chaos import INDICATORS, Chaos, chaos, validate_chaos_arguments
from .._solve.section import Section, section, validate_section_arguments, validate_section_event
from .._solve.solve import select_slice_runner
from .._utils.arguments import (
    Array,
    as_float,
    as_int,
    get_parameter_unit,
    short_repr,
    suggest_name,
    unknown_name_message,
)
from .._utils.processes import Progress, WorkerPool
from ..events import MAKERS, Event, refuse_kinetic
from ..scenes import about, get_scene
from .source import Places, RandomSpec, Source, list_parameter_component_names

TaskName = Literal["solve", "chaos", "lyapunov", "megno", "oli", "section"]
TaskResult = Path | Reductions | Chaos | Section


@dataclass(frozen=True)
class SweepTask:
    """The kreisel function that is called for all tops, and its arguments.

    arguments  those that are not None or that are stored in the plan, except `options`
    options    the other arguments of kreisel.solve or kreisel.reduce
    """

    name: TaskName
    arguments: Mapping[str, Any]
    options: Options | None = None

    @property
    def as_json(self) -> dict[str, Any]:
        words = {name: value for name, value in self.arguments.items() if value is not None}
        if self.options is not None:
            given = {n: v for n, v in self.options.to_json().items() if v is not None}
            solve = {name: given[name] for name in _SOLVE_ARGUMENTS if name in given}
            return {**words, "method": self.options.requested_method, "solve": solve}
        if "event" in words:
            words["event"] = words["event"]._to_json()
        return {self.name: words}

    def normalize_arguments(self, options: Options) -> SweepTask:
        """Return the task in canonical form, so that equivalent arguments lead to equal plans."""
        words = dict(self.arguments)
        for name in {"t", "direction", "tol", "max_wait"} & words.keys():
            if words[name] is not None:
                words[name] = np.asarray(words[name], dtype=np.float64).tolist()
        for name in {"n", "max_steps"} & words.keys():
            words[name] = int(words[name])
        if self.name == "section":
            words |= {"event": validate_section_event(words["event"]), "digits": options.digits}
        return replace(self, arguments=words)

    def validate_options_and_times(self, tops: Ensemble) -> tuple[Options, Array]:
        """Return the options and the requested times; for a section, n times the longest wait."""
        if self.options is not None:
            options = self.options.for_tops(tops)
            refuse_kinetic(tops, options.events or ())
            return options, validate_times(tops, self.arguments["t"], options)
        if self.name == "section":
            waits, options = validate_section_arguments(tops, **self.arguments)
            return options, waits[0]
        times, options, _ = validate_chaos_arguments(tops, **self.arguments)
        return options, times

    def compute_results_of_tops(
        self,
        tops: Ensemble,
        options: Options,
        times: Array,
        threads: int,
        progress: Progress | None,
    ) -> TaskResult:
        """Run the task; refuse the first top to which it does not apply."""
        if self.options is None:
            function: Callable[..., TaskResult] = section if self.name == "section" else chaos
            done = function(tops, **self.arguments, threads=threads, progress=progress)
            return done
        if not (options.is_auto or options.has_step_search):
            options.for_tops(tops)
        kind: Any = Reductions if options.reductions else Path._of_many
        runner = LANES if options.reductions else select_slice_runner(options)
        pool = WorkerPool(threads)
        result: TaskResult = run_ensemble(kind, tops, times, options, pool, runner, progress)
        return result


_CHAOS = ("chaos", *INDICATORS)  # all indicators, or one
# Parts of a sweep are tables, which cannot store tangents.
_SOLVE_ARGUMENTS = tuple(name for name in OPTIONS if name != "tangents")
_OF_CHAOS = {"t": None, "direction": None, "tol": None, "max_steps": 0}
_OF_SECTION = {"event": None, "n": 500, "max_wait": None, "tol": None, "digits": None}
_DEFAULTS: dict[str, dict[str, Any]] = {  # {task: the arguments with their defaults}
    "solve": {"t": None, "method": "auto", **dict.fromkeys(_SOLVE_ARGUMENTS)},
    **dict.fromkeys(_CHAOS, _OF_CHAOS),
    "section": {**_OF_SECTION, "max_steps": 0},
}
ARGUMENTS = tuple(dict.fromkeys(name for names in _DEFAULTS.values() for name in names))


def build_task_from_arguments(task: Any, arguments: Mapping[str, Any]) -> SweepTask:
    """Return a task, each of whose arguments has the same value for all tops of the sweep."""
    if not isinstance(task, str) or task not in _DEFAULTS:
        raise ValueError(unknown_name_message("task", str(task), list(_DEFAULTS)))
    defaults, name = _DEFAULTS[task], cast(TaskName, task)
    for word in arguments:
        if word not in defaults:
            raise ValueError(f"{task} has no argument {word!r}: it has {', '.join(defaults)}")
    if "t" in defaults and "t" not in arguments:
        raise TypeError("t is missing: give the final time or a list of times")
    if np.ndim(arguments.get("t", 0.0)) > 1:
        raise ValueError("t must be a number or a list of times, the same for all tops of a sweep")
    if np.ndim(arguments.get("max_wait", 0.0)):
        raise ValueError("max_wait must be a number, the same for all tops of a sweep")
    if task != "solve":
        return SweepTask(name, {**defaults, **arguments})
    words = {"method": "auto", **arguments}
    t, method = words.pop("t"), words.pop("method")
    if not isinstance(method, str):
        raise TypeError(f"method must be the name of a method, not {short_repr(method)}")
    return SweepTask(name, {"t": t}, make_options(method, **words))


def build_task_from_dict(plan: Mapping[str, Any]) -> SweepTask:
    task = next((name for name in _DEFAULTS if name in plan), "solve")
    arguments: dict[str, Any] = dict(plan[task])
    if task == "solve":
        method = {"method": plan["method"], "asked": plan["method"]}
        words = dict.fromkeys(_SOLVE_ARGUMENTS) | {"max_steps": 0} | arguments | method
        return SweepTask("solve", {"t": plan["t"]}, Options.from_json(words))
    if "event" in arguments:
        arguments["event"] = Event._from_json(arguments["event"])
    return build_task_from_arguments(task, arguments)


FORMAT = 1  # version of the layout of plans and parts
_MAX_PART, _PART_BYTES = 1 << 17, 1 << 26  # default limits of tops and bytes in a part
MAX_INLINE = 1 << 16  # numbers in an array; a longer array is stored in a separate file
_ROW_BYTES = 64  # estimated bytes per top for its index, parameters and status


@dataclass(frozen=True, eq=False)
class SweepPlan:
    """The plan of a sweep: a source of tops, a task, and the number of tops per part.

    `sample` contains the indices and the ensemble of the tops on which the plan was validated.
    """

    source: Source
    task: SweepTask
    part_size: int
    options: Options
    times: Array
    sample: tuple[Places, Ensemble]

    @cached_property
    def states(self) -> int:
        return int(self.times.size)

    @cached_property
    def parts(self) -> int:
        return -(-self.source.size // self.part_size)

    def list_tops_of_part(self, i: int) -> range:
        begin = i * self.part_size
        return range(begin, min(begin + self.part_size, self.source.size))

    @cached_property
    def as_json(self) -> dict[str, Any]:
        source = self.source
        random = source._random
        plan: dict[str, Any] = {
            "format": FORMAT,
            "scene": source.scene.to_toml(),
            "shape": list(source.shape),
            "axes": list(source.axes),
            "parameters": list(map(_encode_parameter, source._parameters.values())),
            "varied": [
                name if source._parameters.get(name) is one else _encode_parameter(one)
                for name, one in source._varied.items()
            ],
            "flags": dict(source._flags),
            "part_size": self.part_size,
        } | self.task.as_json
        if random is not None:
            plan["random"] = {
                "seed": random.seed,
                "ranges": list(map(_encode_parameter, random.ranges.values())),
                "widths": dict(random.widths),
            }
        return plan

    @cached_property
    def hash(self) -> str:
        return hash_plan(self.as_json)

    def build_ensemble_of_tops(self, tops: range) -> Ensemble:
        """Return an ensemble of the tops with these indices: the sample, if it is these tops."""
        places, ensemble = self.sample
        if len(places) == len(tops) and (places[0], places[-1]) == (tops[0], tops[-1]):
            return ensemble
        return self.source[tops.start : tops.stop]

    def compute_results_of_tops(
        self, tops: range, threads: int, progress: Progress | None
    ) -> TaskResult:
        """Run the task on these tops; errors name the index of the first invalid top."""
        try:
            ensemble = self.build_ensemble_of_tops(tops)
            return self.task.compute_results_of_tops(
                ensemble, self.options, self.times, threads, progress
            )
        except (TypeError, ValueError) as error:
            places = np.arange(tops.start, tops.stop, dtype=np.int64)
            raise self.source._find_error_of_first_invalid_top(
                self.task.validate_options_and_times, places, error
            ) from None


def hash_plan(plan: Mapping[str, Any]) -> str:
    """Return the SHA-256 hash of a plan's canonical JSON."""
    text = json.dumps(plan, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def make_file_name_from_array_hash(values: Array) -> str:
    """Return the file name of an array, which is derived from a hash of its shape and values."""
    digest = hashlib.sha256(str(values.shape).encode())
    digest.update(np.ascontiguousarray(values, dtype="<f8").data)
    return f"starts-{digest.hexdigest()}.npy"


def _encode_parameter(one: BatchParameter) -> list[Any]:
    """Return a parameter as JSON data; a long array is replaced by the name of its file."""
    is_long = one.values.size > MAX_INLINE
    values = make_file_name_from_array_hash(one.values) if is_long else one.values.tolist()
    return [one.name, list(one.value), values, *[True] * one.degrees]


def _decode_parameter(row: list[Any], load: Callable[[str], Array]) -> BatchParameter:
    name, value, numbers, *degrees = row
    values = load(numbers) if isinstance(numbers, str) else np.asarray(numbers, np.float64)
    if not np.isfinite(values).all():
        raise ValueError(f"{name} must be finite")
    return BatchParameter(name, values, tuple(value), bool(degrees))


def make_sweep_plan(source: Source, task: SweepTask, part_size: int | None = None) -> SweepPlan:
    """Return the plan for a sweep, after validating it on a sample of the tops."""
    sample = source._choose_validation_tops()
    try:
        ensemble = source._build_tops(sample)
        options, times = task.validate_options_and_times(ensemble)
    except (TypeError, ValueError) as error:
        raise source._find_error_of_first_invalid_top(
            task.validate_options_and_times, sample, error
        ) from None
    states = times.shape[-1]
    results = 8 * len(options.reductions) or states * (8 + options.bytes_per_state)
    row = _ROW_BYTES + results
    if part_size is None:
        size = max(1, min(_MAX_PART, _PART_BYTES // row))
    else:
        size = as_int("part_size", part_size, 1)
    byte_count = min(size, source.size) * row
    if byte_count > get_total_memory():
        raise MemoryError(
            f"a part of {size} tops with {states} states each needs {1e-9 * byte_count:.3g} GB, "
            "more than this machine has: use smaller parts, fewer times or fewer quantities"
        )
    return SweepPlan(
        source, task.normalize_arguments(options), size, options, times, (sample, ensemble)
    )


def build_plan_from_dict(plan: Mapping[str, Any], load: Callable[[str], Array]) -> SweepPlan:
    """Return the plan stored in a JSON object; `load` reads an array, given its file name."""
    try:
        parameters = {row[0]: _decode_parameter(row, load) for row in plan["parameters"]}
        varied = [
            parameters[row] if isinstance(row, str) else _decode_parameter(row, load)
            for row in plan["varied"]
        ]
        random = None
        if "random" in plan:
            spec = plan["random"]
            ranges = {row[0]: _decode_parameter(row, load) for row in spec["ranges"]}
            random = RandomSpec(spec["seed"], ranges, spec["widths"])
        source = Source(
            Scene.from_toml(plan["scene"]),
            tuple(plan["shape"]),
            tuple(plan["axes"]),
            parameters,
            {one.name: one for one in varied},
            plan["flags"],
            random,
        )
        result = make_sweep_plan(source, build_task_from_dict(plan), plan["part_size"])
    except (KeyError, TypeError) as error:
        raise ValueError(f"it is not a plan of a sweep: {error}") from None
    if result.hash != hash_plan(plan):
        raise ValueError("it is a plan in a format of another version")
    return result


Column = npt.NDArray[Any]
COUNT = "events"  # name of the column with the number of events of each top
_STATES = {"t": TIME, "q": RECORDABLE["q"], "m": RECORDABLE["m"]}
EVENT_STATE = [name for quantity in _STATES.values() for name in quantity.components]


@dataclass
class PartResults:
    """A table of the results and events of the tops in one part of a sweep.

    columns  {name: values (n,) or (n, k)} of the tops
    ragged   {name: values (e,)} of the events, sorted by top
    units    {name: dimension [M L T]}; an empty string for a dimensionless column
    """

    columns: dict[str, Column] = field(default_factory=dict)
    ragged: dict[str, Column] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)


def tabulate_sweep_part(plan: SweepPlan, tops: range, outcome: TaskResult) -> PartResults:
    """Return a table of the tops with the given indices, including their results."""
    results = [
        (name, values, column.unit)
        for column in _list_result_columns(plan.task.name, outcome)
        for name, values in column.split_components()
    ]
    names = [name for name, _, _ in results]
    part = PartResults({"top": np.arange(tops.start, tops.stop, dtype=np.int64)}, {}, {"top": ""})
    ensemble: Any = (
        plan.build_ensemble_of_tops(tops) if isinstance(outcome, Chaos) else outcome.scene
    )
    for name, one in plan.source._list_varying_values(tops.start, tops.stop, ensemble).items():
        flat = one.values.reshape(len(one.values), -1)
        for i, component in enumerate(list_parameter_component_names(name, one.value)):
            # A recorded quantity can have the name of a parameter, as spin with want=("spin",).
            column = f"{component}_given" if component in names else component
            part.columns[column], part.units[column] = (
                flat[:, i],
                get_parameter_unit(name, one.degrees, i),
            )
    for name, values, dimension in results:
        part.columns[name], part.units[name] = values, dimension
    if isinstance(outcome, Section):
        _add_event_columns(part, outcome)
    elif isinstance(outcome, Path) and outcome._options.requests_events:
        part.ragged = {"event_which": outcome.events.which}
        part.ragged |= {"event_direction": outcome.events.direction}
        _add_event_columns(part, outcome.events)
    return part


def _list_result_columns(task: str, outcome: TaskResult) -> list[TableColumn]:
    """Return the columns that contain the results of the tops, excluding their parameters."""
    top, time = ("top",), ("top", "time")
    if isinstance(outcome, Chaos):
        names = [task] if task in INDICATORS else [*INDICATORS]
        ends, curves = (
            [
                TableColumn(
                    name + ending, dims, getattr(outcome, name + ending), INDICATORS[name][0]
                )
                for name in names
            ]
            for dims, ending in ((top, ""), (time, "_curve"))
        )
        verdict = ("certificate", "is_chaotic", "is_doubtful")
        times = np.broadcast_to(outcome.t, (outcome.size, outcome.t.size))
        return [
            TableColumn("status", top, outcome._buffers.status),
            *ends,
            *(TableColumn(name, top, getattr(outcome, name)) for name in verdict),
            TableColumn("t", time, times, TIME.dimension),
            *curves,
        ]
    result: Any = outcome._many if isinstance(outcome, Path) else outcome
    buffers = result._buffers
    columns = [
        TableColumn("status", top, buffers.status),
        TableColumn("reached", top, buffers.reached, TIME.dimension),
        TableColumn("steps", top, buffers.counts[:, 0]),
    ]
    if isinstance(outcome, Reductions):
        columns += outcome._list_columns()
    elif isinstance(outcome, Path):
        t, *quantities = list_quantity_columns(outcome, axes=top)
        times = np.broadcast_to(t.values, (outcome.size, t.values.shape[-1]))
        columns += [t._replace(dims=time, values=times), *quantities]
    return columns


def _add_event_columns(part: PartResults, events: Events | Section) -> None:
    """Add columns that contain the recorded events and the number of events of each top."""
    part.columns[COUNT], part.units[COUNT] = np.asarray(events.count), ""
    for name, quantity in _STATES.items():
        values = getattr(events, name).reshape(-1, quantity.doubles)
        for i, component in enumerate(quantity.components):
            part.ragged[f"event_{component}"] = values[:, i]
            part.units[f"event_{component}"] = quantity.dimension


_CONSTRUCTORS: dict[str, Callable[..., Source]] = {
    "grid": Source.grid,
    "random": Source.random,
    "scatter": Source.scatter,
    "columns": Source.columns,
}
_KEYS = ["task", *ARGUMENTS, "part_size"]


def read_sweep_plan(file: File) -> SweepPlan:
    return parse_toml_text_or_file(
        file, lambda text: _build_plan_from_tables(parse_toml_tables(text), file.parent)
    )


def _build_plan_from_tables(tables: dict[str, Any], folder: File) -> SweepPlan:
    for name in tables:
        if name not in (*_KEYS, *_CONSTRUCTORS, "scene"):
            raise ValueError(
                unknown_name_message("key in a plan:", name, [*_KEYS, *_CONSTRUCTORS, "scene"])
            )
    arguments = {name: tables[name] for name in ARGUMENTS if name in tables}
    if "t" in arguments:
        arguments["t"] = _expand_range_to_values("t", arguments["t"])
    if "events" in arguments:
        rows = arguments["events"]
        if not isinstance(rows, list):
            raise TypeError(f"events must be tables [[events]], not {short_repr(rows)}")
        arguments["events"] = [_build_event_from_table("events", row) for row in rows]
    if "event" in arguments:
        arguments["event"] = _build_event_from_table("event", arguments["event"])
    if "reduce" in arguments:
        require_toml_table("reduce", arguments["reduce"])
    task = build_task_from_arguments(tables.get("task", "solve"), arguments)
    return make_sweep_plan(
        _build_sweep_source_from_tables(tables, folder), task, tables.get("part_size")
    )


def _build_sweep_source_from_tables(tables: dict[str, Any], folder: File) -> Source:
    names = [name for name in _CONSTRUCTORS if name in tables]
    if len(names) != 1:
        finding = f"not {' and '.join(names)}" if names else "and there is none"
        raise ValueError(
            f"a plan must have exactly one of the tables {', '.join(_CONSTRUCTORS)}, {finding}"
        )
    if "scene" not in tables:
        raise ValueError("a plan needs a scene: a name, a file, or a table [scene]")
    place, name = tables["scene"], names[0]
    if not isinstance(place, str):
        scene = build_scene_from_table(dict(require_toml_table("scene", place)))
    elif place in about:
        scene = get_scene(place)
    else:
        try:
            scene = Scene.from_toml(folder / place)
        except FileNotFoundError:
            hint = suggest_name(place, about)
            raise ValueError(f"there is no file or named scene {place!r}; {hint}") from None
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


def _build_event_from_table(key: str, value: object) -> Event:
    row: dict[str, Any] = dict(require_toml_table(key, value))
    name = row.pop("event", None)
    if name not in MAKERS:
        raise ValueError(unknown_name_message("event", str(name), MAKERS))
    try:
        return MAKERS[name](**row)
    except (TypeError, ValueError) as error:
        text = str(error).replace(f"{name}()", "it")
        raise ValueError(f"event {name}: {text}") from None
