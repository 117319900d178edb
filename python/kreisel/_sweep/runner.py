"""Computation of the parts of a sweep, in this process or on the workers of an executor.

In this process several threads compute one part after the other. A worker of an executor computes a
part on one thread, writes the file, and returns the number of tops.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor

from .._options.solve_options import Progress
from .._results.executor import is_local, run_jobs
from .part_table import PartTable, tabulate_part
from .store import SweepStore

_IN_FLIGHT = 256  # parts that an executor has at once: more than it has workers, few to cancel
_PROGRESS_SECONDS = 0.1  # between calls of progress


def compute_part(
    store: SweepStore, tops: range, threads: int, progress: Progress | None
) -> PartTable:
    """Return the rows of the tops with these indices; a top that fails has a row too."""
    return tabulate_part(store.plan, tops, store.plan.compute_tops(tops, threads, progress))


def store_part(store: SweepStore, i: int, progress: Progress | None = None) -> int:
    """Compute a part on one thread, write its file, and return the number of its tops."""
    tops = store.plan.tops_of(i)
    store.write_part(i, compute_part(store, tops, 1, progress))
    return len(tops)


class PartsLost(RuntimeError):
    """Error for parts that an executor did not return."""


class PartRunner:
    """The computation of some parts of a sweep, and its progress."""

    def __init__(self, store: SweepStore, parts: Sequence[int], progress: Progress | None) -> None:
        self.store, self.progress = store, progress
        self.left = list(parts)
        self.tops = store.plan.count_tops(parts)
        self.done, self._reported = 0, 0.0
        self._stopped = threading.Event()

    def run_local(self, threads: int) -> None:
        """Compute the parts in this process; while one is written the next is computed."""
        with ThreadPoolExecutor(1) as writer:
            written: Future[None] | None = None
            for i in tuple(self.left):
                tops = self.store.plan.tops_of(i)
                part = compute_part(self.store, tops, threads, self._part_progress(len(tops)))
                if written is not None:
                    written.result()
                written = writer.submit(self.store.write_part, i, part)
                self.done += len(tops)
        if written is not None:
            written.result()
            self._report(self.done, last=True)

    def _part_progress(self, tops: int) -> Progress | None:
        """Return the progress callback of a part of `tops` tops."""
        return self.progress and (lambda share: self._report(self.done + share * tops))

    def _report(self, tops: float, last: bool = False) -> None:
        """Call progress, unless it was called just before."""
        now = time.monotonic()
        if self.progress is not None and (last or now - self._reported >= _PROGRESS_SECONDS):
            self._reported = now
            self.progress(tops / self.tops)

    def run_on(self, executor: Executor) -> None:
        """Compute the parts on the workers of an executor; lost parts are tried twice."""
        for _ in range(2):
            self._run_once(executor)
            if not self.left:
                self._report(self.done, last=True)
                return
        raise PartsLost(
            f"the executor has lost {len(self.left)} parts, the first of them part {self.left[0]}; "
            "all others are stored, and the same call computes the missing ones"
        )

    def _run_once(self, executor: Executor) -> None:
        check = (self._check_stopped,) if is_local(executor) else ()
        jobs = ((i, (store_part, (self.store, i, *check))) for i in tuple(self.left))
        try:
            run_jobs(executor, jobs, _IN_FLIGHT, self._collect, self._poll, self._stopped.set)
        except BrokenExecutor as error:
            raise PartsLost(
                f"the executor has broken, with {len(self.left)} parts left, the first of them "
                f"part {self.left[0]}: {error}; the stored parts stay, and the same call "
                "computes the rest"
            ) from None
        finally:
            self._stopped.clear()

    def _poll(self) -> None:
        self._report(self.done)

    def _check_stopped(self, _: float) -> None:
        """Raise KeyboardInterrupt in a thread that computes a part, once the run is stopped."""
        if self._stopped.is_set():
            raise KeyboardInterrupt

    def _collect(self, i: int, future: Future[int]) -> None:
        """Count a part that was stored; a part that was cancelled or is missing stays left."""
        if future.cancelled():
            return
        tops = len(self.store.plan.tops_of(i))
        if future.result() == tops and self.store.file(i).exists():
            self.left.remove(i)
            self.done += tops
