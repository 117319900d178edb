"""Tests of how ensembles are divided among threads."""

import threading

import kreisel as kr
import numpy as np
import pytest
from kreisel._results.executor import WorkerPool


@pytest.mark.parametrize(("n", "threads", "first"), [(10_000, 2, 1256), (100, 2, 56), (5, 4, 5)])
def test_slices_get_smaller_and_hold_whole_vectors(n, threads, first):
    slices = list(WorkerPool(threads).yield_slice_bounds(n))
    sizes = [end - begin for begin, end in slices]
    assert sizes[0] == first and sum(sizes) == n
    assert [begin for begin, _ in slices[1:]] == [end for _, end in slices[:-1]]
    assert sizes == sorted(sizes, reverse=True) and all(size % 8 == 0 for size in sizes[:-1])


def test_slices_have_a_largest_size():
    assert next(WorkerPool(1).yield_slice_bounds(10**6)) == (0, 1 << 15)


TOPS = kr.scenes.asymmetric.vary(gravity=np.linspace(0.5, 1.0, 64))
RUNS = {  # every way to run the tops of an ensemble
    "lanes": lambda **more: kr.solve(TOPS, 3000.0, **more),
    "one by one": lambda **more: kr.solve(TOPS, 300.0, events=[], **more),
    "reductions": lambda **more: kr.reduce(TOPS, 3000.0, {"spin": "max"}, **more),
    "sections": lambda **more: kr.section(TOPS, n=1000, **more),
    "tangents": lambda **more: kr.megno(TOPS, 300.0, **more),
    "step search": lambda **more: kr.solve(TOPS, 5.0, "geometric", error=1e-6, **more),
}


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("run", RUNS)
def test_progress_is_called_in_the_calling_thread_and_ends_with_one(run, threads):
    calls = []
    RUNS[run](threads=threads, progress=lambda part: calls.append((threading.get_ident(), part)))
    parts = [part for _, part in calls]
    assert {thread for thread, _ in calls} == {threading.get_ident()}
    assert parts == sorted(parts) and parts[0] >= 0.0 and parts[-1] == 1.0


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("run", RUNS)
def test_an_exception_in_progress_ends_the_run(run, threads):
    def stop(part):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        RUNS[run](threads=threads, progress=stop)


def test_sections_do_not_depend_on_threads():
    first, *others = (kr.section(TOPS, n=50, threads=n) for n in (1, 2, 5))
    assert all(np.array_equal(first.states, other.states) for other in others)
