"""Tests of messages and of undo in the viewer."""

import kreisel as kr
import numpy as np
import pytest
from browser import (
    PRESETS,
    TICKS,
    UPRIGHT,
    advance,
    drag,
    load,
    read_clock,
    read_message,
    read_scene,
    read_states,
    scene_in_python,
    wait_for,
    wait_until_time,
)

LISTED = 1 + PRESETS.index(UPRIGHT)
REFUSED = [
    *(("Step, number", value) for value in ("0", "-1", "", "1e300", "0.0000001")),
    *(("Second step, number", value) for value in ("0", "-1", "", "1e300")),
    *((f"{name}, number", "") for name in ("Speed", "Gravity", "Distance", "Thickness")),
    *(("Jump to t", value) for value in ("-1", "1e300")),
]


def read_everything(page):
    """Return the scene, the time, the states and the undo history of the viewer page."""
    return page.evaluate(
        "[kreisel.page.scene, kreisel.page.clock, kreisel.readStates(), kreisel.page.undoStack]"
    )


def find_button(page, name):
    return page.get_by_role("button", name=name, exact=True)


def read_choice(page, name):
    return page.get_by_label(name, exact=True).first.evaluate(
        "(list) => list.selectedOptions[0].text"
    )


# Refusals


@pytest.mark.parametrize("name, value", REFUSED)
def test_a_refused_number_changes_nothing(page, name, value):
    page.get_by_role("checkbox", name="Each with a second step").check()
    page.evaluate("kreisel.page.undoStack = []; kreisel.page.showMessage(''); kreisel.advance(3)")
    before, field = read_everything(page), page.get_by_label(name, exact=True)
    text = field.input_value()
    field.fill(value)
    field.press("Tab")
    assert read_everything(page) == before and read_message(page)
    assert name == "Jump to t" or field.input_value() == text


def test_an_empty_momentum_changes_nothing(page):
    page.evaluate("kreisel.page.showMessage(''); kreisel.advance(3)")
    before, field = read_everything(page), page.get_by_label("Momentum, first component")
    field.fill("")
    field.press("Tab")
    assert read_everything(page) == before and read_message(page)
    field.fill("1.5")
    field.press("Tab")
    assert read_scene(page)["momentum"][0] == 1.5 and read_message(page) == ""


# Undo


def test_undo_of_view_options_does_not_stop_the_motion(page):
    advance(page, 3)
    before = read_everything(page)
    for name in ("Floor", "2D view", "Elastic rod"):
        box = page.get_by_role("checkbox", name=name)
        is_checked = box.is_checked()
        box.set_checked(not is_checked)
        assert read_everything(page)[1:3] == before[1:3]
        find_button(page, "Undo").click()
        assert box.is_checked() == is_checked
    assert read_everything(page) == before and find_button(page, "Undo").is_disabled()


@pytest.mark.parametrize(
    "kind, offset", [("tip", (30, 20)), ("face", (40, 10)), ("corner", (15, -15))]
)
def test_undo_of_a_drag_restores_scene_and_time(page, kind, offset):
    advance(page, 3)
    before = read_everything(page)
    drag(page, kind, offset, number=5)
    assert read_clock(page) == 0 and read_scene(page) != before[0]
    page.keyboard.press("Control+z")
    wait_until_time(page, 3)
    assert read_everything(page) == before


def test_undo_of_a_drag_ignores_the_focused_field(page):
    before = read_scene(page)
    page.get_by_label("Momentum, first component").focus()
    drag(page, "tip", (30, 20))
    page.keyboard.press("Control+z")
    assert read_scene(page) == before


def test_escape_cancels_a_drag(page):
    advance(page, 3)
    before = read_everything(page)
    x, y = page.evaluate("kreisel.locate('tip')")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y + 20)
    assert read_scene(page) != before[0]
    page.keyboard.press("Escape")
    wait_until_time(page, 3)
    page.mouse.move(x + 60, y + 20)
    page.mouse.up()
    assert read_everything(page) == before


def test_undo_of_a_menu_choice_restores_the_scene(page):
    advance(page, 3)
    before = read_everything(page)
    page.get_by_role("radio", name="Kowalewski").check()
    assert read_scene(page)["name"] == "Kowalewski" and read_clock(page) == 0
    find_button(page, "Undo").click()
    wait_until_time(page, 3)
    assert (
        read_everything(page) == before
        and page.locator("#preset").inner_text() == f"{LISTED} {UPRIGHT}"
    )


def test_one_undo_reverts_one_move_of_a_slider(page):
    slider = page.get_by_role("slider", name="Gravity")
    for _ in range(3):
        slider.evaluate("(e) => (e.stepUp(), e.dispatchEvent(new Event('input', {bubbles: true})))")
    assert read_scene(page)["gravity"] == pytest.approx(1.3)
    find_button(page, "Undo").click()
    assert read_scene(page)["gravity"] == 1


# Keys


def test_keys_work_after_a_click_on_a_button(page):
    for name in ("Step", "View next side"):
        find_button(page, name).click()
        for key, option in {"t": "trace", "e": "rod"}.items():
            before = read_scene(page)["show"][option]
            page.keyboard.press(key)
            assert read_scene(page)["show"][option] != before
    page.keyboard.press("r")
    assert read_clock(page) == 0


def test_keys_are_ignored_during_a_drag(page):
    x, y = page.evaluate("kreisel.locate('tip')")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y + 20)
    state = read_everything(page)
    for key in ("r", "t", "3", "c", "h", "z", "Space", "ArrowRight", ".", "?", "Control+z"):
        page.keyboard.press(key)
    assert read_everything(page) == state and page.locator("#panel").is_visible()
    assert find_button(page, "Start").is_visible() and not page.get_by_role("dialog").is_visible()
    page.mouse.up()
    assert read_scene(page) == state[0]
    page.keyboard.press("z")
    assert read_scene(page)["momentum"] == [0.172, -1.862, 1.46]


def test_the_start_button_is_labelled_stop_while_running(page):
    page.locator("canvas").first.focus()
    for name, other in (("Start", "Stop"), ("Stop", "Start")):
        assert find_button(page, name).is_visible()
        page.keyboard.press("Space")
        assert find_button(page, other).is_visible() and not find_button(page, name).is_visible()
    find_button(page, "Start").click()
    wait_for(page, "kreisel.page.clock > 0")
    find_button(page, "Stop").click()
    assert find_button(page, "Start").is_visible()


# Scenes, methods


def test_a_changed_scene_is_labelled_as_changed(page):
    assert page.locator("#preset").inner_text() == f"{LISTED} {UPRIGHT}"
    for value in ("1.5", "2.5"):
        page.get_by_label("Momentum, first component").fill(value)
        page.keyboard.press("Tab")
        assert page.locator("#preset").inner_text() == f"{UPRIGHT}, changed"
    find_button(page, "Undo").click()
    find_button(page, "Undo").click()
    assert page.locator("#preset").inner_text() == f"{LISTED} {UPRIGHT}"


def test_an_unsuitable_method_is_replaced(page):
    page.get_by_label("Beside it").select_option("rk4")
    page.get_by_label("Shape").select_option("kowalewski")
    assert read_scene(page)["methods"] == ["strang", "rk4"]
    assert (
        read_choice(page, "Method") == "strang"
        and "bobenko_suris does not apply to this top: strang is used instead" in read_message(page)
    )


@pytest.mark.parametrize("method", ["rk4", "extrap", "bobenko_suris4"])
def test_a_method_is_described(page, method):
    text = kr.methods[method].text
    assert page.get_by_text(text).count() == 0
    page.get_by_label("Method").first.select_option(method)
    assert page.get_by_text(text).is_visible()


def test_errors_depend_on_the_tolerance(page):
    page.get_by_label("Method").first.select_option("extrap")
    field, errors = page.get_by_label("Tolerance of adaptive methods"), []
    exact = kr.solve(scene_in_python(read_scene(page)), [4.0], "exact").states[0]
    for tol in ("0.01", "1e-10"):
        field.fill(tol)
        field.press("Tab")
        page.evaluate("kreisel.page.setValue('step.0', 0.5); kreisel.advance(4)")
        errors.append(np.abs(np.subtract(read_states(page)[0], exact)).max())
        page.evaluate("kreisel.page.rewind()")
    assert read_scene(page)["tol"] == 1e-10 and errors[1] < 1e-8 < 1e-5 < errors[0]
    field.fill("0")
    field.press("Tab")
    # the method does not offer a tolerance of zero
    assert 0 < read_scene(page)["tol"] == float(field.input_value())


# Time


def test_the_stop_time_is_shown_and_respected(page):
    field = page.get_by_label("Stop at t")
    field.fill("0.5")
    field.press("Tab")
    for _ in range(2):
        find_button(page, "Start").click()
        advance(page, 3)
        assert read_clock(page) == 0.5 * TICKS and find_button(page, "Start").is_visible()
        assert "The stop time 0.5 is reached" in read_message(page)


def test_advance_respects_its_time_budget(page):
    load(page, methods=["extrap"], momentum=[1e4, 0, 1e4])
    page.evaluate(f"kreisel.page.advance({100 * TICKS}, 8)")
    assert page.evaluate("kreisel.page.isLate") and 0 < read_clock(page) < 100 * TICKS
    load(page)
    page.evaluate(f"kreisel.page.advance({TICKS}, 1e6)")
    assert not page.evaluate("kreisel.page.isLate") and read_clock(page) == TICKS


# Redo


@pytest.mark.parametrize("key", ["Control+Shift+z", "Control+y"])
def test_redo_restores_what_undo_reverted(page, key):
    for gravity in (4, 5, 6):
        page.evaluate("x => kreisel.page.setValue('gravity', x)", gravity)
    advance(page, 2)
    last = read_everything(page)[:3]
    page.locator("canvas").first.focus()
    gravities = []
    for press in ("Control+z", "Control+z", key, key):
        page.keyboard.press(press)
        gravities.append(read_scene(page)["gravity"])
    assert gravities == [5, 4, 5, 6] and find_button(page, "Redo").is_disabled()
    wait_until_time(page, 2)
    assert read_everything(page)[:3] == last
    page.keyboard.press("Control+z")
    page.evaluate("kreisel.page.setValue('gravity', 1)")
    assert find_button(page, "Redo").is_disabled()


def test_a_refused_value_does_not_change_redo(page):
    page.evaluate("kreisel.page.setValue('gravity', 4)")
    page.keyboard.press("Control+z")
    page.evaluate("kreisel.page.setValue('step.0', -1)")
    find_button(page, "Redo").click()
    assert read_scene(page)["gravity"] == 4
