"""Memory is steady: no call leaves something behind each time that it is made."""

import pytest

from validation.trust import memory

CALLS, FEWER = 150, 100  # some caches grow by some blocks now and then; a leak by one each time


@pytest.mark.parametrize("name", memory.calls(memory.Path("/nowhere")))
def test_a_call_leaves_nothing_behind(tmp_path, name):
    blocks, _ = memory.left(memory.calls(tmp_path)[name], CALLS)
    assert blocks < FEWER


def test_a_leak_is_seen():
    kept = []
    blocks, _ = memory.left(lambda: kept.append(object()), CALLS)
    assert blocks >= CALLS
