"""Tests of the C library against stored results in tests/c.

golden.txt contains hashes of the states of algebraic methods and of closed forms on a torus.
kernels.txt contains hashes of results with and without fused multiply-add. The script
.ci/golden updates golden.txt.
"""

import pytest
from toolbox import CSRC, ROOT, compile_objects, core_sources, install_library, need, run

PROGRAM = ROOT / "tests/c/golden.c"
FLAGS = ["-std=c99", "-ffp-contract=off", f"-I{CSRC}"]


@pytest.fixture
def golden():
    return (ROOT / "tests/c/golden.txt").read_text()


def test_clang_gives_the_golden_bits(golden, tmp_path):
    """Optimize all that golden.c runs. The other functions only have to be linked."""
    need("clang")
    sources = [*core_sources(), PROGRAM]
    idle = [file for file in sources if file.parent.name in ("taylor", "ensemble", "events")]
    objects = []
    for option, files in ("-O0", idle), ("-O2", [file for file in sources if file not in idle]):
        folder = tmp_path / option
        folder.mkdir()
        objects += compile_objects("clang", [option, "-DKR_SMALL", *FLAGS], files, folder)
    run("clang", *objects, "-lm", "-o", tmp_path / "golden")
    assert run(tmp_path / "golden") == golden


def run_with_library(program, file):
    """Link a program with the installed library, run it, and return its output."""
    need("cmake", "gcc")
    run("gcc", *FLAGS, program, install_library() / "lib/libkreisel.a", "-lm", "-o", file)
    return run(file)


def test_the_installed_library_gives_the_golden_bits(golden, tmp_path):
    assert run_with_library(PROGRAM, tmp_path / "golden") == golden


def test_every_instruction_set_gives_the_bits_of_its_sums(tmp_path):
    """Compare the output of tests/c/kernels.c with tests/c/kernels.txt.

    Expected outputs with and without fused multiply-add are stored in kernels.txt. The script
    .ci/processors makes the same comparison on other processors, which are emulated.
    """
    golden = (ROOT / "tests/c/kernels.txt").read_text().splitlines()
    output = run_with_library(ROOT / "tests/c/kernels.c", tmp_path / "kernels")
    lines = [line.split(maxsplit=1) for line in output.splitlines()]
    for name in {isa for isa, _ in lines}:
        own = [line for isa, line in lines if isa == name]
        assert own == [line for line in golden if line.split()[0] == own[0].split()[0]], name
    assert {line.split()[0] for _, line in lines} <= {"fused", "apart"} and len(lines) >= 55
