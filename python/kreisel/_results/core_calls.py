"""Functions that compute the motion of a single scene by calling the C library."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._core import Work, record, start
from .._model.scene import Scene
from .._options.methods import explain_no_closed_form, has_torus_closed_form
from .._options.solve_options import Progress, SolveOptions
from .._utils.errors import make_exception_from_status
from .._utils.validation import Array, as_finite_array, as_float

# The name of the status; the states reached (n, 8), as t, q, m; the low words of these states or
# None; the numbers of steps, rejected steps, evaluations and iterations; the last requested time.
CoreResult = tuple[str, Array, Array | None, tuple[int, int, int, int], float]


class RunStart(NamedTuple):
    """The time [T] of a run's initial state, and the low-order words of that state, if any.

    The time is nonzero only after a `push`, a `reset` or a change of the scene.
    """

    begin: float = 0.0
    low: Array | None = None

    def to_json(self) -> list[object] | None:
        """Convert this RunStart object to a JSON value, or to None for the default start."""
        if not self.begin and self.low is None:
            return None
        return [self.begin, None if self.low is None else self.low.tolist()]

    @classmethod
    def from_json(cls, value: object) -> RunStart:
        """Build a RunStart object from its JSON value. Raises TypeError or ValueError."""
        if value is None:
            return ORIGIN
        if not isinstance(value, list) or len(value) != 2:
            raise TypeError("the start must be a time and low words")
        low = None if value[1] is None else as_finite_array("low", value[1], "8 numbers")
        if low is not None and low.shape != (8,):
            raise ValueError(f"the low words of the start must be 8 numbers, not {low.size}")
        return cls(as_float("the time of the start", value[0]), low)


ORIGIN = RunStart()


def compute_states_at_times(
    scene: Scene,
    options: SolveOptions,
    times: Array,
    progress: Progress | Work | None = None,
    origin: RunStart = ORIGIN,
) -> CoreResult:
    """Record the states of the motion at the given times, which must have been validated before.

    `progress` is either a callback that receives the current time, or a Work object that can stop
    the run.
    """
    begin, low = origin
    return record(
        scene._block, *options.core_arguments, times, progress=progress, begin=begin, low=low
    )


def compute_states_at_unordered_times(
    scene: Scene, options: SolveOptions, times: Array, origin: RunStart = ORIGIN
) -> CoreResult:
    """Compute the states at given times, which may be negative and need not be sorted.

    States at negative and at positive times are computed in separate runs. If a run fails, the
    result contains only the states that this run reached before the failure.
    """
    states = np.empty((times.size, 8))
    low = np.empty((times.size, 8)) if options.has_extended_precision else None
    counts, end = np.zeros(4, dtype=np.int64), 0.0
    for side in (times < 0.0, times >= 0.0):
        indices = np.flatnonzero(side)
        indices = indices[np.argsort(np.abs(times[indices]), kind="stable")]
        if not indices.size:
            continue
        result = compute_states_at_times(scene, options, times[indices], None, origin)
        if result[0] != "OK":
            return result
        states[indices], end, counts = result[1], result[-1], counts + result[3]
        if low is not None:
            low[indices] = result[2]
    steps, rejected, evaluations, iterations = counts.tolist()
    return "OK", states, low, (steps, rejected, evaluations, iterations), end


def make_core_start_error(
    status: str, scene: Scene, method: str, step: float | None, tol: float | None
) -> Exception:
    """Return the exception that explains why the C library cannot start a run.

    If `step` is too large, the message suggests a smaller step that the C library accepts.
    """
    if status == "ERR_METHOD" and has_torus_closed_form(scene):
        return ValueError(f"the method {method!r} does not apply: {explain_no_closed_form(scene)}")
    hint = ""
    if status == "ERR_STEP_SIZE" and step:
        smaller_step = step
        while smaller_step and start(scene._block, method, smaller_step, 0.0, 0, 0)[0] == status:
            smaller_step /= 2.0
        hint = f", where {smaller_step!r} would suffice"
    return make_exception_from_status(
        status, f"{method} with step = {step!r}{hint}, tol = {tol!r} and {scene!r}"
    )
