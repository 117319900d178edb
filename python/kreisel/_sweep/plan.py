"""Plans of sweeps, their tasks, and the tables of their parts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path as File
from typing import Any, Literal

import numpy as np

from .._model import toml
from .._model.parameters import BatchParameter, get_parameter_unit
from .._model.scene import Scene, build_scene_from_table
from .._options import options as options_of
from .._options.options import RECORDABLE, TIME, Options, get_total_memory
from .._results.calls import LANES, run_ensemble
from .._results.path import Path, Reductions
from .._results.results import RunResult
from .._results.tables import TableColumn, list_quantity_columns
from .._solve.chaos import INDICATORS, Chaos, chaos, validate_chaos_arguments
from .._solve.section import Section, section, validate_section_arguments, validate_section_event
from .._solve.solve import select_slice_runner
from .._utils import arguments as checks
from .._utils.arguments import Array, short_repr, unknown_name_message
from .._utils.processes import Progress, WorkerPool
from ..events import MAKERS, Event, refuse_kinetic
from ..scenes import about, get_scene
from .source import Places, Source, list_component_names

TaskName = Literal["solve", "chaos", "lyapunov", "megno", "oli", "section"]
# The arguments of kreisel.solve but t and method. Parts are tables, which cannot store tangents.
_SOLVE_ARGUMENTS = tuple(name for name in options_of.ARGUMENTS if name != "tangents")
_OF_CHAOS = {"t": None, "direction": None, "tol": None, "max_steps": 0}
_OF_SECTION = {"event": None, "n": 500, "max_wait": None, "tol": None, "digits": None}
_DEFAULTS: dict[str, dict[str, Any]] = {  # {task: the arguments with their defaults}
    "solve": {"t": None, "method": "auto", **dict.fromkeys(_SOLVE_ARGUMENTS)},
    **dict.fromkeys(("chaos", *INDICATORS), _OF_CHAOS),
    "section": {**_OF_SECTION, "max_steps": 0},
}
ARGUMENTS = tuple(dict.fromkeys(name for names in _DEFAULTS.values() for name in names))
_FORMAT = 1  # version of the layout of plans and parts
_MAX_PART, _PART_BYTES = 1 << 17, 1 << 26  # default limits of tops and bytes in a part
MAX_INLINE = 1 << 16  # numbers in an array; a longer array is stored in a separate file
_SAMPLE_SIZE = 1 << 10  # approximate number of tops on which a plan is validated
_ROW_BYTES = 64  # estimated bytes per top for its index, parameters and status
# The dimensions of the columns of a part, which have one value per top, time of a top, or event.
TOP, TIMES, EVENT = ("top",), ("top", "time"), ("event",)
COUNT = "events"  # name of the column with the number of events of each top
_STATES = {"t": TIME, "q": RECORDABLE["q"], "m": RECORDABLE["m"]}
EVENT_STATE = [name for quantity in _STATES.values() for name in quantity.components]
# The states of the file of a part; a folder, or a complete part of another plan, is foreign.
DONE, MISSING, DAMAGED, OLD = "done", "missing", "damaged", "of another version"
FOREIGN = "foreign"
REPAIR = (
    "repeating the call of kreisel.sweep replaces it, and read_sweep(folder, partial=True) skips it"
)


class SweepPlan:
    """The plan of a sweep: a source of tops, a task, and the number of tops per part.

    It is validated on a sample of the tops.

    task       the kreisel function that is called for all tops
    arguments  its arguments in canonical form, so that equivalent ones lead to equal plans; for
               "solve" only t. Each has the same value for all tops
    requested  for "solve" the other arguments of kreisel.solve or kreisel.reduce
    options    the validated options of the runs, and `times` the requested times; for a section n
               times the longest wait
    """

    def __init__(
        self, source: Source, task: Any, arguments: Mapping[str, Any], part_size: object = None
    ) -> None:
        if not isinstance(task, str) or task not in _DEFAULTS:
            raise ValueError(unknown_name_message("task", str(task), list(_DEFAULTS)))
        defaults = _DEFAULTS[task]
        for word in arguments:
            if word not in defaults:
                raise ValueError(f"{task} has no argument {word!r}: it has {', '.join(defaults)}")
        if "t" in defaults and "t" not in arguments:
            raise TypeError("t is missing: give the final time or a list of times")
        if np.ndim(arguments.get("t", 0.0)) > 1:
            raise ValueError("t must be a number or a list of times, the same for all tops")
        if np.ndim(arguments.get("max_wait", 0.0)):
            raise ValueError("max_wait must be a number, the same for all tops of a sweep")
        self.source, self.task = source, task
        self.requested: Options | None = None
        self.arguments: dict[str, Any] = {**defaults, **arguments}
        if task == "solve":
            words = {"method": "auto", **arguments}
            t, method = words.pop("t"), words.pop("method")
            if not isinstance(method, str):
                raise TypeError(f"method must be the name of a method, not {short_repr(method)}")
            self.arguments, self.requested = {"t": t}, options_of.make_options(method, **words)
        if source._ranges or source._widths:  # of random tops, only consecutive ones can be built
            self._sample = np.arange(min(source.size, _SAMPLE_SIZE), dtype=np.int64)
        else:
            step = max(1, source.size // _SAMPLE_SIZE)
            places = np.arange(0, source.size, step, dtype=np.int64)
            self._sample = np.unique(np.append(places, source.size - 1))
        self._tops, self.options, self.times = source._name_invalid_top(
            self._sample, self.validate, self._build_and_validate
        )
        self.states = self.times.shape[-1]
        results = 8 * len(self.options.reductions)
        row = _ROW_BYTES + (results or self.states * (8 + self.options.bytes_per_state))
        self.part_size = max(1, min(_MAX_PART, _PART_BYTES // row))
        if part_size is not None:
            self.part_size = checks.as_int("part_size", part_size, 1)
        self.parts = -(-source.size // self.part_size)
        byte_count = min(self.part_size, source.size) * row
        if byte_count > get_total_memory():
            raise MemoryError(
                f"a part of {self.part_size} tops with {self.states} states each needs "
                f"{1e-9 * byte_count:.3g} GB, more than this machine has: use smaller parts, fewer "
                "times or fewer quantities"
            )
        for name, value in self.arguments.items():
            if name in ("n", "max_steps"):
                self.arguments[name] = int(value)
            elif name in ("t", "direction", "tol", "max_wait") and value is not None:
                self.arguments[name] = np.asarray(value, dtype=np.float64).tolist()
        if task == "section":
            self.arguments["event"] = validate_section_event(self.arguments["event"])
            self.arguments["digits"] = self.options.digits

    def validate(self, tops: Scene) -> tuple[Options, Array]:
        """Return the options and the times for these tops; refuse tops without this task."""
        if self.requested is not None:
            options = self.requested.for_tops(tops)
            refuse_kinetic(tops, options.events or ())
            return options, options_of.validate_times(tops, self.arguments["t"], options)
        if self.task == "section":
            waits, options = validate_section_arguments(tops, **self.arguments)
            return options, waits[0]
        times, options, _ = validate_chaos_arguments(tops, **self.arguments)
        return options, times

    def _build_and_validate(self) -> tuple[Scene, Options, Array]:
        tops = self.source._build_tops(self._sample)
        return tops, *self.validate(tops)

    def list_tops_of_part(self, i: int) -> range:
        begin = i * self.part_size
        return range(begin, min(begin + self.part_size, self.source.size))

    @cached_property
    def as_json(self) -> dict[str, Any]:
        source = self.source
        task = {name: value for name, value in self.arguments.items() if value is not None}
        if self.requested is not None:
            given = {n: v for n, v in self.requested.to_json().items() if v is not None}
            solve = {name: given[name] for name in _SOLVE_ARGUMENTS if name in given}
            task |= {"method": self.requested.requested_method, "solve": solve}
        else:
            if "event" in task:
                task["event"] = task["event"]._to_json()
            task = {self.task: task}
        plan = {
            "format": _FORMAT,
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
            **task,
        }
        if source._ranges or source._widths:
            ranges = list(map(_encode_parameter, source._ranges.values()))
            widths = dict(source._widths)
            plan["random"] = {"seed": source._seed, "ranges": ranges, "widths": widths}
        return plan

    @cached_property
    def hash(self) -> str:
        return hash_plan(self.as_json)

    def build_tops(self, tops: range) -> Scene:
        """Return an ensemble of the tops with these indices: the sample, if it is these tops."""
        places = self._sample
        if len(places) == len(tops) and (places[0], places[-1]) == (tops[0], tops[-1]):
            return self._tops
        return self.source[tops.start : tops.stop]

    def compute_part(
        self, tops: range, threads: int, progress: Progress | None
    ) -> list[TableColumn]:
        """Run the task on these tops; errors name the index of the first invalid top."""
        options = self.options

        def run() -> RunResult:
            ensemble = self.build_tops(tops)
            if self.requested is None:
                function: Callable[..., RunResult] = section if self.task == "section" else chaos
                return function(ensemble, **self.arguments, threads=threads, progress=progress)
            if not (options.is_auto or options.error is not None):
                options.for_tops(ensemble)
            kind: Any = Reductions if options.reductions else Path._of_many
            runner = LANES if options.reductions else select_slice_runner(options)
            pool = WorkerPool(threads)
            result: RunResult = run_ensemble(
                kind, ensemble, self.times, options, pool, runner, progress
            )
            return result

        places = np.arange(tops.start, tops.stop, dtype=np.int64)
        return self._tabulate(places, self.source._name_invalid_top(places, self.validate, run))

    def _tabulate(self, places: Places, outcome: Any) -> list[TableColumn]:
        """Return a table of the tops with these indices, including their parameters."""
        results = [
            TableColumn(name, TIMES[: values.ndim], values, column.unit)
            for column in _list_result_columns(self.task, outcome)
            for name, values in column.split_components()
        ]
        names = {column.name for column in results}
        parameters = []
        varied = self.source._select_values(self.source._varied, places)
        for name in self.source._widths:
            deviating: Array = getattr(outcome.scene, name)
            varied[name] = BatchParameter(name, deviating, deviating.shape[1:])
        for name, one in varied.items():
            flat = one.values.reshape(len(one.values), -1)
            for i, component in enumerate(list_component_names(name, one.value)):
                # A recorded quantity can have the name of a parameter, as spin with want=("spin",).
                column = f"{component}_given" if component in names else component
                unit = get_parameter_unit(name, one.degrees, i)
                parameters.append(TableColumn(column, TOP, flat[:, i], unit))
        events: Any = outcome if isinstance(outcome, Section) else None
        ragged = []
        if isinstance(outcome, Path) and outcome._options.events is not None:
            events = outcome.events
            ragged.append(TableColumn("event_which", EVENT, events.which))
            ragged.append(TableColumn("event_direction", EVENT, events.direction))
        if events is not None:
            results.append(TableColumn(COUNT, TOP, np.asarray(events.count)))
            for name, quantity in _STATES.items():
                values = getattr(events, name).reshape(-1, quantity.doubles)
                ragged += [
                    TableColumn(f"event_{component}", EVENT, values[:, i], quantity.dimension)
                    for i, component in enumerate(quantity.components)
                ]
        return [TableColumn("top", TOP, places), *parameters, *results, *ragged]


def _list_result_columns(task: str, outcome: Any) -> list[TableColumn]:
    """Return the columns that contain the results of the tops, excluding their parameters."""
    if isinstance(outcome, Chaos):
        names = [task] if task in INDICATORS else [*INDICATORS]
        columns = [TableColumn("status", TOP, outcome._buffers.status)]
        columns += [TableColumn(n, TOP, getattr(outcome, n), INDICATORS[n][0]) for n in names]
        verdict = "certificate", "is_chaotic", "is_doubtful"
        columns += [TableColumn(name, TOP, getattr(outcome, name)) for name in verdict]
        times = np.broadcast_to(outcome.t, (outcome.size, outcome.t.size))
        columns.append(TableColumn("t", TIMES, times, TIME.dimension))
        curves = {name: getattr(outcome, f"{name}_curve") for name in names}
        return columns + [
            TableColumn(f"{name}_curve", TIMES, values, INDICATORS[name][0])
            for name, values in curves.items()
        ]
    buffers = outcome._buffers
    columns = [
        TableColumn("status", TOP, buffers.status),
        TableColumn("reached", TOP, buffers.reached, TIME.dimension),
        TableColumn("steps", TOP, buffers.counts[:, 0]),
    ]
    if isinstance(outcome, Reductions):
        columns += outcome._list_columns()
    elif isinstance(outcome, Path):
        t, *quantities = list_quantity_columns(outcome, axes=TOP)
        times = np.broadcast_to(t.values, (outcome.size, t.values.shape[-1]))
        columns += [t._replace(dims=TIMES, values=times), *quantities]
    return columns


def hash_plan(plan: Mapping[str, Any]) -> str:
    """Return the SHA-256 hash of a plan's canonical JSON."""
    text = json.dumps(plan, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def name_array_file(values: Array) -> str:
    """Return the file name of an array, which is derived from a hash of its shape and values."""
    digest = hashlib.sha256(str(values.shape).encode())
    digest.update(np.ascontiguousarray(values, dtype="<f8").data)
    return f"starts-{digest.hexdigest()}.npy"


def _encode_parameter(one: BatchParameter) -> list[Any]:
    """Return a parameter as JSON data; a long array is replaced by the name of its file."""
    is_long = one.values.size > MAX_INLINE
    values = name_array_file(one.values) if is_long else one.values.tolist()
    return [one.name, list(one.value), values, *[True] * one.degrees]


def build_plan_from_dict(plan: Mapping[str, Any], load: Callable[[str], Array]) -> SweepPlan:
    """Return the plan stored in a JSON object; `load` reads an array, given its file name."""

    def decode(rows: Sequence[Any]) -> dict[str, BatchParameter]:
        parameters = {}
        for name, value, numbers, *degrees in rows:
            values = load(numbers) if isinstance(numbers, str) else np.asarray(numbers, np.float64)
            if not np.isfinite(values).all():
                raise ValueError(f"{name} must be finite")
            parameters[name] = BatchParameter(name, values, tuple(value), bool(degrees))
        return parameters

    try:
        parameters, random = decode(plan["parameters"]), plan.get("random", {})
        varied: dict[str, BatchParameter] = {}
        for row in plan["varied"]:
            varied |= {row: parameters[row]} if isinstance(row, str) else decode([row])
        source = Source(
            Scene.from_toml(plan["scene"]),
            tuple(plan["shape"]),
            tuple(plan["axes"]),
            parameters,
            varied,
            plan["flags"],
            random.get("seed", 0),
            decode(random.get("ranges", [])),
            random.get("widths", {}),
        )
        task = next((name for name in _DEFAULTS if name in plan), "solve")
        arguments = dict(plan[task])
        if task == "solve":
            arguments |= {"t": plan["t"], "method": plan["method"]}
        if "event" in arguments:
            arguments["event"] = Event._from_json(arguments["event"])
        if "events" in arguments:
            arguments["events"] = [Event._from_json(row) for row in arguments["events"]]
        if "reduce" in arguments:
            arguments["reduce"] = dict(arguments["reduce"])
        result = SweepPlan(source, task, arguments, plan["part_size"])
    except (AttributeError, KeyError, TypeError) as error:
        raise ValueError(f"it is not a plan of a sweep: {error}") from None
    if result.hash != hash_plan(plan):
        raise ValueError("it is a plan in a format of another version")
    return result


_CONSTRUCTORS: dict[str, tuple[Callable[..., Source], str]] = {  # with a required argument
    "grid": (Source.grid, ""),
    "random": (Source.random, "n"),
    "scatter": (Source.scatter, "n"),
    "columns": (Source.columns, "file"),
}
_RANGE = "from", "to", "n"


def read_sweep_plan(file: File) -> SweepPlan:
    """Read a plan that a user wrote as TOML."""
    return toml.parse_toml_text_or_file(
        file, lambda text: _build_plan_from_tables(toml.parse_toml_tables(text), file.parent)
    )


def _build_plan_from_tables(tables: dict[str, Any], folder: File) -> SweepPlan:
    known = ["task", *ARGUMENTS, "part_size", *_CONSTRUCTORS, "scene"]
    for name in tables:
        if name not in known:
            raise ValueError(unknown_name_message("key in a plan:", name, known))
    arguments = {name: tables[name] for name in ARGUMENTS if name in tables}
    if "t" in arguments:
        arguments["t"] = _expand_range("t", arguments["t"])
    if "events" in arguments:
        rows = arguments["events"]
        if not isinstance(rows, list):
            raise TypeError(f"events must be tables [[events]], not {short_repr(rows)}")
        arguments["events"] = [_build_event_from_table("events", row) for row in rows]
    if "event" in arguments:
        arguments["event"] = _build_event_from_table("event", arguments["event"])
    if "reduce" in arguments:
        toml.require_toml_table("reduce", arguments["reduce"])
    names = [name for name in _CONSTRUCTORS if name in tables]
    if len(names) != 1:
        finding = f"not {' and '.join(names)}" if names else "and there is none"
        raise ValueError(
            f"a plan must have exactly one of the tables {', '.join(_CONSTRUCTORS)}, {finding}"
        )
    if "scene" not in tables:
        raise ValueError("a plan needs a scene: a name, a file, or a table [scene]")
    place, [name] = tables["scene"], names
    if not isinstance(place, str):
        scene = build_scene_from_table(dict(toml.require_toml_table("scene", place)))
    elif place in about:
        scene = get_scene(place)
    else:
        try:
            scene = Scene.from_toml(folder / place)
        except FileNotFoundError:
            hint = checks.suggest_name(place, about)
            raise ValueError(f"there is no file or named scene {place!r}; {hint}") from None
    table = toml.require_toml_table(name, tables[name])
    words: dict[str, Any] = {key: _expand_range(key, value) for key, value in table.items()}
    make, needed = _CONSTRUCTORS[name]
    if needed and needed not in words:
        raise ValueError(f"[{name}] has no {needed}")
    if name == "columns":
        words["file"] = folder / str(words["file"])
    source = toml.call_with_error_prefix(f"[{name}]", lambda: make(scene, **words))
    return SweepPlan(source, tables.get("task", "solve"), arguments, tables.get("part_size"))


def _expand_range(name: str, value: object) -> Any:
    """Return the given values, or evenly spaced values if `value` is a table { from, to, n }."""
    if not isinstance(value, dict):
        return value
    for key in value:
        if key not in _RANGE:
            raise ValueError(unknown_name_message(f"key in {name}:", key, _RANGE))
    for key in _RANGE:
        if key not in value:
            raise ValueError(f"{name} has no {key}: give the first and the last value")
    ends = (np.asarray(value[end], dtype=np.float64) for end in ("from", "to"))
    begin, end = (checks.as_float(name, one[()]) if not one.ndim else one for one in ends)
    return np.linspace(begin, end, checks.as_int(f"n of {name}", value["n"], 1))


def _build_event_from_table(key: str, value: object) -> Event:
    row: dict[str, Any] = dict(toml.require_toml_table(key, value))
    name = row.pop("event", None)
    if name not in MAKERS:
        raise ValueError(unknown_name_message("event", str(name), MAKERS))
    return toml.call_with_error_prefix(f"event {name}", lambda: MAKERS[name](**row))
