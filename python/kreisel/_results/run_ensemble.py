"""Parallel computation of the motions of an ensemble."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from .._core import Work
from .._model.scene import Ensemble
from .._options.ensemble_options import EnsembleOptions
from .._options.solve_options import Progress
from .._utils.validation import Array
from .ensemble_buffers import INTERRUPTED, EnsembleBuffers, SliceRunner
from .ensemble_result import EnsembleResult
from .executor import DivisibleTask, Job, WorkerPool

_Result = TypeVar("_Result", bound=EnsembleResult)


def run_ensemble(
    kind: type[_Result],
    tops: Ensemble,
    t: Array,
    options: EnsembleOptions,
    pool: WorkerPool,
    runner: SliceRunner,
    progress: Progress | None = None,
    out: Array | None = None,
) -> _Result:
    """Compute the motions of all tops in an ensemble at times that have been validated.

    Raises kreisel.Interrupted, with all results obtained so far, after Ctrl-C.
    """
    n = tops.size
    buffers, work = EnsembleBuffers.allocate_buffers(n, t.shape[-1], options, out), Work()
    flat = tops.ravel() if pool.has_workers_in_other_processes else tops

    def make_local_job(begin: int, end: int) -> Job[EnsembleBuffers]:
        return runner.run, (buffers, options, tops, begin, end, t, work)

    def make_remote_job(begin: int, end: int) -> Job[EnsembleBuffers]:
        times = t[begin:end] if t.ndim == 2 else t
        return run_slice_in_worker, (runner, options, flat[begin:end], times)

    job, collect = (
        (make_remote_job, buffers.insert_part_at_row)
        if pool.has_workers_in_other_processes
        else (make_local_job, buffers.add_events_and_failures)
    )
    try:
        pool.run_task(DivisibleTask(n, job, collect, work, progress, runner.is_native))
    except KeyboardInterrupt:
        buffers.mark_unrun_tops_interrupted(t)
        indices = np.flatnonzero(buffers.status == INTERRUPTED)
        if not indices.size:
            raise
        result = kind(tops, t, options, buffers)
        raise result._make_stop_error(int(indices[0]), indices.size) from None
    if progress is not None:
        progress(1.0)
    return kind(tops, t, options, buffers)


def run_slice_in_worker(
    runner: SliceRunner, options: EnsembleOptions, tops: Ensemble, t: Array
) -> EnsembleBuffers:
    """Compute the motions of a slice of an ensemble in a worker process, and return the results."""
    buffers = EnsembleBuffers.allocate_buffers(len(tops), t.shape[-1], options)
    part: EnsembleBuffers = runner.run(buffers, options, tops, 0, len(tops), t, None)
    return part
