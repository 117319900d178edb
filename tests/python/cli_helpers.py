"""The command `kreisel` of the installed distribution, run within the process of the tests."""

import csv
import re
import subprocess
import sys
from importlib.metadata import entry_points

import numpy as np
from click.testing import CliRunner
from toolbox import HANG, HEEDING

[KREISEL] = {entry.load() for entry in entry_points(group="console_scripts", name="kreisel")}


def invoke(words, text=None, **options):
    """Run the command with these words and this standard input, and return the result of click."""
    return CliRunner().invoke(KREISEL, [str(word) for word in words], input=text, **options)


def call(line, *more, code=0, text=None):
    """Run a command line that ends with this exit code, and return its output and its errors."""
    result = invoke([*line.split(), *more], text)
    assert result.exit_code == code and (code == 0 or result.exc_info[0] is SystemExit), (
        result.output
    )
    return result.output


# A process that runs the command and heeds Ctrl-C, even in the background.
PROGRAM = f"{HEEDING}import runpy\nrunpy.run_module('kreisel', run_name='__main__')"
PLAN = """
t = [1.0, 4.0]
part_size = 64
max_steps = 14
scene = "asymmetric"
[reduce]
nutation = ["min", "max"]
[grid]
spin = { from = 0, to = 9, n = 12 }
gravity = { from = -1, to = 1, n = 25 }
"""


def start_process(line, program=PROGRAM, **options):
    """Start a command in a separate process."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
    return subprocess.Popen([sys.executable, "-c", program, *line.split()], **options)


def run_process(line, **options):
    """Run a command in a separate process; return its exit code, its output and its errors."""
    with start_process(line, **options) as run:
        output, errors = run.communicate(timeout=HANG)
    assert "Traceback" not in errors and "Exception ignored" not in errors
    return run.returncode, output, errors


def read_csv(text):
    """Return the columns of a CSV file as arrays by their heads."""
    head, *rows = csv.reader(text.splitlines())
    columns = zip(*rows, strict=True) if rows else [()] * len(head)
    return {
        name: np.array(column, str if name == "event" else float)
        for name, column in zip(head, columns, strict=True)
    }


def make_raiser(error):
    """Return a function that raises `error`, whatever its arguments."""

    def raise_error(*_, **__):
        raise error

    return raise_error


def join_lines(text):
    return re.sub(r"\s+", " ", text)
