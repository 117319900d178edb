"""What the package gives for many lines of Python is what it gave: results.txt."""

import pytest
import results

LINES = results.lines()


@pytest.mark.parametrize("line", LINES)
def test_a_line_gives_what_it_gave(line):
    """What has moved is told by tests/python/results.py and the number of the line."""
    assert results.hash_of(line) == LINES[line]
