"""kreisel.solve of an ensemble."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import Executor

import numpy as np

from .._ground.arguments import Array, Numbers
from .._ground.names import QuantityName
from .._model.ensemble import Ensemble
from .._recording.crew import Crew
from .._recording.moving import move
from .._recording.paths import Paths
from .._request.many import order, out_of, threads_of, times_of
from .._request.request import Progress, checked_every, checked_progress


def solve_all(
    tops: Ensemble,
    t: Numbers,
    method: str,
    *,
    step: float | None = None,
    tol: float | None = None,
    digits: int | None = None,
    every: int | None = None,
    max_steps: int = 0,
    want: Iterable[QuantityName] | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    out: Array | None = None,
) -> Paths:
    asked = order(tops, method, step, tol, digits, max_steps, want)
    number = checked_every(asked.request.method, every)
    crew = Crew(threads_of(threads, executor), executor)
    callback = checked_progress(progress)
    times = times_of(tops, t, asked, number)
    return move(Paths, tops, times, asked, crew, callback, out_of(tops, out, times, asked))
