"""Regression tests of the viewer."""

import json
from urllib.parse import quote

import kreisel as kr
import numpy as np
import pytest
from browser import (
    PHONE,
    PRESETS,
    WIDE,
    advance,
    drag,
    list_changes,
    load,
    measure_top,
    open_viewer,
    read_clock,
    read_message,
    read_scene,
    read_states,
    scene_in_python,
    visit,
    wait_for,
    wait_until_time,
)
from kreisel.quaternion import attitude_error

START = ("attitude", "momentum", "second", "body", "gravity")


def read_start(page):
    scene = read_scene(page)
    return {key: scene[key] for key in START}


def wait_two_frames(page):
    """Wait until the viewer has drawn two frames."""
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def fill_field(page, name, value):
    field = page.get_by_label(name, exact=True)
    field.fill(str(value))
    field.press("Tab")


# Misleading displays


def test_tick_labels_are_evenly_spaced(page):
    load(page, chart="energy", methods=["bobenko_suris2"])
    advance(page, 0.98)
    page.evaluate("kreisel.charts.update()")
    ticks = page.evaluate("kreisel.charts.plots[0].axes[1]._values").copy()
    gaps = np.diff([float(tick) for tick in ticks])
    assert len(ticks) > 2 and gaps == pytest.approx(gaps[0], rel=1e-9)


def test_each_top_has_its_own_error_and_no_other_ones(page):
    load(page, "Compare four")
    advance(page, 200)
    exact = kr.exact(scene_in_python(read_scene(page)))([200.0])
    for i, state in enumerate(read_states(page)):
        own = attitude_error(state[1:5], exact.q[-1])
        assert measure_top(page, i, "error") == pytest.approx(own, rel=1e-3, abs=1e-11)
    assert measure_top(page, 2, "error") < 1e-6 < 1e-4 < measure_top(page, 0, "error")
    assert page.get_by_text("the exact motion, in closed form").count() == 1


@pytest.mark.parametrize(
    "place, value",
    [
        ("methods.0", "rk4"),
        ("methods.1", "strang"),
        ("step.0", 0.02),
        ("both", True),
        ("tol", 1e-9),
        ("ghost", True),
    ],
)
def test_changes_of_method_and_step_keep_start_and_time(page, place, value):
    advance(page, 20)
    before = read_start(page)
    page.evaluate("([place, value]) => kreisel.page.setValue(place, value)", [place, value])
    wait_until_time(page, 20)
    assert read_start(page) == before and read_scene(page)["taken"] is None
    top = page.evaluate("kreisel.page.tops[0]")
    path = kr.solve(
        scene_in_python(read_scene(page)),
        20,
        top["method"],
        step=top["step"],
        every=round(20 / top["step"]),
    )
    assert read_states(page)[0] == path.states[-1].tolist()


def test_changes_of_gravity_and_body_keep_the_start(page):
    advance(page, 20)
    before = read_scene(page)
    page.evaluate("kreisel.page.setValue('gravity', 2)")
    assert list_changes(before, read_scene(page)) == {"gravity"}
    advance(page, 3)
    fill_field(page, "Half edges, T", 1.5)
    assert read_scene(page)["attitude"] == before["attitude"]
    assert read_scene(page)["momentum"] == before["momentum"]
    page.get_by_role("button", name="Reset").click()
    assert read_scene(page) == before and read_clock(page) == 0


def test_a_start_taken_from_the_motion_is_reported(page):
    before, start_text = read_scene(page), page.locator("#start")
    assert start_text.inner_text() == "Start: as given"
    advance(page, 3)
    state = read_states(page)[0]
    page.get_by_role("button", name="Start from this moment").click()
    assert [*read_scene(page)["attitude"], *read_scene(page)["momentum"]] == state[1:]
    assert read_clock(page) == 0 and start_text.inner_text() == "Start: the motion at t = 3.00 s"
    page.get_by_role("button", name="Rewind").click()
    assert read_scene(page)["taken"] == 3
    page.get_by_role("button", name="Reset").click()
    assert read_scene(page) == before and start_text.inner_text() == "Start: as given"
    page.keyboard.press("z")
    assert read_scene(page)["taken"] == 3


def test_a_start_of_an_exercise_or_by_hand_is_reported(page):
    load(page, "A spinning top")
    start_text = page.locator("#start")
    for title in ("Without spin", "Double the spin"):
        page.get_by_role("button", name=title).click()
        page.evaluate("kreisel.page.setRunning(false); kreisel.page.rewind()")
        assert start_text.inner_text() == f"Start: changed by “{title}”"
        assert page.locator("#about h3").inner_text() == title
    page.evaluate("kreisel.page.setValue('gravity', 3)")
    assert start_text.inner_text() == "Start: changed by “Double the spin”"
    page.evaluate("kreisel.page.setValue('spin', 10)")
    assert start_text.inner_text() == "Start: changed by hand"
    page.get_by_role("button", name="Back to the start").click()
    page.evaluate("kreisel.page.setRunning(false)")
    assert start_text.inner_text() == "Start: as given" and page.locator("#about h3").count() == 0


def test_a_phone_shows_the_exercises(browser):
    page = visit(browser, size=PHONE, reduced_motion="reduce")
    for button in page.locator(".exercises button:visible").all():
        box = button.bounding_box()
        assert box["y"] + box["height"] <= PHONE[1] and box["x"] + box["width"] <= PHONE[0]
    assert page.get_by_role("button", name="Why does it not fall?").is_visible()
    page.context.close()


def test_a_top_between_its_steps_shows_its_time(page):
    load(page, "Compare four")
    advance(page, 11.7)
    wait_for(page, "document.getElementById('times').textContent.includes('11.6')")
    assert page.locator("#times").inner_text().count("is shown at t = 11.6") == 2
    advance(page, 11.8)
    wait_for(page, "!document.getElementById('times').textContent")


def test_descriptions_are_removed_when_the_scene_changes(page):
    description = page.locator("#about").inner_text()
    page.evaluate("kreisel.page.setValue('gravity', 3)")
    assert description not in page.locator("#about").inner_text()
    page.keyboard.press("z")
    assert page.locator("#about").inner_text() == description


# Jumps


def test_nothing_jumps_while_a_slider_is_held(page):
    page.evaluate("kreisel.page.rewind()")
    slider = page.get_by_role("slider", name="Gravity")
    wait_two_frames(page)
    place = slider.bounding_box()
    for t in (0, 3):
        advance(page, t)
        wait_two_frames(page)
        assert slider.bounding_box() == place
        page.evaluate("kreisel.page.setValue('gravity', 1.7)")
        wait_two_frames(page)
        assert slider.bounding_box() == place


def test_rows_of_the_table_keep_their_height(page):
    load(page, methods=["bobenko_suris2"])
    lines = "document.querySelector('#integrals td').offsetHeight"
    wait_two_frames(page)
    before = page.evaluate(lines)
    page.evaluate("kreisel.page.jumpTo(40)")
    wait_until_time(page, 40)
    wait_for(
        page,
        "[...document.querySelectorAll('#integrals td')]"
        ".some((cell) => /e-\\d\\d/.test(cell.textContent))",
    )
    assert page.evaluate(lines) == before


def test_a_second_top_is_brought_into_view(page):
    script = "kreisel.view.camera.position.distanceTo(kreisel.view.orbit.target)"
    before = page.evaluate(script)
    page.get_by_label("Beside it").select_option("strang")
    second_distance = page.evaluate(script)
    page.get_by_label("Third method").select_option("rk4")
    assert before < second_distance < page.evaluate(script)
    page.evaluate("kreisel.view.world.updateMatrixWorld(true)")
    for i in range(3):
        for corner in range(8):
            x, y = page.evaluate(f"kreisel.locate('corner', {i}, {corner})")
            assert 0 < x < WIDE[0] - 320 and 0 < y < WIDE[1]


def test_presets_have_their_own_viewing_direction(page):
    looks = "kreisel.view.camera.position.toArray()"
    page.evaluate("kreisel.choosePreset(kreisel.presets[0])")
    before = page.evaluate(looks)
    page.keyboard.press("n")
    page.keyboard.press("ArrowLeft")
    assert page.evaluate(looks) != before
    page.keyboard.press("1")
    assert page.evaluate(looks) == pytest.approx(before)


def test_the_stop_time_is_a_common_multiple_of_the_steps(page):
    load(page, "Compare four")
    page.evaluate("kreisel.page.setValue('stop', 10.13)")
    assert read_scene(page)["stop"] == 10.2
    page.evaluate("kreisel.page.setValue('step.1', 0.07)")
    assert read_scene(page)["stop"] == 10.22 and "10.22" in read_message(page)


# Freezes


def test_a_very_fast_top_does_not_block_the_viewer(window):
    scene = {"momentum": [1e12, 0, 0], "methods": ["extrap"], "step": [0.2]}
    page = open_viewer(window, fragment="#scene=" + quote(json.dumps(scene)))
    page.get_by_role("button", name="Start", exact=True).click()
    wait_for(page, "kreisel.page.isLate")
    page.get_by_role("button", name="Stop").click()
    page.get_by_role("button", name="Step", exact=True).click()
    page.get_by_role("button", name="Stop").click()
    assert (
        read_clock(page) == 0 and page.get_by_role("button", name="Start", exact=True).is_visible()
    )
    assert page.troubles == []


# Missing or translucent parts


def test_hidden_parts_cannot_be_picked(page):
    load(page, "Compare four", distance=0)
    advance(page, 11.7)
    page.evaluate("kreisel.view.tops.forEach((top, i) => i === 1 || (top.handles = []))")
    x, y = page.evaluate("kreisel.locate('face', 1)")
    assert page.evaluate("([x, y]) => kreisel.view.pick(x, y) ?? null", [x, y]) is None
    x, y = page.evaluate("kreisel.locate('corner', 1, 5)")
    assert page.evaluate("([x, y]) => kreisel.view.pick(x, y).i", [x, y]) == 1


def test_a_solid_body_hides_what_is_behind_it(page):
    hides = """(({transparent, depthWrite}) => !transparent && depthWrite)(
        kreisel.view.tops[0].solid.children[0].material)"""
    assert not page.evaluate(hides)
    page.get_by_role("slider", name="Opacity").press("End")
    assert page.evaluate(hides)
    page.get_by_role("slider", name="Opacity").press("Home")
    assert not page.evaluate(hides)


def test_zero_vectors_have_no_arrow(page):
    heads = "kreisel.view.tops[0].m.children.slice(0, 2).map((part) => part.visible)"
    assert page.evaluate(heads) == [True, True]
    load(page, momentum=[0, 0, 0], gravity=0)
    assert page.evaluate(heads) == [False, False]
    drag(page, "tip", (40, -30))
    assert np.linalg.norm(read_scene(page)["momentum"]) > 0 and page.evaluate(heads) == [True, True]


def test_rounding_errors_are_not_shown_as_body_values(page):
    load(page, body={"half": [0.8, 0.8, 1], "pivot": [1.2e-16, 0.3, -1], "density": 1})
    page.evaluate("kreisel.page.onChange()")
    assert "e-" not in page.locator("#body").inner_text()
    assert page.get_by_label("Fixed point, from the centre, N").input_value() == "0"


def test_printed_pages_show_the_whole_picture(page):
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 794, "height": 1100})
    try:
        wait_two_frames(page)
        picture, frame = (
            page.locator(selector).first.bounding_box() for selector in ("canvas", "main")
        )
        assert picture["x"] >= frame["x"] and picture["width"] <= frame["width"] <= 794
        assert picture["height"] <= frame["height"] and frame["height"] > 300
        panel = page.locator("#panel").bounding_box()
        assert panel["y"] >= frame["y"] + frame["height"]
    finally:
        page.emulate_media(media="screen")
        page.set_viewport_size({"width": WIDE[0], "height": WIDE[1]})


def test_the_label_of_an_arrow_is_beside_the_arrow(browser):
    page = visit(browser, size=PHONE, reduced_motion="reduce")
    load(page, "Steady precession")
    page.evaluate("kreisel.page.setRunning(true)")
    advance(page, 4)
    page.evaluate("kreisel.page.setRunning(false)")
    wait_two_frames(page)
    letter = page.locator(".labels .arrow", has_text="m").bounding_box()
    x, y = page.evaluate("kreisel.locate('tip')")
    assert abs(letter["y"] + letter["height"] / 2 - y) < 40
    assert min(abs(letter["x"] - x), abs(letter["x"] + letter["width"] - x)) < 40
    page.context.close()


def test_the_list_of_keys_needs_no_scrolling(page):
    page.locator("canvas").first.focus()
    page.keyboard.press("?")
    box = page.get_by_role("dialog").bounding_box()
    assert box["height"] > 300 and box["y"] + box["height"] <= WIDE[1]
    assert page.get_by_role("dialog").evaluate("(box) => box.scrollHeight <= box.clientHeight")
    assert "Principal axes" in page.get_by_role("dialog").inner_text()
    page.keyboard.press("Escape")
    assert not page.get_by_role("dialog").is_visible()


# Messages


def test_a_message_disappears_with_its_cause(page):
    fill_field(page, "Jump to t", "1e10")
    assert "Cannot jump to" in read_message(page)
    fill_field(page, "Jump to t", "12.3")
    wait_until_time(page, 12.3)
    assert read_message(page) == ""


def test_scenes_of_a_later_version_are_refused(window):
    page = open_viewer(window, fragment='#scene={"version": 99}')
    assert "version cannot be 99: this page reads 1" in read_message(page)
    assert read_scene(page)["name"] == PRESETS[0]


@pytest.mark.parametrize(
    "name, value, text",
    [
        ("Step, number", "0", "Step cannot be 0: from 0.000001 to 2000"),
        ("Tolerance of adaptive methods", "-1", "Tolerance cannot be -1: from 1e-15 to 1"),
        ("Gravity, number", "1e13", "Gravity cannot be 10000000000000: from -1000000000000 to"),
        ("Half edges, N", "-2", "Size cannot be -2: it must be more than 0"),
        ("Mass, number", "0", "Mass cannot be 0: it must be more than 0"),
        ("Tilt, degrees", "", "Tilt cannot be empty"),
    ],
)
def test_allowed_values_are_shown_beside_a_refused_field(page, name, value, text):
    before = read_scene(page)
    fill_field(page, name, value)
    field = page.get_by_label(name, exact=True)
    message = page.locator(".wrong:visible")
    assert message.count() == 1 and message.inner_text().startswith(text)
    assert read_message(page).startswith(text) and read_scene(page) == before
    box, field_box = message.bounding_box(), field.bounding_box()
    assert abs(box["y"] - field_box["y"] - field_box["height"]) < 6
    field.focus()
    assert page.locator(".wrong:visible").count() == 0


def test_unreadable_paths_have_a_specific_message(window):
    tracks = [{"name": "rk4", "step": 0.1, "states": "!"}]
    fragment = "#scene=" + quote(json.dumps({"tracks": tracks}))
    page = open_viewer(window, fragment=fragment)
    assert "not base64" in read_message(page) and "atob" not in read_message(page)
