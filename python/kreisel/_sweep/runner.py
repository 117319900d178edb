"""Computation of the parts of a sweep, in the current process or by workers of an executor.

Without an executor, the parts are computed one after another, each by several threads. If an
executor is given, each of its workers computes one part at a time in a single thread, and writes
the file of that part.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor

from .._options.solve_options import Progress
from .._results.executor import has_thread_workers, run_jobs
from .._utils.counts import format_count
from .._utils.signals import defer_signals
from .part_table import PartResults, tabulate_sweep_part
from .store import SweepStore

# Maximal number of unfinished parts submitted to an executor. It exceeds the number of workers of
# most executors, so no worker waits. It is small, because an exception must cancel these parts.
_IN_FLIGHT = 256
_PROGRESS_SECONDS = 0.1  # minimal time between two calls of progress


def compute_sweep_part(
    store: SweepStore, tops: range, threads: int, progress: Progress | None
) -> PartResults:
    """Compute a table of the results for the tops with the given indices."""
    return tabulate_sweep_part(
        store.plan, tops, store.plan.compute_results_of_tops(tops, threads, progress)
    )


def compute_and_store_part(store: SweepStore, i: int, progress: Progress | None = None) -> int:
    """Compute part i in a single thread and write its file; return the number of tops."""
    tops = store.plan.list_tops_of_part(i)
    store.write_part(i, compute_sweep_part(store, tops, 1, progress))
    return len(tops)


class PartsLostError(RuntimeError):
    """Error raised if an executor fails, or loses parts of a sweep in two attempts."""


class SweepPartsRunner:
    """The computation of selected parts of a sweep."""

    def __init__(self, store: SweepStore, parts: Sequence[int], progress: Progress | None) -> None:
        self.store, self.progress = store, progress
        self.left = list(parts)
        self.tops = store.plan.count_tops_in_parts(parts)
        self.done, self._reported = 0, 0.0
        self._stopped = threading.Event()

    def compute_parts_locally(self, threads: int) -> None:
        """Compute the requested parts of the sweep in the current process, without workers.

        While a part is being computed, a second thread writes the previous part to its file.
        """
        with ThreadPoolExecutor(1) as writer:
            future: Future[None] | None = None
            for i in tuple(self.left):
                tops = self.store.plan.list_tops_of_part(i)
                part = compute_sweep_part(
                    self.store, tops, threads, self._make_part_progress(len(tops))
                )
                with defer_signals():
                    if future is not None:
                        future.result()
                    future = writer.submit(self.store.write_part, i, part)
                self.done += len(tops)
        if future is not None:
            future.result()
            self._report_progress(self.done, last=True)

    def _make_part_progress(self, tops: int) -> Progress | None:
        """Return a function that reports the progress of a part, or None if none is requested."""
        return self.progress and (lambda share: self._report_progress(self.done + share * tops))

    def _report_progress(self, tops: float, last: bool = False) -> None:
        """Report the number of tops computed so far, at most about ten times per second."""
        now = time.monotonic()
        if self.progress is not None and (last or now - self._reported >= _PROGRESS_SECONDS):
            self._reported = now
            self.progress(tops / self.tops)

    def compute_parts_on_executor(self, executor: Executor) -> None:
        """Compute the requested parts of a sweep on the workers of an executor.

        Parts that the executor failed to complete are submitted a second time. Raises
        PartsLostError if the executor fails, or if some parts of the sweep are still missing after
        the second attempt.
        """
        for _ in range(2):
            self._submit_all_parts(executor)
            if not self.left:
                self._report_progress(self.done, last=True)
                return
        raise PartsLostError(
            f"the executor lost {format_count(len(self.left), 'part')}, the first of them part "
            f"{self.left[0]}; all others are stored, and repeating the call computes the missing "
            "parts"
        )

    def _submit_all_parts(self, executor: Executor) -> None:
        check = (self._raise_if_stopped,) if has_thread_workers(executor) else ()
        jobs = ((i, (compute_and_store_part, (self.store, i, *check))) for i in tuple(self.left))
        try:
            run_jobs(
                executor,
                jobs,
                _IN_FLIGHT,
                self._mark_part_as_done,
                self._report_finished_tops,
                self._stopped.set,
            )
        except BrokenExecutor as error:
            parts = format_count(len(self.left), "part")
            raise PartsLostError(
                f"the executor failed with {parts} left, the first of them part "
                f"{self.left[0]}: {error}; the stored parts are kept, and repeating the call "
                "computes the others"
            ) from None
        finally:
            self._stopped.clear()

    def _report_finished_tops(self) -> None:
        self._report_progress(self.done)

    def _raise_if_stopped(self, _: float) -> None:
        """Raise KeyboardInterrupt if the computation has been stopped."""
        if self._stopped.is_set():
            raise KeyboardInterrupt

    def _mark_part_as_done(self, i: int, future: Future[int]) -> None:
        """Add the tops of part i to the number of computed tops if the file of the part exists."""
        if future.cancelled():
            return
        tops = len(self.store.plan.list_tops_of_part(i))
        if future.result() == tops and self.store.part_file_path(i).exists():
            self.left.remove(i)
            self.done += tops
