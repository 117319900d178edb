"""Slices of an ensemble for worker threads."""

import pytest
from kreisel._results.executor import WorkerPool


@pytest.mark.parametrize(("n", "threads", "first"), [(10_000, 2, 1256), (100, 2, 56), (5, 4, 5)])
def test_threads_take_ever_fewer_members_and_whole_vectors(n, threads, first):
    slices = list(WorkerPool(threads).slices(n))
    sizes = [end - begin for begin, end in slices]
    assert sizes[0] == first and sum(sizes) == n
    assert [begin for begin, _ in slices[1:]] == [end for _, end in slices[:-1]]
    assert sizes == sorted(sizes, reverse=True) and all(size % 8 == 0 for size in sizes[:-1])


def test_threads_take_so_many_members_at_most():
    assert next(WorkerPool(1).slices(10**6)) == (0, 1 << 15)
