"""The command `kreisel` of the installed distribution, run within the process of the tests."""

import csv
import re
from importlib.metadata import entry_points

import numpy as np
from click.testing import CliRunner

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
