"""Fixtures for the tests of the viewer."""

import shutil

import pytest
from browser import PAGE, load, visit
from toolbox import need, start_playwright

SOFTWARE = [  # options for rendering without a GPU
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",  # rendering is faster without an emulated compositor
]


@pytest.fixture(scope="session")
def browser():
    need("chromium")
    if not PAGE.exists():
        need("npm")
    path = shutil.which("chromium")
    browser = start_playwright().chromium.launch(executable_path=path, args=SOFTWARE)
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def shared_page(browser):
    """Open a page that several tests share."""
    page = visit(browser, reduced_motion="reduce")
    yield page
    page.context.close()


@pytest.fixture
def page(shared_page):
    """Return the shared page in its initial state, with all sections open."""
    shared_page.evaluate("""{
        const {page, view} = kreisel;
        page.setRunning(false);
        Object.assign(page, {undoStack: [], redoStack: [], gesture: null});
        Object.assign(view, {isHome: true, side: undefined});
        document.getElementById('panel').hidden = false;
        for (const id of ['keys', 'share']) document.getElementById(id).close();
        document.querySelectorAll('details').forEach((part) => (part.open = true));
    }""")
    load(shared_page)
    yield shared_page
    troubles, shared_page.troubles[:] = [*shared_page.troubles], []
    assert troubles == []
