"""Requests: validated arguments of a call of the core, and the paths that it records."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any

from .._core import Request
from .._model.scene import Scene
from .._options.methods import EXACT, FALLBACK, compute_closed_form_error_limit
from .._options.options import CHUNK_SIZE, Options, make_options
from .._utils.arguments import Array
from .._utils.processes import Progress
from .._utils.quantity_attributes import QuantityName
from .calls import CoreResult, Stats, compute_states_at_times
from .path import Path, build_path_or_raise, join_paths


def record_path(scene: Scene, options: Options, times: Array, progress: Progress | None) -> Path:
    result = compute_states_at_times(scene, options, times, progress)
    return report_final_time(build_path_or_raise(scene, options, result), progress)


def report_final_time(path: Path, progress: Progress | None) -> Path:
    if progress is not None and len(path):
        progress(float(path.t[-1]))
    return path


def record_quantities_in_chunks(
    times: Array,
    want: tuple[QuantityName, ...],
    record: Callable[[Array], tuple[str, Path]],
    has_ended: Callable[[], bool],
) -> tuple[str, Path]:
    """Record selected quantities in chunks, and return the status and the path of the run.

    The first chunk is a single state, so that Ctrl-C leaves a path that is not empty.
    """
    pieces: list[Path] = []
    status = "OK"
    try:
        for first in (0, *range(1, times.size, CHUNK_SIZE)):
            if first and (status != "OK" or has_ended()):
                break
            status, piece = record(times[first : first + CHUNK_SIZE if first else 1])
            pieces.append(piece)
            pieces[-1] = piece.only(want)
    except KeyboardInterrupt:
        if not pieces:
            raise
        status = "ERR_INTERRUPTED"
    pieces[-1] = pieces[-1].only(want)
    return status, join_paths(pieces)


@lru_cache(maxsize=256, typed=True)
def build_request_from_solve_arguments(
    want: Any, method: Any, step: Any, tol: Any, digits: Any, max_steps: Any
) -> Request:
    """Validate arguments of kreisel.solve, and return them as a reusable request."""
    accuracy = {"step": step, "tol": tol, "digits": digits}
    options = make_options(method, max_steps=max_steps, want=want, **accuracy)
    if options.error is not None:
        raise ValueError("a search for the step takes several runs")
    if not options.is_auto:
        return _build_request(options.with_method(options.method))
    closed_form = _build_request(options.with_method(EXACT))
    decide = compute_closed_form_error_limit if step is tol is None else None
    return _build_request(options.with_method(FALLBACK), closed_form, decide)


def build_request_from_solve_options(options: Options) -> Request | None:
    """Build a request from the options, or return None if it needs several C library calls."""
    if options.error is not None or options.events is not None or options.tangents:
        return None
    return _build_request(replace(options, every=None))


@lru_cache(maxsize=256, typed=True)
def _build_request(
    options: Options,
    closed_form: Request | None = None,
    decide: Callable[..., float] | None = None,
) -> Request:
    want, stored = options.want, options.copy_with_default_run_settings
    stored = stored if want is None else replace(stored, want=want)
    limits = options.max_time_with_exact_step_count, options.chunk_size
    classes, core = (Path, Stats, Scene), options.core_arguments
    return Request(classes, options, stored, core, want, *limits, closed_form, decide)


def try_to_solve_in_core(
    scene: Scene, t: object, progress: Progress | None,
    method: object, step: object, tol: object, digits: object, max_steps: object, want: object,
) -> Path | None:  # fmt: skip
    """Return the path of a scene, or None if Python code must first validate the arguments.

    Raises the exception returned by make_stop_exception if the run fails.
    """
    names = tuple(want) if type(want) is list else want
    if names is not None and type(names) is not tuple:
        return None  # an iterator, which can be read only once
    try:
        request = build_request_from_solve_arguments(names, method, step, tol, digits, max_steps)
    except (TypeError, ValueError):
        return None
    path: Path | tuple[Options, CoreResult] | None = request.solve(scene, t, progress)
    if not isinstance(path, tuple):
        return path
    options, result = path
    return report_final_time(build_path_or_raise(scene, options, result), progress)
