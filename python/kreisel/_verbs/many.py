"""kreisel.solve of an ensemble."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import replace
from typing import NamedTuple

from .._ground.arguments import Array, Numbers
from .._ground.names import QuantityName
from .._model.scene import Ensemble
from .._recording.crew import Crew
from .._recording.moving import move
from .._recording.paths import Paths
from .._recording.reduced import Reduced
from .._request.many import Order, Reductions, order, out_of, threads_of, times_of
from .._request.request import Progress, checked_every, checked_progress
from ..events import checked_events, looked_for
from .start import Looked


class Words(NamedTuple):
    """What steers a solve, and what is wanted of it."""

    step: float | None = None
    tol: float | None = None
    digits: int | None = None
    every: int | None = None
    max_steps: int = 0
    error: float | None = None
    want: Iterable[QuantityName] | None = None
    events: Looked | None = None
    reduce: Reductions | None = None


def solve_all(
    tops: Ensemble,
    t: Numbers,
    method: str,
    words: Words,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    out: Array | None = None,
) -> Paths | Reduced:
    """What becomes of all tops, in the words of solve."""
    asked = order_of(tops, method, words)
    every = words.every
    number = checked_every(asked.request.method, every)
    crew = Crew(threads_of(threads, executor), executor)
    callback = checked_progress(progress)
    times = times_of(tops, t, asked, number)
    target = out_of(tops, out, times, asked)
    if asked.kept:
        return move(Reduced, tops, times, asked, crew, callback)
    return move(Paths, tops, times, asked, crew, callback, target)


def order_of(tops: Ensemble, method: str, words: Words) -> Order:
    """The order in these words, and the events to look for."""
    step, tol, digits, _, max_steps, _, want, events, reduce = words
    if events is None:
        return order(tops, method, step, tol, digits, max_steps, want, reduce)
    if reduce is not None:
        raise ValueError("events are met on the way of paths: leave reduce out")
    asked = order(tops, method, step, tol, digits, max_steps, want, watched=True)
    sought = looked_for(checked_events(asked.request.method.name, events))
    return replace(asked, events=sought)


def refuse_words_of_many(*given: object) -> None:
    """Words for an ensemble that were given with one scene."""
    names = [
        name
        for name, value in zip(("threads", "executor", "reduce", "out"), given, strict=True)
        if value is not None
    ]
    raise ValueError(
        f"{' and '.join(names)}: for a kreisel.Ensemble of many tops, not for one scene"
    )
