"""Validation of the requested times, and generation of equally spaced times."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from .._model.scene import Scene
from .._utils.arguments import Array, Numbers, R, as_finite_array, as_float

CHUNK_SIZE = 1 << 14  # largest number of states that are held in memory at a time
COUNTABLE = 2.0**53  # largest number up to which doubles represent all integers
TIMES_FORM = "a number or a list of times"
_MAX_ROWS = 1 << 20  # largest number of times that are validated in one batch


def time_array(
    t: object,
    step: float | None,
    every: int | None,
    size: int = 64,
    begin: float = 0.0,
    shape: tuple[int, ...] | None = None,
) -> Array:
    """Return the requested times, given either as a list or as a final time.

    If `shape`, the shape of an ensemble, is given, the times may be an array with separate times of
    each top; the result then has one row per top. `size` is the number of bytes required for each
    state. Raises MemoryError if the states would not fit into memory.
    """
    times = validate_time_list(t) if shape is None else as_finite_array("t", t, _TIMES_OF_TOPS)
    if times.ndim > 1 and shape is not None:
        times = _validate_times_per_top(times, shape)
        if every is not None:
            raise ValueError("every needs t as a number; an array lists its own times")
    elif times.ndim == 1:
        check_times_are_monotonic(times, every)
    elif step is None or every is None:
        times = np.array([begin, float(times)])
    else:
        return _compute_times_of_every_nth_step(float(times), step, every, size + 8, begin)
    end = float(np.abs(times).max(initial=0.0))
    if shape is not None and step is not None and not end / step < COUNTABLE:
        raise ValueError(too_many_steps_message(end, step))
    return times


_TIMES_OF_TOPS = "a number, a list of times, or an array of times of each top"


def _validate_times_per_top(times: Array, shape: tuple[int, ...]) -> Array:
    """Broadcast an array of times to the shape of the ensemble, and return one row per top."""
    try:
        all_times = np.broadcast_to(times, (*shape, times.shape[-1]))
    except ValueError:
        raise ValueError(
            f"t must be a number, a list of times for all tops, or an array of shape "
            f"{(*shape, 'k')} with k times of each, not an array of shape {times.shape}"
        ) from None
    rows = np.ascontiguousarray(all_times).reshape(math.prod(shape), times.shape[-1])
    most = max(1, _MAX_ROWS // max(1, times.shape[-1]))
    for first in range(0, len(rows), most):
        block = rows[first : first + most]
        distances = np.where(block[:, -1:] < 0.0, -block, block)
        is_backward = np.diff(distances, axis=1, prepend=0.0) < 0.0
        if is_backward.any():
            i, k = (int(indices[0]) for indices in np.nonzero(is_backward))
            at = [int(j) for j in np.unravel_index(first + i, shape)]
            origin = f"t{[*at, k - 1]} = {float(block[i, k - 1])!r}" if k else "the start at 0"
            raise ValueError(
                "the times of a top must move away from 0 in one direction; "
                f"t{[*at, k]} = {float(block[i, k])!r} goes back from {origin}"
            )
    return rows


def validate_time_list(t: object) -> Array:
    """Return one time, or a list of times, as an array of shape () or (k,)."""
    times = as_finite_array("t", t, TIMES_FORM)
    if times.ndim > 1:
        raise ValueError(
            f"t must be a number or a list of times, not an array of shape {times.shape}"
        )
    return times


def check_times_are_monotonic(times: Array, every: int | None) -> None:
    """Raise ValueError if a list of times is not monotonic, or if `every` is given as well."""
    if every is not None:
        raise ValueError("every needs t as a number; a list has its own times")
    check_times_continue_monotonically(times, 0.0, times.size > 0 and bool(times[-1] < 0.0))


def check_times_continue_monotonically(times: Array, last: float, is_back: bool) -> None:
    """Raise ValueError unless the times start at or after `last` and do not decrease.

    If `is_back` is True, the times must not increase.
    """
    steps = (times[1:] > times[:-1]) if is_back else (times[1:] < times[:-1])
    if times.size and (times[0] > last if is_back else times[0] < last):
        i, origin = 0, f"the run's {last!r}" if last else "the start at 0"
    elif steps.any():
        i = int(steps.argmax()) + 1
        origin = f"t[{i - 1}] = {float(times[i - 1])!r}"
    else:
        return
    entry = f"t[{i}] = {float(times[i])!r}"
    raise ValueError(
        f"times must move away from 0 in one direction; {entry} goes back from {origin}"
    )


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
            raise ValueError("every needs t as a number; an iterator has its own times")
        return _split_time_iterator_into_chunks(t, size)
    if np.ndim(t) > 0 or isinstance(t, Sequence):
        times = time_array(t, step, every)
        return (times[i : i + size] for i in range(0, times.size, size))
    if every is None or step is None:
        raise ValueError(
            "a stream needs times: every=10 with a method of fixed step, or t as a list or iterator"
        )
    end = float(t) if isinstance(t, float) and math.isinf(t) else as_float("t", t)
    return _split_time_grid_into_chunks(end, step, every, size, resume_time, begin)


def find_time_direction(t: Numbers | Iterator[float]) -> tuple[bool, Numbers | Iterator[float]]:
    """Return a flag that is True if time runs backwards, and the requested times.

    If `t` is an iterator, times are read from it up to the first nonzero time. The returned
    iterator starts again with the times that have already been read.
    """
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
    length = abs(end - begin)
    if not length / step < COUNTABLE:
        raise ValueError(too_many_steps_message(end, step))
    steps = math.floor(length / step + 0.5)
    rounding = 2.0 * np.finfo(float).eps * max(abs(begin), abs(end))
    return steps - 1 if steps * step - length > rounding else steps


def _compute_grid_times(steps: R, step: float, begin: float) -> R:
    """Return the times after the given numbers of steps, starting at the time `begin`."""
    times = steps * step
    return times + begin if begin else times


def _compute_times_of_every_nth_step(
    end: float, step: float, every: int, size: int, begin: float
) -> Array:
    """Return the times from `begin` to `end` at intervals of `every` steps."""
    steps = _count_whole_steps(end, step, begin)
    states = steps // every + 1
    check_states_fit_in_memory(states, size)
    grid = np.arange(0, steps + 1, every, dtype=np.float64)
    return _compute_grid_times(grid, math.copysign(step, end - begin), begin)


def _split_time_grid_into_chunks(
    end: float, step: float, every: int, size: int, resume_time: float | None, begin: float
) -> Iterator[Array]:
    last = 2**53 - 1 if math.isinf(end) else _count_whole_steps(end, step, begin)
    first, signed_step = 0, math.copysign(step, end - begin)
    if resume_time is not None:
        first = _count_whole_steps(resume_time, step, begin) // every * every
        first += (
            every
            if abs(_compute_grid_times(float(first), signed_step, begin)) <= abs(resume_time)
            else 0
        )
    return (
        _compute_grid_times(
            np.arange(k, min(k + size * every, last + 1), every, dtype=np.float64),
            signed_step,
            begin,
        )
        for k in range(first, last + 1, size * every)
    )


def check_states_fit_in_memory(states: int, size: int) -> None:
    """Raise MemoryError if the states, with `size` bytes each, would not fit in memory."""
    if size * states > get_total_memory():
        memory = f"{1e-9 * size * states:.3g} GB"
        raise MemoryError(
            f"{states} states need {memory}, more than this machine has: record fewer with a "
            "larger every or step"
        )


def get_total_memory() -> int:
    """Return the memory of this machine in bytes, or 2**63 if it is unknown."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return 2**63


def too_many_steps_message(end: float, step: float) -> str:
    return (
        f"t = {end!r} takes more steps of {step!r} than double precision can count (2**53): "
        "take larger steps"
    )


def check_resolvable_horizon(scene: Scene, end: float, step: float | None) -> None:
    """Raise ValueError if double precision does not suffice to compute the state at time `end`.

    The run up to `end` must have fewer than 2**53 steps, and the top must turn by less than 2**53
    rad.
    """
    if step is not None and not abs(end / step) < COUNTABLE:
        raise ValueError(too_many_steps_message(end, abs(step)))
    horizon = scene._resolvable_horizon  # 0 if the momentum is too large for the core
    if end and abs(end) >= horizon:
        angle = COUNTABLE * (abs(end) / horizon) if horizon else math.inf
        raise ValueError(
            f"by t = {end!r} this top turns by {angle:.2g} rad: double precision cannot "
            "resolve its attitude"
        )
