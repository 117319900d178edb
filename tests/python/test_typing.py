"""Tests that static type checkers accept correct code and reject misspelt names."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import kreisel as kr
import pytest
from internals import RECORDABLE
from toolbox import ROOT, run

SCRIPTS = ROOT / "tests/python/typed"
TOOLS = Path(sys.executable).parent


def by_mypy(script, folder):
    """Return the line numbers at which mypy reports an error."""
    words = ["--strict", "--no-incremental", "--hide-error-context", str(script)]
    done = subprocess.run(
        [TOOLS / "mypy", "--config-file=", *words],
        env=os.environ | {"MYPYPATH": str(ROOT / "python")},
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert done.returncode in (0, 1), done.stdout + done.stderr
    return {int(line) for line in re.findall(r"^[^:]+:(\d+): error", done.stdout, re.M)}


def by_pyright(script, folder):
    """Return the line numbers at which pyright reports an error in strict mode."""
    how = {
        "typeCheckingMode": "strict",
        "extraPaths": [str(ROOT / "python")],
        "include": [str(script)],
    }
    (folder / "pyrightconfig.json").write_text(json.dumps(how))
    words = ["--project", folder, "--pythonpath", sys.executable, "--outputjson"]
    done = subprocess.run([TOOLS / "basedpyright", *words], capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stdout + done.stderr
    told = json.loads(done.stdout)["generalDiagnostics"]
    return {said["range"]["start"]["line"] + 1 for said in told if said["severity"] == "error"}


CHECKERS = pytest.mark.parametrize("checker", [by_mypy, by_pyright])


@CHECKERS
def test_a_correct_script_has_no_type_errors(checker, tmp_path):
    assert checker(SCRIPTS / "right.py", tmp_path) == set()


@CHECKERS
def test_misspelt_names_are_type_errors(checker, tmp_path):
    script = SCRIPTS / "wrong.py"
    lines = enumerate(script.read_text().splitlines(), 1)
    expected = {number for number, line in lines if line.endswith("# wrong")}
    assert len(expected) > 20 and checker(script, tmp_path) == expected


def test_a_right_script_runs():
    run(sys.executable, SCRIPTS / "right.py")


def test_type_checkers_know_the_names_of_the_core():
    known = set(get_args(kr.MethodName))
    assert known - {"gsl_rk8pd", "gsl_bsimp"} <= {"auto", *kr.methods} <= known
    assert list(get_args(kr.QuantityName)) == ["t", *RECORDABLE]


def test_literal_types_agree_with_the_tables():
    written = (ROOT / "python/kreisel/_utils/quantity_attributes.py").read_text()
    assert run(ROOT / ".ci/names") == written, (
        "write it: .ci/names >python/kreisel/_utils/quantity_attributes.py"
    )
