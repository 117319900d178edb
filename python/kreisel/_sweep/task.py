"""Tasks of a sweep: the arguments of kreisel.solve, of an indicator of chaos or of a section.

A plan file stores them as JSON.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from .._model.scene import Ensemble
from .._options.ensemble_options import (
    EnsembleOptions,
    method_for_all,
    parse_ensemble_options,
    parse_times,
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
from .._solve.chaos import lyapunov, megno, oli, parse_growth
from .._solve.section import parse_event, parse_section, section
from .._solve.solve_ensemble import SolveArguments, parse_arguments, runner_for
from .._utils.errors import unknown_name_message
from .._utils.validation import Array, Numbers, short_repr
from ..events import Event, from_record, parse_events, to_record

Verb = Literal["solve", "lyapunov", "megno", "oli", "section"]
Became = Paths | Reductions | Indicator | Section


class SweepTask(Protocol):
    """A verb with its words."""

    @property
    def told(self) -> dict[str, Any]:
        """The words that were given, as JSON has them."""

    def normalized(self, order: EnsembleOptions) -> SweepTask:
        """Return the task in the form of a plan, with equivalent arguments alike."""

    def look(self, some: Ensemble) -> tuple[EnsembleOptions, Array]:
        """The order of some tops, and their times; of a section, for each of its states how long
        the tops wait. TypeError or ValueError for what cannot be."""

    def compute_tops(
        self,
        some: Ensemble,
        options: EnsembleOptions,
        times: Array,
        threads: int,
        progress: Progress | None,
    ) -> Became:
        """Compute the results of the tops `some`, with the options and times of `look`.

        Raises TypeError or ValueError for the first top that the task does not suit.
        """


class Solve(NamedTuple):
    """kreisel.solve."""

    t: Numbers
    method: str
    words: SolveArguments

    @property
    def told(self) -> dict[str, Any]:
        words = self.words
        told = _given_arguments(words._asdict())
        if words.events is not None:
            told["events"] = [to_record(event) for event in parse_events(FALLBACK, words.events)]
        if words.want is not None:
            told["want"] = list(words.want)
        if words.reduce is not None:
            told["reduce"] = [[name, kinds] for name, kinds in words.reduce.items()]
        return {"t": self.t, "method": self.method, "solve": told}

    def normalized(self, order: EnsembleOptions) -> Solve:
        words, options = self.words, order.solve
        reduce = None
        if words.reduce is not None:
            reduce = {
                name: [kinds] if isinstance(kinds, str) else list(dict.fromkeys(kinds))
                for name, kinds in words.reduce.items()
            }
        words = words._replace(
            step=_double(words.step),
            tol=_double(words.tol),
            error=_double(words.error),
            digits=options.digits,
            every=None if words.every is None else int(words.every),
            max_steps=int(words.max_steps),
            want=None if order.reductions else options.want,
            reduce=reduce,
        )
        return Solve(_doubles(self.t), self.method, words)

    def look(self, some: Ensemble) -> tuple[EnsembleOptions, Array]:
        words = self.words
        options = parse_arguments(some, self.method, words)
        return options, parse_times(some, self.t, options)

    def compute_tops(
        self,
        some: Ensemble,
        options: EnsembleOptions,
        times: Array,
        threads: int,
        progress: Progress | None,
    ) -> Paths | Reductions:
        if not (options.is_auto or options.searches_step):
            method_for_all(options.solve.method.name, some)
        kind: type[Paths | Reductions] = Reductions if options.reductions else Paths
        runner = LANES if options.reductions else runner_for(options)
        return run_ensemble(kind, some, times, options, WorkerPool(threads), runner, progress)


class Growth(NamedTuple):
    """An indicator of chaos."""

    verb: str
    t: Numbers
    direction: Sequence[float] | None = None
    tol: float | None = None
    max_steps: int = 0

    @property
    def told(self) -> dict[str, Any]:
        words = _given_arguments(self._asdict())
        return {words.pop("verb"): words}

    def normalized(self, order: EnsembleOptions) -> Growth:
        direction = None if self.direction is None else _doubles(self.direction)
        steering = direction, _double(self.tol), int(self.max_steps)
        return Growth(self.verb, _doubles(self.t), *steering)

    def look(self, some: Ensemble) -> tuple[EnsembleOptions, Array]:
        times, _ = parse_growth(some, *self[1:])
        return parse_ensemble_options(some, FALLBACK, tol=self.tol, max_steps=self.max_steps), times

    def compute_tops(
        self,
        some: Ensemble,
        options: EnsembleOptions,
        times: Array,
        threads: int,
        progress: Progress | None,
    ) -> Indicator:
        verb, t, direction, tol, most = self
        steering = {"direction": direction, "tol": tol, "max_steps": most}
        return INDICATORS[verb](some, t, **steering, threads=threads, progress=progress)


class Sections(NamedTuple):
    """kreisel.section."""

    event: Event | None = None
    n: int = 500
    max_wait: float | None = None
    tol: float | None = None
    digits: int | None = None
    max_steps: int = 0

    @property
    def told(self) -> dict[str, Any]:
        return {
            "section": _given_arguments(self._asdict())
            | {"event": to_record(parse_event(self.event))}
        }

    def normalized(self, order: EnsembleOptions) -> Sections:
        return Sections(
            parse_event(self.event),
            int(self.n),
            _double(self.max_wait),
            _double(self.tol),
            order.solve.digits,
            int(self.max_steps),
        )

    def look(self, some: Ensemble) -> tuple[EnsembleOptions, Array]:
        waits, order = parse_section(some, *self)
        return order, waits[0]

    def compute_tops(
        self,
        some: Ensemble,
        options: EnsembleOptions,
        times: Array,
        threads: int,
        progress: Progress | None,
    ) -> Section:
        words = self._asdict()
        return section(some, **words, threads=threads, progress=progress)


INDICATORS: dict[str, Callable[..., Indicator]] = {"lyapunov": lyapunov, "megno": megno, "oli": oli}
_WORDS: dict[str, tuple[str, ...]] = {
    "solve": ("t", "method", *SolveArguments._fields),
    **dict.fromkeys(INDICATORS, Growth._fields[1:]),
    "section": Sections._fields,
}
WORDS = tuple(dict.fromkeys(word for words in _WORDS.values() for word in words))


def parse_task(verb: object, words: Mapping[str, Any]) -> SweepTask:
    """Build the task of a verb from its arguments.

    Raises TypeError or ValueError for an unknown verb, for an argument that it does not have, and
    for an argument with a value for each top.
    """
    if not isinstance(verb, str) or verb not in _WORDS:
        raise ValueError(unknown_name_message("verb", str(verb), list(_WORDS)))
    for word in words:
        if word not in _WORDS[verb]:
            raise ValueError(f"{verb} has no word {word!r}: it has {', '.join(_WORDS[verb])}")
    if "t" in _WORDS[verb]:
        if "t" not in words:
            raise TypeError("t is missing: the time to reach, or a list of times")
        if np.ndim(words["t"]) > 1:
            raise ValueError(
                "t must be a number or a list of times, which all tops of a sweep share"
            )
    if np.ndim(words.get("max_wait", 0.0)):
        raise ValueError("max_wait must be a number, which all tops of a sweep share")
    if verb == "section":
        return Sections(**words)
    return Growth(verb, **words) if verb in INDICATORS else _solve(**words)


def _solve(t: Numbers, method: object = "auto", **words: Any) -> Solve:
    if not isinstance(method, str):
        raise TypeError(f"method must be the name of one, not {short_repr(method)}")
    for word, listed in (("want", _read_once), ("reduce", _materialize)):
        if word in words:
            words[word] = listed(words[word])
    return Solve(t, method, SolveArguments(**words))


def _materialize(reduce: Any) -> Any:
    """Convert the reductions to lists that can be read more than once."""
    if not isinstance(reduce, Mapping):
        return reduce
    return {name: _read_once(kinds) for name, kinds in reduce.items()}


def _read_once(names: Any) -> Any:
    """Names in a list that can be read more than once."""
    return list(names) if isinstance(names, Iterator) else names


def _given_arguments(words: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in words.items() if value is not None}


def _double(value: float | None) -> float | None:
    return None if value is None else float(value)


def _doubles(values: Numbers) -> Any:
    """A number, or numbers in a list."""
    return np.asarray(values, dtype=np.float64).tolist()


def task_from_json(told: Mapping[str, Any]) -> SweepTask:
    """Build the task of a plan file; raise KeyError, TypeError or ValueError if it is invalid."""
    verb = next((verb for verb in _WORDS if verb in told), "solve")
    words: dict[str, Any] = dict(told[verb])
    if verb == "solve":
        words |= {"t": told["t"], "method": told["method"]}
    if "events" in words:
        words["events"] = [from_record(row) for row in words["events"]]
    if "event" in words:
        words["event"] = from_record(words["event"])
    if "reduce" in words:
        words["reduce"] = dict(words["reduce"])
    return parse_task(verb, words)
