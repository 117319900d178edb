"""Tests of the built site in a browser. `make docs` builds it."""

import fcntl
import os
import re

import pytest
from axe import SIZES, list_violations, open_browser
from toolbox import ROOT

SITE = ROOT / "build/docs"
# Short pages that together have all kinds of elements, and the sizes of their windows.
PAGES = {
    "index.html": SIZES,
    "start.html": SIZES[::2],  # tables, programs with their output and pictures
    "recipes.html": SIZES[::2],  # tabs
    "gallery/index.html": SIZES[2:],
    "gallery/tops/loops_cusps_waves.html": SIZES[:1],
    "theory/equations.html": SIZES[2:],  # formulas
    "api/events.html": SIZES[:1],
    "header.html": SIZES[2:],  # the colours of C
}


@pytest.fixture(scope="module")
def browser():
    with (ROOT / "build/docs.lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_SH)  # waits for `make docs`
    with open_browser() as browser:
        yield browser


def test_the_site_opens_with_a_top_and_the_gallery_with_what_a_top_does():
    if not (SITE / "index.html").exists():
        (pytest.fail if os.environ.get("CI") == "true" else pytest.skip)("needs `make docs`")
    start, gallery = ((SITE / page).read_text() for page in ("index.html", "gallery/index.html"))
    assert 0 < start.index("<iframe") < start.index("<pre")
    cards = re.findall(r'tooltip="([^"]*)"', gallery)
    assert "loops" in cards[0] and "cusps" in cards[0]


@pytest.mark.parametrize("page", PAGES)
def test_axe_finds_nothing_on_the_site(page, browser):
    if not (SITE / page).exists():
        (pytest.fail if os.environ.get("CI") == "true" else pytest.skip)("needs `make docs`")
    assert list_violations(browser, (SITE / page).as_uri(), sizes=PAGES[page]) == []
