"""Tests of output times given as lists, grids or iterators."""

import math

import kreisel as kr
import numpy as np
import pytest
from kreisel._options import ensemble_options, times

TOP, THESIS = kr.scenes.asymmetric, kr.scenes.thesis
MANY = THESIS.vary(spin=[1.0, 2.0, 3.0], tilt=[[0.2], [0.4]])


def test_the_number_of_steps_is_limited():
    edge = 2.0**53
    assert times._count_whole_steps(edge - 2.0, 1.0) == 2**53 - 2
    for end in (edge, -edge):
        with pytest.raises(ValueError, match=r"takes more steps of 1\.0 than double precision"):
            times._count_whole_steps(end, 1.0)
        with pytest.raises(ValueError, match="takes more steps"):
            times.check_resolvable_horizon(TOP, end, 1.0)
    times_array = np.full((2, 3, 1), 0.01 * edge)
    with pytest.raises(ValueError, match=r"takes more steps of 0\.01"):
        ensemble_options.validate_ensemble_times(
            MANY, times_array, ensemble_options.validate_ensemble_options(MANY, "strang", 0.01)
        )
    assert times._count_whole_steps(0.0, 0.1) == 0
    assert [times._count_whole_steps(end, 0.1) for end in (0.3, -0.3, 0.35, 0.34, 0.2999)] == [
        3,
        3,
        3,
        3,
        2,
    ]


def test_the_rotation_of_a_top_is_limited():
    velocity = np.abs(kr.solve(TOP, [0.0]).body_velocity).max()
    end = 2.0**53 / max(TOP._rotation_rate, velocity)
    times.check_resolvable_horizon(TOP, 0.999999 * end, None)
    for t in (1.000001 * end, -1.000001 * end):
        with pytest.raises(ValueError, match=r"this top turns by 9e\+15 rad"):
            times.check_resolvable_horizon(TOP, t, None)


def test_a_time_grid_contains_the_steps_up_to_its_end():
    def grid(end, every=1, step=0.1):
        return times.time_array(end, step, every).round(12).tolist()

    assert grid(0.0) == [0.0] and grid(0.05) == [0.0] and grid(-0.3) == [0.0, -0.1, -0.2, -0.3]
    assert grid(0.5, 2) == [0.0, 0.2, 0.4] and grid(0.5, 5) == [0.0, 0.5] and grid(0.5, 6) == [0.0]
    assert (
        times.time_array(0.5, None, 3).tolist()
        == times.time_array(0.5, 0.1, None).tolist()
        == [0, 0.5]
    )


def test_memory_is_checked_to_the_byte(monkeypatch):
    for module in (times, ensemble_options):
        monkeypatch.setattr(module, "get_total_memory", lambda: 7200)
    times.check_states_fit_in_memory(100, 72)
    with pytest.raises(MemoryError, match=r"101 states need 7\.27e-06 GB"):
        times.check_states_fit_in_memory(101, 72)
    assert len(times.time_array(9.9, 0.1, 1)) == 100
    with pytest.raises(MemoryError, match="101 states"):
        times.time_array(10.0, 0.1, 1)
    order = ensemble_options.validate_ensemble_options(MANY, "auto")
    ensemble_options.check_result_memory(MANY, np.ones(18), order)
    with pytest.raises(MemoryError, match=r"6 tops with 19 states each need 7\.3e-06 GB"):
        ensemble_options.check_result_memory(MANY, np.ones(19), order)
    ensemble_options.check_result_memory(
        MANY,
        np.ones(1900),
        ensemble_options.validate_ensemble_options(MANY, "auto", reduce={"energy": "min"}),
    )


@pytest.mark.parametrize(
    "values, message",
    [
        ([-1.0, 2.0], r"t\[0\] = -1\.0 goes back from the start at 0"),
        ([1.0, 2.0, 1.5], r"t\[2\] = 1\.5 goes back from t\[1\] = 2\.0"),
        ([-1.0, -2.0, -1.5], r"t\[2\] = -1\.5 goes back from t\[1\] = -2\.0"),
    ],
)
def test_decreasing_times_are_named(values, message):
    with pytest.raises(ValueError, match=message):
        times.time_array(values, None, None)


def test_times_before_the_time_of_a_run_are_named():
    for sign in (1, -1):
        run = kr.start(TOP, back=sign < 0)
        run.to([sign * 1.0])
        with pytest.raises(ValueError, match=rf"t\[0\] = {sign * 0.5} goes back from the run's"):
            run.to([sign * 0.5])
        assert run.to([sign * 1.0]).t.tolist() == [sign * 1.0]
    assert times.time_array([1.0, 1.0], None, None).tolist() == [1.0, 1.0]
    assert times.time_array([-1.0, -1.0], None, None).tolist() == [-1.0, -1.0]
    assert times.time_array([0.0, 0.0], None, None).tolist() == [0.0, 0.0]


def test_decreasing_times_of_one_top_are_named(monkeypatch):
    monkeypatch.setattr(ensemble_options, "_MAX_ROWS", 4)
    own = np.array([[[1.0, 2.0]] * 3] * 2)
    own[1, 2] = 2.0, 1.0
    with pytest.raises(ValueError, match=r"t\[1, 2, 1\] = 1\.0 goes back from t\[1, 2, 0\] = 2\.0"):
        kr.solve(MANY, own)
    own[1, 2], own[1, 1] = (1.0, 1.0), (-1.0, 2.0)
    with pytest.raises(ValueError, match=r"t\[1, 1, 0\] = -1\.0 goes back from the start at 0"):
        kr.solve(MANY, own)
    own[1, 1] = -1.0, -1.0
    assert np.array_equal(kr.solve(MANY, own).t, own)


def test_chunks_have_the_requested_size():
    def sizes(t, size, **more):
        words = {"step": 0.1, "every": 1, "resume_time": None, **more}
        return [
            piece.round(12).tolist() for piece in times.iterate_time_chunks(t, size=size, **words)
        ]

    assert sizes(0.3, 2) == [[0.0, 0.1], [0.2, 0.3]] and sizes(-0.2, 2) == [[0.0, -0.1], [-0.2]]
    assert sizes(0.7, 2, every=3) == [[0.0, 0.3], [0.6]]
    assert sizes(0.7, 2, every=3, resume_time=3 * 0.1) == [[0.6]]
    assert sizes(0.7, 2, every=3, resume_time=0.2) == [[0.3, 0.6]]
    assert sizes(-0.7, 2, every=3, resume_time=-0.2) == [[-0.3, -0.6]]
    assert sizes(0.3, 2, resume_time=3 * 0.1) == []
    for t in ([1.0, 2.0, 3.0], iter([1.0, 2.0, 3.0])):
        assert sizes(t, 2, every=None) == [[1.0, 2.0], [3.0]]
    run = kr.start(TOP)
    assert [len(path) for path in run.stream([1.0, 2.0], chunk=1)] == [1, 1]
    endless = times.iterate_time_chunks(-math.inf, 0.5, 2, 3, None)
    assert [next(endless).tolist() for _ in range(2)] == [[0.0, -1.0, -2.0], [-3.0, -4.0, -5.0]]


def test_the_first_nonzero_time_determines_the_direction():
    for t, back in (
        (0.0, False),
        (-1.0, True),
        ([0.0, -1.0], True),
        ([], False),
        (np.array([-1.0, -2.0]), True),
        ((0.0, 1.0), False),
        (np.float64(-2.0), True),
        (-math.inf, True),
    ):
        assert times.find_time_direction(t)[0] is back
    for values, back in (([0.0, -1.0, -2.0], True), ([0.0, 0.0], False), ([0.0, 2.0, 3.0], False)):
        is_back, t = times.find_time_direction(iter(values))
        assert is_back is back and list(t) == values


def test_iterated_rows_of_times_may_begin_with_the_start():
    is_back, _ = times.find_time_direction(iter([np.array([0.0, 1.0]), np.array([2.0])]))
    assert is_back is False
    assert times.find_time_direction(iter([np.array([0.0, -1.0])]))[0] is True


def test_unknown_memory_size_counts_as_enough(monkeypatch):
    def silent(name):
        raise ValueError(name)

    monkeypatch.setattr(times.os, "sysconf", silent)
    assert times.get_total_memory() == 2**63
    monkeypatch.setattr(times.os, "sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 3}.__getitem__)
    assert times.get_total_memory() == 12288


def test_empty_times_allow_any_angular_velocity():
    fast = THESIS.replace(momentum=(0, 0, 1e18))
    for more in ({}, {"tangents": "start"}):
        assert len(kr.solve(fast, [], **more)) == 0
        with pytest.raises(ValueError, match=r"by t = 1\.0 this top turns by"):
            kr.solve(fast, [1.0], **more)
