"""Tests that add a preset and a quantity to the viewer, with the changes that are written here.

They show that these changes are sufficient. ARCHITECTURE.md, which has the recipes, is not read.
"""

import sys

import pytest
from browser import visit
from copied import House, add_quantity
from toolbox import ROOT, need, run

PRESET = """  {
    "name": "Lagrange's top, twice as heavy",
    "about": "The top of the thesis under twice the gravity.",
    "shape": "lagrange",
    "gravity": 2
  },
"""


@pytest.fixture(scope="module")
def extended_page(browser, tmp_path_factory):
    """Build a viewer with an additional preset and quantity."""
    need("npm")
    house = House(tmp_path_factory.mktemp("house"))
    add_quantity(house)
    house.insert("preset", "python/viewer/presets.json", "  {", PRESET)
    page = house.folder / "top.html"
    build = house.folder / "python/viewer/build.py"
    libraries = str(ROOT / "build/viewer/zig")  # contains the compiled libraries of zig
    run(sys.executable, build, house.folder / "build", page, ZIG_GLOBAL_CACHE_DIR=libraries)
    page = visit(browser, page)
    page.house = house
    yield page
    page.context.close()


def test_a_preset_touches_one_file_and_can_be_chosen(extended_page):
    assert extended_page.house.touched["preset"] == ["python/viewer/presets.json"]
    extended_page.get_by_role("radio", name="Lagrange's top, twice as heavy").check()
    assert extended_page.evaluate("kreisel.page.scene.gravity") == 2
    assert extended_page.troubles == []


def test_a_quantity_can_be_charted(extended_page):
    labels = extended_page.locator("select option").all_text_contents()
    assert any("height" in label.lower() for label in labels)
    assert "height" in extended_page.evaluate("kreisel.charts.formatCsv().split('\\n', 1)[0]")
