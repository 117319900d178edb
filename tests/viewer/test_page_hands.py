"""Tests of dragging, touching, pushing and turning the view by mouse and finger."""

import kreisel as kr
import numpy as np
import pytest
from browser import FINGERS, PHONE, UPRIGHT, WIDE, Viewer, list_changes, wait_for

EMPTY = (60, 120)  # a point of the picture beside the top
EYE = "kreisel.view.camera.position.toArray()"


# Handles


def test_dragging_the_tip_sets_the_momentum(page):
    before = page.read_scene()
    velocity = "kreisel.view.tops[0].w.quaternion.toArray()"
    old = page.evaluate(velocity)
    with page.hold("tip", (60, -80)) as start:
        assert page.evaluate("kreisel.view.tops[0].drops.visible")
    end = np.array(page.locate("tip"))
    assert not page.evaluate("kreisel.view.tops[0].drops.visible")
    assert end - start == pytest.approx((60, -80), abs=1)
    assert (
        list_changes(before, page.read_scene()) == {"momentum"} and page.evaluate(velocity) != old
    )
    m = np.array(page.read_scene()["momentum"])
    page.drag("tip", (30, -10), key="Shift")
    momentum = np.array(page.read_scene()["momentum"])
    assert np.linalg.norm(np.cross(m, momentum)) < 1e-9 * m @ m
    assert np.linalg.norm(momentum) != pytest.approx(np.linalg.norm(m), rel=1e-3)


@pytest.mark.parametrize("kind, number", [("face", 5), ("edge", 0)])
def test_dragging_a_face_or_an_edge_rotates_the_body(page, kind, number):
    before = page.read_scene()
    page.drag(kind, (50, 20), number=number)
    assert list_changes(before, page.read_scene()) == {"attitude"}
    assert np.linalg.norm(page.read_scene()["attitude"]) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("shape", ["free", "lagrange", "kowalewski", "goryachev_chaplygin"])
def test_dragging_a_corner_resizes_the_body_within_its_shape(page, shape):
    page.set_value("shape", shape)
    before = page.read_scene()["body"]
    start, end = page.drag("corner", (25, -30), number=5)
    after = page.read_scene()["body"]
    assert after["half"] != before["half"] and after["pivot"] == pytest.approx(
        (0, 0, -after["half"][2])
    )
    if shape == "free":
        assert end - start == pytest.approx((25, -30), abs=1)
    else:
        assert page.build_scene().body.kind == shape


@pytest.mark.parametrize("way", [{"button": "middle"}, {"key": "Alt"}, {}], ids=str)
def test_dragging_a_corner_moves_the_fixed_point(page, way):
    before, box = page.read_scene(), page.get_by_label("Corners move the fixed point")
    box.set_checked(not way)
    with page.hold("corner", (9, 9), number=5, **way):
        assert page.evaluate("kreisel.view.tops[0].axes.visible")
        page.keyboard.press("Escape")
    assert page.read_scene()["body"] == before["body"]
    start, end = page.drag("corner", (-30, 25), number=5, **way)
    after = page.read_scene()
    box.set_checked(False)
    assert end - start == pytest.approx((-30, 25), abs=1)
    assert after["body"]["half"] == before["body"]["half"]
    assert after["body"]["pivot"] != before["body"]["pivot"]
    assert after["momentum"] == before["momentum"] and after["methods"] == ["strang"]
    assert page.evaluate("kreisel.page.kind") == "general"
    assert not page.evaluate("kreisel.view.tops[0].axes.visible")


def test_a_body_without_given_density_is_resized_with_density_1(page):
    scene = kr.view(kr.scenes.thesis, open=False).scene
    page.load_scene({**scene, "show": {"solid": "box"}})
    assert page.evaluate("kreisel.view.body.half") == pytest.approx((0.8, 0.8, 1), rel=1e-6)
    page.drag("corner", (10, -10), number=5)
    assert page.read_scene()["body"]["density"] == pytest.approx(1, rel=1e-12)


def test_a_drag_starts_from_the_current_state_and_the_motion_continues_after_it(page):
    page.advance(3)
    state = page.read_states()[0]
    page.drag("tip", (20, 20))
    assert page.read_scene()["attitude"] == state[1:5] and page.read_clock() == 0
    assert page.read_scene()["taken"] == 3 and not page.evaluate("kreisel.page.isRunning")
    momentum = page.read_scene()["momentum"]
    page.evaluate("kreisel.page.setRunning(true)")
    page.swipe("tip", (20, -20), "mouse")
    assert page.evaluate("kreisel.page.isRunning") and page.read_scene()["momentum"] != momentum
    page.find_button("Stop").click()


@pytest.mark.parametrize("kind, component", [("tip", slice(5, 8)), ("face", slice(1, 5))])
def test_two_motions_are_changed_independently(page, kind, component):
    page.load("Sleeping top")
    page.advance(4)
    before = page.read_states()
    page.drag(kind, (15, -10), top=1)
    left, right = page.read_states()
    assert left[1:] == before[0][1:] and right[component] != before[1][component]
    assert np.linalg.norm(np.subtract(right, before[1])[1:5]) < 0.3
    rest = slice(1, 5) if kind == "tip" else slice(5, 8)
    assert right[rest] == before[1][rest]


@pytest.mark.parametrize("top", [0, 1])
def test_the_dragged_top_determines_the_new_start(page, top):
    page.load("Energy and motion")
    page.advance(20)
    before = page.read_states()
    assert np.abs(np.subtract(before[0], before[1])).max() > 1e-3
    page.drag("tip", (3, -2), top=top)
    assert page.read_scene()["attitude"] == before[top][1:5]


def test_arrows_can_be_hidden_and_hidden_parts_are_no_handles(page):
    page.load("Cusps", show={"velocity": True, "vertical": True})
    tip = page.locate("tip")
    picked = "([x, y]) => kreisel.view.pick(x, y)?.part"
    assert page.evaluate(picked, tip) == "tip"
    shown = "['m', 'w', 'p'].map((name) => kreisel.view.tops[0][name].visible)"
    for on in (False, True):
        page.keyboard.press("i")
        assert page.evaluate(shown) == [on] * 3
    for name in ("momentum", "velocity", "vertical"):
        page.set_value(f"show.{name}", False)
    shown = "['m', 'w', 'p'].map((name) => kreisel.view.tops[0][name].visible)"
    assert page.evaluate(shown) == [False] * 3 and page.evaluate(picked, tip) != "tip"
    page.load(momentum=[0, 0, 0], gravity=0)
    heads = "kreisel.view.tops[0].m.children.slice(0, 2).map((part) => part.visible)"
    assert page.evaluate(heads) == [False, False]
    page.drag("tip", (40, -30))
    assert np.linalg.norm(page.read_scene()["momentum"]) > 0 and page.evaluate(heads) == [
        True,
        True,
    ]


def test_long_arrows_are_brought_back_into_the_picture(page):
    page.load(momentum=[0, 0, 1])
    page.drag("corner", (200, -200), number=7)
    page.set_value("gravity", 0)
    _, y = page.locate("tip")
    page.drag("tip", (30, -y + 5))
    for part in ("m", "w"):
        end = f"kreisel.view.project(kreisel.view.tops[0].{part}.getEnd())"
        x, y = page.evaluate(end)
        assert 0 <= x <= WIDE[0] and 0 <= y <= WIDE[1]


@pytest.mark.parametrize("pointer", ["mouse", "touch"])
def test_a_push_changes_the_momentum_of_the_running_top(page, pointer):
    page.find_button("Push").click()
    page.evaluate("kreisel.page.setRunning(true)")
    wait_for(page, "kreisel.page.clock > 100000")
    start = page.build_scene()
    page.swipe("face", (60, 20), pointer)
    after = page.read_scene()
    assert page.evaluate("kreisel.page.isRunning") and after["taken"] > 0
    page.evaluate("kreisel.page.setRunning(false)")
    count = round(100 * after["taken"])
    before = kr.solve(start, after["taken"], "bobenko_suris", step=0.01, every=count).end
    assert after["attitude"] == pytest.approx(before.attitude, abs=1e-12)
    assert np.linalg.norm(np.subtract(after["momentum"], before.momentum)) > 0.1


@pytest.mark.parametrize("pointer, way", [("mouse", 40), ("touch", -40)])
def test_a_swipe_along_the_rim_gives_spin_alone(page, pointer, way):
    page.load("A spinning top")
    page.advance(2)
    state = page.read_states()[0]
    front = page.evaluate("""(() => {  // the rim below the tip of m
        const [x, low] = kreisel.locate('tip'), {drags} = kreisel;
        for (let clientY = 700; clientY > low; clientY -= 3)
            if (drags.findPart({clientX: x, clientY, pointerType: 'touch'})?.part === 'rim')
                return [x, clientY - 6];
    })()""")
    page.swipe(front, (way, 0), pointer)
    page.evaluate("kreisel.page.setRunning(false)")
    scene = page.read_scene()
    assert scene["taken"] == 2 and scene["attitude"] == pytest.approx(state[1:5], abs=1e-12)
    apex = kr.quaternion.turn(state[1:5], (0, 0, 1))
    given = np.subtract(scene["momentum"], state[5:])
    assert np.linalg.norm(np.cross(given, apex)) < 1e-9 and given @ apex * way > 0
    change = given @ apex / page.build_scene().body.moments[2]
    assert page.measure_top(0, "spin") == pytest.approx(220 + change)
    assert f"{abs(given @ apex):.3g} N m s" in page.read_message()


def test_dragging_the_pen_tilts_the_top_with_its_momentum_and_shows_the_angle(page):
    page.load("A spinning top")
    page.advance(0.1)
    before, spin = page.read_states()[0], page.measure_top(0, "spin")
    with page.hold("pen", (80, 60)) as start:
        shown = page.locator("#angle").inner_text()
        assert np.subtract(page.locate("pen"), start) == pytest.approx((80, 60), abs=1)
    assert page.locator("#angle").inner_text() == ""
    after, apexes = page.read_scene(), []
    for q, m in ((before[1:5], before[5:]), (after["attitude"], after["momentum"])):
        apexes.append(kr.quaternion.turn(q, (0, 0, 1)))
        assert np.dot(apexes[-1], m) == pytest.approx(np.dot(apexes[0], before[5:]))
    assert shown == f"tilt {np.degrees(np.arccos(apexes[1][2])):.1f}°"
    assert np.linalg.norm(after["momentum"]) == pytest.approx(np.linalg.norm(before[5:]))
    assert page.measure_top(0, "spin") == pytest.approx(spin) and np.ptp(apexes, axis=0).max() > 0.1
    page.set_value("tilt", 400)
    assert "Tilt cannot be 400" in page.read_message()


@pytest.mark.parametrize("size", [WIDE, PHONE])
def test_spin_and_tilt_have_dials_in_the_picture_that_can_be_closed(page, size):
    page.resize(size)
    page.load("A spinning top")
    for shown in (False, True):
        page.keyboard.press(",")
        assert page.locator("main #hand").is_visible() == shown
    for name, measure, value in (("Spin", "spin", 222), ("Tilt [°]", "nutation", np.radians(31))):
        slider = page.get_by_role("slider", name=name, exact=True)
        box = slider.bounding_box()
        assert box["y"] >= 0 and box["y"] + box["height"] <= size[1]
        slider.press("ArrowRight")
        assert page.measure_top(0, measure) == pytest.approx(value, abs=1e-9)


# Fingers


def test_a_finger_drags_only_tip_and_rim_and_turns_the_view_elsewhere(browser):
    page = Viewer(browser, **FINGERS).open()
    for preset, kinds in (("Gyroscope", ("face", "edge")), (UPRIGHT, ("face", "corner", "edge"))):
        page.load(preset)
        before = page.read_scene()
        for kind in kinds:
            position = page.evaluate(EYE)
            page.swipe(kind, (60, 20), number=5)
            assert page.evaluate(EYE) != pytest.approx(position, abs=0.1), kind
            assert page.read_scene() == before
        page.find_button("Home view").click()
    start = page.locate("tip")
    page.swipe("tip", (40, -30))
    moved = np.subtract(page.locate("tip"), start)
    assert moved == pytest.approx((40, -30), abs=1)
    buttons = "[...document.querySelectorAll('#bar button')]"
    sizes = f"{buttons}.map((each) => Math.min(each.offsetWidth, each.offsetHeight))"
    assert min(page.evaluate(sizes)) >= 36
    assert page.locator("#hint").is_visible()
    page.find_button("Keys").click()  # a phone has none, and shows gestures
    words = page.locator("#keys").inner_text()
    assert "Swipe along the rim" in words and "Space" not in words
    assert page.troubles == []
    page.close()


# The camera


def read_camera(page):
    """Return the camera position relative to the target, the target position, and the zoom."""
    offset, target, zoom = page.evaluate("""(({camera, orbit: {target}}) => [
        camera.position.clone().sub(target).toArray(), target.toArray(), camera.zoom,
    ])(kreisel.view)""")
    return np.array(offset), np.array(target), zoom


def drag_empty(page, offset, button="left"):
    page.mouse.move(*EMPTY)
    page.mouse.down(button=button)
    page.mouse.move(EMPTY[0] + offset[0], EMPTY[1] + offset[1])
    page.mouse.up(button=button)


def locate_handles(page, top=0):
    """Return the places of the tip and the corners of a top in the window."""
    corners = f"...Array.from({{length: 8}}, (_, i) => kreisel.locate('corner', {top}, i))"
    return np.array(page.evaluate(f"[kreisel.locate('tip', {top}), {corners}]"))


def is_in_sight(page, top=0):
    places, size = locate_handles(page, top), page.evaluate("kreisel.view.pixels")
    return ((places > 0) & (places < size)).all()


def measure_sides(page):
    """Return the viewing directions and the extent of the top in each of three side views."""
    sizes, directions = [], []
    for _ in range(3):
        page.find_button("View next side").click()
        assert is_in_sight(page)
        sizes.append(np.ptp(locate_handles(page), axis=0))
        offset = read_camera(page)[0]
        directions.append(offset / np.linalg.norm(offset))
    return np.array(directions), np.array(sizes)


def test_dragging_beside_the_top_orbits_the_camera(page):
    before, (offset, target, _) = page.read_scene(), read_camera(page)
    drag_empty(page, (90, 30))
    new_offset, new_target, _ = read_camera(page)
    assert np.linalg.norm(new_offset) == pytest.approx(np.linalg.norm(offset))
    assert (new_target == target).all() and page.read_scene() == before
    assert new_offset @ offset < 0.99 * offset @ offset


@pytest.mark.parametrize("is_flat", [False, True], ids=["3D", "2D"])
def test_the_view_pans_zooms_within_limits_and_shows_three_sides(page, is_flat):
    page.get_by_role("checkbox", name="2D view").set_checked(is_flat)
    (offset, target, _), x = read_camera(page), page.evaluate("kreisel.locate('tip')[0]")
    drag_empty(page, (90, 0), button="right")
    new_offset, new_target, _ = read_camera(page)
    assert new_offset == pytest.approx(offset) and np.linalg.norm(new_target - target) > 0.1
    assert page.evaluate("kreisel.locate('tip')[0]") == pytest.approx(x + 90, abs=20)
    page.keyboard.press("Home")
    directions, sizes = measure_sides(page)
    expected = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    assert np.sort(directions, axis=0) == pytest.approx(np.sort(expected, axis=0), abs=2e-3)
    size = (
        "kreisel.view.camera.zoom"
        if is_flat
        else "kreisel.view.camera.position.distanceTo(kreisel.view.orbit.target)"
    )
    page.keyboard.press("Home")
    before = page.evaluate(size)
    least, most = (0.2, 10) if is_flat else (3, 2.5 * before)
    for way, limit in ((8000, least if is_flat else most), (-16000, most if is_flat else least)):
        page.mouse.move(*EMPTY)
        page.mouse.wheel(0, way)
        wait_for(page, f"Math.abs({size} - {limit}) < 1e-6 * {limit}")
        drag_empty(page, (300, 250), button="right")
        assert measure_sides(page)[1] == pytest.approx(sizes, rel=0.02)
        page.keyboard.press("Home")


def test_more_tops_and_a_sinking_floor_are_brought_into_view(page):
    page.keyboard.press("Home")
    for count, label in ((2, "Beside it"), (3, "Third method")):
        page.get_by_label(label).select_option("rk4")
        assert all(is_in_sight(page, top) for top in range(count))
    page.load("A spinning top")
    page.keyboard.press("Home")
    near, floor = read_camera(page)[0], "kreisel.view.floor.height"
    before = page.evaluate(floor)
    for axis in ("first", "second", "vertical"):
        page.fill_field(f"Momentum, {axis} component", 0)
    assert page.evaluate(floor) < before - 0.5  # the top falls through the lowest point
    assert np.linalg.norm(read_camera(page)[0]) > 1.1 * np.linalg.norm(near)
    low = f"""(({{orbit}}) => kreisel.view.project(
        orbit.target.clone().setZ({floor})))(kreisel.view)[1]"""
    assert page.evaluate(low) < WIDE[1]


def test_handles_follow_the_size_of_the_window(page):
    for size in ((900, 600), (1200, 420), (500, 900)):
        page.resize(size)
        assert is_in_sight(page)
        before = page.read_scene()["momentum"]
        start, end = page.drag("tip", (12, -9))
        assert end - start == pytest.approx((12, -9), abs=1)
        assert page.read_scene()["momentum"] != before and page.read_message() == ""


def test_a_faster_top_has_the_knob_of_its_spin_further_right(page):
    page.load("A spinning top")
    ends = set()
    for title in ("Double the spin", "Spin it slowly"):
        page.find_button(title).click()
        ends.add(page.get_by_role("slider", name="Spin", exact=True).get_attribute("max"))
    assert len(ends) == 1 and float(*ends) > 440


@pytest.mark.parametrize(
    "preset, said", [("Cusps", "rim pen tip"), ("Satellite", "tip"), ("Gyrocompass", "look")]
)
def test_the_hint_names_what_can_be_dragged(page, preset, said):
    page.load(preset)
    words = page.locator("#hint").inner_text()
    assert [word for word in ("rim", "pen", "tip", "look") if word in words] == said.split()
