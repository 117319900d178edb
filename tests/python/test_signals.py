"""Tests of deferred signals."""

import signal
import threading
from concurrent.futures import Future, ThreadPoolExecutor

import pytest
from kreisel._results.executor import run_jobs
from kreisel._utils.signals import defer_signals, replace_signal_handlers

NUMBERS = signal.SIGINT, signal.SIGTERM, signal.SIGALRM


@pytest.fixture(autouse=True)
def interrupts():
    """Let three signals raise KeyboardInterrupt, and check that the handlers are restored."""
    before = {number: signal.signal(number, signal.default_int_handler) for number in NUMBERS}
    yield
    after = {number: signal.signal(number, before[number]) for number in NUMBERS}
    assert after == dict.fromkeys(NUMBERS, signal.default_int_handler)


@pytest.mark.parametrize("number", NUMBERS)
def test_signals_are_handled_at_the_end(number):
    steps = []
    with pytest.raises(KeyboardInterrupt), defer_signals():
        signal.raise_signal(number)
        steps.append("after the signal")
    assert steps


def test_signals_are_handled_on_request():
    steps = []
    with pytest.raises(KeyboardInterrupt), defer_signals() as handle_received_signals:
        handle_received_signals()
        signal.raise_signal(signal.SIGINT)
        steps.append("after the signal")
        handle_received_signals()
        steps.append("after the exception")
    assert steps == ["after the signal"]


def test_exceptions_take_precedence_over_deferred_signals():
    with pytest.raises(ZeroDivisionError), defer_signals():
        signal.raise_signal(signal.SIGINT)
        1 / 0  # noqa: B018


def test_ignored_and_default_signals_are_left_alone():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(signal, "getsignal", {signal.SIGINT: signal.SIG_IGN}.get)
        with replace_signal_handlers(NUMBERS, print) as handlers:
            assert handlers == {}


def test_other_threads_change_no_handler():
    found = []

    def find_handlers():
        with replace_signal_handlers(NUMBERS, print) as handlers:
            found.append((handlers, signal.getsignal(signal.SIGINT)))

    thread = threading.Thread(target=find_handlers)
    thread.start()
    thread.join()
    assert found == [({}, signal.default_int_handler)]


class InterruptedFuture(Future):
    """A future during whose cancellation a signal arrives."""

    cancelled_count = 0

    def cancel(self):
        signal.raise_signal(signal.SIGINT)
        InterruptedFuture.cancelled_count += 1
        return super().cancel()


class InterruptedPool(ThreadPoolExecutor):
    """An executor during whose calls a signal arrives, and which runs no job."""

    submitted_count = 0

    def submit(self, function, /, *arguments):
        signal.raise_signal(signal.SIGINT)
        self.submitted_count += 1
        return InterruptedFuture()


def test_signals_interrupt_no_call_of_an_executor():
    """Check that submissions and cancellations end, which an exception could leave locked."""
    calls = []
    InterruptedFuture.cancelled_count = 0
    with InterruptedPool(1) as pool, pytest.raises(KeyboardInterrupt):
        jobs = ((i, (print, ())) for i in range(3))
        run_jobs(pool, jobs, 3, calls.append, lambda: None, lambda: calls.append("stop"))
    assert pool.submitted_count == InterruptedFuture.cancelled_count == 3 and calls == ["stop"]
