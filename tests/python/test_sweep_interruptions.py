"""Tests of sweeps on executors, and of sweeps that are killed, stopped or run out of disk."""

import multiprocessing
import os
import pickle
import random
import signal
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor

import kreisel as kr
import pytest
from sweeps import LOW, PARTS, REDUCED, fork, hash_rows, kill_worker_once, make_replace, run_sweep

SPAWN = multiprocessing.get_context("spawn")
TASKS = {
    "reduced": REDUCED,
    "watched": {"t": [0.5, 4.0], "method": "taylor", "events": [LOW], "part_size": 7},
    "megno": {"task": "megno", "t": [-1, -3.5], "part_size": 7},
    "section": {"task": "section", "n": 5, "max_wait": -4, "part_size": 7},
}


@pytest.fixture(scope="module")
def hashes(tmp_path_factory):
    """Run each sweep in a single thread, and return hashes of the results by task."""
    folder = tmp_path_factory.mktemp("hashes")
    for name, words in TASKS.items():
        assert len(run_sweep(folder / name, words, threads=1).present) == PARTS
    return {name: hash_rows(folder / name) for name in TASKS}


@pytest.fixture(autouse=True)
def default_handler():
    """Let SIGINT raise KeyboardInterrupt, as it does not in tests that run in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_results_do_not_depend_on_processes(tmp_path, hashes):
    with ProcessPoolExecutor(1, SPAWN) as pool:
        for name, words in TASKS.items():
            run_sweep(tmp_path / name, words, executor=pool)
    assert {name: hash_rows(tmp_path / name) for name in TASKS} == hashes


def test_a_killed_worker_loses_only_its_own_part(tmp_path, hashes):
    flag, place = str(tmp_path / "killed"), tmp_path / "runs"
    with (
        ProcessPoolExecutor(1, SPAWN, initializer=kill_worker_once, initargs=(flag,)) as pool,
        pytest.raises(RuntimeError, match=r"failed with 3 parts left.*repeating the call"),
    ):
        run_sweep(place, executor=pool)
    assert os.path.exists(flag) and kr.read_sweep(place).check().present == [0, 1]
    run_sweep(place)
    assert hash_rows(place) == hashes["reduced"] and not list(place.glob(".*"))


class LosingExecutor(Executor):
    """An executor that cancels one task a few times."""

    def __init__(self, times):
        self.times = times

    def submit(self, make, folder, i, *more):
        future = Future()
        if i == 3 and self.times:
            self.times -= 1
            future.cancel()
            future.set_running_or_notify_cancel()
        else:
            future.set_result(make(folder, i, *more))
        return future


def test_a_lost_part_is_tried_twice_and_then_reported(tmp_path, hashes):
    with pytest.raises(RuntimeError, match="lost 1 part, the first of them part 3;"):
        run_sweep(tmp_path, executor=LosingExecutor(2))
    assert kr.read_sweep(tmp_path).missing == [3]
    run_sweep(tmp_path, executor=LosingExecutor(1))
    assert hash_rows(tmp_path) == hashes["reduced"]


WAYS = [{"threads": 1}, {"threads": 2}, {"executor": ThreadPoolExecutor}]


def start_executor(words):
    return {"executor": words["executor"](1)} if "executor" in words else words


def fill_disk():
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize(("name", "words"), [*zip(TASKS, [*WAYS, WAYS[0]], strict=True)])
def test_ctrl_c_keeps_stored_parts_and_the_same_call_resumes(
    tmp_path, hashes, monkeypatch, name, words
):
    """Interrupt a sweep when a part drawn at random is being written."""
    last = random.Random(name).randrange(PARTS - 1)
    with monkeypatch.context() as patch, pytest.raises(kr.Interrupted) as interruption:
        patch.setattr(os, "replace", make_replace(last, lambda: os.kill(os.getpid(), 2)))
        run_sweep(tmp_path, TASKS[name], **start_executor(words))
    error, sweep = interruption.value, interruption.value.result
    assert isinstance(error, KeyboardInterrupt) and "repeating the call" in str(error)
    assert f"{len(sweep.missing)} of 5 parts are left" in str(error)
    assert kr.read_sweep(tmp_path).check().present == sweep.present == [*range(len(sweep.present))]
    assert len(sweep.present) >= last
    assert pickle.loads(pickle.dumps(error)).result.present == sweep.present
    run_sweep(tmp_path, TASKS[name])
    assert hash_rows(tmp_path) == hashes[name]


@pytest.mark.parametrize("words", WAYS)
def test_a_full_disk_stops_the_sweep_and_keeps_stored_parts(tmp_path, hashes, monkeypatch, words):
    with monkeypatch.context() as patch, pytest.raises(OSError, match="No space left on device"):
        patch.setattr(os, "replace", make_replace(3, fill_disk))
        run_sweep(tmp_path, **start_executor(words))
    sweep = kr.read_sweep(tmp_path).check()
    # a worker may begin part 4 before the sweep stops
    assert sweep.present in ([0, 1, 2], [0, 1, 2, 4]) and not list(tmp_path.glob(".*"))
    run_sweep(tmp_path)
    assert hash_rows(tmp_path) == hashes["reduced"]


@pytest.mark.parametrize(
    ("number", "moment"),
    [(signal.SIGKILL, "fsync"), (signal.SIGKILL, "replace"), (signal.SIGINT, "fsync")],
)
def test_a_stopped_process_leaves_whole_parts(tmp_path, hashes, number, moment):
    call, stops = getattr(os, moment), []

    def stop_at_part_2(*words):
        if list(tmp_path.glob("part-000001*")) and not stops:
            stops.append(number)
            os.kill(os.getpid(), number)
        return call(*words)

    def sweep():
        setattr(os, moment, stop_at_part_2)
        run_sweep(tmp_path, threads=1)

    code = fork(sweep)
    found = kr.read_sweep(tmp_path).check()
    if number == signal.SIGKILL:
        assert code == -number and found.present == [0, 1]
        assert len(list(tmp_path.glob(".*.new"))) == (moment == "replace")
    else:
        assert code == 200 + len(found.missing) > 200
    run_sweep(tmp_path)
    assert hash_rows(tmp_path) == hashes["reduced"] and not list(tmp_path.glob(".*"))


def test_processes_and_threads_may_sweep_one_folder(tmp_path, hashes):
    folder = tmp_path / "runs"
    with ThreadPoolExecutor(3) as pool:
        process = pool.submit(fork, lambda: run_sweep(folder, threads=1))
        for sweep in pool.map(lambda _: run_sweep(folder, threads=1), range(2)):
            assert sweep.missing == []
        assert process.result() == 0
    names = [f"part-{i:06}.parquet" for i in range(PARTS)]
    assert sorted(os.listdir(folder)) == [*names, "plan.json"]
    assert hash_rows(folder) == hashes["reduced"]


@pytest.mark.parametrize("words", WAYS)
def test_progress_rises_to_one_and_counts_the_tops_of_this_call(tmp_path, words):
    reports = []
    run_sweep(tmp_path, parts=range(2), **start_executor(words))
    run_sweep(tmp_path, progress=reports.append, **start_executor(words))
    assert reports == sorted(reports) and reports[-1] == 1.0 and reports[0] >= 0.0
    reports.clear()
    run_sweep(tmp_path, progress=reports.append)  # no part is left to compute
    assert reports == []


def test_an_exception_of_progress_stops_the_sweep(tmp_path):
    def stop(share):
        raise ArithmeticError

    with pytest.raises(ArithmeticError):
        run_sweep(tmp_path, progress=stop)
    assert run_sweep(tmp_path).missing == []
