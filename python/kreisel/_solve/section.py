"""kreisel.section: the states of the tops of an ensemble at the occurrences of an event."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from .._core import horizons
from .._model.scene import Ensemble, Scene
from .._options.ensemble_options import (
    EnsembleOptions,
    check_result_memory,
    validate_ensemble_options,
    validate_thread_count,
)
from .._options.methods import FALLBACK
from .._options.solve_options import Progress, validate_progress_callback
from .._results.executor import WorkerPool
from .._results.run_ensemble import run_ensemble
from .._results.section_result import SECTION, Section
from .._results.turn_times import estimate_turn_durations
from .._utils.validation import Array, as_finite_array, as_int, short_repr, validate_type
from ..events import Event, nutation, refuse_kinetic, to_core_events, validate_events

_TURNS = 1024.0  # the default of max_wait, in estimated turns of a top


def section(
    tops: Ensemble | Scene,
    event: Event | None = None,
    n: int = 500,
    *,
    max_wait: ArrayLike | None = None,
    tol: float | None = None,
    digits: int | None = None,
    max_steps: int = 0,
    progress: Progress | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
) -> Section:
    """Find the states of each top at the first `n` occurrences of an event.

    event      an event of kreisel.events; default: nutation(direction=1), the lowest points of the
               apex, which occur in every motion that is not steady. No occurrence is missed. An
               occurrence at the start itself does not count
    n          the number of states of each top
    max_wait   the longest allowed time from the start, or from the previous event, to the next
               event [T]: a number, or an array of the ensemble's shape; negative: back in time. If
               no event occurs in this time, the status of the top is 'ERR_EVENT', and the states
               found so far are kept. Default: 1024 times an estimate of the time of one turn, but
               at most a quarter of the time up to which doubles resolve the attitude

    The other arguments are the same as for kreisel.solve. The results for each top do not depend on
    the other tops, not even in the last bit. The search is fastest if the event is linear in
    body_vertical, body_velocity, body_momentum, apex_z and spin.

        >>> import kreisel as kr
        >>> tops = kr.starts(kr.scenes.asymmetric.body, energy=2, vertical=1, gravity=1, n=5)
        >>> section = kr.section(tops, n=20)
        >>> section
        <kreisel.Section of shape (5,), 100 states of 5 tops: taylor, none failed>
        >>> section.spin_angle.shape, section.top[:3].tolist(), section.count.tolist()
        ((100,), [0, 0, 0], [20, 20, 20, 20, 20])

    Raises TypeError or ValueError for invalid arguments, before any computation starts. Raises
    MemoryError if the states do not fit in memory. Raises kreisel.Interrupted after Ctrl-C; the
    exception contains all results obtained so far. The status of the computation for each top is
    stored in section.status. The method section.check raises an exception for the first top whose
    computation failed.

    Sources: Poincaré (1892). Dullin and Wittek (Journal of Physics A 28, 1995) construct sections
    that are crossed by every motion.
    """
    ensemble = (
        Ensemble.of([tops]) if isinstance(tops, Scene) else validate_type("tops", tops, Ensemble)
    )
    waits, options = validate_section_arguments(
        ensemble, event, n, max_wait, tol, digits, max_steps
    )
    pool = WorkerPool(validate_thread_count(threads, executor), executor)
    callback = validate_progress_callback(progress)
    check_result_memory(ensemble, waits, options)
    return run_ensemble(Section, ensemble, waits, options, pool, SECTION, callback)


def validate_section_arguments(
    tops: Ensemble,
    event: object,
    n: object,
    max_wait: object,
    tol: object,
    digits: object,
    max_steps: object,
) -> tuple[Array, EnsembleOptions]:
    """Return the longest allowed waiting times for the next event, and the validated options.

    The waiting times form an array of shape (tops, n), in which all entries of a row are equal.

    Raises TypeError or ValueError for an invalid argument.
    """
    options = validate_ensemble_options(
        tops, FALLBACK, None, tol, digits, max_steps, requests_events=True
    )
    section_event = validate_section_event(event)
    refuse_kinetic(tops, [section_event])
    events = to_core_events([section_event])
    waits = np.broadcast_to(
        _validate_or_estimate_max_waits(tops, max_wait)[:, None], (tops.size, as_int("n", n, 1))
    )
    return waits, replace(options, core_events=events)


def validate_section_event(event: object) -> Event:
    """Validate the event that defines a Poincare section, and return it.

    Raises ValueError if the event is terminal or limits the number of its occurrences.
    """
    if event is None:
        return nutation(direction=1)
    [one] = validate_events(FALLBACK, [event])
    if one.max_count is not None or one.terminal:
        raise ValueError(
            "n sets the number of events: leave max_count and terminal out of the event"
        )
    return one


def _validate_or_estimate_max_waits(tops: Ensemble, max_wait: object) -> Array:
    """Return the time [T] after which the search for an event of each top is abandoned."""
    if max_wait is None:
        horizon_times = np.empty(tops.size)
        horizons(tops._core_scenes, horizon_times)
        return np.minimum(_TURNS * estimate_turn_durations(tops), 0.25 * horizon_times)
    waits = as_finite_array("max_wait", max_wait, "a number, or one for each top")
    if (waits == 0.0).any():
        raise ValueError("max_wait must not be zero")
    try:
        return np.array(np.broadcast_to(waits, tops.shape)).reshape(-1)
    except ValueError:
        raise ValueError(
            f"max_wait must be a number or an array of shape {tops.shape}, "
            f"not {short_repr(max_wait)}"
        ) from None
