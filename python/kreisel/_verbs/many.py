"""kreisel.solve of an ensemble."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Executor
from typing import NamedTuple

from .._ground.arguments import Array, Numbers
from .._ground.names import QuantityName
from .._model.scene import Ensemble
from .._recording.crew import Crew
from .._recording.moving import move
from .._recording.paths import Paths
from .._recording.reduced import Reduced
from .._request.many import Reductions, order, out_of, threads_of, times_of
from .._request.request import Progress, checked_every, checked_progress
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
    step, tol, digits, every, max_steps, _, want, _, reduce = words
    asked = order(tops, method, step, tol, digits, max_steps, want, reduce)
    number = checked_every(asked.request.method, every)
    crew = Crew(threads_of(threads, executor), executor)
    callback = checked_progress(progress)
    times = times_of(tops, t, asked, number)
    target = out_of(tops, out, times, asked)
    kind = Reduced if asked.kept else Paths
    return move(kind, tops, times, asked, crew, callback, target)


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
