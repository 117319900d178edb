"""Tests of the files of suite/ against kreisel's series, closed forms and proved enclosures."""

import csv
import json
import os
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import kreisel as kr
import numpy as np
import pytest
from kreisel._score.suite import load_cases

from suite import make

flint = pytest.importorskip("flint")

FOLDER = Path(make.__file__).parent
CASES = load_cases()
GROWTH = 12  # the column of numbers that are rounded to two digits
PROVED = os.environ.get("KREISEL_PROVE", "products rotor_driven coning").split()


def read(name):
    return json.loads((FOLDER / f"{name}.json").read_text())


@pytest.mark.parametrize("name", ["rotor_free", "impulses"])
def test_the_generator_writes_the_files(name):
    written, made = read(name), json.loads(json.dumps(make.make_document(CASES[name])))
    old, new = (np.delete(one.pop("states"), GROWTH, axis=1) for one in (written, made))
    np.testing.assert_allclose(new, old, rtol=1e-13, atol=1e-14)
    assert made == written


@pytest.mark.parametrize("name", CASES)
def test_the_states_are_those_of_kreisel_in_30_digits_and_in_doubles(name):
    """The states of the files come from decimal arithmetic, which shares no code with kreisel."""
    case, file = CASES[name], read(name)
    table = dict(zip(file["columns"], np.transpose(file["states"]), strict=True))
    assert (table["t"] == case.times).all()
    states = np.array(file["exact_states"], float)
    if name != "products":  # of which kreisel rounds the principal axes to doubles
        pieces = case.solve(case.times, digits=30)
        high, low = (np.concatenate([getattr(p, n) for p in pieces]) for n in ("q", "q_low"))
        pairs = zip(high.ravel().tolist(), low.ravel().tolist(), strict=True)
        ours = [Fraction(a) + Fraction(b) for a, b in pairs]
        true = [Fraction(x) for row in file["exact_states"] for x in row[:4]]
        gaps = np.array([float(a - b) for a, b in zip(ours, true, strict=True)]).reshape(-1, 4)
        gaps -= high * (high * gaps).sum(axis=1, keepdims=True)  # without changes of the norm
        assert abs(gaps).max() <= 1e-29 + sum(path.error for path in pieces)
    pieces, bound = case.solve(case.times), 100 * table["growth"].max()
    for first, quantity in (0, "q"), (4, "body_velocity"), (7, "m"):
        values = np.concatenate([getattr(path, quantity) for path in pieces])
        true = states[:, first : first + values.shape[1]]
        assert abs(values - true).max() <= bound * abs(true).max(), quantity


@pytest.mark.parametrize("name", PROVED)
def test_every_digit_is_proved(name):
    """KREISEL_PROVE has the names of cases; `long` takes minutes and 70 digits."""
    digits = 70 if name == "long" else 45
    balls = kr.enclose(CASES[name].scene, CASES[name].times, digits=digits)
    rows = zip(read(name)["exact_states"], balls.attitude, balls.momentum, strict=True)
    with flint.ctx.workprec(300):
        for row, q, m in rows:
            for text, ball in zip(row[:4] + row[7:], q + m, strict=True):
                unit = flint.arb(10) ** Decimal(text).as_tuple().exponent
                assert abs(flint.arb(text) - ball) < 0.51 * unit


@pytest.mark.parametrize("name", CASES)
def test_the_csv_files_have_the_states_and_no_errors(name):
    file, table = read(name), FOLDER / f"{name}.csv"
    head, *rows = csv.reader(table.read_text().splitlines())
    assert head == file["columns"] and [[*map(float, row)] for row in rows] == file["states"]
    score = kr.score(table, level="science")
    assert score.is_within and score.mistakes == ()
    for word in "velocity", "energy", "momentum", "direction":
        assert abs(getattr(score, f"{word}_error")) < 1e-12, word
