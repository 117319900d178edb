"""Tests of the scene thumbnails and of the Share dialog."""

import kreisel as kr
import numpy as np
import pytest
from browser import (
    PAGE,
    PRESETS,
    advance,
    load,
    read_message,
    read_scene,
    read_states,
    scene_in_python,
    wait_for,
)
from toolbox import open_context

STRIP = "[...document.querySelectorAll('#presets svg')]"
TRACE = '[stroke-width="1.6"]'  # the trace within a picture
TRACED = ["A spinning top", "Rising top", "Gyroscope"]


# The strip


@pytest.mark.parametrize("preset", TRACED)
def test_the_thumbnail_of_a_scene_is_its_trace(page, preset):
    load(page, preset)
    path = kr.exact(scene_in_python(read_scene(page)))(np.arange(240, -1, -1) * 0.05)
    data = page.evaluate(
        f"i => {STRIP}[i].querySelector({TRACE!r}).getAttribute('d')",
        PRESETS.index(preset),
    )
    points = np.array([point.split() for point in data[1:].split("L")], float)
    x, y, z = path.apex.T
    expected = np.transpose([x, -(z + y) / np.sqrt(2)])
    # older points are up to 2 % nearer the centre
    assert points == pytest.approx(expected, abs=0.03)


def test_every_scene_has_a_thumbnail_within_its_box(page):
    is_inside = page.evaluate(f"""{STRIP}.map((svg) => {{
        const {{x, y, width, height}} = svg.viewBox.baseVal;
        return [...svg.querySelectorAll({TRACE!r})].every((p) => {{
            const box = p.getBBox();
            return box.width + box.height > 0 && box.x >= x && box.y >= y &&
                box.x + box.width <= x + width && box.y + box.height <= y + height;
        }});
    }})""")
    assert is_inside == [True] * len(PRESETS)


DELAY = """{
    const wait = setTimeout;
    window.delayed = [];
    window.setTimeout = (act, time, ...rest) =>
        time === 0 ? delayed.push(() => act(...rest)) : wait(act, time, ...rest);
}"""


def test_drawing_thumbnails_changes_neither_motion_nor_trace(browser):
    page = open_context(browser, offline=True, reduced_motion="reduce").new_page()
    page.add_init_script(DELAY)
    page.goto(PAGE.as_uri())
    wait_for(page, "!!window.kreisel && delayed.length > 0")
    advance(page, 3)
    before, trace = read_states(page), page.evaluate("[...kreisel.view.getTrace(0)]")
    assert page.evaluate(f"{STRIP}[0].childElementCount") == 0
    page.evaluate("while (delayed.length) delayed.shift()()")
    wait_for(page, f"{STRIP}.every((picture) => picture.childElementCount > 0)")
    assert read_states(page) == before
    assert page.evaluate("[...kreisel.view.getTrace(0)]") == trace
    page.context.close()


def test_arrow_keys_choose_a_visible_scene(page):
    load(page, PRESETS[0])
    page.get_by_role("radio", name=PRESETS[0]).focus()
    for name in PRESETS[1:8]:
        page.keyboard.press("ArrowRight")
        assert read_scene(page)["name"] == name
    page.evaluate("kreisel.page.setRunning(false)")
    strip = page.locator("#presets").bounding_box()
    box = page.locator("#presets label:has(:checked)").bounding_box()
    assert strip["x"] <= box["x"]
    assert box["x"] + box["width"] <= strip["x"] + strip["width"]


# Share


@pytest.fixture
def page_with_share_dialog(page, full_picture):
    load(page, "A spinning top")
    page.keyboard.press("k")
    yield page
    page.keyboard.press("Escape")
    assert not page.locator("#share").is_visible()
    page.evaluate("history.replaceState(null, '', '#')")


NO_COPY = "The address of this page is now a link to this scene"
COPY = "Copied: a link to this scene, which is now the address of this page"
NO_ADDRESS = "A page in a notebook has no address: save “This page” instead"


@pytest.mark.parametrize(
    "environment, words",
    [
        ("navigator.clipboard.writeText = async () => {}", COPY),
        ("navigator.clipboard.writeText = () => Promise.reject(new Error('forbidden'))", NO_COPY),
        ("history.replaceState = () => { throw new Error('no address'); }", NO_ADDRESS),
    ],
)
def test_the_dialog_says_where_the_link_is(page, environment, words):
    page.evaluate(f"() => {{ {environment}; }}")
    page.locator("canvas").first.focus()
    page.keyboard.press("k")
    wait_for(page, "words => document.querySelector('#share p')?.textContent === words", words)
    assert read_message(page) == words
    page.keyboard.press("Escape")
    page.evaluate("delete navigator.clipboard.writeText, delete history.replaceState")
    page.evaluate("history.replaceState(null, '', '#')")


def test_the_square_picture_shows_the_whole_top(page_with_share_dialog):
    before = page_with_share_dialog.evaluate("[...kreisel.view.pixels, kreisel.view.canvas.width]")
    with page_with_share_dialog.expect_download() as download:
        page_with_share_dialog.get_by_role("button", name="Square picture").click()
    data = download.value.path().read_bytes()
    assert data.startswith(b"\x89PNG") and len(data) > 50_000
    assert [int.from_bytes(data[k : k + 4], "big") for k in (16, 20)] == [1080, 1080]
    after = page_with_share_dialog.evaluate("[...kreisel.view.pixels, kreisel.view.canvas.width]")
    assert after == before


def test_a_video_starts_and_ends(page_with_share_dialog):
    page_with_share_dialog.evaluate("Object.assign(kreisel.share, {seconds: 1, size: 120}).draw()")
    with page_with_share_dialog.expect_download() as download:
        state = "[kreisel.page.isRunning, document.querySelector('#share :disabled').textContent]"
        assert page_with_share_dialog.evaluate(f"(kreisel.share.saveFilm(), {state})") == [
            True,
            "Filming …",
        ]
    assert download.value.path().stat().st_size > 1000
    assert page_with_share_dialog.get_by_role("button", name="Film of").is_enabled()
    assert not page_with_share_dialog.evaluate("kreisel.view.recording")
    page_with_share_dialog.evaluate("kreisel.page.setRunning(false)")
    page_with_share_dialog.evaluate("Object.assign(kreisel.share, {seconds: 6, size: 1080})")


def test_videos_are_refused_with_a_message_if_unsupported(page_with_share_dialog):
    page_with_share_dialog.evaluate(
        "window.kept = kreisel.share.filmType, kreisel.share.filmType = undefined"
    )
    page_with_share_dialog.get_by_role("button", name="Film of").click()
    assert read_message(page_with_share_dialog) == "This browser cannot record films"
    page_with_share_dialog.evaluate("kreisel.share.filmType = kept")


# Before and after a change


@pytest.mark.parametrize("change", ["setValue('gravity', 8)", "setValue('tilt', 50)"])
def test_the_trace_before_a_change_stays_as_a_faint_line(page, change):
    load(page, "A spinning top")
    advance(page, 4)
    before = page.evaluate("Array.from(kreisel.view.getTrace(0))")
    page.evaluate(f"kreisel.page.{change}")
    advance(page, 2)
    line = page.evaluate("""(({before}) => [before.visible, before.material.uniforms.opacity.value,
        Array.from(kreisel.page.previousMotion.ways[0])])(kreisel.view.tops[0])""")
    assert line[0] and line[1] < 0.5 and line[2] == before
    page.evaluate("kreisel.page.setValue('chart', 'spin')")
    assert page.evaluate("kreisel.view.tops[0].before.visible")
    page.get_by_role("button", name="Undo").click()
    page.get_by_role("button", name="Undo").click()
    wait_for(page, "kreisel.page.goal === null")
    assert not page.evaluate("kreisel.view.tops[0].before?.visible")


def test_traces_and_charts_stay_during_a_drag(page):
    load(page, "A spinning top")
    advance(page, 4)
    x, y = page.evaluate("kreisel.locate('tip')")
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(1, 5):
        page.mouse.move(x - 10 * k, y + 3 * k)
        assert page.evaluate("kreisel.view.tops[0].before.visible")
    page.mouse.up()
    advance(page, 1)
    page.evaluate("kreisel.charts.update()")
    times = page.evaluate(
        "(({data, earlier}) => [data[0], earlier.times])(kreisel.charts.plots[0])"
    )
    assert times[0][0] == times[1][0] == 0 and times[1][-1] == pytest.approx(4)
    assert times[0][-1] == pytest.approx(1, abs=0.02)
