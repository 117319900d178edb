"""Counts of the Python function calls that a public function of the package makes.

    python -m validation.benchmarks.calls_profile [CASE ...]

The program also counts the source files in which the called functions are defined. Each public
function is called a few times as a warm-up. Calls of functions in NumPy, the standard library and
the C extension are not counted. Function calls on other threads are not counted.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from types import FrameType
from typing import Any

import kreisel as kr
import numpy as np

PACKAGE = str(Path(kr.__file__).parent)
WARM_RUNS = 3
TIMES = np.linspace(0.0, 10.0, 11)
REDUCTIONS = {"nutation": ("min", "max")}


def solve_scene() -> object:
    """Solve the equations of motion of one top for a single time."""
    return kr.solve(kr.scenes.thesis, [1.0])


def plan_scene() -> object:
    """Plan the integration of an asymmetric top."""
    return kr.plan(kr.scenes.asymmetric)


def reduce_ensemble() -> Callable[[], object]:
    """Return a function that computes summary statistics of 100 tops that differ in gravity."""
    tops = kr.scenes.asymmetric.vary(gravity=np.linspace(0.5, 1.0, 100))
    return lambda: kr.reduce(tops, TIMES, REDUCTIONS)


def solve_ensemble() -> Callable[[], object]:
    """Return a function that solves the equations of motion of 100 tops that differ in gravity."""
    tops = kr.scenes.asymmetric.vary(gravity=np.linspace(0.5, 1.0, 100))
    return lambda: kr.solve(tops, TIMES)


def sweep_part() -> object:
    """Run a small sweep and read one column of its result."""
    spin, tilt = np.linspace(0, 20, 10), np.linspace(0.1, 1, 10)
    source = kr.Source.grid(kr.scenes.sleeping, spin=spin, tilt=tilt)
    with tempfile.TemporaryDirectory() as folder:
        result = kr.sweep(source, TIMES, folder=folder, reduce={"nutation": "max"})
        return result["nutation_max"]


CASES: dict[str, Callable[[], Callable[[], object]]] = {
    "solve(scene, [1.0])": lambda: solve_scene,
    "plan(scene)": lambda: plan_scene,
    "solve(ensemble)": solve_ensemble,
    "reduce(ensemble)": reduce_ensemble,
    "sweep of one part, one column": lambda: sweep_part,
}


@contextmanager
def record_calls() -> Iterator[list[str]]:
    """Record the source file of each Python function called within the package."""
    files: list[str] = []

    def note(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(PACKAGE):
            files.append(frame.f_code.co_filename)

    sys.setprofile(note)
    try:
        yield files
    finally:
        sys.setprofile(None)


def count_calls(run: Callable[[], object]) -> tuple[int, int, int]:
    """Count the function calls, the source files visited, and the returns to earlier files."""
    for _ in range(WARM_RUNS):
        run()
    with record_calls() as files:
        run()
    visits = [file for file, _ in groupby(files)]
    return len(files), len(set(files)), len(visits) - len(set(files))


def main(words: list[str] | None = None) -> None:
    """Print the number of function calls of each benchmark."""
    parser = argparse.ArgumentParser(
        prog="python -m validation.benchmarks.calls_profile",
        description=__doc__.splitlines()[0],
    )
    parser.add_argument("cases", nargs="*", choices=[*CASES, []], help="which cases; default: all")
    names = parser.parse_args(words).cases or list(CASES)
    print(f"{'':<32}{'calls':>7}{'files':>7}{'returns':>9}")
    for name in names:
        calls, files, returns = count_calls(CASES[name]())
        print(f"{name:<32}{calls:>7}{files:>7}{returns:>9}")


if __name__ == "__main__":
    main()
