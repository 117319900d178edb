"""Tests of links that share a scene, and of failures in the viewer."""

import base64
import json
import shutil
from urllib.parse import quote

import kreisel as kr
import pytest
from browser import (
    PAGE,
    SMALL,
    TICKS,
    advance,
    count_colours,
    load,
    open_viewer,
    read_clock,
    read_message,
    read_scene,
    read_states,
    visit,
    wait_for,
)
from toolbox import open_context

BODY = {"half": [1, 1, 1], "pivot": [0, 0, -1], "density": 1}
TRACK = {"name": "rk4", "step": 0.1, "states": ""}
WRONG = {
    "version": ["1", None],
    "name": [7, None, ["a"]],
    "about": [7, None, {}],
    "shape": ["round", 1, "toString"],
    "attitude": [[1, 0, 0], "1000", [1, 0, 0, None], {}],
    "momentum": ["1", [1, 2], [1, 2, "3"], None],
    "second": [5, [1, 2], "none"],
    "gravity": ["1", None, True, [1]],
    "methods": ["rk4", [], [1], ["rk4"] * 4, None],
    "step": [0.01, [], [0], [-1], ["0.01"], [0.1, 0.2, 0.3]],
    "tol": ["1", 0, -1, None],
    "ghost": ["yes", 1, None],
    "distance": ["4", None],
    "stop": ["x", 0, -3, True],
    "speed": [-1, "fast"],
    "chart": ["k", None, 3],
    "tracks": [
        7,
        [7],
        ["rk4"],
        [{**TRACK, "name": 7}],
        [{**TRACK, "step": "0.1"}],
        [{**TRACK, "states": None}],
    ],
    "body": [
        "<b>",
        None,
        [],
        {},
        {**BODY, "half": [1, 1]},
        {**BODY, "pivot": "0"},
        {"mass": 1, "inertia": [1, 1, 1]},
    ],
}
IMPOSSIBLE = [
    {"attitude": [0, 0, 0, 0]},
    {"body": {**BODY, "half": [-1, 1, 1]}},
    {"body": {**BODY, "density": 0}},
    {"step": [1e300]},
    {"methods": ["none"]},
    {"methods": ["constructor"]},
    {"tracks": [TRACK]},
    {"tracks": [{**TRACK, "states": "!"}]},
    {"tracks": [{**TRACK, "states": "AAAA"}]},
]
EVIL = '</script><b id="evil">bold</b><img src="x" onerror="kreisel.evil = 1">'


def follow_link(page, scene):
    """Follow a link in the open page, and return the displayed message."""
    page.evaluate(
        """(hash) => new Promise((done) => {
        kreisel.page.showMessage('');
        history.replaceState(null, '', '#');
        addEventListener('hashchange', () => setTimeout(done), {once: true});
        location.hash = hash;
    })""",
        "#scene=" + quote(json.dumps(scene)),
    )
    return read_message(page)


def make_track(name):
    path = kr.solve(kr.scenes.thesis, 1, "rk4", step=0.1, every=1)
    states = base64.b64encode(path.states.astype("<f8").tobytes()).decode()
    return {"name": name, "step": 0.1, "states": states}


# Links


def test_a_link_loads_in_the_open_viewer(page):
    advance(page, 3)
    scene = {
        "name": "Mine",
        "about": "To look at.",
        "momentum": [1, 2, 3],
        "methods": ["strang", "rk4"],
        "step": [0.02],
    }
    assert follow_link(page, scene) == ""
    assert {key: read_scene(page)[key] for key in scene} == scene
    assert page.evaluate("[kreisel.page.clock, kreisel.page.tops.length]") == [0, 2]
    assert page.get_by_text("To look at.").is_visible()
    advance(page, 2)
    expected = kr.solve(
        kr.Scene(kr.Body.cuboid((0.8, 0.8, 1), (0, 0, -1)), (1, 2, 3), gravity=1),
        2,
        "rk4",
        step=0.02,
        every=100,
    )
    assert read_states(page)[1] == expected.states[-1].tolist()


@pytest.mark.parametrize(
    "chart, shape, chart_name",
    [
        ("vertical", "lagrange", "vertical_momentum"),
        ("axial", "lagrange", "axial_momentum"),
        ("fourth", "lagrange", "energy"),
        ("fourth", "kowalewski", "kowalewski"),
        ("fourth", "goryachev_chaplygin", "goryachev_chaplygin"),
    ],
)
def test_links_accept_eps_and_short_names_of_charts(page, chart, shape, chart_name):
    page.get_by_label("Shape").select_option(shape)
    body = read_scene(page)["body"]
    track = {"eps" if key == "step" else key: value for key, value in make_track("rk4").items()}
    scene = {"body": body, "methods": ["strang"], "eps": [0.02, 0.1], "chart": chart}
    assert follow_link(page, {**scene, "tracks": [track]}) == ""
    page_scene = read_scene(page)
    assert page_scene["step"] == [0.02, 0.1] and page_scene["tracks"][0]["step"] == 0.1
    assert page_scene["chart"] == chart_name and "eps" not in page_scene


@pytest.mark.parametrize("key", WRONG)
def test_wrong_types_are_refused_with_a_message(page, key):
    before = read_scene(page)
    for value in WRONG[key]:
        assert f"{key} cannot be" in follow_link(page, {key: value}), value
        assert read_scene(page) == before


def test_impossible_scenes_are_refused_with_a_message(page):
    before = read_scene(page)
    for scene in IMPOSSIBLE:
        assert "cannot be" in follow_link(page, scene), scene
        assert read_scene(page) == before
    advance(page, 1)
    assert read_states(page)[0][0] == pytest.approx(1)


def test_html_in_a_link_stays_text(page):
    scene = {"name": EVIL, "about": EVIL, "tracks": [make_track(EVIL)]}
    assert follow_link(page, scene) == "" and read_scene(page)["name"] == EVIL
    advance(page, 0.7)
    assert page.get_by_role("checkbox", name=f"{EVIL} 0.1").is_checked()
    assert page.locator("#about").inner_text() == EVIL
    follow_link(page, {"methods": [EVIL]})
    assert page.locator("#evil, img").count() == 0 and page.evaluate("kreisel.evil === undefined")


def test_html_in_a_saved_page_stays_text(page, window, tmp_path):
    follow_link(page, {"name": EVIL, "about": EVIL})
    with page.expect_download() as download:
        page.get_by_role("button", name="This page").click()
    (tmp_path / "a.html").write_bytes(download.value.path().read_bytes())
    other = open_viewer(window, tmp_path / "a.html")
    assert (
        read_scene(other)["name"] == EVIL
        and other.locator("#evil, img").count() == 0
        and other.troubles == []
    )


# Films and pictures


@pytest.mark.usefixtures("full_picture")
def test_a_video_of_a_paused_motion_is_not_empty(page):
    if page.evaluate("typeof MediaRecorder === 'undefined'"):
        pytest.skip("needs MediaRecorder")
    page.get_by_role("button", name="Video", exact=True).click()
    for _ in range(5):
        page.evaluate("new Promise(requestAnimationFrame)")
    with page.expect_download() as download:
        page.get_by_role("button", name="End video").click()
    assert download.value.path().stat().st_size > 1000
    assert page.get_by_role("button", name="Video", exact=True).is_visible()


def test_the_picture_is_restored_with_the_graphics(browser):
    page = visit(browser, size=SMALL, reduced_motion="reduce")
    page.evaluate("sketches = false; kreisel.view.isDirty = true")
    wait_for(page, "!kreisel.view.isDirty")
    before = count_colours(page)
    page.evaluate("""new Promise((done) => {
        const lose = kreisel.view.renderer.getContext().getExtension('WEBGL_lose_context');
        const on = (type, act) => kreisel.view.canvas.addEventListener(type, act, {once: true});
        on('webglcontextlost', () => setTimeout(() => lose.restoreContext()));
        on('webglcontextrestored', () => requestAnimationFrame(done));
        lose.loseContext();
    })""")
    page.evaluate("new Promise(requestAnimationFrame)")
    assert before > 200 and count_colours(page) > 200
    page.context.close()


# What may fail or be missing


def test_a_failing_method_is_named_and_the_other_continues(page):
    load(page, methods=["veselov2", "strang"], step=[1], gravity=10)
    page.evaluate("kreisel.page.setRunning(true)")
    advance(page, 20)
    assert read_message(page).startswith("veselov2 1 stopped: ") and "converge" in read_message(
        page
    )
    assert [t for t, *_ in read_states(page)] == [1, 20]
    assert page.get_by_role("button", name="Stop").is_visible()


def test_the_viewer_stops_when_all_methods_have_failed(page):
    load(page, methods=["veselov2", "rk4"], step=[1], gravity=10)
    page.evaluate("kreisel.page.setRunning(true)")
    advance(page, 20)
    assert (
        " stopped: " in read_message(page)
        and page.get_by_role("button", name="Start", exact=True).is_visible()
    )
    assert read_clock(page) == 2 * TICKS


def test_without_graphics_a_message_is_shown(browser):
    flags = ["--no-sandbox", "--disable-gpu", "--disable-software-rasterizer"]
    plain = browser.browser_type.launch(executable_path=shutil.which("chromium"), args=flags)
    page = open_context(plain).new_page()
    page.goto(PAGE.as_uri())
    wait_for(page, "document.getElementById('words').textContent.includes('WebGL')")
    assert (
        "The page has stopped on an error" in read_message(page)
        and page.locator("#words").is_visible()
    )
    plain.close()


def test_browser_notes_are_not_errors(page):
    note = "ResizeObserver loop completed with undelivered notifications."
    page.evaluate("note => dispatchEvent(new ErrorEvent('error', { message: note }))", note)
    assert "The page has stopped on an error" not in read_message(page)


def test_without_javascript_a_message_is_shown(browser):
    context = open_context(browser, java_script_enabled=False)
    page = context.new_page()
    page.goto(PAGE.as_uri())
    message = page.locator("noscript")
    assert message.inner_text() == "This page needs JavaScript." and message.is_visible()
    context.close()


def share(page):
    """Click the Share button, and return the fragment of the URL that encodes the scene."""
    page.get_by_role("button", name="Share").click()
    return page.evaluate(
        """() => {
        const link = location.hash;
        history.replaceState(null, '', '#');
        kreisel.page.showMessage('');
        return link;
    }"""
    )


@pytest.mark.parametrize(
    "preset, changes",
    [
        ("A spinning top", {}),
        ("Steady precession", {"gravity": 5}),
        ("Sleeping top", {"step": [0.02]}),
        ("Elastic rod", {"show": {"torque": True}}),
        ("A spinning top", {"name": "My own top", "momentum": [0.1, 0.2, 3]}),
    ],
)
def test_a_link_contains_only_differences_from_a_preset(window, page, preset, changes):
    load(page, preset)
    scene = read_scene(page)
    page.evaluate(
        "(given) => kreisel.page.load(given)",
        {**scene, **changes, "show": {**scene["show"], **changes.get("show", {})}},
    )
    scene, link = read_scene(page), share(page)
    assert len(link) < (300 if scene["name"] == preset else 1000)
    other = open_viewer(window, fragment=link)
    assert read_scene(other) == scene and other.troubles == []


def test_a_link_to_an_exercise_is_short(window, page):
    load(page, "A spinning top")
    page.get_by_role("button", name="Why does it not fall?").click()
    page.evaluate("kreisel.page.setRunning(false)")
    scene, link = read_scene(page), share(page)
    assert len(link) < 150
    other = open_viewer(window, fragment=link)
    assert read_scene(other) == scene


@pytest.mark.parametrize(
    "scene, words",
    [
        ({"preset": "Nothing"}, "there is no scene “Nothing”"),
        ({"preset": "A spinning top", "exercise": "x"}, "has no exercise “x”"),
        ({"preset": "A spinning top", "gravity": "x"}, "gravity cannot be"),
    ],
)
def test_a_link_with_an_unknown_name_is_refused(page, scene, words):
    assert words in follow_link(page, scene)
