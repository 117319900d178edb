"""Fixtures for the tests of the report.

No test depends on run times; heyoka therefore compiles without optimization, and each call is timed
only once.
"""

from functools import partial

import heyoka
import pytest
from axe import open_browser

from validation.competitors import timing


@pytest.fixture(scope="session", autouse=True)
def short_measurements():
    """Compile heyoka's integrators without optimization, and time each call only once."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("taylor_adaptive", "taylor_adaptive_batch"):
            patch.setattr(heyoka, name, partial(getattr(heyoka, name), opt_level=0))
        patch.setattr(timing, "SAMPLE", 1e-9)
        yield


@pytest.fixture(scope="session")
def browser():
    with open_browser() as browser:
        yield browser
