"""Tests that repeated calls do not leak memory.

If the environment variable KREISEL_CALLS is 1000, each call is repeated 1000 times.
"""

import copy
import gc
import os
import pickle
import sys
from itertools import count, islice

import kreisel as kr
import numpy as np
import pytest

CALLS = max(110, int(os.environ.get("KREISEL_CALLS", 0)))
GROWTH = 100  # blocks that caches may add once; a leak adds a block for each call
TOP, SYMMETRIC = kr.scenes.asymmetric, kr.scenes.thesis
TIMES = [0.0, 0.5, 1.0]
TENSOR = [[3.0, 0.1, 0.0], [0.1, 2.5, 0.0], [0.0, 0.0, 2.0]]
DATA = ("start", "moments", "com", "gravity", "mass")
PATH = kr.solve(SYMMETRIC, np.linspace(0, 5, 200))
NAMES = [name for name in dir(kr.Path) if name[0] != "_" and name not in ("plot", "error")]
RUN = kr.start(TOP, "strang", step=0.01)


def solve_by_method(name):
    method = kr.methods[name]
    step = None if method.adaptive or name == "exact" else 0.01
    return lambda _: kr.solve(SYMMETRIC, TIMES, name, step=step)


def read_attributes(_):
    path = kr.solve(SYMMETRIC, TIMES, "taylor", tangents=DATA)
    for name in NAMES:
        getattr(path, name)


def interrupt(_):
    raise KeyboardInterrupt


def refuse(error, call, *words, **more):
    """Return a function that makes a call and fails unless the call raises the exception."""

    def call_and_catch(_):
        with pytest.raises(error):
            call(*words, **more)

    return call_and_catch


CASES = {  # functions of a folder
    "Body": lambda _: kr.Body(1.0, TENSOR, (0.1, 0.2, 0.3)),
    "Body.cuboid": lambda _: kr.Body.cuboid(half=(0.8, 0.8, 1.0), pivot=(0, 0, -1)),
    "Scene": lambda _: kr.Scene(SYMMETRIC.body, momentum=(1, 2, 3), gravity=1).replace(gravity=2),
    "exact": lambda _: kr.exact([SYMMETRIC, SYMMETRIC])(1.0),
    "plan": lambda _: kr.plan(TOP, want=("energy",)),
    "events": lambda _: kr.solve(TOP, 3.0, events=[kr.events.plane((1, 2, 3), 0.1)]),
    "copies of a scene": lambda _: pickle.loads(pickle.dumps(copy.deepcopy(SYMMETRIC))),
    "copies of a path": lambda _: pickle.loads(pickle.dumps(copy.deepcopy(PATH))),
    "copies of a run": lambda _: kr.resume(copy.copy(RUN).checkpoint),
    "files": lambda folder: (RUN.save(folder / "run"), kr.resume(folder / "run")),
    "scenes in files": lambda folder: (TOP.to_toml(folder / "top"), kr.load(folder / "top")),
    "digits": lambda _: kr.solve(TOP, TIMES, digits=30),
    "want": lambda _: kr.solve(TOP, TIMES, want=("energy", "nutation"), progress=lambda t: None),
    "many tops": lambda _: kr.solve(TOP.vary(gravity=[1.0, 2.0, 3.0]), TIMES, threads=2),
    "run": lambda _: kr.start(TOP, "strang", step=0.01).to(0.1),
    "stream": lambda _: list(islice(kr.stream(TOP, (0.01 * k for k in count()), chunk=5), 3)),
    "view": lambda _: kr.view(SYMMETRIC, open=False),
    "attributes": read_attributes,
    "curves": lambda _: (kr.apex(PATH), kr.rod(PATH), PATH.only(("energy",))),
    "attitude_error": lambda _: kr.attitude_error(PATH.q, PATH.q),
    **{name: solve_by_method(name) for name, each in kr.methods.items() if each.suits(SYMMETRIC)},
    "unphysical body": refuse(ValueError, kr.Body, 1.0, (1.0, 1.0, 3.0), (0, 0, 1)),
    "diverging step": refuse(kr.Error, kr.solve, SYMMETRIC, [9.0], "rk4", step=4.0),
    "unknown quantity": refuse(ValueError, kr.solve, TOP, 1.0, want=("none",)),
    "progress": refuse(KeyboardInterrupt, kr.solve, TOP, 3.0, progress=interrupt),
    "no checkpoint": refuse(ValueError, kr.resume, b"none"),
}


def measure_growth(call, folder=None):
    """Return how many more memory blocks Python has allocated after repeated calls."""
    for _ in range(20):
        call(folder)
    gc.collect()
    blocks = sys.getallocatedblocks()
    for _ in range(CALLS):
        call(folder)
    gc.collect()
    return sys.getallocatedblocks() - blocks


@pytest.mark.parametrize("name", CASES)
def test_a_call_leaves_nothing_behind(tmp_path, name):
    assert any(measure_growth(CASES[name], tmp_path) < GROWTH for _ in range(3))


def test_a_leak_is_seen():
    leak = []
    assert measure_growth(lambda _: leak.append(object())) >= CALLS > GROWTH
