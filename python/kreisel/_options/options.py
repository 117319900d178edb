"""The validated options of `kr.solve`, for one top and for many: quantities, times, methods."""

from __future__ import annotations

import itertools
import math
import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from inspect import signature
from operator import itemgetter
from typing import Any, Literal, NamedTuple, TypedDict

import numpy as np

from .. import _core as core
from .._model.scene import Scene
from .._utils.arguments import (
    Array,
    Numbers,
    as_finite_array,
    as_float,
    as_int,
    as_positive,
    short_repr,
    spell,
    unknown_name_message,
)
from .._utils.processes import Progress
from .._utils.quantity_attributes import QuantityName
from ..events import CoreEvent, Event
from .methods import (
    AUTO,
    EXACT,
    FALLBACK,
    TIMES_FORM,
    Method,
    explain_taylor_choice,
    get_method,
    has_torus_closed_form,
    methods,
    resolve_method,
)


class QuantityDescription(NamedTuple):
    """A named function of the state.

    doubles     the number of components
    components  the names of the components
    turns       True if the quantity changes when the top is rotated about the vertical
    dimension   rad, rad/T or rad/T^2, or in terms of M, L and T; empty for a pure number
    text        a description
    """

    name: str
    doubles: int
    components: list[str]
    turns: bool
    dimension: str
    text: str

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value of the quantity."""
        return () if self.doubles == 1 else (3, 3) if self.doubles == 9 else (self.doubles,)


_FIELDS = itemgetter(*QuantityDescription._fields)
QUANTITIES: dict[str, QuantityDescription] = {  # functions of the state
    row["name"]: QuantityDescription(*_FIELDS(row)) for row in core.quantities
}
LOW: dict[str, QuantityDescription] = {
    f"{name}_low": QUANTITIES[name]._replace(
        name=f"{name}_low",
        components=[f"{name}_low{one.removeprefix(name)}" for one in QUANTITIES[name].components],
        text=f"low words of {name}, to be added to {name}; zero up to 16 digits",
    )
    for name in ("q", "m")
}
RECORDABLE = QUANTITIES | LOW  # the quantities that `want` may contain
TIME = QuantityDescription("t", 1, ["t"], False, "T", "times")
HEADING_DEPENDENT = frozenset(name for name, quantity in RECORDABLE.items() if quantity.turns)
ANGLES = frozenset(name for name, quantity in QUANTITIES.items() if quantity.dimension == "rad")
_COMPONENTS = {  # {quantity or component: the indices of its components}
    **{
        component: [(quantity.name, i)]
        for quantity in QUANTITIES.values()
        for i, component in enumerate(quantity.components)
    },
    **{name: [(name, i) for i in range(one.doubles)] for name, one in QUANTITIES.items()},
}


def count_quantity_components(name: str) -> int:
    return (TIME if name == "t" else RECORDABLE[name]).doubles


GEOMETRIC = "geometric"  # the value of `method` for which trial runs choose the method
EventSpec = Event | Sequence[Event]
Kind = Literal["min", "max", "mean", "variance", "last", "where_min", "where_max"]
ReductionSpec = Mapping[str, Kind | Iterable[Kind]]  # maps quantities to kinds of reduction
_Parameter = Literal[
    "moments",
    "com",
    "gravity",
    "mass",
    "damping",
    "rotor",
    "turning",
    "shaking",
    "friction",
    "gradient",
]
TangentName = Literal["start"] | _Parameter
TangentSpec = TangentName | Iterable[TangentName]
TORUS_TANGENTS = ("start", "gravity", "mass")  # changes that keep the closed form on a torus
# The arguments of the core: name or None for 'auto', step, tol, digits, max_steps, leave_heading.
CoreArguments = tuple[Any, float, float, int, int, bool]
Index = tuple[int, ...]
Shape = tuple[int, ...]
CHUNK_SIZE = 1 << 14  # largest number of states that are held in memory at a time
_COUNTABLE = 2.0**53  # largest number up to which doubles represent all integers
_MAX_ROWS = 1 << 20  # largest number of times that are validated in one batch
_MAX_THREADS = 1024


class StreamKeywords(TypedDict, total=False):
    step: float | None
    tol: float | None
    digits: int | None
    every: int | None
    max_steps: int
    want: Iterable[QuantityName] | None
    events: EventSpec | None
    progress: Progress | None


class EnsembleKeywords(StreamKeywords, total=False):
    error: float | None
    tangents: TangentSpec | None
    threads: int | None
    executor: Executor | None
    out: Array | None


# A statistic of a quantity: the quantity, the indices of the component and of the kind, and the
# name of the quantity or component that the user gave.
Reduction = tuple[str, int, int, str]


@dataclass(frozen=True)
class Options:
    """The options of a run: all arguments of kreisel.solve but the tops and the times.

    `make_options` validates the arguments of a call, and `for_tops` what depends on the tops.

    method            the name of the method; 'auto' if each top uses exact if it applies, and
                      taylor otherwise; 'geometric' if a search chooses the method
    requested_method  the name that the user gave
    want              the quantities to record; for reductions those that they need
    keeps_heading     True: the method must compute the heading, on which the motion depends if the
                      support turns
    """

    method: str = AUTO
    step: float | None = None
    tol: float | None = None
    digits: int | None = None
    max_steps: int = 0
    want: tuple[QuantityName, ...] | None = None
    requested_method: str = ""
    every: int | None = None
    error: float | None = None
    events: tuple[Event, ...] | None = None
    reductions: tuple[Reduction, ...] = ()
    tangents: tuple[str, ...] = ()
    keeps_heading: bool = False

    @property
    def integrator(self) -> Method:
        """The method; for 'auto' that of tops without a closed form."""
        return methods[FALLBACK if self.method == AUTO else self.method]

    @property
    def is_auto(self) -> bool:
        return self.method == AUTO

    @property
    def has_extended_precision(self) -> bool:
        return (self.digits or 0) > 16

    @property
    def uses_one_run_per_top(self) -> bool:
        """True if the tops of an ensemble cannot share the lanes of a vector."""
        return self.events is not None or bool(self.tangents) or self.has_extended_precision

    @property
    def tangent_bit_mask(self) -> int:
        return sum(core.tangents[name][0] for name in self.tangents)

    @property
    def tangent_column_count(self) -> int:
        return sum(core.tangents[name][1] for name in self.tangents)

    @property
    def reduce(self) -> dict[str, list[str]]:
        """The kinds of reduction of each quantity."""
        kinds: dict[str, dict[str, None]] = {}
        for _, _, kind, name in self.reductions:
            kinds.setdefault(name, {})[core.reductions[kind]] = None
        return {name: list(each) for name, each in kinds.items()}

    @cached_property
    def core_arguments(self) -> CoreArguments:
        """The method and its parameters, as passed to the C library."""
        level = self.want is not None and HEADING_DEPENDENT.isdisjoint(self.want)
        is_fixed = self.has_extended_precision or self.events is not None or self.keeps_heading
        leave_heading = level and not is_fixed and self.integrator.skips_heading
        accuracy = self.step or 0.0, self.tol or 0.0, self.digits or 0
        return None if self.is_auto else self.method, *accuracy, self.max_steps, leave_heading

    @cached_property
    def core_events(self) -> list[CoreEvent]:
        return [event._core_arguments for event in self.events or ()]

    @cached_property
    def copy_with_default_run_settings(self) -> Options:
        """A copy of the options without the settings that are specific to a single run."""
        events = () if self.events is not None else None
        options = replace(self, max_steps=0, every=None, want=None, events=events, tangents=())
        return self if options == self else options

    @property
    def can_skip_heading_angle(self) -> bool:
        """True if the heading is not computed, because no requested quantity depends on it."""
        return bool(self.core_arguments[-1])

    @property
    def max_time_with_exact_step_count(self) -> float:
        """A time [T] before which the number of steps is exactly representable as a double."""
        return math.inf if self.step is None else 0.5 * _COUNTABLE * self.step

    @property
    def chunk_size(self) -> int:
        """The largest number of states that are held in memory at a time."""
        return sys.maxsize if self.want is None else CHUNK_SIZE

    @cached_property
    def bytes_per_state(self) -> int:
        if self.reductions:
            return 0
        numbers = 8 if self.want is None else sum(map(count_quantity_components, self.want))
        numbers += 6 * self.tangent_column_count
        return 8 * numbers * (2 if self.has_extended_precision else 1)

    def check_heading_is_computed(self, action: str) -> None:
        """Raise ValueError if the heading, which `action` needs, is not computed."""
        if self.can_skip_heading_angle:
            raise ValueError(f"{action} needs the heading, which is not computed: add 'q' to want")

    def with_method(self, name: str) -> Options:
        """Return the options with a method in place of 'auto'. exact ignores step and tol."""
        if name == EXACT and (self.step is not None or self.tol is not None):
            return replace(self, method=name, step=None, tol=None)
        return self if name == self.method else replace(self, method=name)

    def with_heading(self, tops: Scene) -> Options:
        """Return options that compute the heading if the support of the scene turns."""
        if self.keeps_heading or not any(tops.turning):
            return self
        return replace(self, keeps_heading=True)

    def for_member(self, scene: Scene) -> Options:
        """Return the options for one of many tops, to which the method applies or has failed."""
        name = resolve_method(AUTO, scene).name if self.is_auto else self.method
        return self.with_method(name).with_heading(scene)

    def for_tops(self, tops: Scene, t: object = None, *, is_many: bool = False) -> Options:
        """Return the options with which the motion of one or of many tops is computed.

        For one top, 'auto' becomes the name of a method, which for Kowalewski and
        Goryachev-Chaplygin tops depends on the times `t`. If `is_many` is True, one top is treated
        as any of many. Raises ValueError if the method does not apply to a top, or if tangents are
        not defined.
        """
        options = self
        if self.error is not None:
            return self
        if not (tops.shape or is_many):
            name = FALLBACK if self.method == FALLBACK else resolve_method(self.method, tops).name
            is_open = self.is_auto and t is not None and self.step is self.tol is None
            if is_open and has_torus_closed_form(tops):
                times = as_finite_array("t", t, TIMES_FORM)
                name = FALLBACK if explain_taylor_choice(tops, times) else EXACT
            options = self.with_method(name).with_heading(tops)
        elif self.method not in (AUTO, FALLBACK):  # taylor suits every top
            first, count = core.unsuited(tops._core_scenes, self.method)
            if count:
                more = f", the first of {count} such members" if count > 1 else ""
                try:
                    resolve_method(self.method, get_member_by_flat_index(tops, first))
                except ValueError as error:
                    member = f"top{format_index(unravel_index(first, tops.shape))}{more}"
                    raise ValueError(f"{member}: {error}") from None
            options = self.with_method(self.method)
        method, names = options.integrator, self.tangents
        if not names:
            return options
        if method.exact and not tops.shape and has_torus_closed_form(tops):
            check_torus_tangent_names(tops, names)
        elif method.exact or not method.tangents:
            reason = "most changes of the moments or of com lead to bodies without closed form"
            raise ValueError(
                f"the method {method.name!r} computes no tangents"
                f"{f', because {reason}' if method.exact else ''}: use method='taylor' or 'auto'"
            )
        has_friction = np.asarray(tops.friction) > 0.0
        if "friction" in names and not has_friction.all():
            raise ValueError("a friction of 0 has no tangents, as it cannot decrease: leave it out")
        if "com" in names and np.any(has_friction & ~np.any(np.asarray(tops.body.com), axis=-1)):
            raise ValueError("with friction, com = 0 has no tangents: leave out 'com'")
        return options

    def to_json(self) -> dict[str, Any]:
        """Return the options as JSON data, for checkpoints, saved paths and plans of sweeps."""
        return {
            "method": self.method,
            "asked": self.requested_method,
            "keeps_heading": self.keeps_heading,
            **{name: getattr(self, name) for name in ARGUMENTS},
            "want": None if self.reductions or self.want is None else list(self.want),
            "events": None if self.events is None else [one._to_json() for one in self.events],
            "reduce": list(map(list, self.reduce.items())) or None,
            "tangents": list(self.tangents) or None,
        }

    @classmethod
    def from_json(cls, words: Mapping[str, Any]) -> Options:
        """Return the options stored as JSON data.

        Saved paths and runs have further entries, and lack those that do not concern them. Raises
        KeyError, TypeError or ValueError if an entry is invalid.
        """
        given = {name: words.get(name) for name in ARGUMENTS}
        given |= {name: words[name] for name in ("step", "tol", "digits")}
        given["max_steps"] = words.get("max_steps", 0)
        if given["events"] is not None:
            given["events"] = [Event._from_json(row) for row in given["events"]]
        if given["reduce"] is not None:
            given["reduce"] = dict(given["reduce"])
        if not isinstance(words["asked"], str):
            given_name = short_repr(words["asked"])
            raise TypeError(f"the requested method must be a name, not {given_name}")
        options = make_options(words["method"], **given)
        keeps_heading = bool(words.get("keeps_heading", False))
        return replace(options, requested_method=words["asked"], keeps_heading=keeps_heading)


def make_options(method: object = AUTO, **given: object) -> Options:
    """Return the options of a call of kreisel.solve, whose arguments are validated here.

    What depends on the tops is validated by `Options.for_tops`. If digits, events or tangents are
    given, 'auto' is taylor. Raises TypeError or ValueError for an invalid argument.
    """
    want, events = given.get("want"), given.get("events")
    if type(want) is list:
        given["want"] = want = tuple(want)
    if type(events) is list:
        given["events"] = events = tuple(events)
    if {type(want), type(events), type(given.get("tangents"))} <= _HASHABLE:
        try:
            return _make_options(method, **given)
        except TypeError:  # another argument is not hashable, or invalid
            pass
    return _make_options.__wrapped__(method, **given)


_HASHABLE = {type(None), str, tuple, Event}


@lru_cache(maxsize=256, typed=True)
def _make_options(
    method: object,
    *,
    step: object = None,
    tol: object = None,
    digits: object = None,
    every: object = None,
    max_steps: object = 0,
    error: object = None,
    want: object = None,
    events: object = None,
    reduce: object = None,
    tangents: object = None,
) -> Options:
    is_auto = isinstance(method, str) and method == AUTO
    if isinstance(method, str) and method == GEOMETRIC:
        others = {"step": step, "tol": tol, "digits": digits, "every": every, "events": events}
        others |= {"reduce": reduce, "tangents": tangents}
        geometric = spell("method", GEOMETRIC)
        if error is None:
            raise ValueError(f"{geometric} needs the allowed error [rad]: {spell('error', 1e-6)}")
        names = " and ".join(spell(name) for name, value in others.items() if value is not None)
        if names:
            raise ValueError(f"{geometric} chooses its steps: leave {names} out")
        target = as_positive("error", error)
        if target > 0.1:
            raise ValueError(f"{spell('error')} must be at most 0.1 rad, not {target!r}")
        quantities, limit = validate_requested_quantities(want), as_int("max_steps", max_steps, 0)
        return Options(GEOMETRIC, None, None, None, limit, quantities, GEOMETRIC, error=target)
    if error is not None:
        raise ValueError(f"{spell('error')} needs {spell('method', GEOMETRIC)}, not {method!r}")
    if reduce is not None and (want is not None or events is not None):
        reason = "give either want, for the path of each top, or reduce, not both"
        raise ValueError(reason if events is None else "events need paths: leave out reduce")
    parameters = () if tangents is None else validate_tangent_names(tangents)
    for name, value in {"want": want, "events": events, "reduce": reduce}.items():
        if parameters and value is not None:
            raise ValueError(f"tangents are computed for all states of a path: leave out {name}")
    one = get_method(FALLBACK if is_auto else method)
    reductions = _validate_reductions(reduce)
    if reductions:
        want = [quantity for quantity, *_ in reductions]
    quantities = validate_requested_quantities(want)
    if step is None and not one.adaptive:
        raise ValueError(f"the method {one.name!r} has a fixed step: give {spell('step')}")
    length = None if step is None else as_positive("step", step)
    if tol is not None and not (one.adaptive or one.implicit):
        raise ValueError(f"the method {one.name!r} has no tolerance: leave out {spell('tol')}")
    accuracy = None if tol is None else as_positive("tol", tol)
    if accuracy is not None and accuracy >= 1.0:
        raise ValueError(f"{spell('tol')}, the relative error, must be below 1, not {tol!r}")
    places = None if digits is None else _validate_digits(one, digits, tol)
    needs_series = digits is not None or events is not None or bool(parameters)
    options = Options(
        AUTO if is_auto and not needs_series else one.name,
        length,
        accuracy,
        places,
        as_int("max_steps", max_steps, 0),
        quantities,
        str(method),
        validate_recording_interval(one, every),
        None,
        None if events is None else _validate_events(one.name, events),
        reductions,
        parameters,
    )
    if reductions and options.has_extended_precision:
        raise ValueError("reduce accepts at most 16 digits: its results are doubles")
    return options


# The entries of a run's JSON data that are arguments of kreisel.solve.
ARGUMENTS = tuple(signature(_make_options).parameters)[1:]


def validate_requested_quantities(want: object) -> tuple[QuantityName, ...] | None:
    """Return the names of the quantities to record, without duplicates and without t."""
    if want is None:
        return None
    if isinstance(want, str):
        raise TypeError(f"want must be a list of names, as want=[{short_repr(want)}]")
    names: list[Any] = _list_names("want", want, ["t", *RECORDABLE])
    quantities = tuple(name for name in names if name != "t")
    if not quantities:
        raise ValueError(f"{spell('want')} has no quantity besides t; leave it out to record all")
    return quantities


def _list_names(what: str, value: object, known: Iterable[str]) -> list[str]:
    """Return one name or several as a list without duplicates, if they are among the known ones."""
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, Iterable):
        raise TypeError(f"{spell(what)} must be one or several names, not {short_repr(value)}")
    names = list(names)
    for name in names:
        if not isinstance(name, str) or name not in known:
            raise ValueError(unknown_name_message(f"name in {spell(what)}:", str(name), known))
    if not names:
        raise ValueError(f"{spell(what)} is empty: give one or several of {', '.join(known)}")
    return list(dict.fromkeys(names))


def _validate_digits(method: Method, digits: object, tol: object) -> int:
    """Return the number of digits, rounded up to 16, 20 or 30."""
    if not method.digits:
        raise ValueError(f"{spell('digits')} needs 'taylor', not {method.name!r}")
    if tol is not None:
        raise ValueError(f"give either {spell('digits')} or {spell('tol')}, not both")
    count = as_int("digits", digits, 1)
    if count > 30:
        raise ValueError(f"{spell('digits')} must be at most 30, not {digits!r}")
    return 16 if count <= 16 else 20 if count <= 20 else 30


def validate_recording_interval(method: Method, every: object) -> int | None:
    """Return the number of steps between two recorded states."""
    if every is None:
        return None
    if method.adaptive:
        raise ValueError(
            f"{spell('every')} needs a method of fixed step: give {spell('t')} as a list"
        )
    return as_int("every", every, 1)


def _validate_events(method: str, events: object) -> tuple[Event, ...]:
    if method != FALLBACK:
        raise ValueError(f"{spell('events')} need the polynomials of 'taylor', not {method!r}")
    several = [events] if isinstance(events, Event) else events
    if not isinstance(several, Sequence) or not all(isinstance(one, Event) for one in several):
        raise TypeError(f"events must be one or several kreisel.Event, not {short_repr(events)}")
    return tuple(several)


def _validate_reductions(reduce: object) -> tuple[Reduction, ...]:
    """Validate a mapping of quantities to statistics, such as {"nutation": ("min", "max")}."""
    if reduce is None:
        return ()
    if not isinstance(reduce, Mapping):
        raise TypeError(f"reductions must map quantities to kinds, not be {short_repr(reduce)}")
    if not reduce:
        raise ValueError("the reductions name no quantity")
    reductions: list[Reduction] = []
    for name, value in reduce.items():
        if not isinstance(name, str) or name not in _COMPONENTS:
            names = [*QUANTITIES, *(one for one in _COMPONENTS if one not in QUANTITIES)]
            raise ValueError(unknown_name_message("quantity in reductions:", str(name), names))
        for kind in _list_names(f"reductions[{name!r}]", value, core.reductions):
            at = core.reductions.index(kind)
            reductions += [(*one, at, name) for one in _COMPONENTS[name]]
    return tuple(reductions)


def validate_tangent_names(tangents: object) -> tuple[str, ...]:
    """Return the names of the requested tangents without duplicates, in a fixed order."""
    names = _list_names("tangents", tangents, core.tangents)
    return tuple(name for name in core.tangents if name in names)


def check_torus_tangent_names(scene: Scene, names: Iterable[str]) -> None:
    """Raise ValueError for a parameter for which a closed form on a torus has no tangents."""
    suited = TORUS_TANGENTS[: 1 if core.scene_kind(scene._block) == "gyrostat" else None]
    for name in names:
        if name not in suited:
            reason = "damped tops have" if name == "damping" else "most changes of it have"
            raise ValueError(
                f"a closed form on a torus has no tangents with respect to {name!r}, because "
                f"{reason} none: use {', '.join(map(repr, suited))}, or "
                f"kr.solve(scene, t, tangents={name!r})"
            )


def format_index(index: Index) -> str:
    """Return an index as text, such as "[3, 17]"."""
    return f"[{', '.join(map(str, index))}]" if index else ""


def unravel_index(i: int, shape: Shape) -> Index:
    """Return the multi-dimensional index of an ensemble member, given its index in C order."""
    return tuple(map(int, np.unravel_index(i, shape))) if shape else ()


def get_member_by_flat_index(tops: Scene, i: int) -> Scene:
    return tops._select_member(unravel_index(i, tops.shape))


def validate_times(tops: Scene, t: object, options: Options) -> Array:
    """Return the requested times (k,), or (tops, k) if each top of an ensemble has its own.

    Raises ValueError if they are not monotonic, or if reaching them takes 2**53 steps or more.
    """
    times = core.plain_times(t) if options.every is None else None
    if times is not None and options.step is None:
        return times
    size, shape = options.bytes_per_state, tops.shape or None
    return time_array(t, options.step, options.every, size, shape=shape)


def check_result_memory(tops: Scene, times: Array, options: Options) -> None:
    """Raise MemoryError if the states of all tops would not fit into memory."""
    advice = "use fewer times, want, kreisel.reduce or kreisel.stream"
    size = tops.size * options.bytes_per_state
    check_states_fit_in_memory(times.shape[-1], size, f" of {tops.size} tops", advice)


def validate_output_array(tops: Scene, out: object, times: Array, options: Options) -> Array | None:
    """Return the output array `out` with one row per top."""
    if out is None:
        return None
    if options.reductions or options.want is not None:
        raise ValueError("out receives states: leave out want and reduce")
    shape = (*tops.shape, times.shape[-1], 8)
    if not isinstance(out, np.ndarray):
        raise TypeError(f"out must be a NumPy array, not {short_repr(out)}")
    if out.dtype != np.float64 or out.shape != shape:
        raise ValueError(
            f"out must be an array of float64 of shape {shape}, not of {out.dtype} and {out.shape}"
        )
    if not out.flags.c_contiguous or not out.flags.writeable:
        raise ValueError("out must be in C order and writeable")
    return out.reshape(tops.size, times.shape[-1], 8)


def validate_progress_callback(progress: Progress | None) -> Progress | None:
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be a function of one number, not {short_repr(progress)}")
    return progress


def validate_thread_count(threads: object, executor: object = None) -> int:
    """Return the number of threads, which defaults to the number of available processors."""
    if executor is not None:
        if threads is not None:
            raise ValueError("give either threads or an executor, not both")
        if not isinstance(executor, Executor):
            raise TypeError(f"executor must be of concurrent.futures, not {short_repr(executor)}")
    most = 1 if sys.platform == "emscripten" else _MAX_THREADS  # browsers start no threads
    if threads is not None:
        return min(as_int("threads", threads, 1), most)
    has_affinity = hasattr(os, "sched_getaffinity")
    return min(len(os.sched_getaffinity(0)) if has_affinity else os.cpu_count() or 1, most)


def time_array(
    t: object,
    step: float | None,
    every: int | None,
    size: int = 64,
    begin: float = 0.0,
    shape: Shape | None = None,
) -> Array:
    """Return the requested times, given either as a list or as a final time.

    If the shape of many tops is given, each may have its own times, in a row of the result. `size`
    is the number of bytes of a state. Raises MemoryError if the states would not fit into memory.
    """
    times = validate_time_list(t, shape)
    if times.ndim and every is not None:
        raise ValueError(f"{spell('every')} needs {spell('t')} as a number, not a list")
    if times.ndim > 1 and shape is not None:
        try:
            all_times = np.broadcast_to(times, (*shape, times.shape[-1]))
        except ValueError:
            raise ValueError(
                f"t must be a number, a list of times for all tops, or an array of shape "
                f"{(*shape, 'k')} with k times of each, not an array of shape {times.shape}"
            ) from None
        times = np.ascontiguousarray(all_times).reshape(math.prod(shape), times.shape[-1])
        most = max(1, _MAX_ROWS // max(1, times.shape[-1]))
        for first in range(0, len(times), most):
            block = times[first : first + most]
            distances = np.where(block[:, -1:] < 0.0, -block, block)
            is_wrong = (np.diff(distances, axis=1, prepend=0.0) < 0.0).any(axis=1)
            if is_wrong.any():
                i = int(is_wrong.argmax())
                check_times_continue_monotonically(block[i], place=unravel_index(first + i, shape))
    elif times.ndim == 1:
        check_times_continue_monotonically(times)
    elif step is None or every is None:
        times = np.array([begin, float(times)])
    else:
        end = float(times)
        steps = _count_whole_steps(end, step, begin)
        check_states_fit_in_memory(steps // every + 1, size + 8)
        return _compute_grid_times(0, steps + 1, every, math.copysign(step, end - begin), begin)
    if step is not None:
        _check_steps_can_be_counted(float(np.abs(times).max(initial=0.0)), step)
    return times


def validate_time_list(t: object, shape: Shape | None = None) -> Array:
    """Return one time or a list, or for tops of a shape an array of times of each, as an array."""
    form = "a number, a list of times, or an array of times of each top"
    times = as_finite_array("t", t, TIMES_FORM if shape is None else form)
    if times.ndim > 1 and shape is None:
        raise ValueError(f"t must be a number or a list of times, not of shape {times.shape}")
    return times


def check_times_continue_monotonically(
    times: Array, last: float = 0.0, is_back: bool | None = None, place: Index = ()
) -> None:
    """Raise ValueError unless the times start at or after `last` and do not decrease.

    If `is_back` is True, or the last time is negative, the times must not increase. `place` is the
    index of the top to which they belong.
    """
    if is_back is None:
        is_back = times.size > 0 and bool(times[-1] < 0.0)
    before = np.concatenate([[last], times[:-1]])[: times.size]
    is_wrong = times > before if is_back else times < before
    if not is_wrong.any():
        return
    i = int(is_wrong.argmax())
    entries = [f"t{[*place, k]} = {float(times[k])!r}" for k in (i - 1, i)]
    origin = entries[0] if i else f"the run's {last!r}" if last else "the start at 0"
    raise ValueError(f"times must move away from 0; {entries[1]} goes back from {origin}")


def iterate_time_chunks(
    t: Numbers | Iterator[float],
    step: float | None,
    every: int | None,
    size: int,
    resume_time: float | None,
    begin: float = 0.0,
) -> Iterator[Array]:
    """Return the requested times in chunks of length `size`.

    `t` may also be an infinite iterator. If `t` is a number, the first step starts at the time
    `begin`, and the times from `begin` to `resume_time` are omitted.
    """
    if isinstance(t, Iterator):
        if every is not None:
            raise ValueError(f"{spell('every')} needs {spell('t')} as a number, not an iterator")
        return _split_time_iterator_into_chunks(t, size)
    if np.ndim(t) > 0 or isinstance(t, Sequence):
        times = time_array(t, step, every)
        return (times[i : i + size] for i in range(0, times.size, size))
    if every is None or step is None:
        raise ValueError("a stream needs times: a list, an iterator, or every with a fixed step")
    end = float(t) if isinstance(t, float) and math.isinf(t) else as_float("t", t)
    stop = 2**53 if math.isinf(end) else _count_whole_steps(end, step, begin) + 1
    first, signed_step, stride = 0, math.copysign(step, end - begin), size * every
    if resume_time is not None:
        first = _count_whole_steps(resume_time, step, begin) // every * every
        [time] = _compute_grid_times(first, first + 1, 1, signed_step, begin)
        first += every if abs(time) <= abs(resume_time) else 0
    return (
        _compute_grid_times(k, min(k + stride, stop), every, signed_step, begin)
        for k in range(first, stop, stride)
    )


def find_time_direction(t: Numbers | Iterator[float]) -> tuple[bool, Numbers | Iterator[float]]:
    """Return True if time runs backwards, and the times, of which an iterator is partly read."""
    if isinstance(t, Iterator):
        head, is_back = [], False
        for time in t:
            head.append(time)
            first = as_finite_array("t", time, "an iterator of times")
            if first.any():
                is_back = bool((first < 0.0).any())
                break
        return is_back, itertools.chain(head, t)
    last = t
    if isinstance(t, (Sequence, np.ndarray)) and np.ndim(t) > 0:
        last = t[-1] if len(t) else 0.0
    return isinstance(last, (int, float, np.number)) and bool(last < 0.0), t


def _split_time_iterator_into_chunks(t: Iterable[float], size: int) -> Iterator[Array]:
    while piece := list(itertools.islice(t, size)):
        times = as_finite_array("t", piece, "an iterator of times")
        if times.ndim != 1:
            raise ValueError(f"t must be an iterator of times, not of {piece[0]!r}")
        yield times


def _count_whole_steps(end: float, step: float, begin: float = 0.0) -> int:
    """Return the number of whole steps from `begin` to `end`, allowing for rounding errors."""
    _check_steps_can_be_counted(end, step, begin)
    length = abs(end - begin)
    steps = math.floor(length / step + 0.5)
    rounding = 2.0 * np.finfo(float).eps * max(abs(begin), abs(end))
    return steps - 1 if steps * step - length > rounding else steps


def _compute_grid_times(first: int, stop: int, every: int, step: float, begin: float) -> Array:
    """Return the times after `first` steps from `begin`, and after every so many further steps."""
    times = np.arange(first, stop, every, dtype=np.float64) * step
    return times + begin if begin else times


def check_states_fit_in_memory(states: int, size: int, of: str = "", advice: str = "") -> None:
    """Raise MemoryError if the states, with `size` bytes each, would not fit in memory."""
    if size * states > get_total_memory():
        memory = f"{1e-9 * size * states:.3g} GB, more than this machine has"
        advice = advice or f"record fewer with a larger {spell('every')} or {spell('step')}"
        raise MemoryError(f"{states} states{of} need {memory}: {advice}")


def get_total_memory() -> int:
    """Return the memory of this machine in bytes, or 2**63 if it is unknown."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return 2**63


def _check_steps_can_be_counted(end: float, step: float, begin: float = 0.0) -> None:
    if not abs(end - begin) / step < _COUNTABLE:
        raise ValueError(
            f"t = {end!r} takes more steps of {step!r} than double precision can count (2**53): "
            "take larger steps"
        )


def check_resolvable_horizon(scene: Scene, end: float, step: float | None) -> None:
    """Raise ValueError if, up to `end`, there are 2**53 steps, or the top turns by 2**53 rad."""
    if step is not None:
        _check_steps_can_be_counted(end, abs(step))
    horizon = scene._resolvable_horizon  # 0 if the momentum is too large for the core
    if end and abs(end) >= horizon:
        angle = _COUNTABLE * (abs(end) / horizon) if horizon else math.inf
        raise ValueError(
            f"by t = {end!r} this top turns by {angle:.2g} rad: double precision cannot "
            "resolve its attitude"
        )
