"""Tests that memory does not grow with repeated calls."""

import pytest

from validation.mutation import memory_leaks

CALLS, FEWER = 150, 100  # caches may grow once by some blocks, a leak grows by one block per call


@pytest.mark.parametrize("name", memory_leaks.list_calls(memory_leaks.Path("/nowhere")))
def test_calls_do_not_leak_memory(tmp_path, name):
    call = memory_leaks.list_calls(tmp_path)[name]
    assert any(memory_leaks.measure_growth(call, CALLS)[0] < FEWER for _ in range(3))


def test_a_leak_is_detected():
    kept = []
    blocks, _ = memory_leaks.measure_growth(lambda: kept.append(object()), CALLS)
    assert blocks >= CALLS
