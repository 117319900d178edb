"""Tests of the single-file library written by cmake/amalgamate.py."""

import re
from collections import defaultdict
from pathlib import Path

import pytest
from toolbox import CSRC, ROOT, need, run

WARNINGS = "-Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror"
TESTS = ROOT / "tests/c"


@pytest.fixture(scope="module")
def folder():
    """Return the folder of the file, which `make` writes without an environment."""
    command = run("make", "--dry-run", "--no-print-directory", "amalgamation")
    assert command == "python3 cmake/amalgamate.py\n"
    run("make", "amalgamation")
    return ROOT / "build/amalgamation"


def output(program, library, folder):
    """Link a program of tests/c with `library`, run it, and return its output."""
    flags = ["-std=c99", "-ffp-contract=off", f"-I{CSRC}"]
    run("gcc", *flags, TESTS / f"{program}.c", library, "-lm", "-o", folder / program)
    return run(folder / program)


def kernels_of(text):
    """Return the lines of `text`, grouped by the instruction set that their first word names."""
    kernels = defaultdict(list)
    for line in text.splitlines():
        isa, bits = line.split(maxsplit=1)
        kernels[isa].append(bits)
    return kernels


# The passes of -O2 by which gcc, in gnu99, fuses products and sums unless the file forbids it.
FUSING = "-O1 -fexpensive-optimizations -ftree-vectorize -ftree-slp-vectorize"
COMMANDS = {
    "cc": f"cc {FUSING} -std=gnu99 -DKR_SMALL",
    "clang": f"clang -O0 -std=gnu17 -DKR_SMALL {WARNINGS}",
    "plain": f"gcc -O0 -std=c99 -DKR_PLAIN -DKR_SMALL {WARNINGS}",
}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_file_gives_the_same_bits_as_the_library(folder, tmp_path, name):
    """Compare the outputs of two test programs with the results stored in tests/c."""
    need("cc", "clang", "gcc")
    library = folder / "kreisel.o"
    text = (folder / "kreisel.c").read_text()
    if name == "cc":  # compile AVX-512 only once, by the faster compiler
        text = re.sub("^# *define KR_WITH_AVX512\n", "", text, flags=re.M)
    (folder / f"{name}.c").write_text(text)
    # ccache finds earlier object files if compilers run in the folder of the file.
    run(*COMMANDS[name].split(), "-c", f"{name}.c", "-o", "kreisel.o", cwd=folder)
    assert output("golden", library, tmp_path) == (TESTS / "golden.txt").read_text()
    golden = (TESTS / "kernels.txt").read_text().splitlines()
    kernels = kernels_of(output("kernels", library, tmp_path))
    for isa, lines in kernels.items():
        assert len(lines) >= 55, isa
        assert lines == [li for li in golden if li.split()[0] == lines[0].split()[0]], isa
    assert (len(kernels) == 1) == (name == "plain" or "avx2" not in kernels)


@pytest.mark.parametrize(
    ("target", "headers"),
    [("x86_64-w64-mingw32", "any-windows-any"), ("arm64-apple-macos11", "any-darwin-any")],
)
def test_the_file_is_c99_for_other_systems(folder, target, headers):
    """Check the file with the headers of another system, which zig contains."""
    ziglang = pytest.importorskip("ziglang")
    need("clang")
    include = Path(ziglang.__file__).parent / "lib/libc/include" / headers
    words = ["-target", target, "-std=c99", *WARNINGS.split(), "-fsyntax-only", "-isystem", include]
    run("clang", *words, folder / "kreisel.c")
