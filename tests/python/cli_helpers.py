"""The command `kreisel` of the installed distribution, run within the process of the tests."""

import re
from importlib.metadata import entry_points

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


def make_raiser(error):
    """Return a function that raises `error`, whatever its arguments."""

    def raise_error(*_, **__):
        raise error

    return raise_error


def join_lines(text):
    return re.sub(r"\s+", " ", text)


def record_console_calls(monkeypatch, *modules):
    """Replace the consoles of the given modules by stubs, and return a list of recorded calls."""
    calls = []

    class StubConsole:
        width = 80

        def __init__(self, **words):
            self.words = words

        def print(self, grid, crop=True):
            calls.append((self.words, grid))

    for module in modules:
        monkeypatch.setattr(module, "Console", StubConsole)
    return calls


def list_cells_by_column(grid):
    """Return a dictionary that maps the header of each column of a rich.Table to its cells."""
    return {str(column.header): list(column.cells) for column in grid.columns}
