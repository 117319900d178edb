"""Tests that bodies and rods cast shadows on the floor."""

import numpy as np
import pytest
from browser import PRESETS, advance, load

SHADOWS = "kreisel.view.floor.shadows"
# Returns red + green + blue of each pixel in a small copy of the picture, from 0 to 765.
BRIGHTNESS = """(() => {
    const {view} = kreisel, pen = document.createElement('canvas').getContext('2d');
    drawPicture();
    pen.drawImage(view.canvas, 0, 0, 120, 100);
    const {data} = pen.getImageData(0, 0, 120, 100);
    const sum = (at) => data[at] + data[at + 1] + data[at + 2];
    return Array.from({length: 120 * 100}, (_, i) => sum(4 * i));
})()"""
ROD = "Elastic rod"  # a scene that is drawn as a rod instead of a body


def brightness(page):
    return np.reshape(page.evaluate(BRIGHTNESS), (100, 120)) / 3


@pytest.mark.parametrize("preset", PRESETS)
def test_each_scene_has_shadows(page, preset):
    load(page, preset)
    advance(page, 6)
    assert page.evaluate(f"{SHADOWS}.visible && {SHADOWS}.children.length") > 0
    shadow = brightness(page)
    page.evaluate(f"{SHADOWS}.visible = false")
    full = brightness(page)
    page.evaluate(f"{SHADOWS}.visible = true")
    darker = full - shadow
    assert darker.max() > 15 and darker.min() > -3
    rows, _ = np.nonzero(darker > 10)
    assert len(rows) > (4 if preset == ROD else 40)
    assert np.median(rows) > 40  # the shadows lie in the lower part of the picture


def test_shadows_follow_the_top(page):
    load(page, "A spinning top")
    position_script = f"""(kreisel.view.isDirty = true, kreisel.view.render(),
        {SHADOWS}.children[0].matrixWorld.toArray())"""
    before = page.evaluate(position_script)
    advance(page, 3)
    assert page.evaluate(position_script) != before


def test_body_and_rod_have_shadows_while_they_are_shown(page):
    script = f"{SHADOWS}.children.map(({{visible, userData}}) => [userData.isRod, visible])"
    load(page, ROD)
    assert not page.evaluate("kreisel.view.tops[0].solid.visible")
    assert all(is_rod == visible for is_rod, visible in page.evaluate(script))
    page.get_by_label("Show as").select_option("box")
    assert page.evaluate("kreisel.view.tops[0].solid.visible")
    assert all(visible for _, visible in page.evaluate(script))
    page.get_by_role("checkbox", name="Elastic rod").uncheck()
    assert all(is_rod != visible for is_rod, visible in page.evaluate(script))
