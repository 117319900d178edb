"""Tests that type checkers accept the package and correct programs, but reject misspelt names."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from toolbox import ROOT, run

SCRIPTS = ROOT / "tests/python/typed"
FILES = [SCRIPTS / name for name in ("right.py", "wrong.py")]  # without errors, and with errors
TOOLS = Path(sys.executable).parent


def by_mypy(_):
    """Return the file names and line numbers of all type errors that mypy reports."""
    words = ["--strict", "--hide-error-context", "python/kreisel", *FILES]
    result = subprocess.run([TOOLS / "mypy", *words], cwd=ROOT, capture_output=True, text=True)
    print(result.stdout)
    assert result.returncode in (0, 1), result.stderr
    errors = re.findall(r"^([^:]+):(\d+): error", result.stdout, re.M)
    return {(Path(file).name, int(line)) for file, line in errors}


def by_pyright(folder):
    """Return the name and line number of each place where pyright reports an error."""
    settings = {
        "typeCheckingMode": "strict",
        "extraPaths": [str(ROOT / "python")],
        "include": [str(file) for file in FILES],
    }
    (folder / "pyrightconfig.json").write_text(json.dumps(settings))
    words = ["--project", folder, "--pythonpath", sys.executable, "--outputjson"]
    result = subprocess.run([TOOLS / "basedpyright", *words], capture_output=True, text=True)
    assert result.returncode in (0, 1), result.stdout + result.stderr
    messages = json.loads(result.stdout)["generalDiagnostics"]
    return {
        (Path(message["file"]).name, message["range"]["start"]["line"] + 1)
        for message in messages
        if message["severity"] == "error"
    }


@pytest.mark.parametrize("checker", [by_mypy, by_pyright])
def test_misspelt_names_are_the_only_type_errors(checker, tmp_path):
    """Run each type checker only once, because it spends most of its time on the package."""
    lines = enumerate((SCRIPTS / "wrong.py").read_text().splitlines(), 1)
    expected = {("wrong.py", number) for number, line in lines if line.endswith("# wrong")}
    assert len(expected) > 20 and checker(tmp_path) == expected


def test_a_right_script_runs():
    run(sys.executable, SCRIPTS / "right.py")


def test_literal_types_agree_with_the_tables():
    text = (ROOT / "python/kreisel/_utils/quantity_attributes.py").read_text()
    assert run(ROOT / ".ci/names") == text, (
        "write it: .ci/names >python/kreisel/_utils/quantity_attributes.py"
    )
