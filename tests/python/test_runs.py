"""Tests of streams and of runs that are continued, saved and resumed."""

import copy
import itertools
import math
import pickle
import warnings
import zlib

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits
from tops import WILD, scene_for, words_for

TOP = kr.scenes.asymmetric


@pytest.mark.parametrize("method", ["strang", "extrap", "exact", "taylor"])
@pytest.mark.parametrize("chunk", [1, 7, 1000])
def test_stream_equals_solve_bitwise(method, chunk):
    scene, words, times = scene_for(method), words_for(method), np.linspace(0, 9, 61)
    whole = kr.solve(scene, times, method, **words)
    for t in (times, times.tolist(), iter(times)):
        paths = list(kr.stream(scene, t, method, chunk=chunk, **words))
        assert [len(path) for path in paths[:-1]] == [chunk] * (len(paths) - 1) and len(
            paths[-1]
        ) <= chunk
        assert same_bits(np.concatenate([path.states for path in paths]), whole.states)
    assert paths[-1].stats == whole.stats


@pytest.mark.parametrize("end", [20.0, -20.0, 19.99])
def test_stream_on_a_grid_yields_the_path_in_chunks(end):
    whole = kr.solve(TOP, end, "strang", step=0.01, every=7)
    paths = list(kr.stream(TOP, end, "strang", step=0.01, every=7, chunk=50, want=("t", "energy")))
    assert np.array_equal(np.concatenate([path.t for path in paths]), whole.t)
    assert np.array_equal(np.concatenate([path.energy for path in paths]), whole.energy)


def test_streams_may_be_infinite():
    grid = kr.stream(TOP, math.inf, "strang", step=0.01, every=10, chunk=100)
    paths = list(itertools.islice(grid, 5))
    whole = kr.solve(TOP, 49.9, "strang", step=0.01, every=10)
    assert np.array_equal(np.concatenate([path.states for path in paths]), whole.states)
    grid.close()
    back = next(kr.stream(TOP, -math.inf, "strang", step=0.01, every=10, chunk=3))
    assert back.t.tolist() == [0, -0.1, -0.2]
    endless = kr.stream(TOP, (0.1 * k for k in itertools.count()), chunk=10)
    assert next(endless).t[-1] == 0.1 * 9 and next(endless).t[0] == 0.1 * 10


@pytest.mark.parametrize(
    "t, words, kind, message",
    [
        (5.0, {}, ValueError, "a stream needs times"),
        (math.inf, {}, ValueError, "a stream needs times"),
        (math.nan, {"method": "strang", "step": 0.1, "every": 1}, ValueError, "t must be finite"),
        ([2.0, 1.0], {}, ValueError, "goes back"),
        ("abc", {}, TypeError, "t must be"),
        (iter("abc"), {}, TypeError, "an iterator of times"),
        (
            iter([1.0]),
            {"method": "strang", "step": 0.1, "every": 1},
            ValueError,
            "every needs t as a number",
        ),
        ([1.0], {"chunk": 0}, ValueError, "chunk must be at least 1"),
        ([1.0], {"progress": 3}, TypeError, "progress must be a function"),
        ([1.0], {"method": "rk4"}, ValueError, "fixed step"),
    ],
)
def test_stream_refuses_before_anything_runs(t, words, kind, message):
    with pytest.raises(kind, match=message):
        kr.stream(TOP, t, **words)


def test_stream_refuses_invalid_times_of_an_iterator():
    times = kr.stream(TOP, iter([1.0, 2.0, 3.0, 2.5]), chunk=2)
    assert next(times).t.tolist() == [1, 2]
    with pytest.raises(ValueError, match=r"t\[1\] = 2.5 goes back from t\[0\] = 3.0"):
        next(times)
    with pytest.raises(kr.Error) as failure:
        list(kr.stream(WILD, [1.0, 1.5, 50.0], "rk4", step=0.5, chunk=2))
    assert failure.value.path.t.size <= 2


# Checkpoints


@pytest.mark.parametrize("back", [False, True], ids=["forth", "back"])
@pytest.mark.parametrize("name", [*kr.methods, "taylor 16", "taylor 20", "taylor 30"])
def test_a_resumed_run_has_the_same_bits(name, back, tmp_path):
    name, _, digits = name.partition(" ")
    scene, words = scene_for(name), words_for(name) | ({"digits": int(digits)} if digits else {})
    times = np.array([0.0, 0.5, 1.0, 1.01, 4.44, 10.0, 10.0, 13.7, 50.0]) * (-1 if back else 1)
    whole = kr.solve(scene, times, name, **words)
    run, parts = kr.start(scene, name, back=back, **words), []
    for t in times:
        run.save(tmp_path / "run")
        run = kr.resume(tmp_path / "run")
        parts.append(run.to([t]))
        assert run.t == t
    assert same_bits(np.concatenate([path.states for path in parts]), whole.states)
    assert same_bits(np.concatenate([path.q_low for path in parts]), whole.q_low)
    assert (
        parts[-1].stats == whole.stats == run.stats
        and run.method == whole.method
        and run.scene == scene
    )
    assert [file.name for file in tmp_path.iterdir()] == ["run"]


def test_a_run_without_heading_is_resumed():
    times = np.linspace(0, 30, 50)
    whole, run = kr.solve(TOP, times, want=("energy",)), kr.start(TOP, want=("energy",))
    first = run.to(times[:20])
    rest = kr.resume(run.checkpoint).to(times[20:])
    assert np.array_equal(
        np.concatenate([first.energy, rest.energy]), whole.energy
    ) and rest.want == ("energy",)


def test_an_interrupted_stream_is_resumed_from_a_file(tmp_path):
    file, words = tmp_path / "run", {"every": 10, "chunk": 100}
    whole = kr.solve(TOP, 100, "strang", step=0.01, every=10)
    run, states = kr.start(TOP, "strang", step=0.01), []
    for path in itertools.islice(run.stream(100, **words), 4):
        states.append(path.states)
        run.save(file)
    next(run.stream(100, **words))  # the process would be killed here
    for path in kr.resume(file).stream(100, **words):
        states.append(path.states)
    assert np.array_equal(np.concatenate(states), whole.states)


def test_a_run_advances_in_one_direction():
    run = kr.start(TOP, "strang", step=0.01)
    assert run.to(1).t.tolist() == [0, 1] and run.to(2).t.tolist() == [1, 2] and run.t == 2
    assert run.to(2.1, every=5).t.tolist() == [205 * 0.01, 210 * 0.01]
    assert "strang at t = 2.1" in repr(run) and run.plan == kr.plan(TOP, method="strang", step=0.01)
    with pytest.raises(ValueError, match=r"goes back from the run's 2.1"):
        run.to([1.0])
    with pytest.raises(ValueError, match="goes back"):
        run.to(-3)
    short_run = kr.start(TOP, "strang", step=0.01, max_steps=100)
    with pytest.raises(kr.Error, match="largest number of steps"):
        short_run.to(3)
    assert short_run.t == 1
    next_run = kr.resume(short_run.checkpoint, max_steps=0)
    assert np.array_equal(
        next_run.to(3).states[-1], kr.solve(TOP, 3, "strang", step=0.01).states[-1]
    )
    with pytest.raises(TypeError, match="back must be True or False"):
        kr.start(TOP, back=1)
    with pytest.raises(ValueError, match=r"only kreisel.solve accepts"):
        kr.start(TOP, "geometric")
    with pytest.raises(ValueError, match="step is too large"):
        kr.start(kr.scenes.thesis, "bobenko_suris4", step=100)


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ArithmeticError])
@pytest.mark.parametrize(
    "method, words", [("rk4", {"step": 1e-3}), ("taylor", {"digits": 30}), ("extrap", {})]
)
def test_a_stopped_run_continues_with_the_same_bits(method, words, stop):
    def tell(t):
        raise stop

    run = kr.start(TOP, method, **words)
    with pytest.raises((kr.Interrupted, ArithmeticError)):
        run.to(1e6, progress=tell)
    assert 0 < run.t < 1e6
    times = [run.t + 0.5, run.t + 3]
    whole = kr.solve(TOP, times, method, **words)
    assert same_bits(kr.resume(run.checkpoint).to(times).states, whole.states)
    assert same_bits(run.to(times).states, whole.states)


def test_damaged_checkpoints_are_refused(tmp_path):
    run = kr.start(TOP, want=("energy",))
    run.to(5)
    whole, random = run.checkpoint, np.random.default_rng(3)
    for i in [*range(200), *random.integers(0, len(whole), 300)]:
        bad = bytearray(whole)
        bad[i] ^= 1 << random.integers(0, 8)
        with pytest.raises(ValueError, match="the checkpoint is not a saved run, or is damaged"):
            kr.resume(bytes(bad))
    for bad in (b"", whole[:-1], whole[:100], whole + b"x", random.bytes(len(whole))):
        with pytest.raises(ValueError, match="damaged"):
            kr.resume(bad)
    (tmp_path / "odd").write_bytes(b"kreisel run\nnothing of the kind")
    with pytest.raises(ValueError, match="odd is not a saved run"):
        kr.resume(tmp_path / "odd")
    with pytest.raises(FileNotFoundError):
        kr.resume(tmp_path / "none")
    magic, body = whole[:12], whole[21:].replace(b"gravity = 1.0", b"gravity = 2.0")
    assert body != whole[21:]
    with pytest.raises(ValueError, match="the checkpoint is damaged"):
        kr.resume(magic + b"%08x\n" % zlib.crc32(body) + body)


def test_resuming_with_another_kernel_warns():
    run = kr.start(TOP)
    run.to(5)
    whole, own = run.checkpoint, run.plan.kernel.encode()
    other = b"avx512" if own == b"base" else b"base"
    body = whole[21:].replace(b'"kernel": "' + own, b'"kernel": "' + other)
    with pytest.warns(UserWarning, match="agrees only up to rounding"):
        kr.resume(whole[:12] + b"%08x\n" % zlib.crc32(body) + body)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kr.resume(whole)


@pytest.mark.parametrize(
    "make_copy", [copy.copy, copy.deepcopy, lambda run: pickle.loads(pickle.dumps(run))]
)
def test_a_copy_of_a_run_is_independent(make_copy):
    run = kr.start(TOP, "strang", step=0.01)
    run.to(1.0)
    twin = make_copy(run)
    assert twin.t == 1.0 and twin.stats == run.stats
    states = run.to(2.0).states
    assert twin.t == 1.0 and np.array_equal(twin.to(2.0).states, states)


def test_assignment_to_results_and_runs_raises(tmp_path):
    tops = kr.scenes.asymmetric.scatter(3, momentum=0.1)
    source = kr.Source.grid(TOP, gravity=[1.0, 2.0])
    sweep = kr.sweep(source, 1.0, folder=tmp_path)
    path = kr.solve(kr.scenes.cusps, [0.0, 1.0])
    for one, message in [
        (kr.start(TOP), r"kreisel\.start\(path\.end\.replace\(momentum=\.\.\.\)\)"),
        (kr.solve(tops, [1.0]), "solve again"),
        (kr.reduce(tops, [1.0], {"nutation": "max"}), "solve again"),
        (kr.section(tops, n=2), "solve again"),
        (sweep, "kreisel.sweep are read-only"),
        (source, "construct a new"),
        (kr.exact(kr.scenes.cusps), "momentum"),
        (path, "momentum"),
    ]:
        for name in ("momentum", "t", "gravty"):
            with pytest.raises(AttributeError, match=r"cannot assign to field|read.only|no setter"):
                setattr(one, name, 1.0)
        with pytest.raises(AttributeError, match=message):
            one.momentum = (0, 0, 9)


def test_a_run_continues_after_a_refused_change():
    run, other = kr.start(TOP), kr.start(TOP)
    with pytest.raises(AttributeError):
        run.momentum = (0, 0, 9)
    with pytest.raises(AttributeError):
        run.t = 5.0
    assert np.array_equal(run.to([1.0, 2.0]).states, other.to([1.0, 2.0]).states)
    assert run.t == 2.0 and run.stats == other.stats


# Boundary values


def test_an_iterator_of_lists_is_refused_as_times():
    with pytest.raises(ValueError, match="an iterator of times, not of"):
        list(kr.stream(TOP, iter([[1.0, 2.0], [3.0, 4.0]])))


def test_a_run_that_has_not_begun_has_no_costs():
    run = kr.start(TOP, "strang", step=0.01)
    assert (run.t, tuple(run.stats)) == (0.0, (0, 0, 0, 0))
    assert run.to([]).stats == run.stats
    assert tuple(kr.resume(run.checkpoint).stats) == (0, 0, 0, 0)
    assert repr(run) == "<kreisel.Run: strang at t = 0, 0 steps>"
