"""Progress bars, signal handling and output during a run."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from types import FrameType

from rich.console import Console
from rich.progress import Progress

from .._results.path import Error, Interrupted, Path
from .._solve.run import Run
from .._utils.signals import replace_signal_handlers
from .outputs import PathPieceReceiver


class StopSignalHandler:
    """A handler for Ctrl-C and SIGTERM during a run.

    After the first signal, the run stops, and the results obtained so far are written to the output
    files. A second signal of the same kind terminates the process immediately.
    """

    def __init__(self, end: float) -> None:
        self._end, self.asked = end, False
        self._bar: Progress | None = None

    @contextmanager
    def defer_signals(self) -> Iterator[None]:
        """Return a context manager that records signals instead of raising KeyboardInterrupt."""
        with replace_signal_handlers((signal.SIGINT, signal.SIGTERM), self._handle_stop_signal):
            yield

    def _handle_stop_signal(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        signal.signal(number, signal.SIG_DFL)

    @contextmanager
    def show_progress(self) -> Iterator[None]:
        """Return a context manager that shows a progress bar if standard error is a terminal."""
        console = Console(stderr=True)
        with (
            Progress(console=console, transient=True)
            if console.is_terminal
            else nullcontext() as bar
        ):
            if bar is not None:
                self._bar, self._task = bar, bar.add_task("t", total=abs(self._end))
            yield

    def update_progress_bar(self, t: float) -> None:
        """Update the progress bar; raise KeyboardInterrupt if a signal arrived before the end."""
        if self._bar is not None:
            self._bar.update(self._task, completed=abs(t))
        if self.asked and t != self._end:
            raise KeyboardInterrupt


@dataclass
class RunOutcome:
    """The exception that stopped a run, if any, and a checkpoint for resuming the run.

    The checkpoint corresponds to the last state that was written to all outputs.
    """

    stopped: BaseException | None = None
    checkpoint: bytes | None = None


def write_path_pieces_to_outputs(
    outputs: list[PathPieceReceiver],
    pieces: Iterator[Path],
    run: Run | None,
    stops: StopSignalHandler,
) -> RunOutcome:
    """Write a path to all outputs piece by piece, and return the outcome of the run.

    `run` provides the checkpoint.
    """
    while True:
        checkpoint = run.checkpoint if run else None
        failure: BaseException | None = None
        try:
            piece = next(pieces, None)
        except (Error, Interrupted) as error:
            piece, failure = error.path, error
        if piece is None:
            return RunOutcome(None, checkpoint)
        try:
            for output in outputs:
                output.receive_path_piece(piece)
        except OSError as error:
            return RunOutcome(error, checkpoint)
        if failure is None and stops.asked:
            failure = KeyboardInterrupt(f"interrupted at t = {piece.t[-1]:g}")
        if failure is not None:
            return RunOutcome(failure, run.checkpoint if run else None)
