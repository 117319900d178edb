"""Tests of names, compiler warnings and global state in the code."""

import re

import pytest
from layers import c_includes
from toolbox import (
    CSRC,
    ROOT,
    VERSION,
    compile_objects,
    core_sources,
    install_library,
    need,
    run,
)

WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
SOURCES = sorted(file for file in CSRC.rglob("*") if file.suffix in {".c", ".h", ".def"})
PYTHON = sorted(
    file
    for folder in ("python", "tests", "validation", "docs", "examples")
    for file in (ROOT / folder).rglob("*.py")
    if "gallery" not in file.parts
)
BINDING = sorted((ROOT / "python").glob("*.[ch]pp"))
PAGE = sorted(
    file for file in (ROOT / "python/viewer").iterdir() if file.is_file() and file.suffix != ".py"
)
C = sorted(
    file
    for folder in ("csrc", "tests", "validation", "examples")
    for file in (ROOT / folder).rglob("*.[ch]")
)


def name(file):
    return file.relative_to(ROOT).as_posix()


def test_no_c_file_is_included():
    assert [
        name(file) for file in SOURCES if any(header.suffix == ".c" for header in c_includes(file))
    ] == []


def test_the_binding_includes_only_the_public_header():
    for file in BINDING:
        assert set(c_includes(file)) <= {CSRC / "kreisel.h", *BINDING}, name(file)


def symbols(library, *options):
    """Return the name, type and section that nm prints for each symbol of a library."""
    rows = [
        line.split("|")
        for line in run("nm", "-f", "sysv", *options, library).splitlines()
        if "|" in line
    ]
    return {(row[0].strip(), row[2].strip(), row[6].strip()) for row in rows}


@pytest.fixture(scope="module")
def static_library():
    need("cmake", "gcc", "nm")
    return install_library() / "lib/libkreisel.a"


def test_shared_library_exports_the_public_header(static_library):
    header = re.sub(r"/\*.*?\*/", "", (CSRC / "kreisel.h").read_text(), flags=re.DOTALL)
    methods = re.search(r"extern KR_API const kr_method ([^;]*);", header)[1]
    public = {*re.findall(r"\b(kr_\w+)\(", header), *re.findall(r"\w+", methods)}
    names = {
        symbol
        for symbol, _, _ in symbols(
            static_library.with_name("libkreisel.so"), "-D", "--defined-only"
        )
    }
    assert names == public and len(public) > 20


def test_exported_symbols_have_the_prefix(static_library):
    assert {
        s for s, _, _ in symbols(static_library, "-g", "--defined-only") if not s.startswith("kr_")
    } == set()


def test_no_global_state(static_library):
    writable = re.compile(r"\.t?(data|bss)(?!\.rel\.ro)")  # tables of pointers are in .data.rel.ro
    assert {
        s for s, _, section in symbols(static_library, "--defined-only") if writable.match(section)
    } == set()


def test_the_library_neither_prints_nor_aborts_and_rarely_allocates(static_library):
    names = {symbol for symbol, _, _ in symbols(static_library, "-u")}
    forbidden = {
        "abort",
        "exit",
        "__assert_fail",
        "stderr",
        "stdout",
        "printf",
        "fprintf",
        "puts",
        "malloc",
        "realloc",
    }
    assert names & forbidden == set()
    text = "".join(file.read_text() for file in core_sources())
    assert len(re.findall(r"\bcalloc\(", text)) == 2


STRICT = ["-std=c99", "-ffp-contract=off", "-Wmissing-prototypes", *WARNINGS, f"-I{CSRC}"]


def test_wasm_c_compiles_without_warnings(tmp_path):
    """Check that gcc compiles wasm.c without warnings.

    .ci/test compiles all other files in the same way.
    """
    need("gcc")
    compile_objects("gcc", ["-O2", *STRICT], [CSRC / "viewer/wasm.c"], tmp_path)


@pytest.mark.parametrize("word", [*WARNINGS[:-1], "-Wmissing-prototypes"])
def test_builds_enable_all_warnings(word):
    assert word in (ROOT / "CMakeLists.txt").read_text()


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("language", [("c", "c99"), ("c++", "c++17")], ids=["c99", "c++17"])
def test_the_header_has_no_warnings_and_defines_no_foreign_macros(compiler, language, tmp_path):
    need(compiler)
    file = tmp_path / "user.c"
    file.write_text(
        "#define X 3\n#include <kreisel.h>\nint main(void) { return X - KR_VERSION_MINOR - 2; }\n"
    )
    run(
        compiler,
        f"-x{language[0]}",
        f"-std={language[1]}",
        *WARNINGS,
        "-fsyntax-only",
        f"-I{CSRC}",
        file,
    )


def test_methods_def_agrees_with_the_files():
    text = (CSRC / "methods.def").read_text()
    gsl = "".join(re.findall(r"^#ifdef KREISEL_GSL\n(.*?)^#endif", text, re.DOTALL | re.MULTILINE))
    ids = re.findall(r"^X\((\w+)\)$", text, re.MULTILINE)
    of_gsl = re.findall(r"^X\((\w+)\)$", gsl, re.MULTILINE)
    own = [CSRC / "taylor/taylor.c", CSRC / "exact/exact.c", *CSRC.glob("methods/*.c")]
    assert len(ids) == len(set(ids)) and sorted(set(ids) - set(of_gsl)) == sorted(
        file.stem for file in own
    )
    for file in [*own, *CSRC.glob("gsl/*.c")]:
        defined = re.findall(
            r'^const kr_method kr_method_(\w+) = \{\s*\.name = "(\w+)"', file.read_text(), re.M
        )
        expected = of_gsl if file.parent.name == "gsl" else [file.stem]
        assert sorted(defined) == sorted((i, i) for i in expected), name(file)


def test_versions_agree():
    assert f"\nversion: {VERSION}\n" in (ROOT / "CITATION.cff").read_text()
    assert re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)[1] == VERSION


def test_files_contain_no_machine_paths():
    pattern = r"(?<![\w.])/(work|root|home|Users)/|pypi\.org|python[h]osted|npm[j]s"
    top = [
        file
        for file in ROOT.iterdir()
        if file.is_file()
        and file.name != ".git"
        and file.suffix in {"", ".txt", ".toml", ".md", ".cff"}
    ]
    files = [
        *SOURCES,
        *C,
        *PYTHON,
        *PAGE,
        *top,
        *(ROOT / ".ci").iterdir(),
        *(ROOT / "cmake").glob("*.*"),
    ]
    assert [name(file) for file in files if re.search(pattern, file.read_text())] == []
