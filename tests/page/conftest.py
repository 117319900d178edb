"""The browser, and in it one page for all tests of a file that can share it."""

import shutil

import pytest
from browser import PAGE, SMALL, load, visit
from toolbox import need

SOFTWARE = [  # draws without a GPU
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]


@pytest.fixture(scope="session")
def browser():
    need("chromium")
    if not PAGE.exists():
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


@pytest.fixture(scope="module")
def small(shared):
    shared.set_viewport_size(SMALL)


@pytest.fixture
def page(shared):
    """Lagrange's top at rest, at its start, and all of the panel open."""
    shared.evaluate("kreisel.page.run(false); kreisel.page.past = []")
    load(shared)
    shared.evaluate("document.querySelectorAll('details').forEach((part) => (part.open = true))")
    return shared
