"""The sizes of programs that link the library, as listed in docs/sizes.md.

    python tests/repo/sizes.py > docs/sizes.md

Each program is linked with an object file of kreisel.c for a single instruction set. The linker
option --gc-sections removes unused functions. The size is that of the text and data sections, minus
the size of a similar program that does not use the library. The C standard library is linked
dynamically and is not counted.
"""

import platform
import re
import shutil
import subprocess
import sys
import tempfile
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


def name_functions(pattern=None):
    """Return the names of all public functions, except those that match `pattern`."""
    header = re.sub(r"/\*.*?\*/", "", (CSRC / "kreisel.h").read_text(), flags=re.DOTALL)
    names = sorted(set(re.findall(r"\b(kr_\w+)\(", header)))
    return [name for name in names if not (pattern and re.search(pattern, name))]


def write_table(names):
    """Return a C program that contains a table of pointers to functions."""
    table = ", ".join(f"(function)&{name}" for name in names)
    return (
        "#include <kreisel.h>\n"
        "typedef void (*function)(void);\n"
        "extern const function functions[];\n"
        "int main(int count, char **words)\n"
        "{\n"
        "    functions[count]();\n"
        "    return words != 0;\n"
        "}\n"
        f"const function functions[] = {{{table}}};\n"
    )


def write_everything(pattern=None):
    """Return a program that uses all public functions, and a similar program that uses none."""
    names = name_functions(pattern)
    return write_table(names), write_table(["main"] * len(names))


TORUS = "kowalewski_|chaplygin_"
# The rows of the table: label, program and the one that calls nothing, options of kreisel.c, limit
# in kB at -Os on x86_64.
ROWS = (
    ("one splitting method, `kr_method_strang`", (MOVING % "strang", EMPTY), (), 40),
    ("closed form, `kr_exact_plan` and `kr_exact_state`", (CLOSED_FORM, EMPTY), (), 105),
    (
        "Taylor series, `kr_method_taylor`, 30 digits, tangents",
        (MOVING % "taylor", EMPTY),
        (),
        150,
    ),
    (
        "the same, with `-DKR_NO_SUPPORTS`",
        (MOVING % "taylor", EMPTY),
        ("-DKR_NO_TORUS", "-DKR_NO_SUPPORTS"),  # torus forms are not linked here anyway
        135,
    ),
    (
        "everything, with `-DKR_NO_TORUS -DKR_NO_SUPPORTS`",
        write_everything(TORUS),
        ("-DKR_NO_TORUS", "-DKR_NO_SUPPORTS"),
        270,
    ),
    (
        "everything, with `-DKR_NO_TORUS`",
        write_everything(TORUS),
        ("-DKR_NO_TORUS",),
        325,
    ),
    ("everything", write_everything(), (), None),
)
LEVELS = {"-Os": ["-Os", "-fno-asynchronous-unwind-tables"], "-O2": ["-O2"]}
COLUMNS = [(processor, level) for processor in ("x86_64", "arm64") for level in ("-Os", "-O2")]
NONE = "-"
ARM_TARGET = "aarch64-linux-gnu"


def find_compiler(processor):
    """Return the compiler command for a processor, or None if no compiler is installed."""
    if platform.machine() == {"x86_64": "x86_64", "arm64": "aarch64"}[processor]:
        return ["gcc"] if shutil.which("gcc") else None
    if processor == "x86_64":
        return None
    has_zig = subprocess.run([sys.executable, "-c", "import ziglang"], capture_output=True)
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", ARM_TARGET]
    return zig if has_zig.returncode == 0 else None


def compile_library(folder, compiler, level, options):
    """Compile kreisel.c for one instruction set, and return the object file."""
    object_file = Path(folder) / f"kreisel{''.join(options)}.o"
    if not object_file.exists():
        run(sys.executable, ROOT / "cmake/amalgamate.py", folder)
        flags = ["-std=c99", *LEVELS[level], "-ffunction-sections", "-fdata-sections"]
        # ccache finds the object file of an earlier run only by a relative path.
        command = (
            *compiler,
            *flags,
            "-DKR_ONE_ISA",
            *options,
            "-c",
            "kreisel.c",
            "-o",
            object_file,
        )
        run(*command, cwd=folder)
    return object_file


def link_program(folder, compiler, level, text, library):
    """Compile and link a program, and return its path."""
    source, program = Path(folder) / "program.c", Path(folder) / "program"
    source.write_text(text)
    linking = ["-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", library, "-lm"]
    run(*compiler, "-std=c99", *LEVELS[level], f"-I{CSRC}", source, *linking, "-o", program)
    return program


def sum_sections(program):
    """Return the total size in bytes of the text and data sections of a program."""
    text, data, *_ = run("size", program).splitlines()[1].split()
    return int(text) + int(data)


def measure_column(folder, processor, level, rows=ROWS):
    """Return the size [kB] of each program, or a list of None if no compiler is installed."""
    compiler = find_compiler(processor)
    if compiler is None:
        return [None for _ in rows]
    sizes = []
    for _, programs, options, _ in rows:
        library = compile_library(folder, compiler, level, options)
        full, empty = (
            sum_sections(link_program(folder, compiler, level, program, library))
            for program in programs
        )
        sizes.append(round((full - empty) / 1000, 1))
    return sizes


def measure():
    """Return all columns of the table of program sizes."""
    columns = []
    for column in COLUMNS:
        with tempfile.TemporaryDirectory() as folder:
            columns.append(measure_column(folder, *column))
    return columns


def format_table(columns):
    """Return the program sizes as a Markdown table."""
    heads = [f"`{processor} {level}`" for processor, level in COLUMNS]
    lines = [f"| linked | {' | '.join(heads)} |", f"| --- |{' ---: |' * len(heads)}"]
    for i, (label, *_) in enumerate(ROWS):
        cells = [NONE if column[i] is None else f"{column[i]:.1f}" for column in columns]
        lines.append(f"| {label} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def read_table(text):
    """Return the numeric columns of a Markdown table of program sizes, omitting the row labels."""
    rows = [line.strip("| \n").split(" | ")[1:] for line in text.splitlines()[2:]]
    return [
        [None if cell == NONE else float(cell) for cell in column]
        for column in zip(*rows, strict=True)
    ]


if __name__ == "__main__":
    print(format_table(measure()), end="")
