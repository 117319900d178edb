"""The layers defined in ARCHITECTURE.md, and the dependencies between files.

A C file depends on the files that it includes. A Python file or script depends on the files that it
imports, even inside functions.
"""

import ast
import re
from functools import cache

from toolbox import ROOT

PLAN = ROOT / "ARCHITECTURE.md"
C, PYTHON, SCRIPTS = {".c", ".h", ".def"}, {".py"}, {".js"}


@cache
def layers():
    """Return a dictionary of the layers in each source tree, beginning with the lowest layer."""
    layer_of_name = {}
    for tree, text in re.findall(r"^```layers (\S+)\n(.*?)^```", PLAN.read_text(), re.M | re.S):
        rows = [re.split(r"\s{2,}", line.strip())[0].split() for line in text.splitlines()]
        layer_of_name[tree] = rows[::-1]
    return layer_of_name


def files(tree):
    folder = ROOT / tree
    endings = C | PYTHON | SCRIPTS
    return sorted(file for file in folder.rglob("*") if file.suffix in endings and is_ours(file))


def is_ours(file):
    parts = file.relative_to(ROOT).parts
    return not {"node_modules", "__pycache__"} & set(parts)


def layer(file, tree):
    """Return the index of the layer that contains a file, or None if there is no unique layer."""
    relative_name = file.relative_to(ROOT / tree).as_posix()
    levels = [
        number
        for number, names in enumerate(layers()[tree])
        for name in names
        if relative_name == name or (name.endswith("/") and relative_name.startswith(name))
    ]
    return levels[0] if len(levels) == 1 else None


def targets(file, tree):
    """Return the files in the folder `tree` on which a source file depends."""
    uses = (
        c_includes
        if file.suffix in C
        else python_imports
        if file.suffix in PYTHON
        else script_imports
    )
    folder = ROOT / tree
    return {other for other in uses(file) if other != file and other.is_relative_to(folder)}


def c_includes(file):
    for name in re.findall(r'^\s*#\s*include\s+"(.+)"', file.read_text(), re.M):
        neighbour = (file.parent / name).resolve()
        yield neighbour if neighbour.exists() else ROOT / "csrc" / name


def script_imports(file):
    for name in re.findall(r'^(?:import|\} from)\b.*"(\./.+\.js)";', file.read_text(), re.M):
        yield (file.parent / name).resolve()


def python_imports(file):
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from module(alias.name.split("."))
        elif isinstance(node, ast.ImportFrom):
            base = package(file, node)
            for alias in node.names:
                yield from module([*base, alias.name]) or module(base)


def package(file, node):
    """Return the absolute module name of an import statement as a list of its parts."""
    words = node.module.split(".") if node.module else []
    if not node.level:
        return words
    beginning = next(top for top in TOPS if file.is_relative_to(top))
    folders = file.relative_to(beginning).parts[: -node.level]
    return [*folders, *words]


TOPS = (ROOT / "tests/repo", ROOT / "tests/viewer", ROOT / "tests/python", ROOT / "python", ROOT)


def module(words):
    """Return a list with the file of a module, or an empty list for an external module."""
    for top in TOPS:
        for path in (top.joinpath(*words).with_suffix(".py"), top.joinpath(*words, "__init__.py")):
            if words and path.is_file() and is_ours(path):
                return [path]
    return []


def circle(arrows):
    """Return a cycle of dependencies, or an empty list if there is none."""
    state, way = {}, []

    def visit(file):
        state[file] = "open"
        way.append(file)
        for other in sorted(arrows.get(file, ())):
            if state.get(other) == "open":
                return way[way.index(other) :]
            cycle = [] if other in state else visit(other)
            if cycle:
                return cycle
        way.pop()
        state[file] = "done"
        return []

    return next(
        (cycle for file in sorted(arrows) if file not in state if (cycle := visit(file))), []
    )
