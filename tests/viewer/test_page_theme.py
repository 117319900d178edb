"""Tests of the colour schemes and printing of the viewer, and that an idle viewer draws nothing."""

import numpy as np
import pytest
from browser import (
    PAGE,
    UPRIGHT,
    WIDE,
    advance,
    list_changes,
    load,
    make_viewport,
    read_scene,
    read_states,
    reload,
    visit,
    wait_for,
)
from toolbox import open_context

GROUND = "kreisel.view.world.background.getHexString()"
TOP = "kreisel.view.tops[0]"
FRAMES = """new Promise((done) => {
    let left = 12;
    const next = () => (left-- ? requestAnimationFrame(next) : done());
    next();
})"""


@pytest.fixture
def themed_page(page):
    """Return the viewer, and restore the system's colour scheme after the test."""
    yield page
    page.emulate_media(color_scheme="light")
    page.get_by_label("Light or dark").select_option("")


def wait_until_drawn(page):
    """Wait until everything is drawn, and return the number of drawn frames."""
    wait_for(page, "!kreisel.view.isDirty && kreisel.charts.clock === kreisel.page.clock")
    return page.evaluate("kreisel.view.renderer.info.render.frame")


# Light and dark


def test_the_colour_scheme_follows_the_system_until_chosen(themed_page):
    light = themed_page.evaluate(GROUND)
    themed_page.emulate_media(color_scheme="dark")
    wait_for(themed_page, f"{GROUND} !== '{light}'")
    dark, before = themed_page.evaluate(GROUND), read_scene(themed_page)
    field = themed_page.get_by_label("Light or dark")
    field.select_option("light")
    assert themed_page.evaluate(GROUND) == light and read_scene(themed_page) == before
    field.select_option("dark")
    themed_page.emulate_media(color_scheme="light")
    assert themed_page.evaluate(GROUND) == dark
    field.select_option("")
    assert themed_page.evaluate(GROUND) == light


def test_the_chosen_colour_scheme_is_remembered(browser):
    page = visit(browser, color_scheme="light", reduced_motion="reduce")
    light, dark = page.evaluate(GROUND), None
    for choice in ("dark", "light", "dark", ""):
        page.locator("details", has_text="Looks").locator("summary").click()
        page.get_by_label("Light or dark").select_option(choice)
        dark = dark or page.evaluate(GROUND)
        reload(page)
        assert page.evaluate(GROUND) == (dark if choice == "dark" else light) and light != dark
    assert page.troubles == []
    page.context.close()


def test_the_colour_scheme_can_be_chosen_without_storage(browser):
    context = open_context(browser, color_scheme="light", reduced_motion="reduce")
    page = context.new_page()
    page.add_init_script("""Object.defineProperty(window, 'localStorage', {get() {
        throw new DOMException('The document is sandboxed', 'SecurityError');
    }})""")
    page.goto(PAGE.as_uri())
    wait_for(page, "!!window.kreisel")
    light = page.evaluate(GROUND)
    page.locator("details", has_text="Looks").locator("summary").click()
    page.get_by_label("Light or dark").select_option("dark")
    assert page.evaluate(GROUND) != light
    assert page.get_by_label("Light or dark").input_value() == "dark"
    context.close()


@pytest.mark.parametrize("light, ground", [("light", "ffffff"), ("dark", "000000")])
def test_projector_mode_has_the_highest_contrast(themed_page, light, ground):
    themed_page.get_by_label("Light or dark").select_option(light)
    before = themed_page.evaluate(GROUND)
    themed_page.get_by_role("button", name="Projector").click()
    assert themed_page.evaluate(GROUND) == ground != before
    themed_page.get_by_role("button", name="Projector").click()
    assert themed_page.evaluate(GROUND) == before


def test_projector_mode_has_larger_numbers_and_charts(page):
    size = "parseFloat(getComputedStyle(document.querySelector('#numbers dd')).fontSize)"
    panel = "document.getElementById('panel').clientWidth"
    before = page.evaluate(size)
    page.keyboard.press("b")
    narrow = page.evaluate(panel)
    assert page.evaluate(size) > 1.5 * before
    page.keyboard.press("l")
    assert page.evaluate(panel) > 1.3 * narrow
    page.keyboard.press("l")
    page.keyboard.press("b")
    assert page.evaluate(size) == before


def test_charts_in_projector_mode_have_large_text(page):
    page.set_viewport_size(make_viewport((2400, 1300)))
    load(page, "Compare four")
    advance(page, 30)
    page.keyboard.press("b")
    wait_until_drawn(page)
    size = "(place) => parseFloat(getComputedStyle(place).fontSize)"
    reads = page.locator(".read")
    assert reads.first.evaluate(size) >= 20
    fonts = (
        "kreisel.charts.plots.flatMap((plot) => plot.axes.map((axis) => parseFloat(axis.font[0])))"
    )
    assert min(page.evaluate(fonts)) >= 20 * page.evaluate("devicePixelRatio")
    assert reads.first.evaluate("(place) => place.scrollWidth <= place.clientWidth")
    page.keyboard.press("b")
    page.set_viewport_size(make_viewport(WIDE))


def test_printed_pages_are_light(themed_page):
    light = themed_page.evaluate(GROUND)
    themed_page.get_by_label("Light or dark").select_option("dark")
    dark = themed_page.evaluate(GROUND)
    themed_page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert themed_page.evaluate(GROUND) == light
    themed_page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert themed_page.evaluate(GROUND) == dark
    assert themed_page.get_by_label("Light or dark").input_value() == "dark"


# Idle pages


def test_an_idle_viewer_draws_nothing(page):
    advance(page, 3)
    before = wait_until_drawn(page)
    page.evaluate(FRAMES)
    assert page.evaluate("kreisel.view.renderer.info.render.frame") == before
    page.evaluate("kreisel.page.setValue('gravity', 2)")
    assert wait_until_drawn(page) > before


def test_highlighting_a_handle_draws_no_frames_when_idle(page):
    page.mouse.move(*page.evaluate("kreisel.locate('tip')"))
    before = wait_until_drawn(page)
    assert page.evaluate("kreisel.drags.highlight.visible")
    page.evaluate(FRAMES)
    assert page.evaluate("kreisel.view.renderer.info.render.frame") == before
    page.mouse.move(60, 120)


# Drop lines


def read_drops(page):
    """Return the lower ends and the heights of the vertical drop lines."""
    return np.array(
        page.evaluate(f"""{TOP}.drops.children.map(({{position, children}}) =>
            [...position.toArray(), children[0].scale.z])""")
    )


def test_drop_lines_go_from_tip_and_centre_of_mass_to_the_floor(page):
    assert not page.evaluate(f"{TOP}.drops.visible")
    before = read_scene(page)
    page.get_by_role("checkbox", name="Drop lines").check()
    assert list_changes(before, read_scene(page)) == {"show"} and page.evaluate(
        f"{TOP}.drops.visible"
    )
    advance(page, 2)
    state, floor = read_states(page)[0], page.evaluate("kreisel.view.floor.height")
    m = np.array(state[5:]) * page.evaluate("kreisel.view.momentumZoom")
    _, w, x, y, z = state[:5]
    apex = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    centre = apex * page.evaluate("kreisel.view.zoom")  # the lever is 1
    for drop, point in zip(read_drops(page), (m, centre), strict=True):
        assert drop == pytest.approx([point[0], point[1], floor, point[2] - floor], abs=1e-6)


def test_drop_lines_are_shown_while_a_tip_is_held(page):
    x, y = page.evaluate("kreisel.locate('tip')")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 20, y - 10)
    assert page.evaluate(f"{TOP}.drops.visible")
    page.mouse.up()
    assert not page.evaluate(f"{TOP}.drops.visible")


# Shapes


@pytest.mark.parametrize(
    "section, ratio", [("stiff", 0.5), ("thesis", 0.25), ("round", 1)], ids=str
)
def test_the_section_of_the_rod_can_be_chosen(page, section, ratio):
    load(page, "Goryachev-Chaplygin", show={"rod": True})
    page.get_by_label("Rod's section").select_option(section)
    advance(page, 3)
    ring = page.evaluate(f"Array.from({TOP}.rod.geometry.attributes.position.array.slice(0, 36))")
    radii = np.linalg.norm(np.reshape(ring, (12, 3)), axis=1)
    assert radii.min() / radii.max() == pytest.approx(ratio, rel=1e-5)


def test_top_or_box_changes_nothing_else(page):
    load(page, UPRIGHT, chart="spin")
    before, choice = read_scene(page), page.get_by_label("Show as")
    choice.select_option("top")
    assert list_changes(before, read_scene(page)) == {"show"} and choice.input_value() == "top"
    page.get_by_label("Shape").select_option("kowalewski")
    assert choice.input_value() == "box" and choice.locator("option[value=top]").is_disabled()
    assert read_scene(page)["chart"] == "spin" and read_scene(page)["integral"] == "kowalewski"
    page.get_by_label("Shape").select_option("lagrange")
    assert choice.input_value() == "top"
    assert read_scene(page)["chart"] == "spin" and read_scene(page)["integral"] == "energy"
