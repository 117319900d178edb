"""Fixtures for the tests of the report.

The report has no time limit here, so that it is complete even on slow machines.
"""

from dataclasses import replace

import pytest
from axe import open_browser

from validation.parts.budget import BUDGETS


@pytest.fixture(scope="session", autouse=True)
def no_time_limit():
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(BUDGETS, "quick", replace(BUDGETS["quick"], seconds=1e9))
        yield


@pytest.fixture(scope="session")
def browser():
    with open_browser() as browser:
        yield browser
