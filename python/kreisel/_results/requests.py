"""Validated arguments of kreisel.solve that can be reused for any scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

from .._core import Request
from .._model.scene import Scene
from .._options.closed_form_choice import compute_closed_form_error_limit
from .._options.methods import EXACT, FALLBACK, get_method, methods
from .._options.solve_options import Progress, SolveOptions, make_solve_options
from .core_calls import CoreResult
from .path import Path, build_path_or_raise
from .recorder import report_final_time
from .state_quantities import Stats


@lru_cache(maxsize=256, typed=True)
def build_request_from_solve_arguments(
    method: object,
    step: object = None,
    tol: object = None,
    digits: object = None,
    max_steps: object = 0,
    want: object = None,
) -> Request:
    """Validate arguments of kreisel.solve, and return them as a reusable request.

    With method='auto', the method is chosen separately for each scene. Raises TypeError or
    ValueError for an invalid argument, and TypeError for an argument that is not hashable.
    """
    controls = step, tol, digits, max_steps, method, want
    if method != "auto":
        return _build_request(make_solve_options(get_method(method), *controls))
    series = make_solve_options(methods[FALLBACK], *controls)
    if digits is not None:
        return _build_request(series)
    closed_form = _build_request(make_solve_options(methods[EXACT], *controls))
    is_open = step is tol is None
    return _build_request(series, closed_form, compute_closed_form_error_limit if is_open else None)


def build_request_from_solve_options(options: SolveOptions) -> Request | None:
    """Build a request from the options, or return None if it needs several C library calls."""
    if options.error is not None or options.requests_events or options.tangents:
        return None
    controls = options.step, options.tol, options.digits, options.max_steps
    names = options.requested_method, options.want
    return _get_cached_request(options.method.name, options.keeps_heading, *controls, *names)


@lru_cache(maxsize=256, typed=True)
def _get_cached_request(method: str, keeps_heading: bool, *controls: object) -> Request:
    options = make_solve_options(methods[method], *controls)
    return _build_request(options.copy_options_with_heading() if keeps_heading else options)


def _build_request(
    options: SolveOptions,
    closed_form: Request | None = None,
    decide: Callable[..., float] | None = None,
) -> Request:
    want, path_options = options.want, options.copy_with_default_run_settings
    if want is not None:
        path_options = replace(path_options, want=want)
    core, most, limit = (
        options.core_arguments,
        options.max_time_with_exact_step_count,
        options.chunk_size,
    )
    classes = Path, Stats, Scene
    return Request(classes, options, path_options, core, want, most, limit, closed_form, decide)


def try_to_solve_in_core(
    scene: Scene,
    t: object,
    method: object,
    step: object,
    tol: object,
    digits: object,
    max_steps: object,
    want: object,
    progress: Progress | None,
) -> Path | None:
    """Return the path of a scene, or None if Python code must first validate the arguments.

    Raises the exception returned by make_stop_exception if the run fails.
    """
    names = tuple(want) if type(want) is list else want
    if names is not None and type(names) is not tuple:
        return None  # an iterator, which can be read only once
    try:
        request = build_request_from_solve_arguments(method, step, tol, digits, max_steps, names)
    except (TypeError, ValueError):
        return None
    path: Path | tuple[SolveOptions, CoreResult] | None = request.solve(scene, t, progress)
    if not isinstance(path, tuple):
        return path
    options, result = path
    return report_final_time(build_path_or_raise(scene, options, result), progress)
