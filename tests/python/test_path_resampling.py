"""Tests of path states at arbitrary times, and of slices of paths."""

import copy
import pickle

import kreisel as kr
import numpy as np
import pytest
from ensembles import same_bits
from tops import LAGRANGE, scene_for, words_for

TOP = kr.scenes.asymmetric
LOWEST = kr.events.nutation(direction=1)
TIMES = np.array([1.7, 0.3, 2.0, 0.0, 0.7, 0.7])
SOME = ("nutation", "frame")


def solve_unordered(scene, times, *words, **more):
    """Return a path with states at `times`, which may be in any order."""
    order = np.argsort(np.abs(times), kind="stable")
    path = kr.solve(scene, np.asarray(times)[order], *words, **more)
    return path[np.argsort(order, kind="stable")]


def same(a, b):
    names = ("t", "q", "m", "q_low", "m_low") if a.want is None else ("t", *a.want)
    rows = [(getattr(a, name), getattr(b, name)) for name in names]
    words = ("scene", "method", "step", "tol", "digits", "want")
    return all(x.shape == y.shape and x.tobytes() == y.tobytes() for x, y in rows) and all(
        getattr(a, word) == getattr(b, word) for word in words
    )


@pytest.mark.parametrize("back", [1.0, -1.0])
@pytest.mark.parametrize("method", kr.methods)
def test_resampled_states_equal_those_of_solve_bitwise(method, back):
    scene, words = scene_for(method), words_for(method)
    path = kr.solve(scene, 2.0 * back, method, **words)
    assert same(path(TIMES * back), solve_unordered(scene, TIMES * back, method, **words))
    one_by_one = [path(t).states for t in TIMES * back]
    assert same_bits(np.concatenate(one_by_one), path(TIMES * back).states)


@pytest.mark.parametrize("want", [None, SOME, ("q", "q_low")])
@pytest.mark.parametrize("words", [{}, {"tol": 1e-6}, {"digits": 20}, {"digits": 30}])
def test_resampling_keeps_digits_and_wanted_quantities(words, want):
    path = kr.solve(TOP, 2.0, **words, want=want)
    assert same(path(TIMES), solve_unordered(TOP, TIMES, **words, want=want))
    assert path([]).want == want and len(path([])) == 0
    assert same(pickle.loads(pickle.dumps(path))(TIMES), path(TIMES))


@pytest.mark.parametrize("words", [{}, {"digits": 30}, {"want": SOME}])
def test_damped_paths_can_be_resampled(words):
    damped = LAGRANGE.replace(damping=0.1)
    path = kr.solve(damped, -2.0, **words)
    assert same(path(-TIMES), solve_unordered(damped, -TIMES, **words))


def test_resampling_across_chunks_equals_solve():
    times = np.linspace(0.0, 2.0, 40_000)
    path = kr.solve(TOP, times, want=("nutation",))
    assert same(path(times), path)


def test_resampling_geometric_paths_uses_their_method_and_step():
    path = kr.solve(LAGRANGE, 5.0, "geometric", error=1e-6)
    again = path([5.0, 2.5])
    assert np.array_equal(again[0].states, path[1].states)
    assert again.plan.choice == path.plan.choice and again.error == path.error
    assert again.step == path.step


def test_closed_form_paths_can_be_resampled_in_both_directions():
    motion = kr.exact(LAGRANGE)
    path = motion([3.0, -1.0])
    times = [2.0, -0.5, -1.0, 3.0]
    assert same(path(times), motion(times))
    assert tuple(path(0.0).m[0]) == LAGRANGE.momentum  # the given momentum, as in solve
    assert path.error < 1e-13 and path(times).error < 1e-13  # [rad]
    with pytest.raises(ValueError, match=r"lies outside the path, .* from -1\.0 to 3\.0"):
        path(-1.1)


def test_the_closed_form_of_a_map_cannot_be_resampled():
    path = kr.exact(LAGRANGE, map="bobenko_suris", step=0.01)([3, 1])
    with pytest.raises(ValueError, match="closed form of bobenko_suris, a map"):
        path(0.02)
    other = kr.solve(LAGRANGE, 0.03, "bobenko_suris", step=0.01)
    assert len(other(0.02)) == 1 and path[0].t == 0.03


def test_failed_paths_can_be_resampled_up_to_their_last_valid_state():
    with pytest.raises(kr.Error) as error:
        kr.solve(TOP, [0.25, 9.0], max_steps=4)
    path = error.value.path
    end = float(path.t[-1])
    assert np.array_equal(path(end).states, path[-1].states)
    assert same(path([0.2, end]), kr.solve(TOP, [0.2, end]))
    with pytest.raises(ValueError, match="outside"):
        path(np.nextafter(end, 9.0))


@pytest.mark.parametrize("words", [{}, {"want": SOME}, {"digits": 20}])
def test_paths_of_a_stream_can_be_resampled(words):
    times = np.linspace(0.0, 4.0, 9)
    for path in kr.stream(TOP, times, chunk=3, **words):
        own_times = [float(path.t[-1]), 0.1, 0.0]
        own_times = [t for t in own_times if t <= path.t[-1]]
        assert same(path(own_times), solve_unordered(TOP, own_times, **words))
    run = kr.start(TOP, "strang", step=0.1, back=True)
    run.to(-1.0)
    assert same(run.to(-2.0)([-0.5, -1.5]), kr.solve(TOP, [-0.5, -1.5], "strang", step=0.1))


def test_paths_with_events_can_be_resampled():
    path = kr.solve(TOP, 30.0, events=[LOWEST])
    event_path = path.events.path
    assert np.array_equal(event_path(event_path.t[::-1]).states, event_path.states[::-1])
    assert len(path(3.0).events) == 0 and same(path(3.0), kr.solve(TOP, [3.0]))
    short_path = kr.solve(TOP, 30.0, events=[kr.events.nutation(direction=1, terminal=True)])
    assert np.array_equal(short_path(short_path.t[-1]).states, short_path.states[-1:])
    with pytest.raises(ValueError, match="outside"):
        short_path(30.0)


@pytest.mark.parametrize(
    "t, kind, message",
    [
        (2.1, ValueError, "t = 2.1 lies outside the path, whose times go from 0.0 to 2.0"),
        ([1.0, -0.1], ValueError, r"t\[1\] = -0.1 lies outside"),
        (np.nan, ValueError, "finite"),
        ([[1.0]], ValueError, "shape"),
        ("1", TypeError, "t must be"),
        (None, TypeError, "t must be"),
    ],
)
def test_times_outside_the_path_are_refused(t, kind, message):
    with pytest.raises(kind, match=message):
        kr.solve(TOP, 2.0)(t)


def test_an_empty_path_can_be_evaluated_at_its_start():
    path = kr.solve(TOP, [])
    assert len(path([])) == 0 and tuple(path(0.0).q[0]) == TOP.attitude
    with pytest.raises(ValueError, match="outside"):
        path(0.1)


PATHS = {
    "states": lambda: kr.solve(TOP, np.linspace(0.0, 1.0, 7)),
    "wanted": lambda: kr.solve(TOP, np.linspace(0.0, 1.0, 7), want=SOME),
    "digits": lambda: kr.solve(TOP, np.linspace(0.0, -1.0, 7), digits=30),
    "wanted digits": lambda: kr.solve(TOP, np.linspace(0.0, 1.0, 7), digits=20, want=("q_low",)),
    "events": lambda: kr.solve(TOP, np.linspace(0.0, 30.0, 7), events=[LOWEST]),
    "closed form": lambda: kr.exact(LAGRANGE)(np.linspace(3.0, -3.0, 7)),
}


@pytest.mark.parametrize("kind", PATHS)
@pytest.mark.parametrize(
    "index",
    [0, -1, np.int64(3), slice(None), slice(5, 1, -2), slice(9, None), [4, 0, 0], [], (1, 2),
     np.array([6, -7]), np.arange(7) > 3, [True] * 6 + [False]],
)  # fmt: skip
def test_indexed_states_equal_those_of_the_path(kind, index):
    path = PATHS[kind]()
    selection = path[index]
    indices = np.arange(7)[list(index) if isinstance(index, tuple) else index].reshape(-1)
    for name in ("t", *path.want) if path.want else ("t", "q", "m", "q_low", "m_low", "energy"):
        assert (
            getattr(selection, name).tobytes() == getattr(path, name)[indices.astype(int)].tobytes()
        )
    words = ("scene", "method", "step", "tol", "digits", "want", "stats")
    assert all(getattr(selection, word) == getattr(path, word) for word in words)
    assert len(selection.events) == 0 and not selection.t.flags.writeable
    assert len(copy.deepcopy(selection)) == len(selection) == len(indices)


@pytest.mark.parametrize(
    "index, kind, message",
    [
        (7, IndexError, "a path of 7 states has no state of index 7"),
        (-8, IndexError, "index -8"),
        ([7], IndexError, "out of bounds"),
        ([True], IndexError, "boolean"),
        ("q", TypeError, "its quantities are attributes"),
        (1.0, TypeError, "a whole number, a slice or a list"),
        (True, TypeError, "a whole number"),
        (None, TypeError, "a whole number"),
        ([[1]], TypeError, "a whole number"),
        ([0.5] * 9999, TypeError, r"not \[0.5, 0.5, .*\.\.\.\]"),
    ],
)
def test_invalid_indices_are_refused(index, kind, message):
    with pytest.raises(kind, match=message):
        PATHS["states"]()[index]


def test_iteration_yields_single_states():
    path = PATHS["states"]()
    assert [len(state) for state in path] == [1] * 7
    assert all(same(state, path[i]) for i, state in enumerate(path))
    assert list(kr.solve(TOP, [])) == []


def test_a_path_cannot_be_converted_to_an_array():
    with pytest.raises(TypeError, match=r"use an array such as path\.q"):
        np.asarray(PATHS["states"]())


def test_the_error_of_selected_states_does_not_depend_on_their_order():
    path = kr.solve(TOP, np.linspace(0.0, 20.0, 9), tol=1e-6)
    assert path[::-1].error == path.error
    assert path[[8, 5, 0]].error == path[[0, 5, 8]].error <= path.error


def test_slices_of_paths_with_events_can_be_resampled_bitwise():
    path = kr.solve(TOP, 20.0, events=[LOWEST], want=["energy"])
    again = pickle.loads(pickle.dumps(path))
    for part in (path[1:], again[1:]):
        assert part(7.0).energy.tobytes() == path(7.0).energy.tobytes()
        assert part.plan == path[1:].plan and len(part.events) == 0
