"""The size and speed of the interactive viewer, in headless Chromium with software rendering.

    python -m validation.benchmarks.viewer_speed

Each frame advances the simulation by 1/60 of a unit of time. Each measurement is repeated several
times, and the program prints the median and the maximum. For mouse drags, the program also prints
the 99th percentile and the longest processor time of an event. On a busy machine, the measured
durations include the time spent waiting for the processor.
"""

import argparse
import gzip
import json
import shutil
from statistics import median

from kreisel._view import _PAGE
from playwright.sync_api import sync_playwright

SOFTWARE = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PAIRS = [
    ("bobenko_suris", "rk4"),
    ("bobenko_suris", "extrap"),
    ("strang", "implicit_midpoint"),
    ("exact", "taylor"),
]

WINDOW = {"width": 1280, "height": 800}
EVENTS = 600  # per drag
DRAGS = [  # preset, dragged part, index of the top, and index of a corner
    ("A spinning top", "tip", 0, 0),
    ("A spinning top", "face", 0, 0),
    ("Sleeping top", "tip", 1, 0),
    ("Sleeping top", "face", 1, 0),
    *(("Lagrange's top", part, 0, 5) for part in ("tip", "face", "edge", "corner", "pivot")),
    *(("Kowalewski", part, 0, 5) for part in ("tip", "corner", "pivot")),
    *(("Elastic rod", part, 0, 5) for part in ("tip", "corner")),
    *(("Compare four", part, 0, 5) for part in ("tip", "face", "edge", "corner", "pivot")),
    ("Compare four, ghost", "corner", 0, 5),
    ("Compare four", "tip", 2, 0),
    ("Energy and motion", "corner", 1, 5),
]

# Returns the milliseconds from navigation until the first picture is complete.
READY = """new Promise((done) => { const look = () => {
    if (!window.kreisel?.view.renderer.info.render.frame) return requestAnimationFrame(look);
    kreisel.view.renderer.getContext().finish();
    done(performance.now());
}; look(); })"""
# Returns eleven values: the mean time of stepping in a frame [ms], each over 2000 frames.
STEPPING = """(methods) => Array.from({ length: 11 }, () => {
    const preset = kreisel.presets.find((preset) => preset.name === "Compare four");
    kreisel.page.load({ ...preset, methods, step: [0.01, 0.01] });
    const begin = performance.now();
    for (let i = 1; i <= 2000; i++) kreisel.simulation.advance((i * 1e6) / 60, 1e9);
    return (performance.now() - begin) / 2000;
})"""
# Drags a part and waits for a frame after every 30 events. A pivot is a corner dragged with Alt.
HELD = """async ([part, top, number, events]) => {
    const { canvas } = kreisel.view, altKey = part === "pivot";
    const [x, y] = kreisel.locate(altKey ? "corner" : part, top, number);
    canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
    const mouse = { pointerId: 7, pointerType: "mouse", bubbles: true, cancelable: true, altKey };
    const send = (type, clientX, clientY) => canvas.dispatchEvent(
        new PointerEvent(type, { ...mouse, clientX, clientY, buttons: 1 }));
    send("pointerdown", x, y);
    if (!kreisel.drags.current) throw new Error(`no ${part} is where it is sought`);
    for (let i = 0; i < events; i++) {
        send("pointermove", x + i % 20, y - i % 30);
        if (i % 30 === 29) await new Promise(requestAnimationFrame);
    }
    send("pointerup", x, y);
}"""
LOAD = """(name) => {
    const preset = kreisel.presets.find((preset) => preset.name === name.split(",")[0]);
    kreisel.page.load({ ...preset, ghost: name.endsWith("ghost") });
}"""
# Records in window.seen how many frames and milliseconds pass from each pointermove until it is
# drawn.
WATCH = """window.seen = []; kreisel.view.canvas.addEventListener("pointermove", (event) => {
    const { render } = kreisel.view.renderer.info, before = render.frame;
    let frames = 0;
    const look = () => (frames++, render.frame > before
        ? seen.push([frames, performance.now() - event.timeStamp]) : requestAnimationFrame(look));
    requestAnimationFrame(look);
})"""


def open_page(browser):
    page = browser.new_context(viewport=WINDOW, offline=True).new_page()
    page.goto(_PAGE.as_uri())
    return page


def time_first_picture(browser):
    """Return the elapsed and the processor time [ms] of the viewer until its first frame."""
    page = browser.new_context(viewport=WINDOW, offline=True).new_page()
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.goto(_PAGE.as_uri())
    milliseconds = page.evaluate(READY)
    metrics = {
        each["name"]: each["value"] for each in session.send("Performance.getMetrics")["metrics"]
    }
    page.context.close()
    return milliseconds, 1e3 * metrics["TaskDuration"]


def print_row(title, values, unit, digits):
    print(f"{title:44} {median(values):8.{digits}f} {unit:9} largest {max(values):.{digits}f}")


def print_spread(title, times, processor_times):
    nearly_all = sorted(times)[int(0.99 * len(times))]
    print(
        f"{title:44} {median(times):8.2f} ms        99 % {nearly_all:.2f} largest {max(times):.2f} "
        f"worked {max(processor_times):.2f}"
    )


def time_drag_events(browser, page, *arguments):
    """Return the duration [ms] and the processor time [ms] of each mouse event."""
    browser.start_tracing(page=page, categories=["devtools.timeline"])
    page.evaluate(HELD, [*arguments, EVENTS])
    events = [
        event
        for event in json.loads(browser.stop_tracing())["traceEvents"]
        if event["name"] == "EventDispatch" and event["args"]["data"]["type"] == "pointermove"
    ]
    assert len(events) == EVENTS
    return [e["dur"] / 1e3 for e in events], [e["tdur"] / 1e3 for e in events]


def time_drag(page):
    """Return the delay of the viewer after each of 100 mouse movements, in frames and in ms."""
    page.evaluate(WATCH)
    x, y = page.evaluate("kreisel.locate('tip')")
    page.mouse.move(x, y)
    page.mouse.down()
    page.evaluate("window.seen = []")
    for i in range(100):
        page.mouse.move(x + i % 20, y - i % 30)
        page.wait_for_timeout(20)
    page.mouse.up()
    return page.evaluate("seen")


def print_size():
    text = _PAGE.read_bytes()
    compressed_size = len(gzip.compress(text, 9)) / 1e3
    print(f"{'size':44} {len(text) / 1e3:8.1f} kB        gzipped {compressed_size:.1f} kB")


def main(argv=None):
    argparse.ArgumentParser(
        prog="python -m validation.benchmarks.viewer_speed", description=__doc__.splitlines()[0]
    ).parse_args(argv)
    print_size()
    with sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=shutil.which("chromium"), args=SOFTWARE)
        times, processor_times = zip(*(time_first_picture(browser) for _ in range(7)), strict=True)
        print_row("ready", times, "ms", 0)
        print_row("ready, work of the viewer's thread", processor_times, "ms", 0)
        page = open_page(browser)
        page.evaluate(READY)
        for pair in PAIRS:
            name = f"stepping, two {pair[0]}, two {pair[1]}"
            print_row(name, page.evaluate(STEPPING, list(pair)), "ms/frame", 4)
        for name, part, top, number in DRAGS:
            page.evaluate(LOAD, name)
            page.evaluate("kreisel.page.setRunning(false)")
            title = f"a drag event, {name}, {part}{f' of top {top}' if top else ''}"
            print_spread(title, *time_drag_events(browser, page, part, top, number))
        page.evaluate(LOAD, "Lagrange's top")
        frames, delays = zip(*time_drag(page), strict=True)
        print_row("a drag is drawn", frames, "frame(s)", 0)
        print_row("a drag is drawn", delays, "ms", 0)
        browser.close()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
