"""Tests of progress, and of runs that end early because of failures, exceptions or Ctrl-C."""

import gc
import json
import pickle
import signal
import threading
import weakref
from concurrent.futures import Executor, Future, ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits
from toolbox import python
from tops import GENERAL, WILD

TOP = kr.scenes.asymmetric
TOPS = TOP.vary(gravity=np.linspace(0.5, 1.0, 64))
LOWEST = kr.events.nutation(direction=1)


@pytest.fixture
def default_handlers():
    """Let signals raise KeyboardInterrupt, and check that these handlers are restored."""
    numbers = signal.SIGINT, signal.SIGTERM
    before = {number: signal.signal(number, signal.default_int_handler) for number in numbers}
    yield
    after = {number: signal.signal(number, before[number]) for number in numbers}
    assert after == dict.fromkeys(numbers, signal.default_int_handler)


# Failures


def test_a_failed_run_keeps_its_path_and_is_pickled():
    with pytest.raises(kr.Error, match=r"rk4 reached t = 0.1 of 1 in 10 steps") as failure:
        kr.solve(GENERAL, [0, 0.055, 1], "rk4", step=0.01, max_steps=10)
    error = failure.value
    assert error.status == "ERR_LIMIT" and isinstance(error, RuntimeError)
    assert error.path.t.tolist() == [0, 0.055, 0.1] and error.path.stats.steps == 10
    full = kr.solve(GENERAL, [0, 0.055, 0.1], "rk4", step=0.01, max_steps=10)
    assert np.array_equal(error.path.states, full.states)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.status) == (kr.Error, str(error), error.status)
    assert np.array_equal(again.path.states, full.states)


@pytest.mark.parametrize("want", [None, ("energy",)])
@pytest.mark.parametrize("first, times", [(0.0, [0]), (0.5, [0.5]), (50.0, [0.5])])
def test_a_state_that_is_not_finite_ends_a_run(first, times, want):
    with pytest.raises(kr.Error, match="finite") as failure:
        kr.solve(WILD, [first, 50.0], "rk4", step=0.5, want=want)
    path, whole = failure.value.path, kr.solve(WILD, 0.5, "rk4", step=0.5)
    assert failure.value.status == "ERR_NOT_FINITE" and path.t.tolist()[:1] == times
    assert path.energy[-1] == whole.energy[-1] and np.isfinite(path.energy).all()


# Progress


CALLS = {  # calls of every kind that end at 3, with a callback
    "states": lambda progress: kr.solve(TOP, 3.0, progress=progress),
    "wanted": lambda progress: kr.solve(
        TOP, np.linspace(0, 3, 40000), want=("energy",), progress=progress
    ),
    "events": lambda progress: kr.solve(TOP, 3.0, events=[LOWEST], progress=progress),
    "step search": lambda progress: kr.solve(TOP, 3.0, "geometric", error=1e-3, progress=progress),
    "run": lambda progress: kr.start(TOP).to(3.0, progress=progress),
    "stream": lambda progress: list(kr.stream(TOP, [1.0, 2.0, 3.0], chunk=1, progress=progress)),
}


@pytest.mark.parametrize("kind", CALLS)
def test_progress_ends_with_the_final_time(kind):
    times = []
    CALLS[kind](times.append)
    assert times[-1] == 3.0 and times == sorted(times)


FIXED = {"method": "strang", "step": 0.01}
LONG_CALLS = {  # calls of every kind that would take hours
    "fixed": lambda **more: kr.solve(TOP, 1e9, "rk4", step=1e-3, **more),
    "wanted": lambda **more: kr.solve(TOP, 1e5, every=1, want=("energy",), **FIXED, **more),
    "stream": lambda **more: list(kr.stream(TOP, 1e9, every=1, chunk=7, **FIXED, **more)),
    "many tops": lambda **more: kr.solve(TOPS, 1e8, **more),
    "many tops, threads": lambda **more: kr.solve(TOPS, 1e8, threads=3, **more),
    "reductions": lambda **more: kr.reduce(TOPS, 1e8, {"spin": "max"}, **more),
    "sections": lambda **more: kr.section(TOPS, n=20_000, **more),
    "tangents": lambda **more: kr.chaos(TOPS, 1e6, threads=3, **more),
}


@pytest.mark.parametrize("kind", LONG_CALLS)
def test_an_exception_in_progress_ends_the_call_and_is_not_kept_alive(kind):
    class Big:
        pass

    def call_until_exception():
        reports, big = [], Big()

        def stop(report):
            reports.append((report, threading.get_ident()))
            if len(reports) == 3:
                raise ArithmeticError(f"enough of {big}")

        with pytest.raises(ArithmeticError, match="enough"):
            LONG_CALLS[kind](progress=stop)
        values = [value for value, _ in reports]
        assert len(values) == 3 and values == sorted(values) and values[0] >= 0.0
        assert {thread for _, thread in reports} == {threading.get_ident()}
        return weakref.ref(big)

    big = call_until_exception()
    gc.collect()
    assert big() is None


# Ctrl-C


STOPS = {  # long calls; the first of them keeps nothing if it is interrupted
    "closed form": "send(0), [kr.exact(thesis)(np.arange(1e6)) for _ in range(1000)]",
    "fixed": 'kr.solve(top, 1e8, "rk4", step=1e-3, progress=send)',
    "adaptive": "kr.solve(top, 1e8, tol=1e-12, progress=send)",
    "detours": 'kr.solve(top, np.arange(0, 4e5) * 0.1005, "strang", step=1e-3, progress=send)',
    "digits": "kr.solve(top, 1e9, digits=30, progress=send)",
    "dense": "kr.solve(top, np.linspace(0, 10, 3_000_000), progress=send)",
    "implicit": 'kr.solve(top, 1e9, "implicit_midpoint", step=0.01, progress=send)',
    "geometric": 'kr.solve(kr.scenes.thesis, 1e6, "geometric", error=1e-3, progress=send)',
    "exact": "kr.solve(kr.scenes.thesis, np.linspace(0, 10, 3_000_000), progress=send)",
    "wanted": 'kr.solve(top, np.linspace(0, 1e8, 3_000_000), want=("energy",), progress=send)',
    "stream": 'list(kr.stream(top, math.inf, "strang", step=.01, every=200, progress=send))',
    "between": "send(0), kr.solve(top, 1e9, 'strang', step=1, every=10**9)([3, 1e8 + 0.5])",
    "compare": 'kr.compare(thesis, 1e6, ["exact", "rk4"], [1e-4], truth="exact", progress=send)',
    "reference": 'send(0), kr.compare(thesis, 1e6, ["exact", "rk4"], steps=[1e-4], truth="rk4")',
}
STOP = """
import json, math, numpy as np, os, signal, sys, threading, kreisel as kr
top, thesis = kr.scenes.asymmetric, kr.scenes.thesis
def kill():
    os.kill(os.getpid(), signal.SIGINT)
def send(_):
    if not timers:
        timers.append(threading.Timer(0.02, kill))
        timers[0].start()
for kind, call in json.loads(sys.argv[1]).items():
    timers = []
    try:
        eval(call)
    except KeyboardInterrupt as stopped:
        name, path = type(stopped).__name__, getattr(stopped, "path", None)
        if path is None:
            print(json.dumps([kind, name, len(getattr(stopped, "result", [])), 0]))
        else:
            assert np.array_equal(path(path.t[:2]).energy, path[:2].energy), kind
            print(json.dumps([kind, name, len(path), path.t[-1]]))
"""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs signals")
def test_ctrl_c_stops_every_long_call():
    """Check that SIGINT interrupts calls that would otherwise run for a very long time."""
    result = python(STOP, json.dumps(STOPS))
    assert result.returncode == 0, result.stdout + result.stderr
    rows = {kind: row for kind, *row in map(json.loads, result.stdout.splitlines())}
    assert list(rows) == list(STOPS)
    assert rows.pop("closed form") == ["KeyboardInterrupt", 0, 0]
    assert rows.pop("compare") == ["Interrupted", 1, 0]
    assert rows.pop("reference") == ["Interrupted", 0, 0]
    assert {name for name, _, _ in rows.values()} == {"Interrupted"}
    assert all(states >= 1 and end >= 0 for _, states, end in rows.values())
    assert all(rows[kind][1] >= 2 and rows[kind][2] > 0 for kind in ("fixed", "adaptive"))


@pytest.mark.parametrize("count", [1, 3, 5, 7])
def test_an_interrupted_comparison_keeps_its_rows(count):
    words = {"methods": ["rk4", "strang", "taylor"], "steps": [0.1, 0.05], "repeats": 2}
    reports = []

    def stop(part):
        reports.append(part)
        if len(reports) == count:
            raise KeyboardInterrupt

    with pytest.raises(kr.Interrupted) as interruption:
        kr.compare(TOP, 1.0, progress=stop, **words)
    again = pickle.loads(pickle.dumps(interruption.value)).result
    whole = kr.compare(TOP, 1.0, progress=reports.append, **words)
    assert reports == pytest.approx([i / 10 for i in (*range(1, count + 1), *range(1, 11))])
    assert len(again) == len(interruption.value.result) == min(count, 5) and len(whole) == 5
    for row, full in zip(again, whole, strict=False):
        assert (row.method, row.step, row.steps) == (full.method, full.step, full.steps)
        assert row.attitude_error == full.attitude_error and row.seconds > 0


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs a timer with a signal")
def test_other_signals_raise_the_exception_of_their_handler():
    def raise_timeout(*_):
        raise TimeoutError("enough")

    before = signal.signal(signal.SIGALRM, raise_timeout)
    signal.setitimer(signal.ITIMER_REAL, 0.1)
    try:
        with pytest.raises(TimeoutError, match="enough"):
            kr.solve(GENERAL, 1e8, "rk4", step=1e-3)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


# Executors


class CopyingExecutor(Executor):
    """An executor that runs each task when it is submitted, using pickled arguments."""

    def submit(self, function, *arguments):
        future = Future()
        copied, words = pickle.loads(pickle.dumps((function, arguments)))
        future.set_result(copied(*words))
        return future


@pytest.mark.parametrize(
    "words",
    [{}, {"method": "geometric", "error": 1e-6}, {"want": ["energy"]}, {"method": "taylor"}],
)
def test_workers_that_share_no_memory_give_the_same_bits(words):
    reports = []
    paths = kr.solve(TOPS, [0.0, 1.0], executor=CopyingExecutor(), progress=reports.append, **words)
    expected = kr.solve(TOPS, [0.0, 1.0], **words)
    assert same_bits(paths.energy, expected.energy) and same_bits(
        paths.stats.steps, expected.stats.steps
    )
    assert reports == sorted(reports) and reports[-1] == 1.0


class InterruptedPool(ThreadPoolExecutor):
    """An executor that receives a signal while it submits a task, and while it cancels one."""

    def __init__(self, number):
        super().__init__(1)
        self.number, self.futures, self.cancelled = number, [], 0

    def submit(self, function, /, *arguments):
        if len(self.futures) == 2:
            self.futures[0].result()
            signal.raise_signal(self.number)
        future = super().submit(function, *arguments)
        self.futures.append(future)
        cancel = future.cancel

        def cancel_and_count():
            signal.raise_signal(self.number)
            self.cancelled += 1
            return cancel()

        future.cancel = cancel_and_count
        return future


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("words", [{"t": 50.0}, {"t": 3.0, "method": "geometric", "error": 1e-3}])
def test_ctrl_c_interrupts_no_call_of_an_executor_and_keeps_the_tops_that_ended(
    default_handlers, words, number
):
    tops = TOP.vary(gravity=np.linspace(0.5, 1.0, 1000))
    for _ in range(5):  # another thread may or may not compute tops at the time of the signal
        with InterruptedPool(number) as pool, pytest.raises(KeyboardInterrupt) as stopped:
            kr.solve(tops, executor=pool, **words)
        assert isinstance(stopped.value, kr.Interrupted) and pool.cancelled > 0
        paths = stopped.value.result
        has_ended = paths.status == "OK"
        assert 0 < has_ended.sum() < 1000
        assert same_bits(paths.states[has_ended], kr.solve(tops[has_ended], **words).states)


@pytest.mark.parametrize("task", [kr.solve, kr.chaos])
def test_ctrl_c_after_the_last_top_is_not_hidden(task):
    reports = []

    def interrupt_at_end(part):
        reports.append(part)
        if part == 1.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as stopped:
        task(TOPS, 1.0, threads=2, progress=interrupt_at_end)
    assert type(stopped.value) is KeyboardInterrupt and reports == sorted(reports)
