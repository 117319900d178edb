"""The examples in the package's docstrings print what they state."""

import doctest
import importlib
import pkgutil

import kreisel as kr
import numpy as np
import pytest

MODULES = [
    module.name
    for module in pkgutil.walk_packages(kr.__path__, "kreisel.")
    if not module.name.endswith(("._core", ".__main__"))
]
PARTS = sorted({".".join(name.split(".")[:2]) for name in MODULES})


def find_examples(part):
    """Return the doctest examples of the modules in a part of the package."""
    names = [name for name in MODULES if f"{name}.".startswith(f"{part}.")]
    find = doctest.DocTestFinder().find
    tests = [find(importlib.import_module(name), globs={"kr": kr, "np": np}) for name in names]
    return [test for several in tests for test in several if test.examples]


@pytest.mark.parametrize("part", ["kreisel", *PARTS])
def test_examples_print_the_documented_output(part, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    messages = []
    examples = doctest.DocTestFinder().find(kr) if part == "kreisel" else find_examples(part)
    for test in examples:
        runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
        runner.run(test, out=messages.append)
    assert messages == [], "".join(messages)
