"""Names of the package: what is public stays at its top, and is no module and something else at once."""

import kreisel as kr
from toolbox import ROOT

PACKAGE = ROOT / "python/kreisel"


def test_no_public_name_is_a_module_and_something_else():
    modules = {file.stem for file in PACKAGE.glob("*.py") if not file.stem.startswith("_")}
    assert modules == {"events", "quaternion", "scenes"} and modules <= set(kr.__all__)
    assert all(getattr(kr, name).__name__ == f"kreisel.{name}" for name in modules)


def test_rooms_are_marked_private():
    rooms = [folder.name for folder in PACKAGE.iterdir() if (folder / "__init__.py").is_file()]
    assert len(rooms) == 7 and all(name.startswith("_") for name in rooms)
