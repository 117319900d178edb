"""Validated options for ensembles: solver options, times, statistics and threads."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Literal, NamedTuple

import numpy as np

from .._core import reductions as KINDS
from .._core import unsuited
from .._model.scene import Ensemble, Scene
from .._utils.errors import unknown_name_message
from .._utils.validation import Array, as_finite_array, as_int, short_repr
from .methods import FALLBACK, Method, get_method, resolve_method
from .quantities import QUANTITIES
from .solve_options import SolveOptions, make_solve_options
from .times import (
    COUNTABLE,
    check_times_are_monotonic,
    compute_recording_times,
    get_total_memory,
    too_many_steps_message,
)

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
