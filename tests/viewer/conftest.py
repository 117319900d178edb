"""The browser, and in it one page for all tests of a file that can share it."""

import shutil

import pytest
from browser import PAGE, load, visit
from toolbox import need

SOFTWARE = [  # draws without a GPU
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",  # what is not WebGL is drawn faster without one that is made up
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


@pytest.fixture(scope="session")
def page_of_all_tests(browser):
    """One page for all tests that can share it."""
    page = visit(browser, reduced_motion="reduce")
    yield page
    page.context.close()


@pytest.fixture
def page(page_of_all_tests):
    """Lagrange's top at rest, at its start, and all of the panel open."""
    page_of_all_tests.evaluate("""{
        const {page, view} = kreisel;
        page.run(false);
        Object.assign(page, {past: [], future: [], gesture: null});
        Object.assign(view, {isHome: true, side: undefined});
        document.getElementById('panel').hidden = false;
        document.getElementById('keys').close();
        document.querySelectorAll('details').forEach((part) => (part.open = true));
    }""")
    load(page_of_all_tests)
    yield page_of_all_tests
    troubles, page_of_all_tests.troubles[:] = [*page_of_all_tests.troubles], []
    assert troubles == []
