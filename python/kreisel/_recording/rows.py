"""Rows: what the core records for a request, before it is a path; and why it would not begin."""

from __future__ import annotations

import numpy as np

from .._core import Work, record, start
from .._ground.arguments import Array
from .._ground.refusals import refusal
from .._model.scene import Scene
from .._request.methods import is_kowalewski, no_closed_form
from .._request.request import Progress, Request

# The name of the status, 'OK' where all went well; (n, 8) t, q, m of the states that were reached,
# and what their doubles leave out; steps, rejected ones, evaluations, iterations; the
# last time that was asked for.
Rows = tuple[str, Array, Array | None, tuple[int, int, int, int], float]


def rows(
    scene: Scene, done: Request, times: Array, progress: Progress | Work | None = None
) -> Rows:
    """The states of a request at these times, which need no check; who waits for them is told of
    progress, or may stop the work."""
    came = record(scene._block, *done.core, times, progress=progress)
    assert came is not None
    return came


def rows_in_any_order(scene: Scene, done: Request, times: Array) -> Rows:
    """The states of a request at these times, which lie on either side of 0 as they like; where a
    run fails, those that it reached."""
    states = np.empty((times.size, 8))
    low = np.empty((times.size, 8)) if done.low else None
    counts, end = np.zeros(4, dtype=np.int64), 0.0
    for side in (times < 0.0, times >= 0.0):
        at = np.flatnonzero(side)
        at = at[np.argsort(np.abs(times[at]), kind="stable")]
        if not at.size:
            continue
        came = rows(scene, done, times[at])
        if came[0] != "OK":
            return came
        states[at], end, counts = came[1], came[-1], counts + came[3]
        if low is not None:
            low[at] = came[2]
    steps, rejected, evaluations, iterations = counts.tolist()
    return "OK", states, low, (steps, rejected, evaluations, iterations), end


def rows_at_once(
    scene: Scene, done: Request, t: object, progress: Progress | None = None
) -> Rows | None:
    """The states of a request at times as a user gave them; None where they need a second look."""
    most = min(scene._within, done.within)
    return record(scene._block, *done.core, t, most, done.limit, progress)


def refused(
    status: str, scene: Scene, method: str, step: float | None, tol: float | None
) -> Exception:
    """The exception for a top that the core did not make, with a step that would do."""
    if status == "ERR_METHOD" and is_kowalewski(scene):
        return ValueError(f"the method {method!r} does not apply: {no_closed_form(scene)}")
    would = ""
    if status == "ERR_STEP_SIZE" and step:
        fits = step
        while fits and start(scene._block, method, fits, 0.0, 0, 0)[0] == status:
            fits /= 2.0
        would = f", where {fits!r} would do"
    return refusal(status, f"{method} with step = {step!r}{would}, tol = {tol!r} and {scene!r}")
