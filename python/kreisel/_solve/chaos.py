"""Indicators of chaos, which measure how fast neighbouring motions separate.

A heavy top has at most one positive Lyapunov exponent, because energy and <m, e3> are conserved.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._core import statuses
from .._model.environment import refuse_disturbances
from .._model.scene import Ensemble, Scene
from .._options.ensemble_options import validate_thread_count
from .._options.methods import FALLBACK, methods
from .._options.solve_options import Progress, validate_progress_callback, validate_tol
from .._options.times import check_resolvable_horizon, time_array
from .._results.executor import WorkerPool
from .._results.indicators import (
    Indicator,
    compute_chaos_indicator,
    extract_single_top_indicator,
    raise_if_single_top_failed,
)
from .._utils.errors import make_exception_from_status
from .._utils.validation import Array, Numbers, as_finite_array, as_float, as_int, short_repr

POINTS = 32  # default number of times of a curve; the times are evenly spaced on a log scale
_DECADES = 3.0  # log10 of the ratio of the last of these times to the first


def lyapunov(
    scene: Scene | Ensemble,
    t: Numbers,
    *,
    direction: Sequence[float] | None = None,
    tol: float | None = None,
    max_steps: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Indicator:
    """Compute the largest Lyapunov exponent, ln(|tangent(t)| / |tangent(0)|) / t [T^-1].

    For a regular motion, the exponent tends to zero as ln(t) / t.

    scene      an undamped kreisel.Scene or kreisel.Ensemble
    t          a number: the curve has 32 times up to t, evenly spaced on a logarithmic scale over
               three decades; or a monotonic list of times on one side of 0 [T]
    direction  the tangent at the start: three components of a rotation vector seen from the body
               [rad], then three components of a change of momentum in space [M L^2 T^-1]; default:
               a direction that is the same for all tops in scaled units. The components of the
               tangent along the flow and along rotations about the vertical do not grow, and are
               removed
    tol        the local error of a step of the path; default: rounding error. 1e-9 distinguishes
               regular from chaotic motion equally well in about half the time; the certificate is
               then also about 1e-9
    max_steps  the maximal number of steps; 0: no limit
    threads    the number of threads; default: the number of processors
    progress   a function called with the finished fraction of the tops, 0 .. 1

    The tangent is integrated together with the path, and is repeatedly scaled by powers of two. The
    norm of the tangent is computed in units in which the largest moment of inertia and the angular
    velocity are about 1.

        >>> import kreisel as kr
        >>> chaos = kr.lyapunov(kr.scenes.asymmetric, 1000)
        >>> 0.1 < chaos.value < 0.2, chaos.curve.shape, bool(chaos.certificate < 1e-12)
        (True, (32,), True)
        >>> kr.lyapunov(kr.scenes.kowalewski, 1000).value < 0.01
        True

    Raises TypeError or ValueError for invalid arguments, before any computation starts. Raises
    kreisel.Error if the computation for a single scene fails. For an ensemble, failures are
    recorded in the attribute `status`. Raises kreisel.Interrupted after Ctrl-C; its attribute
    `paths` contains the results obtained so far. Source: Benettin, Galgani, Giorgilli and Strelcyn,
    Meccanica 15 (1980).
    """
    return _compute_chaos_indicator(
        "lyapunov", scene, t, direction, tol, max_steps, threads, progress
    )


def megno(
    scene: Scene | Ensemble,
    t: Numbers,
    *,
    direction: Sequence[float] | None = None,
    tol: float | None = None,
    max_steps: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Indicator:
    """Compute the mean exponential growth of nearby orbits (MEGNO), averaged over time.

    For a regular motion, MEGNO tends to 2 if neighbouring motions separate linearly in time, and to
    0 if they do not separate. For a chaotic motion, MEGNO is about half the Lyapunov exponent times
    t. The arguments are the same as for kreisel.lyapunov.

        >>> import kreisel as kr
        >>> kr.megno(kr.scenes.asymmetric, 1000).value > 20
        True
        >>> round(kr.megno(kr.scenes.thesis, 10000).value, 1)
        2.0

    Raises the same exceptions as kreisel.lyapunov. Source: Cincotta and Simo, Astronomy and
    Astrophysics Supplement Series 147 (2000).
    """
    return _compute_chaos_indicator("megno", scene, t, direction, tol, max_steps, threads, progress)


def oli(
    scene: Scene | Ensemble,
    t: Numbers,
    *,
    direction: Sequence[float] | None = None,
    tol: float | None = None,
    max_steps: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Indicator:
    """Compute the orthogonal Lyapunov indicator (OLI).

    The indicator is the largest logarithm of the norm of a tangent vector up to time t, and never
    decreases. The norm is evaluated at a few times in each integration step and at the requested
    times. The indicator is therefore slightly too small, and depends slightly on the requested
    times. The tangent vector is orthogonal to the direction of motion and to rotations about the
    vertical. The indicator grows as ln(t) for a regular motion, and as t for a chaotic motion. The
    arguments are the same as for kreisel.lyapunov.

        >>> import kreisel as kr
        >>> kr.oli(kr.scenes.asymmetric, 1000).value > 100
        True
        >>> round(kr.oli(kr.scenes.thesis, 1000).value, 1)
        8.4

    Raises the same exceptions as kreisel.lyapunov. Source: Fouchard, Lega, Froeschle and Froeschle,
    Celestial Mechanics and Dynamical Astronomy 83 (2002).
    """
    return _compute_chaos_indicator("oli", scene, t, direction, tol, max_steps, threads, progress)


def _compute_chaos_indicator(
    name: str,
    scene: Scene | Ensemble,
    t: Numbers,
    direction: object,
    tol: object,
    max_steps: object,
    threads: object,
    progress: Progress | None,
) -> Indicator:
    times, controls = validate_indicator_arguments(scene, t, direction, tol, max_steps)
    pool, callback = (
        WorkerPool(validate_thread_count(threads, None)),
        validate_progress_callback(progress),
    )
    if isinstance(scene, Ensemble):
        return compute_chaos_indicator(scene, times, name, controls, pool, callback)
    check_resolvable_horizon(scene, float(times[-1]), None)
    tops = Ensemble.of([scene])
    result = compute_chaos_indicator(tops, times, name, controls, pool, callback)
    status = str(result.status[0])
    if status != "OK" and statuses[status][0] == "INPUT":
        raise make_exception_from_status(
            status, f"no tangent in the direction {direction!r} of {scene!r}"
        )
    raise_if_single_top_failed(tops, result, statuses[status][1])
    return extract_single_top_indicator(result)


def validate_indicator_arguments(
    scene: Scene | Ensemble, t: Numbers, direction: object, tol: object, max_steps: object
) -> tuple[Array, tuple[float, int, Sequence[float]]]:
    """Return the times at which the chaos indicator is recorded, and the validated options.

    Raises TypeError or ValueError for an invalid argument.
    """
    if not isinstance(scene, Scene | Ensemble):
        raise TypeError(
            f"scene must be a kreisel.Scene or a kreisel.Ensemble, not {short_repr(scene)}"
        )
    times = _validate_indicator_times(t)
    accuracy = validate_tol(methods[FALLBACK], tol) or 0.0
    controls = accuracy, as_int("max_steps", max_steps, 0), _validate_tangent_direction(direction)
    if np.any(scene.damping):
        raise ValueError(
            "a damped top has no indicator of chaos: its motion decays, and energy and <m, e3> "
            "are not conserved"
        )
    hint = "path.tangents of kr.solve(..., tangents='start') shows how changes of the start grow"
    refuse_disturbances(scene, "indicators of chaos do not support tops", reason=hint)
    return times, controls


def _validate_indicator_times(t: Numbers) -> Array:
    times = time_array(t, None, None, 16)
    if np.ndim(t) == 0:
        end = as_float("t", t)
        times = end * np.logspace(-_DECADES, 0.0, POINTS)
    if not times.size or not times.all():
        raise ValueError("t must contain only positive or only negative times, and not 0")
    return times


def _validate_tangent_direction(direction: object) -> tuple[float, ...]:
    if direction is None:
        return ()
    vector = as_finite_array("direction", direction, "six numbers")
    if vector.shape != (6,) or not vector.any():
        raise ValueError(
            "direction must be six numbers, not all 0: a rotation vector seen from the body, and a "
            f"change of the momentum in space; not {short_repr(direction)}"
        )
    return tuple(vector.tolist())
