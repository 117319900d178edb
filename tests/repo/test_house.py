"""Tests of the symbols, warnings, version and texts of the C library and the repository."""

import re
import subprocess

import pytest
from toolbox import CSRC, ROOT, VERSION, core_sources, install_library, need, run

WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]


@pytest.fixture(scope="module")
def static_library():
    need("cmake", "gcc", "nm")
    return install_library() / "lib/libkreisel.a"


def list_symbols(library, *options):
    """Return the name and the section that nm prints for each symbol of a library."""
    lines = run("nm", "-f", "sysv", *options, library).splitlines()
    rows = [line.split("|") for line in lines if "|" in line]
    return {(row[0].strip(), row[6].strip()) for row in rows}


def test_the_libraries_define_the_names_of_the_public_header(static_library):
    header = re.sub(r"/\*.*?\*/", "", (CSRC / "kreisel.h").read_text(), flags=re.DOTALL)
    methods = re.search(r"extern KR_API const kr_method ([^;]*);", header)[1]
    public = {*re.findall(r"\b(kr_\w+)\(", header), *re.findall(r"\w+", methods)}
    shared = list_symbols(static_library.with_name("libkreisel.so"), "-D", "--defined-only")
    assert {name for name, _ in shared} == public and len(public) > 20
    static = list_symbols(static_library, "-g", "--defined-only")
    assert [name for name, _ in static if not name.startswith("kr_")] == []


def test_the_library_has_no_global_state_does_not_print_and_rarely_allocates(static_library):
    writable = re.compile(r"\.t?(data|bss)(?!\.rel\.ro)")  # tables of pointers are in .data.rel.ro
    defined = list_symbols(static_library, "--defined-only")
    assert [name for name, section in defined if writable.match(section)] == []
    forbidden = {"abort", "exit", "__assert_fail", "stderr", "stdout", "printf", "fprintf", "puts"}
    used = {name for name, _ in list_symbols(static_library, "-u")}
    assert used & (forbidden | {"malloc", "realloc"}) == set()
    text = "".join(file.read_text() for file in core_sources())
    assert len(re.findall(r"\bcalloc\(", text)) == 2


def test_the_sources_of_the_viewer_compile_without_warnings():
    """Check wasm.c. The C tests check all other files."""
    need("gcc")
    options = ["-std=c99", "-O2", "-Wmissing-prototypes", *WARNINGS, f"-I{CSRC}"]
    run("gcc", *options, "-c", CSRC / "viewer/wasm.c", "-o", "/dev/null")


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("language", [("c", "c99"), ("c++", "c++17")], ids=["c99", "c++17"])
def test_the_headers_have_no_warnings_and_define_no_foreign_macros(compiler, language, tmp_path):
    need(compiler)
    file = tmp_path / "user.c"
    file.write_text(
        "#define X 3\n#include <kreisel.h>\n#include <kreisel_step.h>\n"
        "int main(void) { return X - KR_VERSION_MINOR - 2; }\n"
    )
    words = [f"-x{language[0]}", f"-std={language[1]}", "-fsyntax-only", f"-I{CSRC}", file]
    run(compiler, *WARNINGS, "-Wdouble-promotion", *words)


def test_versions_agree():
    assert f"\nversion: {VERSION}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"version = {{{VERSION}}}," in (ROOT / "docs/citing.md").read_text()
    assert re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)[1] == VERSION


def test_files_contain_no_machine_paths():
    pattern = r"(?<![\w.])/(work|root|home|Users)/|pypi\.org|python[h]osted|npm[j]s"
    command = ["git", "grep", "-nIP", pattern]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 1, result.stdout + result.stderr
