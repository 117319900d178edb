"""A pytest plugin that sets the running test as coverage context, and writes durations [s].

All parameter sets of a test share one context. Fixtures run without a context.
"""

import json
from collections import Counter

import coverage
import pytest

TIMES = "--times-of-tests"
took = Counter()


def test_name(nodeid):
    return nodeid.partition("[")[0]


def pytest_addoption(parser):
    parser.addoption(TIMES, dest="times_of_tests")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    measured = coverage.Coverage.current()
    measured.switch_context(test_name(item.nodeid))
    try:
        return (yield)
    finally:
        measured.switch_context("")


def pytest_runtest_logreport(report):
    took[test_name(report.nodeid)] += report.duration


def pytest_sessionfinish(session):
    with open(session.config.option.times_of_tests, "w") as file:
        json.dump(took, file)
