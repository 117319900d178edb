"""Tests of interrupted calls of kreisel.compare."""

import pickle

import kreisel as kr
import pytest
from toolbox import python

TOP = kr.scenes.asymmetric
WORDS = {"methods": ["rk4", "strang", "taylor"], "steps": [0.1, 0.05], "repeats": 2}


def test_a_comparison_reports_progress():
    reports = []
    table = kr.compare(TOP, 1.0, progress=reports.append, **WORDS)
    assert len(table) == 5 and reports == [pytest.approx(i / 10) for i in range(1, 11)]
    assert reports[-1] == 1.0
    with pytest.raises(TypeError, match="progress must be a function"):
        kr.compare(TOP, 1.0, progress=3, **WORDS)


@pytest.mark.parametrize("count", [1, 3, 5, 7])
def test_an_interrupted_comparison_keeps_its_rows(count):
    reports = []

    def stop(part):
        reports.append(part)
        if len(reports) == count:
            raise KeyboardInterrupt

    with pytest.raises(kr.CompareInterrupted) as interruption:
        kr.compare(TOP, 1.0, progress=stop, **WORDS)
    rows = min(count, 5)
    assert str(interruption.value) == f"interrupted: {rows} of 5 runs were completed"
    whole = kr.compare(TOP, 1.0, **WORDS)
    again = pickle.loads(pickle.dumps(interruption.value))
    for table in (interruption.value.table, again.table):
        assert len(table) == rows
        for row, full in zip(table, whole, strict=False):
            assert (row.method, row.step, row.steps) == (full.method, full.step, full.steps)
            assert row.attitude_error == full.attitude_error and row.seconds > 0
    assert isinstance(interruption.value, KeyboardInterrupt)


SEND = """
import os, signal, sys, threading
import kreisel as kr, numpy as np
from kreisel._cli import main
def send(*told):
    os.kill(os.getpid(), signal.SIGINT)
soon = threading.Timer(0.5, send)
"""


@pytest.mark.parametrize("truth, option", [("exact", "progress=send"), ("rk4", "")])
def test_ctrl_c_ends_a_comparison(truth, option):
    result = python(
        SEND
        + f"""
try:
    {"" if option else "soon.start()"}
    kr.compare(kr.scenes.thesis, 1e6, ["exact", "rk4"], steps=[1e-4], truth={truth!r}, {option})
except kr.CompareInterrupted as stopped:
    print([row.method for row in stopped.table])
"""
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip() == ("['exact']" if truth == "exact" else "[]")


def test_the_command_line_shows_finished_rows():
    words = ["compare", "thesis", "--t", "1e6", "--methods", "exact,rk4", "--steps", "1e-4"]
    code = f"""
sys.argv[1:] = {[*words, "--truth", "exact"]}
soon.start()
main()
"""
    result = python(SEND + code)
    assert result.returncode == 130, result.stderr
    assert "exact" in result.stdout and "rk4" not in result.stdout
    assert "interrupted: 1 of 2 runs" in result.stderr


def test_ctrl_c_in_a_closed_form_raises_keyboard_interrupt():
    result = python(
        SEND
        + """
times = np.linspace(0, 10, 3_000_000)
try:
    soon.start()
    while True:
        kr.exact(kr.scenes.thesis)(times)
except KeyboardInterrupt as stopped:
    print(type(stopped).__name__)
"""
    )
    assert (result.returncode, result.stdout) == (0, "KeyboardInterrupt\n"), result.stderr
