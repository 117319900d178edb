"""Tests of the camera and of the drawn traces, rods and bodies."""

import kreisel as kr
import numpy as np
import pytest
from browser import (
    ROD_SIDES,
    TRACE,
    UPRIGHT,
    WIDE,
    advance,
    drag,
    load,
    read_scene,
    scene_in_python,
    wait_for,
)

EMPTY = (60, 120)  # a point of the picture beside the top
TOP = "kreisel.view.tops[0]"


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


def locate_handles(page):
    return np.array(
        page.evaluate(
            "[kreisel.locate('tip'),"
            "...Array.from({length: 8}, (_, i) => kreisel.locate('corner', 0, i))]"
        )
    )


def measure_picture(page):
    return page.locator("canvas").first.bounding_box()


def is_in_sight(page):
    box = measure_picture(page)
    return (
        (locate_handles(page) > (0, 0)) & (locate_handles(page) < (box["width"], box["height"]))
    ).all()


def measure_sides(page):
    """Return the extent of the top on the screen in each of three side views."""
    sizes = []
    for _ in range(3):
        page.get_by_role("button", name="View next side").click()
        page.evaluate("new Promise(requestAnimationFrame)")  # drawn
        assert is_in_sight(page)
        sizes.append(np.ptp(locate_handles(page), axis=0))
    return np.array(sizes)


def set_flat(page, is_flat):
    page.get_by_role("checkbox", name="2D view").set_checked(is_flat)


def is_green(page, x, y):
    """Return True if the pixel at (x, y) is green."""
    red, green, blue, _ = page.evaluate(
        """([x, y]) => { const c = document.createElement('canvas'), v = kreisel.view;
        v.render(); [c.width, c.height] = [1, 1];
        const at = c.getContext('2d'), zoom = v.canvas.width / v.canvas.clientWidth;
        at.drawImage(v.canvas, -Math.round(x * zoom), -Math.round(y * zoom));
        return Array.from(at.getImageData(0, 0, 1, 1).data); }""",
        [x, y],
    )
    return green > 1.1 * blue and green > 2 * red


# The camera


def test_dragging_beside_the_top_orbits_the_camera(page):
    before, offset, target = read_scene(page), *read_camera(page)[:2]
    drag_empty(page, (90, 30))
    new_offset, new_target, _ = read_camera(page)
    assert (
        np.linalg.norm(new_offset) == pytest.approx(np.linalg.norm(offset))
        and (new_target == target).all()
    )
    assert new_offset @ offset < 0.99 * offset @ offset and read_scene(page) == before


@pytest.mark.parametrize("is_flat", [False, True], ids=["3D", "2D"])
def test_dragging_with_the_right_button_pans(page, is_flat):
    set_flat(page, is_flat)
    (offset, target, _), x = read_camera(page), page.evaluate("kreisel.locate('tip')[0]")
    drag_empty(page, (90, 0), button="right")
    new_offset, new_target, _ = read_camera(page)
    assert new_offset == pytest.approx(offset) and np.linalg.norm(new_target - target) > 0.1
    assert page.evaluate("kreisel.locate('tip')[0]") == pytest.approx(x + 90, abs=20)


@pytest.mark.parametrize("is_flat", [False, True], ids=["3D", "2D"])
def test_the_wheel_zooms_within_limits(page, is_flat):
    set_flat(page, is_flat)
    size = (
        "kreisel.view.camera.zoom"
        if is_flat
        else "kreisel.view.camera.position.distanceTo(kreisel.view.orbit.target)"
    )
    page.keyboard.press("Home")
    before = page.evaluate(size)
    least, most = (0.2, 10) if is_flat else (3, 2.5 * before)
    page.mouse.move(*EMPTY)
    page.mouse.wheel(0, 100)
    wait_for(
        page, f"{size} {'<' if is_flat else '>'} {before}"
    )  # the picture is smaller in the 2D view, or the camera is more distant
    for way, limit in ((8000, least if is_flat else most), (-16000, most if is_flat else least)):
        page.mouse.wheel(0, way)
        wait_for(page, f"Math.abs({size} - {limit}) < 1e-6 * {limit}")


@pytest.mark.parametrize("way", [-8000, 8000], ids=["near", "far"])
@pytest.mark.parametrize("is_flat", [False, True], ids=["3D", "2D"])
def test_the_next_side_button_brings_all_tops_into_view(page, is_flat, way):
    set_flat(page, is_flat)
    before = measure_sides(page)
    page.mouse.move(*EMPTY)
    page.mouse.wheel(0, way)
    height = "Math.abs(kreisel.locate('corner', 0, 7)[1] - kreisel.locate('corner', 0, 0)[1])"
    wait_for(page, f"{height} {'>' if way < 0 else '<'} {before[-1][1]}")
    drag_empty(page, (300, 250), button="right")
    assert way > 0 or not is_in_sight(page)
    assert measure_sides(page) == pytest.approx(before, rel=0.02)


@pytest.mark.usefixtures("full_picture")
def test_the_panel_can_be_hidden(page):
    narrow = measure_picture(page)["width"]
    for hide, show in (
        (lambda: page.keyboard.press("h"),) * 2,
        (page.get_by_role("button", name="Panel").click,) * 2,
    ):
        hide()
        wait_for(page, "kreisel.view.canvas.clientWidth === innerWidth")
        assert not page.locator("#panel").is_visible() and is_green(
            page, *page.evaluate("kreisel.locate('tip')")
        )
        show()
        wait_for(page, f"kreisel.view.canvas.clientWidth === {narrow}")
        assert page.locator("#panel").is_visible()


@pytest.mark.usefixtures("full_picture")
@pytest.mark.parametrize("size", [(900, 600), (1200, 420), (500, 900)], ids=str)
def test_window_can_be_resized(page, size):
    page.set_viewport_size({"width": size[0], "height": size[1]})
    wait_for(
        page,
        "Math.abs(kreisel.view.canvas.clientWidth"
        " - document.querySelector('main').clientWidth) < 1",
    )
    assert is_green(page, *page.evaluate("kreisel.locate('tip')"))
    before = read_scene(page)["momentum"]
    start, end = drag(page, "tip", (12, -9))
    page.set_viewport_size(dict(zip(("width", "height"), WIDE, strict=True)))
    wait_for(page, f"kreisel.view.canvas.clientHeight === {WIDE[1]}")
    assert end - start == pytest.approx((12, -9), abs=1) and read_scene(page)["momentum"] != before


def test_the_camera_goes_back_when_the_floor_sinks(page):
    load(page, "A spinning top")
    page.keyboard.press("Home")
    (near, before_target, _), floor = read_camera(page), "kreisel.view.floor.height"
    before = page.evaluate(floor)
    for axis in ("first", "second", "vertical"):
        page.get_by_label(f"Momentum, {axis} component").fill("0")
        page.keyboard.press("Tab")
    assert page.evaluate(floor) < before - 0.5  # the top falls through the lowest point
    offset, target, _ = read_camera(page)
    assert np.linalg.norm(offset) > 1.1 * np.linalg.norm(near)
    low = f"""(({{orbit}}) => kreisel.view.project(
        orbit.target.clone().setZ({floor})))(kreisel.view)[1]"""
    assert page.evaluate(low) < WIDE[1]
    assert target[2] < before_target[2] - 0.2


# The rod


def read_rings(page):
    """Return the mesh vertices of the rod as an array of rings, beginning with the ring added
    last."""
    places, count = page.evaluate(f"""(({{attributes, drawRange}}) =>
        [Array.from(attributes.position.array), drawRange.count])({TOP}.rod.geometry)""")
    return np.reshape(places, (-1, ROD_SIDES, 3))[: count // (6 * ROD_SIDES) + 1]


@pytest.mark.parametrize(
    "preset, ratio", [(UPRIGHT, 1), ("Kowalewski", 0.5**0.5), ("Goryachev-Chaplygin", 0.5)]
)
def test_the_thickness_of_the_rod_follows_from_the_moments(page, preset, ratio):
    load(page, preset)
    page.get_by_role("checkbox", name="Elastic rod").check()
    advance(page, 3)
    radii = np.linalg.norm(read_rings(page)[0], axis=1)
    assert radii.min() / radii.max() == pytest.approx(ratio, rel=1e-5)
    path = kr.solve(
        scene_in_python(read_scene(page)),
        3,
        page.evaluate("kreisel.page.tops[0].method"),
        step=0.01,
        every=300,
    )
    # perpendicular to the centre line of the rod
    assert np.abs(read_rings(page)[0] @ path.apex[-1]).max() < 1e-6
    section = kr.rod(path).section
    assert min(section) / max(section) == pytest.approx(ratio)


@pytest.mark.parametrize("preset", ["Elastic rod", "Kowalewski"])
def test_the_rod_agrees_with_python_and_grows(page, preset):
    load(page, preset)
    page.get_by_role("checkbox", name="Elastic rod").check()
    lengths = []
    for t in (1, 8, 15):
        advance(page, t)
        lengths.append(len(read_rings(page)))
    assert lengths == [21, 161, 301]
    times = np.linspace(0, 15, 1501)
    method = page.evaluate("kreisel.page.tops[0].method")
    words = {} if method == "exact" else {"step": 0.01}
    path = kr.solve(scene_in_python(read_scene(page)), times, method, **words)
    scale = page.evaluate("0.5 * kreisel.view.zoom")
    line, expected = read_rings(page).mean(axis=1) / scale, kr.rod(path).centre[::-5]
    assert line[0] == pytest.approx((0, 0, 0), abs=1e-6)
    ends = path.apex[::-5] - path.apex[-1]
    assert (
        np.abs(line - (expected - expected[0])).max() < 0.06
    )  # the sum of the segments, each along the tangent at the newer end of the segment
    assert (
        np.abs(line - (expected - expected[0]) - 0.025 * ends).max() < 0.002
    )  # the error of this approximation


# The trace of the apex


@pytest.mark.parametrize("t, stride", [(5, 1), (45, 2)])
def test_the_trace_is_the_curve_of_the_apex(page, t, stride):
    advance(page, t)
    places, count = page.evaluate(f"""(({{attributes, drawRange}}) =>
        [Array.from(attributes.start.data.array), drawRange.count])({TOP}.line.geometry)""")
    points = np.reshape(places, (-1, 4, 3))[: count // 6 + 1, 0]
    assert len(points) == min(100 * t + 1, TRACE)
    path = kr.solve(scene_in_python(read_scene(page)), t, "bobenko_suris", step=0.01, every=1)
    radius = np.linalg.norm(points, axis=1)
    assert points / radius[:, None] == pytest.approx(path.apex[::-stride][: len(points)], abs=1e-6)
    fading = 1 - 0.02 * np.arange(len(points)) / TRACE
    assert radius == pytest.approx(radius[0] * fading, rel=1e-6)


def test_the_newest_part_of_the_trace_is_drawn_last(page):
    advance(page, 5)
    order = page.evaluate(f"""(({{line}}) => {{
        const order = [], parts = [line, line.children[0]];
        parts.forEach((part, k) => (part.onBeforeRender = () => order.push(k)));
        kreisel.view.isDirty = true;
        kreisel.view.render();
        for (const part of parts) delete part.onBeforeRender;
        return order;
    }})({TOP})""")
    assert order == [0, 1]


# The body


def read_body(page):
    """Return the kind, mass, moments of inertia and centre of mass that the viewer displays."""
    kind, _, numbers = page.get_by_text("top: mass").inner_text().partition(" top: mass ")
    words = (
        numbers.replace("moments", "").replace("centre of mass", "").partition("(")[0].split(",")
    )
    return kind, [float(word) for word in words]


def check_body(page, body):
    kind, numbers = read_body(page)
    assert kind.lower().replace("-", "_") == body.kind
    assert numbers == pytest.approx(
        [body.mass, *body.moments, *body.principal_com], rel=5.1e-4, abs=1e-12
    )


def test_the_description_of_the_body_agrees_with_python(page):
    assert read_body(page)[0] == "Lagrange" and read_body(page)[1] == [
        5.12,
        7.919,
        7.919,
        2.185,
        0,
        0,
        1,
    ]
    for kind, name in {
        "kowalewski": "Kowalewski",
        "goryachev_chaplygin": "Goryachev-Chaplygin",
        "free": "",
    }.items():
        page.get_by_label("Shape").select_option(kind)
        check_body(page, scene_in_python(read_scene(page)).body)
        assert name in read_body(page)[0]


@pytest.mark.parametrize("name", ["thesis", "asymmetric", "dzhanibekov"])
def test_a_body_given_by_numbers_is_described(page, name):
    scene = getattr(kr.scenes, name)
    page.evaluate("given => kreisel.page.load(given)", kr.view(scene, open=False).scene)
    check_body(page, scene.body)
    body = kr.Body(2.0, [[3.0, 0.2, 0.1], [0.2, 4.0, 0.3], [0.1, 0.3, 5.0]], (0.1, 0.2, 0.3))
    page.evaluate(
        "given => kreisel.page.load(given)",
        kr.view(kr.Scene(body, (1.0, 2.0, 3.0), gravity=1), open=False).scene,
    )
    check_body(page, body)
