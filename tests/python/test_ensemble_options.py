"""Tests of the threads and executors that ensembles use."""

from concurrent.futures import ThreadPoolExecutor

import kreisel as kr
import pytest
from kreisel._options import ensemble_options

THESIS = kr.scenes.thesis
MANY = THESIS.vary(spin=[1.0, 2.0, 3.0], tilt=[[0.2], [0.4]])


def test_threads_are_limited():
    assert [ensemble_options.validate_thread_count(n, None) for n in (1, 1024, 1025, 10**9)] == [
        1,
        1024,
        1024,
        1024,
    ]
    with pytest.raises(ValueError, match="threads must be"):
        ensemble_options.validate_thread_count(0, None)
    with ThreadPoolExecutor(1) as pool:
        available = ensemble_options.validate_thread_count(None, None)
        assert ensemble_options.validate_thread_count(None, pool) == available
        with pytest.raises(ValueError, match="give either threads or an executor, not both"):
            ensemble_options.validate_thread_count(1, pool)
        kr.solve(MANY, 1.0, executor=pool)


def test_all_processors_of_the_affinity_are_used(monkeypatch):
    monkeypatch.setattr(
        ensemble_options.os, "sched_getaffinity", lambda _: {1, 4, 5, 7, 9}, raising=False
    )
    assert ensemble_options.validate_thread_count(None, None) == 5


@pytest.mark.parametrize("count, threads", [(None, 1), (3, 3)])
def test_all_processors_are_used_if_affinity_is_unknown(monkeypatch, count, threads):
    monkeypatch.delattr(ensemble_options.os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(ensemble_options.os, "cpu_count", lambda: count)
    assert ensemble_options.validate_thread_count(None, None) == threads


@pytest.mark.parametrize("limit, expected", [(0, 100), (7, 7), (100, 100), (1000, 100)])
def test_a_trial_run_takes_no_more_steps_than_the_run(limit, expected):
    options = ensemble_options.validate_ensemble_options(MANY, "auto", max_steps=limit)
    limited = options.copy_with_step_limit(100)
    assert limited.solve.max_steps == expected and options.solve.max_steps == limit
