"""Temporary handlers of SIGINT (Ctrl-C) and SIGTERM."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

Handler = Callable[[int, FrameType | None], object]


@contextmanager
def replace_signal_handlers(handler: Handler) -> Iterator[dict[int, Handler]]:
    """Return a context manager that replaces the handlers of SIGINT and SIGTERM.

    Only handlers that are Python functions are replaced, and only in the main thread. The context
    manager yields a dictionary that maps the signal numbers to the replaced handlers.
    """
    handlers: dict[int, Handler] = {
        number: original
        for number in (signal.SIGINT, signal.SIGTERM)
        if callable(original := signal.getsignal(number))
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
    """Return a context manager that defers SIGINT and SIGTERM.

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
        lambda *signal_and_frame: received.append(signal_and_frame)
    ) as handlers:
        yield handle_received_signals
    handle_received_signals()
