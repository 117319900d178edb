"""Tests that source files depend only on lower layers, or on files of their layer and folder.

ARCHITECTURE.md lists the layers. A C file depends on the files that it includes, a script and a
Python file on those that they import, even inside functions.
"""

import ast
import re
from graphlib import TopologicalSorter

import pytest
from toolbox import CSRC, ROOT

LAYERS = {  # of each tree, beginning with the lowest
    tree: [re.split(r"\s{2,}", line)[0].split() for line in text.splitlines()][::-1]
    for tree, text in re.findall(
        r"^```layers (\S+)\n(.*?)^```", (ROOT / "ARCHITECTURE.md").read_text(), re.M | re.S
    )
}
GENERATED = {"node_modules", "__pycache__"}


def list_files(tree, *suffixes):
    files = sorted((ROOT / tree).rglob("*"))
    return [file for file in files if file.suffix in suffixes and not GENERATED & {*file.parts}]


def list_c_includes(file):
    for name in re.findall(r'^\s*#\s*include\s+"(.+)"', file.read_text(), re.M):
        neighbour = (file.parent / name).resolve()
        yield neighbour if neighbour.exists() else CSRC / name


def list_script_imports(file):
    for name in re.findall(r'^(?:import|\} from)\b.*"(\./.+\.js)";', file.read_text(), re.M):
        yield (file.parent / name).resolve()


def name_module(file):
    """Return the name by which a Python file is imported, with `__init__`."""
    is_test = file.is_relative_to(ROOT / "tests")
    top = file.parent if is_test else ROOT / "python" if "kreisel" in file.parts else ROOT
    return ".".join(file.relative_to(top).with_suffix("").parts)


def list_python_imports(file, modules):
    """Yield the files in the dictionary `modules` of names that `file` imports."""
    for node in ast.walk(ast.parse(file.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            package = name_module(file).rsplit(".", node.level)[0] if node.level else ""
            base = ".".join(filter(None, [package, node.module]))
            words = [alias.name for alias in node.names]
            names = [f"{base}.{word}" for word in words if word != "_core"]  # a compiled module
        for name in names:
            if name.endswith("._core"):  # the binding
                continue
            yield modules.get(name) or modules.get(name.rpartition(".")[0])


def find_dependencies(tree):
    """Return a dictionary of the files of `tree`, each with the files on which it depends."""
    python = list_files(tree, ".py")
    modules = {name_module(file).removesuffix(".__init__"): file for file in python}
    uses = {file: set(list_python_imports(file, modules)) for file in python}
    uses |= {file: set(list_c_includes(file)) for file in list_files(tree, ".c", ".h", ".def")}
    uses |= {file: set(list_script_imports(file)) for file in list_files(tree, ".js")}
    return {file: (others & uses.keys()) - {file} for file, others in uses.items()}


def find_layer(file, tree):
    """Return the index of the layer of a file. Exactly one layer must name the file."""
    name = file.relative_to(ROOT / tree).as_posix()
    (layer,) = (
        i
        for i, entries in enumerate(LAYERS[tree])
        if any(name == entry or (entry[-1] == "/" and name.startswith(entry)) for entry in entries)
    )
    return layer


@pytest.mark.parametrize("tree", LAYERS)
def test_files_use_only_lower_layers_or_their_own_folder(tree):
    dependencies = find_dependencies(tree)
    layers = {file: find_layer(file, tree) for file in dependencies}
    assert [
        f"{file} uses {other}"
        for file, others in dependencies.items()
        for other in others
        if layers[other] > layers[file]
        or (layers[other] == layers[file] and other.parent != file.parent)
    ] == []
    TopologicalSorter(dependencies).prepare()  # raises CycleError
    assert all((ROOT / tree / name).exists() for names in LAYERS[tree] for name in names)


def test_the_binding_includes_only_the_public_header():
    binding = list_files("python", ".cpp", ".hpp")
    for file in binding:
        assert set(list_c_includes(file)) <= {CSRC / "kreisel.h", *binding}, file
