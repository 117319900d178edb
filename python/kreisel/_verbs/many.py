"""kreisel.solve of an ensemble."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import Executor
from dataclasses import replace
from typing import NamedTuple

from .._ground.arguments import Array, Numbers, whole
from .._ground.names import QuantityName
from .._model.scene import Ensemble
from .._recording.crew import Crew
from .._recording.moving import move
from .._recording.paths import Paths
from .._recording.reduced import Reduced
from .._recording.top_rows import fill
from .._request.many import Order, Reductions, order, out_of, refuse_too_large, threads_of, times_of
from .._request.methods import methods
from .._request.plan import BY_TRIAL
from .._request.request import Progress, Request, checked_every, checked_progress, wanted
from ..events import checked_events, looked_for
from .geometric import checked_error, no_error
from .geometric_many import fill_best
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
    chooses = isinstance(method, str) and method == BY_TRIAL
    asked = by_trial(words) if chooses else order_of(tops, method, words)
    number = None if chooses else checked_every(asked.request.method, words.every)
    crew = Crew(threads_of(threads, executor), executor)
    callback = checked_progress(progress)
    times = times_of(tops, t, asked, number)
    refuse_too_large(tops, times, asked)
    target = out_of(tops, out, times, asked)
    if asked.kept:
        return move(Reduced, tops, times, asked, crew, callback)
    way = fill_best if chooses else fill
    return move(Paths, tops, times, asked, crew, callback, target, way)


def stream_all(
    tops: Ensemble,
    t: Numbers,
    method: str,
    words: Words,
    chunk: int,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> Iterator[Paths]:
    """The paths of solve, of a few tops at a time: of `chunk` states together, or of one top."""
    asked = order_of(tops, method, words)
    number = checked_every(asked.request.method, words.every)
    crew = Crew(threads_of(threads, executor), executor)
    callback = checked_progress(progress)
    times = times_of(tops, t, asked, number)
    some = max(1, chunk // max(1, times.shape[-1]))
    return _streamed(tops, times, asked, crew, callback, some)


def _streamed(
    tops: Ensemble, t: Array, asked: Order, crew: Crew, progress: Progress | None, some: int
) -> Iterator[Paths]:
    row = tops.ravel()
    for begin in range(0, len(row), some):
        own = t[begin : begin + some] if t.ndim == 2 else t
        yield move(Paths, row[begin : begin + some], own, asked, crew)
        if progress is not None:
            progress(min(1.0, (begin + some) / len(row)))


def order_of(tops: Ensemble, method: str, words: Words) -> Order:
    """The order in these words, and the events to look for."""
    step, tol, digits, _, max_steps, error, want, events, reduce = words
    if error is not None:
        raise no_error(method)
    if events is None:
        return order(tops, method, step, tol, digits, max_steps, want, reduce)
    if reduce is not None:
        raise ValueError("events are met on the way of paths: leave reduce out")
    asked = order(tops, method, step, tol, digits, max_steps, want, watched=True)
    sought = looked_for(checked_events(asked.request.method.name, events))
    return replace(asked, events=sought)


def by_trial(words: Words) -> Order:
    """The order of method='geometric', which has the error allowed for its tolerance."""
    steering = words._asdict()
    for word in ("error", "max_steps", "want"):
        del steering[word]
    target = checked_error(words.error, steering)
    most = whole("max_steps", words.max_steps, 0)
    method = methods["strang"]  # of those that may be chosen none stands for all
    names = wanted(words.want)
    return Order(Request(method, None, target, None, most, names, BY_TRIAL), chooses=True)


def refuse_words_of_many(*given: object) -> None:
    """Words for an ensemble that were given with one scene."""
    names = [
        name
        for name, value in zip(("threads", "executor", "reduce", "out"), given, strict=False)
        if value is not None
    ]
    raise ValueError(
        f"{' and '.join(names)}: for a kreisel.Ensemble of many tops, not for one scene"
    )
