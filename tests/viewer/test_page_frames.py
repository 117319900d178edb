"""Tests that the viewer adapts to window sizes, phones, notebooks and embedded frames."""

import pytest
from browser import PAGE, PHONE, WIDE, advance, load, make_viewport, visit, wait_for
from toolbox import open_context

FRAMES = [*((width, 480) for width in range(320, 1281, 32)), (798, 600), (768, 1024), (780, 390)]
SITE = (736, 480)  # size of the frame in which the site shows the viewer
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
PACE = """(() => {
    const list = document.querySelector('#bar select'), style = getComputedStyle(list);
    const pen = document.createElement('canvas').getContext('2d');
    pen.font = style.font;
    const arrow = 20;
    const room = list.clientWidth - parseFloat(style.paddingLeft) - arrow;
    return room - pen.measureText('\u00d70.25').width;
})()"""
DIALOG = """(() => {
    const dialog = document.getElementById('keys');
    const {left, top, width, height} = dialog.getBoundingClientRect();
    const covered = [];
    for (let x = 4; x < width - 4; x += 17)
        for (let y = 4; y < height - 4; y += 17)
            if (!dialog.contains(document.elementFromPoint(left + x, top + y)))
                covered.push([x, y]);
    const {scrollTop, scrollHeight, clientHeight} = dialog;
    return {box: [left, top, left + width, top + height], covered, scrollTop,
        hidden: scrollHeight - clientHeight};
})()"""


@pytest.fixture
def resizable(page):
    yield page
    page.set_viewport_size(make_viewport(WIDE))
    page.evaluate("document.getElementById('keys').close()")


def resize(page, size):
    page.set_viewport_size(make_viewport(size))
    width = "document.querySelector('main').getBoundingClientRect().width"
    wait_for(page, f"Math.abs(kreisel.view.pixels[0] - {width}) < 1")


@pytest.mark.parametrize("is_folded", [False, True], ids=["panel", "alone"])
def test_the_toolbar_fits_every_frame(resizable, is_folded):
    load(resizable, "A spinning top", speed=0.25, step=[0.1])
    resizable.evaluate("kreisel.page.jumpTo(12345.6)")
    wait_for(resizable, "kreisel.page.goal === null")
    resizable.evaluate(f"document.getElementById('panel').hidden = {str(is_folded).lower()}")
    broken = {}
    for size in FRAMES:
        resize(resizable, size)
        broken[size] = resizable.evaluate(BROKEN)
        assert resizable.evaluate(PACE) >= 0, size
    assert not any(broken.values()), broken


def test_the_toolbar_fits_a_frame_of_the_site(browser, tmp_path):
    width, height = SITE
    style = f"width:{width}px;height:{height}px;border:0"
    file = tmp_path / "site.html"
    file.write_text(f'<iframe style="{style}" src="{PAGE.as_uri()}"></iframe>')
    page = open_context(browser, offline=True).new_page()
    page.goto(file.as_uri())
    frame = page.frames[1]
    wait_for(frame, "!!window.kreisel")
    assert frame.evaluate(BROKEN) == []
    assert not frame.locator("#hint").is_visible()
    for number in frame.locator("#numbers div").all():
        assert number.bounding_box()["y"] < 60
    page.context.close()


@pytest.mark.parametrize("size", [WIDE, PHONE, (1280, 640)], ids=str)
def test_the_list_of_keys_is_on_top_and_complete(resizable, size):
    resize(resizable, size)
    resizable.locator("#bar [aria-label=Keys]").click()
    layout = resizable.evaluate(DIALOG)
    left, top, right, bottom = layout["box"]
    assert left >= 0 and top >= 0 and right <= size[0] and bottom <= size[1]
    assert layout["covered"] == [] and layout["scrollTop"] == 0 and layout["hidden"] <= 1


def test_keys_are_ignored_while_their_list_is_open(resizable):
    advance(resizable, 2)
    resizable.locator("canvas").first.focus()
    resizable.keyboard.press("?")
    resizable.keyboard.press("r")
    assert resizable.evaluate("kreisel.page.clock") > 0
    resizable.keyboard.press("?")
    assert not resizable.locator("#keys").is_visible()
    resizable.keyboard.press("r")
    assert resizable.evaluate("kreisel.page.clock") == 0


def test_the_table_of_integrals_is_not_clipped(page):
    page.evaluate("kreisel.page.setValue('methods.1', 'strang')")
    advance(page, 20)
    page.evaluate("kreisel.page.onChange()")
    assert page.get_by_role("columnheader", name="H_ε").is_visible()
    right = "document.getElementById('panel').getBoundingClientRect().right"
    cells = "[...document.querySelectorAll('#integrals th, #integrals td')]"
    ends = page.evaluate(f"{cells}.map((cell) => cell.getBoundingClientRect().right - {right})")
    assert max(ends) <= 0


PHONES = [(390, 780), (360, 640), (416, 480)]
# Returns the lowest pixel of all tops, the lowest of all labels, and the highest of the footer.
LOWEST = """(() => {
    const {view} = kreisel, {top} = document.querySelector('main').getBoundingClientRect();
    view.isDirty = true;
    view.render();
    view.world.updateMatrixWorld(true);
    const corner = ({min, max}, i) => view.camera.position.clone().set(
        i & 1 ? min.x : max.x, i & 2 ? min.y : max.y, i & 4 ? min.z : max.z);
    const bodies = view.tops.flatMap(({solid}) => solid.handles).filter((part) => part.geometry);
    const ends = bodies.flatMap((part) => {
        part.geometry.computeBoundingBox();
        return Array.from({length: 8}, (_, i) => view.project(
            part.localToWorld(corner(part.geometry.boundingBox, i)))[1]);
    });
    const labels = [...document.querySelectorAll('.labels span')].filter((one) => !one.hidden)
        .map((one) => one.getBoundingClientRect().bottom - top);
    const shown = ['hint', 'bar'].map((id) => document.getElementById(id))
        .filter((one) => one.offsetParent);
    return [Math.max(...ends), Math.max(...labels), shown[0].getBoundingClientRect().top - top];
})()"""


@pytest.mark.parametrize("size", PHONES, ids=str)
@pytest.mark.parametrize("preset", ["A spinning top", "Sleeping top", "Compare four"])
def test_the_footer_covers_neither_tops_nor_their_names(resizable, size, preset):
    resize(resizable, size)
    resizable.keyboard.press("Home")
    load(resizable, preset)
    advance(resizable, 6)
    wait_for(resizable, "kreisel.view.covered > 40")
    body, label, footer = resizable.evaluate(LOWEST)
    assert body < footer and label < footer


@pytest.mark.parametrize("is_large", [False, True], ids=["plain", "projector"])
def test_scrollable_parts_can_be_scrolled_by_keyboard(resizable, is_large):
    resize(resizable, PHONE)
    load(resizable, "Compare four")
    if is_large:
        resizable.keyboard.press("b")
    advance(resizable, 6)
    resizable.evaluate("kreisel.page.onChange(), kreisel.charts.update()")
    parts = "[...document.querySelectorAll('#panel *')]"
    out_of_reach = resizable.evaluate(
        f"{parts}.filter"
        + """((one) => {
        const {overflowX, overflowY} = getComputedStyle(one), scrolls = /auto|scroll/;
        const isWide = scrolls.test(overflowX) && one.scrollWidth > one.clientWidth;
        const isHigh = scrolls.test(overflowY) && one.scrollHeight > one.clientHeight;
        return (isWide || isHigh) && one.tabIndex < 0 && !one.querySelector('input');
    }).map((one) => one.id || one.className)"""
    )
    reachable = resizable.evaluate("document.querySelectorAll('p[tabindex]').length")
    if is_large:
        resizable.keyboard.press("b")
    assert out_of_reach == [] and (reachable > 0) == is_large


def test_a_phone_has_a_hint_and_buttons_for_fingers(browser):
    page = visit(browser, size=PHONE, has_touch=True, is_mobile=True, reduced_motion="reduce")
    assert page.locator("#hint").inner_text() == "Drag the green tip; ☞ lets you push the top."
    sizes = page.evaluate("""[...document.querySelectorAll('#bar button')].map((button) => {
        const {width, height} = button.getBoundingClientRect();
        return Math.min(width, height);
    })""")
    assert min(sizes) >= 36
    page.context.close()
