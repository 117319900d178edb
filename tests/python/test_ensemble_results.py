"""Tests of results of ensembles beyond the laws: failures, tables, plans, interruption."""

import contextlib
import pickle
import signal
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from drawn_tops import assert_same_bits, assert_same_path
from ensembles import MIXED, SCENES, TIMES, UNDAMPED, random_ensemble, same
from toolbox import python

GRID = kr.scenes.cusps.vary(spin=np.linspace(5, 20, 4)[:, None], tilt=np.linspace(0.1, 1, 3))
PATHS = kr.solve(GRID, TIMES)
LOW = kr.events.nutation(direction=1)
N = 120
TOPS = random_ensemble(N)
WHOLE = kr.solve(TOPS, TIMES)
SPIN = {"spin": "max"}


# Independence of threads, shapes and executors


def test_results_do_not_depend_on_threads_shapes_and_other_requests():
    square = kr.solve(TOPS.reshape(10, 12), TIMES)
    assert np.array_equal(square.states.reshape(N, len(TIMES), 8), WHOLE.states)
    assert same(square[3, 2:5], WHOLE[38:41])
    for selection in (slice(7, 8), slice(3, 100, 7), [5, 99, 5, 0], slice(None, None, -1)):
        assert same(kr.solve(TOPS[selection], TIMES), WHOLE[selection])
    more = kr.solve(TOPS, [0.0, 0.1, 0.5, 1.7, 2.0, 5.0])
    assert np.array_equal(more.states[:, [0, 2, 4, 5]], WHOLE.states)
    assert all(same(kr.solve(TOPS, TIMES, threads=threads), WHOLE) for threads in (1, 3))
    results = []
    threads = [threading.Thread(target=lambda: results.append(kr.solve(TOPS, TIMES))) for _ in "ab"]
    for go in (threading.Thread.start, threading.Thread.join):
        list(map(go, threads))
    assert len(results) == 2 and same(*results) and same(results[0], WHOLE)


def test_executors_report_the_same_results_failures_and_messages():
    square = TOPS[:40].reshape(5, 8)
    with ThreadPoolExecutor(2) as threads, ProcessPoolExecutor(2) as processes:
        assert same(kr.solve(TOPS, TIMES, executor=threads), WHOLE)
        assert same(kr.solve(TOPS, np.tile(TIMES, (N, 1)), executor=processes), WHOLE)
        for words in (
            {"digits": 20},
            {"events": [LOW]},
            {"want": ["nutation", "q_low"]},
            {"method": "taylor", "max_steps": 12},
            {"method": "geometric", "error": 1e-14},
        ):
            own = kr.solve(square, TIMES, **words)
            pooled = kr.solve(square, TIMES, executor=processes, **words)
            assert np.array_equal(own.status, pooled.status)
            for place in np.ndindex(5, 8):
                assert_same_path([own[place]], pooled[place])
                assert own.message(place) == pooled.message(place)
        one, other = (kr.reduce(TOPS, TIMES, SPIN, executor=pool) for pool in (None, processes))
        assert np.array_equal(one["spin"]["max"], other["spin"]["max"])


# Failed members


@pytest.mark.parametrize(
    "key",
    [
        np.s_[..., -1],
        np.s_[::2, 0, [3, 0, 3]],
        np.s_[[2, 0], :, 1],
        np.s_[GRID.coords["spin"][:, 0] > 9, -1, 1:],
    ],
)
def test_an_index_selects_tops_and_then_states(key):
    """Compare with the array of states, of which a whole number keeps its dimension."""
    *tops, rows = key
    keeps = (*tops, slice(rows, rows + 1 or None) if isinstance(rows, int) else rows)
    path, states = PATHS[key], PATHS.states[(*keeps, slice(None))]
    assert path.shape == states.shape[:-2]
    assert np.array_equal(path.states, states)
    assert np.array_equal(path.nutation, PATHS.nutation[keeps])
    assert np.array_equal(path.t, np.array(TIMES)[keeps[-1]])


def test_selected_states_keep_times_tangents_and_failures():
    own_times = np.outer(np.arange(1, 5), TIMES)
    paths = kr.solve(GRID[:, 0], own_times, tangents="gravity")
    assert np.array_equal(paths[:, 1:3].t, own_times[:, 1:3])
    assert np.array_equal(paths[:, -1].derivative("energy"), paths.derivative("energy")[:, -1:])
    wanted = kr.solve(GRID, TIMES, want=["nutation", "q"], events=LOW)
    assert np.array_equal(wanted[..., 2:].nutation, wanted.nutation[..., 2:])
    assert len(wanted[..., 2:].events) == 0 < len(wanted.events)
    failed = kr.solve(GRID[:, 0], [0.0, 1.0, 2000.0], "taylor", max_steps=50)
    assert failed[:, 1:].state_counts.tolist() == [1] * 4
    assert np.isnan(failed[:, ::-1].apex[:, 0]).all()
    assert failed[1, -1].t.tolist() == [failed.reached[1]]
    for key in (np.s_[0, 0, 0, 0], np.s_[..., None], np.s_[[0, 1], 0, [1, 2]], np.s_[0, 0, 9]):
        with pytest.raises(IndexError):
            PATHS[key]


def test_a_failed_member_is_reported_and_leaves_the_others_alone():
    paths = kr.solve(TOPS, TIMES, "taylor", max_steps=12)
    has_failed = paths.status != "OK"
    assert 0 < has_failed.sum() < N and paths.failed.tolist() == np.flatnonzero(has_failed).tolist()
    for selection in (has_failed, ~has_failed):
        assert same(paths[selection], kr.solve(TOPS[selection], TIMES, "taylor", max_steps=12))
    good = np.arange(len(TIMES)) < paths.state_counts[:, None]
    assert np.isnan(paths.q[~good]).all() and np.isnan(paths.energy[~good]).all()
    assert kr.attitude_error(paths.q[good], WHOLE.q[good]).max() < 1e-11
    assert set(paths.status[has_failed]) == {"ERR_LIMIT"} and (paths.stats.steps <= 12).all()
    with pytest.raises(kr.Error, match=rf"top\[{paths.failed[0]}\]") as error:
        paths.check()
    assert error.value.result is paths
    assert_same_path([error.value.path], paths[int(paths.failed[0])])
    for one in (PATHS, kr.solve(GRID, TIMES, want=["q"]), kr.solve(GRID, TIMES, digits=20)):
        assert_same_path([pickle.loads(pickle.dumps(one))[1, 2]], one[1, 2])
    again = pickle.loads(pickle.dumps(error.value))
    assert str(again) == str(error.value) and same(again.result, paths)
    words = {"method": "rk4", "step": 0.1, "max_steps": 20}
    with pytest.raises(kr.Error) as alone:
        kr.solve(UNDAMPED[1], [1.0, 9.0], **words)
    assert kr.solve(UNDAMPED, [1.0, 9.0], **words).message(1) == str(alone.value)
    reductions = kr.reduce(UNDAMPED, [1.0, 9.0], SPIN, **words)
    assert np.isnan(reductions["spin"]["max"]).all() and (reductions.state_counts == 1).all()
    with pytest.raises(kr.Error, match=r"top\[0\]") as error:
        reductions.check()
    assert error.value.path.t.tolist() == [reductions.reached[0]]


# Results


def test_quantities_events_and_streams_equal_those_of_the_paths():
    many = kr.solve(MIXED, TIMES)
    for name in ("apex", "frame", "nutation", "energy", "kowalewski", "spin_angle"):
        assert not getattr(many, name).flags.writeable
        for i in range(len(SCENES)):
            assert_same_bits(getattr(many, name)[i], getattr(many[i], name))
    own = kr.solve(MIXED.reshape(2, 3), 9.0, events=LOW)
    found = own.events
    assert np.array_equal(LOW.value(own)[1, 1], LOW.value(own[1, 1]))
    assert found.top.shape == (len(found), 2) and found.q.shape == (len(found), 4)
    assert np.array_equal(found.t[np.all(found.top == (1, 1), axis=1)], own[1, 1].events.t)
    assert own[1, [2, 0]].events.t.tolist() == [*own[1, 2].events.t, *own[1, 0].events.t]
    pieces = list(kr.stream(GRID, TIMES, chunk=20))
    assert [len(piece) for piece in pieces] == [5, 5, 2]
    states = np.concatenate([piece.states for piece in pieces])
    assert np.array_equal(states, PATHS.states.reshape(12, -1, 8))
    for name in ("torque", "states", "nutatio"):
        with pytest.raises(AttributeError):
            getattr(kr.solve(GRID, TIMES, want=["apex"]), name)
    out = np.full((4, 3, len(TIMES), 8), 7.0)
    paths = kr.solve(GRID, TIMES, out=out)
    assert np.shares_memory(paths.states, out) and np.array_equal(out, PATHS.states)


def test_no_tops_and_no_times_give_empty_results():
    no_tops = MIXED[:0]
    for words in ({}, {"digits": 20}, {"events": LOW}, {"want": ["apex"]}):
        paths = kr.solve(no_tops, TIMES, **words).check()
        assert len(paths) == 0 and paths.apex.shape == (0, 4, 3) and not len(paths.events)
    none = kr.solve(kr.scenes.cusps.vary(gravity=np.empty((0, 1))), [0.0, 1.0])
    assert none.to_pandas().empty and none.to_xarray("q").q.shape == (0, 1, 2, 4)
    assert kr.reduce(no_tops, 1.0, SPIN)["spin"]["max"].shape == (0,)
    assert kr.solve(no_tops, 1.0, "geometric", error=1e-3).q.shape == (0, 2, 4)
    assert kr.exact(no_tops)([1.0, 2.0]).states.shape == (0, 2, 8)
    no_times = kr.solve(MIXED, [])
    assert no_times.q.shape == (6, 0, 4) and not no_times.failed.size
    assert len(no_times[0]) == 0 == no_times[0].error
    assert np.isnan(kr.reduce(MIXED, [], SPIN)["spin"]["max"]).all()


@pytest.mark.parametrize("degrees", [False, True])
def test_tables_have_the_names_of_the_axes_and_units(degrees):
    pytest.importorskip("xarray")
    angle = "deg" if degrees else "rad"
    data = PATHS.to_xarray("apex", "nutation", degrees=degrees)
    assert data["apex"].dims == ("spin", "tilt", "time", "axis")
    assert data["nutation"].attrs["units"] == angle and data["time"].attrs["units"] == "T"
    factor = 180.0 / np.pi if degrees else 1.0
    np.testing.assert_allclose(data["nutation"], PATHS.nutation * factor, rtol=1e-15)
    kinds = {"nutation": "variance", "apex": "where_max", "m_x": "min"}
    reductions = kr.reduce(GRID, TIMES, kinds)
    table, frame = reductions.to_xarray(), reductions.to_pandas()
    assert table["nutation_variance"].attrs["units"] == "(rad)^2"
    assert table["apex_where_max"].attrs["units"] == "T" and len(frame) == 4 * len(reductions) == 12
    assert frame.attrs["units"]["m_x_min"] == "M L^2 T^-1"
    expected = reductions["apex"]["where_max"][..., 2].ravel()
    assert frame["apex_z_where_max"].tolist() == expected.tolist()
    varied = {"tilt": [[1.0], [2.0]], "shaking": [[0.1, 1, 0], [0.1, 2, 0]]}
    tops = kr.scenes.sleeping.vary(**varied, degrees=degrees)
    units = {"tilt": angle, "shaking": f"L, {angle}/T, {angle}"}
    for some in (tops, tops[1:], tops[[0, 1]], tops.reshape(4), pickle.loads(pickle.dumps(tops))):
        dataset = kr.reduce(some, 1.0, SPIN).to_xarray()
        assert {name: dataset[name].attrs["units"] for name in units} == units


def test_plans_count_tops_by_solver_and_bytes():
    plan = kr.plan(MIXED, TIMES, threads=2)
    assert (plan.closed_form, plan.lanes, plan.alone) == (3, 3, 0) and plan.seconds > 0.0
    assert kr.plan(MIXED, TIMES, digits=20).alone == 6 and kr.plan(MIXED).seconds is None
    small = kr.plan(MIXED, range(1000), reduce={"spin": "max"})
    assert small.size < kr.plan(MIXED, range(1000), want=["spin"]).size / 50


# Progress and interruption

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


def short_and_long_times(n=N, end=1e6):
    """Return short integration times for the first 40 tops, and long ones for the other tops."""
    times = np.tile(LONG * end / 1e6, (n, 1))
    times[:40] = LONG * 1e-6
    return times


@pytest.mark.parametrize("words", [{}, {"digits": 20}, {"want": ["nutation"]}, {"threads": 1}])
def test_ctrl_c_keeps_finished_members(words):
    with send_sigint(0.3), pytest.raises(kr.Interrupted, match=r"top\[\d+\]") as stop:
        kr.solve(TOPS, short_and_long_times(), "taylor", **words)
    paths = stop.value.result
    is_complete = paths.status == "OK"
    assert 0 < is_complete.sum() < N
    assert set(paths.status[~is_complete]) == {"ERR_INTERRUPTED"}
    times = short_and_long_times()[is_complete]
    finished = kr.solve(TOPS[is_complete], times, "taylor", **words)
    assert np.array_equal(finished.nutation, paths.nutation[is_complete])
    assert np.isnan(paths.nutation[~is_complete][:, -1]).all()
    assert stop.value.path.t[-1] == paths.reached[int(paths.failed[0])]


@pytest.mark.parametrize("pool", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_ctrl_c_ends_the_work_of_an_executor(pool):
    with pool(2) as executor:
        # the test does not wait for the other processes, so they must end by themselves
        times = short_and_long_times(end=4e4)
        times[0, -1] = 1e300  # a double cannot resolve the attitude at this time
        with send_sigint(0.3), pytest.raises(kr.Interrupted) as stop:
            kr.solve(TOPS, times, "taylor", executor=executor)
        names = stop.value.result.status
        assert "ERR_INTERRUPTED" in names
        assert names[0] == "ERR_RESOLUTION" or pool is ProcessPoolExecutor


def test_attitudes_in_single_precision_are_normalized():
    q = np.array([(1.0, 2.0, 3.0, 4.0), (1.0, 0.0, 0.0, 0.0)]) / [[30.0**0.5], [1.0]]
    tops = kr.Scene(SCENES[0].body, (0, 0, 1), attitude=q.astype(np.float32), gravity=1)
    np.testing.assert_allclose(kr.solve(tops, [0.0]).q[:, 0], q, rtol=0, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(tops.attitude, axis=1), 1.0, rtol=1e-15)
    one = kr.Scene(SCENES[0].body, (0, 0, 1), attitude=q[0].astype(np.float32), gravity=1)
    np.testing.assert_allclose(np.linalg.norm(one.attitude), 1.0, rtol=1e-15)
    assert one.attitude == tuple(tops[0].attitude)


def test_progress_rises_to_one_and_may_stop_the_call():
    reports = []

    def stop(part):
        reports.append(part)
        if len(reports) == 3:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        kr.solve(TOPS, short_and_long_times(), progress=stop)
    assert reports == sorted(reports) and 0.0 <= reports[0] <= reports[-1] < 1.0
    kr.solve(TOPS, 1.0, progress=reports.append)
    assert reports[-1] == 1.0


# Refusals: callable, valid arguments, argument, bad value, exception, word

SHAPE = (len(MIXED), len(TIMES), 8)
SOLVE, REDUCE = {"scene": MIXED, "t": TIMES}, {"scene": MIXED, "t": TIMES, "reductions": SPIN}
GEOMETRIC = SOLVE | {"method": "geometric", "error": 1e-3}
BACK = np.array([[1.0, 2.0]] * 4 + [[1.0, 0.5]] * 2)
UPWARD = np.broadcast_to([0.0, 0.0, 1.0], (10**6, 3))
MANY = kr.Scene(SCENES[0].body, UPWARD, gravity=1)
MILLION = {"scene": MANY, "method": "strang", "step": 0.01}
LOOP = []
LOOP.append(LOOP)
HELD = {"body": SCENES[0].body, "momentum": [(0, 0, 1)], "gravity": 1, "attitude": (1, 0, 0, 0)}
REFUSALS = [
    (kr.Scene.stack, {}, "scenes", LOOP, ValueError, "themselves"),
    (kr.Scene, HELD, "attitude_xyzw", (0, 0, 0, 1), ValueError, "not both"),
    (kr.solve, SOLVE, "method", "exact", ValueError, r"top\[0\]"),
    (kr.solve, SOLVE | {"step": 0.1}, "method", "strang", ValueError, r"top\[5\]"),
    (kr.solve, GEOMETRIC, "error", 0.5, ValueError, "0.1"),
    (kr.solve, SOLVE, "threads", 0, ValueError, "threads"),
    (kr.solve, SOLVE, "executor", 3, TypeError, "executor"),
    (kr.solve, SOLVE, "progress", 3, TypeError, "progress"),
    (kr.solve, SOLVE, "out", np.empty(SHAPE[::-1]).T, ValueError, "C order"),
    (kr.solve, SOLVE | {"want": ["spin"]}, "out", np.empty(SHAPE), ValueError, "out"),
    (kr.solve, SOLVE, "out", [[0.0]], TypeError, "NumPy array"),
    (kr.solve, SOLVE, "out", np.empty(SHAPE[1:]), ValueError, "float64 of shape"),
    (kr.solve, SOLVE | {"every": 2}, "t", np.ones((6, 1)), ValueError, "every"),
    (kr.solve, SOLVE, "t", [0.0, np.inf], ValueError, r"t\[1\]"),
    (kr.solve, SOLVE, "t", np.ones((5, 4)), ValueError, "shape"),
    (kr.solve, SOLVE, "t", BACK, ValueError, r"t\[4, 1\]"),
    (kr.solve, MILLION | {"every": 1}, "t", 1e5, MemoryError, "GB"),
    (kr.solve, MILLION, "t", 1e300, ValueError, "steps"),
    (kr.reduce, REDUCE, "reductions", {"nutatio": "max"}, ValueError, "nutation"),
    (kr.reduce, REDUCE, "reductions", {"spin": "maxx"}, ValueError, "max"),
    (kr.reduce, REDUCE, "reductions", ["spin"], TypeError, "quantities"),
    (kr.reduce, REDUCE, "reductions", {"spin": 3}, TypeError, "several"),
    (kr.reduce, REDUCE, "digits", 20, ValueError, "16"),
    (kr.stream, SOLVE, "t", iter([1.0]), TypeError, "iterator"),
    (kr.start, {}, "scene", MIXED, TypeError, "index"),
    (kr.plan, {"scene": MIXED}, "method", "geometric", ValueError, "plan"),
    (kr.plan, {"scene": SCENES[0], "t": [1.0]}, "reduce", SPIN, ValueError, "reduce"),
    (kr.exact, {}, "scene", UNDAMPED[[0, 2]], ValueError, r"top\[0\]"),
    (kr.exact(GRID), {}, "t", 1e300, ValueError, r"top\[0, 0\]"),
    (kr.apex, {}, "path", PATHS, ValueError, r"path\[0\]"),
    (PATHS.message, {}, "index", 0, IndexError, "index"),
]


@pytest.mark.parametrize(("call", "valid", "name", "bad", "error", "word"), REFUSALS)
def test_bad_arguments_are_refused(call, valid, name, bad, error, word):
    with pytest.raises(error, match=word):
        call(**valid | {name: bad})


def test_a_system_without_threads_and_signals_computes_ensembles():
    """Pyodide is such a system."""
    code = """
import _thread, signal, sys, threading
import numpy as np
del signal.SIGTERM, signal.SIGALRM
def refuse(*words, **more):
    raise RuntimeError("can't start new thread")
for module in (_thread, threading):
    for name in [name for name in dir(module) if "start" in name and "thread" in name]:
        setattr(module, name, refuse)
sys.platform = "emscripten"
import kreisel as kr
tops = kr.scenes.asymmetric.vary(gravity=np.linspace(0.5, 1, 100))
path = kr.solve(tops, 2.0, threads=4)
assert kr.section(tops, n=2, threads=2).shape == kr.reduce(tops, 2.0, {"spin": "max"}).shape
print(path.q.sum().hex())
"""
    tops = kr.scenes.asymmetric.vary(gravity=np.linspace(0.5, 1, 100))
    result = python(code)
    assert result.stdout.strip() == kr.solve(tops, 2.0).q.sum().hex(), result.stderr
