"""Accessibility checks of web pages with axe-core."""

from contextlib import contextmanager

from axe_playwright_python.sync_playwright import Axe
from toolbox import launch_chromium, open_context

SIZES = ((1280, 800), (768, 1024), (390, 780))  # a desktop, a tablet and a phone [pixels]


@contextmanager
def open_browser():
    """Open Debian's Chromium headless. Without Chromium, skip the test, or fail on a CI server."""
    browser = launch_chromium()
    yield browser
    browser.close()


def list_violations(browser, address, open_folds=False, sizes=SIZES):
    """Return the accessibility violations of a page for several window sizes.

    If `open_folds` is true, all folded sections are opened first.
    """
    violations = []
    viewports = [{"width": width, "height": height} for width, height in sizes]
    page = open_context(browser, viewport=viewports[0]).new_page()
    page.goto(address)
    page.evaluate("document.querySelectorAll('svg').forEach((e,i) => i % 8 && e.replaceChildren())")
    if open_folds:
        page.evaluate("document.querySelectorAll('details').forEach(e => e.open = true)")
    for viewport in viewports:
        page.set_viewport_size(viewport)
        violations += check_page(page, viewport["width"])
    page.close()
    return violations


def check_page(page, case):
    """Return the accessibility violations of a page, labelled with `case`."""
    if not page.evaluate("!!window.axe"):
        page.evaluate(Axe().axe_script)
    violations = page.evaluate("axe.run({resultTypes: ['violations']})")["violations"]
    places = [[node["html"][:120] for node in each["nodes"][:3]] for each in violations]
    return [(case, each["id"], place) for each, place in zip(violations, places, strict=True)]
