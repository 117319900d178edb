"""Tests that the examples in docs/embedding.md work without any other source files."""

import os
import re
import shutil

import pytest
from toolbox import ROOT, VERSION, first_process, need, need_cargo, run, write_fast_compiler

PAGE = (ROOT / "docs/embedding.md").read_text()
INCLUDED = re.compile(
    r"^```\{literalinclude\} \.\./(examples/\S+)\n(?::\w+: .*\n)*?:caption: (\S+)\n```$", re.M
)
COMMANDS = re.compile(r"^```sh\n(.*?)^```$", re.M | re.S)
SECTIONS = {
    head: text
    for head, _, text in (part.partition("\n") for part in re.split("^## ", PAGE, flags=re.M)[1:])
}
BEGINNING = "The source and an installed library"
# The last line of the output of each section with commands, and the tools that the section needs.
LAST_LINES = {
    "One file": (r"t = 1\.0 s: tilt 1\.115\d+ rad", ["cc", "python3"]),
    "CMake: an installed library": (r"t = 1\.0 s: tilt 1\.115\d+ rad", ["cmake", "cc"]),
    "CMake: the source as a subdirectory": (r"end: t = 3\.000, tilt .+", ["cmake", "cc"]),
    "CMake: FetchContent": (r"end: t = 3\.000, tilt .+", ["cmake", "cc"]),
    "pkg-config": (r"t = 1\.0 s: tilt 1\.115\d+ rad", ["make", "pkg-config", "cc"]),
    "C++": ("caught: there is no step: .+", ["c++"]),
    "Rust": ("refused: there is no step: .+", ["cc"]),
    "Python's ctypes": ("refused: a time lies before the previous one .+", ["python3"]),
    "Microcontrollers": (r"success, \d+ bytes of memory", ["make", "cc", "python3"]),
}


def write_files(folder):
    """Copy the source files shown in docs/embedding.md to `folder`."""
    for source, name in INCLUDED.findall(PAGE):
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text((ROOT / source).read_text())


@pytest.fixture(scope="module")
def prefix():
    """Return the folder into which the commands in docs/embedding.md install the library.

    The commands run in the folder `build`, so that ccache can reuse the object files of other
    builds.
    """
    need("cmake", "cc")
    folder = ROOT / "build"
    prefix = folder / "prefix-embedding"
    variables, commands = COMMANDS.findall(SECTIONS[BEGINNING])
    assert re.findall(r"^export (\w+)=", variables, re.M) == ["KREISEL", "PREFIX"]
    with first_process(prefix.name) as is_first:
        if is_first:
            shutil.rmtree(prefix, ignore_errors=True)
            run("sh", "-ec", commands, cwd=folder, KREISEL=str(ROOT), PREFIX=str(prefix))
    return prefix


@pytest.mark.parametrize("section", LAST_LINES)
def test_the_commands_of_a_section_work_with_the_files_of_the_page(section, prefix, tmp_path):
    last_line, tools = LAST_LINES[section]
    need(*tools)
    if section == "Rust":
        need_cargo()
    write_files(tmp_path)
    commands = "\n".join(COMMANDS.findall(SECTIONS[section]))
    environment = {"KREISEL": str(ROOT), "PREFIX": str(prefix), "CARGO_NET_OFFLINE": "true"}
    environment |= {"MAKELEVEL": "0", "MAKEFLAGS": ""}  # those of `make test` change the output
    if section == "Microcontrollers":  # compiles the library with the program
        (tmp_path / "bin").mkdir()
        compiler = write_fast_compiler(tmp_path / "bin")
        environment["PATH"] = f"{compiler.parent}:{os.environ['PATH']}"
    output = run("sh", "-ec", commands, cwd=tmp_path, **environment)
    assert re.fullmatch(last_line, output.splitlines()[-1]), output


def test_every_section_with_commands_is_tested():
    with_commands = {name for name, text in SECTIONS.items() if COMMANDS.search(text)}
    assert with_commands == {BEGINNING, *LAST_LINES}


def test_the_page_shows_every_example():
    sources = {source for source, _ in INCLUDED.findall(PAGE)}
    examples = ROOT / "examples"
    files = {
        f"examples/{file.relative_to(examples)}"
        for file in examples.rglob("*")
        if file.is_file() and "include" not in file.parts and "target" not in file.parts
    }
    assert files - {"examples/rust/Cargo.lock"} == sources
    assert PAGE.count("{literalinclude}") == len(INCLUDED.findall(PAGE))


def test_the_table_names_the_options_of_cmake():
    options = re.findall(
        r"^(?:option|set)\((KREISEL_(?:METHODS|ISA|DIGITS|TANGENTS|SUPPORTS))\b",
        (ROOT / "CMakeLists.txt").read_text(),
        re.M,
    )
    names = re.findall(r"^\| `(KREISEL_\w+)`", SECTIONS["Build options"], re.M)
    assert names == options and len(options) == 5


def test_the_example_requests_this_version():
    match = re.search(
        r"find_package\(kreisel (\S+) ", (ROOT / "examples/find_package/CMakeLists.txt").read_text()
    )
    assert match[1] == VERSION.rpartition(".")[0]
