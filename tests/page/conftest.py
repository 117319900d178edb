"""The browser, and in it one page for all tests that can share it."""

import shutil

import pytest
from browser import visit
from kreisel._showing.view import _PAGE
from toolbox import need

SOFTWARE = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]  # draws without a GPU


@pytest.fixture(scope="session")
def browser():
    need("chromium")
    if not _PAGE.exists():
        need("npm")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=shutil.which("chromium"), args=SOFTWARE)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def shared(browser):
    page = visit(browser, reduced_motion="reduce")
    yield page
    assert page.troubles == []
    page.context.close()


@pytest.fixture
def page(shared):
    """Lagrange's top at rest, at its start, and all of the panel open."""
    shared.evaluate(
        "kreisel.page.run(false); kreisel.page.past = []; kreisel.page.load(kreisel.presets[0])"
    )
    shared.evaluate("document.querySelectorAll('details').forEach((part) => (part.open = true))")
    return shared
