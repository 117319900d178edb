"""What lies on the very edge of what is taken, and the first that is refused."""

import itertools
import math
from concurrent.futures import ThreadPoolExecutor

import kreisel as kr
import numpy as np
import pytest
from kreisel._model import starts, words
from kreisel._request import many, request, times
from kreisel._verbs import chaos, geometric

TOP, THESIS, FREE = kr.scenes.asymmetric, kr.scenes.thesis, kr.scenes.dzhanibekov
MANY = THESIS.vary(spin=[1.0, 2.0, 3.0], tilt=[[0.2], [0.4]])
BALL = kr.Body(2.0, (0.5, 0.5, 0.5), (0, 0, 0))


# Starts


def test_a_start_of_the_very_least_energy_is_one():
    asked = {"body": TOP.body, "vertical": 1.0, "n": 0}
    with pytest.raises(ValueError, match="the least energy there is") as refused:
        kr.starts(energy=-5.0, **asked)
    least = float(str(refused.value).split()[-1])
    assert kr.starts(energy=least, **asked).shape == (0,)
    with pytest.raises(ValueError, match="no start has energy"):
        kr.starts(energy=math.nextafter(least, -9.0), **asked)
    level = kr.starts(BALL, energy=1.0 + 1e-12, vertical=1.0, n=3)
    np.testing.assert_allclose(level.momentum, [(0, 0, 1)] * 3, atol=2e-6)


def test_no_start_at_all_may_be_asked_for():
    assert kr.starts(TOP.body, energy=2.0, vertical=1.0, n=0).shape == (0,)
    for wrong in ({"n": -1}, {"n": 3, "seed": -1}, {"grid": (0, 3)}, {"grid": (1, 2, 0)}):
        with pytest.raises(ValueError, match=r"must be|must not"):
            kr.starts(TOP.body, energy=2.0, vertical=1.0, **wrong)


def test_starts_are_the_same_in_blocks_of_any_size(monkeypatch):
    asked = {"energy": 2.0, "vertical": 1.0, "n": 11, "seed": 6}
    whole = kr.starts(TOP.body, **asked)
    monkeypatch.setattr(starts, "_ROWS", 4)
    parts = kr.starts(TOP.body, **asked)
    assert np.array_equal(parts.momentum, whole.momentum)
    assert np.array_equal(parts.attitude, whole.attitude)


@pytest.mark.parametrize("grid", [(3, 4), (2, 3, 1), (2, 3, 2), (2, 3, 5)])
@pytest.mark.parametrize("body", [TOP.body, THESIS.body, FREE.body, BALL])
def test_starts_of_a_grid_are_all_apart_and_on_the_surface(grid, body):
    tops = kr.starts(body, energy=6.0, vertical=-0.5, grid=grid, gravity=-0.5)
    assert len(tops) == math.prod(grid) * (2 if len(grid) == 2 else 1)
    rows = np.concatenate([tops.momentum, tops.attitude], axis=1).round(9)
    assert len(np.unique(rows, axis=0)) == len(rows)
    path = kr.solve(tops, [0.0])
    np.testing.assert_allclose(path.energy[:, 0], 6.0, rtol=1e-13)
    np.testing.assert_allclose(path.vertical_momentum[:, 0], -0.5, rtol=1e-12)


def test_verticals_turn_by_the_shortest_way():
    ways = np.array([(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0), (0.6, 0, -0.8), (0, 0.6, 0.8)])
    turns = starts._unturned(ways.astype(float))
    expected = np.array(
        [
            (1, 0, 0, 0),
            (0, 1, 0, 0),
            (math.sqrt(0.5), 0, -math.sqrt(0.5), 0),
            (math.sqrt(0.5), -math.sqrt(0.5), 0, 0),
            (math.sqrt(0.1), 0, -math.sqrt(0.9), 0),
            (math.sqrt(0.9), math.sqrt(0.1), 0, 0),
        ]
    )
    np.testing.assert_allclose(turns, expected, atol=1e-15)
    near = starts._unturned(np.array([[3e-9, 4e-9, -1.0]]))
    np.testing.assert_allclose(near, [(2.5e-9, 0.8, -0.6, 0)], rtol=1e-7)


def test_cells_cover_a_sphere_and_are_halved_across_their_longer_side():
    cover = starts._Cover(*(np.array([x]) for x in (-1.0, 0.0, 1.0, 0.5 * math.pi)))
    whole = cover
    for _ in range(5):
        whole = whole.halved()
    assert len(whole.height) == 32
    assert (whole.tall * whole.wide).sum() == pytest.approx(0.5 * math.pi, rel=1e-14)
    middles, reach = whole.middles()
    corners = np.stack(
        [
            starts._verticals(whole.height + a * whole.tall, whole.angle + b * whole.wide)
            for a, b in itertools.product((0.0, 0.5, 1.0), repeat=2)
        ]
    )
    away = np.arccos(np.clip((corners * middles).sum(axis=-1), -1.0, 1.0))
    assert (away <= reach + 1e-7).all() and reach.max() < 0.75
    tall = starts._Cover(*(np.array([x]) for x in (-0.5, 0.0, 1.0, 0.25))).halved()
    assert tall.tall.tolist() == [0.5, 0.5] and tall.height.tolist() == [-0.5, 0.0]
    wide = starts._Cover(*(np.array([x]) for x in (-0.1, 1.0, 0.2, 2.0))).halved()
    assert wide.wide.tolist() == [1.0, 1.0] and wide.angle.tolist() == [1.0, 2.0]


# Words


def test_damping_on_the_edge():
    assert words.damping_of(None) == (0.0, 0.0, 0.0) and words.damping_of(0) == (0.0, 0.0, 0.0)
    assert words.damping_of(np.float64(0.5)) == (0.5, 0.5, 0.5)
    assert tuple(words.damping_of((0.0, 0.1, 0.2))) == (0.0, 0.1, 0.2)
    for wrong in (-0.1, (0.1, -1e-300, 0.0)):
        with pytest.raises(ValueError, match="damping must not be negative"):
            words.damping_of(wrong)


# What steers


def test_digits_go_up_to_the_next_that_there_are():
    taylor = kr.methods["taylor"]
    asked = {1: 16, 16: 16, 17: 20, 20: 20, 21: 30, 30: 30}
    assert {n: request.checked_digits(taylor, n, None) for n in asked} == asked
    assert [request.request(TOP, "taylor", digits=n).low for n in (16, 17)] == [False, True]
    for wrong, said in ((31, "at most 30, not 31"), (0, "digits must be")):
        with pytest.raises(ValueError, match=said):
            request.checked_digits(taylor, wrong, None)


def test_a_tolerance_is_below_one():
    below = math.nextafter(1.0, 0.0)
    assert request.checked_tol(kr.methods["taylor"], below) == below
    with pytest.raises(ValueError, match=r"tol must be below 1: .* not 1\.0"):
        request.checked_tol(kr.methods["taylor"], 1.0)
    assert request.checked_tol(kr.methods["exact"], 0.5) is None
    assert request.checked_step(kr.methods["exact"], 0.5) is None


def test_an_error_is_at_most_a_tenth_of_a_radian():
    assert geometric.checked_error(0.1, {"step": None}) == 0.1
    with pytest.raises(ValueError, match=r"at most 0\.1 rad, not 0\.100"):
        geometric.checked_error(math.nextafter(0.1, 1.0), {})
    with pytest.raises(ValueError, match="leave step and every out"):
        geometric.checked_error(0.1, {"step": 1.0, "tol": None, "every": 2})


def test_a_request_that_is_asked_again_is_the_same():
    one, other = (request.request(TOP, "strang", step=0.1, want=("energy",)) for _ in range(2))
    assert one is other
    assert request.request(TOP, "strang", step=1).step == 1.0
    assert type(request.request(TOP, "strang", step=1).step) is float
    assert one.signed(True) == -0.1 and one.signed(False) == 0.1
    assert request.request(TOP, "taylor").signed(True) is None
    assert one.within == 2.0**52 * 0.1 and request.request(TOP, "taylor").within == math.inf
    assert request.request(TOP, "taylor").limit > one.limit == times.PIECE
    assert request.request(TOP, "taylor", want=("q", "energy")).size == 40
    assert request.request(TOP, "taylor").size == 64


def test_the_heading_is_left_out_where_nothing_needs_it():
    def left(method="taylor", **more):
        return request.request(TOP, method, **more).leave_heading

    assert left(want=("energy",)) and left(want=("nutation", "energy"))
    assert (
        not left() and not left(want=("energy", "apex")) and not left(want=("energy",), digits=17)
    )
    assert left(want=("energy",), digits=16) and not left("strang", want=("energy",), step=0.1)
    watched = kr.start(TOP, want=["energy"], events=kr.events.nutation())
    assert not watched._request.leave_heading


def test_threads_are_no_more_than_can_be():
    assert [many.threads_of(n, None) for n in (1, 1024, 1025, 10**9)] == [1, 1024, 1024, 1024]
    with pytest.raises(ValueError, match="threads must be"):
        many.threads_of(0, None)
    with ThreadPoolExecutor(1) as pool:
        assert many.threads_of(None, pool) >= 1
        with pytest.raises(ValueError, match="give either threads or an executor, not both"):
            many.threads_of(1, pool)
        kr.solve(MANY, 1.0, executor=pool)


@pytest.mark.parametrize("count, threads", [(None, 1), (3, 3)])
def test_where_nobody_tells_who_may_run_all_processors_do(monkeypatch, count, threads):
    monkeypatch.delattr(many.os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(many.os, "cpu_count", lambda: count)
    assert many.threads_of(None, None) == threads


def test_a_plan_tells_its_bytes_in_all():
    plan = kr.plan(MANY, [1.0, 2.0, 3.0], threads=2)
    assert f"3 states each: {1e-6 * plan.bytes:.3g} MB in all" in str(plan)
    assert f"about {plan.seconds:.2g} s, as 6 of the tops tell" in str(plan)


# Times


def test_steps_can_be_counted_up_to_an_edge():
    edge = 2.0**53
    assert times._steps(edge - 2.0, 1.0) == 2**53 - 2
    for end in (edge, -edge):
        with pytest.raises(ValueError, match=r"takes more steps of 1\.0 than double precision"):
            times._steps(end, 1.0)
        with pytest.raises(ValueError, match="takes more steps"):
            times.refuse_endless(TOP, end, 1.0)
    far = np.full((2, 3, 1), 0.01 * edge)
    with pytest.raises(ValueError, match=r"takes more steps of 0\.01"):
        many.times_of(MANY, far, many.order(MANY, "strang", 0.01), None)
    assert times._steps(0.0, 0.1) == 0
    assert [times._steps(end, 0.1) for end in (0.3, -0.3, 0.35, 0.34, 0.2999)] == [3, 3, 3, 3, 2]


def test_a_top_turns_up_to_an_edge():
    end = 2.0**53 / TOP._fastest
    times.refuse_endless(TOP, 0.999999 * end, None)
    for far in (1.000001 * end, -1.000001 * end):
        with pytest.raises(ValueError, match=r"this top turns by 9e\+15 rad"):
            times.refuse_endless(TOP, far, None)


def test_a_grid_has_what_fits():
    def grid(end, every=1, step=0.1):
        return times.listed(end, step, every).round(12).tolist()

    assert grid(0.0) == [0.0] and grid(0.05) == [0.0] and grid(-0.3) == [0.0, -0.1, -0.2, -0.3]
    assert grid(0.5, 2) == [0.0, 0.2, 0.4] and grid(0.5, 5) == [0.0, 0.5] and grid(0.5, 6) == [0.0]
    assert times.listed(0.5, None, 3).tolist() == times.listed(0.5, 0.1, None).tolist() == [0, 0.5]


def test_memory_on_the_edge(monkeypatch):
    for module in (times, many):
        monkeypatch.setattr(module, "memory", lambda: 7200)
    times.refuse_too_many(100, 72)
    with pytest.raises(MemoryError, match=r"101 states need 7\.27e-06 GB"):
        times.refuse_too_many(101, 72)
    assert len(times.listed(9.9, 0.1, 1)) == 100
    with pytest.raises(MemoryError, match="101 states"):
        times.listed(10.0, 0.1, 1)
    order = many.order(MANY, "auto")
    many.refuse_too_large(MANY, np.ones(18), order)
    with pytest.raises(MemoryError, match=r"6 tops with 19 states each need 7\.3e-06 GB"):
        many.refuse_too_large(MANY, np.ones(19), order)
    many.refuse_too_large(MANY, np.ones(1900), many.order(MANY, "auto", reduce={"energy": "min"}))


@pytest.mark.parametrize(
    "given, said",
    [
        ([-1.0, 2.0], r"t\[1\] = 2\.0 goes back from t\[0\] = -1\.0|t\[0\] = -1\.0 goes back"),
        ([1.0, 2.0, 1.5], r"t\[2\] = 1\.5 goes back from t\[1\] = 2\.0"),
        ([-1.0, -2.0, -1.5], r"t\[2\] = -1\.5 goes back from t\[1\] = -2\.0"),
    ],
)
def test_times_that_go_back_are_named(given, said):
    with pytest.raises(ValueError, match=said):
        times.listed(given, None, None)


def test_times_that_go_back_from_where_a_run_stands_are_named():
    for sign in (1, -1):
        run = kr.start(TOP, back=sign < 0)
        run.to([sign * 1.0])
        with pytest.raises(ValueError, match=rf"t\[0\] = {sign * 0.5} goes back from the run's"):
            run.to([sign * 0.5])
        assert run.to([sign * 1.0]).t.tolist() == [sign * 1.0]
    assert times.listed([1.0, 1.0], None, None).tolist() == [1.0, 1.0]
    assert times.listed([-1.0, -1.0], None, None).tolist() == [-1.0, -1.0]
    assert times.listed([0.0, 0.0], None, None).tolist() == [0.0, 0.0]


def test_own_times_of_a_top_that_go_back_are_named(monkeypatch):
    monkeypatch.setattr(many, "_ROWS", 4)
    own = np.array([[[1.0, 2.0]] * 3] * 2)
    own[1, 2] = 2.0, 1.0
    with pytest.raises(ValueError, match=r"t\[1, 2, 1\] = 1\.0 goes back from t\[1, 2, 0\] = 2\.0"):
        kr.solve(MANY, own)
    own[1, 2], own[1, 1] = (1.0, 1.0), (-1.0, 2.0)
    with pytest.raises(ValueError, match=r"t\[1, 1, 0\] = -1\.0 goes back from the start at 0"):
        kr.solve(MANY, own)
    own[1, 1] = -1.0, -1.0
    assert np.array_equal(kr.solve(MANY, own).t, own)


def test_pieces_are_of_the_size_that_is_asked_for():
    def sizes(t, size, **more):
        words = {"step": 0.1, "every": 1, "after": None, **more}
        return [piece.round(12).tolist() for piece in times.pieces(t, size=size, **words)]

    assert sizes(0.3, 2) == [[0.0, 0.1], [0.2, 0.3]] and sizes(-0.2, 2) == [[0.0, -0.1], [-0.2]]
    assert sizes(0.7, 2, every=3) == [[0.0, 0.3], [0.6]]
    assert sizes(0.7, 2, every=3, after=3 * 0.1) == [[0.6]]
    assert sizes(0.7, 2, every=3, after=0.2) == [[0.3, 0.6]]
    assert sizes(-0.7, 2, every=3, after=-0.2) == [[-0.3, -0.6]]
    assert sizes(0.3, 2, after=3 * 0.1) == []
    for t in ([1.0, 2.0, 3.0], iter([1.0, 2.0, 3.0])):
        assert sizes(t, 2, every=None) == [[1.0, 2.0], [3.0]]
    run = kr.start(TOP)
    assert [len(path) for path in run.stream([1.0, 2.0], chunk=1)] == [1, 1]
    endless = times.pieces(-math.inf, 0.5, 2, 3, None)
    assert [next(endless).tolist() for _ in range(2)] == [[0.0, -1.0, -2.0], [-3.0, -4.0, -5.0]]


def test_the_way_back_is_told_by_the_first_time_that_is_not_the_start():
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
        assert times.direction(t)[0] is back
    for given, back in (([0.0, -1.0, -2.0], True), ([0.0, 0.0], False), ([0.0, 2.0, 3.0], False)):
        told, t = times.direction(iter(given))
        assert told is back and list(t) == given


# Chaos


def test_the_curve_of_a_number_has_three_decades():
    told = chaos._times(20.0)
    assert told.size == 32 and told[-1] == 20.0 and told[0] == pytest.approx(0.02, rel=1e-12)
    np.testing.assert_allclose(told[1:] / told[:-1], 10 ** (3 / 31), rtol=1e-12)
    assert (chaos._times(-20.0) == -told).all()
    assert chaos._times([1.0, 2.0]).tolist() == [1.0, 2.0]


def test_a_curve_of_a_number_ends_as_that_of_a_list():
    told, last = kr.lyapunov(TOP, 20.0), kr.lyapunov(TOP, [20.0])
    assert told.value == last.value and last.curve.shape == (1,)
    assert told.certificate.shape == told.status.shape == ()
    assert kr.lyapunov(TOP, 20.0, tol=1e-5).value == pytest.approx(told.value, rel=1e-2)
    assert kr.lyapunov(TOP, 20.0, tol=1e-5).certificate > told.certificate


# Sections


def test_a_section_waits_as_long_as_is_said():
    first = kr.section(TOP, n=1).t[0]
    assert kr.section(TOP, n=1, wait=1.001 * first).count.tolist() == [1]
    late = kr.section(TOP, n=1, wait=0.999 * first)
    assert late.count.tolist() == [0] and late.failed.tolist() == [0]
    for wrong, said in ((0.0, "wait must not be zero"), ([1.0, 2.0], r"of shape \(1,\)")):
        with pytest.raises(ValueError, match=said):
            kr.section(TOP, n=1, wait=wrong)
    for event in (kr.events.nutation(most=2), kr.events.nutation(terminal=True)):
        with pytest.raises(ValueError, match="leave most and terminal out"):
            kr.section(TOP, event, 1)
    with pytest.raises(ValueError, match="n must be"):
        kr.section(TOP, n=0)


# Closed forms


def test_a_map_counts_up_to_an_edge():
    mapped = kr.exact(THESIS, map="bobenko_suris", step=0.1)
    assert len(mapped([0, 2**53 - 1])) == 2 and len(mapped([])) == 0 and len(mapped(-3)) == 1
    for wrong in (2**53, -(2**53), 0.5, [1, 2.5]):
        with pytest.raises(ValueError, match=r"k must be whole and below 2\*\*53"):
            mapped(wrong)


def test_closed_forms_of_many_are_those_of_one():
    told = kr.exact(MANY)
    assert len(told) == 2 and len(told.scenes) == 6 and told([]).shape == (2, 3, 0, 8)
    own = np.arange(12.0).reshape(2, 3, 2) - 5.0
    states, at_once = told(own), told([0.5, -0.5, 0.0])
    for i in np.ndindex(2, 3):
        one = kr.exact(MANY[i])
        assert np.array_equal(states[i], one(own[i]).states)
        assert np.array_equal(at_once[i], one([0.5, -0.5, 0.0]).states)
        assert np.array_equal(told(-1.5)[i], one(-1.5).states[0])
        assert told.t_least[i] == one.t_least and told.course[i] == one.course
    assert not told.course.flags.writeable and not told.period.flags.writeable
    assert repr(told) == "<kreisel.ExactEnsemble: scenes of shape (2, 3)>"
    assert repr(kr.exact([THESIS, FREE])) == "<kreisel.ExactEnsemble: 2 scenes>"
    with pytest.raises(ValueError, match=r"^top\[0, 0\]: by t = 1e\+17 this top turns"):
        told([1.0, -1e17])
    late = own.copy()
    late[1, 1, 0] = 1e17
    with pytest.raises(ValueError, match=r"^top\[1, 1\]: by t = 1e\+17"):
        told(late)


def test_scenes_without_closed_form_are_counted():
    mixed = [THESIS, TOP, FREE, TOP]
    with pytest.raises(ValueError, match=r"^scene\[1\], the first of 2 such: no closed form"):
        kr.exact(mixed)
    with pytest.raises(ValueError, match=r"^scene\[1\]: no closed form"):
        kr.exact(mixed[:3])
    with pytest.raises(ValueError, match="must not be empty"):
        kr.exact([])
