"""Parts are made: here, one after the other by some threads, or by an executor, one on each of its
workers. A worker gives back a count; what it made is on the disk."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor

from .._options.solve_options import Progress
from .._results.executor import is_local, run_jobs
from .part_table import PartTable, tabulate_part
from .store import SweepStore

_AHEAD = 256  # parts that an executor has at once: more than it has workers, few enough to call off
_TELL = 0.1  # seconds between calls of progress


def compute_part(folder: SweepStore, i: int, threads: int, progress: Progress | None) -> PartTable:
    """The rows of a part. A top that fails is one as any other."""
    numbers = folder.plan.tops_of(i)
    return tabulate_part(folder.plan, numbers, folder.plan.compute_tops(numbers, threads, progress))


def make(folder: SweepStore, i: int, progress: Progress | None = None) -> int:
    """Makes a part on one thread and puts it in its place: the same bits wherever that is. Gives
    back how many tops it has."""
    folder.put(i, compute_part(folder, i, 1, progress))
    return len(folder.plan.tops_of(i))


class PartsLost(RuntimeError):
    """Parts that an executor did not bring back."""


class PartRunner:
    """The making of some parts of a folder, and how far it has come."""

    def __init__(self, folder: SweepStore, parts: Sequence[int], progress: Progress | None) -> None:
        self.folder, self.progress = folder, progress
        self.left = list(parts)
        self.tops = sum(len(folder.plan.tops_of(i)) for i in parts)
        self.done, self._told = 0, 0.0
        self._ended = threading.Event()

    def here(self, threads: int) -> None:
        """Compute the parts in this process; while one is written the next is computed."""
        with ThreadPoolExecutor(1) as writer:
            written: Future[None] | None = None
            for i in tuple(self.left):
                rows = compute_part(self.folder, i, threads, self._within(i))
                if written is not None:
                    written.result()
                written = writer.submit(self.folder.put, i, rows)
                self.done += len(self.folder.plan.tops_of(i))
        if written is not None:
            written.result()
            self._tell(self.done, last=True)

    def _within(self, i: int) -> Progress | None:
        """To be told how far a part has come."""
        tops = len(self.folder.plan.tops_of(i))
        return self.progress and (lambda share: self._tell(self.done + share * tops))

    def _tell(self, tops: float, last: bool = False) -> None:
        now = time.monotonic()
        if self.progress is not None and (last or now - self._told >= _TELL):
            self._told = now
            self.progress(tops / self.tops)

    def by(self, executor: Executor) -> None:
        """Compute all parts on the workers of an executor. Parts that are lost are tried twice."""
        for _ in range(2):
            self._once(executor)
            if not self.left:
                self._tell(self.done, last=True)
                return
        raise PartsLost(
            f"the executor has lost {len(self.left)} parts, the first of them part {self.left[0]}; "
            "all others are kept, and the same call makes what is missing"
        )

    def _once(self, executor: Executor) -> None:
        watch = (self._watch,) if is_local(executor) else ()
        jobs = ((i, (make, (self.folder, i, *watch))) for i in tuple(self.left))
        try:
            run_jobs(executor, jobs, _AHEAD, self._end, self._poll, self._ended.set)
        except BrokenExecutor as error:
            raise PartsLost(self._broken(error)) from None
        finally:
            self._ended.clear()

    def _poll(self) -> None:
        self._tell(self.done)

    def _watch(self, _: float) -> None:
        """Raise KeyboardInterrupt in a thread that computes a part, once parts are cancelled."""
        if self._ended.is_set():
            raise KeyboardInterrupt

    def _end(self, i: int, future: Future[int]) -> None:
        """Count a part that was stored; one that was cancelled or is missing stays left."""
        if future.cancelled():
            return
        tops = len(self.folder.plan.tops_of(i))
        if future.result() == tops and self.folder.file(i).exists():
            self.left.remove(i)
            self.done += tops

    def _broken(self, error: BrokenExecutor) -> str:
        return (
            f"the executor has broken, with {len(self.left)} parts left, the first of them part "
            f"{self.left[0]}: {error}; what is done is kept, and the same call makes the rest"
        )
