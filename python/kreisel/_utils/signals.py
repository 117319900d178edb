"""Temporary handlers of signals such as SIGINT (Ctrl-C)."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType

Handler = Callable[[int, FrameType | None], object]
# Signals that interrupt a program: Ctrl-C, a request to terminate, and a timer (not on Windows).
_INTERRUPTION_SIGNALS = [
    signal.Signals[name]
    for name in ("SIGINT", "SIGTERM", "SIGALRM")
    if name in signal.Signals.__members__
]


@contextmanager
def replace_signal_handlers(
    numbers: Iterable[int], handler: Handler
) -> Iterator[dict[int, Handler]]:
    """Return a context manager that replaces the handlers of signals.

    Only handlers that are Python functions are replaced, and only in the main thread. The context
    manager yields a dictionary that maps the signal numbers to the replaced handlers.
    """
    handlers: dict[int, Handler] = {
        number: original for number in numbers if callable(original := signal.getsignal(number))
    }
    if threading.current_thread() is not threading.main_thread():
        handlers = {}  # only the main thread can set signal handlers
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
