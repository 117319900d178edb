"""Tests of the built site in a browser. `make docs` builds it."""

import os

import pytest
from axe import list_violations, open_browser
from toolbox import ROOT

SITE = ROOT / "build/docs"
PAGES = (
    "index.html",
    "start.html",
    "choosing.html",
    "gallery/index.html",
    "gallery/tops/loops_cusps_waves.html",
    "theory/closed_form.html",
    "theory/discretizations.html",
    "api/index.html",
    "api/motion.html",
    "header.html",
)


@pytest.fixture(scope="module")
def browser():
    with open_browser() as browser:
        yield browser


@pytest.mark.parametrize("page", PAGES)
def test_axe_finds_nothing_on_the_site(page, browser):
    if not (SITE / page).exists():
        (pytest.fail if os.environ.get("CI") == "true" else pytest.skip)("needs `make docs`")
    assert list_violations(browser, (SITE / page).as_uri()) == []
