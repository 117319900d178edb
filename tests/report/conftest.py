"""A report that tests make is whole, however slow the machine is."""

from dataclasses import replace

import pytest

from validation.parts.budget import BUDGETS


@pytest.fixture(scope="session", autouse=True)
def unhurried():
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(BUDGETS, "quick", replace(BUDGETS["quick"], seconds=1e9))
        yield
