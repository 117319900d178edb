"""`kreisel sweep`."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, InvalidStateError, ProcessPoolExecutor
from contextlib import contextmanager
from itertools import chain, pairwise
from pathlib import Path
from types import FrameType
from typing import Any

import click
import numpy as np

from .._sweep.plan import DONE, MISSING
from .._sweep.sweep import SweepResult, read_sweep
from .._sweep.sweep import sweep as run_sweep
from .._utils.arguments import format_count, optional_dependency
from .options import UsageError, command, show_progress

_SHOWN = 6  # largest number of ranges of parts in a printed line
_STOP_SIGNALS = signal.SIGINT, signal.SIGTERM
_GRACE_SECONDS = 3.0  # time after SIGTERM in which the parent process can end a worker


class _SweepCommandGroup(click.Group):
    """The command group `kreisel sweep`, whose default command is `run`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in self.commands and args[0] not in ("-h", "--help"):
            args = ["run", *args]
        return super().parse_args(ctx, args)


@click.group("sweep", cls=_SweepCommandGroup)
def sweep() -> None:
    """Run a task on many tops, and store the results in parts: kreisel sweep PLAN --folder FOLDER.

    The name of the default command `run` can be omitted. To resume an interrupted sweep, repeat the
    command.
    """


@command("sweep plan.toml --folder runs --workers 8", sweep)
@click.argument("plan", type=click.Path())
def run(plan: str, folder: str, parts: range | None, workers: int | None, dask: str | None) -> None:
    """Compute all missing parts of the sweep described in the TOML file PLAN."""
    if workers is not None and dask is not None:
        raise UsageError("give either --workers or --dask")
    with (
        _convert_sweep_errors_to_cli_errors(),
        show_progress(1.0) as progress,
        _open_executor(workers, dask) as executor,
    ):
        result = run_sweep(
            Path(plan), folder=folder, parts=parts, executor=executor, progress=progress
        )
    click.echo(_format_sweep_summary(result, result.present))


@contextmanager
def _convert_sweep_errors_to_cli_errors() -> Iterator[None]:
    try:
        yield
    except (FileExistsError, FileNotFoundError) as error:
        raise UsageError(str(error)) from None
    except RuntimeError as error:
        raise click.ClickException(str(error)) from None


@contextmanager
def _open_executor(workers: int | None, dask: str | None) -> Iterator[Executor | None]:
    if dask is not None:
        with optional_dependency("'kreisel[dask]'"):
            import distributed
        connect: Callable[..., Any] = distributed.Client
        with connect(dask) as client:
            yield client.get_executor()
    elif workers is not None:
        context = multiprocessing.get_context("spawn")
        with _WorkerProcessPool(workers, context, initializer=prepare_worker_process) as pool:
            try:
                yield pool
            except BaseException:
                threading.excepthook = report_thread_exception
                pool.shutdown(wait=False, cancel_futures=True)
                for child in multiprocessing.active_children():
                    child.kill()  # SIGTERM would end a worker only after _GRACE_SECONDS
                raise
    else:
        yield None


def report_thread_exception(failure: threading.ExceptHookArgs) -> None:
    """Report an exception except InvalidStateError, as of a closed pool whose worker exits."""
    if failure.exc_type is not InvalidStateError:
        threading.__excepthook__(failure)


class _WorkerProcessPool(ProcessPoolExecutor):
    """A pool of processes that block SIGINT and SIGTERM until they have set their handlers."""

    def submit(self, *words: Any, **more: Any) -> Future[Any]:
        """Submit a task; this may start a worker, which inherits the blocked signals."""
        if not hasattr(signal, "pthread_sigmask"):  # on Windows
            return super().submit(*words, **more)
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, _STOP_SIGNALS)
        try:
            return super().submit(*words, **more)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def prepare_worker_process() -> None:
    """Ignore Ctrl-C in a worker process, and end the process a moment after SIGTERM.

    Terminals and batch systems send a signal to all processes of a command. The parent process
    handles the signal, and ends its workers. If a worker ended earlier, the pool would fail.
    """
    threading.Thread(target=_end_process_with_parent, daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if not hasattr(signal, "pthread_sigmask"):  # on Windows
        return
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    if signal.getsignal(signal.SIGTERM) is not signal.SIG_IGN:
        signal.signal(signal.SIGTERM, _end_process_after_grace_period)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _STOP_SIGNALS)


def _end_process_with_parent() -> None:
    """Wait for the end of the parent process, and end this process, which would wait for tasks."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _end_process_after_grace_period(number: int, frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_IGN)
    signal.setitimer(signal.ITIMER_REAL, _GRACE_SECONDS)  # SIGALRM ends the process


@command(group=sweep)
@click.argument("folder", type=click.Path())
def status(folder: str) -> None:
    """Verify the parts in FOLDER, and count the complete, missing and damaged ones."""
    with _convert_sweep_errors_to_cli_errors():
        result = read_sweep(folder, partial=True)
        parts_by_state = result._verify_existing_parts()
        failure_count = sum(
            int(np.count_nonzero(result.part(i)["status"] != "OK")) for i in parts_by_state[DONE]
        )
    click.echo(_format_sweep_summary(result, parts_by_state[DONE]))
    existing = [range(0), *_list_ranges(sorted(chain(*parts_by_state.values())))]
    gaps = [range(a.stop, b.start) for a, b in pairwise([*existing, range(result.parts, 0)])]
    ranges = {MISSING: [gap for gap in gaps if gap]}
    ranges |= {state: _list_ranges(parts) for state, parts in parts_by_state.items()}
    for state, runs in ranges.items():
        if runs and state != DONE:
            count = format_count(sum(map(len, runs)), "part")
            first = [f"{one.start}:{one.stop}" for one in runs[:_SHOWN]]
            click.echo(f"{state}: {count}, {', '.join([*first, *['...'] * (len(runs) > _SHOWN)])}")
    if failure_count:
        click.echo(f"failed: {format_count(failure_count, 'top')}, whose status is not OK")
    if file_count := sum(1 for _ in Path(folder).glob(".*.new")):
        click.echo(
            f"also {format_count(file_count, 'file')} .*.new, left by processes that are still "
            "writing or were killed"
        )


def _format_sweep_summary(result: SweepResult, done: list[int]) -> str:
    size = sum(file.stat().st_size for file in Path(result.folder).glob("part-*"))
    tops, folder = format_count(result.size, "top"), click.format_filename(result.folder)
    return (
        f"{folder}: {len(done)} of {result.parts} parts, {tops} in all, "
        f"{1e-6 * size:.3g} MB; plan {result.hash[:16]}"
    )


def _list_ranges(numbers: list[int]) -> list[range]:
    """Return the ranges that consist of these ascending numbers, such as 3:7 for 3 to 6."""
    ranges: list[range] = []
    for i in numbers:
        begin = ranges.pop().start if ranges and ranges[-1].stop == i else i
        ranges.append(range(begin, i + 1))
    return ranges
