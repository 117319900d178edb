"""Tests of the examples in the package's docstrings."""

import doctest
import importlib
import pkgutil

import kreisel as kr
import numpy as np
import pytest

MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(kr.__path__, "kreisel.")
    if not module.name.endswith(("._core", ".__main__"))
)


def examples(name):
    """Return the doctest examples of a module, including those of private objects."""
    module = importlib.import_module(name)
    tests = doctest.DocTestFinder().find(module, globs={"kr": kr, "np": np})
    return [test for test in tests if test.examples]


def list_failures(tests):
    """Run doctest examples, and return the messages of those that fail."""
    messages = []
    for test in tests:
        doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(
            test, out=messages.append
        )
    return messages


@pytest.mark.parametrize("name", ["kreisel", *MODULES])
def test_examples_print_the_documented_output(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    messages = list_failures(examples(name))
    assert messages == [], "".join(messages)


def test_the_main_functions_have_examples():
    names_with_examples = {test.name for name in ["kreisel", *MODULES] for test in examples(name)}
    for function in (kr.solve, kr.plan, kr.compare, kr.rod, kr.attitude_error, kr.stream):
        assert f"{function.__module__}.{function.__qualname__}" in names_with_examples, function


def test_a_wrong_example_is_detected():
    right, wrong = (
        doctest.DocTestParser().get_doctest(f">>> [1,  2]\n{text}\n", {}, "example", None, None)
        for text in ("[1,   2]", "[1, 3]")
    )
    assert list_failures([right]) == []
    [message] = list_failures([right, wrong])
    assert "Expected:\n    [1, 3]" in message
