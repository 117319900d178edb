"""Tests of friction, falls, rotors, turntables and the balancing game in the viewer."""

import json
import re

import kreisel as kr
import numpy as np
import pytest
from browser import (
    PHONE,
    WIDE,
    advance,
    load,
    make_viewport,
    read_message,
    read_scene,
    read_states,
    reload,
    scene_in_python,
    turn_description,
    visit,
    wait_until_time,
)
from scipy.integrate import solve_ivp
from test_page_numbers import click_exercise, read_numbers

GAME, GYROSCOPE, TURNTABLE = "How long can it stand?", "Gyroscope", "On a turntable"


def differentiate(_, state, moments, lever, damping, friction):
    """Return the time derivatives of attitude and momentum of a spinning top with friction."""
    w, x, y, z, *m = state
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    rate = turn @ ((turn.T @ m) / moments)
    apex = turn[:, 2]
    spin = 0.5 * np.array([-rate @ (x, y, z), *(w * rate + np.cross(rate, (x, y, z)))])
    torque = lever * np.cross((0, 0, 1), apex) - damping * rate
    return np.concatenate((spin, torque - friction * np.sign(rate @ apex) * apex))


def solve_fall(settings, contact):
    """Integrate with SciPy until the tilt of a top equals `contact`, and return the time."""
    scene = scene_in_python(settings)
    body = scene.body

    def reach(_, state, *_rest):
        return 1 - 2 * (state[1] ** 2 + state[2] ** 2) - np.cos(contact)

    reach.terminal = True
    solution = solve_ivp(
        differentiate,
        (0, 100),
        [*settings["attitude"], *settings["momentum"]],
        "DOP853",
        events=reach,
        args=(
            np.array(body.moments),
            body.mass * scene.gravity * body.com[2],
            settings["damping"],
            settings["friction"],
        ),
        rtol=1e-11,
        atol=1e-11,
    )
    return solution.t_events[0][0]


def read_end(page, top=0):
    return page.evaluate(f"kreisel.simulation.getEnd({top})")


# The end on the floor


@pytest.mark.parametrize("exercise", [None, "Start it upright", "Half the friction"])
def test_the_time_until_the_rim_meets_the_floor_agrees_with_scipy(page, exercise):
    load(page, GAME)
    if exercise:
        click_exercise(page, exercise)
        page.evaluate("kreisel.page.rewind()")
    page.evaluate("kreisel.page.setRunning(true)")
    advance(page, 90)
    expected = solve_fall(read_scene(page), page.evaluate("kreisel.page.contact"))
    assert read_end(page) == pytest.approx(expected, abs=1e-4)
    assert f"meets the floor at t = {expected:.2f} s" in read_message(page)
    assert read_numbers(page)["stood"][0] == f"{expected:.2f}"
    assert page.get_by_role("button", name="Start", exact=True).is_visible()


def test_rim_is_on_the_floor_and_not_below(page):
    load(page, GAME)
    advance(page, 90)
    lowest, floor = page.evaluate("""(() => {
        const {view} = kreisel;
        view.world.updateMatrixWorld(true);
        let lowest = Infinity;
        for (const part of view.tops[0].solid.handles.slice(0, 2)) {
            const {position} = part.geometry.attributes, at = view.camera.position.clone();
            for (let k = 0; k < position.count; k++)
                lowest = Math.min(lowest, part.localToWorld(at.fromBufferAttribute(position, k)).z);
        }
        return [lowest, view.floor.height];
    })()""")
    assert floor - 0.01 < lowest < floor + 0.08


def test_a_large_step_gives_an_interval_of_times(page):
    load(page, GAME, step=[0.5])
    advance(page, 90)
    end = solve_fall(read_scene(page), page.evaluate("kreisel.page.contact"))
    low = np.floor(end / 0.5) * 0.5
    assert f"between t = {low:g} and {low + 0.5:g} s" in read_message(page)


def test_both_tops_of_a_pair_are_named(page):
    load(page, GAME, second={"tilt": 30, "spin": 20}, methods=["taylor", "taylor"])
    advance(page, 90)
    assert "Left: the rim" in read_message(page) and "Right: the rim" in read_message(page)
    assert read_end(page, 1) < read_end(page, 0)


@pytest.mark.parametrize("turn", [(0.5, 0.5, 0.5, 0.5), (0.8, 0.36, 0.48, 0.0)])
def test_the_floor_is_the_same_for_a_body_described_in_any_axes(page, turn):
    load(page, GAME)
    contact = page.evaluate("kreisel.page.contact")
    given = turn_description(read_scene(page), turn)
    page.evaluate("given => kreisel.page.load(given)", given)
    assert page.evaluate("kreisel.page.contact") == pytest.approx(contact)


@pytest.mark.parametrize(
    "changes",
    [
        {"damping": 0, "friction": 0},
        {"start": {"tilt": 120, "spin": 5}},
        {"body": {"half": [0.8, 0.8, 0.42], "pivot": [0, 0, 0], "density": 1}},
    ],
)
def test_other_tops_do_not_meet_the_floor(page, changes):
    load(page, GAME, **changes)
    assert page.evaluate("kreisel.page.contact") is None
    advance(page, 60)
    assert np.isnan(read_end(page)) and read_states(page)[0][0] == 60


def test_a_changed_top_restarts_and_undo_returns_to_the_end(page):
    load(page, GAME)
    advance(page, 90)
    end, states = read_end(page), read_states(page)
    message = f"The rim meets the floor at t = {end:.2f} s"
    assert message in read_message(page)
    page.evaluate("kreisel.page.setValue('tilt', 5)")
    assert np.isnan(read_end(page)) and read_states(page)[0][0] == 0
    assert read_message(page) == ""
    page.get_by_role("button", name="Undo").click()
    assert read_states(page) == states and read_message(page) == ""
    advance(page, 90)
    assert read_end(page) == end and message in read_message(page)


def test_start_after_the_end_restarts_the_motion(page):
    load(page, GAME)
    advance(page, 90)
    page.get_by_role("button", name="Start", exact=True).click()
    assert page.evaluate("kreisel.page.isRunning && kreisel.page.clock < 2e6")
    page.evaluate("kreisel.page.setRunning(false)")
    assert np.isnan(read_end(page))


# The texts


def test_an_upright_top_sleeps_above_the_critical_spin(page):
    load(page, GAME)
    click_exercise(page, "Start it upright")
    scene = scene_in_python(read_scene(page)).replace(damping=0, friction=0)
    critical = kr.exact(scene).critical_spin
    page.evaluate("kreisel.page.rewind()")
    for t in range(1, 20):
        advance(page, t)
        spin, tilt = page.evaluate("""(({spin, nutation}) => [spin, nutation])(
            kreisel.simulation.measureTop(0))""")
        if spin < critical:
            break
        assert tilt < np.radians(6)
    assert spin < critical and np.isnan(read_end(page))
    advance(page, 60)
    assert read_end(page) > t


def test_half_the_friction_lets_the_top_stand_longer(page):
    ends = []
    for exercise in (None, "Half the friction"):
        load(page, GAME)
        if exercise:
            click_exercise(page, exercise)
        advance(page, 90)
        ends.append(read_end(page))
    assert ends[1] > 1.5 * ends[0]


def test_texts_of_the_gyroscope_are_true(page):
    types = []
    for exercise in (None, "Let it go at rest", "Half the rotor", "Stop the rotor"):
        load(page, GYROSCOPE)
        if exercise:
            click_exercise(page, exercise)
        types.append(kr.exact(scene_in_python(read_scene(page))).motion_type)
    assert types == ["steady", "cusps", "steady", "pendulum"]


# The game


def test_the_longest_time_is_stored_for_the_next_visit(browser):
    page = visit(browser, reduced_motion="reduce")
    load(page, GAME)
    advance(page, 90)
    first = read_end(page)
    assert read_message(page).endswith("This is your longest time")
    load(page, GAME, start={"tilt": 40, "spin": 20})
    advance(page, 90)
    assert read_end(page) < first and f"longest time is {first:.2f} s" in read_message(page)
    reload(page)
    load(page, GAME)
    assert read_numbers(page)["stands"][1] == f"longest {first:.2f} s"
    page.context.close()


def test_a_start_with_more_energy_does_not_count(browser):
    page = visit(browser, reduced_motion="reduce")
    load(page, GAME, start={"tilt": 15, "spin": 23})
    advance(page, 90)
    scene = scene_in_python(read_scene(page))
    energy = kr.solve(scene, [0.0]).kinetic[0]
    assert f"It started with {energy:.4g} J" in read_message(page)
    assert "does not count" in read_message(page) and read_numbers(page)["stood"][1] == ""
    load(page, GAME, damping=0.011)
    advance(page, 90)
    assert "count" not in read_message(page) and "longest" not in read_message(page)
    page.context.close()


# Numbers and files


@pytest.mark.parametrize("preset", [GAME, GYROSCOPE, TURNTABLE])
def test_states_agree_with_python(page, preset):
    load(page, preset)
    advance(page, 10)
    expected = kr.solve(scene_in_python(read_scene(page)), [10.0]).states[0]
    assert read_states(page)[0] == pytest.approx(expected.tolist(), abs=1e-10)


@pytest.mark.parametrize("preset", [GAME, GYROSCOPE, TURNTABLE])
def test_program_and_toml_have_friction_rotor_and_turntable(page, preset, tmp_path):
    load(page, preset)
    scene, names = scene_in_python(read_scene(page)), {}
    exec(page.get_by_label("Equivalent Python program").input_value(), names)
    assert names["scene"] == scene
    with page.expect_download() as download:
        page.get_by_role("button", name="TOML", exact=True).click()
    assert kr.Scene.from_toml(download.value.path()) == scene


def test_a_method_for_undamped_tops_is_replaced(page):
    page.get_by_role("slider", name="Damping").press("ArrowRight")
    assert read_scene(page)["methods"] == ["taylor"] and read_scene(page)["tol"] == 1e-15
    assert "taylor is used instead" in read_message(page)


@pytest.mark.parametrize("word", ["damping", "friction", "rotor", "turning"])
@pytest.mark.parametrize("bad", [-1, "x", None, [1, 2]])
def test_invalid_numbers_are_refused(page, word, bad):
    before = read_scene(page)
    page.evaluate("given => kreisel.page.load({...kreisel.page.scene, ...given})", {word: bad})
    assert f"{word} cannot be" in read_message(page) and read_scene(page) == before


def test_rotor_keeps_the_rates_of_the_body(page):
    load(page, GYROSCOPE)
    rates = "kreisel.simulation.getVelocity(0)"
    before = page.evaluate(rates)
    field = page.get_by_label("Rotor, number")
    field.fill("5")
    field.press("Tab")
    assert read_scene(page)["rotor"] == [0, 0, 5]
    assert page.evaluate(rates) == pytest.approx(before, abs=1e-12)


def test_rotor_is_an_arrow_at_the_centre_of_mass(page):
    load(page, GYROSCOPE)
    exact = kr.exact(scene_in_python(read_scene(page)))
    assert exact.motion_type == "steady"
    arrow = page.evaluate("""(({h}) => [h.visible, h.tip.position.z / kreisel.view.momentumZoom,
        h.position.z / kreisel.view.zoom])(kreisel.view.tops[0])""")
    assert arrow == pytest.approx([True, 8, 1.1], rel=1e-6)
    load(page)
    assert not page.evaluate("kreisel.view.tops[0].h.visible")


# Turntables


def test_a_top_on_a_turntable_agrees_with_one_at_rest(page):
    load(page, TURNTABLE, start={"tilt": 70, "spin": 1, "precession": 0.3}, gravity=4)
    scene = read_scene(page)
    advance(page, 8)
    resting = scene_in_python({**scene, "turning": [0, 0, 0]})
    x, y, z = kr.exact(resting)(8.0).apex[0]
    c, s = np.cos(-0.6 * 8), np.sin(-0.6 * 8)
    apex = kr.quaternion.turn(read_states(page)[0][1:5], (0, 0, 1))
    assert apex == pytest.approx([c * x - s * y, s * x + c * y, z], abs=1e-9)


@pytest.mark.parametrize("turning", [[0, 0, 0.6], [0.3, -0.2, 0.5]])
def test_starts_are_relative_to_the_support(page, turning):
    start = {"tilt": 50, "spin": 3, "precession": 0.7}
    load(page, GYROSCOPE, start=start, turning=turning, methods=["taylor"])
    tilt = np.radians(50)
    apex = np.array([0, -np.sin(tilt), np.cos(tilt)])
    expected = np.array([0, 0, 0.7]) + (3 - 0.7 * np.cos(tilt)) * apex
    assert page.evaluate("kreisel.simulation.getVelocity(0)") == pytest.approx(expected, abs=1e-12)
    page.evaluate("kreisel.page.setValue('spin', 5)")
    assert page.evaluate("kreisel.simulation.measureTop(0).spin") == pytest.approx(5, rel=1e-12)


def test_steady_precession_keeps_its_height_on_a_turntable(page):
    start = {"tilt": 50, "spin": 3, "precession": "slow"}
    load(page, GYROSCOPE, start=start, turning=[0, 0, 0.4], methods=["taylor"], tol=1e-15)
    limits = page.evaluate("kreisel.page.tops[0].limits")
    heights = [0.0]
    for t in (1, 3, 7):
        advance(page, t)
        heights.append(page.evaluate("kreisel.simulation.measureTop(0).nutation") - np.radians(50))
    assert heights == pytest.approx([0] * 4, abs=1e-10)
    velocity, spin = page.evaluate("kreisel.simulation.getVelocity(0)"), 3
    rate = (velocity[2] - spin * np.cos(np.radians(50))) / np.sin(np.radians(50)) ** 2
    assert limits["precession"] == pytest.approx(rate, rel=1e-9)


def test_steady_precession_is_refused_on_a_tilted_turntable(page):
    before = read_scene(page)
    load_with = "start => kreisel.page.load({...kreisel.page.scene, start, turning: [1, 0, 0]})"
    page.evaluate(load_with, {"tilt": 50, "spin": 30, "precession": "slow"})
    assert "no steady precession" in read_message(page) and read_scene(page) == before


def test_damping_aligns_the_axis_with_that_of_the_turntable(page):
    load(page, TURNTABLE)
    click_exercise(page, "Let the bearings rub")
    tilts = []
    for t in (0, 10, 20, 40):
        advance(page, t)
        tilts.append(page.evaluate("kreisel.simulation.measureTop(0).nutation"))
    assert (np.diff(tilts) < 0).all() and tilts[-1] < 0.01


def measure_heading_from_north(page):
    """Return the angle about the vertical from the room's mark N to the apex."""
    north = page.evaluate("(kreisel.view.render(), kreisel.view.floor.findNorth())")
    apex = kr.quaternion.turn(read_states(page)[0][1:5], (0, 0, 1))
    return np.angle(complex(*apex[:2]) / complex(north["x"], north["y"]))


@pytest.mark.parametrize("exercise", [None, "Turn the table the other way"])
def test_a_gyroscope_on_a_turntable_keeps_pointing_north(page, exercise):
    load(page, TURNTABLE)
    if exercise:
        click_exercise(page, exercise)
    page.evaluate("kreisel.page.setValue('methods.1', 'extrap')")
    for t in (0, 2, 9, 3):  # back in time, too
        page.evaluate(f"kreisel.page.jumpTo({t})")
        wait_until_time(page, t)
        assert measure_heading_from_north(page) == pytest.approx(0, abs=1e-9)
    for act in ("startFromNow", "undo", "redo", "rewind", "reset"):
        page.evaluate(f"kreisel.page.{act}()")
        assert measure_heading_from_north(page) == pytest.approx(0, abs=1e-9), act
        advance(page, 4)
        assert measure_heading_from_north(page) == pytest.approx(0, abs=1e-9), act


def test_only_a_turntable_shows_a_table_and_the_north_of_the_room(page):
    shown, start = "kreisel.view.floor.table.visible", {"tilt": 50, "spin": 3}
    north = page.locator(".labels span", has_text=re.compile("^N$"))
    for turning, is_table in (([0, 0, -1], True), ([0.1, 0, 1], False), ([0, 0, 0], False)):
        load(page, GYROSCOPE, start=start, turning=turning, methods=["taylor"])
        advance(page, 2)
        assert (page.evaluate(shown), north.count()) == (is_table, int(is_table))
        assert page.evaluate("kreisel.view.floor.room.rotation.z") == (2 if is_table else 0)
    page.get_by_role("slider", name="Turntable").press("ArrowRight")
    assert page.evaluate(shown)
    page.get_by_role("checkbox", name="Floor").uncheck()
    assert not page.evaluate(shown)


@pytest.mark.parametrize("size", [WIDE, PHONE])
def test_the_turntable_and_the_north_are_in_the_picture(page, size):
    page.set_viewport_size(make_viewport(size))
    load(page, TURNTABLE)
    width, height = page.evaluate("[kreisel.view.pixels[0], kreisel.view.pixels[1]]")
    for t in (0, 3, 6, 9):
        advance(page, t)
        x, y = page.evaluate("kreisel.view.project(kreisel.view.floor.findNorth())")
        assert 0 < x < width and 0 < y < height
    page.set_viewport_size(make_viewport(WIDE))


# From Python


def test_view_shows_friction_rotor_and_turntable():
    body = kr.Body.symmetric(1, 1, 0.4, 0.5).with_rotor(spin=2, inertia=1, axis=(0, 0, 1))
    scene = kr.Scene(
        body, momentum=(0, 1, 4), damping=0.1, friction=0.2, turning=(0, 1, 2), gravity=1
    )
    data = kr.view(scene, open=False).scene
    assert data["damping"] == 0.1 and data["rotor"] == (0.0, 0.0, 2.0)
    assert data["friction"] == 0.2 and data["turning"] == (0.0, 1.0, 2.0)
    assert data["methods"] == ["taylor"] and json.dumps(data)


@pytest.mark.parametrize(
    "parameters, words",
    [
        ({"damping": (0.1, 0.1, 0)}, "one damping for all axes"),
        ({"shaking": (0.1, 20, 0)}, "shaken supports"),
    ],
)
def test_view_refuses_scenes_that_the_viewer_cannot_compute(parameters, words):
    scene = kr.Scene(kr.Body.symmetric(1, 1, 0.4, 0.5), momentum=(0, 1, 4), gravity=1, **parameters)
    with pytest.raises(ValueError, match=words):
        kr.view(scene, open=False)
