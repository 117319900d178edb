"""What the page weighs and how fast it is, in headless Chromium that draws in software: python -m
validation.bench.page

A frame's steps are those of 1/60 of a unit of time. Each time is the median of its repetitions, the
largest behind it.
"""

import argparse
import gzip
import shutil
from statistics import median

from kreisel._showing.view import _PAGE
from playwright.sync_api import sync_playwright

SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PAIRS = [
    ("bobenko_suris", "rk4"),
    ("bobenko_suris", "extrap"),
    ("strang", "implicit_midpoint"),
    ("exact", "taylor"),
]

WINDOW = {"width": 1280, "height": 800}
DRAGS = [
    ("A spinning top", "tip", 0),
    ("A spinning top", "face", 0),
    ("Lagrange's top", "corner", 5),
    ("Compare four", "corner", 5),
]

# Milliseconds from the navigation to the first picture, drawn to its end.
READY = """new Promise((done) => { const look = () => {
    if (!window.kreisel?.view.renderer.info.render.frame) return requestAnimationFrame(look);
    kreisel.view.renderer.getContext().finish();
    done(performance.now());
}; look(); })"""
# Milliseconds a frame for stepping alone, over 2000 frames: eleven times.
STEPPING = """(methods) => Array.from({ length: 11 }, () => {
    const preset = kreisel.presets.find((preset) => preset.name === "Compare four");
    kreisel.page.load({ ...preset, methods, step: [0.01, 0.01] });
    const begin = performance.now();
    for (let i = 1; i <= 2000; i++) kreisel.stage.advance((i * 1e6) / 60, 1e9);
    return (performance.now() - begin) / 2000;
})"""
# Milliseconds of each of 150 moves of what is held, sorted.
HELD = """([part, number]) => {
    const { canvas } = kreisel.view, [x, y] = kreisel.at(part, 0, number);
    canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
    const mouse = { pointerId: 7, pointerType: "mouse", bubbles: true, cancelable: true };
    const send = (type, clientX, clientY) => {
        const begin = performance.now();
        canvas.dispatchEvent(new PointerEvent(type, { ...mouse, clientX, clientY, buttons: 1 }));
        return performance.now() - begin;
    };
    send("pointerdown", x, y);
    const took = Array.from({ length: 150 }, (_, i) => send("pointermove", x + i % 20, y - i % 30));
    send("pointerup", x, y);
    return took;
}"""
LOAD = "(name) => kreisel.page.load(kreisel.presets.find((preset) => preset.name === name))"
# Of each pointermove: how many frames until it was drawn, and after how many milliseconds.
WATCH = """window.seen = []; kreisel.view.canvas.addEventListener("pointermove", (event) => {
    const { render } = kreisel.view.renderer.info, before = render.frame;
    let frames = 0;
    const look = () => (frames++, render.frame > before
        ? seen.push([frames, performance.now() - event.timeStamp]) : requestAnimationFrame(look));
    requestAnimationFrame(look);
})"""


def fresh(browser):
    page = browser.new_context(viewport=WINDOW, offline=True).new_page()
    page.goto(_PAGE.as_uri())
    return page


def ready(browser):
    """Until the first picture: the time, and what the page's own thread worked of that."""
    page = browser.new_context(viewport=WINDOW, offline=True).new_page()
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.goto(_PAGE.as_uri())
    took = page.evaluate(READY)
    told = {
        each["name"]: each["value"] for each in session.send("Performance.getMetrics")["metrics"]
    }
    page.context.close()
    return took, 1e3 * told["TaskDuration"]


def say(what, values, unit, digits):
    print(f"{what:44} {median(values):8.{digits}f} {unit:9} largest {max(values):.{digits}f}")


def drag(page):
    """Takes the green tip, and moves it a hundred times."""
    page.evaluate(WATCH)
    x, y = page.evaluate("kreisel.at('tip')")
    page.mouse.move(x, y)
    page.mouse.down()
    page.evaluate("window.seen = []")
    for i in range(100):
        page.mouse.move(x + i % 20, y - i % 30)
        page.wait_for_timeout(20)
    page.mouse.up()
    return page.evaluate("seen")


def weigh():
    text = _PAGE.read_bytes()
    packed = len(gzip.compress(text, 9)) / 1e3
    print(f"{'size':44} {len(text) / 1e3:8.1f} kB        gzipped {packed:.1f} kB")


def main(argv=None):
    argparse.ArgumentParser(prog="python -m validation.bench.page", description=__doc__).parse_args(
        argv
    )
    weigh()
    with sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=shutil.which("chromium"), args=SOFTWARE)
        took, worked = zip(*(ready(browser) for _ in range(7)), strict=True)
        say("ready", took, "ms", 0)
        say("ready, work of the page's thread", worked, "ms", 0)
        page = fresh(browser)
        page.evaluate(READY)
        for pair in PAIRS:
            name = f"stepping, two {pair[0]}, two {pair[1]}"
            say(name, page.evaluate(STEPPING, list(pair)), "ms/frame", 4)
        for name, *held in DRAGS:
            page.evaluate(LOAD, name)
            say(f"a drag event, {name}, {held[0]}", page.evaluate(HELD, held), "ms", 2)
        page.evaluate(LOAD, "Lagrange's top")
        frames, after = zip(*drag(page), strict=True)
        say("a drag is drawn", frames, "frame(s)", 0)
        say("a drag is drawn", after, "ms", 0)
        browser.close()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
