"""Tests of the single-file library written by cmake/amalgamate.py.

The script .ci/test also runs the C tests against the single-file library.
"""

import importlib.util
import re
import sys
from collections import defaultdict

import pytest
from toolbox import CSRC, ROOT, need, run

WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
TESTS = ROOT / "tests/c"
# The code for small sizes, without optimization, takes the least time to compile.
ZIG = [sys.executable, "-m", "ziglang", "cc", "-O0", "-DKR_SMALL", "-DKR_NO_BATCHES"]


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("amalgamate", ROOT / "cmake/amalgamate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    directory = tmp_path_factory.mktemp("amalgamation")
    run(sys.executable, ROOT / "cmake/amalgamate.py", directory)
    return directory


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


# All compilers run in the folder of kreisel.c, so that ccache finds earlier object files.
def compile_by_gcc(folder, file):
    """Compile kreisel.c by the command in docs/embedding.md.

    The CMake option KREISEL_AMALGAMATED runs an identical compiler command for kreisel.c, so that
    ccache compiles the file only once.
    """
    run("cc", "-O2", "-std=c99", "-c", "kreisel.c", cwd=folder)
    return folder / "kreisel.o"


def compile_by_clang(folder, file):
    run("clang", "-O2", "-std=gnu17", *WARNINGS, "-c", "kreisel.c", "-o", file, cwd=folder)
    return file


def compile_one_isa(folder, file):
    options = ["-std=c99", "-O0", "-DKR_ONE_ISA"]
    run("gcc", *options, "-c", "kreisel.c", "-o", file, cwd=folder)
    return file


def compile_plain(folder, file):
    options = ["-std=c99", "-O1", "-DKR_PLAIN", "-DKR_SMALL", *WARNINGS]
    run("gcc", *options, "-c", "kreisel.c", "-o", file, cwd=folder)
    return file


@pytest.mark.parametrize(
    "compile_file", [compile_by_gcc, compile_by_clang, compile_one_isa, compile_plain]
)
def test_the_file_gives_the_same_bits_as_the_library(folder, tmp_path, compile_file):
    """Compare the outputs of three test programs with the results stored in tests/c."""
    need("cc", "clang", "gcc")
    library = compile_file(folder, tmp_path / "kreisel.o")
    for name in ("golden", "snapshot"):
        assert output(name, library, tmp_path) == (TESTS / f"{name}.txt").read_text()
    golden = (TESTS / "kernels.txt").read_text().splitlines()
    kernels = kernels_of(output("kernels", library, tmp_path))
    for isa, lines in kernels.items():
        assert len(lines) >= 55, isa
        assert lines == [li for li in golden if li.split()[0] == lines[0].split()[0]], isa
    is_one = compile_file in (compile_one_isa, compile_plain)
    assert (len(kernels) == 1) == (is_one or "avx2" not in kernels)


@pytest.mark.parametrize(
    "target",
    [
        "x86_64-linux-gnu",
        "x86_64-windows-gnu",
        "aarch64-linux-gnu",
        "aarch64-macos",
        "wasm32-wasi",
        "thumb-linux-musleabihf",
        "arm-linux-musleabihf",
        "riscv64-linux-gnu",
    ],
)
def test_zig_compiles_the_file_without_warning(folder, tmp_path, target):
    flags = ["-target", target, "-std=c99", *WARNINGS]
    if target != "x86_64-windows-gnu":  # the other targets get one instruction set
        flags.append("-DKR_ONE_ISA")
    run(*ZIG, *flags, "-c", folder / "kreisel.c", "-o", tmp_path / "kreisel.o")


def test_the_header_is_the_public_header(folder):
    assert (folder / "kreisel.h").read_bytes() == (CSRC / "kreisel.h").read_bytes()


def test_make_works_without_an_environment():
    command = run("make", "--dry-run", "--no-print-directory", "amalgamation")
    assert command == "python3 cmake/amalgamate.py\n"
    run("make", "amalgamation")
    assert (ROOT / "build/amalgamation/kreisel.c").is_file()


def test_no_two_files_define_the_same_name(script):
    """Check that no two files define the same name, because kreisel.c contains all files."""
    plain, _ = script.read_units()
    files = {file for file, _ in plain.parts if file and file.suffix != ".def"}
    assert len(files) > 60
    owners = defaultdict(set)
    for file in files:
        text = re.sub(r"^#.*?(?<!\\)$", "", file.read_text(), flags=re.M | re.S)
        for item in script.split_items(text):
            is_declaration = re.fullmatch(r"(typedef )?struct [^{]*;\n", item)
            if script.is_static(item) or (script.is_type(item) and not is_declaration):
                for name in script.names_of(item) - {"NAME"}:  # a macro that forms names
                    owners[name].add(file.relative_to(CSRC).as_posix())
    assert {"time_since_start", "dd", "KR_TAYLOR_MAX"} <= owners.keys()
    assert {name: paths for name, paths in owners.items() if len(paths) > 1} == {}


def test_every_section_enables_the_features_of_its_instruction_set(script, folder):
    text = (folder / "kreisel.c").read_text()
    sets = script.instruction_sets()
    assert sets.keys() == {"base", "avx2", "avx512"} and sets["base"] == []
    for isa, features in sets.items():
        assert text.count(f"#define KR_ISA {isa}\n") >= 11
        assert not features or f'GCC target("{",".join(features)}")' in text


def test_options_of_single_files_agree_with_the_build(folder):
    """Check that compiler options in CMakeLists.txt agree with the pragmas in kreisel.c."""
    options = re.findall(r"COMPILE_OPTIONS -f([\w-]+)\)", (ROOT / "CMakeLists.txt").read_text())
    assert options == ["tree-vectorize"]
    text = (folder / "kreisel.c").read_text()
    assert text.count('#  pragma GCC optimize("tree-vectorize")\n') == 3
