"""The tests of the report need what `pip install kreisel[report]` brings; without it they are left
out, which is said at the end, and fails where CI=true."""

import importlib.util
import os

import pytest

NEEDED = ("heyoka", "scipy", "mpmath", "matplotlib", "jinja2")
MISSING = [name for name in NEEDED if not importlib.util.find_spec(name)]
collect_ignore_glob = ["test_*.py"] if MISSING else []
if MISSING and os.environ.get("CI") == "true":
    raise pytest.UsageError(f"tests/report needs {', '.join(MISSING)}")


def pytest_terminal_summary(terminalreporter):
    if MISSING:
        terminalreporter.write_line(f"tests/report is left out: it needs {', '.join(MISSING)}")
