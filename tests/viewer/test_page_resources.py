"""Tests that the picture shows the present scene only, reuses its objects, and leaks nothing."""

import numpy as np
import pytest
from browser import TICKS, advance, drag, load, scene, states, wait_for

# Pulls at a part of top i, by some moves, and lets go or not.
PULL = """window.pull = (part, moves = 4, {i = 0, altKey = false, lets = true} = {}) => {
    const {canvas} = kreisel.view, [x, y] = kreisel.at(part, i, 5);
    canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
    const mouse = {pointerId: 7, pointerType: 'mouse', bubbles: true, cancelable: true, altKey};
    const send = (type, clientX, clientY) => canvas.dispatchEvent(
        new PointerEvent(`pointer${type}`, {...mouse, clientX, clientY, buttons: 1}));
    send('down', x, y);
    for (let k = 1; k <= moves; k++) send('move', x + 3 * (k % 9), y - 2 * (k % 11));
    if (lets) send('up', x, y);
};"""
# Tells all that is to be seen: each part's place, shape and colours; and the letters.
SEEN = """window.seen = () => {
    const {view} = kreisel, parts = [];
    view.world.updateMatrixWorld(true);
    view.floor.follow();
    view.world.updateMatrixWorld(true);
    view.letters.follow(view.pixels);
    const digits = (numbers) => Array.from(numbers, (x) => +x.toFixed(5) + 0);
    const sum = ({index, drawRange, attributes}) => {
        const {array} = attributes.position ?? attributes.start.data;
        const points = array.subarray(0, array.length / 3).keys();
        const drawn = index?.array.slice(0, drawRange.count) ?? points;
        let all = 0;
        for (const k of drawn) for (let i = 0; i < 3; i++) all += ((k + i) % 97) * array[3 * k + i];
        return (all || 0).toFixed(1);
    };
    view.world.traverseVisible(({geometry, material, matrixWorld, renderOrder}) => geometry &&
        parts.push([digits(matrixWorld.elements), material.color?.getHexString(), renderOrder,
            material.opacity, material.transparent, material.depthTest, geometry.drawRange.count,
            sum(geometry)]));
    const letters = [...view.letters.place.children].map((span) => span.outerHTML);
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
        rewind: () => page.restart(),
        weightless: () => page.set('gravity', 0),
        heavy: () => page.set('gravity', 3),
        longer: () => page.set('body.half.2', 1.3),
        ghost: () => page.set('ghost', !page.scene.ghost),
        beside: () => page.set('methods.1', 'rk4'),
        both: () => page.set('both', page.scene.step.length < 2),
        box: () => page.set('show.solid', 'box'),
        top: () => page.set('show.solid', 'top'),
        opaque: () => page.set('show.opacity', 1),
        plate: () => page.set('shape', 'kowalewski'),
        light: () => light('light'),
        dark: () => light('dark'),
        four: () => preset('Compare four'),
        sleeping: () => preset('Sleeping top'),
        spinning: () => preset('A spinning top'),
    };
}"""
# Makes all parts anew, which shows the same.
ANEW = "window.anew = () => (kreisel.view.made = '', kreisel.view.build(kreisel.page, false));"
PAIRS = """(first) => {
    const {page, presets} = kreisel, {tell} = page;
    page.tell = () => {}; // all but the picture rests
    const wrong = Object.keys(changes).filter((second) => {
        page.load(presets.find((preset) => preset.name === "Lagrange's top"));
        page.past = [];
        for (const change of [first, second]) changes[change]();
        const kept = seen();
        anew();
        return kept !== seen();
    });
    page.tell = tell;
    return wrong;
}"""
NAMES = [
    *("tip", "face", "corner", "pivot", "later", "undo", "reset", "rewind", "weightless"),
    *("heavy", "longer", "ghost", "beside", "both", "box", "top", "opaque", "plate"),
    *("light", "dark", "four", "sleeping", "spinning"),
]


@pytest.fixture
def page_with_watch(page):
    page.evaluate("".join((PULL, SEEN, ANEW, CHANGES)))
    yield page
    page.evaluate("changes.light(), document.documentElement.style.colorScheme = ''")
    page.evaluate("document.querySelector('[aria-label=\"Light or dark\"]').value = ''")


@pytest.mark.parametrize("first", NAMES)
def test_what_is_kept_shows_the_same_as_what_is_made_anew(page_with_watch, first):
    assert page_with_watch.evaluate("Object.keys(changes)") == NAMES
    assert page_with_watch.evaluate(PAIRS, first) == []


@pytest.mark.parametrize("change", ["tip", "face", "corner", "pivot", "heavy", "dark", "four"])
def test_a_change_is_seen(page_with_watch, change):
    before = page_with_watch.evaluate("seen()")
    page_with_watch.evaluate(f"changes.{change}()")
    assert page_with_watch.evaluate("seen()") != before


PARTS = """(() => {
    const all = [...kreisel.view.letters.place.children];
    kreisel.view.world.traverse((part) => all.push(part, part.geometry, part.material));
    window.known ??= all;
    return all.length === known.length && all.every((part, k) => part === known[k]);
})()"""


@pytest.mark.parametrize(
    "preset, held",
    [
        ("Lagrange's top", ["tip", "face", "corner"]),
        ("Compare four", ["tip", "face", "corner"]),
        ("Kowalewski", ["tip", "corner"]),
        ("Sleeping top", ["tip", "face"]),
    ],
)
def test_a_drag_makes_nothing_anew(page_with_watch, preset, held):
    for part in held:
        load(page_with_watch, preset)
        page_with_watch.evaluate("delete window.known")
        assert page_with_watch.evaluate(PARTS)
        before = scene(page_with_watch)
        page_with_watch.evaluate("part => pull(part, 4, {lets: false})", part)
        assert scene(page_with_watch) != before and page_with_watch.evaluate(PARTS)
        page_with_watch.keyboard.press("Escape")


def test_a_thousand_drags_leave_nothing_behind(page_with_watch):
    told = """(() => {
        const {renderer} = kreisel.view, {memory, programs} = renderer.info;
        kreisel.view.dirty = true;
        kreisel.view.render();
        const nodes = document.querySelectorAll('*').length;
        return [memory.geometries, memory.textures, programs.length, nodes];
    })()"""
    load(page_with_watch, "Compare four")
    some = "for (const name of ['tip', 'face', 'corner']) pull(name, 24), kreisel.view.render();"
    page_with_watch.evaluate(some)
    before = page_with_watch.evaluate(told)
    page_with_watch.evaluate(f"for (let k = 0; k < 14; k++) {{ {some} }}")
    assert page_with_watch.evaluate(told) == before
    for name in ("A spinning top", "Sleeping top", "Kowalewski", "Compare four"):
        load(page_with_watch, name)
        page_with_watch.evaluate("kreisel.view.render()")
    page_with_watch.evaluate("kreisel.page.past = []; kreisel.page.restart()")
    assert page_with_watch.evaluate(told)[:2] == before[:2]


def test_charts_are_kept_and_have_the_record_of_now(page_with_watch):
    plots = "kreisel.charts.plots.every((plot, k) => plot === known[k])"
    advance(page_with_watch, 2)
    wait_for(page_with_watch, f"kreisel.charts.clock === {2 * TICKS}")
    page_with_watch.evaluate("window.known = [...kreisel.charts.plots]")
    drag(page_with_watch, "tip", (40, -30))
    assert page_with_watch.evaluate(plots)
    assert page_with_watch.evaluate("kreisel.charts.plots.map((plot) => plot.data[0].at(-1))") == [
        0,
        0,
        0,
    ]
    assert page_with_watch.evaluate("kreisel.charts.plots[0].scales.x.max") > 2
    page_with_watch.evaluate("changes.ghost()")
    assert not page_with_watch.evaluate(plots)


@pytest.mark.parametrize("top", [0, 1])
def test_the_top_in_hand_is_the_one_that_goes_on(page_with_watch, top):
    load(page_with_watch, "Energy and motion")
    advance(page_with_watch, 20)
    before = states(page_with_watch)
    assert np.abs(np.subtract(before[0], before[1])).max() > 1e-3
    page_with_watch.evaluate("i => pull('tip', 1, {i})", top)
    assert scene(page_with_watch)["attitude"] == before[top][1:5]


def test_undo_while_a_drag_is_held_is_not_for_a_field(page):
    page.get_by_label("Thickness, number").fill("2")
    x, y = page.evaluate("kreisel.at('tip')")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 20, y + 10)
    page.keyboard.press("Control+z")
    assert page.evaluate("document.activeElement === kreisel.view.canvas")
    assert scene(page)["show"]["thickness"] == 2
    page.mouse.up()
