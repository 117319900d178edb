"""Fixtures for the tests of the viewer."""

import pytest
from browser import PAGE, WIDE, Viewer, make_viewport
from toolbox import launch_chromium, need

SOFTWARE = [  # options for rendering without a GPU
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",  # rendering is faster without an emulated compositor
]


@pytest.fixture(scope="session")
def browser():
    if not PAGE.exists():
        need("npm")
    browser = launch_chromium(*SOFTWARE)
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def shared_page(browser):
    """Open a page that several tests share."""
    page = Viewer(browser).open()
    yield page
    page.close()


@pytest.fixture
def page(shared_page):
    """Return the shared page in its initial state, with all sections open."""
    shared_page.evaluate("""async () => {
        const {page, view, drags} = kreisel, panel = document.getElementById('panel');
        Object.assign(page, {isRunning: false, isResuming: false, goal: null});
        Object.assign(page, {undoStack: [], redoStack: [], gesture: null});
        Object.assign(view, {isHome: true, side: undefined});
        drags.isPushing = false;
        document.activeElement.blur();
        Object.assign(panel, {hidden: false, scrollTop: 0});
        document.getElementById('hand').hidden = false;
        for (const id of ['keys', 'share']) document.getElementById(id).close();
        document.querySelectorAll('details').forEach((part) => (part.open = true));
        page.showMessage('');
        // The observers of the page have seen all changes when a new one reports.
        await new Promise((done) => new ResizeObserver(done).observe(view.canvas));
    }""")
    shared_page.load()
    yield shared_page
    if shared_page.viewport_size != make_viewport(WIDE):
        shared_page.resize(WIDE)
    troubles, shared_page.troubles[:] = [*shared_page.troubles], []
    assert troubles == []


@pytest.fixture(scope="session")
def shared_window(browser):
    """Open an empty window that several tests share."""
    page = Viewer(browser)
    yield page
    page.close()


@pytest.fixture
def window(shared_window):
    """Return an empty browser window that tests share, because opening a new one is slow."""
    yield shared_window
    shared_window.evaluate("localStorage.clear()")
    shared_window.goto("about:blank")
    shared_window.troubles.clear()


@pytest.fixture
def full_picture(page):
    """Draw the viewer's picture in full detail, for tests that inspect its pixels."""
    page.evaluate("sketches = false; kreisel.view.isDirty = true; kreisel.view.render()")
    yield
    page.evaluate("sketches = true")
