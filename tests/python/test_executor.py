"""Tests of how ensembles are divided among threads."""

import pickle
import threading
from concurrent.futures import Executor, Future

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits
from kreisel._results import executor
from kreisel._results.executor import WorkerPool
from kreisel._solve import step_search


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


class CopyingExecutor(Executor):
    """An executor that runs each task when it is submitted, using pickled arguments."""

    def submit(self, function, *arguments):
        made = Future()
        copied, given = pickle.loads(pickle.dumps((function, arguments)))
        made.set_result(copied(*given))
        return made


@pytest.mark.parametrize(
    "words",
    [{}, {"method": "geometric", "error": 1e-6}, {"want": ["energy"]}, {"method": "taylor"}],
    ids=["auto", "step search", "want", "taylor"],
)
def test_workers_that_share_no_memory_give_the_same_bits(words):
    paths = kr.solve(TOPS, [0.0, 1.0, 2.0], executor=CopyingExecutor(), **words)
    expected = kr.solve(TOPS, [0.0, 1.0, 2.0], **words)
    assert same_bits(paths.energy, expected.energy)
    assert same_bits(paths.steps, expected.steps) and (paths.status == 0).all()


def test_progress_counts_the_tops_of_workers_that_share_no_memory(monkeypatch):
    monkeypatch.setattr(executor, "PROGRESS_SECONDS", 0.0)
    monkeypatch.setattr(executor, "SLICES_AHEAD", 1)
    calls = []
    tops = kr.scenes.asymmetric.vary(gravity=np.linspace(0.5, 1.0, 2000))
    kr.solve(tops, 0.1, executor=CopyingExecutor(), progress=calls.append)
    assert len(calls) > 3 and 0.0 < calls[0] < 1.0 and calls == sorted(calls) and calls[-1] == 1.0
    assert all(round(2000 * part) % 8 == 0 for part in calls)


def interrupt(part):
    if part > 0.0:
        raise KeyboardInterrupt


INTERRUPTED = {  # the call, the status of success, and the name of the results
    "indicator": (lambda tops, **more: kr.megno(tops, 20.0, **more), "OK", "curve"),
    "step search": (
        lambda tops, **more: kr.solve(tops, 5.0, "geometric", error=1e-6, **more), 0, "states",
    ),
}  # fmt: skip


@pytest.mark.parametrize("run, success, name", INTERRUPTED.values(), ids=INTERRUPTED)
def test_an_interrupted_call_keeps_the_tops_that_ended(monkeypatch, run, success, name):
    monkeypatch.setattr(executor, "PROGRESS_SECONDS", 0.0)
    # Far more slices than are submitted at a time, so that some tops remain.
    tops = kr.scenes.asymmetric.vary(gravity=np.linspace(0.5, 1.0, 4000))
    with pytest.raises(KeyboardInterrupt) as stopped:
        run(tops, threads=2, progress=interrupt)
    assert isinstance(stopped.value, kr.Interrupted)
    found = stopped.value.paths
    ended = found.status == success
    assert 0 < ended.sum() < 4000
    assert np.array_equal(getattr(found, name)[ended], getattr(run(tops[ended]), name))


@pytest.mark.parametrize("words", [{"threads": 1}, {"executor": CopyingExecutor()}])
def test_ctrl_c_in_a_trial_run_ends_the_step_search(monkeypatch, words):
    real, calls = step_search._find_path_by_step_search, []

    def find_or_stop(scene, *given):
        calls.append(scene)
        if len(calls) == 20:
            raise kr.Interrupted("a trial run", "ERR_INTERRUPTED", kr.solve(scene, []))
        return real(scene, *given)

    monkeypatch.setattr(step_search, "_find_path_by_step_search", find_or_stop)
    with pytest.raises(KeyboardInterrupt) as stopped:
        kr.solve(TOPS, 1.0, "geometric", error=1e-6, **words)
    assert isinstance(stopped.value, kr.Interrupted)
    assert len(calls) == 20 and calls[-1] == TOPS[19]
    assert (stopped.value.paths.status == 0).sum() == (19 if "threads" in words else 0)


def test_a_step_search_without_times_has_no_states():
    paths = kr.solve(TOPS, [], "geometric", error=1e-6)
    assert paths.states.shape == (64, 0, 8) and (paths.status == 0).all()
    at, count = step_search._find_indices_of_times(paths[0], np.array([1.0]))
    assert len(at) == count == 0


@pytest.mark.parametrize(
    "run",
    [
        lambda progress: kr.solve(TOPS, 1.0, executor=CopyingExecutor(), progress=progress),
        lambda progress: kr.megno(TOPS, 1.0, threads=2, progress=progress),
    ],
    ids=["solve", "megno"],
)
def test_ctrl_c_after_the_last_top_is_not_hidden(monkeypatch, run):
    monkeypatch.setattr(executor, "PROGRESS_SECONDS", 0.0)

    def interrupt_at_end(part):
        if part == 1.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as stopped:
        run(interrupt_at_end)
    assert type(stopped.value) is KeyboardInterrupt
