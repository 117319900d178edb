"""Many tops are moved: by a crew, slice by slice, into rows, and what became of all is told."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from .._core import Work
from .._ground.arguments import Array
from .._model.scene import Ensemble
from .._request.many import Order
from .._request.request import Progress
from . import top_rows
from .crew import Crew
from .outcomes import Outcomes
from .top_rows import TopRows

Fill = Callable[[TopRows, Order, Ensemble, int, int, Array, Work | None], TopRows]
_O = TypeVar("_O", bound=Outcomes)


def move(
    kind: type[_O],
    tops: Ensemble,
    t: Array,
    order: Order,
    crew: Crew,
    progress: Progress | None = None,
    out: Array | None = None,
    fill: Fill = top_rows.fill,
) -> _O:
    """What becomes of all tops at these times, (k,) or (n, k), where `fill` fills the rows of a
    slice. Raises kreisel.Interrupted for Ctrl-C, with what was done."""
    rows = TopRows.empty(tops.size, t.shape[-1], order, out)
    shared = fill is top_rows.fill and not order.alone
    work = Work(listens=crew.has_caller(tops.size, progress, shared))

    def here(begin: int, end: int) -> tuple[Callable[..., TopRows], tuple[Any, ...]]:
        return fill, (rows, order, tops, begin, end, t, work)

    def elsewhere(begin: int, end: int) -> tuple[Callable[..., TopRows], tuple[Any, ...]]:
        some = flat[begin:end]
        return filled, (fill, order, some, t[begin:end] if t.ndim == 2 else t)

    flat = tops if crew.shares_memory else tops.ravel()
    took = rows.add if crew.shares_memory else rows.put
    job = here if crew.shares_memory else elsewhere
    try:
        crew.do(tops.size, job, took, work, progress, shared)
    except KeyboardInterrupt:
        rows.settle(t)
        became = kind(tops, t, order, rows)
        left = np.flatnonzero(rows.status == top_rows.INTERRUPTED)
        if not left.size:
            raise
        raise became._stopped(int(left[0]), left.size) from None
    if progress is not None:
        progress(1.0)
    return kind(tops, t, order, rows)


def filled(fill: Fill, order: Order, tops: Ensemble, t: Array) -> TopRows:
    """The rows of tops that were sent here, in another process as may be."""
    rows = TopRows.empty(len(tops), t.shape[-1], order)
    return fill(rows, order, tops, 0, len(tops), t, None)
