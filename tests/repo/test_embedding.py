"""Tests that the examples of two pages of the site work without any other source files.

The expected numbers were computed with SciPy: the nutation integrals by quadrature, and states by
DOP853 from Euler angles or Newton's law.
"""

import os
import re
import shutil
import sys

import numpy as np
import pytest
from toolbox import (
    FAST_CC,
    ROOT,
    first_process,
    install_library,
    need,
    need_cargo,
    run,
)

PAGES = ("embedding", "gyroscopic_term")
PAGE = "\n".join((ROOT / f"docs/{name}.md").read_text() for name in PAGES)
INCLUDED = re.compile(
    r"^```\{literalinclude\} \.\./(examples/\S+)\n(?::\w+: .*\n)*?:caption: (\S+)\n```$", re.M
)
EXAMPLES = ROOT / "examples"
COMMANDS = re.compile(r"^```sh\n(.*?)^```$", re.M | re.S)
SECTIONS = {
    head: text
    for head, _, text in (part.partition("\n") for part in re.split("^## ", PAGE, flags=re.M)[1:])
}
BEGINNING = "The source and an installed library"
HELLO = r"t = 1\.0 s: tilt 1\.1152110\d+ rad"
GAME = r"end: t = 3\.000, tilt 1\.04(79|80|81).+"
# The last line of the output of each section with commands, and the tools that the section needs.
LAST_LINES = {
    "One file": (HELLO, ["cc", "python3"]),
    "CMake: an installed library": (HELLO, ["cmake", "cc"]),
    "CMake: the source as a subdirectory": (GAME, ["cmake", "cc"]),
    "CMake: FetchContent": (GAME, ["cmake", "cc"]),
    "pkg-config": (HELLO, ["make", "pkg-config", "cc"]),
    "C++": ("caught: there is no step: .+", ["c++"]),
    "Rust": ("refused: there is no step: .+", ["cc"]),
    "Python's ctypes": ("refused: a time lies before the previous one .+", ["python3"]),
    "Microcontrollers": (r"success, \d+ bytes of memory", ["make", "cc", "python3"]),
    "A step in C": ("the attitude error is within the level of 0.1 rad", ["cc"]),
    "A step in C++": (r"error after 10 s: 1\.\de-03 rad", ["c++"]),
    "A step in Rust": (r"error after 10 s: 1\.6e-8 rad", ["cc", "ar"]),
    "A step in JavaScript": (r"error after 10 s: 1\.6e-8 rad", ["node"]),
    "Errors and costs": (r"order 4, double .+ 1\.6e-08 rad", ["cc"]),
}


def write_files(folder):
    """Copy the source files shown on the pages to `folder`."""
    for source, name in INCLUDED.findall(PAGE):
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text((ROOT / source).read_text())


@pytest.fixture(scope="module")
def prefix():
    """Return the folder into which the commands in docs/embedding.md install the library.

    The commands find most of their work done, because other tests build in the same folder.
    """
    need("cmake", "cc")
    install_library()
    folder = ROOT / "build"
    prefix = folder / "prefix-embedding"
    variables, commands = COMMANDS.findall(SECTIONS[BEGINNING])
    assert re.findall(r"^export (\w+)=", variables, re.M) == ["KREISEL", "PREFIX"]
    with first_process(prefix.name) as is_first, first_process("kreisel-build"):
        if is_first:
            shutil.rmtree(prefix, ignore_errors=True)
            run("sh", "-ec", commands, cwd=folder, KREISEL=str(ROOT), PREFIX=str(prefix))
    return prefix


@pytest.mark.parametrize("section", LAST_LINES)
def test_the_commands_of_a_section_work_with_the_files_of_the_page(section, prefix, tmp_path):
    last_line, tools = LAST_LINES[section]
    need(*tools)
    if "Rust" in section:
        need_cargo()
    if "JavaScript" in section:
        pytest.importorskip("ziglang")
    write_files(tmp_path)
    commands = "\n".join(COMMANDS.findall(SECTIONS[section]))
    environment = {"KREISEL": str(ROOT), "PREFIX": str(prefix), "CARGO_NET_OFFLINE": "true"}
    environment |= {"MAKELEVEL": "0", "MAKEFLAGS": ""}  # those of `make test` change the output
    # A compiler that compiles small code fast. ccache would call it again, but for the first PATH.
    (tmp_path / "bin").mkdir()
    path, options = os.environ["PATH"], "-O0 -DKR_ONE_ISA -DKR_SMALL"
    (tmp_path / "bin/cc").write_text(f'#!/bin/sh\nPATH="{path}" exec {FAST_CC} "$@" {options}\n')
    for name, module in {"zig": "ziglang", "kreisel": "kreisel"}.items():
        text = f'#!/bin/sh\nexec {sys.executable} -m {module} "$@"\n'
        (tmp_path / f"bin/{name}").write_text(text)
    for file in (tmp_path / "bin").iterdir():
        file.chmod(0o755)
    environment["PATH"] = f"{tmp_path}/bin:{path}"
    output = run("sh", "-ec", commands, cwd=tmp_path, **environment)
    assert re.fullmatch(last_line, output.splitlines()[-1]), output


def build_example(name, tmp_path, *linking, folder=EXAMPLES):
    """Compile a C example with the installed library, and return the path of the program."""
    need("cmake", "gcc")
    prefix = install_library()
    warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
    library = [f"-I{prefix}/include", folder / f"{name}.c", prefix / "lib/libkreisel.a"]
    words = [*library, "-lm", "-pthread", *linking, "-o", tmp_path / name]
    run("gcc", "-std=c99", "-O1", *warnings, *words)
    return tmp_path / name


def find_numbers(pattern, text):
    """Return a row of numbers for each match of `pattern`, in which # stands for a number."""
    rows = re.findall(pattern.replace("#", r"([-+.\de]+)"), text, re.M)
    assert rows, text
    return np.array(rows, dtype=float).reshape(len(rows), -1)


def compute_largest_tilt(tilt):
    """Return the largest tilt of the Lagrange top of the examples, released with its spin alone."""
    ratio = (314.159 * 6.25e-4) ** 2 / (4 * 7.5125e-3 * 0.5 * 9.81 * 0.12)
    return np.arccos(ratio - np.sqrt(ratio * ratio - 2 * ratio * np.cos(tilt) + 1))


PERIOD, LARGEST = 0.26188563373112, 1.27668866729303  # of the nutation
OUTPUTS = {  # of programs: a pattern, the numbers in its matches, and the tolerance
    "events": [
        ("^lowest at t = #: tilt #$", [(PERIOD * (i + 0.5), LARGEST) for i in range(8)], 2e-11)
    ],
    "exact": [
        ("^tilt: # to #$", [(np.pi / 3, LARGEST)], 2e-12),
        ("^period: #\nprecession: #$", [(PERIOD, 3.10538649399)], 1e-11),
        ("^t = 86400: tilt #$", [(1.04724223,)], 1e-8),
    ],
    "checkpoint": [("t = 5.0: m = # # #", [(0.29995562, -0.00314363, 0.2)], 1e-8)],
}


@pytest.mark.parametrize("name", OUTPUTS)
def test_a_program_prints_the_motion_of_its_top(name, tmp_path):
    words = [tmp_path / "top"] if name == "checkpoint" else []
    output = run(build_example(name, tmp_path), *words)
    for pattern, truth, tolerance in OUTPUTS[name]:
        np.testing.assert_allclose(find_numbers(pattern, output), truth, rtol=0, atol=tolerance)
    if name == "checkpoint":
        assert "\nbitwise equal\n" in output and "damaged: the checkpoint is damaged" in output


def test_the_example_at_the_beginning_of_the_header_shows_the_nutation(tmp_path):
    header = (ROOT / "csrc/kreisel.h").read_text().partition(" * The functions")[0]
    lines = "\n".join(re.findall(r"^ \*     (.*)$", header, re.M))
    head = "#include <kreisel.h>\n#include <stdio.h>\nint main(void)\n{\n"
    (tmp_path / "header.c").write_text(f"{head}{lines}\n    return 0;\n}}\n")
    output = run(build_example("header", tmp_path, folder=tmp_path))
    tilts = find_numbers("^ *#  #$", output)[:, 1]
    ratio = (0.3 * 10.0) ** 2 / (4 * 1.3)
    largest = np.arccos(ratio - np.sqrt(ratio * ratio - 2 * ratio * np.cos(0.5) + 1))
    assert len(tilts) == 100 and tilts.min() > 0.5 and largest - 0.01 < tilts.max() < largest


def test_an_ensemble_does_not_depend_on_its_threads(tmp_path):
    program = build_example("ensemble", tmp_path)
    output = run(program, "1")
    assert run(program, "7") == output and "\n0 of 1000 tops failed\n" in output
    starts, largest = find_numbers("start #, largest tilt #", output).T
    np.testing.assert_allclose(largest, compute_largest_tilt(starts), rtol=1e-4)  # of samples


def test_the_loop_of_the_game_allocates_nothing(tmp_path):
    linking = [f"-Wl,--wrap={name}" for name in ("malloc", "calloc", "realloc")]
    program = build_example("game_loop", tmp_path, ROOT / "tests/repo/allocations.c", *linking)
    for frames in ("0", "3000"):
        assert run(program, frames).endswith("allocations: 100\n")


def test_a_microcontroller_needs_the_functions_on_the_page(tmp_path):
    pytest.importorskip("ziglang")
    need("clang", "make", "nm")
    run(sys.executable, ROOT / "cmake/amalgamate.py", tmp_path)
    folder = shutil.copytree(EXAMPLES / "bare", tmp_path / "bare")
    tools = ["CC=clang -target thumbv7em-none-eabihf", f"LD={sys.executable} -m ziglang ld.lld"]
    # The code of -Os, without optimization, compiles fastest.
    fast = "-O0 -D__OPTIMIZE_SIZE__ -Wall -Wextra -Wpedantic -Werror"
    words = [f"KREISEL={tmp_path}", *tools, "TARGET=", f"INCLUDE=-Iinclude {fast}"]
    names = set(re.findall(r"\bU (\w+)", run("make", "-s", *words, "needs", cwd=folder)))
    compiler = {name for name in names if name.startswith("__aeabi_")}
    rows = [line for line in SECTIONS["Microcontrollers"].splitlines() if line.startswith("| ")]
    assert compiler and names - compiler == {*re.findall(r"`(\w+)`", "\n".join(rows))}
    assert "kr_method_taylor" not in run("nm", folder / "image.o")


def test_every_section_with_commands_is_tested():
    with_commands = {name for name, text in SECTIONS.items() if COMMANDS.search(text)}
    assert with_commands == {BEGINNING, *LAST_LINES}


def test_the_pages_show_every_example():
    sources = {source for source, _ in INCLUDED.findall(PAGE)}
    files = {
        f"examples/{file.relative_to(EXAMPLES)}"
        for file in EXAMPLES.rglob("*")
        if file.is_file() and not {"include", "target", "engines"} & {*file.parts}
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
