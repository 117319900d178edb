"""Tests of the viewer for accessibility by axe-core, in windows of three sizes."""

import pytest
from axe import SIZES, check_page
from browser import WIDE, advance, load, make_viewport


@pytest.fixture
def resized(page):
    """Return the shared page, whose size and colours a test may change."""
    yield page
    page.set_viewport_size(make_viewport(WIDE))
    page.evaluate("document.documentElement.style.colorScheme = ''")


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_on_the_viewer(resized, size, scheme):
    resized.set_viewport_size(make_viewport(size))
    resized.evaluate(f"document.documentElement.style.colorScheme = '{scheme}'")
    load(resized, "Compare four")
    advance(resized, 2)
    resized.evaluate("kreisel.page.setValue('gravity', NaN)")  # shows why it is refused
    resized.get_by_role("button", name="Share").click()
    assert check_page(resized, "panel and share") == []
    resized.get_by_role("button", name="Close").click()
    resized.get_by_role("button", name="Keys").click()
    assert check_page(resized, "keys") == []


def test_axe_finds_a_button_without_a_name(page):
    page.evaluate("document.getElementById('bar').prepend(document.createElement('button'))")
    found = check_page(page, "toolbar")
    page.evaluate("document.querySelector('#bar button').remove()")
    assert [(case, rule) for case, rule, _ in found] == [("toolbar", "button-name")]
