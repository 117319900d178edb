"""Accessibility tests of the viewer with axe-core."""

import pytest
from axe import SIZES, check_page
from browser import WIDE, advance, load, make_viewport


@pytest.fixture
def changeable_page(page):
    """Return the browser page shared by all tests, and restore its size and colours afterwards."""
    yield page
    page.set_viewport_size(make_viewport(WIDE))
    page.evaluate("document.documentElement.style.colorScheme = ''")


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_on_the_viewer(changeable_page, size, scheme):
    changeable_page.set_viewport_size(make_viewport(size))
    changeable_page.evaluate(f"document.documentElement.style.colorScheme = '{scheme}'")
    load(changeable_page, "Compare four")
    advance(changeable_page, 2)
    changeable_page.evaluate("kreisel.page.setValue('gravity', NaN)")  # shows why it is refused
    changeable_page.get_by_role("button", name="Share").click()
    assert check_page(changeable_page, "panel and share") == []
    changeable_page.get_by_role("button", name="Close").click()
    changeable_page.get_by_role("button", name="Keys").click()
    assert check_page(changeable_page, "keys") == []


def test_axe_finds_a_button_without_a_name(page):
    page.evaluate("document.getElementById('bar').prepend(document.createElement('button'))")
    violations = check_page(page, "toolbar")
    page.evaluate("document.querySelector('#bar button').remove()")
    assert [(case, rule) for case, rule, _ in violations] == [("toolbar", "button-name")]
