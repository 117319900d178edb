"""Tests that meshes are reused, updated and freed."""

import numpy as np
import pytest
from browser import TICKS, advance, drag, load, read_scene, read_states, wait_for

# Drags a part of top i by some moves, and releases the part if requested.
PULL = """window.pull = (part, moves = 4, {i = 0, altKey = false, lets = true} = {}) => {
    const {canvas} = kreisel.view, [x, y] = kreisel.locate(part, i, 5);
    canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
    const mouse = {pointerId: 7, pointerType: 'mouse', bubbles: true, cancelable: true, altKey};
    const send = (type, clientX, clientY) => canvas.dispatchEvent(
        new PointerEvent(`pointer${type}`, {...mouse, clientX, clientY, buttons: 1}));
    send('down', x, y);
    for (let k = 1; k <= moves; k++) send('move', x + 3 * (k % 9), y - 2 * (k % 11));
    if (lets) send('up', x, y);
};"""
# Returns all that is visible: the position, shape and colours of each part, and the letters.
SEEN = """window.seen = () => {
    const {view} = kreisel, parts = [];
    view.world.updateMatrixWorld(true);
    view.floor.updateShadows();
    view.world.updateMatrixWorld(true);
    view.labels.placeLabels(view.pixels);
    const digits = (numbers) => Array.from(numbers, (x) => +x.toFixed(5) + 0);
    const sum = ({index, drawRange, attributes}) => {
        const {array} = attributes.position ?? attributes.start.data;
        const drawn = index?.array.subarray(0, drawRange.count);
        let all = 0;
        for (let at = 0; at < (drawn?.length ?? array.length / 3); at++) {
            const k = drawn ? drawn[at] : at;
            for (let i = 0; i < 3; i++) all += ((k + i) % 97) * array[3 * k + i];
        }
        return (all || 0).toFixed(1);
    };
    view.world.traverseVisible(({geometry, material, matrixWorld, renderOrder}) => geometry &&
        parts.push([digits(matrixWorld.elements), material.color?.getHexString(), renderOrder,
            material.opacity, material.transparent, material.depthTest, geometry.drawRange.count,
            sum(geometry)]));
    const letters = [...view.labels.container.children].map((span) => span.outerHTML);
    return JSON.stringify([parts, letters, view.world.background.getHexString()]);
};"""
CHANGES = """{
    const {page, view, presets} = kreisel;
    const preset = (name) => page.load(presets.find((preset) => preset.name === name));
    const light = (value) => {
        const list = document.querySelector('[aria-label="Light or dark"]');
        list.value = value;
        list.dispatchEvent(new Event('change'));
    };
    window.changes = {
        tip: () => pull('tip'),
        face: () => pull('face'),
        corner: () => pull('corner'),
        pivot: () => pull('corner', 4, {altKey: true}),
        later: () => kreisel.advance(2),
        undo: () => page.undo(),
        reset: () => page.reset(),
        rewind: () => page.rewind(),
        weightless: () => page.setValue('gravity', 0),
        heavy: () => page.setValue('gravity', 3),
        longer: () => page.setValue('body.half.2', 1.3),
        ghost: () => page.setValue('ghost', !page.scene.ghost),
        beside: () => page.setValue('methods.1', 'rk4'),
        both: () => page.setValue('both', page.scene.step.length < 2),
        box: () => page.setValue('show.solid', 'box'),
        top: () => page.setValue('show.solid', 'top'),
        opaque: () => page.setValue('show.opacity', 1),
        plate: () => page.setValue('shape', 'kowalewski'),
        light: () => light('light'),
        dark: () => light('dark'),
        four: () => preset('Compare four'),
        sleeping: () => preset('Sleeping top'),
        spinning: () => preset('A spinning top'),
    };
}"""
# Creates all parts anew. The picture must not change.
ANEW = "window.anew = () => (kreisel.view.partsKey = '', kreisel.view.build(kreisel.page, false));"
PAIRS = """(first) => {
    const {page, presets} = kreisel, {onChange} = page;
    page.onChange = () => {}; // all but the picture rests
    const wrong = Object.keys(changes).filter((second) => {
        page.load(presets.find((preset) => preset.name === "Lagrange's top"));
        page.undoStack = [];
        for (const change of [first, second]) changes[change]();
        const kept = seen();
        anew();
        return kept !== seen();
    });
    page.onChange = onChange;
    return wrong;
}"""
NAMES = [
    *("tip", "face", "corner", "pivot", "later", "undo", "reset", "rewind", "weightless"),
    *("heavy", "longer", "ghost", "beside", "both", "box", "top", "opaque", "plate"),
    *("light", "dark", "four", "sleeping", "spinning"),
]


@pytest.fixture
def page_with_changes(page):
    page.evaluate("".join((PULL, SEEN, ANEW, CHANGES)))
    yield page
    page.evaluate("changes.light(), document.documentElement.style.colorScheme = ''")
    page.evaluate("document.querySelector('[aria-label=\"Light or dark\"]').value = ''")


@pytest.mark.parametrize("first", NAMES)
def test_reused_meshes_show_the_same_as_new_ones(page_with_changes, first):
    assert page_with_changes.evaluate("Object.keys(changes)") == NAMES
    assert page_with_changes.evaluate(PAIRS, first) == []


@pytest.mark.parametrize("change", ["tip", "face", "corner", "pivot", "heavy", "dark", "four"])
def test_a_change_is_shown(page_with_changes, change):
    before = page_with_changes.evaluate("seen()")
    page_with_changes.evaluate(f"changes.{change}()")
    assert page_with_changes.evaluate("seen()") != before


PARTS = """(() => {
    const all = [...kreisel.view.labels.container.children];
    kreisel.view.world.traverse((part) => all.push(part, part.geometry, part.material));
    window.known ??= all;
    return all.length === known.length && all.every((part, k) => part === known[k]);
})()"""


@pytest.mark.parametrize(
    "preset, parts",
    [
        ("Lagrange's top", ["tip", "face", "corner"]),
        ("Compare four", ["tip", "face", "corner"]),
        ("Kowalewski", ["tip", "corner"]),
        ("Sleeping top", ["tip", "face"]),
    ],
)
def test_a_drag_creates_no_new_meshes(page_with_changes, preset, parts):
    for part in parts:
        load(page_with_changes, preset)
        page_with_changes.evaluate("delete window.known")
        assert page_with_changes.evaluate(PARTS)
        before = read_scene(page_with_changes)
        page_with_changes.evaluate("part => pull(part, 4, {lets: false})", part)
        assert read_scene(page_with_changes) != before and page_with_changes.evaluate(PARTS)
        page_with_changes.keyboard.press("Escape")


def test_a_thousand_moves_of_the_pointer_in_drags_leak_no_resources(page_with_changes):
    script = """(() => {
        const {renderer} = kreisel.view, {memory, programs} = renderer.info;
        kreisel.view.isDirty = true;
        kreisel.view.render();
        const nodes = document.querySelectorAll('*').length;
        return [memory.geometries, memory.textures, programs.length, nodes];
    })()"""
    load(page_with_changes, "Compare four")
    drags = "for (const name of ['tip', 'face', 'corner']) pull(name, 24), kreisel.view.render();"
    page_with_changes.evaluate(drags)
    before = page_with_changes.evaluate(script)
    page_with_changes.evaluate(f"for (let k = 0; k < 14; k++) {{ {drags} }}")
    assert page_with_changes.evaluate(script) == before
    for name in ("A spinning top", "Sleeping top", "Kowalewski", "Compare four"):
        load(page_with_changes, name)
        page_with_changes.evaluate("kreisel.view.render()")
    page_with_changes.evaluate("kreisel.page.undoStack = []; kreisel.page.rewind()")
    assert page_with_changes.evaluate(script)[:2] == before[:2]


def test_charts_are_reused_with_the_current_record(page_with_changes):
    plots = "kreisel.charts.plots.every((plot, k) => plot === known[k])"
    advance(page_with_changes, 2)
    wait_for(page_with_changes, f"kreisel.charts.clock === {2 * TICKS}")
    page_with_changes.evaluate("window.known = [...kreisel.charts.plots]")
    drag(page_with_changes, "tip", (40, -30))
    assert page_with_changes.evaluate(plots)
    assert page_with_changes.evaluate(
        "kreisel.charts.plots.map((plot) => plot.data[0].at(-1))"
    ) == [0, 0, 0]
    earlier = "kreisel.charts.plots.map((plot) => plot.earlier.times.at(-1))"
    assert page_with_changes.evaluate(earlier) == [2, 2, 2]
    page_with_changes.evaluate("changes.ghost()")
    assert not page_with_changes.evaluate(plots)


@pytest.mark.parametrize("top", [0, 1])
def test_the_dragged_top_determines_the_new_start(page_with_changes, top):
    load(page_with_changes, "Energy and motion")
    advance(page_with_changes, 20)
    before = read_states(page_with_changes)
    assert np.abs(np.subtract(before[0], before[1])).max() > 1e-3
    page_with_changes.evaluate("i => pull('tip', 1, {i})", top)
    assert read_scene(page_with_changes)["attitude"] == before[top][1:5]


def test_undo_during_a_drag_does_not_change_a_field(page):
    page.get_by_label("Thickness, number").fill("2")
    x, y = page.evaluate("kreisel.locate('tip')")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 20, y + 10)
    page.keyboard.press("Control+z")
    assert page.evaluate("document.activeElement === kreisel.view.canvas")
    assert read_scene(page)["show"]["thickness"] == 2
    page.mouse.up()
