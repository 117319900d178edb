"""Progress is told, and Ctrl-C stops whatever runs; how soon, validation/bench/running.py measures."""

import signal
import subprocess
import sys
import threading

import kreisel as kr
import pytest

TOP = kr.scenes.asymmetric


def test_progress_is_told():
    told = []
    with pytest.raises(ArithmeticError, match="enough"):

        def tell(t):
            told.append(t)
            if len(told) == 3:
                raise ArithmeticError("enough")

        kr.solve(TOP, 1e9, "rk4", step=1e-3, progress=tell)
    assert 0 < told[0] < told[1] < told[2] < 1e9


@pytest.mark.parametrize(
    "run",
    [
        lambda tell: list(
            kr.stream(TOP, 1e6, "strang", step=1e-2, every=1, chunk=7, progress=tell)
        ),
        lambda tell: kr.solve(
            TOP, 1e5, "strang", step=1e-2, every=1, want=("energy",), progress=tell
        ),
    ],
    ids=["stream", "want"],
)
def test_progress_is_told_however_short_the_pieces(run):
    told = []

    def tell(t):
        told.append(t)
        if len(told) == 3:
            raise ArithmeticError("enough")

    with pytest.raises(ArithmeticError, match="enough"):
        run(tell)
    assert 0 < told[0] < told[1] < told[2] < 1e6


def test_progress_is_told_in_any_thread_and_may_not_lead_on():
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
    assert failures == ["this run is under way: one thread at a time, one call in another"]


STOPS = {
    "digits": "kr.solve(top, 1e9, digits=30, progress=send)",
    "dense": "kr.solve(top, np.linspace(0, 10, 30_000_000), progress=send)",
    "implicit": 'kr.solve(top, 1e9, "implicit_midpoint", step=0.01, progress=send)',
    "geometric": 'kr.solve(kr.scenes.thesis, 1e6, "geometric", error=1e-3, progress=send)',
    "exact": "kr.solve(kr.scenes.thesis, np.linspace(0, 10, 30_000_000), progress=send)",
    "wanted": 'kr.solve(top, np.linspace(0, 1e8, 10_000_000), want=("energy",), progress=send)',
    "stream": 'list(kr.stream(top, math.inf, "strang", step=.01, every=200, progress=send))',
    "by itself": 'kr.solve(top, 1e9, "rk4", step=1e-3, progress=stop)',
}
INTERRUPTED = """
import math, numpy as np, os, signal, sys, threading, time, kreisel as kr
top = kr.scenes.asymmetric
def stop(t):
    raise KeyboardInterrupt
def kill():
    sys.stderr.write(f"{time.perf_counter()}\\n")
    os.kill(os.getpid(), signal.SIGINT)
def send(t, timers=[]):
    if not timers:
        timers.append(threading.Timer(0.02, kill))
        timers[0].start()
try:
    eval(sys.argv[1])
except kr.Interrupted as stopped:
    print(time.perf_counter(), len(stopped.path.t), stopped.path.t[-1])
"""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs signals")
@pytest.mark.parametrize("kind", STOPS)
def test_ctrl_c_stops_everything_that_runs(kind):
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, STOPS[kind]],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0 and done.stdout, done.stderr
    _, states, reached = map(float, done.stdout.split())
    assert states >= 1 and reached >= 0
