"""The programs of validation/bench: each can be asked what it measures."""

import importlib

import pytest
from toolbox import ROOT

FOLDER = ROOT / "validation/bench"
PROGRAMS = sorted(file.stem for file in FOLDER.glob("*.py") if "__main__" in file.read_text())


def test_programs_are_found():
    assert {"exact", "geometric", "kernels", "running", "steps", "taylor"} <= set(PROGRAMS)


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_says_what_it_measures(name, capsys):
    if name == "page":
        pytest.importorskip("playwright")
    program = importlib.import_module(f"validation.bench.{name}")
    with pytest.raises(SystemExit) as done:
        program.main(["--help"])
    said = capsys.readouterr().out
    assert done.value.code == 0 and f"python -m validation.bench.{name}" in said
    assert program.__doc__.split()[0] in said
