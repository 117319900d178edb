"""Tests of the picture: camera and shapes; traces, rods and bodies equal those of Python."""

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
    scene,
    scene_in_python,
    wait_for,
)

EMPTY = (60, 120)  # in the picture, beside the top
TOP = "kreisel.view.tops[0]"


def camera(page):
    """Return the camera's place relative to its target, the target, and the zoom of the 2D view."""
    offset, target, zoom = page.evaluate("""(({camera, orbit: {target}}) => [
        camera.position.clone().sub(target).toArray(), target.toArray(), camera.zoom,
    ])(kreisel.view)""")
    return np.array(offset), np.array(target), zoom


def move(page, by, button="left"):
    page.mouse.move(*EMPTY)
    page.mouse.down(button=button)
    page.mouse.move(EMPTY[0] + by[0], EMPTY[1] + by[1])
    page.mouse.up(button=button)


def handles(page):
    return np.array(
        page.evaluate(
            "[kreisel.at('tip'), ...Array.from({length: 8}, (_, i) => kreisel.at('corner', 0, i))]"
        )
    )


def picture(page):
    return page.locator("canvas").first.bounding_box()


def in_sight(page):
    box = picture(page)
    return ((handles(page) > (0, 0)) & (handles(page) < (box["width"], box["height"]))).all()


def sides(page):
    """Return the size of the top from each of the three sides."""
    sizes = []
    for _ in range(3):
        page.get_by_role("button", name="From the next side").click()
        page.evaluate("new Promise(requestAnimationFrame)")  # drawn
        assert in_sight(page)
        sizes.append(np.ptp(handles(page), axis=0))
    return np.array(sizes)


def flat(page, on):
    page.get_by_role("checkbox", name="2D view").set_checked(on)


def is_green(page, x, y):
    """Return True if the picture has the momentum's green at this place."""
    red, green, blue, _ = page.evaluate(
        """([x, y]) => { const c = document.createElement('canvas'), v = kreisel.view;
        v.dirty = true; v.render(); [c.width, c.height] = [1, 1];
        const at = c.getContext('2d'), zoom = v.canvas.width / v.canvas.clientWidth;
        at.drawImage(v.canvas, -Math.round(x * zoom), -Math.round(y * zoom));
        return Array.from(at.getImageData(0, 0, 1, 1).data); }""",
        [x, y],
    )
    return green > 1.1 * blue and green > 2 * red


# The camera


def test_drag_beside_the_top_orbits(page):
    before, offset, target = scene(page), *camera(page)[:2]
    move(page, (90, 30))
    turned, same, _ = camera(page)
    assert (
        np.linalg.norm(turned) == pytest.approx(np.linalg.norm(offset)) and (same == target).all()
    )
    assert turned @ offset < 0.99 * offset @ offset and scene(page) == before


@pytest.mark.parametrize("on", [False, True], ids=["3D", "2D"])
def test_drag_with_the_right_button_pans(page, on):
    flat(page, on)
    (offset, target, _), x = camera(page), page.evaluate("kreisel.at('tip')[0]")
    move(page, (90, 0), button="right")
    same, panned, _ = camera(page)
    assert same == pytest.approx(offset) and np.linalg.norm(panned - target) > 0.1
    assert page.evaluate("kreisel.at('tip')[0]") == pytest.approx(x + 90, abs=20)


@pytest.mark.parametrize("on", [False, True], ids=["3D", "2D"])
def test_wheel_zooms_within_limits(page, on):
    flat(page, on)
    size = (
        "kreisel.view.camera.zoom"
        if on
        else "kreisel.view.camera.position.distanceTo(kreisel.view.orbit.target)"
    )
    page.keyboard.press("Home")
    before = page.evaluate(size)
    least, most = (0.2, 10) if on else (3, 2.5 * before)
    page.mouse.move(*EMPTY)
    page.mouse.wheel(0, 100)
    wait_for(
        page, f"{size} {'<' if on else '>'} {before}"
    )  # smaller in the 2D view, or further off
    for way, limit in ((8000, least if on else most), (-16000, most if on else least)):
        page.mouse.wheel(0, way)
        wait_for(page, f"Math.abs({size} - {limit}) < 1e-6 * {limit}")


@pytest.mark.parametrize("way", [-8000, 8000], ids=["near", "far"])
@pytest.mark.parametrize("on", [False, True], ids=["3D", "2D"])
def test_next_side_brings_all_back_into_sight(page, on, way):
    flat(page, on)
    before = sides(page)
    page.mouse.move(*EMPTY)
    page.mouse.wheel(0, way)
    height = "Math.abs(kreisel.at('corner', 0, 7)[1] - kreisel.at('corner', 0, 0)[1])"
    wait_for(page, f"{height} {'>' if way < 0 else '<'} {before[-1][1]}")
    move(page, (300, 250), button="right")
    assert way > 0 or not in_sight(page)
    assert sides(page) == pytest.approx(before, rel=0.02)


def test_panel_can_be_put_away(page):
    narrow = picture(page)["width"]
    for hide, show in (
        (lambda: page.keyboard.press("h"),) * 2,
        (page.get_by_role("button", name="Panel").click,) * 2,
    ):
        hide()
        wait_for(page, "kreisel.view.canvas.clientWidth === innerWidth")
        assert not page.locator("#panel").is_visible() and is_green(
            page, *page.evaluate("kreisel.at('tip')")
        )
        show()
        wait_for(page, f"kreisel.view.canvas.clientWidth === {narrow}")
        assert page.locator("#panel").is_visible()


@pytest.mark.parametrize("size", [(900, 600), (1200, 420), (500, 900)], ids=str)
def test_window_can_be_resized(page, size):
    page.set_viewport_size({"width": size[0], "height": size[1]})
    wait_for(
        page,
        "Math.abs(kreisel.view.canvas.clientWidth"
        " - document.querySelector('main').clientWidth) < 1",
    )
    assert is_green(page, *page.evaluate("kreisel.at('tip')"))
    before = scene(page)["momentum"]
    start, end = drag(page, "tip", (12, -9))
    page.set_viewport_size(dict(zip(("width", "height"), WIDE, strict=True)))
    wait_for(page, f"kreisel.view.canvas.clientHeight === {WIDE[1]}")
    assert end - start == pytest.approx((12, -9), abs=1) and scene(page)["momentum"] != before


# The rod


def rings(page):
    """The rod's points, (rings, sides, 3), newest first; 6 indices draw a side of a ring."""
    places, count = page.evaluate(f"""(({{attributes, drawRange}}) =>
        [Array.from(attributes.position.array), drawRange.count])({TOP}.rod.geometry)""")
    return np.reshape(places, (-1, ROD_SIDES, 3))[: count // (6 * ROD_SIDES) + 1]


@pytest.mark.parametrize(
    "preset, ratio", [(UPRIGHT, 1), ("Kowalewski", 0.5**0.5), ("Goryachev-Chaplygin", 0.5)]
)
def test_rod_is_as_thick_as_the_body_is_stiff(page, preset, ratio):
    load(page, preset)
    page.get_by_role("checkbox", name="Elastic rod").check()
    advance(page, 3)
    across = np.linalg.norm(rings(page)[0], axis=1)
    assert across.min() / across.max() == pytest.approx(ratio, rel=1e-5)
    path = kr.solve(
        scene_in_python(scene(page)),
        3,
        page.evaluate("kreisel.page.tops[0].method"),
        step=0.01,
        every=300,
    )
    assert np.abs(rings(page)[0] @ path.apex[-1]).max() < 1e-6  # across the way of the rod
    section = kr.rod(path).section
    assert min(section) / max(section) == pytest.approx(ratio)


@pytest.mark.parametrize("preset", ["Elastic rod", "Kowalewski"])
def test_rod_is_that_of_python_and_grows(page, preset):
    load(page, preset)
    page.get_by_role("checkbox", name="Elastic rod").check()
    lengths = []
    for t in (1, 8, 15):
        advance(page, t)
        lengths.append(len(rings(page)))
    assert lengths == [21, 161, 301]
    path = kr.solve(
        scene_in_python(scene(page)),
        15,
        page.evaluate("kreisel.page.tops[0].method"),
        step=0.01,
        every=1,
    )
    scale = page.evaluate("0.5 * kreisel.view.zoom")
    line, expected = rings(page).mean(axis=1) / scale, kr.rod(path).centre[::-5]
    assert line[0] == pytest.approx((0, 0, 0), abs=1e-6)
    ends = path.apex[::-5] - path.apex[-1]
    assert (
        np.abs(line - (expected - expected[0])).max() < 0.06
    )  # a sum of pieces, each along its newer end
    assert (
        np.abs(line - (expected - expected[0]) - 0.025 * ends).max() < 0.002
    )  # and so much the sum is off


# The trace of the apex


@pytest.mark.parametrize("t, stride", [(5, 1), (45, 2)])
def test_trace_is_the_way_of_the_apex(page, t, stride):
    advance(page, t)
    places, count = page.evaluate(f"""(({{attributes, drawRange}}) =>
        [Array.from(attributes.start.data.array), drawRange.count])({TOP}.line.geometry)""")
    points = np.reshape(places, (-1, 4, 3))[: count // 6 + 1, 0]
    assert len(points) == min(100 * t + 1, TRACE)
    path = kr.solve(scene_in_python(scene(page)), t, "bobenko_suris", step=0.01, every=1)
    radius = np.linalg.norm(points, axis=1)
    assert points / radius[:, None] == pytest.approx(path.apex[::-stride][: len(points)], abs=1e-6)
    fading = 1 - 0.02 * np.arange(len(points)) / TRACE
    assert radius == pytest.approx(radius[0] * fading, rel=1e-6)


# The body


def read_out(page):
    """Its kind, and the numbers: mass, moments, centre of mass."""
    kind, _, numbers = page.get_by_text("top: mass").inner_text().partition(" top: mass ")
    words = (
        numbers.replace("moments", "").replace("centre of mass", "").partition("(")[0].split(",")
    )
    return kind, [float(word) for word in words]


def assert_is(page, body):
    kind, numbers = read_out(page)
    assert kind.lower().replace("-", "_") == body.kind
    assert numbers == pytest.approx(
        [body.mass, *body.moments, *body.principal_com], rel=5.1e-4, abs=1e-12
    )


def test_body_is_told_as_python_tells_it(page):
    assert read_out(page)[0] == "Lagrange" and read_out(page)[1] == [
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
        assert_is(page, scene_in_python(scene(page)).body)
        assert name in read_out(page)[0]


@pytest.mark.parametrize("name", ["thesis", "asymmetric", "dzhanibekov"])
def test_body_given_by_numbers_is_told_too(page, name):
    given = getattr(kr.scenes, name)
    page.evaluate("given => kreisel.page.load(given)", kr.view(given, open=False).scene)
    assert_is(page, given.body)
    turned = kr.Body(2.0, [[3.0, 0.2, 0.1], [0.2, 4.0, 0.3], [0.1, 0.3, 5.0]], (0.1, 0.2, 0.3))
    page.evaluate(
        "given => kreisel.page.load(given)",
        kr.view(kr.Scene(turned, (1.0, 2.0, 3.0)), open=False).scene,
    )
    assert_is(page, turned)
