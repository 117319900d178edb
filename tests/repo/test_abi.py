"""Tests that the binary interface of the library remains compatible.

The file abi.txt describes the interface of the current version. A program compiled with the header
of one version must work with all libraries of this version. After an intended change, raise the
minor version of kreisel.h and write the file anew:

    python tests/repo/test_abi.py
"""

import re
import tempfile
from pathlib import Path

from toolbox import CSRC, ROOT, VERSION, need, run

FILE = ROOT / "tests/repo/abi.txt"
STRUCT = re.compile(r"typedef struct (\w+) \{(.*?)\} \1;", re.S)
ENUM = re.compile(r"enum \w*\s*\{(.*?)\}", re.S)
MEMBER = re.compile(r"\(\*(\w+)\)\([^)]*\)|(\w+)(?:\[\w+\])?\s*(?=[,;])")


def preprocess():
    """Return the preprocessed header without the declarations of the C standard library."""
    need("gcc")
    options = ["-E", "-P", "-std=c99", "-include", "stddef.h", "-include", "stdint.h"]
    text = run("gcc", *options, CSRC / "kreisel.h")
    text = text[text.index("typedef enum kr_status") :]
    return re.sub(r"__attribute__\(\(.*?\)\)\)\s*", "", text)


def list_structs(text):
    """Return the member names of each public struct."""
    return {
        name: [pointer or member for pointer, member in MEMBER.findall(body)]
        for name, body in STRUCT.findall(text)
    }


def list_enumerators(text):
    return re.findall(r"\b(KR_\w+)\b(?=\s*(?:=|,|$))", "\n".join(ENUM.findall(text)), re.M)


def list_prototypes(text):
    """Return a sorted list of the declarations of functions and constants."""
    types = r"typedef (?:enum|struct)[^;{]*(?:\{.*?\}[^;]*)?;|enum \{.*?\};"
    declarations = (
        " ".join(part.split()) for part in re.sub(types, "", text, flags=re.S).split(";")
    )
    return sorted(line for line in declarations if "kr_" in line)


def write_program(text):
    """Return a C program that prints the layouts of structs and the values of enumerators."""
    lines = []
    for name, members in list_structs(text).items():
        lines.append(f'printf("struct {name}: %zu bytes\\n", sizeof({name}));')
        lines += [
            f'printf("    {member} at %zu\\n", offsetof({name}, {member}));' for member in members
        ]
    lines += [f'printf("{name} = %lld\\n", (long long){name});' for name in list_enumerators(text)]
    body = "\n    ".join(lines)
    head = "#include <stdio.h>\n#include <stddef.h>\n#include <kreisel.h>\n"
    return f"{head}int main(void)\n{{\n    {body}\n    return 0;\n}}\n"


def describe_interface(folder):
    """Return the contents of abi.txt for the current header."""
    text = preprocess()
    source, program = Path(folder) / "abi.c", Path(folder) / "abi"
    source.write_text(write_program(text))
    run("gcc", "-std=c99", f"-I{CSRC}", source, "-o", program)
    return f"version {VERSION}\n" + run(program) + "\n".join(list_prototypes(text)) + "\n"


def test_the_interface_agrees_with_abi_txt(tmp_path):
    assert describe_interface(tmp_path).splitlines() == FILE.read_text().splitlines()


def test_the_description_covers_the_header():
    text = preprocess()
    structs, prototypes = list_structs(text), "\n".join(list_prototypes(text))
    assert {"kr_scene", "kr_config", "kr_event", "kr_tops", "kr_exact"} <= set(structs)
    assert "poll" in structs["kr_config"] and structs["kr_vec3"] == ["x", "y", "z"]
    functions = set(re.findall(r"KR_API [\w \*]*?\b(kr_\w+)\(", (CSRC / "kreisel.h").read_text()))
    assert len(functions) > 80
    assert not [name for name in functions if f"{name}(" not in prototypes]
    assert "KR_ERR_NO_EVENTS" in list_enumerators(text)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        FILE.write_text(describe_interface(folder))
