"""Chaos: how fast neighbours part, by one tangent of each top. A heavy top has no more than one
exponent beside its opposite and four zeros, for energy and <m, e3> are kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .._core import statuses
from .._ground.arguments import Array, Numbers, array, number, whole
from .._ground.refusals import refusal
from .._model.scene import Ensemble, Scene
from .._recording.executor import WorkerPool
from .._recording.indicators import (
    LOG,
    MEGNO,
    MOST,
    CurveFunction,
    Indicator,
    compute_indicator,
    raise_if_failed,
)
from .._request.ensemble_options import parse_threads
from .._request.methods import FALLBACK, methods
from .._request.solve_options import Progress, parse_progress, parse_tol
from .._request.times import check_horizon, time_array

POINTS = 32  # of a curve, where no times are given
_DECADES = 3.0  # over which they lie, evenly in the logarithm


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
    """The largest Lyapunov exponent, ln(|tangent(t)| / |tangent(0)|) / t [T^-1]; of an ordered
    motion it goes to zero as ln(t) / t.

    scene      or a kreisel.Ensemble; undamped
    t          a number: the curve has 32 times up to it, evenly in the logarithm over three
               decades; or a list of times, none of them 0, all on one side of it and ever further
               away [T]
    direction  of the tangent at the start: a rotation vector seen from the body, then a change of
               the momentum in space [M L^2 T^-1]; left out: one that is the same for all tops in
               their own units. The flow and the turn about the vertical are taken out of it, which
               are tangents for ever and grow at no rate
    tol        local error of a step of the path; left out: rounding. 1e-9 tells order from chaos as
               well, in about half the time; the certificate is then of that size
    max_steps  0: no limit
    threads    how many move the tops; left out: as many as there are processors
    progress   called with the part of the tops that is done, 0 .. 1

    The tangent rides along with the path, and is renormalised by powers of two. Its size is that in
    the top's own units: an angle, and a momentum over those of the top.

        >>> import kreisel as kr
        >>> chaos = kr.lyapunov(kr.scenes.asymmetric, 1000)
        >>> 0.1 < chaos.value < 0.2, chaos.curve.shape, bool(chaos.certificate < 1e-12)
        (True, (32,), True)
        >>> kr.lyapunov(kr.scenes.kowalewski, 1000).value < 0.01
        True

    Raises TypeError or ValueError before anything runs; kreisel.Error where the run of one scene
    fails (of an ensemble `.status` tells); kreisel.Interrupted for Ctrl-C, with what was done as
    `.paths`.
    Source: Benettin, Galgani, Giorgilli and Strelcyn, Meccanica 15 (1980).
    """

    def curve(rows: Array, times: Array) -> Array:
        return rows[..., LOG] / np.abs(times)

    return _indicator(scene, t, direction, tol, max_steps, threads, progress, curve)


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
    """The mean exponential growth of nearby orbits, averaged over time: it goes to 2 where the
    motion is ordered and its neighbours part linearly, to 0 where they do not, and is half the
    Lyapunov exponent times t where it is chaotic. The words are those of kreisel.lyapunov.

        >>> import kreisel as kr
        >>> kr.megno(kr.scenes.asymmetric, 1000).value > 20
        True
        >>> round(kr.megno(kr.scenes.thesis, 10000).value, 1)
        2.0

    Raises what kreisel.lyapunov raises.
    Source: Cincotta and Simo, Astron. Astrophys. Suppl. 147 (2000).
    """
    return _indicator(
        scene, t, direction, tol, max_steps, threads, progress, lambda rows, _: rows[..., MEGNO]
    )


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
    """The orthogonal Lyapunov indicator: the largest logarithm up to t of the size of a tangent,
    across the flow and the turn about the vertical. It grows as ln(t) where the motion is ordered,
    as t where it is chaotic. The words are those of kreisel.lyapunov.

        >>> import kreisel as kr
        >>> kr.oli(kr.scenes.asymmetric, 1000).value > 100
        True
        >>> round(kr.oli(kr.scenes.thesis, 1000).value, 1)
        8.4

    Raises what kreisel.lyapunov raises.
    Source: Fouchard, Lega, Froeschle and Froeschle, Celest. Mech. 83 (2002).
    """
    return _indicator(
        scene, t, direction, tol, max_steps, threads, progress, lambda rows, _: rows[..., MOST]
    )


def _indicator(
    scene: Scene | Ensemble,
    t: Numbers,
    direction: object,
    tol: object,
    max_steps: object,
    threads: object,
    progress: Progress | None,
    reader: CurveFunction,
) -> Indicator:
    times, steering = parse_growth(scene, t, direction, tol, max_steps)
    crew, callback = WorkerPool(parse_threads(threads, None)), parse_progress(progress)
    if isinstance(scene, Ensemble):
        return compute_indicator(scene, times, reader, steering, crew, callback)
    check_horizon(scene, float(times[-1]), None)
    tops = Ensemble.of([scene])
    told = compute_indicator(tops, times, reader, steering, crew, callback)
    status = str(told.status[0])
    if status != "OK" and statuses[status][0] == "INPUT":
        raise refusal(status, f"no tangent in the direction {direction!r} of {scene!r}")
    raise_if_failed(tops, told, statuses[status][1])
    own = {"curve": told.curve[0], "certificate": told.certificate[0:1].reshape(())}
    return replace(told, **own, status=told.status[0:1].reshape(()))


def parse_growth(
    scene: Scene | Ensemble, t: Numbers, direction: object, tol: object, max_steps: object
) -> tuple[Array, tuple[float, int, Sequence[float]]]:
    """The times of the curve, and what steers it: tol, max_steps and the direction. TypeError or
    ValueError for what cannot be."""
    if not isinstance(scene, Scene | Ensemble):
        raise TypeError(f"scene must be a kreisel.Scene or a kreisel.Ensemble, not {scene!r}")
    times = _times(t)
    accuracy = parse_tol(methods[FALLBACK], tol) or 0.0
    steering = accuracy, whole("max_steps", max_steps, 0), _direction(direction)
    if np.any(scene.damping):
        raise ValueError(
            "a damped top has no such indicator: its neighbours come to rest, and what certifies "
            "a tangent is not kept"
        )
    return times, steering


def _times(t: Numbers) -> Array:
    times = time_array(t, None, None, 16)
    if np.ndim(t) == 0:
        end = number("t", t)
        times = end * np.logspace(-_DECADES, 0.0, POINTS)
    if not times.size or not times.all():
        raise ValueError(
            "t must be times on one side of the start, where nothing has grown yet: not 0"
        )
    return times


def _direction(direction: object) -> tuple[float, ...]:
    if direction is None:
        return ()
    given = array("direction", direction, "six numbers")
    if given.shape != (6,) or not given.any():
        raise ValueError(
            "direction must be six numbers, not all 0: a rotation vector seen from the body, and a "
            f"change of the momentum in space; not {direction!r}"
        )
    return tuple(given.tolist())
