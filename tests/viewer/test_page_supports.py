"""Tests of friction, falls, rotors, turntables and the balancing game in the viewer."""

import re

import kreisel as kr
import numpy as np
import pytest
from browser import PHONE, PRESETS, WIDE, turn_description, wait_for

GAME, GYROSCOPE, TURNTABLE = "How long can it stand?", "Gyroscope", "On a turntable"


def solve_fall(page):
    """Return the time at which the tilt of the top equals that of a rim on the floor."""
    lowest = np.cos(page.evaluate("kreisel.page.contact"))
    floor = kr.events.crossing("apex_z", lowest, terminal=True)
    return kr.solve(page.build_scene(), [100.0], "taylor", events=floor).t[-1]


def read_end(page, top=0):
    return page.evaluate(f"kreisel.simulation.getEnd({top})")


# The end on the floor


@pytest.mark.parametrize("exercise", [None, "Start it upright", "Half the friction"])
def test_the_time_until_the_rim_meets_the_floor_agrees_with_python(page, exercise):
    page.open_exercise(GAME, exercise)
    page.evaluate("kreisel.page.setRunning(true)")
    page.advance(90)
    expected = solve_fall(page)
    assert read_end(page) == pytest.approx(expected, abs=1e-4)
    assert f"t = {expected:.2f} s" in page.read_message()
    assert page.read_numbers()["stood"][0] == f"{expected:.2f}"
    assert page.find_button("Start").is_visible() and "▶ starts again" in page.read_message()
    (end,) = page.run_program()["ends"]  # ends at the floor, too
    lowest = kr.quaternion.turn(end.attitude, (0, 0, 1))[2]
    assert lowest == pytest.approx(np.cos(page.evaluate("kreisel.page.contact")), abs=1e-9)


def test_the_rim_is_on_the_floor_at_the_end(page):
    page.load(GAME)
    page.advance(90)
    lowest, floor = page.evaluate("""(() => {
        const {view} = kreisel;
        view.world.updateMatrixWorld(true);
        let lowest = Infinity;
        for (const part of view.tops[0].solid.handles.slice(0, 1)) {
            const {position} = part.geometry.attributes, at = view.camera.position.clone();
            for (let k = 0; k < position.count; k++)
                lowest = Math.min(lowest, part.localToWorld(at.fromBufferAttribute(position, k)).z);
        }
        return [lowest, view.floor.height];
    })()""")
    assert floor - 0.01 < lowest < floor + 0.08


def test_large_steps_and_pairs_have_their_own_words(page):
    body = {"half": [0.8, 0.8, 0.42], "pivot": [0, 0, -1.25], "density": 0.465}
    slow = {"body": body, "gravity": 4, "damping": 0.012, "friction": 0.1, "step": [0.5]}
    starts = {"start": {"tilt": 15, "spin": 22}, "second": {"tilt": 30, "spin": 20}}
    page.load(GAME, **slow, **starts, methods=["taylor", "taylor"])
    low = np.floor(solve_fall(page) / 0.5) * 0.5
    page.advance(90)
    message = page.read_message()
    assert "Right" in message and read_end(page, 1) < read_end(page, 0)
    assert f"between t = {low:g} and {low + 0.5:g} s" in message[message.index("Left") :]


def test_the_floor_is_the_same_for_a_body_described_in_any_axes(page):
    page.load(GAME)
    contact = page.evaluate("kreisel.page.contact")
    for turn in ((0.5, 0.5, 0.5, 0.5), (0.8, 0.36, 0.48, 0.0)):
        page.load_scene(turn_description(page.read_scene(), turn))
        assert page.evaluate("kreisel.page.contact") == pytest.approx(contact)


def test_other_tops_do_not_meet_the_floor(page):
    for changes in (
        {"damping": 0, "friction": 0},
        {"start": {"tilt": 120, "spin": 50}},
        {"body": {"half": [0.8, 0.8, 0.42], "pivot": [0, 0, 0], "density": 1}},
    ):
        page.load(GAME, **changes)
        page.advance(60)
        assert np.isnan(read_end(page)) and page.read_states()[0][0] == 60


def test_the_motion_can_be_changed_and_restarted_after_its_end(page):
    page.load(GAME)
    page.advance(90)
    end, states, message = read_end(page), page.read_states(), page.read_message()
    page.set_value("tilt", 5)
    assert np.isnan(read_end(page)) and page.read_states()[0][0] == 0 and page.read_message() == ""
    page.find_button("Undo").click()
    wait_for(page, "kreisel.page.goal === null")
    assert page.read_states() == states
    page.advance(90)
    assert read_end(page) == end and page.read_message().split(". ")[0] in message
    start = page.find_button("Start")
    assert start.evaluate("(e) => (e.click(), kreisel.page.isRunning && kreisel.page.clock === 0)")
    page.evaluate("kreisel.page.setRunning(false)")
    assert np.isnan(read_end(page))


def test_an_upright_top_sleeps_above_the_critical_spin_and_less_friction_lets_it_stand(page):
    page.open_exercise(GAME, "Start it upright")
    scene = page.build_scene().replace(damping=0, friction=0)
    critical = kr.exact(scene).critical_spin
    for t in range(1, 20):
        page.advance(t)
        if page.measure_top(0, "spin") < critical:
            break
        assert page.measure_top(0, "nutation") < np.radians(6)
    assert page.measure_top(0, "spin") < critical and np.isnan(read_end(page))
    ends = []
    for exercise in (None, "Half the friction"):
        page.open_exercise(GAME, exercise)
        page.advance(90)
        ends.append(read_end(page))
    assert ends[1] > 1.5 * ends[0]


# The game


def test_only_the_longest_time_of_a_fair_start_counts(window):
    page = window.open()
    page.load(GAME)
    page.advance(90)
    first = read_end(page)
    assert "longest" in page.read_message()
    page.load(GAME, start={"tilt": 40, "spin": 200})
    page.advance(90)
    assert read_end(page) < first and f"{first:.2f} s" in page.read_message()
    page.load(GAME, start={"tilt": 15, "spin": 230})
    page.advance(90)
    energy = kr.solve(page.build_scene(), [0.0]).kinetic[0]
    assert f"{energy:.4g} J" in page.read_message() and read_end(page) > first
    page.load(GAME, damping=7e-7)
    page.advance(90)
    assert "count" not in page.read_message() and "longest" not in page.read_message()
    page.reload()
    page.load(GAME)
    assert page.read_numbers()["stands"][1] == f"longest {first:.2f} s"


# Rotors


def test_a_new_rotor_keeps_the_rates_of_the_body(page):
    page.load(GYROSCOPE)
    rates = "kreisel.simulation.getVelocity(0)"
    before = page.evaluate(rates)
    page.fill_field("Rotor, number", 5)
    assert page.read_scene()["rotor"] == [0, 0, 5]
    assert page.evaluate(rates) == pytest.approx(before, abs=1e-12)


def test_the_wheel_turns_in_the_frame_at_its_rate_and_its_momentum_is_an_arrow(page):
    body = kr.Body.symmetric(0.2, i1=6e-4, i3=1e-4, height=0.05)
    made = body.with_wheel(inertia=5e-5, axis=(0, 0, 1), rate=300.0)
    top = kr.Scene.spinning(made, spin=2.0, tilt=1.0, gravity=9.81)
    page.load_scene({**kr.view(top, open=False).scene, "show": {"solid": "gyroscope"}})
    page.advance(0.01)
    assert page.evaluate("kreisel.view.findRates(0)") == pytest.approx([2, 300])
    assert page.evaluate("kreisel.view.tops[0].wheelAngle") == pytest.approx(3)
    assert page.read_numbers()["wheel"][0] == "300"
    arrow = page.evaluate("""(({h}) => [h.visible, h.tip.position.z / kreisel.view.momentumZoom,
        h.position.z / kreisel.view.zoom])(kreisel.view.tops[0])""")
    assert arrow == pytest.approx([True, 5e-5 * 302, 0.05], rel=1e-6)


BODY = kr.Body.cuboid((0.3, 0.2, 0.5), (0, 0.1, -0.4), density=10)
WHEEL = BODY.with_wheel(inertia=0.02, axis=(0.6, 0, 0.8), rate=30)
MOVED = [
    kr.Scene(WHEEL, velocity=(1, 2, 3), gravity=9.81),
    kr.Scene(BODY, velocity=(1, 2, 3), gravity=9.81, shaking=(0.1, 20, 1)),
    kr.Scene(BODY, velocity=(1, 2, 3), gravity=1, gradient=5, turning=(0, 1, 0)),
]


@pytest.mark.parametrize("top", MOVED, ids=["wheel", "shaking", "gradient"])
def test_wheels_shaken_supports_and_orbits_move_as_in_python(page, top):
    page.load_scene({**kr.view(top, open=False).scene, "tol": 1e-15})
    page.advance(2)
    path = kr.solve(top, [2.0], "taylor")
    assert page.read_states()[0][1:] == pytest.approx([*path.q[0], *path.m[0]], abs=1e-8)
    height = page.evaluate("kreisel.view.tops[0].group.position.z / kreisel.view.zoom")
    assert height == pytest.approx(top.shaking[0] * np.cos(41), abs=1e-9)
    program = page.run_program(only_start=True)["scene"]
    assert kr.solve(program, [2.0], "taylor").m == pytest.approx(path.m, abs=1e-8)


def test_a_top_without_spin_stands_on_a_foot_that_is_shaken_fast_enough(page):
    for exercise in (None, "Shake it more slowly", "Shake it half as far"):
        page.open_exercise("Shaken upright", exercise)
        page.advance(2)
        assert (page.read_record(0, "nutation").max() < np.pi / 2) == (exercise is None)


# Turntables


@pytest.mark.parametrize("turning", [[0, 0, 0.6], [0.3, -0.2, 0.5]])
def test_starts_are_relative_to_the_support(page, turning):
    start = {"tilt": 50, "spin": 3, "precession": 0.7}
    page.load(GYROSCOPE, start=start, turning=turning, methods=["taylor"])
    tilt = np.radians(50)
    apex = np.array([0, -np.sin(tilt), np.cos(tilt)])
    expected = np.array([0, 0, 0.7]) + (3 - 0.7 * np.cos(tilt)) * apex
    assert page.evaluate("kreisel.simulation.getVelocity(0)") == pytest.approx(expected, abs=1e-12)
    page.set_value("spin", 5)
    assert page.measure_top(0, "spin") == pytest.approx(5, rel=1e-12)


def test_steady_precession_keeps_its_height_on_a_turntable(page):
    start = {"tilt": 50, "spin": 3, "precession": "slow"}
    page.load(GYROSCOPE, start=start, turning=[0, 0, 0.4], methods=["taylor"], tol=1e-15)
    limits = page.evaluate("kreisel.page.tops[0].limits")
    for t in (0, 1, 3, 7):
        page.advance(t)
        assert page.measure_top(0, "nutation") == pytest.approx(np.radians(50), abs=1e-10)
    velocity = page.evaluate("kreisel.simulation.getVelocity(0)")
    rate = (velocity[2] - 3 * np.cos(np.radians(50))) / np.sin(np.radians(50)) ** 2
    assert limits["precession"] == pytest.approx(rate, rel=1e-9)


def measure_heading_from_north(page):
    """Return the angle about the vertical from the room's mark N to the apex."""
    north, (state, *_) = page.evaluate(
        "(kreisel.view.render(), [kreisel.view.floor.findNorth(), kreisel.readStates()])"
    )
    apex = kr.quaternion.turn(state[1:5], (0, 0, 1))
    return np.angle(complex(*apex[:2]) / complex(north["x"], north["y"]))


@pytest.mark.parametrize("exercise", [None, "Turn the table the other way"])
def test_a_gyroscope_on_a_turntable_keeps_pointing_north(page, exercise):
    page.load(TURNTABLE)
    if exercise:
        page.click_exercise(exercise)
    page.set_value("methods.1", "extrap")
    for t in (0, 2, 9, 3):  # back in time, too
        page.evaluate(f"kreisel.page.jumpTo({t})")
        page.wait_until_time(t)
        assert measure_heading_from_north(page) == pytest.approx(0, abs=1e-9)
    for act in ("startFromNow", "undo", "redo", "rewind", "reset"):
        page.evaluate(f"kreisel.page.{act}()")
        assert measure_heading_from_north(page) == pytest.approx(0, abs=1e-9), act
        page.advance(4)
        assert measure_heading_from_north(page) == pytest.approx(0, abs=1e-9), act


def test_only_a_turntable_shows_a_table_and_only_turning_supports_a_north(page):
    shown, start = "kreisel.view.floor.table.visible", {"tilt": 50, "spin": 3}
    north = page.locator(".labels span", has_text=re.compile("^N$"))
    cases = (([0, 0, -1], True, 1), ([0.1, 0, 1], False, 1), ([0, 0, 0], False, 0))
    for turning, is_table, marks in cases:
        page.load(GYROSCOPE, start=start, turning=turning, methods=["taylor"])
        page.advance(2)
        assert (page.evaluate(shown), north.count()) == (is_table, marks)
        assert not is_table or page.evaluate("kreisel.view.floor.room.rotation.z") == 2
    page.get_by_role("slider", name="Turntable").press("ArrowRight")
    assert page.evaluate(shown)
    page.get_by_role("checkbox", name="Floor").uncheck()
    assert not page.evaluate(shown)


def test_seen_from_the_room_the_north_rests_and_the_table_turns(page):
    page.open_exercise(TURNTABLE, "See it from the room")
    north = "kreisel.view.project(kreisel.view.floor.findNorth())"
    mark = """(({floor, camera}) => kreisel.view.project(
        floor.table.localToWorld(camera.position.clone().set(0, -0.9, 0))))(kreisel.view)"""
    places = []
    for t in (0, 3, 7, 1):
        page.evaluate(f"kreisel.page.jumpTo({t}), kreisel.view.render()")
        page.wait_until_time(t)
        places.append([page.evaluate(north), page.evaluate(mark)])
    rest, moves = np.ptp(places, axis=0)
    assert rest == pytest.approx([0, 0], abs=1e-6) and moves[0] > 100


@pytest.mark.parametrize("exercise", [None, "Start it to the south"])
def test_a_gyrocompass_comes_to_rest_pointing_north(page, exercise):
    page.open_exercise("Gyrocompass", exercise)
    page.advance(60)
    x, y, _ = kr.quaternion.turn(page.read_states()[0][1:5], (-1, 0, 0))  # of the rotor
    north = page.evaluate("(kreisel.view.render(), kreisel.view.floor.findNorth())")
    assert abs(np.angle(complex(x, y) / complex(north["x"], north["y"]), deg=True)) < 0.5


@pytest.mark.parametrize("size", [WIDE, PHONE])
def test_the_foot_the_pen_and_north_are_in_the_picture_and_no_round_body_hides_its_foot(page, size):
    page.resize(size)
    for preset in set(PRESETS) - {"Elastic rod"}:
        page.load(preset)
        for t in (0, 3, 6, 9) if preset == TURNTABLE else (0,):
            page.advance(t)
            *places, cover = page.evaluate("""(({view}) => {
                view.render();
                const foot = view.tops[0].group.position, at = view.project(foot);
                const hit = view.isRevolution && view.pick(...at);
                const north = view.floor.north.visible ? view.floor.findNorth() : foot;
                return [at, kreisel.locate('pen'), view.project(north), view.pixels,
                    hit ? hit.point.distanceTo(foot) : 0];
            })(kreisel)""")
            (width, height), bar = places.pop(), page.locator("#bar").bounding_box()["y"]
            assert all(0 < x < width and 0 < y < min(height, bar) for x, y in places), preset
            assert cover < 0.6, preset
