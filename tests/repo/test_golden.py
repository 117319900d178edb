"""A test of the installed library against the hashes in tests/c/kernels.txt.

The C test `golden` compares those of algebraic methods and closed forms on a torus.
"""

from toolbox import CSRC, ROOT, install_library, need, run


def test_every_instruction_set_gives_the_bits_of_its_sums(tmp_path):
    """Compare the output of tests/c/kernels.c with tests/c/kernels.txt.

    The script .ci/processors makes the same comparison on other processors, which are emulated.
    """
    need("cmake", "gcc")
    golden = (ROOT / "tests/c/kernels.txt").read_text().splitlines()
    library, program = install_library() / "lib/libkreisel.a", tmp_path / "kernels"
    words = ["-std=c99", "-ffp-contract=off", f"-I{CSRC}", ROOT / "tests/c/kernels.c"]
    run("gcc", *words, library, "-lm", "-o", program)
    lines = [line.split(maxsplit=1) for line in run(program).splitlines()]
    for name in {isa for isa, _ in lines}:
        own = [line for isa, line in lines if isa == name]
        assert own == [line for line in golden if line.split()[0] == own[0].split()[0]], name
    assert {line.split()[0] for _, line in lines} <= {"fused", "apart"} and len(lines) >= 55
