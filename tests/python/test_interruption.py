"""Tests of runs that end early because of failures or interruptions."""

import gc
import pickle
import signal
import threading
import weakref

import kreisel as kr
import numpy as np
import pytest
from kreisel._solve import run, variational
from toolbox import python
from tops import GENERAL

TOP = kr.scenes.asymmetric


def test_max_steps_ends_a_run():
    with pytest.raises(
        kr.Error, match=r"largest number of steps.*rk4 reached t = 0.1 of 1 in 10 steps"
    ) as failure:
        kr.solve(GENERAL, [0, 0.055, 1], "rk4", step=0.01, max_steps=10)
    error = failure.value
    assert error.status == "ERR_LIMIT" and isinstance(error, RuntimeError)
    assert error.path.t.tolist() == [0, 0.055, 0.1] and error.path.stats.steps == 10
    full = kr.solve(GENERAL, [0, 0.055, 0.1], "rk4", step=0.01, max_steps=10)
    assert np.array_equal(error.path.states, full.states)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.status) == (kr.Error, str(error), error.status)
    assert np.array_equal(again.path.states, full.states)


@pytest.mark.parametrize("first, times", [(0.0, [0, 1.5]), (1.0, [1, 1.5]), (50.0, [1.5])])
def test_a_state_that_is_not_finite_ends_a_run(first, times):
    wild = GENERAL.replace(momentum=(5, -10, 5), attitude=(1, 0, 0, 0))
    with pytest.raises(kr.Error, match=r"finite.* in 3 steps") as failure:
        kr.solve(wild, [first, 50.0], "rk4", step=0.5)
    path = failure.value.path
    assert failure.value.status == "ERR_NOT_FINITE" and path.t.tolist() == times
    assert np.isfinite(path.states).all()
    assert np.array_equal(path.states[-1], kr.solve(wild, 1.5, "rk4", step=0.5).states[-1])


def test_an_unreachable_tolerance_ends_a_run():
    with pytest.raises(kr.Error) as failure:
        kr.solve(GENERAL, 1, tol=1e-300)
    assert failure.value.status == "ERR_STEP" and failure.value.path.t.tolist()[0] == 0


# Progress


def make_third_call_raise(run):
    """Call `run` with a progress callback that raises an exception at its third call."""
    times = []

    def note(t):
        times.append(t)
        if len(times) == 3:
            raise ArithmeticError("enough")

    with pytest.raises(ArithmeticError, match="enough"):
        run(note)
    return times


def stream_top(progress):
    list(kr.stream(TOP, 1e9, "strang", step=1e-2, every=1, chunk=7, progress=progress))


def solve_energy(progress):
    kr.solve(TOP, 1e5, "strang", step=1e-2, every=1, want=("energy",), progress=progress)


def solve_top(progress):
    kr.solve(TOP, 1e9, "rk4", step=1e-3, progress=progress)


@pytest.mark.parametrize("run, end", [(solve_top, 1e9), (stream_top, 1e9), (solve_energy, 1e5)])
def test_progress_is_reported_with_short_chunks(run, end):
    first, second, third = make_third_call_raise(run)
    assert 0 <= first < second < third < end  # `first` may be 0 on a slow machine


def test_progress_works_in_any_thread_and_must_not_advance_the_run():
    failures = []

    def work():
        run = kr.start(TOP, "rk4", step=1e-3)
        try:
            run.to(1e9, progress=lambda t: run.to(2e9))
        except RuntimeError as error:
            failures.append(str(error))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join(60)
    assert failures == [
        "this run is under way: another thread leads it, or a call that has not yet returned"
    ]


def test_exceptions_in_progress_are_not_kept_alive():
    class Big:
        pass

    def once():
        run, big = kr.start(TOP, "rk4", step=1e-3), Big()

        def stop(t):
            raise ValueError(f"enough of {big}")

        with pytest.raises(ValueError, match="enough"):
            run.to(1e9, progress=stop)
        return weakref.ref(big)

    big = once()
    gc.collect()
    assert big() is None


@pytest.mark.parametrize(
    "run",
    [
        lambda progress: kr.solve(TOP, 3.0, progress=progress),
        lambda progress: kr.solve(TOP, [1.0, 3.0], progress=progress, want=("energy",)),
        lambda progress: kr.solve(
            TOP, np.linspace(0, 3, 40000), progress=progress, want=("energy",)
        ),
        lambda progress: kr.solve(TOP, 3.0, progress=progress, events=[kr.events.nutation()]),
        lambda progress: kr.solve(TOP, 3.0, "geometric", error=1e-3, progress=progress),
        lambda progress: kr.start(TOP).to(3.0, progress=progress),
        lambda progress: list(kr.stream(TOP, [1.0, 2.0, 3.0], chunk=1, progress=progress)),
    ],
)
def test_progress_ends_with_the_final_time(run):
    times = []
    run(times.append)
    assert times[-1] == 3.0 and times == sorted(times)


def test_a_refused_call_does_not_change_the_time():
    run, times = kr.start(TOP, "rk4", step=1e-3), []

    def note(t):
        with pytest.raises(RuntimeError, match="under way"):
            run.to(2e9)
        times.append(run.t)
        if len(times) == 2:
            raise ArithmeticError

    with pytest.raises(ArithmeticError):
        run.to(1e9, progress=note)
    assert times == [0.0, 0.0] and run.t > 0.0


# Ctrl-C and other signals


@pytest.mark.parametrize("pieces", [1, 2, 4])
def test_ctrl_c_between_two_chunks_keeps_the_path(monkeypatch, pieces):
    record, sizes = kr.start(TOP)._record_path.__func__, []

    def record_or_stop(self, times, progress):
        if len(sizes) == pieces:
            raise KeyboardInterrupt
        sizes.append(len(times))
        return record(self, times, progress)

    monkeypatch.setattr(kr.Run, "_record_path", record_or_stop)
    times = np.linspace(0, 10, 100_000)
    with pytest.raises(kr.Interrupted) as interruption:
        kr.solve(TOP, times, want=("energy",))
    path = interruption.value.path
    assert len(path) == sum(sizes) == len(path.energy) and path.want == ("energy",)
    assert np.array_equal(path.t, times[: len(path)])


STOPS = {
    "fixed": 'kr.solve(top, 1e8, "rk4", step=1e-3, progress=send)',
    "adaptive": "kr.solve(top, 1e8, tol=1e-12, progress=send)",
    "detours": 'kr.solve(top, np.arange(0, 4e5) * 0.1005, "strang", step=1e-3, progress=send)',
    "digits": "kr.solve(top, 1e9, digits=30, progress=send)",
    "dense": "kr.solve(top, np.linspace(0, 10, 10_000_000), progress=send)",
    "implicit": 'kr.solve(top, 1e9, "implicit_midpoint", step=0.01, progress=send)',
    "geometric": 'kr.solve(kr.scenes.thesis, 1e6, "geometric", error=1e-3, progress=send)',
    "exact": "kr.solve(kr.scenes.thesis, np.linspace(0, 10, 10_000_000), progress=send)",
    "wanted": 'kr.solve(top, np.linspace(0, 1e8, 10_000_000), want=("energy",), progress=send)',
    "stream": 'list(kr.stream(top, math.inf, "strang", step=.01, every=200, progress=send))',
    "between": "send(0), replace(kr.solve(top, [1], 'strang', step=1e-3), states=far)([3, 1e8])",
    "by itself": 'kr.solve(top, 1e9, "rk4", step=1e-3, progress=stop)',
}
INTERRUPTED = """
import math, numpy as np, os, signal, sys, threading, kreisel as kr
from dataclasses import replace
top = kr.scenes.asymmetric
far = np.array([[1e8, 1, 0, 0, 0, 0, 0, 1.0]])
def stop(t):
    raise KeyboardInterrupt
def kill():
    os.kill(os.getpid(), signal.SIGINT)
def send(t, timers=[]):
    if not timers:
        timers.append(threading.Timer(0.02, kill))
        timers[0].start()
try:
    eval(sys.argv[1])
except kr.Interrupted as stopped:
    assert isinstance(stopped, KeyboardInterrupt) and stopped.status == "ERR_INTERRUPTED"
    print(len(stopped.path.t), stopped.path.t[-1])
"""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs signals")
@pytest.mark.parametrize("kind", STOPS)
def test_ctrl_c_stops_every_long_call(kind):
    """Check that SIGINT interrupts calls that would otherwise run for a very long time."""
    result = python(INTERRUPTED, STOPS[kind])
    assert result.returncode == 0 and result.stdout, result.stderr
    states, end = map(float, result.stdout.split())
    assert states >= 1 and end >= 0
    assert kind not in ("fixed", "adaptive", "detours") or (states >= 2 and end > 0)


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs a timer with a signal")
def test_other_signals_raise_the_exception_of_their_handler():
    def handler(*_):
        raise TimeoutError("enough")

    before = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, 0.1)
    try:
        with pytest.raises(TimeoutError, match="enough"):
            kr.solve(GENERAL, 1e8, "rk4", step=1e-3)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


# Boundary values


@pytest.mark.parametrize("words", [{"tangents": "start"}, {"events": [kr.events.nutation()]}])
def test_a_top_refused_by_the_core_takes_no_step(words, monkeypatch):
    for verb in run, variational:
        monkeypatch.setattr(verb, "start_top", lambda *_: ("ERR_NOT_FINITE", None))
    with pytest.raises(kr.Error) as error:
        kr.solve(TOP, [1.0], **words)
    assert tuple(error.value.path.stats) == (0, 0, 0, 0) and len(error.value.path) == 1


def test_ctrl_c_while_quantities_are_computed_loses_nothing(monkeypatch):
    real, calls = kr.Path.only, []

    def only(path, want):
        if not calls:
            calls.append(path)
            raise KeyboardInterrupt
        return real(path, want)

    monkeypatch.setattr(kr.Path, "only", only)
    with pytest.raises(kr.Interrupted) as interruption:
        list(kr.stream(TOP, [1.0, 2.0], want=["energy", "q_low"]))  # Python computes q_low
    assert (
        len(interruption.value.path.energy) == 2 and interruption.value.status == "ERR_INTERRUPTED"
    )
