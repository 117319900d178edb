"""Growth: how a tangent of each of many tops grows, and the indicators of chaos that are read off
it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import Work, growth
from .._ground.arguments import Array, frozen
from .._model.scene import Ensemble
from .._request.methods import ELSE, methods
from .._request.request import Progress, Request
from .crew import Crew
from .path import Error, Interrupted, path_of
from .top_rows import INTERRUPTED, STATUSES, Codes

# Columns of the core's rows: ln of the tangent's size, the mean of MEGNO, the largest ln so far,
# how far the changes of energy and <m, e3> by the tangent are from constant, and the largest last
# term of its series.
LOG, MEGNO, MOST, ENERGY, MOMENTUM, REST = range(6)


@dataclass(frozen=True, eq=False)
class Indicator:
    """What kreisel.lyapunov, kreisel.megno and kreisel.oli give. Arrays are read-only; of one scene
    their shape is () in place of an ensemble's.

    t            (k,) the times of the curve [T]
    curve        (*shape, k) the indicator over the way from the start to these times
    certificate  (*shape,) the largest error of the tangent on the way, over its size: of the
                 changes of energy and <m, e3> by the tangent, which are constant, and of its
                 series, by the last term
    status       (*shape,) how each run went: "OK", or the reason's name, and NaN in the curve
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
        """The indicator at the last time: a number of one scene, (*shape,) of an ensemble."""
        last = self.curve[..., -1]
        return float(last) if last.ndim == 0 else frozen(last)

    @property
    def failed(self) -> npt.NDArray[np.intp]:
        """(f,) the numbers of the tops that failed, of an ensemble in C order."""
        return np.flatnonzero(self.status != "OK")

    def __repr__(self) -> str:
        if self.curve.ndim == 1:
            return f"<kreisel.Indicator: {self.value:.6g} at t = {self.t[-1]:g}>"
        shape = "x".join(map(str, self.curve.shape[:-1]))
        return f"<kreisel.Indicator: {shape} tops at t = {self.t[-1]:g}, {self.failed.size} failed>"


Reader = Callable[[Array, Array], Array]  # of a curve, from rows (n, k, 6) and the times


def grown(
    tops: Ensemble,
    t: Array,
    reader: Reader,
    steering: tuple[float, int, Sequence[float]],
    crew: Crew,
    progress: Progress | None,
) -> Indicator:
    """The indicator of all tops at these times, which need no check; `steering` is tol, max_steps
    and the direction. Raises kreisel.Interrupted for Ctrl-C, with what was done."""
    n = tops.size
    curve, worst = np.full((n, t.size), np.nan), np.full(n, np.nan)
    status = np.full(n, INTERRUPTED, dtype=np.int8)
    work = Work(listens=crew.has_caller(n, progress, False))

    def job(begin: int, end: int) -> tuple[Callable[..., tuple[Codes, Array]], tuple[Any, ...]]:
        return _rows, (tops, begin, end, t, steering, work)

    def take(begin: int, part: tuple[Codes, Array]) -> None:
        codes, rows = part
        here = slice(begin, begin + len(codes))
        status[here], curve[here] = codes, reader(rows, t)
        worst[here] = rows[..., [ENERGY, MOMENTUM, REST]].max(axis=(1, 2))

    def told() -> Indicator:
        names = np.array(STATUSES)[status].reshape(tops.shape)
        return Indicator(t, curve.reshape(*tops.shape, -1), worst.reshape(tops.shape), names)

    try:
        crew.do(n, job, take, work, progress)
    except KeyboardInterrupt:
        left = np.flatnonzero(status == INTERRUPTED)
        if not left.size:
            raise
        raise _stopped(Interrupted, tops, int(left[0]), "interrupted", told()) from None
    if progress is not None:
        progress(1.0)
    return told()


def _rows(
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
    growth(tops._tops, begin, end, t, *steering, status, out, work)
    out[status == INTERRUPTED] = np.nan
    return status, out


def _stopped(
    kind: type[Error] | type[Interrupted], tops: Ensemble, i: int, text: str, told: Indicator
) -> Error | Interrupted:
    """The exception for top number i."""
    scene = tops.ravel()[i]
    status = str(told.status.ravel()[i])
    none = status, np.empty((0, 8)), None, (0, 0, 0, 0), float(told.t[-1])
    path = path_of(scene, Request(methods[ELSE], asked=ELSE), none)
    return kind(f"{text}: the tangent of {scene!r}", status, path, told)


def check_one(tops: Ensemble, told: Indicator, text: str) -> None:
    """Raises what became of the only top."""
    if told.failed.size:
        raise _stopped(Error, tops, 0, text, told)
