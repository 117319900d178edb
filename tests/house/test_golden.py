"""The algebraic methods end in the same bits whichever compiler built them, however it optimized.

tests/core/golden.txt is what tests/core/golden.c printed when the results were last meant to
change.
"""

import pytest
from toolbox import CSRC, ROOT, compiled, core_sources, need, run


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
