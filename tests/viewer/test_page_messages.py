"""Tests that invalid input is refused with a message and changes nothing."""

import pytest
from browser import PAGE, PRESETS, encode_link, wait_for
from toolbox import launch_chromium, open_context

BODY = {"half": [1, 1, 1], "pivot": [0, 0, -1], "density": 1}
TRACK = {"name": "rk4", "step": 0.1, "states": ""}
# Values of fields, each with a word of the message.
FIELDS = [
    *(("Step, number", value, "from 0.000001") for value in ("0", "-1", "", "1e300", "1e-7")),
    *(("Second step, number", value, "from 0.000001") for value in ("0", "", "1e300")),
    *((f"{name}, number", "", "empty") for name in ("Gravity", "Distance", "Thickness")),
    ("Gravity, number", "1e13", "1000000000000"),
    ("Tolerance of adaptive methods", "-1", "from 1e-15 to 1"),
    ("Half edges, N", "-2", "more than 0"),
    ("Mass, number", "0", "more than 0"),
    *(("Tilt [°], number", value, word) for value, word in (("", "empty"), ("400", "0 to 180"))),
    ("Momentum, first component", "", "empty"),
    ("Jump to t", "-1", "from 0"),
    ("Jump to t", "1e300", "from 0"),
]
# Wrong values of parts of a scene.
WRONG = {
    "version": ["1", None, 99],
    "name": [7, None, ["a"]],
    "about": [7, {}],
    "shape": ["round", 1, "toString"],
    "attitude": [[1, 0, 0], "1000", [1, 0, 0, None], {}],
    "momentum": ["1", [1, 2], [1, 2, "3"], None],
    "second": [5, [1, 2], "none"],
    "gravity": ["1", None, True, [1]],
    "damping": [-1, "x", None],
    "friction": [-1, "x", [1, 2]],
    "rotor": [-1, "x", [1, 2]],
    "turning": [-1, None, [1, 2]],
    "methods": ["rk4", [], [1], ["rk4"] * 4, None],
    "step": [7, [], [0], [-1], ["0.01"], [0.1, 0.2, 0.3]],
    "tol": ["1", 0, -1, None],
    "ghost": ["yes", 1, None],
    "distance": ["4", None],
    "stop": ["x", 0, -3, True],
    "speed": [-1, "fast"],
    "chart": ["k", None, 3],
    "show": [{"opacity": "x"}, {"solid": "ball"}, {"trace": 1}],
    "start": [{"tilt": 200, "spin": 1}, {"spin": 1}, {"tilt": 1, "spin": 2, "nod": 3}],
    "tracks": [7, [7], ["rk4"], [{**TRACK, "name": 7}], [{**TRACK, "states": None}]],
    "body": ["<b>", None, [], {}, {**BODY, "half": [1, 1]}, {**BODY, "pivot": "0"}],
}
# Scenes and links that cannot be shown, each with a word of the message.
IMPOSSIBLE = [
    ({"attitude": [0, 0, 0, 0]}, "attitude"),
    ({"body": {**BODY, "half": [-1, 1, 1]}}, ""),
    ({"body": {**BODY, "density": 0}}, ""),
    ({"body": {"mass": 1, "inertia": [1, 1, 1]}}, "body"),
    ({"step": [1e300]}, "step"),
    ({"methods": ["none"]}, "none"),
    ({"methods": ["constructor"]}, "constructor"),
    ({"tracks": [TRACK]}, ""),
    ({"tracks": [{**TRACK, "states": "!"}]}, "base64"),
    ({"tracks": [{**TRACK, "states": "AAAA"}]}, ""),
    ({"start": {"tilt": 30, "spin": 1, "precession": "slow"}}, "no steady precession"),
    ({"start": {"tilt": 50, "spin": 30, "precession": "slow"}, "turning": [1, 0, 0]}, "precession"),
    ({"preset": "Nothing"}, "Nothing"),
    ({"preset": "A spinning top", "exercise": "x"}, "x"),
    ({"preset": "A spinning top", "gravity": "x"}, "gravity"),
]
GARBAGE = ["garbage", "[1]", "{}x", "7"]


def read_motion(page):
    return page.evaluate(
        "[kreisel.page.scene, kreisel.page.clock, kreisel.readStates(), kreisel.page.undoStack]"
    )


def test_a_refused_number_changes_nothing_and_the_reason_stands_beside_it(page):
    page.get_by_role("checkbox", name="Each with a second step").check()
    page.evaluate("kreisel.page.undoStack = []; kreisel.advance(3)")
    before, reason = read_motion(page), page.locator(".wrong:visible")
    for name, value, word in FIELDS:
        page.evaluate("kreisel.page.showMessage('')")
        field = page.get_by_label(name, exact=True)
        text = field.input_value()
        page.fill_field(name, value)
        assert read_motion(page) == before, (name, value)
        assert word in page.read_message(), (name, value)
        if name == "Jump to t":
            continue
        assert field.input_value() == text
        assert reason.inner_text() == page.read_message()
        box, field_box = reason.bounding_box(), field.bounding_box()
        assert abs(box["y"] - field_box["y"] - field_box["height"]) < 6
        field.focus()
        assert reason.count() == 0


def test_a_message_disappears_with_its_cause(page):
    page.fill_field("Jump to t", "-1")
    assert page.read_message()
    page.fill_field("Jump to t", "1.5")
    wait_for(page, "kreisel.page.clock === 1.5e6")
    assert page.read_message() == ""


def test_wrong_values_in_links_are_refused_with_a_message(page):
    before = page.read_scene()
    cases = [(key, value) for key, values in WRONG.items() for value in values]
    results = page.follow_links([encode_link(dict([case])) for case in cases])
    for (key, value), (message, scene) in zip(cases, results, strict=True):
        assert f"{key} cannot be" in message and scene == before, (key, value)


def test_impossible_scenes_are_refused_with_a_message(page):
    before = page.read_scene()
    cases = [(encode_link(scene), word) for scene, word in IMPOSSIBLE]
    cases += [(f"#scene={garbage}", "") for garbage in GARBAGE]
    cases += [(encode_link(IMPOSSIBLE[0][0])[:-9], "damaged or cut off")]
    results = page.follow_links([link for link, _ in cases])
    for (link, word), (message, scene) in zip(cases, results, strict=True):
        assert "cannot be" in message and word in message and scene == before, link


@pytest.mark.parametrize("link", ["garbage", '{"version": 99}', '{"tracks": [7]}'])
def test_a_viewer_opened_by_an_invalid_link_shows_the_first_preset_and_a_message(window, link):
    page = window.open(fragment=f"#scene={link}")
    assert "cannot be shown" in page.read_message()
    assert page.read_scene()["name"] == PRESETS[0] and page.troubles == []


def test_without_javascript_or_graphics_the_page_says_so(browser):
    context = open_context(browser, java_script_enabled=False)
    page = context.new_page()
    page.goto(PAGE.as_uri())
    assert page.locator("noscript").is_visible()
    context.close()
    plain = launch_chromium("--disable-gpu", "--disable-software-rasterizer")
    page = open_context(plain).new_page()
    page.goto(PAGE.as_uri())
    wait_for(page, "document.getElementById('words').textContent.includes('WebGL')")
    assert page.locator("#words").is_visible()
    plain.close()


def test_notes_of_the_browser_are_not_errors(page):
    note = "ResizeObserver loop completed with undelivered notifications."
    page.evaluate("note => dispatchEvent(new ErrorEvent('error', { message: note }))", note)
    assert page.read_message() == ""
