"""kreisel.plan: what a verb would use and leave out, and what it would cost, of one scene or of
many."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import overload

import numpy as np

from .._core import Worker, unsuited
from .._ground.arguments import Array, Numbers
from .._ground.names import MethodName, QuantityName
from .._model.scene import Ensemble, Scene
from .._recording.top_rows import TopRows, fill
from .._request.many import Order, Reductions, member, threads_of, times_of
from .._request.methods import ELSE
from .._request.plan import BY_TRIAL, Plan, plan_of
from .._request.plan import plan as plan_one
from .._request.request import checked_every
from .many import Words, order_of, refuse_words_of_many

_MEMBERS = 16  # so many tops are measured, and
_STATES, _STEPS = 1 << 11, 1 << 11  # no more of their states and steps
_ROW = 57  # bytes that are told of each top: status, states done, counts, time reached


@dataclass(frozen=True)
class ManyPlan:
    """What is used for an ensemble; print it.

    shape        of the ensemble
    closed_form  how many tops go by their closed form
    lanes        how many go as many at once as a vector has lanes
    alone        how many go one by one, in each thread
    threads      how many move them
    states       of each top; None where no times were given
    bytes        of the result, or of a state where no times were given
    seconds      about how long it takes; None where no times were given
    measured     how many tops, spread over the ensemble, that was measured with, each for at most
                 some thousand steps
    first        what is used for the first top; None where there is none
    """

    shape: tuple[int, ...]
    closed_form: int
    lanes: int
    alone: int
    threads: int
    states: int | None
    bytes: int
    seconds: float | None
    measured: int
    first: Plan | None

    def __str__(self) -> str:
        counts = {
            "by closed form": self.closed_form,
            "in lanes": self.lanes,
            "one by one": self.alone,
        }
        ways = ", ".join(f"{n} {way}" for way, n in counts.items() if n) or "none"
        parts = {"tops": f"{self.shape}: {ways}; by {self.threads} threads"}
        if self.states is None:
            parts["recorded"] = f"{self.bytes} bytes a state"
        else:
            parts["recorded"] = f"{self.states} states each: {1e-6 * self.bytes:.3g} MB in all"
        if self.seconds is not None:
            parts["time"] = f"about {self.seconds:.2g} s, as {self.measured} of the tops tell"
        lines = [f"{name:<11}{text}" for name, text in parts.items()]
        return "\n".join([*lines, *([f"the first of them:\n{self.first}"] if self.first else [])])


@overload
def plan(
    scene: Scene,
    t: Numbers | None = None,
    want: Iterable[QuantityName] | None = None,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    threads: None = None,
    reduce: None = None,
) -> Plan: ...
@overload
def plan(
    scene: Ensemble,
    t: Numbers | None = None,
    want: Iterable[QuantityName] | None = None,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    threads: int | None = None,
    reduce: Reductions | None = None,
) -> ManyPlan: ...
def plan(
    scene: Scene | Ensemble,
    t: Numbers | None = None,
    want: Iterable[QuantityName] | None = None,
    method: MethodName = "auto",
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    threads: int | None = None,
    reduce: Reductions | None = None,
) -> Plan | ManyPlan:
    """What kreisel.solve would use in these words, and what it would leave out. Nothing is run, but
    of an ensemble a few tops for some milliseconds, to tell how long all will take.

    t  may be left out; with it the plan says which states are wanted

        >>> import kreisel as kr
        >>> plan = kr.plan(kr.scenes.asymmetric, want=("nutation", "energy"))
        >>> print(str(plan).splitlines()[0])
        method     taylor: no closed form is known for this body of kind 'general' under gravity
        >>> tops = kr.scenes.asymmetric.vary(gravity=[0.0, 0.5, 1.0])
        >>> print(str(kr.plan(tops, 10, threads=2)).splitlines()[0])
        tops       (3,): 1 by closed form, 2 in lanes; by 2 threads

    Raises what kreisel.solve raises before anything runs; ValueError for 'geometric', whose choice
    takes trial runs: see path.plan.
    """
    if isinstance(scene, Ensemble):
        if method == BY_TRIAL:
            raise ValueError("method='geometric' chooses by trial runs: solve, and see path.plan")
        words = Words(step, tol, digits, every, want=want, reduce=reduce)
        return _plan_all(scene, t, method, words, threads_of(threads, None))
    if threads is not None or reduce is not None:
        refuse_words_of_many(threads, None, reduce)
    return plan_one(scene, t, want, method, step=step, tol=tol, digits=digits, every=every)


def _plan_all(
    tops: Ensemble, t: Numbers | None, method: MethodName, words: Words, threads: int
) -> ManyPlan:
    asked = order_of(tops, method, words)
    number = checked_every(asked.request.method, words.every)
    closed, lanes = _ways(tops, asked)
    size = 8 * len(asked.kept) if asked.kept else asked.size
    states, seconds, measured = None, None, 0
    if t is not None:
        times = times_of(tops, t, asked, number)
        states = times.shape[-1]
        size = tops.size * (_ROW + (size if asked.kept else states * size))
        seconds, measured = _measured(tops, times, asked, threads)
    return ManyPlan(
        shape=tops.shape,
        closed_form=closed,
        lanes=lanes,
        alone=tops.size - closed - lanes,
        threads=threads,
        states=states,
        bytes=size,
        seconds=seconds,
        measured=measured,
        first=_first(tops, asked, states),
    )


def _ways(tops: Ensemble, asked: Order) -> tuple[int, int]:
    """How many tops have a closed form that is used, and how many go in lanes."""
    if asked.request.method.exact:
        return tops.size, 0
    if asked.alone or asked.request.method.name != ELSE:
        return 0, 0
    damped = int(np.count_nonzero((tops.damping > 0.0).any(axis=-1)))
    closed = tops.size - unsuited(tops._tops, "auto")[1] if asked.mixed else 0
    return closed, tops.size - closed - damped


def _first(tops: Ensemble, asked: Order, states: int | None) -> Plan | None:
    if not tops.size:
        return None
    scene, one = member(tops, 0), asked.request
    plan = plan_of(scene, asked.of(scene) if asked.mixed else one, states)
    kernel, order = Worker(*asked.core, []).kernel
    if plan.method != ELSE or asked.alone or not kernel or any(scene.damping):
        return plan
    level = one.leave_heading
    form = "(P, W): vertical and angular velocity seen from the body"
    form += "; without the heading" if level else ", and from these the heading"
    return replace(plan, order=order, kernel=f"{kernel}, in lanes", form=form)


def _measured(tops: Ensemble, t: Array, asked: Order, threads: int) -> tuple[float, int]:
    """About how many seconds the tops take, by some of them whose steps and states are limited; and
    by how many."""
    if not tops.size or not t.shape[-1]:
        return 0.0, 0
    at = np.unique(np.linspace(0, tops.size - 1, _MEMBERS).astype(np.int64))
    some = tops[np.unravel_index(at, tops.shape)] if tops.shape else tops.reshape(1)
    whole = t[at] if t.ndim == 2 else t
    times = whole[..., :_STATES]
    few = asked.limited(_STEPS)
    rows = TopRows.empty(at.size, times.shape[-1], few)
    begun = time.perf_counter()
    fill(rows, few, some, 0, at.size, times, None)
    spent = time.perf_counter() - begun
    all_told = rows.done == times.shape[-1]
    part = np.where(all_told, rows.done / whole.shape[-1], np.inf)
    end = np.abs(np.broadcast_to(whole[..., -1], part.shape))
    with np.errstate(invalid="ignore", divide="ignore"):
        way = np.where(end > 0.0, np.abs(rows.reached) / end, np.inf)
    done = float(np.maximum(np.minimum(part, way), 1e-9).mean())
    return spent / done * tops.size / at.size / threads, int(at.size)
