"""The page in hand: every drag changes what it should, and nothing else."""

import numpy as np
import pytest
from browser import PHONE, TICKS, advance, clock, differing_keys, drag, load, scene, states, visit

BESIDE = (60, 120)  # in the picture, where there is nothing


def test_drag_of_the_tip_sets_the_momentum(page):
    before = scene(page)
    velocity = "kreisel.view.tops[0].w.quaternion.toArray()"
    old = page.evaluate(velocity)
    start, end = drag(page, "tip", (60, -80))
    assert end - start == pytest.approx((60, -80), abs=1)
    assert differing_keys(before, scene(page)) == {"momentum"} and page.evaluate(velocity) != old
    m = np.array(scene(page)["momentum"])
    drag(page, "tip", (30, -10), key="Shift")
    along = np.array(scene(page)["momentum"])
    assert np.linalg.norm(np.cross(m, along)) < 1e-9 * m @ m
    assert np.linalg.norm(along) != pytest.approx(np.linalg.norm(m), rel=1e-3)


@pytest.mark.parametrize("kind", ["face", "edge"])
def test_drag_of_face_or_edge_turns(page, kind):
    before = scene(page)
    drag(page, kind, (50, 20), number=5 if kind == "face" else 0)
    assert differing_keys(before, scene(page)) == {"attitude"}
    assert np.linalg.norm(scene(page)["attitude"]) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("shape", ["free", "lagrange", "kowalewski", "goryachev_chaplygin"])
def test_drag_of_a_corner_resizes(page, shape):
    page.evaluate("name => kreisel.page.set('shape', name)", shape)
    before = scene(page)["body"]
    start, end = drag(page, "corner", (25, -30), number=5)
    after = scene(page)["body"]
    n, b, t = after["half"]
    assert after["half"] != before["half"] and after["pivot"] == pytest.approx((0, 0, -t))
    if shape == "free":
        assert end - start == pytest.approx((25, -30), abs=1)
    elif shape == "lagrange":
        assert n == b
    else:
        assert (n / b, t / b) == pytest.approx(({"k": 3, "g": 7}[shape[0]] ** 0.5, 0.5))
        assert page.evaluate("kreisel.page.kind") == shape


@pytest.mark.parametrize("how", ["middle", "Alt", "tool"])
def test_drag_of_a_corner_moves_the_fixed_point(page, how):
    before = scene(page)
    if how == "tool":
        page.get_by_label("Corners move the fixed point").check()
    hold = {"middle": {"button": "middle"}, "Alt": {"key": "Alt"}, "tool": {}}[how]
    start, end = drag(page, "corner", (-30, 25), number=5, **hold)
    after = scene(page)
    if how == "tool":
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
    x, y = page.evaluate("kreisel.at('corner', 0, 5)")
    page.mouse.move(x, y)
    page.mouse.down(button="middle")
    page.mouse.move(x + 9, y + 9)
    assert page.evaluate("kreisel.view.tops[0].axes.visible")
    page.keyboard.press("Escape")
    assert scene(page)["body"]["pivot"] == [0, 0, -1] and not page.evaluate(
        "kreisel.view.tops[0].axes.visible"
    )
    page.mouse.up(button="middle")


def test_drag_takes_the_state_of_the_moment_as_start_and_is_undone(page):
    before = scene(page)
    advance(page, 3)
    state = states(page)[0]
    drag(page, "tip", (20, 20))
    assert scene(page)["attitude"] == state[1:5] and clock(page) == 0
    page.keyboard.press("Control+z")
    assert scene(page) == before


def test_a_click_changes_nothing_and_a_double_click_shows_one_top_alone(page):
    load(page, "Compare four")
    advance(page, 3)
    before = scene(page)
    x, y = page.evaluate("kreisel.at('corner', 2, 5)")
    shown = "kreisel.charts.plots[0].series.slice(1).map((s) => s.show)"
    page.mouse.dblclick(x, y)
    assert page.evaluate(shown) == [False, False, True, False]
    page.mouse.dblclick(*BESIDE)
    assert page.evaluate(shown) == [True] * 4
    assert scene(page) == before and clock(page) == 3 * TICKS


def test_touch_drags_too(browser):
    page = visit(browser, size=PHONE, has_touch=True, is_mobile=True, reduced_motion="reduce")
    x, y = page.evaluate("kreisel.at('tip')")
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
    assert np.subtract(page.evaluate("kreisel.at('tip')"), (x, y)) == pytest.approx(
        (40, -30), abs=1
    )
    page.context.close()


@pytest.mark.parametrize("kind, moved", [("tip", slice(5, 8)), ("face", slice(1, 5))])
def test_each_of_two_motions_is_changed_by_itself(page, kind, moved):
    load(page, "Sleeping top")
    advance(page, 4)
    before = states(page)
    x, y = page.evaluate(f"kreisel.at('{kind}', 1)")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 15, y - 10)
    page.mouse.up()
    left, right = states(page)
    assert left[1:] == before[0][1:]
    assert (
        right[moved] != before[1][moved]
        and np.linalg.norm(np.subtract(right, before[1])[1:5]) < 0.3
    )
    kept = slice(1, 5) if kind == "tip" else slice(5, 8)
    assert right[kept] == before[1][kept]
