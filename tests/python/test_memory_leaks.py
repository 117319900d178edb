"""Tests that repeated calls do not leak memory.

If the environment variable KREISEL_CALLS is 1000, each call is repeated 1000 times.
"""

import copy
import gc
import os
import pickle
import sys
from functools import partial
from itertools import count, islice
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest

CALLS = int(os.environ.get("KREISEL_CALLS", 150))
GROWTH = 100  # blocks that caches may add once; a leak adds a block for each call
TOP, SYMMETRIC = kr.scenes.asymmetric, kr.scenes.thesis
TIMES = [0.0, 0.5, 1.0]


def list_calls(folder):
    """Return calls of public functions, some of which raise an expected exception."""
    return constructor_calls() | run_calls(folder) | attribute_calls() | error_calls()


def constructor_calls():
    body = SYMMETRIC.body
    tensor = [[3.0, 0.1, 0.0], [0.1, 2.5, 0.0], [0.0, 0.0, 2.0]]
    return {
        "Body": partial(kr.Body, 1.0, tensor, (0.1, 0.2, 0.3)),
        "Body.cuboid": partial(kr.Body.cuboid, half=(0.8, 0.8, 1.0), pivot=(0, 0, -1)),
        "Scene": partial(kr.Scene, body, momentum=(1, 2, 3), gravity=1),
        "Scene.replace": partial(TOP.replace, gravity=0.5),
        "exact": partial(kr.exact, SYMMETRIC),
        "exact, states": lambda: kr.exact(SYMMETRIC)(TIMES),
        "exact of many": lambda: kr.exact([SYMMETRIC, SYMMETRIC])(1.0),
        "plan": partial(kr.plan, TOP, want=("energy",)),
        "events": partial(kr.events.plane, (1, 2, 3), 0.1),
        "pickle": lambda: pickle.loads(pickle.dumps(TOP)),
        "copy": partial(copy.deepcopy, SYMMETRIC),
    }


def run_calls(folder):
    run = kr.start(TOP, "strang", step=0.01)
    run.to(1.0)
    checkpoint = run.checkpoint
    methods = {
        f"solve, {name}": partial(kr.solve, SYMMETRIC, TIMES, name, step=default_step(method))
        for name, method in kr.methods.items()
        if method.suits(SYMMETRIC)
    }
    return methods | {
        "solve, digits": partial(kr.solve, TOP, TIMES, digits=30),
        "solve, want": partial(kr.solve, TOP, TIMES, want=("energy", "nutation")),
        "solve, events": partial(kr.solve, TOP, 3.0, events=[kr.events.nutation()]),
        "solve, progress": partial(kr.solve, TOP, TIMES, progress=lambda t: None),
        "start": partial(kr.start, TOP, "strang", step=0.01),
        "resume": partial(kr.resume, checkpoint),
        "copy of a run": partial(copy.copy, run),
        "checkpoint": lambda: run.checkpoint,
        "save": partial(run.save, folder / "run"),
        "to_toml": partial(TOP.to_toml, folder / "top.toml"),
        "from_toml": lambda: (
            TOP.to_toml(folder / "own.toml"),
            kr.Scene.from_toml(folder / "own.toml"),
        ),
        "stream": lambda: list(islice(kr.stream(TOP, (0.01 * k for k in count()), chunk=5), 3)),
        "view": lambda: kr.view(SYMMETRIC, open=False),
    }


def default_step(method):
    return None if method.adaptive or method.name == "exact" else 0.01


def solve_for(name):
    if name.startswith(("tangents", "conditioning")):
        columns = ("start", "moments", "com", "gravity", "mass")
        return kr.solve(SYMMETRIC, TIMES, "taylor", tangents=columns)
    return kr.solve(SYMMETRIC, TIMES)


def attribute_calls():
    path = kr.solve(SYMMETRIC, np.linspace(0, 5, 200))
    names = [name for name in dir(kr.Path) if not name.startswith("_")]
    return {
        f"path.{name}": lambda name=name: getattr(solve_for(name), name)
        for name in names
        if name not in ("plot", "error")
    } | {
        "apex": lambda: kr.apex(path),
        "rod": lambda: kr.rod(path),
        "copy of a path": partial(copy.deepcopy, path),
        "pickle of a path": lambda: pickle.loads(pickle.dumps(path)),
        "path.only": partial(path.only, ("energy",)),
        "attitude_error": partial(kr.attitude_error, path.q, path.q),
    }


def expect_error(exception, call, *args, **kwargs):
    """Return a function that makes a call and fails unless the call raises the exception."""

    def call_quietly():
        with pytest.raises(exception):
            call(*args, **kwargs)

    return call_quietly


def error_calls():
    def interrupt(_):
        raise KeyboardInterrupt

    return {
        "unknown method": expect_error(ValueError, kr.solve, TOP, 1.0, "none"),
        "unphysical body": expect_error(ValueError, kr.Body, 1.0, (1.0, 1.0, 3.0), (0, 0, 1)),
        "diverging step": expect_error(kr.Error, kr.solve, SYMMETRIC, [9.0], "rk4", step=4.0),
        "step limit": expect_error(kr.Error, kr.solve, TOP, 1e6, max_steps=10),
        "unknown quantity": expect_error(ValueError, kr.solve, TOP, 1.0, want=("none",)),
        "progress that raises": expect_error(
            KeyboardInterrupt, kr.solve, TOP, 1e4, progress=interrupt
        ),
        "no checkpoint": expect_error(ValueError, kr.resume, b"none"),
        "missing file": expect_error(FileNotFoundError, kr.Scene.from_toml, "/nowhere"),
    }


@pytest.fixture(scope="module", autouse=True)
def frozen():
    """Exclude the objects of other tests from garbage collection, which would otherwise be slow."""
    gc.collect()
    gc.freeze()


def measure_growth(call):
    """Return how many more memory blocks Python has allocated after repeated calls."""
    for _ in range(20):
        call()
    gc.collect()
    blocks = sys.getallocatedblocks()
    for _ in range(CALLS):
        call()
    gc.collect()
    return sys.getallocatedblocks() - blocks


@pytest.mark.parametrize("name", list_calls(Path("/nowhere")))
def test_a_call_leaves_nothing_behind(tmp_path, name):
    call = list_calls(tmp_path)[name]
    assert any(measure_growth(call) < GROWTH for _ in range(3))


def test_a_leak_is_seen():
    leak = []
    assert measure_growth(lambda: leak.append(object())) >= CALLS > GROWTH
