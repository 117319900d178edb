"""Validated options of `kr.solve`, for one top and for ensembles."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np

from .._core import reductions as KINDS
from .._core import tangents as TANGENTS
from .._core import unsuited
from .._model.scene import Ensemble, Scene
from .._utils.arguments import (
    Array,
    as_finite_array,
    as_int,
    as_positive,
    short_repr,
    unknown_name_message,
    validate_type,
)
from .._utils.processes import Progress
from .._utils.quantity_attributes import QuantityName
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
from .times import (
    CHUNK_SIZE,
    COUNTABLE,
    check_times_are_monotonic,
    compute_recording_times,
    get_total_memory,
    too_many_steps_message,
)

# The arguments of the core: name, step, tol, digits, max_steps and leave_heading.
CoreArguments = tuple[str, float, float, int, int, bool]


@dataclass(frozen=True)
class SolveOptions:
    """The validated arguments of kreisel.solve, except the scene and the times.

    An argument is None if the method has no such parameter, or if its default is used. If `error`
    is given, the cheapest suitable method is found by a search and replaces `method`. `events`
    contains kreisel.events.Event objects. `tangents` contains the names of the parameters with
    respect to which the state is differentiated. `keeps_heading` prevents the method from skipping
    the heading, on which the motion depends if the support turns.
    """

    method: Method
    step: float | None = None
    tol: float | None = None
    digits: int | None = None
    max_steps: int = 0
    want: tuple[QuantityName, ...] | None = None
    requested_method: str = ""
    every: int | None = None
    error: float | None = None
    events: tuple[Any, ...] | None = None
    tangents: tuple[str, ...] = ()
    keeps_heading: bool = False

    @property
    def requests_events(self) -> bool:
        """True if events are to be found along the path."""
        return self.events is not None

    @property
    def tangent_bit_mask(self) -> int:
        """The bit flags of the requested tangents."""
        return sum(TANGENTS[name][0] for name in self.tangents)

    @property
    def tangent_column_count(self) -> int:
        """The number of columns in the matrix of tangents."""
        return sum(TANGENTS[name][1] for name in self.tangents)

    @cached_property
    def core_arguments(self) -> CoreArguments:
        """The method and its parameters, as passed to the C library."""
        level = self.want is not None and HEADING_DEPENDENT.isdisjoint(self.want)
        precise = self.has_extended_precision or self.requests_events
        can_leave = self.method.skips_heading and not self.keeps_heading
        leave_heading = level and can_leave and not precise
        accuracy = self.step or 0.0, self.tol or 0.0, self.digits or 0
        return self.method.name, *accuracy, self.max_steps, leave_heading

    @cached_property
    def copy_with_default_run_settings(self) -> SolveOptions:
        """A copy of the options without the settings that are specific to a single run."""
        events = () if self.requests_events else None
        options = replace(self, max_steps=0, every=None, want=None, events=events, tangents=())
        return self if options == self else options

    @property
    def can_skip_heading_angle(self) -> bool:
        """True if the heading is not computed, because no requested quantity depends on it."""
        return self.core_arguments[-1]

    def copy_options_with_heading(self) -> SolveOptions:
        """Return a copy of the options with which the heading of the top is always computed.

        This also holds for copies of the copy that record other quantities.
        """
        return self if self.keeps_heading else replace(self, keeps_heading=True)

    def copy_for_scene(self, scene: Scene) -> SolveOptions:
        """Return a copy of the options with which the method computes all that the motion needs."""
        return self.copy_options_with_heading() if any(scene.turning) else self

    def check_heading_is_computed(self, action: str) -> None:
        """Raise ValueError if the heading, which `action` needs, is not computed."""
        if self.can_skip_heading_angle:
            raise ValueError(
                "the heading of this run is not computed, because no quantity in want depends on "
                f"it: {action} needs it, so add 'q' to want"
            )

    @cached_property
    def max_time_with_exact_step_count(self) -> float:
        """A time [T] before which the number of steps is exactly representable as a double."""
        return math.inf if self.step is None else 0.5 * COUNTABLE * self.step

    @cached_property
    def chunk_size(self) -> int:
        """The largest number of states that are held in memory at a time."""
        return sys.maxsize if self.want is None else CHUNK_SIZE

    @property
    def bytes_per_state(self) -> int:
        """The number of bytes stored for each state, excluding the array of requested times."""
        return 64 if self.want is None else 8 * sum(map(count_quantity_components, self.want))

    @property
    def has_extended_precision(self) -> bool:
        """True if the states are recorded with more digits than double precision."""
        return (self.digits or 0) > 16

    def get_signed_step(self, is_back: bool) -> float | None:
        """Return the step size, which is negative if `is_back` is True."""
        return -self.step if is_back and self.step is not None else self.step


def validate_solve_options(
    scene: object,
    method: object,
    step: object = None,
    tol: object = None,
    digits: object = None,
    max_steps: object = 0,
    want: object = None,
    every: object = None,
    requested_method: object = None,
    t: object = None,
) -> SolveOptions:
    """Return the validated options for solving `scene`.

    `requested_method` is the name of the method given by the user. `t` contains the requested
    times, or is None if they are unknown. Raises TypeError or ValueError for an invalid argument.
    """
    top = scene if type(scene) is Scene else validate_type("scene", scene, Scene)
    resolved_method = resolve_method(
        FALLBACK if method == "auto" and digits is not None else method, top
    )
    is_open = (
        resolved_method.name == FALLBACK and method == "auto" and step is tol is digits is None
    )
    if is_open and t is not None and has_torus_closed_form(top) and prefers_closed_form(top, t):
        resolved_method = methods[EXACT]
    name = method if requested_method is None else requested_method
    options = make_solve_options(resolved_method, step, tol, digits, max_steps, name, want, every)
    return options.copy_for_scene(top)


def validate_options_for_method(
    method: Method,
    step: object,
    tol: object,
    digits: object,
    max_steps: object,
    requested_method: object,
    want: object,
    every: object = None,
) -> SolveOptions:
    """Return the validated options for a method, without any checks that depend on the scene.

    Raises TypeError or ValueError for an invalid argument.
    """
    return SolveOptions(
        method,
        validate_step(method, step),
        validate_tol(method, tol),
        validate_digits(method, digits, tol),
        as_int("max_steps", max_steps, 0),
        validate_requested_quantities(want),
        str(requested_method),
        validate_recording_interval(method, every),
    )


_find_options = lru_cache(maxsize=256, typed=True)(validate_options_for_method)


def make_solve_options(
    method: Method,
    step: object,
    tol: object,
    digits: object,
    max_steps: object,
    requested_method: object,
    want: object,
    every: object = None,
) -> SolveOptions:
    """Return the validated options for a method, from a cache if possible."""
    if want is None or type(want) is tuple:
        try:
            return _find_options(
                method, step, tol, digits, max_steps, requested_method, want, every
            )
        except TypeError:  # an argument is not hashable, or invalid
            pass
    return validate_options_for_method(
        method, step, tol, digits, max_steps, requested_method, want, every
    )


def validate_requested_quantities(want: object) -> tuple[QuantityName, ...] | None:
    """Return the names of the quantities to record, without duplicates.

    Raises TypeError or ValueError for invalid names.
    """
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


def validate_step(method: Method, step: object) -> float | None:
    """Return the step size, or None if the method takes no steps or chooses its first step.

    Raises ValueError if `step` is None but the method has a fixed step.
    """
    if step is not None:
        h = as_positive("step", step)
        return None if method.exact else h
    if not method.adaptive:
        raise ValueError(f"the method {method.name!r} has a fixed step: give step, as in step=0.01")
    return None


def validate_tol(method: Method, tol: object) -> float | None:
    """Validate the tolerance, and return it as a float, or None to use the default tolerance.

    Raises ValueError if the method has no tolerance, or if `tol` is not between 0 and 1.
    """
    if tol is None:
        return None
    if not (method.adaptive or method.implicit):
        raise ValueError(f"the method {method.name!r} has no tolerance: leave out tol")
    accuracy = as_positive("tol", tol)
    if accuracy >= 1.0:
        raise ValueError(
            f"tol must be below 1, since it is the relative error of a step; not {tol!r}"
        )
    return None if method.exact else accuracy


def validate_digits(method: Method, digits: object, tol: object) -> int | None:
    """Return the number of digits, rounded up to 16, 20 or 30.

    Raises ValueError if the method has a fixed precision, or if both `digits` and `tol` are given.
    """
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
    """Return the number of steps between two recorded states.

    Raises ValueError for an adaptive method.
    """
    if every is None:
        return None
    if method.adaptive:
        steps = "has none" if method.exact else "chooses its steps"
        raise ValueError(
            f"every needs a method of fixed step; {method.name} {steps}: give t as a list"
        )
    return as_int("every", every, 1)


def validate_progress_callback(progress: Progress | None) -> Progress | None:
    """Return `progress`; raise TypeError if it is neither callable nor None."""
    if progress is not None and not callable(progress):
        raise TypeError(
            f"progress must be a function that takes the time reached, not {short_repr(progress)}"
        )
    return progress


Kind = Literal["min", "max", "mean", "variance", "last", "where_min", "where_max"]
ReductionSpec = Mapping[str, Kind | Iterable[Kind]]  # maps quantities to kinds of reduction
CoreEvents = list[
    tuple[list[tuple[float, int, int]], list[tuple[float, int, int]], bool, int, int, bool]
]
Index = tuple[int, ...]
Shape = tuple[int, ...]
_TIMES_FORM = "a number, a list of times, or an array of times of each top"
_MAX_ROWS = 1 << 20  # largest number of times that are validated in one batch
_MAX_THREADS = 1024


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
class EnsembleOptions:
    """The validated options for solving an ensemble.

    solve        options of all tops; if `is_auto` is True, the method in `solve` is used only for
                 tops without a closed form
    is_auto      True if tops with a closed form use the closed form
    reductions   the reductions that replace the states of each top in the result
    core_events  the events to search for, as arguments of the core
    """

    solve: SolveOptions
    is_auto: bool = False
    reductions: tuple[Reduction, ...] = ()
    core_events: CoreEvents | None = None

    @property
    def has_step_search(self) -> bool:
        """True if the method and step are chosen separately for each top."""
        return self.solve.error is not None

    @property
    def uses_one_run_per_top(self) -> bool:
        """True if the motion of each top must be computed in a separate run."""
        is_one_by_one = self.core_events is not None or bool(self.solve.tangents)
        return is_one_by_one or self.solve.has_extended_precision

    @cached_property
    def core_arguments(self) -> tuple[str | None, float, float, int, int, bool]:
        """The method and its parameters, as passed to the C library."""
        name, step, tol, digits, most, leave_heading = self.solve.core_arguments
        return None if self.is_auto else name, step, tol, digits, most, leave_heading

    @cached_property
    def core_reductions(self) -> list[tuple[str, int, int]]:
        """The requested statistics, as passed to the C library."""
        return [one[:3] for one in self.reductions]

    @cached_property
    def bytes_per_state(self) -> int:
        """The number of bytes stored for each state."""
        if self.reductions:
            return 0
        numbers = self.solve.bytes_per_state + 8 * 6 * self.solve.tangent_column_count
        return numbers * (2 if self.solve.has_extended_precision else 1)

    def make_options_for_top(self, scene: Scene) -> SolveOptions:
        """Return the options for computing the motion of a single top."""
        one, name = self.solve, self.solve.requested_method
        if self.is_auto:
            controls = one.step, one.tol, one.digits, one.max_steps, name, one.want
            one = make_solve_options(resolve_method(name, scene), *controls)
        return one.copy_for_scene(scene)

    def copy_with_step_limit(self, max_steps: int) -> EnsembleOptions:
        """Return a copy of the options with at most `max_steps` steps per top."""
        steps = min(self.solve.max_steps or max_steps, max_steps)
        return replace(self, solve=replace(self.solve, max_steps=steps))


def format_index(index: Index) -> str:
    """Return an index as text, such as "[3, 17]"."""
    return f"[{', '.join(map(str, index))}]" if index else ""


def unravel_index(i: int, shape: Shape) -> Index:
    """Return the multi-dimensional index of an ensemble member, given its index in C order."""
    return tuple(map(int, np.unravel_index(i, shape))) if shape else ()


def get_member_by_flat_index(tops: Ensemble, i: int) -> Scene:
    """Return the i-th member of an ensemble in C order."""
    return tops._select_member(unravel_index(i, tops.shape))


def resolve_method_for_ensemble(name: object, tops: Ensemble) -> Method:
    """Return the method named `name` if it applies to all members of an ensemble.

    Raises ValueError if the method does not apply to a member; the message states its index.
    """
    method = get_method(name)
    if method.name == FALLBACK:  # suits every top
        return method
    first, count = unsuited(tops._core_scenes, method.name)
    if count:
        member = f"top{format_index(unravel_index(first, tops.shape))}"
        more = f", the first of {count} such members" if count > 1 else ""
        try:
            resolve_method(name, get_member_by_flat_index(tops, first))
        except ValueError as error:
            raise ValueError(f"{member}{more}: {error}") from None
    return method


def validate_ensemble_options(
    tops: Ensemble,
    method: object,
    step: object = None,
    tol: object = None,
    digits: object = None,
    max_steps: object = 0,
    want: object = None,
    reduce: object = None,
    every: object = None,
    requests_events: bool = False,
) -> EnsembleOptions:
    """Return the validated options for solving an ensemble.

    Raises TypeError or ValueError for an invalid argument.
    """
    is_auto = isinstance(method, str) and method == "auto"
    resolved_method = resolve_method_for_ensemble(FALLBACK if is_auto else method, tops)
    reductions = validate_reductions(reduce)
    if reductions and want is not None:
        raise ValueError("give either want, for the path of each top, or reduce, not both")
    names = tuple(dict.fromkeys([one.quantity for one in reductions])) if reductions else want
    solve = make_solve_options(resolved_method, step, tol, digits, max_steps, method, names, every)
    if reductions and solve.has_extended_precision:
        raise ValueError("reduce accepts at most 16 digits: its results are doubles")
    if requests_events:
        solve = replace(solve, events=())
    return EnsembleOptions(solve, is_auto and digits is None and not requests_events, reductions)


_COMPONENTS = {
    component: (quantity.name, i)
    for quantity in QUANTITIES.values()
    for i, component in enumerate(quantity.components)
}


@lru_cache
def find_components_by_name(name: str) -> list[tuple[str, int]]:
    """Return all components with the given name, as pairs (quantity, index).

    The name of a quantity denotes all of its components.
    """
    if name in QUANTITIES:
        return [(name, i) for i in range(QUANTITIES[name].doubles)]
    return [_COMPONENTS[name]]


def validate_reductions(reduce: object) -> tuple[Reduction, ...]:
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
    reductions: list[Reduction] = []
    for name, kinds in reduce.items():
        if not isinstance(name, str) or (name not in QUANTITIES and name not in _COMPONENTS):
            raise ValueError(
                unknown_name_message(
                    "quantity in reductions:", str(name), [*QUANTITIES, *_COMPONENTS]
                )
            )
        for kind in _validate_reduction_kinds(name, kinds):
            for quantity, component in find_components_by_name(name):
                reductions.append(Reduction(quantity, component, KINDS.index(kind), name))
    return tuple(reductions)


def _validate_reduction_kinds(name: str, value: object) -> list[str]:
    """Return the statistics requested for a quantity, without duplicates."""
    kinds = [value] if isinstance(value, str) else value
    if not isinstance(kinds, Iterable):
        raise TypeError(
            f"reductions[{name!r}] must be one or several of {KINDS}, not {short_repr(value)}"
        )
    unique_kinds = list(dict.fromkeys(kinds))
    for kind in unique_kinds:
        if kind not in KINDS:
            raise ValueError(
                unknown_name_message(f"kind in reductions[{name!r}]:", str(kind), KINDS)
            )
    if not unique_kinds:
        raise ValueError(
            f"reductions[{name!r}] is empty: give one or several of {', '.join(KINDS)}"
        )
    return unique_kinds


def validate_ensemble_times(tops: Ensemble, t: object, options: EnsembleOptions) -> Array:
    """Return the requested times, with one row per top if the tops have different times.

    Raises ValueError if the times are not monotonic, or if reaching them takes 2**53 steps or more.
    """
    step, every = options.solve.step, options.solve.every
    times = as_finite_array("t", t, _TIMES_FORM)
    if times.ndim > 1:
        times = _validate_times_per_top(tops, times)
        if every is not None:
            raise ValueError("every needs t as a number; an array lists its own times")
    elif times.ndim == 1:
        check_times_are_monotonic(times, every)
    else:
        times = compute_recording_times(float(times), step, every, options.bytes_per_state)
    end = float(np.abs(times).max(initial=0.0))
    if step is not None and not end / step < COUNTABLE:
        raise ValueError(too_many_steps_message(end, step))
    return times


def check_result_memory(tops: Ensemble, times: Array, options: EnsembleOptions) -> None:
    """Raise MemoryError if the states of all tops would not fit into memory."""
    byte_count = tops.size * times.shape[-1] * options.bytes_per_state
    if byte_count > get_total_memory():
        raise MemoryError(
            f"{tops.size} tops with {times.shape[-1]} states each need {1e-9 * byte_count:.3g} GB, "
            "more than this machine has: use fewer times, want, kreisel.reduce or kreisel.stream"
        )


def _validate_times_per_top(tops: Ensemble, times: Array) -> Array:
    """Broadcast an array of times to the shape of the ensemble, and return one row per top.

    Raises ValueError if `times` cannot be broadcast, or if the times of a top are not monotonic.
    """
    shape = (*tops.shape, times.shape[-1])
    try:
        all_times = np.broadcast_to(times, shape)
    except ValueError:
        raise ValueError(
            f"t must be a number, a list of times for all tops, or an array of shape "
            f"{(*tops.shape, 'k')} with k times of each, not an array of shape {times.shape}"
        ) from None
    rows = np.ascontiguousarray(all_times).reshape(tops.size, times.shape[-1])
    most = max(1, _MAX_ROWS // max(1, times.shape[-1]))
    for first in range(0, tops.size, most):
        _check_times_per_top_monotonic(rows[first : first + most], first, tops.shape)
    return rows


def _check_times_per_top_monotonic(rows: Array, first: int, shape: Shape) -> None:
    """Raise ValueError if the times of a top are not monotonic.

    `first` is the ensemble index of the top in the first row.
    """
    distances = np.where(rows[:, -1:] < 0.0, -rows, rows)
    is_backward = np.diff(distances, axis=1, prepend=0.0) < 0.0
    if not is_backward.any():
        return
    i, k = (int(indices[0]) for indices in np.nonzero(is_backward))
    index = unravel_index(first + i, shape)
    origin = (
        f"t{format_index((*index, k - 1))} = {float(rows[i, k - 1])!r}" if k else "the start at 0"
    )
    raise ValueError(
        "the times of a top must move away from 0 in one direction; "
        f"t{format_index((*index, k))} = {float(rows[i, k])!r} goes back from {origin}"
    )


def validate_output_array(
    tops: Ensemble, out: object, times: Array, options: EnsembleOptions
) -> Array | None:
    """Validate the output array `out`, and reshape it to one row per top.

    Raises TypeError or ValueError if `out` is not a suitable array.
    """
    if out is None:
        return None
    if options.reductions or options.solve.want is not None:
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


def validate_thread_count(threads: object, executor: object) -> int:
    """Return the number of threads, which defaults to the number of available processors.

    Raises TypeError or ValueError if an argument is invalid, or if both `threads` and `executor`
    are given.
    """
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
