"""Tests of the public API against the results in snapshot.txt.

Each line of snapshot.txt contains an expression and its value. Run `python
tests/python/test_snapshot.py` to update the file after an intended change.
"""

from functools import cache
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest

FILE = Path(__file__).with_name("snapshot.txt")
LINES = [line.rsplit(" = ", 1) for line in FILE.read_text().splitlines()]


@cache
def names():
    """Return the variables that the expressions in snapshot.txt can use, by name."""
    cone = kr.Body.cone(0.3, 1.2, (0, 0, -0.9), mass=0.5)
    thesis = kr.scenes.thesis
    tops = thesis.vary(spin=[1.0, 2.0, 3.0], tilt=[[0.2], [0.4]])
    reductions = ("min", "max", "mean", "variance", "last", "where_min", "where_max")
    return {
        "kr": kr,
        "np": np,
        "TOP": kr.scenes.asymmetric,
        "THESIS": thesis,
        "FREE": kr.scenes.dzhanibekov,
        "KOWALEWSKI": kr.scenes.kowalewski,
        "CONE": cone,
        "PLATE": kr.Body.cuboid((0.5, 0.8, 0.1), (0.1, 0.2, -0.3), density=2.0),
        "TOPS": tops,
        "NEAR": kr.scenes.asymmetric.scatter(3, seed=1, momentum=0.1),
        "REDUCED": kr.reduce(tops, np.linspace(0, 2, 9), {"nutation": reductions}),
        "LOW": kr.events.nutation(direction=1),
        "SWAY": kr.solve(kr.scenes.cusps, np.linspace(0.0, 20.0, 201)),
    }


def value_of(expression):
    """Evaluate an expression, and format its value with six significant digits."""
    value = eval(expression, names())
    return value if isinstance(value, str) else f"{float(value):.6g}"


@pytest.mark.parametrize(("expression", "value"), LINES, ids=[line[0] for line in LINES])
def test_an_expression_has_the_value_of_the_snapshot(expression, value):
    assert value_of(expression) == value


if __name__ == "__main__":
    FILE.write_text("".join(f"{line[0]} = {value_of(line[0])}\n" for line in LINES))
