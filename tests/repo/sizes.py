"""Measure the code that programs link: prints the table of the page on embedding.

python tests/repo/sizes.py FOLDER > docs/sizes.md      FOLDER keeps the builds

A size is what `size` reports as text and data of a program that links the static library with
--gc-sections, less the size of an empty program. The C library is shared, and does not count.
"""

import os
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

from toolbox import CSRC, ROOT, run

MOVING = """
#include <kreisel.h>
int main(void)
{
    const kr_scene scene = kr_scene_default();
    kr_config config = kr_config_default();
    kr_top *top = 0;
    config.step = 0.01;
    kr_status status = kr_top_create(&scene, &kr_method_%s, config, &top);
    if (status == KR_OK) status = kr_top_advance(top, 1.0);
    const kr_state end = kr_top_state(top);
    kr_top_free(top);
    return status != KR_OK || end.t != 1.0;
}
"""
CLOSED_FORM = """
#include <kreisel.h>
int main(void)
{
    const kr_scene scene = kr_scene_default();
    kr_exact exact;
    if (kr_exact_plan(&scene, &exact) != KR_OK) return 1;
    return kr_exact_state(&exact, 1.0).t != 1.0;
}
"""
EMPTY = "int main(void) { return 0; }\n"


def write_everything():
    """Return a program that refers to every function of the header."""
    header = re.sub(r"/\*.*?\*/", "", (CSRC / "kreisel.h").read_text(), flags=re.DOTALL)
    names = sorted(set(re.findall(r"\b(kr_\w+)\(", header)))
    table = ", ".join(f"(function)&{name}" for name in names)
    return (
        "#include <kreisel.h>\n"
        "typedef void (*function)(void);\n"
        f"extern const function functions[{len(names)}];\n"
        f"const function functions[{len(names)}] = {{{table}}};\n"
        "const function *volatile first = functions;\n"  # volatile: the compiler keeps the table
        "int main(void) { return first[0] == 0; }\n"
    )


EVERYTHING = write_everything()
# The rows of the table: label, program, build of the library, limit in kB at -Os on x86_64.
ROWS = (
    ("one splitting method, `kr_method_strang`", MOVING % "strang", "one", 40),
    ("closed form, `kr_exact_plan` and `kr_exact_state`", CLOSED_FORM, "one", 105),
    ("Taylor series, `kr_method_taylor`, up to 16 digits", MOVING % "taylor", "short", 135),
    ("Taylor series, `kr_method_taylor`, up to 30 digits", MOVING % "taylor", "one", 135),
    ("everything on one instruction set, up to 16 digits", EVERYTHING, "short", None),
    ("everything on one instruction set, up to 30 digits", EVERYTHING, "one", None),
    ("everything on all instruction sets", EVERYTHING, "all", None),
)
ONE_ISA = {"x86_64": "sse2", "arm64": "neon"}
SHORT = ["-DKREISEL_DIGITS=16", "-DKREISEL_TANGENTS=OFF"]
LEVELS = {"-Os": ["-DCMAKE_BUILD_TYPE=MinSizeRel"], "-O2": ["-DCMAKE_C_FLAGS_RELEASE=-O2"]}
COLUMNS = [(processor, level) for processor in ("x86_64", "arm64") for level in ("-Os", "-O2")]
NONE = "-"
ARM_TARGET = "aarch64-linux-gnu"


def write_wrapper(folder, name, *command):
    """Write a shell script that runs a command with further arguments, and return its path."""
    script = Path(folder) / name
    script.write_text(f'#!/bin/sh\nexec {" ".join(command)} "$@"\n')
    script.chmod(0o755)
    return script


def find_compiler(processor, folder):
    """Return the compiler for a processor and its options of CMake; None if there is none."""
    if platform.machine() == {"x86_64": "x86_64", "arm64": "aarch64"}[processor]:
        return ("gcc", []) if shutil.which("gcc") else None
    if processor == "x86_64":
        return None
    cross = ["-DCMAKE_SYSTEM_NAME=Linux", "-DCMAKE_SYSTEM_PROCESSOR=aarch64"]
    if shutil.which(f"{ARM_TARGET}-gcc"):
        return f"{ARM_TARGET}-gcc", cross
    if subprocess.run([sys.executable, "-c", "import ziglang"], capture_output=True).returncode:
        return None
    zig = [f'"{sys.executable}"', "-m", "ziglang"]
    compiler = write_wrapper(folder, "zig-cc", *zig, "cc", "-target", ARM_TARGET)
    archiver, index = (write_wrapper(folder, f"zig-{s}", *zig, s) for s in ("ar", "ranlib"))
    return compiler, [*cross, f"-DCMAKE_AR={archiver}", f"-DCMAKE_RANLIB={index}"]


def build_library(folder, processor, level, kind):
    """Build the static library, and return its file."""
    compiler, options = find_compiler(processor, folder)
    build = Path(folder) / f"{processor}{level}-{kind}"
    options = [*options, *LEVELS[level], "-DKREISEL_TESTS=OFF", f"-DCMAKE_C_COMPILER={compiler}"]
    options += [] if kind == "all" else [f"-DKREISEL_ISA={ONE_ISA[processor]}"]
    options += SHORT if kind == "short" else []
    run("cmake", "-S", ROOT, "-B", build, *options)
    run("cmake", "--build", build, "--target", "kreisel_static", "--parallel", os.cpu_count())
    return build / "libkreisel.a"


def link_program(folder, compiler, level, text, library):
    """Compile a program, link it with the library, and return it."""
    source, program = Path(folder) / "program.c", Path(folder) / "program"
    source.write_text(text)
    linking = ["-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", library, "-lm"]
    run(compiler, "-std=c99", level, f"-I{CSRC}", source, *linking, "-o", program)
    return program


def sum_sections(program):
    """Return the bytes of text and data of a program."""
    text, data, *_ = run("size", program).splitlines()[1].split()
    return int(text) + int(data)


def measure_column(folder, processor, level):
    """Return the size of each row in kB of 1000 bytes, or None in each row without a compiler."""
    found = find_compiler(processor, folder)
    if found is None:
        return [None for _ in ROWS]
    libraries, sizes = {}, []
    for _, text, kind, _ in ROWS:
        if processor == "arm64" and kind == "all":  # every arm64 has NEON, and nothing more
            kind = "one"
        if kind not in libraries:
            libraries[kind] = build_library(folder, processor, level, kind)
        programs = [(text, libraries[kind]), (EMPTY, libraries[kind])]
        used, empty = (sum_sections(link_program(folder, found[0], level, *p)) for p in programs)
        sizes.append(round((used - empty) / 1000, 1))
    return sizes


def format_table(columns):
    """Return the table as Markdown, from a list of sizes for each column."""
    heads = [f"{processor}, `{level}`" for processor, level in COLUMNS]
    lines = [f"| linked | {' | '.join(heads)} |", f"| --- |{' ---: |' * len(heads)}"]
    for i, (label, *_) in enumerate(ROWS):
        cells = [NONE if column[i] is None else f"{column[i]:.1f}" for column in columns]
        lines.append(f"| {label} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def read_table(text):
    """Return the sizes of a table in Markdown, as a list for each column."""
    rows = [line.strip("| \n").split(" | ")[1:] for line in text.splitlines()[2:]]
    return [
        [None if cell == NONE else float(cell) for cell in column]
        for column in zip(*rows, strict=True)
    ]


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    print(format_table([measure_column(folder, *column) for column in COLUMNS]), end="")
