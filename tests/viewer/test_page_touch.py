"""Tests of the toolbar and of touch and keyboard input."""

import kreisel as kr
import numpy as np
import pytest
from browser import (
    PHONE,
    WIDE,
    advance,
    drag,
    list_changes,
    load,
    make_viewport,
    read_clock,
    read_scene,
    read_states,
    scene_in_python,
    turn_description,
    visit,
    wait_for,
)
from toolbox import open_context

TURN = (0.8, 0.36, 0.48, 0.0)  # an attitude
EYE = "kreisel.view.camera.position.toArray()"
SEND = """([type, points]) => {
    const {canvas} = kreisel.view;
    canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
    const touch = {pointerId: 7, pointerType: type, button: 0, buttons: 1, isPrimary: true};
    const event = {...touch, bubbles: true, cancelable: true};
    points.forEach(([x, y], i) => {
        const last = i === points.length - 1;
        const name = i === 0 ? 'down' : last ? 'up' : 'move';
        const at = {...event, clientX: x, clientY: y};
        canvas.dispatchEvent(new PointerEvent(`pointer${name}`, at));
    });
}"""


def swipe(page, kind, offset, pointer="touch", number=0):
    x, y = page.evaluate(f"kreisel.locate('{kind}', 0, {number})")
    way = [
        [x, y],
        [x + offset[0] / 2, y + offset[1] / 2],
        [x + offset[0], y + offset[1]],
        [x + offset[0], y + offset[1]],
    ]
    page.evaluate(SEND, [pointer, way])


# Fingers


def test_a_touch_on_the_body_orbits_the_camera(browser):
    page = visit(browser, size=PHONE, has_touch=True, is_mobile=True, reduced_motion="reduce")
    page.evaluate("kreisel.page.setRunning(true)")
    wait_for(page, "kreisel.page.clock > 0")
    before = read_scene(page)
    for preset in (before["name"], "Lagrange's top"):  # a rotated top, and a box with handles
        load(page, preset)
        before = read_scene(page)
        for kind in ("face", "corner", "edge"):
            position = page.evaluate(EYE)
            swipe(page, kind, (60, 20), number=5)
            assert page.evaluate(EYE) != pytest.approx(position, abs=0.1), kind
            assert read_scene(page) == before and page.evaluate("kreisel.page.isRunning")
    page.context.close()


def test_handles_are_highlighted_on_hover(page):
    page.mouse.move(*page.evaluate("kreisel.locate('tip')"))
    assert page.evaluate("kreisel.drags.highlight.visible")
    page.mouse.move(30, 300)
    assert not page.evaluate("kreisel.drags.highlight.visible")


@pytest.mark.parametrize("pointer", ["mouse", "touch"])
def test_a_push_changes_the_momentum_of_the_running_top(page, pointer):
    page.get_by_role("button", name="Push").click()
    try:
        page.evaluate("kreisel.page.setRunning(true)")
        wait_for(page, "kreisel.page.clock > 100000")
        swipe(page, "face", (60, 20), pointer)
        after = read_scene(page)
        assert page.evaluate("kreisel.page.isRunning") and after["taken"] > 0
        page.evaluate("kreisel.page.setRunning(false)")
        top = scene_in_python(read_scene(page))
        before = kr.solve(
            kr.Scene(top.body, (0.172, -1.862, 1.46), gravity=1),
            after["taken"],
            "bobenko_suris",
            step=0.01,
            every=round(100 * after["taken"]),
        ).end
        assert after["attitude"] == pytest.approx(before.attitude, abs=1e-12)
        assert np.linalg.norm(np.subtract(after["momentum"], before.momentum)) > 0.1
    finally:
        page.get_by_role("button", name="Push").click()


def test_the_motion_continues_after_a_drag(page):
    page.evaluate("kreisel.page.setRunning(true)")
    drag(page, "tip", (20, -20))
    assert page.evaluate("kreisel.page.isRunning")
    page.get_by_role("button", name="Stop").click()
    drag(page, "tip", (20, -20))
    assert not page.evaluate("kreisel.page.isRunning")


def test_long_arrows_are_brought_back_into_the_picture(page):
    load(page, momentum=[0, 0, 1])
    drag(page, "corner", (200, -200), number=7)
    page.evaluate("kreisel.page.setValue('gravity', 0)")
    x, y = page.evaluate("kreisel.locate('tip')")
    drag(page, "tip", (30, -y + 5))
    for part in ("m", "w"):
        x, y = page.evaluate(
            f"kreisel.view.project(kreisel.view.tops[0].{part}.tip.getWorldPosition("
            "kreisel.view.camera.position.clone()))"
        )
        assert 0 <= x <= WIDE[0] and 0 <= y <= WIDE[1]


# Bar and keys


def test_the_toolbar_is_in_the_window(browser):
    page = visit(browser, reduced_motion="reduce")
    page.locator("#fold").click()
    for size in (PHONE, (480, 320), (320, 568), WIDE):
        page.set_viewport_size(make_viewport(size))
        wait_for(page, "kreisel.view.canvas.clientWidth === innerWidth")
        bar = page.locator("#bar").bounding_box()
        assert bar["x"] >= 0 and bar["x"] + bar["width"] <= size[0]
        assert bar["y"] + bar["height"] <= size[1] and bar["height"] < 100
        assert page.get_by_role("button", name="Start", exact=True).is_visible()
        assert page.locator("#fold").get_attribute("aria-expanded") == "false"
    page.context.close()


MEETINGS = """(() => {
    const boxOf = (element) => element.getBoundingClientRect();
    const texts = ['words', 'times', 'fold'].map((id) => document.getElementById(id));
    const boxes = texts.filter((each) => each.textContent).map(boxOf);
    return [...document.querySelectorAll('.labels span:not([hidden])')].filter((label) => {
        const {left, right, top, bottom} = boxOf(label);
        return boxes.some((box) =>
            left < box.right - 1 && box.left < right - 1 &&
            top < box.bottom - 1 && box.top < bottom - 1);
    }).map((label) => label.textContent);
})()"""


def test_labels_do_not_cover_messages_on_a_phone(browser):
    page = visit(browser, size=PHONE, has_touch=True, is_mobile=True, reduced_motion="reduce")
    for name in ("Steady precession", "Pendulum", "Elastic rod", "Lagrange's top", "Compare four"):
        load(page, name)
        page.evaluate("kreisel.view.render()")
        count = page.locator(".labels span:not([hidden])").count()
        page.evaluate(
            "kreisel.page.showMessage('A message that is so long that it needs two lines')"
        )
        wait_for(page, f"{MEETINGS}.length === 0")
        assert 0 < page.locator(".labels span:not([hidden])").count() <= count
    page.context.close()


def test_the_pace_can_be_chosen(page):
    page.get_by_label("Pace").select_option("0.25")
    assert read_scene(page)["speed"] == 0.25
    slider = page.get_by_role("slider", name="Speed")
    slider.press("End")  # the field is as wide as the widest value so far
    assert page.get_by_label("Pace").input_value() == slider.get_attribute("max")


def test_keys_move_the_camera_and_home_resets_it(page):
    page.keyboard.press("Home")
    home, before = page.evaluate(EYE), read_scene(page)
    page.locator("canvas").first.focus()
    for key in ("ArrowLeft", "ArrowUp", "w", "a", "+", "ArrowRight", "s", "d", "-", "ArrowDown"):
        position = page.evaluate(EYE)
        page.keyboard.press(key)
        assert page.evaluate(EYE) != pytest.approx(position), key
    page.keyboard.press("ArrowLeft")
    page.get_by_role("button", name="Home view").click()
    assert (
        page.evaluate(EYE) == pytest.approx(home)
        and read_scene(page) == before
        and read_clock(page) == 0
    )


def test_the_camera_stays_above_the_floor(page):
    for _ in range(60):
        page.keyboard.press("ArrowDown")
    page.keyboard.press("-")
    assert page.evaluate("kreisel.view.camera.position.z") > -2.7
    page.keyboard.press("Home")


def test_single_letters_can_be_switched_off(page):
    page.keyboard.press("?")
    page.get_by_label("Single letters are keys").uncheck()
    page.get_by_role("button", name="Close").click()
    page.keyboard.press("e")
    assert not read_scene(page)["show"]["rod"]
    page.keyboard.press("Control+z")
    page.get_by_role("button", name="Keys").click()
    page.get_by_label("Single letters are keys").check()
    page.keyboard.press("Escape")
    page.keyboard.press("e")
    assert read_scene(page)["show"]["rod"]


def test_targets_are_24_pixels(page):
    small = page.evaluate("""[...document.querySelectorAll(
        'button, summary, select, input:not([type=checkbox]), .check')]
        .filter((each) => each.offsetParent && !each.closest('.uplot, dialog'))
        .map((each) => [each.textContent.trim(), each.getBoundingClientRect()])
        .filter(([, box]) => Math.min(box.width, box.height) < 24)""")
    assert small == []


def test_sliders_announce_their_value_not_its_logarithm(page):
    slider = page.get_by_role("slider", name="Step")
    assert slider.first.get_attribute("aria-valuetext") == "0.01"


def test_the_wheel_scrolls_a_notebook_until_a_click_in_the_viewer(browser):
    page = open_context(browser, offline=True, viewport={"width": 900, "height": 700}).new_page()
    html = kr.view(kr.scenes.dzhanibekov, open=False)._repr_html_()
    page.set_content(f"{html}<div style='height:3000px'></div>")
    frame = page.frames[1]
    wait_for(frame, "!!window.kreisel")
    distance_script = "kreisel.view.camera.position.length()"
    before = frame.evaluate(distance_script)
    page.mouse.move(60, 200)
    page.mouse.wheel(0, 120)
    wait_for(page, "scrollY > 0")
    assert frame.evaluate(distance_script) == pytest.approx(before)
    page.evaluate("scrollTo(0, 0)")
    wait_for(page, "scrollY === 0")
    page.mouse.click(60, 200)
    page.mouse.wheel(0, 120)
    wait_for(frame, f"{distance_script} > {before + 0.1}")
    assert page.evaluate("scrollY") == 0
    page.context.close()


# Numbers


def check_tilt_and_spin(page, t):
    """Set the tilt and the spin at the time `t`, and compare them with those in Python."""
    advance(page, t)
    for name, place, value in (("Tilt, degrees", "nutation", 30), ("Spin, number", "spin", 7.5)):
        field = page.get_by_label(name, exact=True)
        field.fill(str(value))
        field.press("Tab")
        path = kr.solve(scene_in_python(read_scene(page)), [0.0])
        number = getattr(path, place)[0]
        assert (np.degrees(number) if place == "nutation" else number) == pytest.approx(value)
    assert read_scene(page)["taken"] == (t or None)
    assert np.degrees(path.nutation[0]) == pytest.approx(30)


@pytest.mark.parametrize("shape", ["lagrange", "kowalewski"])
@pytest.mark.parametrize("t", [0, 3])
def test_tilt_and_spin_agree_with_python(page, shape, t):
    page.evaluate("name => kreisel.page.setValue('shape', name)", shape)
    check_tilt_and_spin(page, t)


@pytest.mark.parametrize("t", [0, 3])
def test_tilt_and_spin_refer_to_the_centre_of_mass_if_no_principal_axis_does(page, t):
    body = {"half": [0.8, 0.8, 1], "pivot": [0.5, 0.2, -1], "density": 1}
    load(page, shape="free", body=body, turning=[0.3, 0.1, -0.2], rotor=[0.4, 1, -0.6])
    check_tilt_and_spin(page, t)


@pytest.mark.parametrize("pivot", [[0, 0, -1], [0, 0, 0]])
def test_tilt_and_spin_agree_with_python_for_a_body_given_by_numbers(page, pivot):
    load(page, shape="free", body={"half": [0.8, 0.7, 1.1], "pivot": pivot, "density": 1})
    given = turn_description(read_scene(page), TURN)
    page.evaluate("given => kreisel.page.load(given)", given)
    check_tilt_and_spin(page, 3)


@pytest.mark.parametrize(
    "place, value", [("density", 2), ("mass", 3), ("body.half.2", 1.2), ("body.pivot.0", 0.1)]
)
def test_a_changed_body_given_by_numbers_keeps_the_positions_of_both_tops(page, place, value):
    load(page, "Sleeping top", shape="free", rotor=[0.5, 1, -2])
    expected = read_scene(page)
    given = turn_description(expected, TURN)
    page.evaluate("given => kreisel.page.load(given)", given)
    page.evaluate("([place, value]) => kreisel.page.setValue(place, value)", [place, value])
    found = read_scene(page)
    # the body is symmetric: its edges may be permuted, but the axis is the same
    for key in ("attitude", "second"):
        axis = kr.quaternion.turn(tuple(found[key][:4]), (0, 0, 1))
        assert axis == pytest.approx(kr.quaternion.turn(tuple(expected[key][:4]), (0, 0, 1)))
        rotor = kr.quaternion.turn(tuple(found[key][:4]), found["rotor"])
        old_rotor = kr.quaternion.turn(tuple(given[key][:4]), given["rotor"])
        assert rotor == pytest.approx(old_rotor)


@pytest.mark.parametrize(
    "name, value, key, expected",
    [
        ("Half edges, N", 0.5, "half", [0.5, 0.8, 1]),
        ("Half edges, T", 2, "half", [0.8, 0.8, 2]),
        ("Fixed point, from the centre, N", 0.25, "pivot", [0.25, 0, -1]),
        ("Fixed point, from the centre, T", -0.5, "pivot", [0, 0, -0.5]),
        ("Density, number", 2.5, "density", 2.5),
        ("Mass, number", 10.24, "density", 2),
    ],
)
def test_size_fixed_point_and_mass_have_fields(page, name, value, key, expected):
    load(page, shape="free")
    before = read_scene(page)
    field = page.get_by_label(name, exact=True)
    field.fill(str(value))
    field.press("Tab")
    assert list_changes(before, read_scene(page)) - {"methods"} == {
        "body"
    }  # one of the methods may not suit this body
    assert read_scene(page)["body"][key] == pytest.approx(expected)
    assert float(field.input_value()) == pytest.approx(value)


def test_a_path_that_no_longer_applies_is_reported(page):
    path = kr.solve(kr.scenes.thesis, 1, "rk4", step=0.1, every=1)
    page.evaluate("given => kreisel.page.load(given)", kr.view(path, open=False).scene)
    page.evaluate("kreisel.page.setValue('gravity', 2)")
    assert "The path belongs to another motion" in page.locator("#words").inner_text()
    page.get_by_role("button", name="Undo").click()
    assert len(read_scene(page)["tracks"]) == 1


# Charts


def test_three_methods_are_shown_side_by_side(page):
    load(page, methods=["bobenko_suris", "strang", "rk4"], step=[0.01, 0.1])
    advance(page, 5)
    scene = scene_in_python(read_scene(page))
    names = [(top["method"], top["step"]) for top in page.evaluate("kreisel.page.tops")]
    assert (
        len(names) == 6 and len({top["colour"] for top in page.evaluate("kreisel.page.tops")}) == 6
    )
    for state, (name, step) in zip(read_states(page), names, strict=True):
        expected = kr.solve(scene, 5, name, step=step, every=round(5 / step)).states[-1]
        assert state == expected.tolist()


def test_charts_show_the_values_under_the_cursor(page):
    load(page, "Compare four", chart="energy")
    advance(page, 30)
    page.evaluate("kreisel.charts.update()")
    legend = page.locator("#charts .read")
    assert legend.inner_text().startswith("t = 30")
    chart = page.locator("#charts .u-over")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 30)
    wait_for(page, "/^t = 1[45]/.test(document.querySelector('#charts .read').textContent)")
    assert len(page.locator("#charts .read span").all_inner_texts()) == 4
    advance(page, 3.01)
    page.evaluate("kreisel.charts.plots.forEach((plot) => kreisel.charts.showValues(plot))")
    assert legend.evaluate("(line) => line.scrollWidth <= line.clientWidth")


def test_charts_are_larger_on_demand(page):
    advance(page, 3)
    width = "kreisel.charts.plots[0].over.clientWidth"
    before = page.evaluate(width)
    page.evaluate("document.getElementById('panel').scrollTop = 1e4")
    page.keyboard.press("l")
    wait_for(page, f"{width} > {1.5 * before}")
    check_chart_is_seen(page)
    page.get_by_role("button", name="Larger").click()
    wait_for(page, f"{width} === {before}")


def check_chart_is_seen(page):
    """Check that the whole chart, with its time axis and its values, is inside the window."""
    for part in ("#charts select", "#charts .uplot", "#charts .read"):
        box, height = page.locator(part).bounding_box(), page.viewport_size["height"]
        assert box["y"] >= 0 and box["y"] + box["height"] <= height, part


def test_larger_charts_leave_three_tops_visible(page):
    load(page, methods=["bobenko_suris", "strang", "rk4"])
    page.keyboard.press("Home")
    width = "kreisel.view.canvas.clientWidth"
    condition = f"Math.abs({width} - document.querySelector('main').clientWidth) < 1"
    wait_for(page, condition)
    widths = [page.evaluate(width)]
    for key in ("l", "l"):
        page.keyboard.press(key)
        wait_for(page, condition)
        right = page.evaluate(width)
        widths.append(right)
        for i in range(3):
            for corner in range(8):
                assert 0 < page.evaluate(f"kreisel.locate('corner', {i}, {corner})[0]") < right
    assert widths[0] == widths[2] > 1.5 * widths[1]


def test_tops_side_by_side_are_labelled(page):
    load(page, methods=["strang", "rk4"])
    letters = page.locator(".labels span")
    assert letters.all_inner_texts()[-1] == "rk4"
    path = kr.solve(kr.scenes.thesis, 1, "rk4", step=0.1, every=1)
    page.evaluate("given => kreisel.page.load(given)", kr.view(path, open=False).scene)
    assert letters.all_inner_texts()[-1] == "the path: rk4"
    load(page, "Sleeping top")
    assert "exact" not in letters.all_inner_texts()


def test_projector_mode_has_large_text(page):
    size = "parseFloat(getComputedStyle(document.getElementById('about')).fontSize)"
    before = page.evaluate(size)
    page.keyboard.press("b")
    assert page.evaluate(size) > 1.4 * before
    check_chart_is_seen(page)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.keyboard.press("b")
    assert page.evaluate(size) == before


def test_compare_four_opens_logarithmic_charts(page):
    page.keyboard.press("c")
    assert read_scene(page)["log"] and page.evaluate("kreisel.charts.isLog('error')")
