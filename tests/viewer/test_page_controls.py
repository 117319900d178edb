"""Tests of the controls and keyboard commands of the viewer.

A control must change only the value that it shows.
"""

import kreisel as kr
import numpy as np
import pytest
from browser import (
    PRESETS,
    TICKS,
    advance,
    list_changes,
    load,
    read_clock,
    read_message,
    read_scene,
    read_states,
    scene_in_python,
    wait_for,
    wait_until_time,
)


@pytest.mark.parametrize(
    "role, name, keys, key, expected",
    [
        ("slider", "Step", "ArrowRight", "step", lambda step: step == [0.011]),
        ("slider", "Speed", "End", "speed", lambda speed: speed >= 10),
        ("slider", "Gravity", "End", "gravity", lambda gravity: gravity == 10),
        ("slider", "Opacity", "End", "show", lambda show: show["opacity"] == 1),
        ("slider", "Thickness", "End", "show", lambda show: show["thickness"] == 4),
        ("slider", "Distance", "Home", "distance", lambda distance: distance == 0),
        ("checkbox", "Each with a second step", "Space", "step", lambda step: step == [0.01, 0.2]),
        ("checkbox", "Ghost", "Space", "ghost", lambda ghost: ghost is True),
        ("checkbox", "Trace of the apex", "Space", "show", lambda show: not show["trace"]),
        ("checkbox", "Elastic rod", "Space", "show", lambda show: show["rod"]),
        ("checkbox", "Principal axes", "Space", "show", lambda show: show["axes"]),
        ("checkbox", "Floor", "Space", "show", lambda show: not show["floor"]),
        ("checkbox", "2D view", "Space", "show", lambda show: show["flat"]),
    ],
)
def test_a_control_changes_only_its_value(page, role, name, keys, key, expected):
    before = read_scene(page)
    page.get_by_role(role, name=name).first.press(keys)
    assert list_changes(before, read_scene(page)) == {key} and expected(read_scene(page)[key])


@pytest.mark.parametrize(
    "name, value, key, expected",
    [
        ("Step, number", "0.037", "step", [0.037]),
        ("Momentum, first component", "2.5", "momentum", [2.5, -1.862, 1.46]),
        ("Momentum, second component", "2.5", "momentum", [0.172, 2.5, 1.46]),
        ("Momentum, vertical component", "2.5", "momentum", [0.172, -1.862, 2.5]),
        ("Stop at t", "7.004", "stop", 7),
    ],
)
def test_a_number_field_changes_only_its_value(page, name, value, key, expected):
    before = read_scene(page)
    field = page.get_by_label(name, exact=True)
    field.fill(value)
    field.press("Tab")
    assert list_changes(before, read_scene(page)) == {key} and read_scene(page)[key] == expected


def test_menus_change_methods_and_charts(page):
    page.get_by_label("Beside it").select_option("rk4")
    page.get_by_label("Method").first.select_option("strang")
    assert (
        read_scene(page)["methods"] == ["strang", "rk4"]
        and page.evaluate("kreisel.page.tops.length") == 2
    )
    page.evaluate("kreisel.advance(1); kreisel.charts.update()")
    page.get_by_label("Quantity in the chart").select_option("axial_momentum")
    assert read_scene(page)["chart"] == "axial_momentum"
    page.get_by_label("Shape").select_option("kowalewski")
    assert page.evaluate("kreisel.page.kind") == "kowalewski"
    assert page.get_by_label("Method").first.locator("option[value=bobenko_suris]").is_disabled()
    page.get_by_label("Shape").select_option("goryachev_chaplygin")
    assert (
        page.evaluate("kreisel.page.kind") == "goryachev_chaplygin"
        and read_scene(page)["momentum"][2] == 0
    )
    page.get_by_role("radio", name="Dzhanibekov effect").check()
    assert (
        read_scene(page)["name"] == "Dzhanibekov effect"
        and page.evaluate("kreisel.page.kind") == "euler"
    )


def test_jump_reaches_any_time_and_returns(page):
    load(page, "Compare four", methods=["bobenko_suris", "rk4"])
    field = page.get_by_label("Jump to t")
    for t in (3200, 7):
        field.fill(str(t))
        field.press("Tab")
        wait_until_time(page, t)
        first, *_, last = (
            kr.solve(
                scene_in_python(read_scene(page)), t, method, step=step, every=round(t / step)
            ).states[-1]
            for method, step in (("bobenko_suris", 0.01), ("rk4", 0.2))
        )
        states = read_states(page)
        assert (states[0], states[3]) == (first.tolist(), last.tolist())
    assert not page.evaluate("kreisel.page.isRunning")
    field.fill("-3")
    field.press("Tab")
    assert read_clock(page) == 7 * TICKS and "Cannot jump" in read_message(page)
    field.fill("1e8")
    field.press("Tab")
    page.get_by_role("button", name="Stop").click()
    assert read_clock(page) < 1e8 * TICKS and page.evaluate("kreisel.page.goal") is None


def test_view_options_change_the_picture(page):
    edge = "kreisel.view.tops[0].solid.children[2].scale.x"
    thin = page.evaluate(edge)
    page.get_by_role("slider", name="Thickness").press("End")
    assert page.evaluate(edge) == pytest.approx(4 * thin, rel=1e-6)
    width = page.evaluate("kreisel.view.tops[0].line.material.uniforms.width.value")
    assert width == pytest.approx(9.6, rel=1e-6)
    page.get_by_role("slider", name="Gravity").press("End")
    up = page.evaluate(
        "kreisel.view.tops[0].p.tip.getWorldPosition(kreisel.view.world.position.clone()).toArray()"
    )
    assert up == pytest.approx([0, 0, 24 / 14], abs=1e-6)
    page.get_by_role("slider", name="Gravity").press("Home")
    assert not page.evaluate("kreisel.view.tops[0].p.visible")


@pytest.mark.parametrize("flat", [False, True])
def test_the_next_side_button_shows_three_sides(page, flat):
    page.evaluate(
        f"kreisel.page.scene.show.flat = {str(flat).lower()};"
        "kreisel.view.showScene(kreisel.page.scene)"
    )
    directions = []
    for _ in range(3):
        page.get_by_role("button", name="View next side").click()
        camera, target = "kreisel.view.camera.position", "kreisel.view.orbit.target"
        directions.append(page.evaluate(f"{camera}.clone().sub({target}).normalize().toArray()"))
    assert (
        np.abs(
            np.sort(directions, axis=0) - np.sort([[0, -1, 0], [1, 0, 0], [0, 0, 1]], axis=0)
        ).max()
        < 2e-3
    )


def test_bad_numbers_change_nothing(page):
    before = read_scene(page)
    field = page.get_by_label("Step, number", exact=True)
    field.fill("-1")
    field.press("Tab")
    assert read_scene(page) == before and "Step cannot be" in read_message(page)


def test_buttons_and_keys_control_the_clock(page):
    page.get_by_role("button", name="Step", exact=True).click()
    assert read_clock(page) == 0.01 * TICKS
    page.locator("canvas").first.focus()
    page.keyboard.press(".")
    assert read_clock(page) == 0.02 * TICKS
    page.keyboard.press("r")
    assert read_clock(page) == 0
    page.keyboard.press("Space")
    wait_for(page, "kreisel.page.clock > 0")
    page.get_by_role("button", name="Stop").click()
    assert not page.evaluate("kreisel.page.isRunning")
    for key, option in {"t": "trace", "e": "rod", "p": "axes", "v": "flat"}.items():
        before = read_scene(page)["show"][option]
        page.keyboard.press("Escape")
        page.locator("canvas").first.focus()
        page.keyboard.press(key)
        assert read_scene(page)["show"][option] != before
    page.keyboard.press("3")
    assert read_scene(page)["name"] == PRESETS[2]
    page.keyboard.press("c")
    assert page.evaluate("kreisel.page.tops.length") == 4
    page.keyboard.press("h")
    assert not page.locator("#panel").is_visible()
    page.keyboard.press("h")
    page.keyboard.press("?")
    assert (
        page.locator("#keys").is_visible()
        and "Principal axes" in page.locator("#keys").inner_text()
    )
    page.keyboard.press("z")
    # the viewer behind the open list does not change
    assert page.evaluate("kreisel.page.tops.length") == 4
    page.keyboard.press("Escape")
    page.keyboard.press("z")
    assert read_scene(page)["name"] == PRESETS[2] and page.evaluate("kreisel.page.tops.length") == 1


def test_icon_buttons_have_a_tooltip(page):
    script = """(button) => {
        const {display, content} = getComputedStyle(button, '::after');
        return [display, content];
    }"""
    for button in page.locator("#bar button, .strip button").all():
        if button.is_disabled():
            continue
        name = button.get_attribute("aria-label")
        button.hover()
        display, words = button.evaluate(script)
        assert display == "block" and name in words
        page.mouse.move(300, 300)
        assert button.evaluate(script)[0] == "none"


def test_the_strip_of_scenes_scrolls_by_a_button(page):
    place = "document.getElementById('presets').scrollLeft"
    page.evaluate(f"{place} = 0")
    places = [0]
    for _ in range(40):
        page.get_by_role("button", name="More scenes").click()
        places.append(page.evaluate(place))
        if places[-1] == 0:
            break
    assert places[-1] == 0 and len(places) > 4
    assert all(np.diff(places[:-1]) > 0)


@pytest.mark.parametrize("preset", ["Fast precession", "Kowalewski", "Sleeping top"])
def test_compare_four_keeps_the_top_the_start_and_the_time(page, preset):
    load(page, preset)
    advance(page, 3)
    before = read_scene(page)
    page.get_by_role("button", name="Compare four").click()
    wait_until_time(page, 3)
    after = read_scene(page)
    for key in ("body", "shape", "attitude", "momentum", "gravity", "taken", "speed", "show"):
        assert after[key] == before[key], key
    first = "strang" if preset == "Kowalewski" else "bobenko_suris"
    assert after["methods"] == [first, "extrap"] and after["step"] == [0.01, 0.2]
    assert page.evaluate("kreisel.page.tops.length") == 4
    page.evaluate("kreisel.page.rewind()")
    assert len({tuple(state) for state in read_states(page)}) == 1  # all tops have the same start


def test_the_clock_stops_at_the_stop_time(page):
    page.evaluate(
        "kreisel.page.editScene((s) => (s.stop = 0.5));"
        "kreisel.page.setRunning(true); kreisel.advance(3)"
    )
    assert read_clock(page) == 0.5 * TICKS and not page.evaluate("kreisel.page.isRunning")


def test_checkboxes_hide_tops_in_charts_and_table(page):
    load(page, "Compare four")
    advance(page, 2)
    page.evaluate("kreisel.charts.update()")
    page.get_by_role("checkbox", name="extrap 0.2").uncheck()
    assert page.evaluate("kreisel.charts.plots[0].series.map((s) => s.show)") == [
        True,
        True,
        True,
        True,
        False,
    ]
    page.get_by_role("checkbox", name="extrap 0.2").check()
    rows = page.locator("#integrals .values").all_inner_texts()
    assert len(rows) == 4 and all("\t1.4600" in row for row in rows)


def test_controls_have_accessible_names(page):
    nameless = page.evaluate("""[
        ...document.querySelectorAll('button, input, select, textarea, canvas')]
        .filter((e) => !e.closest('.uplot'))
        .filter((e) => !e.getAttribute('aria-label') && !e.getAttribute('aria-labelledby'))
        .filter((e) => !e.labels?.[0]?.textContent.trim())
        .filter((e) => e.tagName !== 'BUTTON' || !e.textContent.trim())
        .map((e) => e.outerHTML)""")
    assert nameless == []
