"""Tests of controls, keys, undo and the clock: a control changes only the value that it shows."""

import kreisel as kr
import numpy as np
import pytest
from browser import PRESETS, TICKS, UPRIGHT, list_changes, scene_in_python, wait_for

FIELDS = [  # a value typed into a field, and the value of the scene
    ("Step, number", "0.037", "step", [0.037]),
    ("Gravity, number", "2.5", "gravity", 2.5),
    ("Momentum, first component", "2.5", "momentum", [2.5, -1.862, 1.46]),
    ("Momentum, vertical component", "2.5", "momentum", [0.172, -1.862, 2.5]),
    ("Stop at t", "7.004", "stop", 7),
]
EYE = "kreisel.view.camera.position.toArray()"


def read_everything(page):
    """Return the scene, the time, the states and the undo history of the viewer page."""
    return page.evaluate(
        "[kreisel.page.scene, kreisel.page.clock, kreisel.readStates(), kreisel.page.undoStack]"
    )


# Controls


@pytest.mark.parametrize(
    "role, name, keys, place, expected",
    [
        ("slider", "Step", "ArrowRight", "step", [0.011]),
        ("slider", "Gravity", "End", "gravity", 25),
        ("button", "Moon", "Space", "gravity", 1.62),
        ("slider", "Opacity", "End", "show.opacity", 1),
        ("slider", "Thickness", "End", "show.thickness", 4),
        ("slider", "Distance", "Home", "distance", 0),
        ("checkbox", "Each with a second step", "Space", "step", [0.01, 0.2]),
        ("checkbox", "Ghost", "Space", "ghost", True),
        ("checkbox", "Trace of the apex", "Space", "show.trace", False),
        ("checkbox", "Elastic rod", "Space", "show.rod", True),
        ("checkbox", "Principal axes", "Space", "show.axes", True),
        ("checkbox", "Drop lines", "Space", "show.drops", True),
        ("checkbox", "Floor", "Space", "show.floor", False),
        ("checkbox", "2D view", "Space", "show.flat", True),
    ],
)
def test_a_control_changes_only_its_value_and_undo_restores_it(
    page, role, name, keys, place, expected
):
    page.load(speed=50)  # does not widen the slider of the next scene
    page.load()
    before = page.read_scene()
    page.get_by_role(role, name=name).first.press(keys)
    scene = page.read_scene()
    key, _, part = place.partition(".")
    assert list_changes(before, scene) == {key}
    assert (scene[key][part] if part else scene[key]) == expected
    page.find_button("Undo").click()
    assert page.read_scene() == before


def test_a_number_field_changes_only_its_value(page):
    for name, value, key, expected in FIELDS:
        page.load()
        before = page.read_scene()
        page.fill_field(name, value)
        assert list_changes(before, page.read_scene()) == {key}, name
        assert page.read_scene()[key] == expected


@pytest.mark.parametrize("name, key", [("Friction", "friction"), ("Damping", "damping")])
def test_friction_and_damping_replace_a_method_for_undamped_tops(page, name, key):
    page.fill_field(f"{name}, number", 0.25)
    scene = page.read_scene()
    assert scene[key] == 0.25 and scene["methods"] == ["taylor"] and scene["tol"] == 1e-15
    assert "taylor" in page.read_message()
    page.advance(2)
    expected = kr.solve(scene_in_python(scene), [2.0]).states[0]
    assert page.read_states()[0] == pytest.approx(expected.tolist(), abs=1e-10)


def test_menus_change_methods_shapes_and_scenes(page):
    page.get_by_label("Beside it").select_option("rk4")
    method = page.get_by_label("Method").first
    method.select_option("strang")
    assert page.get_by_text(kr.methods["strang"].text).is_visible()
    assert [top["method"] for top in page.read_tops()] == ["strang", "rk4"]
    method.select_option("bobenko_suris")
    page.get_by_label("Shape").select_option("kowalewski")
    assert page.read_scene()["methods"] == ["strang", "rk4"]
    assert method.locator("option[value=bobenko_suris]").is_disabled()
    page.get_by_role("radio", name="Dzhanibekov effect").check()
    assert page.read_scene()["name"] == "Dzhanibekov effect" and page.read_clock() == 0
    assert page.evaluate("kreisel.page.kind") == "euler"


def test_methods_have_separate_or_common_steps(page):
    page.load(methods=["strang", "rk4"], step=[0.01])
    own = page.get_by_label("Second step for the other methods only")
    own.check()
    assert [top["step"] for top in page.read_tops()] == [0.01, 0.2]
    page.get_by_label("Each with a second step too").check()
    assert [top["step"] for top in page.read_tops()] == [0.01, 0.2] * 2 and not own.is_checked()


@pytest.mark.parametrize("preset", ["Fast precession", "Kowalewski", "Sleeping top"])
def test_compare_four_keeps_the_top_the_start_and_the_time(page, preset):
    page.load(preset)
    page.advance(3)
    before = page.read_scene()
    page.find_button("Compare four").click()
    page.wait_until_time(3)
    after = page.read_scene()
    for key in ("body", "shape", "attitude", "momentum", "gravity", "taken", "speed", "show"):
        assert after[key] == before[key], key
    first = "strang" if preset == "Kowalewski" else "bobenko_suris"
    assert after["methods"] == [first, "extrap"] and after["step"] == [0.01, 0.2]
    page.evaluate("kreisel.page.rewind()")
    assert len({tuple(state) for state in page.read_states()}) == 1


def test_top_or_box_changes_nothing_else(page):
    page.load(UPRIGHT, chart="spin")
    before, choice = page.read_scene(), page.get_by_label("Show as")
    page.advance(2)
    states = page.read_states()
    choice.select_option("top")
    assert list_changes(before, page.read_scene()) == {"show"} and page.read_states() == states
    page.get_by_label("Shape").select_option("kowalewski")
    assert choice.input_value() == "box" and choice.locator("option[value=top]").is_disabled()
    page.get_by_label("Shape").select_option("lagrange")
    assert choice.input_value() == "top"


def test_the_pace_is_that_of_the_film_and_the_values_of_sliders_are_announced(page):
    before = page.read_states()
    page.get_by_label("Pace").select_option("0.25")
    assert page.read_scene()["speed"] == 0.25 and page.read_states() == before
    step = page.get_by_role("slider", name="Step").first  # a logarithmic slider
    assert step.get_attribute("aria-valuetext") == "0.01"


def test_scenes_are_chosen_by_arrow_keys_and_scrolled_by_a_button(page):
    page.load(PRESETS[0])
    page.get_by_role("radio", name=PRESETS[0]).focus()
    for name in PRESETS[1:8]:
        page.keyboard.press("ArrowRight")
        assert page.read_scene()["name"] == name
    page.evaluate("kreisel.page.setRunning(false)")
    strip = page.locator("#presets").bounding_box()
    box = page.locator("#presets label:has(:checked)").bounding_box()
    assert strip["x"] <= box["x"] and box["x"] + box["width"] <= strip["x"] + strip["width"]
    place = "document.getElementById('presets').scrollLeft"
    page.evaluate(f"{place} = 0")
    places = [0]
    for _ in range(40):
        page.find_button("More scenes").click()
        places.append(page.evaluate(place))
        if places[-1] == 0:
            break
    assert places[-1] == 0 and len(places) > 4 and all(np.diff(places[:-1]) > 0)


def test_a_changed_scene_is_labelled_as_changed(page):
    label = page.locator("#preset")
    before = label.inner_text()
    assert before.endswith(UPRIGHT)
    page.set_value("momentum.0", 1.5)
    assert label.inner_text() == f"{UPRIGHT}, changed"
    page.keyboard.press("z")
    assert label.inner_text() == before


# The clock


def test_buttons_and_keys_control_the_clock(page):
    page.find_button("Step").click()
    page.locator("canvas").first.focus()
    page.keyboard.press(".")
    assert page.read_clock() == 0.02 * TICKS
    page.keyboard.press("r")
    assert page.read_clock() == 0
    for name, other in (("Start", "Stop"), ("Stop", "Start")):
        page.keyboard.press("Space")
        assert page.find_button(other).is_visible() and not page.find_button(name).is_visible()
    page.find_button("Start").click()
    wait_for(page, "kreisel.page.clock > 0")
    page.find_button("Stop").click()
    assert not page.evaluate("kreisel.page.isRunning")


# Keys


def test_keys_switch_options_scenes_and_panels(page):
    page.find_button("Step").click()  # keys work after a click
    for key, option in {"t": "trace", "e": "rod", "p": "axes", "v": "flat"}.items():
        before = page.read_scene()["show"][option]
        page.keyboard.press(key)
        assert page.read_scene()["show"][option] != before
    page.keyboard.press("3")
    assert page.read_scene()["name"] == PRESETS[2]
    page.keyboard.press("c")
    assert len(page.read_tops()) == 4
    assert page.read_scene()["log"] and page.evaluate("kreisel.charts.isLog('error')")
    page.keyboard.press("h")
    wait_for(page, "kreisel.view.canvas.clientWidth === innerWidth")
    assert not page.locator("#panel").is_visible()
    page.find_button("Panel").click()
    assert page.locator("#panel").is_visible()


def test_keys_are_ignored_while_their_list_is_open_and_if_switched_off(page):
    page.advance(2)
    keys = page.locator("#keys")
    page.locator("canvas").first.focus()
    page.keyboard.press("?")
    assert "Principal axes" in keys.inner_text()
    page.keyboard.press("r")
    assert page.read_clock() > 0
    page.keyboard.press("?")
    assert not keys.is_visible()
    page.keyboard.press("r")
    assert page.read_clock() == 0
    page.keyboard.press("?")
    letters = page.get_by_label("Single letters are keys")
    letters.uncheck()
    page.find_button("Close").click()
    page.keyboard.press("e")
    assert not page.read_scene()["show"]["rod"]
    page.find_button("Keys").click()
    letters.check()
    page.keyboard.press("Escape")
    page.keyboard.press("e")
    assert page.read_scene()["show"]["rod"]


def test_keys_move_the_camera_above_the_floor_and_home_resets_it(page):
    page.keyboard.press("Home")
    home, before = page.evaluate(EYE), page.read_scene()
    page.locator("canvas").first.focus()
    for key in ("ArrowLeft", "ArrowUp", "w", "a", "+", "ArrowRight", "s", "d", "-", "ArrowDown"):
        position = page.evaluate(EYE)
        page.keyboard.press(key)
        assert page.evaluate(EYE) != pytest.approx(position), key
    for _ in range(60):
        page.keyboard.press("ArrowDown")
    page.keyboard.press("-")
    assert page.evaluate("kreisel.view.camera.position.z") > -2.7
    page.find_button("Home view").click()
    assert page.evaluate(EYE) == pytest.approx(home) and page.read_scene() == before


# Undo


def test_undo_of_view_options_does_not_stop_the_motion(page):
    page.advance(3)
    before = read_everything(page)
    for name in ("Floor", "2D view", "Elastic rod"):
        page.get_by_role("checkbox", name=name).press("Space")
        assert read_everything(page)[1:3] == before[1:3]
        page.find_button("Undo").click()
    assert read_everything(page) == before and page.find_button("Undo").is_disabled()


@pytest.mark.parametrize(
    "change",
    [
        lambda page: page.drag("tip", (30, 20)),
        lambda page: page.drag("face", (40, 10)),
        lambda page: page.drag("corner", (15, -15), number=5),
        lambda page: page.get_by_role("radio", name="Kowalewski").check(),
        lambda page: page.fill_field("Gravity, number", 3),
        lambda page: page.get_by_role("slider", name="Gravity").press("End"),
    ],
    ids=["tip", "face", "corner", "scene", "field", "slider"],
)
def test_undo_restores_scene_and_time(page, change):
    page.advance(3)
    before = read_everything(page)
    change(page)
    assert page.read_clock() == 0 and page.read_scene() != before[0]
    page.find_button("Undo").click()
    page.wait_until_time(3)
    assert read_everything(page) == before


def test_one_undo_reverts_one_move_of_a_slider(page):
    slider = page.get_by_role("slider", name="Gravity")
    for _ in range(3):
        slider.evaluate("(e) => (e.stepUp(), e.dispatchEvent(new Event('input', {bubbles: true})))")
    assert page.read_scene()["gravity"] == pytest.approx(1.3)
    page.find_button("Undo").click()
    assert page.read_scene()["gravity"] == 1


def test_undo_of_a_drag_ignores_the_focused_field(page):
    before = page.read_scene()
    page.get_by_label("Momentum, first component").focus()
    page.drag("tip", (30, 20))
    page.keyboard.press("Control+z")
    assert page.read_scene() == before


@pytest.mark.parametrize("key", ["Control+Shift+z", "Control+y"])
def test_redo_restores_what_undo_reverted(page, key):
    for gravity in (4, 5, 6):
        page.set_value("gravity", gravity)
    page.advance(2)
    last = read_everything(page)[:3]
    page.locator("canvas").first.focus()
    gravities = []
    for press in ("Control+z", "Control+z", key, key):
        page.keyboard.press(press)
        gravities.append(page.read_scene()["gravity"])
    assert gravities == [5, 4, 5, 6] and page.find_button("Redo").is_disabled()
    page.wait_until_time(2)
    assert read_everything(page)[:3] == last
    page.keyboard.press("Control+z")
    page.set_value("step.0", -1)  # a refused value leaves redo
    page.set_value("methods.0", "none")
    page.keyboard.press(key)
    assert page.read_scene()["gravity"] == 6
    page.keyboard.press("Control+z")
    page.set_value("gravity", 1)
    assert page.find_button("Redo").is_disabled()


def test_escape_cancels_a_drag_and_keys_are_ignored_during_it(page):
    page.advance(3)
    before = read_everything(page)
    with page.hold("tip", (30, 20)):
        state = read_everything(page)
        assert state[0] != before[0]
        for key in ("r", "t", "3", "c", "h", "z", "Space", "ArrowRight", ".", "?", "Control+z"):
            page.keyboard.press(key)
        assert read_everything(page) == state and page.locator("#panel").is_visible()
        page.keyboard.press("Escape")
        page.wait_until_time(3)
        page.mouse.move(600, 300)
    assert read_everything(page) == before


def test_reset_returns_to_the_scene_as_loaded(page):
    before = page.read_scene()
    page.advance(3)
    page.set_value("gravity", 2)
    page.fill_field("Half edges, T", 1.5)
    changed = page.read_scene()
    assert changed["attitude"] == before["attitude"] and changed["momentum"] == before["momentum"]
    page.find_button("Reset").click()
    assert page.read_scene() == before and page.read_clock() == 0
