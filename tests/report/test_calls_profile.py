"""Tests of limits on the number of Python calls in public functions."""

import pytest

from validation.benchmarks.calls_profile import CASES, count_calls

LIMITS = {
    "solve(scene, [1.0])": (12, 1),
    "plan(scene)": (45, 20),
    "reduce(ensemble)": (40, 8),
    "sweep of one part, one column": (350, 80),
}


@pytest.mark.parametrize("case", LIMITS)
def test_functions_take_few_calls_and_returns(case):
    calls, _, returns = count_calls(CASES[case]())
    most_calls, most_returns = LIMITS[case]
    assert calls <= most_calls and returns <= most_returns
