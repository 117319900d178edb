"""Tests that the page fits its window, and is legible and accessible on every screen."""

import gzip
import itertools
import re

import numpy as np
import pytest
from axe import SIZES, check_page
from browser import ALL, PAGE, PHONE, WIDE, make_viewport, wait_for
from toolbox import open_context

FRAMES = [(320, 568), (390, 780), (480, 320), (576, 480), (640, 480), (736, 480), (798, 600)]
FRAMES += [(768, 1024), (860, 480), (960, 480), (1120, 480), WIDE]
GROUND = "kreisel.view.world.background.getHexString()"
SCHEME = "document.documentElement.style.colorScheme"
NUMBERS = """[...document.querySelectorAll('#numbers dd')].map((part) => {
    const {left, right, bottom} = part.getBoundingClientRect();
    return [left, right, bottom];
})"""
# Lists the items of the toolbar that leave the frame, overlap a neighbour, or are clipped.
BROKEN = """(() => {
    const frame = document.querySelector('main').getBoundingClientRect();
    const parts = [document.getElementById('bar'), ...document.querySelectorAll('#bar > *')];
    const boxes = parts.map((part) => [part, part.getBoundingClientRect()]);
    const isOut = ([part, {left, right, top, bottom}]) => left < frame.left || top < frame.top
        || right > frame.right || bottom > frame.bottom || part.scrollWidth > part.clientWidth + 1;
    const meets = ([, a], [, b]) => a.left < b.right - 0.5 && b.left < a.right - 0.5
        && a.top < b.bottom - 0.5 && b.top < a.bottom - 0.5;
    const isOver = (one, i) => boxes.slice(1, i).some((other) => meets(one, other));
    return boxes.filter((one, i) => isOut(one) || (i > 1 && isOver(one, i)))
        .map(([part]) => part.id || part.ariaLabel);
})()"""
# Lists the labels of the picture that cover messages, numbers or buttons.
COVERING = """(() => {
    const boxOf = (element) => element.getBoundingClientRect();
    const texts = ['words', 'times', 'fold', 'hint'].map((id) => document.getElementById(id));
    const items = [...document.querySelectorAll('#numbers div, #bar')];
    const boxes = [...texts.filter((each) => each.textContent), ...items]
        .filter((each) => each.offsetParent).map(boxOf);
    return [...document.querySelectorAll('.labels span:not([hidden])')].filter((label) => {
        const {left, right, top, bottom} = boxOf(label);
        return boxes.some((box) => left < box.right - 1 && box.left < right - 1 &&
            top < box.bottom - 6 && box.top < bottom - 6);
    }).map((label) => label.textContent);
})()"""


# Sizes of windows


@pytest.mark.parametrize("is_folded", [False, True], ids=["panel", "alone"])
def test_the_toolbar_fits_every_frame(page, is_folded):
    page.load("A spinning top", speed=0.25, step=[0.1])
    page.mouse.move(0, 0)  # over no button
    page.evaluate("kreisel.page.jumpTo(12345.6)")
    wait_for(page, "kreisel.page.goal === null")
    page.evaluate(f"document.getElementById('panel').hidden = {str(is_folded).lower()}")
    for size in FRAMES:
        page.resize(size)
        assert page.evaluate(BROKEN) == [], size
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), size
        x, y = page.locate("tip")
        width, height = page.evaluate("kreisel.view.pixels")
        assert 0 < x < width and 0 < y < height, size


def test_the_list_of_keys_is_on_top_and_complete(page):
    page.find_button("Keys").click()
    dialog = page.locator("#keys")
    for size in (WIDE, PHONE, (1280, 640)):
        page.resize(size)
        box = dialog.bounding_box()
        assert box["x"] >= 0 and box["y"] >= 0
        assert box["x"] + box["width"] <= size[0] and box["y"] + box["height"] <= size[1]
        assert dialog.evaluate("(box) => box.scrollHeight <= box.clientHeight + 1"), size
        middle = "(box) => box.contains(document.elementFromPoint(innerWidth / 2, innerHeight / 2))"
        assert dialog.evaluate(middle), size


@pytest.mark.parametrize("preset", ["A spinning top", "Sleeping top", "Compare four"])
def test_tops_and_labels_keep_clear_of_texts_and_the_toolbar_of_a_phone(page, preset):
    page.resize(PHONE)
    page.keyboard.press("Home")
    page.load(preset)
    page.evaluate("kreisel.page.showMessage('A message that is so long that it needs two lines')")
    page.advance(6)
    wait_for(page, f"(kreisel.view.isDirty = true, kreisel.view.render(), {COVERING}.length === 0)")
    assert page.locator(".labels span:not([hidden])").count() > 0
    bar = page.locator("#hand").bounding_box()["y"]
    for i, corner in itertools.product(range(len(page.evaluate("kreisel.page.tops"))), range(8)):
        assert page.evaluate(f"kreisel.locate('corner', {i}, {corner})[1]") < bar
    exercises = page.locator(".exercises button:visible").all() if preset == ALL[0]["name"] else []
    for button in exercises:
        box = button.bounding_box()
        assert box["y"] + box["height"] <= PHONE[1] and box["x"] + box["width"] <= PHONE[0]


def test_texts_have_room_on_a_phone_and_arrows_end_below_the_numbers(page):
    page.resize(PHONE)
    for entry in ALL:
        page.load(entry["name"])
        for exercise in [None, *(entry["exercises"] if entry is ALL[0] else ())]:
            if exercise:
                page.find_button(exercise["title"]).click()
            assert page.evaluate(
                "((box) => box.scrollHeight <= box.clientHeight)(document.querySelector('#about'))"
            ), (entry["name"], exercise)
        if entry in ALL[:8]:
            page.load(entry["name"])
            x, y = page.locate("tip")
            for left, right, bottom in page.evaluate(NUMBERS):
                assert y > bottom or not left < x < right, entry["name"]


def test_nothing_moves_while_a_slider_is_held(page):
    slider = page.get_by_role("slider", name="Gravity")
    page.evaluate("kreisel.page.onChange()")
    place = slider.bounding_box()
    for t in (0, 40):
        page.advance(t)
        page.evaluate("kreisel.page.onChange(), kreisel.charts.update()")
        assert slider.bounding_box() == place
        page.evaluate("kreisel.page.setValue('gravity', 1.7)")
        assert slider.bounding_box() == place


def test_larger_charts_leave_three_tops_visible(page):
    page.load(methods=["bobenko_suris", "strang", "rk4"])
    page.keyboard.press("Home")
    width = "kreisel.view.canvas.clientWidth"
    condition = f"Math.abs({width} - document.querySelector('main').clientWidth) < 1"
    widths = []
    for key in ("l", "l"):
        page.keyboard.press(key)
        wait_for(page, condition)
        right = page.evaluate(width)
        widths.append(right)
        for i, corner in itertools.product(range(3), range(8)):
            assert 0 < page.evaluate(f"kreisel.locate('corner', {i}, {corner})[0]") < right
    assert widths[1] > 1.5 * widths[0]


def test_the_projector_has_large_text_and_a_visible_chart(page):
    size = "parseFloat(getComputedStyle(document.querySelector('#numbers dd')).fontSize)"
    before = page.evaluate(size)
    page.keyboard.press("b")
    assert page.evaluate(size) > 1.5 * before
    for part in ("#charts select", "#charts .uplot", "#charts .read"):
        box = page.locator(part).bounding_box()
        assert box["y"] >= 0 and box["y"] + box["height"] <= WIDE[1], part
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert not page.locator("#hint").is_visible()  # it would lie under the dials
    page.keyboard.press("b")
    assert page.evaluate(size) == before


def test_printed_pages_show_the_whole_picture_on_a_light_ground(page):
    light = page.evaluate(GROUND)
    page.get_by_label("Light or dark").select_option("dark")
    dark = page.evaluate(GROUND)
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate(GROUND) == light != dark
    page.emulate_media(media="print")
    page.resize((794, 1100))
    picture, frame = (page.locator(name).first.bounding_box() for name in ("canvas", "main"))
    panel = page.locator("#panel").bounding_box()
    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.evaluate(GROUND) == dark
    page.get_by_label("Light or dark").select_option("")
    assert picture["x"] >= frame["x"] and picture["width"] <= frame["width"] <= 794
    assert picture["height"] <= frame["height"] and frame["height"] > 300
    assert panel["y"] >= frame["y"] + frame["height"]


# Accessibility


@pytest.mark.parametrize("size, scheme", [*zip(SIZES, ("light", "dark", "light"), strict=True)])
def test_axe_finds_nothing_on_the_viewer(page, size, scheme):
    page.resize(size)
    page.evaluate(f"{SCHEME} = '{scheme}'")
    page.load("Compare four")
    page.advance(2)
    if size == PHONE:
        page.keyboard.press("b")  # for a projector, with the largest parts
    page.evaluate("kreisel.page.setValue('gravity', NaN)")  # shows why it is refused
    page.find_button("Share").click()
    found = check_page(page, "panel and share")
    page.find_button("Close").click()
    page.find_button("Keys").click()
    found += check_page(page, "keys")
    if size == PHONE:
        page.evaluate("document.querySelector('[aria-keyshortcuts=B]').click()")
    page.evaluate(f"{SCHEME} = ''; history.replaceState(null, '', '#')")
    assert found == []


def test_targets_have_room_for_fingers(page):
    small = page.evaluate("""[...document.querySelectorAll(
        'button, summary, select, input:not([type=checkbox]), .check')]
        .filter((each) => each.offsetParent && !each.closest('.uplot, dialog'))
        .map((each) => [each.textContent.trim(), each.getBoundingClientRect()])
        .filter(([, box]) => Math.min(box.width, box.height) < 24)""")
    assert small == []


# Colours


def compute_luminance(colour):
    """Return the relative luminance of a colour #rrggbb, as defined in WCAG 2.2."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("is_large", [False, True], ids=["plain", "projector"])
def test_tops_and_arrows_contrast_with_the_ground(page, scheme, is_large):
    page.load(methods=["strang", "rk4", "taylor"], step=[0.01, 0.1])
    page.get_by_label("Light or dark").select_option(scheme)
    if is_large:
        page.find_button("Projector").click()
    tops = page.evaluate("kreisel.page.tops.map(({colour}) => colour)")
    arrows = page.evaluate("['m', 'w', 'p'].map((name) => kreisel.view.tops[0][name].colour)")
    ground = compute_luminance(f"#{page.evaluate(GROUND)}")
    if is_large:
        page.find_button("Projector").click()
    page.get_by_label("Light or dark").select_option("")
    assert len(set(tops)) == 6
    for colour in [*tops, *arrows]:
        low, high = sorted((ground, compute_luminance(colour)))
        assert (high + 0.05) / (low + 0.05) >= 3, colour


def test_the_torque_differs_from_the_momentum_without_green_cones(page):
    # Blue as readers without them see it, of linear colours (Machado et al. 2009, severity 1).
    colours = page.evaluate("['m', 'torque'].map((name) => kreisel.view.tops[0][name].colour)")
    codes = np.array([[int(each[i : i + 2], 16) for i in (1, 3, 5)] for each in colours])
    m, torque = (codes / 255) ** 2.2 @ (-0.012, 0.043, 0.969)
    assert abs(m - torque) > 0.4


def test_texts_identify_tops_not_only_by_colour():
    texts = [
        each.get("about", each.get("text")) for top in ALL for each in [top, *top["exercises"]]
    ]
    for text in texts:
        for sentence in re.split(r"(?<=\.)\s", text.lower()):
            for colour in re.finditer(r"\b(red|yellow|violet|green)\b", sentence):
                context = sentence[max(0, colour.start() - 40) : colour.start() + 50]
                assert re.search(r"\b(left|right|dashed)\b", context), sentence


def test_the_colour_scheme_follows_the_system_until_chosen_and_is_remembered(window):
    page = window.open()
    light = page.evaluate(GROUND)
    page.emulate_media(color_scheme="dark")
    wait_for(page, f"{GROUND} !== '{light}'")
    dark, scene = page.evaluate(GROUND), page.read_scene()
    page.emulate_media(color_scheme="light")
    page.locator("details", has_text="Looks").locator("summary").click()
    choice = page.get_by_label("Light or dark")
    for scheme, expected in (("light", light), ("dark", dark)):
        choice.select_option(scheme)
        assert page.evaluate(GROUND) == expected and page.read_scene() == scene
    wait_for(page, "performance.now() > 1500")
    assert page.read_clock() == 0  # as motions wait if reduced motion is preferred
    page.reload()
    assert page.evaluate(GROUND) == dark != light
    assert page.troubles == []


def test_a_page_without_storage_can_be_used(browser):
    context = open_context(browser, viewport=make_viewport(WIDE), reduced_motion="reduce")
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
    context.close()


# The file


def test_the_page_is_one_small_file_with_its_licences():
    text = PAGE.read_text(encoding="utf-8")
    assert len(gzip.compress(text.encode(), 9)) <= 300_000
    for name in ("three.js authors", "Leon Sorokin", "musl as a whole", "Zig contributors"):
        assert name in text, name
    for name in ("Google LLC", "the kreisel authors"):
        assert name in text, name
