"""Ctrl-C, and workers in threads and processes."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext
from itertools import islice
from types import FrameType
from typing import Any, NamedTuple, TypeVar

from .._core import Work

Progress = Callable[[float], object]
# Signals that interrupt a program: Ctrl-C, a request to terminate, and a timer (not on Windows).
_NAMES = "SIGINT", "SIGTERM", "SIGALRM"
_INTERRUPTION_SIGNALS = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]


@contextmanager
def replace_signal_handlers(
    numbers: Iterable[int],
    handler: Callable[[int, FrameType | None], object],
    replaces_default: bool = False,
) -> Iterator[dict[int, Any]]:
    """Return a context manager that replaces the handlers of signals.

    Only handlers that are Python functions (and, if `replaces_default` is True, the default) are
    replaced, and only in the main thread. The context manager yields a dictionary that maps the
    signal numbers to the replaced handlers.
    """
    handlers: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():  # only it can set signal handlers
        for number in numbers:
            original = signal.getsignal(number)
            if callable(original) or (replaces_default and original is signal.SIG_DFL):
                handlers[number] = original
    try:
        for number in handlers:
            signal.signal(number, handler)
        yield handlers
    finally:
        for number, original in handlers.items():
            signal.signal(number, original)


@contextmanager
def defer_signals() -> Iterator[Callable[[], None]]:
    """Return a context manager that defers SIGINT, SIGTERM and SIGALRM.

    An exception that a signal handler raises, such as KeyboardInterrupt, can leave a lock of the
    standard library locked, so that other threads wait for the lock forever. The context manager
    yields a function that handles the signals received so far. Other signals are handled at the
    end; an exception discards them.
    """
    received: list[tuple[int, FrameType | None]] = []

    def handle_received_signals() -> None:
        while received:
            number, frame = received.pop(0)
            handlers[number](number, frame)

    with replace_signal_handlers(
        _INTERRUPTION_SIGNALS, lambda number, frame: received.append((number, frame))
    ) as handlers:
        yield handle_received_signals
    handle_received_signals()


_MIN_SLICE, _MAX_SLICE = 64, 1 << 15  # members in a slice; a small ensemble has smaller slices
LANES = 8  # number of tops that one thread integrates simultaneously, in the lanes of vectors
_SLICES_AHEAD = 4  # number of submitted slices per thread, running or waiting
_POLL_SECONDS, _PROGRESS_SECONDS = 0.02, 0.1
_K = TypeVar("_K")
_R = TypeVar("_R")

Job = tuple[Callable[..., _R], tuple[Any, ...]]  # a function and its arguments


def has_thread_workers(executor: Executor) -> bool:
    """Return True if the workers of `executor` share memory with this process."""
    return isinstance(executor, ThreadPoolExecutor)


def run_jobs(
    executor: Executor,
    jobs: Iterator[tuple[_K, Job[_R]]],
    max_in_flight: int,
    collect: Callable[[_K, Future[_R]], object],
    poll: Callable[[], object],
    stop: Callable[[], object],
) -> None:
    """Run jobs in parallel, and pass the key and the future of each finished job to `collect`.

    `poll` is called regularly. After an exception or Ctrl-C, waiting jobs are cancelled, and `stop`
    is called to end the running jobs. Before the exception is raised again, the results of all
    finished jobs are passed to `collect`. After an exception, run_jobs waits for jobs that run in
    threads, but not for jobs in other processes.
    """
    running: dict[Future[_R], _K] = {}
    try:
        with defer_signals() as handle_received_signals:
            while True:
                for key, (function, arguments) in islice(jobs, max_in_flight - len(running)):
                    running[executor.submit(function, *arguments)] = key
                if not running:
                    break
                futures, _ = wait(running, timeout=_POLL_SECONDS, return_when=FIRST_COMPLETED)
                for future in futures:
                    collect(running.pop(future), future)
                poll()
                handle_received_signals()
    except BaseException:
        with defer_signals():
            stop()
            pending = [future for future in running if not future.cancel()]
            if has_thread_workers(executor):
                wait(pending)  # until no thread writes results any more, even after another Ctrl-C
            for future in pending:
                if future.done() and not future.cancelled() and future.exception() is None:
                    collect(running[future], future)
        raise


class WorkerPool(NamedTuple):
    """A pool of threads, or an executor supplied by the user."""

    threads: int
    executor: Executor | None = None

    @property
    def has_workers_in_other_processes(self) -> bool:
        """True if the workers do not share memory with this process."""
        return self.executor is not None and not has_thread_workers(self.executor)

    def run_slices(
        self,
        n: int,
        job: Callable[[int, int], Job[_R]],
        collect: Callable[[int, _R], object],
        work: Work,
        progress: Progress | None = None,
        is_native: bool = False,
    ) -> None:
        """Run a computation for n members, divided into slices, until it is complete.

        job        a function that returns the job for the members begin..end
        collect    a function that receives the first index and the result of each slice
        work       the object that can stop running jobs, and that counts finished members
        is_native  True if the core distributes the members to its own threads

        Raises KeyboardInterrupt after Ctrl-C, and re-raises any exception from a job.
        """
        threads = 1 if n <= LANES else self.threads
        if self.executor is None and (threads == 1 or is_native):
            work.listen(n, progress)
            if is_native:
                work.share(threads)
            for begin, end in [(0, n)] if is_native else WorkerPool(1).yield_slice_bounds(n):
                function, arguments = job(begin, end)
                collect(begin, function(*arguments))
                work.end()
                if work.stopped:
                    raise KeyboardInterrupt
            return
        done, last_call = 0, time.monotonic()

        def collect_future(part: tuple[int, int], future: Future[_R]) -> None:
            nonlocal done
            collect(part[0], future.result())
            done += part[1] - part[0]

        def report_progress() -> None:
            nonlocal last_call
            now = time.monotonic()
            if progress is not None and now - last_call >= _PROGRESS_SECONDS:
                last_call = now
                progress((done if self.has_workers_in_other_processes else work.done) / n)

        jobs = ((part, job(*part)) for part in self.yield_slice_bounds(n))
        most = _SLICES_AHEAD * self.threads
        own = None if self.executor else ThreadPoolExecutor(threads)
        with own or nullcontext(self.executor) as executor:
            assert executor is not None
            run_jobs(executor, jobs, most, collect_future, report_progress, work.stop)

    def yield_slice_bounds(self, n: int) -> Iterator[tuple[int, int]]:
        """Divide n members into ever smaller slices, so that all threads finish almost together."""
        begin, least = 0, min(_MIN_SLICE, -(-n // self.threads))
        while begin < n:
            size = min(max((n - begin) // (4 * self.threads), least), _MAX_SLICE)
            end = min(begin + -(-size // LANES) * LANES, n)
            yield begin, end
            begin = end
