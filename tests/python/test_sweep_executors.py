"""Tests that all executors of sweeps compute the same results."""

import logging
import multiprocessing
import os
import pickle
import threading
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from crashing_worker import kill_once
from distributed import Client, LocalCluster
from kreisel._sweep import runner, store
from sweeps import PARTS, REDUCED, SOCKETS_LEFT, SOURCE, WATCHED, hash_rows, run_sweep

pytestmark = pytest.mark.filterwarnings(SOCKETS_LEFT)
WORDS = {"reduced": REDUCED, "watched": WATCHED}
SPAWN = multiprocessing.get_context("spawn")


@pytest.fixture(scope="module")
def hashes(tmp_path_factory):
    """Run each sweep in a single thread, and return hashes of the results by sweep name."""
    place = tmp_path_factory.mktemp("hashes")
    for name, words in WORDS.items():
        sweep = run_sweep(place / name, words, threads=1)
        assert sweep.missing == [] and len(sweep.present) == PARTS
        assert 0 < (sweep["status"] != 0).sum() < sweep.size
    return {name: hash_rows(place / name) for name in WORDS}


@pytest.fixture(scope="module")
def cluster():
    quiet = logging.getLogger("distributed")
    before, quiet.level = quiet.level, logging.CRITICAL + 1
    with (
        LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL + 1,
        ) as local_cluster,
        Client(local_cluster) as client,
    ):
        yield client
    quiet.level = before


@pytest.mark.parametrize("name", WORDS)
def test_results_do_not_depend_on_threads(tmp_path, hashes, name):
    words = WORDS[name]
    run_sweep(tmp_path / "two", words, threads=2)
    with ThreadPoolExecutor(2) as pool:
        run_sweep(tmp_path / "pool", words, executor=pool)
    assert {hash_rows(tmp_path / each) for each in ("two", "pool")} == {hashes[name]}


def test_results_do_not_depend_on_processes(tmp_path, hashes):
    with ProcessPoolExecutor(2, SPAWN) as pool:
        for name, words in WORDS.items():
            run_sweep(tmp_path / name, words, executor=pool)
            assert hash_rows(tmp_path / name) == hashes[name]


@pytest.mark.parametrize("name", WORDS)
def test_results_do_not_depend_on_a_cluster(tmp_path, hashes, cluster, name):
    run_sweep(tmp_path, WORDS[name], executor=cluster.get_executor())
    assert hash_rows(tmp_path) == hashes[name]


@pytest.mark.parametrize("name", WORDS)
def test_results_do_not_depend_on_the_order_of_jobs(tmp_path, hashes, name):
    for i in reversed(range(PARTS)):
        sweep = run_sweep(tmp_path, WORDS[name], parts=range(i, i + 1))
        assert sweep.missing == [*range(i)]
    assert hash_rows(tmp_path) == hashes[name]


@pytest.mark.parametrize("moment", ["moves", "writes"])
def test_a_killed_worker_loses_only_its_own_part(tmp_path, hashes, moment):
    flag, place = str(tmp_path / "killed"), tmp_path / "runs"
    with (
        ProcessPoolExecutor(2, SPAWN, initializer=kill_once, initargs=(flag, moment)) as pool,
        pytest.raises(RuntimeError, match=r"failed with [1-5] parts? left.*repeating the call"),
    ):
        run_sweep(place, executor=pool)
    sweep = kr.read_sweep(place)
    assert os.path.exists(flag) and 2 in sweep.missing
    assert {file.name for file in place.glob("*.parquet")} == {
        f"part-{i:06}.parquet" for i in sweep.present
    }
    run_sweep(place)
    assert hash_rows(place) == hashes["reduced"]


@pytest.mark.parametrize("moment", ["moves", "writes"])
def test_a_cluster_recomputes_the_part_of_a_killed_worker(tmp_path, hashes, cluster, moment):
    flag, place = str(tmp_path / "killed"), tmp_path / "runs"
    cluster.run(kill_once, flag, moment)
    run_sweep(place, executor=cluster.get_executor())
    assert os.path.exists(flag) and hash_rows(place) == hashes["reduced"]


class LosingExecutor(Executor):
    """An executor that repeatedly loses the result of one task."""

    def __init__(self, times, result):
        self.left, self.result = times, result

    def submit(self, make, folder, i, *more):
        future = Future()
        if i == 3 and self.left:
            self.left -= 1
            if self.result is None:
                future.cancel()
                future.set_running_or_notify_cancel()
            else:
                future.set_result(self.result)
        else:
            future.set_result(make(folder, i, *more))
        return future


@pytest.mark.parametrize("result", [None, "done"])
def test_a_lost_part_is_tried_twice_and_then_reported(tmp_path, hashes, result):
    with pytest.raises(RuntimeError, match="lost 1 part, the first of them part 3;"):
        run_sweep(tmp_path, executor=LosingExecutor(2, result))
    assert kr.read_sweep(tmp_path).missing == [3]
    run_sweep(tmp_path, executor=LosingExecutor(1, result))
    assert hash_rows(tmp_path) == hashes["reduced"]


def test_a_failed_part_stops_the_sweep_and_keeps_stored_parts(tmp_path, monkeypatch):
    write_part = store.SweepStore.write_part

    def fail_to_write(self, i, rows):
        if i == 3:
            raise OSError(28, "No space left on device", str(self.part_file_path(i)))
        return write_part(self, i, rows)

    monkeypatch.setattr(store.SweepStore, "write_part", fail_to_write)
    with pytest.raises(OSError, match=r"No space left on device.*part-000003"):
        run_sweep(tmp_path / "alone")
    assert kr.read_sweep(tmp_path / "alone").present == [0, 1, 2]
    with (
        ThreadPoolExecutor(1) as pool,
        pytest.raises(OSError, match=r"No space left on device.*part-000003"),
    ):
        run_sweep(tmp_path / "pool", executor=pool)
    # the worker may begin part 4 before the sweep stops
    assert kr.read_sweep(tmp_path / "pool").present in ([0, 1, 2], [0, 1, 2, 4])


@pytest.mark.parametrize("executor", [None, ThreadPoolExecutor])
def test_ctrl_c_keeps_stored_parts_and_the_same_call_resumes(
    tmp_path, hashes, monkeypatch, executor
):
    def stop(share):
        if share > 0.5:
            raise KeyboardInterrupt

    monkeypatch.setattr(runner, "_PROGRESS_SECONDS", 0.0)
    pool = executor and executor(1)
    with pytest.raises(
        kr.SweepInterrupted, match=r"[0-3] of 5 parts are left; repeating the call"
    ) as interruption:
        run_sweep(tmp_path, executor=pool, progress=stop)
    sweep = interruption.value.sweep
    assert f"interrupted: {len(sweep.missing)} of 5" in str(interruption.value) and sweep.present
    assert pickle.loads(pickle.dumps(interruption.value)).sweep.present == sweep.present
    assert sweep.missing or pool
    run_sweep(tmp_path)
    assert hash_rows(tmp_path) == hashes["reduced"]


def test_parts_cancelled_by_ctrl_c_are_not_stored_later(tmp_path, monkeypatch):
    write_part, interrupt = store.SweepStore.write_part, threading.Event()

    def write_late(self, i, rows):
        assert i == 0 or interrupt.wait(60)
        return write_part(self, i, rows)

    def stop(_):
        interrupt.set()
        raise KeyboardInterrupt

    monkeypatch.setattr(store.SweepStore, "write_part", write_late)
    with ThreadPoolExecutor(1) as pool, pytest.raises(kr.SweepInterrupted) as interruption:
        run_sweep(tmp_path, executor=pool, progress=stop)
    assert kr.read_sweep(tmp_path).present == interruption.value.sweep.present


def test_progress_rises_to_one_and_counts_the_tops_of_this_call(tmp_path):
    reports = []
    run_sweep(tmp_path, parts=range(2))
    run_sweep(tmp_path, progress=reports.append)
    assert reports == sorted(reports) and reports[-1] == 1.0 and reports[0] > 0.0
    reports.clear()
    run_sweep(tmp_path, progress=reports.append)  # in this call no part is left to compute
    assert reports == []


def test_progress_of_an_executor_ends_with_one(tmp_path, monkeypatch):
    monkeypatch.setattr(runner, "_PROGRESS_SECONDS", np.inf)
    reports = []
    run_sweep(tmp_path, executor=LosingExecutor(0, None), progress=reports.append)
    assert reports == [1.0]


def test_a_part_depends_only_on_the_plan_and_its_number(tmp_path):
    one, other = tmp_path / "one", tmp_path / "other"
    run_sweep(one)
    run_sweep(other, parts=range(4, 5), threads=1)
    name = "part-000004.parquet"
    assert (one / name).read_bytes() == (other / name).read_bytes()
    tops = SOURCE[256:300]
    limit = REDUCED["max_steps"]
    alone = kr.reduce(tops, REDUCED["t"], REDUCED["reduce"], max_steps=limit)
    part = kr.read_sweep(other).part(4)
    assert np.array_equal(part["nutation_max"], alone["nutation"]["max"], equal_nan=True)
    assert np.array_equal(part["status"], alone.status)
