"""Tests that the page computes the states and measures that kreisel computes."""

import kreisel as kr
import numpy as np
import pytest
from browser import PRESETS, TICKS, UPRIGHT, encode_link, scene_in_python, wait_for

RK = ["strang", "rk4"]
NOT_IN_PYTHON = {"error", "modified_energy"}  # measures that a path does not have as such


def solve_as_page(scene, top, t):
    """Solve a top of the page with its method and step until `t`, at every step."""
    second = bool(top["side"] == 1 and scene["second"])
    start, method, step = scene_in_python(scene, second=second), top["method"], top["step"]
    count = round(t / step)
    if method == "extrap":  # restarted at each step
        ends = [start]
        for _ in range(count):
            ends.append(kr.solve(ends[-1], [step], method, tol=scene["tol"]).end)
        return [[*end.attitude, *end.momentum] for end in ends], None
    if kr.methods[method].algebraic:
        path = kr.solve(start, t, method, step=step, every=1)
    else:
        path = kr.solve(start, np.arange(count + 1) * step, method)
    return path.states[:, 1:].tolist(), path


def measure(path, name):
    """Return a quantity at all times of a path, or NaN if the body does not have it."""
    try:
        return getattr(path, name)
    except (AttributeError, ValueError):
        return np.full(len(path), np.nan)


@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_moves_and_measures_as_in_python(page, preset):
    page.load(preset)
    page.advance(7)
    scene = page.read_scene()
    for i, (state, top) in enumerate(zip(page.read_states(), page.read_tops(), strict=True)):
        assert 7 - top["step"] < state[0] <= 7 + 1e-9
        states, path = solve_as_page(scene, top, state[0])
        if kr.methods[top["method"]].algebraic:
            assert state[1:] == states[-1], i
        assert state[1:] == pytest.approx(states[-1], abs=1e-7 if path is None else 1e-10)
        if path is None:
            continue
        rows = np.round(page.read_times() / top["step"]).astype(int)
        offered = page.evaluate("kreisel.page.measures.map(({name}) => name)")
        assert {"energy", "nutation", "spin", "axial_momentum", "vertical_momentum"} <= {*offered}
        for name in {*offered} - NOT_IN_PYTHON:
            expected = measure(path, name)
            size = np.abs(expected).max() + 1
            assert page.measure_top(i, name) == pytest.approx(expected[-1], abs=1e-10 * size), name
            record = page.read_record(i, name)
            assert record == pytest.approx(expected[rows], abs=1e-10 * size), name


@pytest.mark.parametrize("preset", [UPRIGHT, "Kowalewski", "Dzhanibekov effect"])
def test_algebraic_methods_equal_python_bitwise(page, preset):
    page.load(preset)
    top = page.build_scene()
    names = [name for name, method in kr.methods.items() if method.algebraic and method.suits(top)]
    assert len(names) >= 9
    for name in names:
        page.evaluate(
            "name => { kreisel.page.editScene((s) => (s.methods = [name])); kreisel.advance(5); }",
            name,
        )
        expected = kr.solve(top, 5, name, step=0.01, every=500).states[-1]
        assert page.read_states()[0] == expected.tolist(), name


def test_three_methods_with_two_steps_have_their_own_states(page):
    page.load(methods=["bobenko_suris", "strang", "rk4"], step=[0.01, 0.1])
    page.advance(5)
    tops = page.read_tops()
    assert len(tops) == 6 == len({top["colour"] for top in tops})
    for state, top in zip(page.read_states(), tops, strict=True):
        assert state[1:] == solve_as_page(page.read_scene(), top, 5)[0][-1]


@pytest.mark.parametrize("place, value", [("methods.0", "rk4"), ("step.0", 0.02), ("tol", 1e-9)])
def test_a_change_of_the_computation_keeps_start_and_time(page, place, value):
    page.advance(20)
    before = page.read_scene()
    page.set_value(place, value)
    page.wait_until_time(20)
    scene, (top, *_) = page.read_scene(), page.read_tops()
    assert all(scene[key] == before[key] for key in ("attitude", "momentum", "body", "gravity"))
    assert page.read_states()[0][1:] == solve_as_page(scene, top, 20)[0][-1]


def test_a_smaller_tolerance_gives_smaller_errors(page):
    page.set_value("methods.0", "extrap")
    exact = kr.exact(page.build_scene())([4.0]).states[0]
    errors = []
    for tol in ("0.01", "1e-10"):
        page.fill_field("Tolerance of adaptive methods", tol)
        page.evaluate("kreisel.page.setValue('step.0', 0.5); kreisel.advance(4)")
        errors.append(np.abs(np.subtract(page.read_states()[0], exact)).max())
        page.evaluate("kreisel.page.rewind()")
    assert page.read_scene()["tol"] == 1e-10 and errors[1] < 1e-8 < 1e-5 < errors[0]


def test_one_large_advance_equals_many_small_ones_and_jumps(page):
    page.load("Compare four")
    page.advance(30)
    states = page.read_states()
    page.evaluate("""{
        kreisel.page.rewind();
        for (let t = 0, i = 0; t < 30; i++) {
            t = Math.min(30, t + ((i * 7919) % 97) / 300);
            kreisel.advance(t);
        }
    }""")
    assert page.read_states() == states
    for t in (300, 30):
        page.fill_field("Jump to t", t)
        page.wait_until_time(t)
    assert page.read_states() == states and not page.evaluate("kreisel.page.isRunning")
    page.fill_field("Jump to t", "1e8")
    page.find_button("Stop").click()
    assert page.read_clock() < 1e8 * TICKS and page.evaluate("kreisel.page.goal") is None


def test_each_top_is_compared_with_the_exact_motion_from_its_own_start(page):
    for preset, methods in (("Compare four", ["bobenko_suris", "extrap"]), ("Sleeping top", RK)):
        page.load(preset, methods=methods)
        page.advance(10)
        for i, state in enumerate(page.read_states()):
            exact = page.read_exact(second=methods is RK and i == 1)([10.0])
            own = kr.attitude_error(state[1:5], exact.q[-1])
            assert page.measure_top(i, "error") == pytest.approx(own, rel=1e-3, abs=1e-11)


def test_tops_are_compared_only_where_their_steps_meet(page):
    page.load("Compare four", step=[0.03, 0.2])
    page.advance(30)
    assert page.read_times() == pytest.approx(0.6 * np.arange(51), abs=1e-9)
    page.advance(30.03)
    assert np.isnan(page.measure_top(1, "error"))
    page.advance(30.21)
    wait_for(page, "document.getElementById('times').textContent.includes('30.2')")
    assert page.locator("#times").inner_text().count("is shown at t = 30.2") == 2


def test_the_modified_energy_is_that_of_the_path(page):
    page.load("Energy and motion")
    page.advance(20)
    path = kr.solve(page.build_scene(), 20, "bobenko_suris", step=0.05, every=1)
    expected = path.modified_energy(0.05)
    assert page.measure_top(0, "modified_energy") == expected[-1]
    record = page.read_record(0, "modified_energy")
    assert np.ptp(record) < 1e-12 and record[0] == pytest.approx(expected[0], rel=1e-12)


def test_thinned_records_keep_their_extremes(page):
    page.load(step=[0.05])
    ends = []
    for t in (100, 20000):
        page.advance(t)
        sides = "[-1, 1].map((side) => kreisel.simulation.getRecord(0, 'energy', side))"
        ends.append(np.array(page.evaluate(sides)) - page.read_record(0, "energy")[0])
    (low, high), (long_low, long_high) = ends
    assert len(page.read_times()) <= 1025 and page.read_times()[-1] > 19900
    assert (long_low.min(), long_high.max()) == pytest.approx((low.min(), high.max()), rel=1e-3)
    assert long_low[1:].max() < 0.98 * low.min() and long_high[1:].min() > 0.98 * high.max()


def test_a_path_plays_beside_a_live_top(page):
    path = kr.solve(kr.scenes.thesis, np.arange(201) * 0.05, "extrap", tol=1e-12)
    scene = kr.view(path, methods="rk4", open=False).scene
    page.load_scene(scene)
    page.advance(10)
    live, played = page.read_states()
    assert played == path.states[-1].tolist()
    assert live[1:] == pytest.approx(played[1:], abs=1e-3)
    assert 0 < page.read_record(1, "error").max() < 1e-4
    page.set_value("gravity", 2)
    assert "path" in page.read_message() and page.read_scene()["tracks"] == []
    page.find_button("Undo").click()
    assert len(page.read_scene()["tracks"]) == 1


def test_a_failing_method_is_named_and_the_others_continue(page):
    for other, end in (("strang", 20), ("rk4", 2)):
        page.load(methods=["veselov2", other], step=[1], gravity=10)
        clock, is_running = page.evaluate("""(kreisel.page.setRunning(true), kreisel.advance(20),
            [kreisel.page.clock, kreisel.page.isRunning])""")
        assert clock == end * TICKS and is_running == (other == "strang")
        assert "veselov2 1 stopped" in page.read_message() and "converge" in page.read_message()
        assert page.read_states()[0][0] == 1


def test_a_very_fast_top_does_not_block_the_page(window):
    scene = {"momentum": [1e12, 0, 0], "methods": ["extrap"], "step": [0.2]}
    page = window.open(fragment=encode_link(scene))
    page.find_button("Start").click()
    wait_for(page, "kreisel.page.isLate")
    page.find_button("Stop").click()
    page.find_button("Step").click()
    page.find_button("Stop").click()
    assert page.read_clock() == 0 and page.find_button("Start").is_visible()
    assert page.troubles == []


def test_the_clock_stops_where_all_steps_meet(page):
    page.load("Compare four", step=[0.03, 0.2])
    page.fill_field("Stop at t", "10.13")
    assert page.read_scene()["stop"] == pytest.approx(10.2)
    for _ in range(2):
        page.find_button("Start").click()
        page.advance(12)
        assert page.read_clock() == 10.2 * TICKS and "10.2" in page.read_message()
        assert not page.evaluate("kreisel.page.isRunning")
