"""Rows: what the core records for a request, before it is a path; and why it would not begin."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._core import record
from .._ground.arguments import Array
from .._ground.refusals import refusal
from .._model.scene import Scene
from .._request.request import Progress, Request


class Rows(NamedTuple):
    """status  its name, 'OK' where all went well
    states  (n, 8): t, q, m of the states that were reached; low: what their doubles leave out
    counts  steps, rejected ones, evaluations, iterations
    """

    status: str
    states: Array
    low: Array | None
    counts: tuple[int, int, int, int]


def rows(done: Request, times: Array, progress: Progress | None = None) -> Rows:
    """The states of a request at these times, which need no check."""
    back = bool(times.size and times[-1] < 0.0)
    block, name, steering = done.scene._block, done.method.name, done.steering(back)
    return Rows(*record(block, name, *steering, times, done.leave_heading, progress))


def refused(
    status: str, scene: Scene, method: str, step: float | None, tol: float | None
) -> Exception:
    """The exception for a top that the core did not make, with a step that would do."""
    would = ""
    if status == "ERR_STEP_SIZE" and step:
        fits, none = step, np.empty(0)
        while fits and record(scene._block, method, fits, 0.0, 0, 0, none)[0] == status:
            fits /= 2.0
        would = f", where {fits!r} would do"
    return refusal(status, f"{method} with step = {step!r}{would}, tol = {tol!r} and {scene!r}")
