"""The algebraic methods end in the same bits whichever compiler built them, however it optimized.

tests/core/golden.txt is what tests/core/golden.c printed when the results were last meant to
change.
"""

import pytest
from toolbox import CSRC, ROOT, compiled, core_sources, installed, need, run


def hashes(compiler, optimization, to):
    sources = [*core_sources(), ROOT / "tests/core/golden.c"]
    flags = ["-std=c99", optimization, "-ffp-contract=off", f"-I{CSRC}"]
    run(compiler, *compiled(compiler, flags, sources, to.parent), "-lm", "-o", to)
    return run(to)


@pytest.mark.parametrize("optimization", ["-O0", "-O3"])
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_every_compiler_gives_the_golden_bits(compiler, optimization, tmp_path):
    need(compiler)
    golden = (ROOT / "tests/core/golden.txt").read_text()
    assert hashes(compiler, optimization, tmp_path / "golden") == golden


def test_every_instruction_set_gives_the_bits_of_its_sums(tmp_path):
    """tests/core/kernels.txt is what tests/core/kernels.c printed, without the names of instruction
    sets, for one with fused products and for one without. Other processors: .ci/processors."""
    need("gcc")
    golden = (ROOT / "tests/core/kernels.txt").read_text().splitlines()
    library = installed() / "lib/libkreisel.a"
    flags = ["-std=c99", f"-I{CSRC}", ROOT / "tests/core/kernels.c", library]
    run("gcc", *flags, "-lm", "-o", tmp_path / "kernels")
    lines = [line.split(maxsplit=1) for line in run(tmp_path / "kernels").splitlines()]
    for name in {isa for isa, _ in lines}:
        own = [line for isa, line in lines if isa == name]
        assert own == [line for line in golden if line.split()[0] == own[0].split()[0]], name
    assert {line.split()[0] for _, line in lines} <= {"fused", "apart"} and len(lines) >= 55
