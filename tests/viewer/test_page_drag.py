"""Tests of dragging the handles in the viewer.

Each drag must change only the dragged object.
"""

import numpy as np
import pytest
from browser import (
    PHONE,
    TICKS,
    advance,
    drag,
    list_changes,
    load,
    read_clock,
    read_scene,
    read_states,
    visit,
)

BESIDE = (60, 120)  # an empty point of the picture


def test_dragging_the_tip_sets_the_momentum(page):
    before = read_scene(page)
    velocity = "kreisel.view.tops[0].w.quaternion.toArray()"
    old = page.evaluate(velocity)
    start, end = drag(page, "tip", (60, -80))
    assert end - start == pytest.approx((60, -80), abs=1)
    assert list_changes(before, read_scene(page)) == {"momentum"} and page.evaluate(velocity) != old
    m = np.array(read_scene(page)["momentum"])
    drag(page, "tip", (30, -10), key="Shift")
    momentum = np.array(read_scene(page)["momentum"])
    assert np.linalg.norm(np.cross(m, momentum)) < 1e-9 * m @ m
    assert np.linalg.norm(momentum) != pytest.approx(np.linalg.norm(m), rel=1e-3)


@pytest.mark.parametrize("kind", ["face", "edge"])
def test_dragging_a_face_or_an_edge_rotates_the_body(page, kind):
    before = read_scene(page)
    drag(page, kind, (50, 20), number=5 if kind == "face" else 0)
    assert list_changes(before, read_scene(page)) == {"attitude"}
    assert np.linalg.norm(read_scene(page)["attitude"]) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("shape", ["free", "lagrange", "kowalewski", "goryachev_chaplygin"])
def test_dragging_a_corner_resizes_the_body(page, shape):
    page.evaluate("name => kreisel.page.setValue('shape', name)", shape)
    before = read_scene(page)["body"]
    start, end = drag(page, "corner", (25, -30), number=5)
    after = read_scene(page)["body"]
    n, b, t = after["half"]
    assert after["half"] != before["half"] and after["pivot"] == pytest.approx((0, 0, -t))
    if shape == "free":
        assert end - start == pytest.approx((25, -30), abs=1)
    elif shape == "lagrange":
        assert n == b
    else:
        assert (n / b, t / b) == pytest.approx(({"k": 3, "g": 7}[shape[0]] ** 0.5, 0.5))
        assert page.evaluate("kreisel.page.kind") == shape


@pytest.mark.parametrize("way", ["middle", "Alt", "tool"])
def test_dragging_a_corner_moves_the_fixed_point(page, way):
    before = read_scene(page)
    if way == "tool":
        page.get_by_label("Corners move the fixed point").check()
    hold = {"middle": {"button": "middle"}, "Alt": {"key": "Alt"}, "tool": {}}[way]
    start, end = drag(page, "corner", (-30, 25), number=5, **hold)
    after = read_scene(page)
    if way == "tool":
        page.get_by_label("Corners move the fixed point").uncheck()
    assert end - start == pytest.approx((-30, 25), abs=1)
    assert (
        after["body"]["half"] == before["body"]["half"]
        and after["body"]["pivot"] != before["body"]["pivot"]
    )
    assert (
        after["momentum"] == before["momentum"] and page.evaluate("kreisel.page.kind") == "general"
    )
    assert after["methods"] == ["strang"] and not page.evaluate("kreisel.view.tops[0].axes.visible")


def test_principal_axes_are_shown_while_the_fixed_point_moves(page):
    x, y = page.evaluate("kreisel.locate('corner', 0, 5)")
    page.mouse.move(x, y)
    page.mouse.down(button="middle")
    page.mouse.move(x + 9, y + 9)
    assert page.evaluate("kreisel.view.tops[0].axes.visible")
    page.keyboard.press("Escape")
    assert read_scene(page)["body"]["pivot"] == [0, 0, -1] and not page.evaluate(
        "kreisel.view.tops[0].axes.visible"
    )
    page.mouse.up(button="middle")


def test_a_drag_starts_from_the_current_state_and_can_be_undone(page):
    before = read_scene(page)
    advance(page, 3)
    state = read_states(page)[0]
    drag(page, "tip", (20, 20))
    assert read_scene(page)["attitude"] == state[1:5] and read_clock(page) == 0
    page.keyboard.press("Control+z")
    assert read_scene(page) == before


def test_a_click_changes_nothing_and_a_double_click_shows_one_top_alone(page):
    load(page, "Compare four")
    advance(page, 3)
    before = read_scene(page)
    x, y = page.evaluate("kreisel.locate('corner', 2, 5)")
    visibility = "kreisel.charts.plots[0].series.slice(1).map((s) => s.show)"
    page.mouse.click(x, y)
    assert page.evaluate(visibility) == [True] * 4
    assert read_scene(page) == before and read_clock(page) == 3 * TICKS
    page.mouse.dblclick(x, y)
    assert page.evaluate(visibility) == [False, False, True, False]
    page.mouse.dblclick(*BESIDE)
    assert page.evaluate(visibility) == [True] * 4
    assert read_scene(page) == before and read_clock(page) == 3 * TICKS


def test_touch_drags_too(browser):
    page = visit(browser, size=PHONE, has_touch=True, is_mobile=True, reduced_motion="reduce")
    x, y = page.evaluate("kreisel.locate('tip')")
    assert y < 400
    page.evaluate(
        """([x, y]) => {
        const canvas = kreisel.view.canvas;
        canvas.setPointerCapture = () => {};
        const touch = {pointerId: 7, pointerType: 'touch', button: 0, buttons: 1};
        const event = {...touch, bubbles: true, cancelable: true};
        const send = (type, x, y) =>
            canvas.dispatchEvent(new PointerEvent(type, {...event, clientX: x, clientY: y}));
        send('pointerdown', x + 6, y - 5);
        send('pointermove', x + 46, y - 35);
        send('pointerup', x + 46, y - 35);
    }""",
        [x, y],
    )
    assert np.subtract(page.evaluate("kreisel.locate('tip')"), (x, y)) == pytest.approx(
        (40, -30), abs=1
    )
    page.context.close()


@pytest.mark.parametrize("kind, component", [("tip", slice(5, 8)), ("face", slice(1, 5))])
def test_two_motions_are_changed_independently(page, kind, component):
    load(page, "Sleeping top")
    advance(page, 4)
    before = read_states(page)
    x, y = page.evaluate(f"kreisel.locate('{kind}', 1)")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 15, y - 10)
    page.mouse.up()
    left, right = read_states(page)
    assert left[1:] == before[0][1:]
    assert (
        right[component] != before[1][component]
        and np.linalg.norm(np.subtract(right, before[1])[1:5]) < 0.3
    )
    rest = slice(1, 5) if kind == "tip" else slice(5, 8)
    assert right[rest] == before[1][rest]
