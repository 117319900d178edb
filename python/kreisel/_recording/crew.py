"""A crew: threads, or the workers of an executor, that do a piece of work slice by slice, while the
thread that called looks after Ctrl-C and progress."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, nullcontext
from typing import Any, NamedTuple, TypeVar

from .._core import Work
from .._request.request import Progress

_LEAST, _MOST = 64, 1 << 15  # members of a slice; fewer where there are few
_LANES = 8  # so many go at once on one thread, in the lanes of a vector
_SHARE = 4  # of what is left, each thread takes this part: all end at about the same time
_AHEAD = 4  # slices for each thread that wait to be done
_LOOK, _TELL = 0.02, 0.1  # seconds between looks at what is done, and between calls of progress
_R = TypeVar("_R")

# What does the members begin to end: a function, and what to call it with.
Job = Callable[[int, int], tuple[Callable[..., _R], tuple[Any, ...]]]


class Crew(NamedTuple):
    """Threads of our own, or an executor's."""

    threads: int
    executor: Executor | None = None

    @property
    def shares_memory(self) -> bool:
        """Whether what does the work sees the arrays that are here."""
        return self.executor is None or isinstance(self.executor, ThreadPoolExecutor)

    def has_caller(self, n: int, progress: Progress | None, shared: bool) -> bool:
        """Whether the calling thread does its part, by work that listens to signals; it then has no
        time for progress."""
        return self.executor is None and progress is None and (shared or self._helpers(n) == 0)

    def _helpers(self, n: int) -> int:
        """How many threads there are beside the caller's, of which few members need none."""
        return 0 if n <= _LANES else self.threads - 1

    def do(
        self,
        n: int,
        job: Job[_R],
        take: Callable[[int, _R], object],
        work: Work,
        progress: Progress | None,
        shared: bool = False,
    ) -> None:
        """Does n members, slice by slice, and takes what became of each slice with its first
        member's number. What is raised on the way, Ctrl-C too, ends it: what runs is stopped by
        `work` and taken, what waits is left out. Where members are `shared`, the job for all of
        them is one, which has threads of its own."""
        if not self.has_caller(n, progress, shared):
            with self._pool() as pool:
                _Shift(self, pool, n, job, take, work, progress).run()
        elif shared:
            work.share(n, self._helpers(n) + 1)
            _take_one(0, n, job, take, work)
        else:
            for begin, end in self.slices(n):
                _take_one(begin, end, job, take, work)

    def _pool(self) -> AbstractContextManager[Executor]:
        return nullcontext(self.executor) if self.executor else ThreadPoolExecutor(self.threads)

    def slices(self, n: int) -> Iterator[tuple[int, int]]:
        """Which members are done together: ever fewer, so that many cost little and all threads
        have something to do to the end."""
        begin, least = 0, min(_LEAST, -(-n // self.threads))
        while begin < n:
            size = min(max((n - begin) // (_SHARE * self.threads), least), _MOST)
            end = min(begin + -(-size // _LANES) * _LANES, n)
            yield begin, end
            begin = end


def _take_one(
    begin: int, end: int, job: Job[_R], take: Callable[[int, _R], object], work: Work
) -> None:
    """Does some members here. What was raised meanwhile is raised when they are taken."""
    function, words = job(begin, end)
    take(begin, function(*words))
    work.end()
    if work.stopped:
        raise KeyboardInterrupt


class _Shift:
    """One piece of work under way."""

    def __init__(
        self,
        crew: Crew,
        pool: Executor,
        n: int,
        job: Job[Any],
        take: Callable[[int, Any], object],
        work: Work,
        progress: Progress | None,
    ) -> None:
        self.crew, self.pool, self.n, self.job, self.take_in = crew, pool, n, job, take
        self.work, self.progress = work, progress
        self.under_way: dict[Future[Any], tuple[int, int]] = {}
        self.done, self.told = 0, time.monotonic()
        self.slices = crew.slices(n)

    def run(self) -> None:
        try:
            while self.submit():
                ended, _ = wait(self.under_way, timeout=_LOOK, return_when=FIRST_COMPLETED)
                for future in ended:
                    self.take(future)
                self.tell()
        except BaseException:
            self.work.stop()
            self.call_off()
            raise

    def submit(self) -> bool:
        """Keeps some slices ahead; says whether any is under way."""
        while len(self.under_way) < _AHEAD * self.crew.threads:
            following = next(self.slices, None)
            if following is None:
                break
            function, words = self.job(*following)
            self.under_way[self.pool.submit(function, *words)] = following
        return bool(self.under_way)

    def take(self, future: Future[Any]) -> None:
        begin, end = self.under_way[future]
        result = future.result()
        del self.under_way[future]
        self.take_in(begin, result)
        self.done += end - begin

    def tell(self) -> None:
        now = time.monotonic()
        if self.progress is not None and now - self.told >= _TELL:
            self.told = now
            done = self.work.done if self.crew.shares_memory else self.done
            self.progress(done / self.n)

    def call_off(self) -> None:
        """Takes what still ends well. Another process is not waited for."""
        running = [future for future in self.under_way if not future.cancel()]
        if self.crew.shares_memory:
            wait(running)
        for future in running:
            if future.done() and not future.cancelled() and future.exception() is None:
                self.take(future)
