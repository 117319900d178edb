"""Tests of the times, states and quantities that a path records, and of states between them."""

import copy
import pickle
import threading
import tracemalloc
from typing import get_args

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits
from kreisel.types import QuantityName
from tops import GENERAL, LAGRANGE

TOP = kr.scenes.asymmetric
TOPS = TOP.scatter(3, seed=1, momentum=0.1)
LOWEST = kr.events.nutation(direction=1)
SOME = ("nutation", "frame")
NAMES = [name for name in get_args(QuantityName) if name[-4:] != "_low" and name != "t"]


def same(one, other):
    """Return True if two paths have the same arrays and options."""
    names = ("t", *(one.want or ("q", "m", "q_low", "m_low")))
    words = ("scene", "method", "step", "tol", "digits", "want")
    return all(same_bits(getattr(one, n), getattr(other, n)) for n in names) and all(
        getattr(one, word) == getattr(other, word) for word in words
    )


# Recorded times and states


@pytest.mark.parametrize(
    "t, every, expected",
    [
        (1, None, [0, 1]),
        ([0.3, 0.3, 1.0], None, [0.3, 0.3, 1.0]),
        (1, 3, [0, 3 * 0.1, 6 * 0.1, 9 * 0.1]),
        (-0.35, 1, [0, -0.1, -0.2, -3 * 0.1]),
        (3 * 0.1, 1, [0, 0.1, 0.2, 3 * 0.1]),
        (0.3, 1, [0, 0.1, 0.2, 3 * 0.1]),
        (0, 1, [0]),
        (np.float32(0.5), None, [0, 0.5]),
        ([], None, []),
    ],
)
def test_states_are_recorded_at_the_requested_times(t, every, expected):
    path = kr.solve(GENERAL, t, "strang", step=0.1, every=every)
    assert path.t.tolist() == expected and len(path) == len(expected)
    if expected[:1] == [0]:
        assert tuple(path.q[0]) == GENERAL.attitude and tuple(path.m[0]) == GENERAL.momentum


def test_parallel_threads_give_the_same_bits():
    scenes = [GENERAL.replace(momentum=(0.1 * i, 1, 2)) for i in range(4)]
    words = {"t": 20, "method": "rk4", "step": 1e-3, "every": 1000}
    alone = [kr.solve(scene, **words).states for scene in scenes]
    parallel = {}

    def run(i):
        parallel[i] = kr.solve(scenes[i], **words).states

    threads = [threading.Thread(target=run, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(same_bits(parallel[i], alone[i]) for i in range(4))


RESULTS = {
    "path": lambda: kr.solve(GENERAL, [1.0, 2.0], events=kr.events.nutation()),
    "wanted": lambda: kr.solve(TOP, [0.0, 1.0, 2.0], want=("energy", "apex")),
    "tangents": lambda: kr.solve(GENERAL, [1.0, 2.0], tangents="start"),
    "paths": lambda: kr.solve(TOPS, [1.0, 2.0]),
    "events": lambda: kr.solve(TOPS, [9.0], events=kr.events.nutation()).events,
    "reduced": lambda: kr.reduce(TOPS, [1.0], {"nutation": "max"}),
    "section": lambda: kr.section(TOPS, n=3),
    "indicator": lambda: kr.chaos(TOPS, 5.0),
    "frequencies": lambda: kr.frequencies(kr.solve(GENERAL, np.linspace(0, 9, 99))),
}
FRESH = "failed", "q_xyzw"  # computed anew at each access


@pytest.mark.parametrize("name", RESULTS)
@pytest.mark.parametrize(
    "make_copy", [lambda one: one, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))]
)
def test_arrays_of_a_result_and_of_its_copies_are_read_only(name, make_copy):
    result = make_copy(RESULTS[name]())
    names = [n for n in {*dir(type(result)), *vars(result)} if n[0] != "_" and n not in FRESH]
    arrays = {n: value for n in names if isinstance(value := getattr(result, n, None), np.ndarray)}
    assert arrays and not [n for n, value in arrays.items() if value.flags.writeable]


# Errors


def test_closed_forms_do_not_overestimate_their_error():
    """Check the error estimate of the closed form for a free body that flips over."""
    body = kr.Body(1.0, (4.483167597121757, 3.657682742032973, 1.0048569934661162), (0, 0, 0))
    momentum = -1.8363240592035863e-08, 8.840258465238069, -1.3362217851799154e-08
    times = np.linspace(0, 28, 41)
    path, short, long = (
        kr.solve(kr.Scene(body, momentum=momentum, gravity=0.0), times, digits=digits)
        for digits in (None, 20, 30)
    )
    true = kr.attitude_error(path.q, long.q).max()
    assert path.method == "exact" and kr.attitude_error(short.q, long.q).max() > 100 * true
    assert true / 3 <= path.error <= 3 * true + 1e-16


def test_the_error_of_30_digits_is_at_least_their_rounding():
    for scene in (kr.scenes.asymmetric, kr.scenes.thesis, kr.scenes.kowalewski):
        assert kr.solve(scene, 20.0, digits=30).error > 1e-32
    body = kr.Body(1, (1, 2, 2.5), (0, 0, 0))
    lingering = kr.Scene(body, momentum=(1e-5, 2.7, -1.6e-5), gravity=0.0)
    assert kr.solve(lingering, 80.0, digits=30).error > 5e-28


def test_the_energy_error_is_the_largest_along_the_path():
    path = kr.solve(TOP, 20.0, "strang", step=0.1, every=1)
    lever = TOP.body.mass * abs(TOP.gravity) * np.linalg.norm(TOP.body.com)
    change = np.abs(path.energy - path.energy[0])
    assert change.max() > 100 * change[change > 0].min()
    largest = change.max() / (path.kinetic.max() + lever)
    assert path.energy_error == pytest.approx(largest, rel=1e-12)
    assert kr.solve(TOP, 3, want=("energy", "kinetic")).energy_error < 1e-14


# States at other times


def test_geometric_paths_keep_their_method_and_step():
    path = kr.solve(LAGRANGE, 5.0, "geometric", error=1e-6)
    again = path([5.0, 2.5])
    assert np.array_equal(again[0].states, path[1].states) and again.step == path.step
    assert again.plan.choice == path.plan.choice and again.error == path.error


def test_closed_forms_have_states_in_both_directions():
    motion, times = kr.exact(LAGRANGE), [2.0, -0.5, -1.0, 3.0]
    path = motion([3.0, -1.0])
    assert same(path(times), motion(times)) and path(times).error < 1e-13  # [rad]
    assert tuple(path(0.0).m[0]) == LAGRANGE.momentum  # the given momentum, as in solve


def test_paths_that_end_early_have_states_up_to_their_end():
    with pytest.raises(kr.Error) as error:
        kr.solve(TOP, [0.25, 9.0], max_steps=4)
    stopped = kr.solve(TOP, 30.0, events=[kr.events.nutation(direction=1, terminal=True)])
    for path in (error.value.path, stopped):
        end = float(path.t[-1])
        assert np.array_equal(path(end).states, path[-1].states)
        with pytest.raises(ValueError, match="outside"):
            path(np.nextafter(end, 30.0))
    events = kr.solve(TOP, 20.0, events=[LOWEST]).events.path
    assert np.array_equal(events(events.t[::-1]).states, events.states[::-1])


@pytest.mark.parametrize("words", [{}, {"want": SOME}, {"digits": 20}])
def test_paths_of_a_stream_and_of_a_run_have_states_between(words):
    for path in kr.stream(TOP, np.linspace(0.0, 4.0, 9), chunk=3, **words):
        times = [0.0, 0.1, float(path.t[-1])]
        assert same(path(times), kr.solve(TOP, times, **words))
    run = kr.start(TOP, "strang", step=0.1, back=True)
    run.to(-1.0)
    assert same(run.to(-2.0)([-0.5, -1.5]), kr.solve(TOP, [-0.5, -1.5], "strang", step=0.1))


# Selected states


PATHS = {
    "states": lambda: kr.solve(TOP, np.linspace(0.0, 1.0, 7)),
    "wanted": lambda: kr.solve(TOP, np.linspace(0.0, 1.0, 7), want=SOME),
    "digits": lambda: kr.solve(TOP, np.linspace(0.0, -1.0, 7), digits=30),
    "events": lambda: kr.solve(TOP, np.linspace(0.0, 30.0, 7), events=[LOWEST]),
    "closed form": lambda: kr.exact(LAGRANGE)(np.linspace(3.0, -3.0, 7)),
}
INDICES = [0, -1, np.int64(3), slice(None), slice(5, 1, -2), slice(9, None), [4, 0, 0], [], (1, 2)]
INDICES += [np.array([6, -7]), np.arange(7) > 3, [True] * 6 + [False]]


@pytest.mark.parametrize("kind", PATHS)
def test_indexed_states_equal_those_of_the_path(kind):
    path = PATHS[kind]()
    for index in INDICES:
        part = path[index]
        rows = np.arange(7)[list(index) if isinstance(index, tuple) else index].reshape(-1)
        for name in ("t", *(path.want or ("q", "m", "q_low", "m_low", "energy"))):
            assert same_bits(getattr(part, name), getattr(path, name)[rows.astype(int)])
        words = ("scene", "method", "step", "tol", "digits", "want", "stats")
        assert all(getattr(part, word) == getattr(path, word) for word in words)
        assert len(part.events) == 0 and not part.t.flags.writeable
        assert len(copy.deepcopy(part)) == len(part) == len(rows)
    assert all(same(state, path[i]) for i, state in enumerate(path))


# The argument want=


def test_only_wanted_quantities_are_recorded():
    path = kr.solve(TOP, 3, want=("energy", "t", "energy"))
    assert path.want == ("energy",) and path.t.tolist() == [0, 3] and path.energy.shape == (2,)
    others = {*NAMES, "states", "end", "rotation", "q_xyzw", "energy_error", "error"} - {"energy"}
    for name in others:
        with pytest.raises(AttributeError, match=name):
            getattr(path, name)
    assert len(kr.solve(TOP, [], want=("energy",))) == 0 and "error" not in dir(path)


@pytest.mark.parametrize("scene", [TOP, kr.scenes.kowalewski, kr.scenes.goryachev_chaplygin])
def test_quantities_without_heading_are_right(scene):
    times = np.linspace(0, 10, 300)
    whole, left_out = kr.solve(scene, times, digits=20), []
    for name in NAMES:
        path = kr.solve(scene, times, want=(name, "energy"))
        size = np.abs(getattr(whole, name)).max() + np.abs(whole.kinetic).max()
        np.testing.assert_allclose(
            getattr(path, name), getattr(whole, name), rtol=0, atol=1e-10 * size, equal_nan=True
        )
        left_out += [name] * ("attitude" in dict(path.plan.left_out))
    assert {"nutation", "spin"} <= {*left_out} and not {"q", "apex", "m"} & {*left_out}


def test_want_needs_little_memory():
    times, peaks = np.linspace(0, 10, 300_000), []
    for words in ({}, {"want": ("energy",)}):
        tracemalloc.start()
        kr.solve(TOP, times, **words)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    # [bytes]: of all states, or of the times, the energy and one chunk of states
    assert peaks[0] > 64 * 300_000 and peaks[1] < 42 * 300_000


@pytest.mark.parametrize(
    "want, digits, names",
    [
        (("q",), 20, ("q_low",)),
        (("q_low",), 30, ("q",)),
        (("energy",), 20, ("q", "q_low")),
        (("energy",), None, ("q",)),
        (("energy",), 16, ("q",)),
    ],
)
def test_a_path_without_error_names_the_quantities_to_add(want, digits, names):
    with pytest.raises(AttributeError, match=f"add '{names[0]}'.* to want$"):
        _ = kr.solve(TOP, [1.0], want=want, digits=digits).error
    whole = kr.solve(TOP, [1.0], want=want + names, digits=digits)
    assert whole.error == kr.solve(TOP, [1.0], digits=digits).error and "error" in dir(whole)


# Refusals


EMPTY, BETWEEN, WANTED = kr.solve(TOP, []), kr.solve(TOP, 2.0), kr.solve(TOP, 1, want=("energy",))
STATES = PATHS["states"]()
REFUSALS = [  # call, exception, word
    (lambda: BETWEEN(2.1), ValueError, "lies outside the path, whose times go from 0.0 to 2.0"),
    (lambda: BETWEEN([1.0, -0.1]), ValueError, r"t\[1\] = -0.1"),
    (lambda: BETWEEN(np.nan), ValueError, "finite"),
    (lambda: BETWEEN("1"), TypeError, "t must be"),
    (lambda: EMPTY(0.1), ValueError, "outside"),
    (lambda: STATES[7], IndexError, "7"),
    (lambda: STATES["q"], TypeError, "attributes"),
    (lambda: STATES[1.0], TypeError, "whole number"),
    (lambda: STATES.scene_at(8), IndexError, "8"),
    (lambda: EMPTY.end, IndexError, "no state"),
    (lambda: np.asarray(STATES), TypeError, r"path\.q"),
    (lambda: STATES.velocty, AttributeError, "did you mean 'velocity'"),
    (lambda: WANTED.enrgy, AttributeError, "did you mean 'energy'"),
    (lambda: kr.from_rotation(STATES.rotation), ValueError, "single"),
    (lambda: kr.solve(TOP, 1, want="energy"), TypeError, "list of names"),
    (lambda: kr.plan(TOP, want=()), ValueError, "empty"),
    (lambda: kr.start(TOP, want=("enrgy",)), ValueError, "did you mean 'energy'"),
    (lambda: kr.stream(TOP, [1.0], want=7), TypeError, "names"),
]


@pytest.mark.parametrize(("call", "error", "word"), REFUSALS)
def test_what_a_path_does_not_have_is_refused(call, error, word):
    with pytest.raises(error, match=word):
        call()
