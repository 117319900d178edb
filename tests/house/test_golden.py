"""The algebraic methods end in the same bits whichever compiler built them, however it optimized.

tests/core/golden.txt is what tests/core/golden.c printed when the results were last meant to
change.
"""

import pytest
from toolbox import CSRC, ROOT, compiled, core_sources, installed, need, run

PROGRAM = ROOT / "tests/core/golden.c"
FLAGS = ["-std=c99", "-ffp-contract=off", f"-I{CSRC}"]


@pytest.fixture
def golden():
    return (ROOT / "tests/core/golden.txt").read_text()


@pytest.mark.parametrize(("compiler", "optimization"), [("gcc", "-O0"), ("clang", "-O3")])
def test_every_compiler_gives_the_golden_bits(golden, compiler, optimization, tmp_path):
    need(compiler)
    objects = compiled(compiler, [optimization, *FLAGS], [*core_sources(), PROGRAM], tmp_path)
    run(compiler, *objects, "-lm", "-o", tmp_path / "golden")
    assert run(tmp_path / "golden") == golden


def test_the_library_as_it_is_installed_gives_the_golden_bits(golden, tmp_path):
    need("cmake", "gcc")
    library = installed() / "lib/libkreisel.a"
    run("gcc", *FLAGS, PROGRAM, library, "-lm", "-o", tmp_path / "golden")
    assert run(tmp_path / "golden") == golden
