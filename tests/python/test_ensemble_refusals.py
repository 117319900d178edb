"""Tests that ensembles reject invalid arguments and can be interrupted."""

import contextlib
import signal
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from ensembles import MIXED, SCENES, TIMES, UNDAMPED, random_ensemble, same

SPIN = {"spin": "max"}
SHAPE = (len(MIXED), len(TIMES), 8)


def verb_of(words):
    return kr.reduce if "reductions" in words else kr.solve


@pytest.mark.parametrize(
    ("words", "kind", "message"),
    [
        (
            {"method": "exact"},
            ValueError,
            r"top\[0\], the first of 3 such members: the method 'exa",
        ),
        ({"method": "strang", "step": 0.1}, ValueError, r"top\[5\]: the method 'strang' does not"),
        ({"method": "tailor"}, ValueError, "did you mean 'taylor'"),
        ({"method": 3}, TypeError, "method must be a name"),
        ({"method": "geometric"}, ValueError, "give the allowed error"),
        ({"method": "geometric", "error": 1e-3, "tol": 1e-3}, ValueError, "leave tol out"),
        ({"error": 1e-3}, ValueError, "error is for method='geometric'"),
        ({"tol": -1}, ValueError, "tol must be positive"),
        ({"digits": 31}, ValueError, "at most 30"),
        ({"every": 2}, ValueError, "every needs a method of fixed step"),
        ({"max_steps": -1}, ValueError, "max_steps must be at least 0"),
        ({"want": ["nutatio"]}, ValueError, "did you mean 'nutation'"),
        ({"threads": 0}, ValueError, "threads must be at least 1"),
        ({"threads": 1.5}, TypeError, "threads must be a whole number"),
        ({"executor": 3}, TypeError, "executor must be one of concurrent.futures"),
        ({"progress": 3}, TypeError, "progress must be a function"),
        ({"events": [3]}, TypeError, "events must be an event"),
        ({"events": [kr.events.loop()], "method": "rk4"}, ValueError, "rk4"),
        ({"reductions": {"nutatio": "max"}}, ValueError, "did you mean 'nutation'"),
        ({"reductions": {"q_low": "max"}}, ValueError, "unknown quantity in reductions"),
        ({"reductions": {"spin": "maxx"}}, ValueError, "did you mean 'max'"),
        ({"reductions": {"spin": []}}, ValueError, "is empty"),
        ({"reductions": {"spin": 3}}, TypeError, "must be one or several"),
        ({"reductions": {}}, ValueError, "name no quantity"),
        ({"reductions": ["spin"]}, TypeError, "reductions must name quantities"),
        ({"reductions": None}, TypeError, "reductions must name quantities"),
        ({"reductions": SPIN, "digits": 20}, ValueError, "at most 16 digits"),
        ({"out": [1.0]}, TypeError, "out must be a NumPy array"),
        ({"out": np.empty((1, 4, 8))}, ValueError, r"of shape \(6, 4, 8\)"),
        ({"out": np.empty(SHAPE, np.float32)}, ValueError, "of float64"),
        ({"out": np.empty(SHAPE[::-1]).T}, ValueError, "C order"),
        ({"out": np.empty(SHAPE), "want": ["spin"]}, ValueError, "out receives states"),
    ],
)
def test_invalid_arguments_are_refused(words, kind, message):
    with pytest.raises(kind, match=message):
        verb_of(words)(MIXED, TIMES, **words)


@pytest.mark.parametrize(
    ("t", "message"),
    [
        (float("nan"), "t must be finite"),
        ([0.0, np.inf], r"t\[1\] = inf"),
        ([1.0, 0.5], r"t\[1\] = 0.5 goes back"),
        (np.ones((5, 4)), r"of shape \(6, 'k'\)"),
        (np.ones((6, 1, 1)), r"of shape \(6, 'k'\)"),
        ([[1.0], [2.0, 3.0]], "t must be a number"),
        (
            np.array([[1.0, 2.0]] * 4 + [[1.0, 0.5]] * 2),
            r"t\[4, 1\] = 0.5 goes back from t\[4, 0\]",
        ),
        (
            np.array([[1.0, 2.0]] * 3 + [[1.0, -2.0]] * 3),
            r"t\[3, 0\] = 1.0 goes back from the start",
        ),
    ],
)
def test_invalid_times_are_refused(t, message):
    with pytest.raises(ValueError, match=message):
        kr.solve(MIXED, t)


def test_requests_beyond_the_memory_are_refused():
    many = kr.Ensemble(
        SCENES[0].body, momentum=np.broadcast_to([0.0, 0.0, 1.0], (10**6, 3)), gravity=1
    )
    with pytest.raises(MemoryError, match="with 10000001 states each need"):
        kr.solve(many, 1e5, "strang", step=0.01, every=1)
    with pytest.raises(ValueError, match="more steps"):
        kr.solve(many, np.full((10**6, 1), 1e300), "strang", step=1e-9)


def test_ensemble_arguments_are_refused_for_single_scenes():
    for verb in (kr.solve, kr.stream):
        with pytest.raises(ValueError, match=r"threads: only for a kreisel\.Ensemble"):
            verb(SCENES[0], [1.0], threads=2)
    with pytest.raises(ValueError, match="threads and out"):
        kr.solve(SCENES[0], [1.0], threads=2, out=np.empty(3))
    with pytest.raises(ValueError, match="threads and reduce"):
        kr.plan(SCENES[0], [1.0], threads=2, reduce=SPIN)


def test_functions_of_one_top_refuse_ensembles():
    for verb in (kr.start, lambda tops: kr.compare(tops, 1), kr.events.separatrix):
        with pytest.raises(TypeError, match=r"kreisel.Scene, .* select one member by its index"):
            verb(MIXED)
    with pytest.raises(TypeError, match="not an iterator"):
        kr.stream(MIXED, iter([1.0]))
    with pytest.raises(ValueError, match=r"see path\.plan"):
        kr.plan(MIXED, method="geometric")


def test_no_tops_and_no_times_give_empty_results():
    no_tops = MIXED[:0]
    for words in ({}, {"digits": 20}, {"events": kr.events.loop()}, {"want": ["apex"]}):
        reports = []
        paths = kr.solve(no_tops, TIMES, progress=reports.append, **words).check()
        assert len(paths) == 0 and paths.apex.shape == (0, 4, 3) and reports == [1.0]
    assert kr.reduce(no_tops, 1.0, SPIN)["spin"]["max"].shape == (0,)
    assert kr.solve(no_tops, 1.0, "geometric", error=1e-3).q.shape == (0, 2, 4)
    assert kr.exact(no_tops)([1.0, 2.0]).shape == (0, 2, 8) and list(kr.stream(no_tops, 1.0)) == []
    no_times = kr.solve(MIXED, [])
    assert no_times.q.shape == (6, 0, 4) and not no_times.failed.size and len(no_times[0]) == 0
    assert np.isnan(kr.reduce(MIXED, [], SPIN)["spin"]["max"]).all()


TOPS = random_ensemble(400)
LONG = np.linspace(0.0, 1e6, 101)  # this run would take minutes


@contextlib.contextmanager
def send_sigint(delay):
    """Raise KeyboardInterrupt after `delay` seconds, with the signal handler of SIGINT."""
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, delay)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def short_and_long_times(n):
    """Return short integration times for the first 40 tops, and long ones for the other tops."""
    times = np.tile(LONG, (n, 1))
    times[:40] *= 1e-6
    return times


@pytest.mark.parametrize("words", [{}, {"digits": 20}, {"want": ["nutation"]}, {"threads": 1}])
def test_ctrl_c_keeps_finished_members(words):
    with send_sigint(0.3), pytest.raises(kr.Interrupted, match=r"top\[\d+\], .*interr") as stop:
        kr.solve(TOPS, short_and_long_times(400), "taylor", **words)
    paths = stop.value.paths
    is_complete = paths.status == 0
    assert 0 < is_complete.sum() < 400 and set(paths.status_names[~is_complete]) == {
        "ERR_INTERRUPTED"
    }
    nutation = paths.nutation
    assert (
        np.isfinite(nutation[is_complete]).all() and np.isnan(nutation[~is_complete][:, -1]).all()
    )
    finished = kr.solve(
        TOPS[is_complete], short_and_long_times(400)[is_complete], "taylor", **words
    )
    assert np.array_equal(finished.nutation, nutation[is_complete])
    first = int(paths.failed[0])
    assert stop.value.status == "ERR_INTERRUPTED" and stop.value.path.t[-1] == paths.reached[first]


def test_ctrl_c_interrupts_a_thread_that_waits_for_another():
    times = short_and_long_times(64) * 1e-6
    times[-1] *= 1e6  # the thread with this top runs long, the other thread finishes immediately
    for _ in range(4):  # either of the threads may have this top
        with send_sigint(0.3), pytest.raises(kr.Interrupted) as stop:
            kr.solve(TOPS[:64], times, "taylor", threads=2)
        assert list(stop.value.paths.failed) == [63]


def test_ctrl_c_is_reported_together_with_failed_tops():
    times = short_and_long_times(400)
    times[0, -1] = 1e300  # a double cannot resolve the attitude at this time
    with send_sigint(0.3), pytest.raises(kr.Interrupted) as stop:
        kr.solve(TOPS, times)
    paths = stop.value.paths
    assert paths.status_names[0] == "ERR_RESOLUTION" and paths.failed[0] == 0
    assert "ERR_INTERRUPTED" in paths.status_names


@pytest.mark.parametrize("words", [{"method": "geometric", "error": 1e-9}, {"reductions": SPIN}])
def test_ctrl_c_ends_every_kind_of_request(words):
    with send_sigint(0.3), pytest.raises(kr.Interrupted) as stop:
        verb_of(words)(TOPS, 1e6, **words)
    assert len(stop.value.paths.status) == 400 and stop.value.paths.failed.size


@pytest.mark.parametrize("pool", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_ctrl_c_ends_the_work_of_an_executor(pool):
    with pool(2) as executor:
        times = short_and_long_times(400)
        # the test does not wait for the other processes, so they must end by themselves
        times[:] = np.minimum(times, 5e3)
        with send_sigint(0.3), pytest.raises(kr.Interrupted) as stop:
            kr.solve(TOPS, np.maximum.accumulate(times, axis=1), "taylor", executor=executor)
        assert stop.value.paths.failed.size
        for future in [executor.submit(int) for _ in range(2)]:
            future.cancel()


def test_progress_rises_to_one_and_may_stop_the_call():
    reports = []

    def stop(part):
        reports.append(part)
        if len(reports) == 3:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        kr.solve(TOPS, short_and_long_times(400), progress=stop)
    assert reports == sorted(reports) and 0.0 <= reports[0] <= reports[-1] < 1.0
    reports.clear()
    kr.solve(TOPS, 1.0, progress=reports.append)
    assert reports[-1] == 1.0


def test_several_threads_may_solve_at_once():
    results = []
    threads = [threading.Thread(target=lambda: results.append(kr.solve(TOPS, TIMES))) for _ in "ab"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 2 and same(*results)


def test_closed_forms_of_an_ensemble_equal_those_of_members():
    tops = kr.scenes.cusps.vary(spin=np.linspace(5, 20, 4)[:, None], tilt=np.linspace(0.1, 1, 3))
    forms = kr.exact(tops)
    own = np.random.default_rng(3).normal(size=(4, 3, 5))
    for i in np.ndindex(4, 3):
        one = kr.exact(tops[i])
        for word in (
            "period",
            "precession_rate",
            "spin_angle_rate",
            "least_nutation",
            "t_greatest",
            "motion_type",
        ):
            assert getattr(forms, word)[i] == getattr(one, word)
        for t in ([0.0, 1.0], [1.0, 2.0, 5.0], [3.0, -1.0, 0.0, -7.0], [], [-1.0, -2.0]):
            assert np.array_equal(forms(t)[i], one(t).states)
        assert np.array_equal(forms(2.5)[i], one(2.5).states[0])
        assert np.array_equal(forms(own)[i], one(own[i]).states)
    with pytest.raises(ValueError, match=r"top\[0\], the first of 2 such: no closed form"):
        kr.exact(UNDAMPED[[0, 2]])
    with pytest.raises(ValueError, match=r"top\[0, 0\]: by t = 1e\+300"):
        forms(1e300)
    with pytest.raises(ValueError, match=r"of shape \(4, 3, 'k'\)"):
        forms(np.ones((3, 4, 2)))
    with pytest.raises(ValueError, match=r"top\[1\]: turning points exist for"):
        _ = kr.exact(kr.Ensemble.of([SCENES[1], kr.scenes.dzhanibekov])).motion_type


def test_times_of_each_top_exclude_every():
    tops = kr.scenes.asymmetric.vary(gravity=[1.0, 2.0])
    with pytest.raises(ValueError, match="every needs t as a number"):
        kr.solve(tops, [[0.0, 1.0], [0.0, 2.0]], "rk4", step=0.1, every=2)
