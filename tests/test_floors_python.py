"""The Python package is a house of rooms: imports of every kind point downwards, and no files form a circle."""

import ast

import pytest
from toolbox import ROOT

import kreisel as kr

PACKAGE = ROOT / "python/kreisel"
FLOORS = [  # from the ground up: folders, which are rooms, and single files
    "_core.pyi",
    "_ground",
    "quaternion.py",
    "_model",
    "scenes.py",
    "_request",
    "_recording",
    "events.py",
    "_verbs",
    "_analysis",
    "_showing",
    "__init__.py",
    "__main__.py",
]
FILES = sorted(PACKAGE.rglob("*.py"))


def name(file):
    return file.relative_to(PACKAGE).as_posix()


def floor(file):
    return FLOORS.index(name(file).split("/")[0])


def module(words):
    """The file of a module by its words below kreisel; None where it is none."""
    place = PACKAGE.joinpath(*words)
    return next((f for f in (place.with_suffix(".py"), place.with_suffix(".pyi"), place / "__init__.py") if f.is_file()), None)


def imported(file):
    """The package's files that a file imports: at the top, inside functions, and for types alike."""
    here = ("kreisel", *file.relative_to(PACKAGE).parts[:-1])
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found = [(alias.name.split("."), []) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = list(here[: len(here) + 1 - node.level]) if node.level else []
            found = [(base + (node.module or "").split("."), [alias.name for alias in node.names])]
        else:
            continue
        for (top, *words), names in found:
            words = [word for word in words if word]
            if top == "kreisel":
                inside = [module([*words, word]) for word in names]
                yield from (target for target in inside if target)
                if not all(inside) or not inside:
                    yield module(words) or PACKAGE / "__init__.py"


def test_the_reader_of_imports_sees_all_kinds(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "PACKAGE", tmp_path)
    for file in ("__init__.py", "a.py", "room/__init__.py", "room/b.py"):
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).touch()
    code = "from . import __init__\nfrom .. import a\nimport kreisel.room.b as b\ndef f():\n    from ..a import x\n    from kreisel import y\n"
    (tmp_path / "room/c.py").write_text(code)
    found = [name(target) for target in imported(tmp_path / "room/c.py")]
    assert found == ["room/__init__.py", "a.py", "room/b.py", "a.py", "__init__.py"]


@pytest.mark.parametrize("file", FILES, ids=name)
def test_imports_point_downwards(file):
    for target in imported(file):
        beside = target.parent == file.parent != PACKAGE
        assert floor(target) < floor(file) or beside, f"imports {name(target)}, which is not below"


def test_no_files_form_a_circle():
    arrows = {file: set(imported(file)) for file in FILES}
    done = set()
    while open_ := {file for file in arrows.keys() - done if arrows[file].intersection(arrows) <= done}:
        done |= open_
    assert [name(file) for file in sorted(arrows.keys() - done)] == []


def test_no_public_name_is_a_module_and_something_else():
    modules = {file.stem for file in PACKAGE.iterdir() if not file.stem.startswith("_")} - {"viewer", "py"}
    assert modules == {"events", "quaternion", "scenes"} and modules <= set(kr.__all__)
    assert all(getattr(kr, word).__name__ == f"kreisel.{word}" for word in modules)
