"""Tasks of a sweep: calls to kreisel.solve, kreisel.section or a chaos indicator.

The plan file stores a task and its arguments as JSON.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from .._model.scene import Ensemble
from .._options.ensemble_options import (
    EnsembleOptions,
    resolve_method_for_ensemble,
    validate_ensemble_options,
    validate_ensemble_times,
)
from .._options.methods import FALLBACK
from .._options.solve_options import Progress
from .._results.ensemble_buffers import LANES
from .._results.ensemble_paths import Paths
from .._results.executor import WorkerPool
from .._results.indicators import Indicator
from .._results.reductions import Reductions
from .._results.run_ensemble import run_ensemble
from .._results.section_result import Section
from .._solve.chaos import lyapunov, megno, oli, validate_indicator_arguments
from .._solve.section import section, validate_section_arguments, validate_section_event
from .._solve.solve_ensemble import SolveArguments, select_slice_runner, validate_ensemble_arguments
from .._utils.errors import unknown_name_message
from .._utils.validation import Array, Numbers, short_repr
from ..events import Event, from_record, to_record, validate_events

TaskName = Literal["solve", "lyapunov", "megno", "oli", "section"]
TaskResult = Paths | Reductions | Indicator | Section


class SweepTask(Protocol):
    """A task of a sweep: the kreisel function that is called for every top, and its arguments."""

    @property
    def as_json(self) -> dict[str, Any]:
        """The task of the sweep as a JSON object."""

    def normalize_arguments(self, options: EnsembleOptions) -> SweepTask:
        """Return the task in canonical form, so that equivalent arguments lead to equal plans."""

    def validate_options_and_times(self, tops: Ensemble) -> tuple[EnsembleOptions, Array]:
        """Return the validated options of the task, and the requested times of the given ensemble.

        For a section, the times are `n` copies of the longest waiting time allowed for the first
        top. Raises TypeError or ValueError for an invalid argument.
        """

    def compute_results_of_tops(
        self,
        tops: Ensemble,
        options: EnsembleOptions,
        times: Array,
        threads: int,
        progress: Progress | None,
    ) -> TaskResult:
        """Run the task on all tops in an ensemble, and return the results.

        Raises TypeError or ValueError for the first top to which the task does not apply.
        """


class SolveTask(NamedTuple):
    """A task that calls kreisel.solve, or kreisel.reduce if statistics are requested."""

    t: Numbers
    method: str
    arguments: SolveArguments

    @property
    def as_json(self) -> dict[str, Any]:
        controls = self.arguments
        solve = _drop_none_values(controls._asdict())
        if controls.events is not None:
            solve["events"] = [
                to_record(event) for event in validate_events(FALLBACK, controls.events)
            ]
        if controls.want is not None:
            solve["want"] = list(controls.want)
        if controls.reduce is not None:
            solve["reduce"] = [[name, kinds] for name, kinds in controls.reduce.items()]
        return {"t": self.t, "method": self.method, "solve": solve}

    def normalize_arguments(self, options: EnsembleOptions) -> SolveTask:
        controls = self.arguments
        reduce = None
        if controls.reduce is not None:
            reduce = {
                name: [kinds] if isinstance(kinds, str) else list(dict.fromkeys(kinds))
                for name, kinds in controls.reduce.items()
            }
        arguments = controls._replace(
            step=_float_or_none(controls.step),
            tol=_float_or_none(controls.tol),
            error=_float_or_none(controls.error),
            digits=options.solve.digits,
            every=None if controls.every is None else int(controls.every),
            max_steps=int(controls.max_steps),
            want=None if options.reductions else options.solve.want,
            reduce=reduce,
        )
        return SolveTask(_float_or_list(self.t), self.method, arguments)

    def validate_options_and_times(self, tops: Ensemble) -> tuple[EnsembleOptions, Array]:
        options = validate_ensemble_arguments(tops, self.method, self.arguments)
        return options, validate_ensemble_times(tops, self.t, options)

    def compute_results_of_tops(
        self,
        tops: Ensemble,
        options: EnsembleOptions,
        times: Array,
        threads: int,
        progress: Progress | None,
    ) -> Paths | Reductions:
        if not (options.is_auto or options.has_step_search):
            resolve_method_for_ensemble(options.solve.method.name, tops)
        kind: type[Paths | Reductions] = Reductions if options.reductions else Paths
        runner = LANES if options.reductions else select_slice_runner(options)
        return run_ensemble(kind, tops, times, options, WorkerPool(threads), runner, progress)


class ChaosTask(NamedTuple):
    """A task that calls kreisel.lyapunov, kreisel.megno or kreisel.oli."""

    name: str
    t: Numbers
    direction: Sequence[float] | None = None
    tol: float | None = None
    max_steps: int = 0

    @property
    def as_json(self) -> dict[str, Any]:
        arguments = _drop_none_values(self._asdict())
        return {arguments.pop("name"): arguments}

    def normalize_arguments(self, options: EnsembleOptions) -> ChaosTask:
        direction = None if self.direction is None else _float_or_list(self.direction)
        controls = direction, _float_or_none(self.tol), int(self.max_steps)
        return ChaosTask(self.name, _float_or_list(self.t), *controls)

    def validate_options_and_times(self, tops: Ensemble) -> tuple[EnsembleOptions, Array]:
        times, _ = validate_indicator_arguments(tops, *self[1:])
        return validate_ensemble_options(
            tops, FALLBACK, tol=self.tol, max_steps=self.max_steps
        ), times

    def compute_results_of_tops(
        self,
        tops: Ensemble,
        options: EnsembleOptions,
        times: Array,
        threads: int,
        progress: Progress | None,
    ) -> Indicator:
        arguments = self._asdict()
        indicator = INDICATORS[arguments.pop("name")]
        return indicator(tops, **arguments, threads=threads, progress=progress)


class SectionTask(NamedTuple):
    """A call to kreisel.section."""

    event: Event | None = None
    n: int = 500
    max_wait: float | None = None
    tol: float | None = None
    digits: int | None = None
    max_steps: int = 0

    @property
    def as_json(self) -> dict[str, Any]:
        event = {"event": to_record(validate_section_event(self.event))}
        return {"section": _drop_none_values(self._asdict()) | event}

    def normalize_arguments(self, options: EnsembleOptions) -> SectionTask:
        return SectionTask(
            validate_section_event(self.event),
            int(self.n),
            _float_or_none(self.max_wait),
            _float_or_none(self.tol),
            options.solve.digits,
            int(self.max_steps),
        )

    def validate_options_and_times(self, tops: Ensemble) -> tuple[EnsembleOptions, Array]:
        waits, options = validate_section_arguments(tops, *self)
        return options, waits[0]

    def compute_results_of_tops(
        self,
        tops: Ensemble,
        options: EnsembleOptions,
        times: Array,
        threads: int,
        progress: Progress | None,
    ) -> Section:
        return section(tops, **self._asdict(), threads=threads, progress=progress)


INDICATORS: dict[str, Callable[..., Indicator]] = {"lyapunov": lyapunov, "megno": megno, "oli": oli}
# Parts of a sweep are tables, which cannot store tangents.
_SOLVE_ARGUMENTS = tuple(name for name in SolveArguments._fields if name != "tangents")
_ARGUMENTS: dict[str, tuple[str, ...]] = {
    "solve": ("t", "method", *_SOLVE_ARGUMENTS),
    **dict.fromkeys(INDICATORS, ChaosTask._fields[1:]),
    "section": SectionTask._fields,
}
ARGUMENTS = tuple(dict.fromkeys(name for names in _ARGUMENTS.values() for name in names))


def build_task_from_arguments(task: object, arguments: Mapping[str, Any]) -> SweepTask:
    """Return the task of a sweep that has the given name and arguments.

    Raises TypeError or ValueError for an unknown task, and for an argument that the task does not
    accept. Every argument of a task has the same value for all tops of the sweep.
    """
    if not isinstance(task, str) or task not in _ARGUMENTS:
        raise ValueError(unknown_name_message("task", str(task), list(_ARGUMENTS)))
    argument_names = _ARGUMENTS[task]
    for name in arguments:
        if name not in argument_names:
            raise ValueError(f"{task} has no argument {name!r}: it has {', '.join(argument_names)}")
    if "t" in argument_names:
        if "t" not in arguments:
            raise TypeError("t is missing: give the final time or a list of times")
        if np.ndim(arguments["t"]) > 1:
            raise ValueError(
                "t must be a number or a list of times, the same for all tops of a sweep"
            )
    if np.ndim(arguments.get("max_wait", 0.0)):
        raise ValueError("max_wait must be a number, the same for all tops of a sweep")
    if task == "section":
        return SectionTask(**arguments)
    if task in INDICATORS:
        return ChaosTask(task, **arguments)
    return _validate_solve_task(**arguments)


def _validate_solve_task(t: Numbers, method: object = "auto", **arguments: Any) -> SolveTask:
    if not isinstance(method, str):
        raise TypeError(f"method must be the name of a method, not {short_repr(method)}")
    if "want" in arguments:
        arguments["want"] = _iterator_to_list(arguments["want"])
    reduce = arguments.get("reduce")
    if isinstance(reduce, Mapping):
        arguments["reduce"] = {name: _iterator_to_list(kinds) for name, kinds in reduce.items()}
    return SolveTask(t, method, SolveArguments(**arguments))


def _iterator_to_list(names: Any) -> Any:
    """Convert an iterator to a list, because iterators can be read only once."""
    return list(names) if isinstance(names, Iterator) else names


def _drop_none_values(arguments: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in arguments.items() if value is not None}


def _float_or_none(value: float | None) -> float | None:
    return None if value is None else float(value)


def _float_or_list(values: Numbers) -> Any:
    """Return a single number as a float, and several numbers as a list of floats."""
    return np.asarray(values, dtype=np.float64).tolist()


def build_task_from_dict(plan: Mapping[str, Any]) -> SweepTask:
    """Return the task that is stored in the JSON form of a plan.

    Raises KeyError, TypeError or ValueError if the task is invalid.
    """
    task = next((name for name in _ARGUMENTS if name in plan), "solve")
    arguments: dict[str, Any] = dict(plan[task])
    if task == "solve":
        arguments |= {"t": plan["t"], "method": plan["method"]}
    if "events" in arguments:
        arguments["events"] = [from_record(row) for row in arguments["events"]]
    if "event" in arguments:
        arguments["event"] = from_record(arguments["event"])
    if "reduce" in arguments:
        arguments["reduce"] = dict(arguments["reduce"])
    return build_task_from_arguments(task, arguments)
