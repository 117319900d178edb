"""Indicators of chaos, computed from the growth of one tangent of each top of an ensemble."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._core import Work, growth
from .._model.scene import Ensemble
from .._options.methods import FALLBACK, methods
from .._options.solve_options import Progress, SolveOptions
from .._utils.validation import Array, ReadOnlyArrays, read_only
from .ensemble_buffers import INTERRUPTED, STATUSES, Codes
from .executor import Job, SliceTask, WorkerPool
from .path import Error, Interrupted, make_path

# Columns of the core's rows: the logarithm of the tangent's size; the time average of MEGNO; the
# largest logarithm so far; the relative changes of the derivatives of the energy and of <m, e3>
# along the tangent; the largest last term of the tangent's series. Without rounding and truncation
# errors, both derivatives would be constant.
LOG, MEGNO, MOST, ENERGY, MOMENTUM, REST = range(6)


@dataclass(frozen=True, eq=False)
class Indicator(ReadOnlyArrays):
    """The result of kreisel.lyapunov, kreisel.megno and kreisel.oli.

    Arrays are read-only. For a single scene, `shape` is ().

    t            (k,) the times of the curve [T]
    curve        (*shape, k) the indicator of the motion from the start to each time in `t`
    certificate  (*shape,) an estimate of the largest relative error of the tangent, namely the
                 largest of three values. Two values are the changes of the derivatives of the
                 energy and of <m, e3> along the tangent, which should be constant. The third value
                 is the last term of the tangent's Taylor series
    status       (*shape,) "OK", or the name of the failure; the curve of a failed top is NaN
    """

    t: Array
    curve: Array
    certificate: Array
    status: npt.NDArray[np.str_]

    def __post_init__(self) -> None:
        for array in (self.t, self.curve, self.certificate, self.status):
            array.flags.writeable = False

    @property
    def value(self) -> Array | float:
        """The indicator at the last time: a float for one scene, (*shape,) for an ensemble."""
        last = self.curve[..., -1]
        return float(last) if last.ndim == 0 else read_only(last)

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """(f,) the indices of the failed tops, in C order."""
        return np.flatnonzero(self.status != "OK")

    def __repr__(self) -> str:
        if self.curve.ndim == 1:
            return f"<kreisel.Indicator: {self.value:.6g} at t = {self.t[-1]:g}>"
        shape = "x".join(map(str, self.curve.shape[:-1]))
        return f"<kreisel.Indicator: {shape} tops at t = {self.t[-1]:g}, {self.failed.size} failed>"


# A function that computes curves (n, k) from the core's rows (n, k, 6) and the times (k,).
CurveFunction = Callable[[Array, Array], Array]


def compute_indicator(
    tops: Ensemble,
    t: Array,
    function: CurveFunction,
    controls: tuple[float, int, Sequence[float]],
    pool: WorkerPool,
    progress: Progress | None,
) -> Indicator:
    """Compute the indicator of all tops at validated times.

    `controls` contains tol, max_steps and the direction of the initial tangent. Raises
    kreisel.Interrupted after Ctrl-C, with the results of the finished tops.
    """
    n = tops.size
    curve, worst = np.full((n, t.size), np.nan), np.full(n, np.nan)
    status = np.full(n, INTERRUPTED, dtype=np.int8)
    work = Work()

    def job(begin: int, end: int) -> Job[tuple[Codes, Array]]:
        return _compute_rows, (tops, begin, end, t, controls, work)

    def collect(begin: int, part: tuple[Codes, Array]) -> None:
        codes, rows = part
        here = slice(begin, begin + len(codes))
        status[here], curve[here] = codes, function(rows, t)
        worst[here] = rows[..., [ENERGY, MOMENTUM, REST]].max(axis=(1, 2))

    def result() -> Indicator:
        names = np.array(STATUSES)[status].reshape(tops.shape)
        return Indicator(t, curve.reshape(*tops.shape, t.size), worst.reshape(tops.shape), names)

    try:
        pool.run(SliceTask(n, job, collect, work, progress))
    except KeyboardInterrupt:
        left = np.flatnonzero(status == INTERRUPTED)
        if not left.size:
            raise
        raise _stop_error(Interrupted, tops, int(left[0]), "interrupted", result()) from None
    if progress is not None:
        progress(1.0)
    return result()


def _compute_rows(
    tops: Ensemble,
    begin: int,
    end: int,
    t: Array,
    steering: tuple[float, int, Sequence[float]],
    work: Work,
) -> tuple[Codes, Array]:
    status, out = (
        np.full(end - begin, INTERRUPTED, dtype=np.int8),
        np.empty((end - begin, t.size, 6)),
    )
    growth(tops._core_scenes, begin, end, t, *steering, status, out, work)
    out[status == INTERRUPTED] = np.nan
    return status, out


def _stop_error(
    kind: type[Error] | type[Interrupted], tops: Ensemble, i: int, text: str, told: Indicator
) -> Error | Interrupted:
    """Return the exception for the i-th top, with the indicator `told` as its `.paths`."""
    scene = tops.ravel()[i]
    status = str(told.status.ravel()[i])
    none = status, np.empty((0, 8)), None, (0, 0, 0, 0), float(told.t[-1])
    path = make_path(scene, SolveOptions(methods[FALLBACK], requested_method=FALLBACK), none)
    return kind(f"{text}: the tangent of {scene!r}", status, path, told)


def raise_if_failed(tops: Ensemble, told: Indicator, text: str) -> None:
    """Raise kreisel.Error if the only top of the ensemble `tops` failed."""
    if told.failed.size:
        raise _stop_error(Error, tops, 0, text, told)
