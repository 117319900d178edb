"""What is asked of many tops: one request for all of them, their times, what is kept of their
states, and who moves them; checked before anything runs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from .._core import reductions as KINDS
from .._core import unsuited
from .._ground.arguments import Array, array, shown, whole
from .._ground.refusals import unknown
from .._model.scene import Ensemble, Scene
from .methods import ELSE, Method, fitting, named
from .quantities import QUANTITIES
from .request import Request, steered
from .times import COUNTABLE, listed, memory, too_many_steps

Kind = Literal["min", "max", "mean", "variance", "last", "where_min", "where_max"]
Reductions = Mapping[str, Kind | Iterable[Kind]]  # what reduce asks to keep
LookedFor = list[
    tuple[list[tuple[float, int, int]], list[tuple[float, int, int]], bool, int, int, bool]
]
Index = tuple[int, ...]
Shape = tuple[int, ...]
_WHAT = "a number, a list of times, or an array of times of each top"
_ROWS = 1 << 20  # times that are looked at at once
_MOST_THREADS = 1024


class Kept(NamedTuple):
    """What is kept of a component over a top's times; kinds are numbered as in the core, and the
    name is the one that was asked for."""

    quantity: str
    component: int
    kind: int
    name: str


@dataclass(frozen=True)
class Order:
    """A request for many tops.

    mixed  'auto': the closed form for those that have one, the request's method for all others
    kept    what is kept of each top's states in their place
    chooses method='geometric': each top has its own, and its own step
    events  what is looked for on the way, as the core takes it; None for nothing
    """

    request: Request
    mixed: bool = False
    kept: tuple[Kept, ...] = ()
    events: LookedFor | None = None
    chooses: bool = False

    @property
    def alone(self) -> bool:
        """Whether the tops go one by one: for events, and for what their doubles leave out."""
        return self.events is not None or self.request.low

    @property
    def core(self) -> tuple[str | None, float, float, int, int, bool]:
        """What steers it, as the core's worker takes it."""
        name, step, tol, digits, most, level = self.request.core
        return None if self.mixed else name, step, tol, digits, most, level

    def of(self, scene: Scene) -> Request:
        """The request of one top."""
        one = self.request
        method = fitting(one.asked, scene) if self.mixed else one.method
        return steered(method, one.step, one.tol, one.digits, one.max_steps, one.asked, one.want)

    def limited(self, most: int) -> Order:
        """The same with at most so many steps of each top."""
        steps = min(self.request.max_steps or most, most)
        return replace(self, request=replace(self.request, max_steps=steps))

    @property
    def reductions(self) -> list[tuple[str, int, int]]:
        """What is kept, as the core's worker takes it."""
        return [one[:3] for one in self.kept]

    @property
    def size(self) -> int:
        """Bytes of a state."""
        return 0 if self.kept else self.request.size * (2 if self.request.low else 1)


def place(index: Index) -> str:
    """A member as it is written: [3, 17]."""
    return f"[{', '.join(map(str, index))}]" if index else ""


def index_of(i: int, shape: Shape) -> Index:
    """The index of the i-th member in C order."""
    return tuple(map(int, np.unravel_index(i, shape))) if shape else ()


def member(tops: Ensemble, i: int) -> Scene:
    """The i-th member in C order."""
    return tops._member(index_of(i, tops.shape))


def fitting_all(name: object, tops: Ensemble) -> Method:
    """The method of this name; ValueError for the first member that it does not suit."""
    method = named(name)
    if method.name == ELSE:  # it suits every top
        return method
    first, count = unsuited(tops._tops, method.name)
    if count:
        where = f"top{place(index_of(first, tops.shape))}"
        more = f", the first of {count} such members" if count > 1 else ""
        try:
            fitting(name, member(tops, first))
        except ValueError as error:
            raise ValueError(f"{where}{more}: {error}") from None
    return method


def order(
    tops: Ensemble,
    method: object,
    step: object = None,
    tol: object = None,
    digits: object = None,
    max_steps: object = 0,
    want: object = None,
    reduce: object = None,
    watched: bool = False,
) -> Order:
    """The order in these words, for events or not. TypeError or ValueError for what cannot be."""
    automatic = isinstance(method, str) and method == "auto"
    mixed = automatic and digits is None and not watched
    chosen = fitting_all(ELSE if automatic else method, tops)
    kept = kept_of(reduce)
    if kept and want is not None:
        raise ValueError("give either want, for the path of each top, or reduce, not both")
    names = tuple(dict.fromkeys(one.quantity for one in kept)) if kept else want
    asked = steered(chosen, step, tol, digits, max_steps, method, names)
    if kept and asked.low:
        raise ValueError("reduce is for up to 16 digits: what it keeps is a double")
    return Order(replace(asked, watched=watched), mixed, kept)


_COMPONENTS = {
    component: (quantity.name, i)
    for quantity in QUANTITIES.values()
    for i, component in enumerate(quantity.components)
}


def components_of(name: str) -> list[tuple[str, int]]:
    """The components of a quantity, or the one of this name, as quantity and number."""
    if name in QUANTITIES:
        return [(name, i) for i in range(QUANTITIES[name].doubles)]
    return [_COMPONENTS[name]]


def kept_of(reduce: object) -> tuple[Kept, ...]:
    """What reduce={"nutation": ("min", "max")} asks to keep, as the core takes it."""
    if reduce is None:
        return ()
    if not isinstance(reduce, Mapping):
        raise TypeError(
            "reduce must name quantities and what to keep of them, as in "
            f"reduce={{'nutation': ('min', 'max')}}, not {shown(reduce)}"
        )
    if not reduce:
        raise ValueError("reduce names no quantity; leave it out for the path of each top")
    kept = []
    for name, given in reduce.items():
        if not isinstance(name, str) or (name not in QUANTITIES and name not in _COMPONENTS):
            raise ValueError(unknown("quantity in reduce:", str(name), [*QUANTITIES, *_COMPONENTS]))
        for kind in _kinds(name, given):
            kept += [Kept(of, i, KINDS.index(kind), name) for of, i in components_of(name)]
    return tuple(kept)


def _kinds(name: str, given: object) -> list[str]:
    """What to keep of a quantity, each once."""
    kinds = [given] if isinstance(given, str) else given
    if not isinstance(kinds, Iterable):
        raise TypeError(f"reduce[{name!r}] must be one or several of {KINDS}, not {shown(given)}")
    listed = list(dict.fromkeys(kinds))
    for kind in listed:
        if kind not in KINDS:
            raise ValueError(unknown(f"word in reduce[{name!r}]:", str(kind), KINDS))
    if not listed:
        raise ValueError(f"reduce[{name!r}] is empty: give one or several of {', '.join(KINDS)}")
    return listed


def times_of(tops: Ensemble, t: object, done: Order, every: int | None) -> Array:
    """(k,) times of all tops, or (n, k) where each has its own; every step of the way can be
    counted."""
    times = array("t", t, _WHAT)
    if times.ndim > 1:
        times = _own(tops, times)
        if every is not None:
            raise ValueError("every is for t as a number; an array says itself which states")
    else:
        times = listed(times, done.request.step, every, done.size)
    end = float(np.abs(times).max(initial=0.0))
    step = done.request.step
    if step is not None and not end / step < COUNTABLE:
        raise ValueError(too_many_steps(end, step))
    return times


def refuse_too_large(tops: Ensemble, times: Array, done: Order) -> None:
    """More states than there is memory for."""
    needed = tops.size * times.shape[-1] * done.size
    if needed > memory():
        raise MemoryError(
            f"{tops.size} tops with {times.shape[-1]} states each need {1e-9 * needed:.3g} GB, "
            "more than this machine has: take fewer times, keep less by want or reduce, or stream"
        )


def _own(tops: Ensemble, times: Array) -> Array:
    """(n, k) times that an array (*shape, k) gives each top, each row away from 0 in one
    direction."""
    wanted = (*tops.shape, times.shape[-1])
    try:
        given = np.broadcast_to(times, wanted)
    except ValueError:
        raise ValueError(
            f"t must be a number, a list of times for all tops, or an array of shape "
            f"{(*tops.shape, 'k')} with k times of each, not an array of shape {times.shape}"
        ) from None
    rows = np.ascontiguousarray(given).reshape(tops.size, times.shape[-1])
    most = max(1, _ROWS // max(1, times.shape[-1]))
    for first in range(0, tops.size, most):
        _refuse_disorder(rows[first : first + most], first, tops.shape)
    return rows


def _refuse_disorder(rows: Array, first: int, shape: Shape) -> None:
    """Times of a top that do not lead away from 0, named by the top."""
    away = np.where(rows[:, -1:] < 0.0, -rows, rows)
    wrong = np.diff(away, axis=1, prepend=0.0) < 0.0
    if not wrong.any():
        return
    i, k = (int(where[0]) for where in np.nonzero(wrong))
    at = index_of(first + i, shape)
    there = f"t{place((*at, k - 1))} = {float(rows[i, k - 1])!r}" if k else "the start at 0"
    raise ValueError(
        "the times of a top must lead away from 0 in one direction; "
        f"t{place((*at, k))} = {float(rows[i, k])!r} goes back from {there}"
    )


def out_of(tops: Ensemble, out: object, times: Array, done: Order) -> Array | None:
    """The array that gets the states, as (n, k, 8)."""
    if out is None:
        return None
    if done.kept or done.request.want is not None:
        raise ValueError("out is for states: leave want and reduce out")
    shape = (*tops.shape, times.shape[-1], 8)
    if not isinstance(out, np.ndarray):
        raise TypeError(f"out must be an array of numpy, not {shown(out)}")
    if out.dtype != np.float64 or out.shape != shape:
        raise ValueError(
            f"out must be an array of float64 of shape {shape}, not of {out.dtype} and {out.shape}"
        )
    if not out.flags.c_contiguous or not out.flags.writeable:
        raise ValueError("out must lie in C order and be writeable")
    return out.reshape(tops.size, times.shape[-1], 8)


def threads_of(threads: object, executor: object) -> int:
    """How many threads move the tops; those of an executor that is given are its own."""
    if executor is not None:
        if threads is not None:
            raise ValueError("give either threads or an executor, not both")
        if not isinstance(executor, Executor):
            raise TypeError(
                "executor must be one of concurrent.futures, as a ThreadPoolExecutor, "
                f"not {shown(executor)}"
            )
    if threads is not None:
        return min(whole("threads", threads, 1), _MOST_THREADS)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
