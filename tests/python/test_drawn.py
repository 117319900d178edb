"""What the public calls give for words that are drawn is what it was: drawn.txt."""

import drawn
import pytest

HASHES = drawn.hashes()


@pytest.mark.parametrize("name", drawn.names())
def test_a_call_gives_what_it_gave(name):
    """What has moved is told by tests/python/drawn.py, the name and the number of the hash."""
    assert [drawn.hash_of(name, i) for i in range(drawn.count(name))] == HASHES[name]
