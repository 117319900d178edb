"""Tests of the arrows for weight and torque, and of the path of the momentum."""

import kreisel as kr
import numpy as np
import pytest
from browser import (
    PRESETS,
    advance,
    load,
    read_record,
    read_scene,
    read_states,
    scene_in_python,
)
from test_page_numbers import click_exercise, read_numbers

WHY, WITHOUT_SPIN = "Why does it not fall?", "Without spin"
TOP = "kreisel.view.tops[0]"


def read_arrow(page, name):
    """Return the starting point and the vector of one of the arrows drawn on the first top."""
    script = f"""(({{position, quaternion, tip}}) =>
        [position, tip.position.clone().applyQuaternion(quaternion)].map((v) => v.toArray())
    )({TOP}.{name})"""
    return map(np.array, page.evaluate(script))


def compute_torque(page):
    """Return the lever arm and the torque of the weight of the first top."""
    scene = scene_in_python(read_scene(page))
    lever = np.array(kr.quaternion.turn(read_states(page)[0][1:5], scene.body.com))
    return lever, np.cross(lever, [0, 0, -scene.body.mass * scene.gravity])


def read_visible(page, *names):
    return page.evaluate(
        "(names) => names.map((name) => kreisel.view.tops[0][name].visible)", names
    )


@pytest.mark.parametrize("preset", PRESETS)
def test_the_torque_is_drawn_at_the_tip_of_m_and_the_weight_at_the_centre(page, preset):
    load(page, preset)
    page.evaluate("kreisel.page.setValue('show.torque', true)")
    advance(page, 1.5)
    lever, torque = compute_torque(page)
    has_torque = np.linalg.norm(torque) > 1e-9
    if not read_scene(page)["gravity"]:
        assert read_visible(page, "weight", "torque", "momentumTrace") == [False] * 3
        return
    zoom, momentum_zoom = page.evaluate("[kreisel.view.zoom, kreisel.view.momentumZoom]")
    begin, arrow = read_arrow(page, "torque")
    assert begin == pytest.approx(momentum_zoom * np.array(read_states(page)[0][5:]), abs=1e-6)
    if has_torque:
        unit = torque / np.linalg.norm(torque)
        assert arrow / np.linalg.norm(arrow) == pytest.approx(unit, abs=1e-6)
    begin, arrow = read_arrow(page, "weight")
    assert begin == pytest.approx(zoom * lever, abs=1e-6)
    assert arrow[:2] == pytest.approx([0, 0]) and arrow[2] * read_scene(page)["gravity"] < 0


def test_the_path_of_m_is_horizontal_and_agrees_with_python(page):
    load(page, "A spinning top")
    click_exercise(page, WHY)
    advance(page, 5)
    zoom = page.evaluate("kreisel.view.momentumZoom")
    places, count = page.evaluate(f"""(({{attributes, drawRange}}) =>
        [Array.from(attributes.start.data.array), drawRange.count]
    )({TOP}.momentumTrace.geometry)""")
    points = np.reshape(places, (-1, 4, 3))[: count // 6 + 1, 0]
    times = 0.01 * np.arange(len(points))
    path = kr.exact(scene_in_python(read_scene(page)))(times)
    assert points == pytest.approx(zoom * path.m[::-1], abs=1e-6)
    assert np.ptp(points[:, 2]) < 1e-6 < np.ptp(points[:, 0])


def test_a_top_with_spin_keeps_its_tilt_and_one_without_falls(page):
    load(page, "A spinning top")
    click_exercise(page, WHY)
    assert read_visible(page, "m", "w", "p", "torque") == [True, False, False, True]
    advance(page, 8)
    tilts = np.degrees(read_record(page, 0, "nutation"))
    assert tilts == pytest.approx(np.full(len(tilts), 30), abs=1e-6)
    click_exercise(page, WITHOUT_SPIN)
    assert read_states(page)[0][5:] == [0, 0, 0]
    advance(page, 8)
    assert np.degrees(read_record(page, 0, "nutation")).max() > 170


@pytest.mark.parametrize("spin", [22, -22])
def test_axis_and_torque_are_not_foreshortened_at_the_start(page, spin):
    load(page, "A spinning top")
    click_exercise(page, WHY)
    start = {"tilt": 30, "spin": spin, "precession": "slow"}
    page.evaluate("start => kreisel.page.load({...kreisel.page.scene, start})", start)
    page.evaluate("kreisel.view.moveHome()")
    for t in (0, 0.5, 1):
        advance(page, t)
        direction = np.array(
            page.evaluate("""(({camera, orbit}) =>
            camera.position.clone().sub(orbit.target).normalize().toArray())(kreisel.view)""")
        )
        for name in ("m", "torque"):
            _, arrow = read_arrow(page, name)
            fraction = np.linalg.norm(np.cross(arrow, direction)) / np.linalg.norm(arrow)
            assert fraction > (0.85 if name == "m" else 0.55), (name, t, fraction)


def test_labels_do_not_cover_the_torque(page):
    load(page, "A spinning top")
    click_exercise(page, WHY)
    for t in np.arange(0, 8, 0.5):
        advance(page, t)
        page.evaluate("kreisel.view.render()")
        assert not page.locator(".labels span:visible", has_text="°").count()
        begin, end = page.evaluate(f"""[{TOP}.m, {TOP}.torque].map((arrow) =>
            kreisel.view.project(arrow.getEnd()))""")
        points = np.linspace(begin, end, 20)
        for words in ("momentum m", "torque"):
            box = page.locator(".labels .arrow", has_text=words).bounding_box()
            low, size = np.array([box["x"], box["y"]]), np.array([box["width"], box["height"]])
            is_inside = (points > low) & (points < low + size)
            assert not is_inside.all(axis=1).any(), (words, t)


def test_the_rule_for_fast_tops_is_compared_with_the_mean_precession(page):
    load(page, "A spinning top")
    assert "fast-top rule" not in read_numbers(page)
    click_exercise(page, WITHOUT_SPIN)
    assert "fast-top rule" not in read_numbers(page)
    click_exercise(page, WHY)
    top = kr.exact(scene_in_python(read_scene(page)))
    body, spin = top.scene.body, page.evaluate("kreisel.simulation.measureTop(0).spin")
    moment = body.moments[np.argmax(np.abs(body.principal_com))]
    rule = body.mass * top.scene.gravity * np.linalg.norm(body.com) / (moment * spin)
    value, note = read_numbers(page)["fast-top rule"]
    assert float(value) == pytest.approx(rule, rel=2e-3)
    percent = 100 * (rule / top.precession_rate - 1)
    side = "below" if percent < 0 else "above"
    assert note == f"Mgl / I₃ω₃: {abs(percent):.1f} % {side} the mean precession"


def test_arrows_can_be_hidden_and_a_hidden_tip_is_no_handle(page):
    load(page, "A spinning top")
    assert read_visible(page, "m", "w", "p", "torque") == [True, True, True, False]
    tip = page.evaluate("kreisel.locate('tip')")
    assert page.evaluate("([x, y]) => kreisel.view.pick(x, y)?.part", tip) == "tip"
    for name in ("momentum", "velocity", "vertical"):
        page.evaluate(f"kreisel.page.setValue('show.{name}', false)")
    assert read_visible(page, "m", "w", "p") == [False] * 3
    assert page.evaluate("([x, y]) => kreisel.view.pick(x, y)?.part", tip) != "tip"


def test_a_key_opens_the_next_exercise(page):
    load(page, "A spinning top")
    titles = page.evaluate("kreisel.presets[0].exercises.map((each) => each.title)")
    for title in [*titles, titles[0]]:
        page.keyboard.press("y")
        page.evaluate("kreisel.page.setRunning(false)")
        assert page.locator(".exercise[aria-pressed=true]").inner_text().strip() == title
