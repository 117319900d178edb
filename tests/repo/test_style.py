"""Tests that clang-format and ruff report no problems."""

import subprocess
import sys
from pathlib import Path

from toolbox import ROOT, run

TOOLS = Path(sys.executable).parent
PYTHON = ["python", "validation", "tests", "docs", "examples", "cmake", ".ci/names", ".ci/wheel.py"]


def sources(*endings):
    """Return the source files that git tracks or does not ignore."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "--", *endings]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [ROOT / name for name in names.splitlines() if (ROOT / name).is_file()]


def test_clang_format_reports_nothing():
    files = sources("*.c", "*.h", "*.cpp", "*.hpp")
    assert len(files) > 100
    run(TOOLS / "clang-format", "--dry-run", "--Werror", *files)


def test_ruff_reports_nothing():
    run(TOOLS / "ruff", "format", "--check", *PYTHON)
    run(TOOLS / "ruff", "check", *PYTHON)
