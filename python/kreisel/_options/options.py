"""The validated options of `kr.solve`, for one top and for many."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Literal, NamedTuple, TypedDict

import numpy as np

from .._core import plain_times, unsuited
from .._core import reductions as KINDS
from .._core import tangents as TANGENTS
from .._model.scene import Ensemble, Scene
from .._utils.arguments import (
    Array,
    as_int,
    as_positive,
    short_repr,
    unknown_name_message,
    validate_type,
)
from .._utils.processes import Progress
from .._utils.quantity_attributes import QuantityName
from ..events import CoreEvent, Event
from .methods import (
    EXACT,
    FALLBACK,
    Method,
    get_method,
    has_torus_closed_form,
    methods,
    prefers_closed_form,
    resolve_method,
)
from .quantities import HEADING_DEPENDENT, QUANTITIES, RECORDABLE, count_quantity_components
from .times import CHUNK_SIZE, COUNTABLE, get_total_memory, time_array

AUTO = "auto"
GEOMETRIC = "geometric"  # the value of `method` for which trial runs choose the method
EventSpec = Event | Sequence[Event]
Kind = Literal["min", "max", "mean", "variance", "last", "where_min", "where_max"]
ReductionSpec = Mapping[str, Kind | Iterable[Kind]]  # maps quantities to kinds of reduction
TangentName = Literal[
    "start",
    "moments",
    "com",
    "gravity",
    "mass",
    "damping",
    "rotor",
    "turning",
    "shaking",
    "friction",
]
TangentSpec = TangentName | Iterable[TangentName]
TORUS_TANGENTS = ("start", "gravity", "mass")  # changes that keep the closed form on a torus
# The arguments of the core: name or None for 'auto', step, tol, digits, max_steps, leave_heading.
CoreArguments = tuple[Any, float, float, int, int, bool]
Index = tuple[int, ...]
Shape = tuple[int, ...]
_MAX_THREADS = 1024
# The entries of a run's JSON data that are arguments of kreisel.solve.
ARGUMENTS = (
    "step",
    "tol",
    "digits",
    "every",
    "max_steps",
    "error",
    "want",
    "events",
    "reduce",
    "tangents",
)


class MethodKeywords(TypedDict, total=False):
    """Keyword arguments that control the integration method."""

    step: float | None
    tol: float | None
    digits: int | None
    every: int | None


class StreamKeywords(MethodKeywords, total=False):
    """Keyword arguments of kreisel.stream for a single scene."""

    max_steps: int
    want: Iterable[QuantityName] | None
    events: EventSpec | None
    progress: Progress | None


class SolveKeywords(StreamKeywords, total=False):
    """Keyword arguments of kreisel.solve for a single scene."""

    error: float | None
    tangents: TangentSpec | None


class EnsembleKeywords(SolveKeywords, total=False):
    """Keyword arguments of kreisel.solve for an ensemble."""

    threads: int | None
    executor: Executor | None
    out: Array | None


class Reduction(NamedTuple):
    """A statistic of one component of a quantity over all output times.

    `component` is the index of the component, and `kind` is the index of the statistic. `name` is
    the name of the quantity or component, as given by the user.
    """

    quantity: str
    component: int
    kind: int
    name: str


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
        """True if each top uses the closed form if it has one."""
        return self.method == AUTO

    @property
    def has_step_search(self) -> bool:
        """True if a search chooses the method and the step for each top."""
        return self.error is not None

    @property
    def requests_events(self) -> bool:
        """True if events are to be found along the path."""
        return self.events is not None

    @property
    def uses_one_run_per_top(self) -> bool:
        """True if the tops of an ensemble cannot share the lanes of a vector."""
        return self.requests_events or bool(self.tangents) or self.has_extended_precision

    @property
    def has_extended_precision(self) -> bool:
        """True if the states are recorded with more digits than double precision."""
        return (self.digits or 0) > 16

    @property
    def tangent_bit_mask(self) -> int:
        """The bit flags of the requested tangents."""
        return sum(TANGENTS[name][0] for name in self.tangents)

    @property
    def tangent_column_count(self) -> int:
        """The number of columns in the matrix of tangents."""
        return sum(TANGENTS[name][1] for name in self.tangents)

    @property
    def reduce(self) -> dict[str, list[str]]:
        """The kinds of reduction of each quantity."""
        kinds: dict[str, list[str]] = {}
        for one in self.reductions:
            kinds.setdefault(one.name, [])
            if KINDS[one.kind] not in kinds[one.name]:
                kinds[one.name].append(KINDS[one.kind])
        return kinds

    @cached_property
    def core_arguments(self) -> CoreArguments:
        """The method and its parameters, as passed to the C library."""
        level = self.want is not None and HEADING_DEPENDENT.isdisjoint(self.want)
        is_fixed = self.has_extended_precision or self.requests_events or self.keeps_heading
        leave_heading = level and not is_fixed and self.integrator.skips_heading
        accuracy = self.step or 0.0, self.tol or 0.0, self.digits or 0
        return None if self.is_auto else self.method, *accuracy, self.max_steps, leave_heading

    @cached_property
    def core_reductions(self) -> list[tuple[str, int, int]]:
        """The requested statistics, as passed to the C library."""
        return [one[:3] for one in self.reductions]

    @cached_property
    def core_events(self) -> list[CoreEvent]:
        """The requested events, as passed to the C library."""
        return [event._core_arguments for event in self.events or ()]

    @cached_property
    def copy_with_default_run_settings(self) -> Options:
        """A copy of the options without the settings that are specific to a single run."""
        events = () if self.requests_events else None
        options = replace(self, max_steps=0, every=None, want=None, events=events, tangents=())
        return self if options == self else options

    @property
    def can_skip_heading_angle(self) -> bool:
        """True if the heading is not computed, because no requested quantity depends on it."""
        return bool(self.core_arguments[-1])

    @cached_property
    def max_time_with_exact_step_count(self) -> float:
        """A time [T] before which the number of steps is exactly representable as a double."""
        return math.inf if self.step is None else 0.5 * COUNTABLE * self.step

    @cached_property
    def chunk_size(self) -> int:
        """The largest number of states that are held in memory at a time."""
        return sys.maxsize if self.want is None else CHUNK_SIZE

    @cached_property
    def bytes_per_state(self) -> int:
        """The number of bytes stored for each state."""
        if self.reductions:
            return 0
        numbers = 8 if self.want is None else sum(map(count_quantity_components, self.want))
        numbers += 6 * self.tangent_column_count
        return 8 * numbers * (2 if self.has_extended_precision else 1)

    def get_signed_step(self, is_back: bool) -> float | None:
        """Return the step size, which is negative if `is_back` is True."""
        return -self.step if is_back and self.step is not None else self.step

    def check_heading_is_computed(self, action: str) -> None:
        """Raise ValueError if the heading, which `action` needs, is not computed."""
        if self.can_skip_heading_angle:
            raise ValueError(
                "the heading of this run is not computed, because no quantity in want depends on "
                f"it: {action} needs it, so add 'q' to want"
            )

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

    def for_tops(self, tops: Scene | Ensemble, t: object = None) -> Options:
        """Return the options with which the motion of one or of many tops is computed.

        For a scene, 'auto' becomes the name of a method, which for Kowalewski and
        Goryachev-Chaplygin tops depends on the times `t`. Raises ValueError if the method does not
        apply to a top, or if tangents are not defined.
        """
        if self.error is not None:
            return self
        options = self
        if not isinstance(tops, Scene):
            if self.method not in (AUTO, FALLBACK):  # taylor suits every top
                _check_method_suits_ensemble(self.integrator, tops)
                options = self.with_method(self.method)
        elif self.method == AUTO:
            name = resolve_method(AUTO, tops).name
            is_open = t is not None and self.step is self.tol is None
            if is_open and has_torus_closed_form(tops) and prefers_closed_form(tops, t):
                name = EXACT
            options = self.with_method(name).with_heading(tops)
        else:
            if self.method != FALLBACK:
                options = self.with_method(resolve_method(self.method, tops).name)
            options = options.with_heading(tops)
        if self.tangents:
            _check_tangents_exist(options, tops)
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
        asked = words["asked"]
        if not isinstance(asked, str):
            raise TypeError(f"the requested method must be a name, not {short_repr(asked)}")
        options = make_options(words["method"], **given)
        keeps_heading = bool(words.get("keeps_heading", False))
        return replace(options, requested_method=asked, keeps_heading=keeps_heading)


def make_options(
    method: object = AUTO,
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
    """Return the options of a call of kreisel.solve, whose arguments are validated here.

    What depends on the tops is validated by `Options.for_tops`. If digits, events or tangents are
    given, 'auto' is taylor. Raises TypeError or ValueError for an invalid argument.
    """
    want = tuple(want) if type(want) is list else want
    events = tuple(events) if type(events) is list else events
    arguments = method, step, tol, digits, every, max_steps, error, want, events, reduce, tangents
    if {type(want), type(events), type(tangents)} <= _HASHABLE:
        try:
            return _make_cached_options(*arguments)
        except TypeError:  # another argument is not hashable, or invalid
            pass
    return _make_options(*arguments)


def _make_options(
    method: object,
    step: object,
    tol: object,
    digits: object,
    every: object,
    max_steps: object,
    error: object,
    want: object,
    events: object,
    reduce: object,
    tangents: object,
) -> Options:
    others = {"step": step, "tol": tol, "digits": digits, "every": every, "events": events}
    others |= {"reduce": reduce, "tangents": tangents}
    if isinstance(method, str) and method == GEOMETRIC:
        target = _validate_error_tolerance(error, others)
        names = validate_requested_quantities(want)
        limit = as_int("max_steps", max_steps, 0)
        return Options(GEOMETRIC, None, None, None, limit, names, GEOMETRIC, error=target)
    if error is not None:
        raise ValueError(
            f"error is for method='geometric', which chooses its step; {method!r} takes step or tol"
        )
    if reduce is not None and (want is not None or events is not None):
        reason = "give either want, for the path of each top, or reduce, not both"
        raise ValueError(reason if events is None else "events need paths: leave out reduce")
    parameters = () if tangents is None else validate_tangent_names(tangents)
    for name, value in {"want": want, "events": events, "reduce": reduce}.items():
        if parameters and value is not None:
            raise ValueError(f"tangents are computed for all states of a path: leave out {name}")
    is_auto = isinstance(method, str) and method == AUTO
    needs_series = digits is not None or events is not None or bool(parameters)
    one = get_method(FALLBACK if is_auto else method)
    reductions = _validate_reductions(reduce)
    quantities = validate_requested_quantities(want)
    if reductions:
        quantities = validate_requested_quantities([each.quantity for each in reductions])
    options = Options(
        AUTO if is_auto and not needs_series else one.name,
        _validate_step(one, step),
        validate_tol(one, tol),
        _validate_digits(one, digits, tol),
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


_HASHABLE = {type(None), str, tuple, Event}
_make_cached_options = lru_cache(maxsize=256, typed=True)(_make_options)


def validate_requested_quantities(want: object) -> tuple[QuantityName, ...] | None:
    """Return the names of the quantities to record, without duplicates and without t."""
    if want is None:
        return None
    if isinstance(want, str) or not isinstance(want, Iterable):
        raise TypeError(
            f"want must be names of quantities, as want=('apex', 'energy'), not {short_repr(want)}"
        )
    names = list(want)
    for name in names:
        if not isinstance(name, str) or (name not in RECORDABLE and name != "t"):
            raise ValueError(
                unknown_name_message("quantity in want:", str(name), ["t", *RECORDABLE])
            )
    quantities = tuple(name for name in dict.fromkeys(names) if name != "t")
    if not quantities:
        raise ValueError("want contains no quantity besides t; leave it out to record all")
    return quantities


def _validate_step(method: Method, step: object) -> float | None:
    if step is None and not method.adaptive:
        raise ValueError(f"the method {method.name!r} has a fixed step: give step, as in step=0.01")
    return None if step is None else as_positive("step", step)


def validate_tol(method: Method, tol: object) -> float | None:
    """Return the tolerance as a float, or None for the default one."""
    if tol is None:
        return None
    if not (method.adaptive or method.implicit):
        raise ValueError(f"the method {method.name!r} has no tolerance: leave out tol")
    accuracy = as_positive("tol", tol)
    if accuracy >= 1.0:
        raise ValueError(
            f"tol must be below 1, since it is the relative error of a step; not {tol!r}"
        )
    return accuracy


def _validate_digits(method: Method, digits: object, tol: object) -> int | None:
    """Return the number of digits, rounded up to 16, 20 or 30."""
    if digits is None:
        return None
    if not method.digits:
        raise ValueError(
            f"the method {method.name!r} has a fixed precision: digits need method='taylor'"
        )
    if tol is not None:
        raise ValueError("give either digits or tol, not both")
    count = as_int("digits", digits, 1)
    if count > 30:
        raise ValueError(f"digits must be at most 30, not {digits!r}")
    return 16 if count <= 16 else 20 if count <= 20 else 30


def validate_recording_interval(method: Method, every: object) -> int | None:
    """Return the number of steps between two recorded states."""
    if every is None:
        return None
    if method.adaptive:
        steps = "has none" if method.exact else "chooses its steps"
        raise ValueError(
            f"every needs a method of fixed step; {method.name} {steps}: give t as a list"
        )
    return as_int("every", every, 1)


def _validate_error_tolerance(error: object, others: Mapping[str, object]) -> float:
    if error is None:
        raise ValueError(
            "method='geometric' chooses its step: give the allowed error [rad], as in error=1e-6"
        )
    names = [name for name, value in others.items() if value is not None]
    if names:
        raise ValueError(f"method='geometric' chooses its steps: leave {' and '.join(names)} out")
    target = as_positive("error", error)
    if target > 0.1:
        raise ValueError(
            f"error must be at most 0.1 rad, not {target!r}: larger errors cannot be measured"
        )
    return target


def _validate_events(method: str, events: object) -> tuple[Event, ...]:
    if method != FALLBACK:
        raise ValueError(
            f"events need the polynomials of method={FALLBACK!r}; {method!r} computes none"
        )
    several = [events] if isinstance(events, Event) else events
    if not isinstance(several, Sequence) or not all(isinstance(one, Event) for one in several):
        raise TypeError(
            "events must be an event of kreisel.events, such as kr.events.loop(), or a list of "
            f"them, not {short_repr(events)}"
        )
    return tuple(several)


_COMPONENTS = {
    component: (quantity.name, i)
    for quantity in QUANTITIES.values()
    for i, component in enumerate(quantity.components)
}


def _validate_reductions(reduce: object) -> tuple[Reduction, ...]:
    """Validate a mapping of quantities to statistics, such as {"nutation": ("min", "max")}."""
    if reduce is None:
        return ()
    if not isinstance(reduce, Mapping):
        raise TypeError(
            "reductions must name quantities, each with its kinds, as in "
            f"{{'nutation': ('min', 'max')}}, not {short_repr(reduce)}"
        )
    if not reduce:
        raise ValueError("the reductions name no quantity")
    known = [*QUANTITIES, *_COMPONENTS]
    reductions: list[Reduction] = []
    for name, value in reduce.items():
        if not isinstance(name, str) or name not in known:
            raise ValueError(unknown_name_message("quantity in reductions:", str(name), known))
        given = [value] if isinstance(value, str) else value
        if not isinstance(given, Iterable):
            raise TypeError(
                f"reductions[{name!r}] must be one or several of {KINDS}, not {short_repr(value)}"
            )
        kinds = list(dict.fromkeys(given))
        if not kinds:
            words = ", ".join(KINDS)
            raise ValueError(f"reductions[{name!r}] is empty: give one or several of {words}")
        for kind in kinds:
            if kind not in KINDS:
                where = f"kind in reductions[{name!r}]:"
                raise ValueError(unknown_name_message(where, str(kind), KINDS))
            # The name of a quantity denotes all of its components.
            components = [_COMPONENTS[name]] if name in _COMPONENTS else []
            if name in QUANTITIES:
                components = [(name, i) for i in range(QUANTITIES[name].doubles)]
            reductions += [Reduction(*each, KINDS.index(kind), name) for each in components]
    return tuple(reductions)


def validate_tangent_names(tangents: object) -> tuple[str, ...]:
    """Return the names of the requested tangents without duplicates, in a fixed order."""
    items = [tangents] if isinstance(tangents, str) else tangents
    if not isinstance(items, Iterable):
        raise TypeError(
            f"tangents must be names, as in tangents='start' or ('start', 'gravity'), not "
            f"{short_repr(tangents)}"
        )
    names = list(items)
    for name in names:
        if not isinstance(name, str) or name not in TANGENTS:
            raise ValueError(unknown_name_message("name in tangents:", str(name), TANGENTS))
    if not names:
        raise ValueError("tangents is empty: leave it out for a path without tangents")
    return tuple(name for name in TANGENTS if name in names)


def check_torus_tangent_names(names: Iterable[str]) -> None:
    """Raise ValueError for a parameter for which a closed form on a torus has no tangents."""
    for name in names:
        if name not in TORUS_TANGENTS:
            reason = "damped tops have" if name == "damping" else "most changes of it have"
            raise ValueError(
                f"a closed form on a torus has no tangents with respect to {name!r}, because "
                f"{reason} none: use {', '.join(map(repr, TORUS_TANGENTS))}, or "
                f"kr.solve(scene, t, tangents={name!r})"
            )


def _check_tangents_exist(options: Options, tops: Scene | Ensemble) -> None:
    """Raise ValueError if the method computes no tangents, or if friction rules them out."""
    method, names = options.integrator, options.tangents
    if method.exact and isinstance(tops, Scene) and has_torus_closed_form(tops):
        check_torus_tangent_names(names)
    elif method.exact or not method.tangents:
        reason = (
            ", because most changes of the moments or of com lead to bodies without closed form"
        )
        raise ValueError(
            f"the method {method.name!r} computes no tangents{reason if method.exact else ''}: "
            "use method='taylor' or 'auto'"
        )
    has_friction = np.asarray(tops.friction) > 0.0
    if "friction" in names and not has_friction.all():
        raise ValueError(
            "there are no tangents with respect to a friction of 0, because it cannot decrease: "
            "leave out 'friction'"
        )
    has_no_com = ~np.any(np.asarray(tops.body.com), axis=-1)
    if "com" in names and np.any(has_friction & has_no_com):
        raise ValueError(
            "there are no tangents with respect to com for tops with friction and com = 0, because "
            "com gives the axis of friction: leave out 'com'"
        )


def format_index(index: Index) -> str:
    """Return an index as text, such as "[3, 17]"."""
    return f"[{', '.join(map(str, index))}]" if index else ""


def unravel_index(i: int, shape: Shape) -> Index:
    """Return the multi-dimensional index of an ensemble member, given its index in C order."""
    return tuple(map(int, np.unravel_index(i, shape))) if shape else ()


def get_member_by_flat_index(tops: Ensemble, i: int) -> Scene:
    """Return the i-th member of an ensemble in C order."""
    scene: Scene = tops._select_member(unravel_index(i, tops.shape))
    return scene


def _check_method_suits_ensemble(method: Method, tops: Ensemble) -> None:
    """Raise ValueError if the method does not apply to a member; the message states its index."""
    first, count = unsuited(tops._core_scenes, method.name)
    if count:
        member = f"top{format_index(unravel_index(first, tops.shape))}"
        more = f", the first of {count} such members" if count > 1 else ""
        try:
            resolve_method(method.name, get_member_by_flat_index(tops, first))
        except ValueError as error:
            raise ValueError(f"{member}{more}: {error}") from None


def validate_times(tops: Scene | Ensemble, t: object, options: Options) -> Array:
    """Return the requested times (k,), or (tops, k) if each top of an ensemble has its own.

    Raises ValueError if they are not monotonic, or if reaching them takes 2**53 steps or more.
    """
    times = plain_times(t) if options.every is None else None
    if times is not None and (options.step is None or isinstance(tops, Scene)):
        return times
    shape = None if isinstance(tops, Scene) else tops.shape
    return time_array(t, options.step, options.every, options.bytes_per_state, shape=shape)


def check_result_memory(tops: Ensemble, times: Array, options: Options) -> None:
    """Raise MemoryError if the states of all tops would not fit into memory."""
    byte_count = tops.size * times.shape[-1] * options.bytes_per_state
    if byte_count > get_total_memory():
        raise MemoryError(
            f"{tops.size} tops with {times.shape[-1]} states each need {1e-9 * byte_count:.3g} GB, "
            "more than this machine has: use fewer times, want, kreisel.reduce or kreisel.stream"
        )


def validate_output_array(
    tops: Ensemble, out: object, times: Array, options: Options
) -> Array | None:
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
    """Return `progress`; raise TypeError if it is neither callable nor None."""
    if progress is not None and not callable(progress):
        raise TypeError(
            f"progress must be a function that takes the time reached, not {short_repr(progress)}"
        )
    return progress


def validate_thread_count(threads: object, executor: object = None) -> int:
    """Return the number of threads, which defaults to the number of available processors."""
    if executor is not None:
        if threads is not None:
            raise ValueError("give either threads or an executor, not both")
        if not isinstance(executor, Executor):
            raise TypeError(
                "executor must be one of concurrent.futures, such as a ThreadPoolExecutor, "
                f"not {short_repr(executor)}"
            )
    if threads is not None:
        return min(as_int("threads", threads, 1), _MAX_THREADS)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def validate_tops(name: str, tops: object) -> Scene | Ensemble:
    """Return `tops`; raise TypeError unless they are a scene or an ensemble."""
    return tops if isinstance(tops, Ensemble) else validate_type(name, tops, Scene)


def as_ensemble(name: str, tops: object) -> Ensemble:
    """Return an ensemble, of shape () for a scene; raise TypeError for anything else."""
    one = validate_tops(name, tops)
    return one if isinstance(one, Ensemble) else Ensemble.of([one]).reshape(())
