"""Tests that calls with plain Python numbers give the results of calls validated in Python."""

import contextlib
import copy
import pickle
import sys
import threading

import kreisel as kr
import numpy as np
import pytest
from kreisel import _core
from kreisel._results.requests import build_request_from_solve_arguments
from tops import scene_for, words_for

TOP = kr.scenes.asymmetric
TIMES = [0.0, 0.5, 1.0, 2.5]
WANTED = ("nutation", "q", "frame", "apex", "m", "energy")
MOMENTUM, ATTITUDE = (0.25, -0.5, 1.5), (0.6, 0.0, 0.8, 0.0)


class NotPlain(float):
    """A subclass of float that requires validation in Python."""


def wrap_numbers(numbers):
    return [NotPlain(x) for x in numbers]


class OwnScene(kr.Scene):
    """A user-defined subclass of Scene."""


def collect_attributes(path):
    """Return the data and options of a path in a form that can be compared."""
    names = ("t", "q", "m") if path.want is None else ("t", *path.want)
    arrays = {name: getattr(path, name).tobytes() for name in names}
    attributes = (
        path.stats,
        path.method,
        path.step,
        path.tol,
        path.digits,
        path.want,
        path.start_time,
    )
    return arrays, attributes, repr(path), str(path.plan), path.scene


class SlowPathError(Exception):
    """An error raised if a single call of the core does not suffice."""


@pytest.fixture
def forbid_slow_path(monkeypatch):
    """Return a context in which arguments must not be validated in Python."""

    def fail(*_, **__):
        raise SlowPathError

    @contextlib.contextmanager
    def forbid():
        with monkeypatch.context() as patch:
            for name in ("validate_solve_options", "_solve_with_options"):
                patch.setattr(sys.modules["kreisel._solve.solve"], name, fail)
            for name in ("_validate_times_to_record", "_advance_to_times", "_restart_run"):
                patch.setattr(kr.Run, name, fail)
            yield

    return forbid


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["forth", "back"])
@pytest.mark.parametrize("want", [None, WANTED, [*WANTED]], ids=["states", "want", "list"])
@pytest.mark.parametrize("method", ["auto", *kr.methods])
def test_plain_times_give_the_path_of_validated_times(method, want, sign, forbid_slow_path):
    scene = TOP if method == "auto" else scene_for(method)
    words = words_for(method) if method != "auto" else {}
    times = [sign * t for t in TIMES]
    slow = kr.solve(scene, wrap_numbers(times), method, want=want, **words)
    for values in (times, tuple(times), np.array(times), [int(t) if t == 1 else t for t in times]):
        with forbid_slow_path():
            path = kr.solve(scene, values, method, want=want, **words)
        assert collect_attributes(path) == collect_attributes(slow)
    with forbid_slow_path():
        number = kr.solve(scene, times[-1], method, want=want, **words)
        with pytest.raises(SlowPathError):
            kr.solve(scene, wrap_numbers(times), method, want=want, **words)
    assert collect_attributes(number) == collect_attributes(
        kr.solve(scene, NotPlain(times[-1]), method, want=want, **words)
    )


@pytest.mark.parametrize("want", [None, WANTED])
@pytest.mark.parametrize("words", [{}, {"digits": 20}, {"digits": 30}, {"tol": 1e-5}])
def test_a_path_from_a_single_call_is_complete(words, want):
    scene = OwnScene(TOP.body, TOP.momentum, gravity=1.0)
    path = kr.solve(TOP, TIMES, want=want, **words)
    for again in (pickle.loads(pickle.dumps(path)), copy.deepcopy(path), path[:]):
        assert collect_attributes(again) == collect_attributes(path)
        assert again._low is path._low is None or again._low.tobytes() == path._low.tobytes()
    assert not any(getattr(path, name).flags.writeable for name in ("t", "q", "m"))
    assert len(path.events) == 0 and (want is None) == hasattr(path, "states")
    assert kr.solve(scene, TIMES).scene is scene
    every = kr.solve(TOP, TIMES, **words)
    assert all(getattr(path, name).tobytes() == getattr(every, name).tobytes() for name in WANTED)


def test_wanted_low_words_and_iterators_are_validated_in_python():
    path = kr.solve(TOP, TIMES, digits=20, want=("q_low", "energy"))
    whole = kr.solve(TOP, TIMES, digits=20)
    assert path.q_low.tobytes() == whole.q_low.tobytes() and path.want == ("q_low", "energy")
    names = iter(["energy"])
    assert kr.solve(TOP, TIMES, want=names).want == ("energy",)
    with pytest.raises(ValueError, match="no quantity besides t"):
        kr.solve(TOP, TIMES, want=names)


@pytest.mark.parametrize(
    "words, message",
    [
        ({"step": True}, "step must be a number, not True"),
        ({"step": -1.0}, "step must be positive"),
        ({"tol": 2.0}, "tol must be below 1"),
        ({"digits": 31}, "digits must be at most 30"),
        ({"max_steps": False}, "max_steps must be a whole number"),
        ({"want": "energy"}, "want must be names of quantities"),
        ({"want": [[]]}, "unknown quantity in want"),
        ({"method": "tailor"}, "did you mean 'taylor'"),
        ({"method": ["taylor"]}, "method must be a name"),
        ({"method": "geometric"}, "error"),
        ({"progress": 1}, "progress must be a function"),
        ({"t": [1.0, 0.5]}, "goes back from"),
        ({"t": [1.0, float("nan")]}, "finite"),
        ({"t": "soon"}, "t must be"),
        ({"t": 1e300}, "cannot resolve"),
    ],
)
def test_invalid_arguments_have_specific_messages(words, message):
    for _ in range(2):  # invalid arguments must not be cached
        with pytest.raises((TypeError, ValueError), match=message):
            kr.solve(TOP, **{"t": TIMES} | words)


def test_a_failure_keeps_the_states_reached():
    with pytest.raises(kr.Error) as error:
        kr.solve(TOP, [0.5, 50.0], max_steps=3, want=["energy"])
    path = error.value.path
    assert error.value.status == "ERR_LIMIT" and path.want == ("energy",)
    assert path.stats.steps == 3 and path.t[0] == 0.5 and len(path) == 2
    run = kr.start(TOP, max_steps=3)
    with pytest.raises(kr.Error) as error:
        run.to([0.5, 50.0])
    assert run.t == error.value.path.t[-1] > 0.5 and run.stats.steps == 3


def test_progress_is_called_at_the_end():
    reports = []
    path = kr.solve(TOP, TIMES, progress=reports.append)
    assert reports == [2.5] and collect_attributes(path) == collect_attributes(kr.solve(TOP, TIMES))
    assert len(kr.solve(TOP, [], progress=reports.append)) == 0 and reports == [2.5]


@pytest.mark.parametrize("want", [None, WANTED])
@pytest.mark.parametrize("back", [False, True], ids=["forth", "back"])
@pytest.mark.parametrize("method", list(kr.methods))
def test_a_run_advances_equally_by_plain_and_validated_times(method, back, want, forbid_slow_path):
    scene, words, sign = scene_for(method), words_for(method), -1.0 if back else 1.0
    fast, slow = (kr.start(scene, method, back=back, want=want, **words) for _ in range(2))
    for values in (0.5, [0.5, 0.75], np.array([1.0, 1.0]), 2.0, []):
        times = sign * np.array(values) if np.ndim(values) else sign * values
        plain = times.tolist() if isinstance(values, list) else times
        checked = wrap_numbers(times) if np.ndim(values) else NotPlain(times)
        if np.size(values):
            with forbid_slow_path():
                path = fast.to(plain)
        else:
            path = fast.to(plain)  # validated in Python
        assert collect_attributes(path) == collect_attributes(slow.to(checked))
        assert (fast.t, fast.stats) == (slow.t, slow.stats)
    with pytest.raises(ValueError, match="goes back from"):
        fast.to(sign * 1.5)
    assert kr.resume(fast.checkpoint).t == fast.t == sign * 2.0


@pytest.mark.parametrize("attitude", [None, ATTITUDE], ids=["momentum", "both"])
@pytest.mark.parametrize("method", [*kr.methods, "digits"])
def test_a_reset_by_plain_numbers_equals_a_validated_one(method, attitude, forbid_slow_path):
    name, words = (method, words_for(method)) if method != "digits" else ("taylor", {"digits": 20})
    fast, slow = (kr.start(scene_for(name), name, **words) for _ in range(2))
    slow_attitude = None if attitude is None else wrap_numbers(attitude)
    for run in fast, slow:
        run.to(1.25)
    with contextlib.nullcontext() if method == "digits" else forbid_slow_path():
        fast.reset(MOMENTUM, attitude)  # more than 16 digits are set in Python
    with forbid_slow_path(), pytest.raises(SlowPathError):
        slow.reset(wrap_numbers(MOMENTUM), slow_attitude)
    slow.reset(wrap_numbers(MOMENTUM), slow_attitude)
    assert fast.scene == slow.scene and fast.scene._block == slow.scene._block
    assert vars(fast.scene).keys() >= {"body", "damping", "gravity"}
    assert (fast.t, fast.start_time, fast.stats) == (1.25, 1.25, (0, 0, 0, 0))
    assert collect_attributes(fast.to([1.25, 2.0])) == collect_attributes(slow.to([1.25, 2.0]))
    assert kr.resume(fast.checkpoint).to(3.0).states.tobytes() == slow.to(3.0).states.tobytes()


def test_a_refused_reset_changes_nothing():
    run, own = kr.start(TOP), kr.start(OwnScene(TOP.body, TOP.momentum, gravity=1.0))
    run.to(1.0)
    before = run.scene, run.t, run.stats, run.checkpoint
    for bad in ((1.0, 2.0), (1.0, 2.0, float("nan")), "abc", 1.0):
        with pytest.raises((TypeError, ValueError)):
            run.reset(bad)
    with pytest.raises(ValueError, match="unit"):
        run.reset(MOMENTUM, (2.0, 0.0, 0.0, 0.0))
    assert (run.scene, run.t, run.stats, run.checkpoint) == before
    own.reset(MOMENTUM)
    assert type(own.scene) is OwnScene
    level = kr.start(TOP, want=["energy"])
    with pytest.raises(ValueError, match="heading"):
        level.reset(MOMENTUM)


def test_an_ended_run_stays_ended_until_it_is_reset():
    event = kr.events.nutation(direction=1, terminal=True)
    run = kr.start(TOP, events=event)
    run.to(50.0)
    assert run.ended
    with pytest.raises(ValueError, match="has ended"):
        run.to(60.0)
    run.reset(MOMENTUM)
    assert not run.ended


def test_threads_share_requests():
    expected = kr.solve(TOP, TIMES).states.tobytes()
    results = []

    def work():
        results.extend(kr.solve(TOP, TIMES).states.tobytes() for _ in range(200))

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 800 and set(results) == {expected}


def test_the_core_refuses_invalid_arguments():
    request, motion = build_request_from_solve_arguments("taylor"), kr.start(TOP)._top
    for call in (request.solve, motion.advance, motion.reset):
        with pytest.raises(TypeError, match="takes"):
            call(1)
    with pytest.raises(AttributeError):
        request.solve(1, 2.0, None)
    with pytest.raises(TypeError, match="not constructed"):
        _core.Request.__new__(_core.Request).solve(TOP, 1.0, None)
    with pytest.raises(TypeError):
        _core.Run.advance(request, None, 1.0, None)
