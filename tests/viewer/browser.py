"""Helpers of the page's tests: visits without a network, presets, drags, and texts of the page."""

import json

import kreisel as kr
import numpy as np
from internals import view
from kreisel import _core
from toolbox import ROOT

PAGE = view._PAGE
WIDE, PHONE, SMALL = (1280, 800), (390, 780), (720, 420)  # windows, in pixels
COARSE = 0.25  # pixels of the screen to one of the page, where nothing depends on how it is drawn
UPRIGHT = "Lagrange's top"  # the preset with which every test of a shared page begins
PRESETS = [p["name"] for p in json.loads((ROOT / "python/viewer/presets.json").read_text())]
TICKS = 1_000_000  # of the clock, in a unit of time
LEVEL = [each for each in _core.quantities if each["doubles"] == 1 and not each["turns"]]
MEASURES = [*(each["name"] for each in LEVEL), "error", "modified_energy"]  # on the record
TRACE = 2048  # the most points that a trace is drawn with
ROD_SIDES = 12  # of a rod's section


def wait_for(page, condition, arg=None):
    """Waits in the page until it is so, or what the condition gives of `arg` is."""
    page.evaluate(
        f"""(arg) => new Promise((done, fail) => {{
            const end = performance.now() + 30000;
            const look = () => {{
                const told = ({condition});
                if (typeof told === 'function' ? told(arg) : told) return done();
                if (performance.now() > end) return fail(new Error('it has not come to this'));
                setTimeout(look, 5);
            }};
            look();
        }})""",
        arg,
    )


def window(size):
    return dict(zip(("width", "height"), size, strict=True))


def is_trouble(message):
    """Return True for errors and warnings, except on the speed of software rendering."""
    return message.type in {"error", "warning"} and "GPU stall" not in message.text


def visit(browser, file=PAGE, size=WIDE, fragment="", scale=COARSE, **how):
    """The page in a window of its own, drawn with so many pixels of the screen to one of its own.

    `troubles` are complaints in the console and what was asked of the network.
    """
    how = {"viewport": window(size), "device_scale_factor": scale, **how}
    context = browser.new_context(offline=True, **how)
    context.set_default_timeout(30000)
    page = context.new_page()
    page.troubles = troubles = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("console", lambda message: is_trouble(message) and troubles.append(message.text))
    page.on(
        "request",
        lambda request: request.url.startswith(("http", "ws")) and troubles.append(request.url),
    )
    page.goto(file.as_uri() + fragment)
    wait_for(page, "!!window.kreisel")
    return page


# What is done in the page


def load(page, preset=UPRIGHT, **changes):
    """Opens a preset, with some of its words changed, at its start."""
    loaded = page.evaluate(
        """([name, changes]) => {
        const preset = kreisel.presets.find((preset) => preset.name === name);
        return !!preset && kreisel.page.load({...preset, ...changes});
    }""",
        [preset, changes],
    )
    assert loaded, f"the page has no preset {preset}, or refuses {changes}"


def advance(page, t):
    page.evaluate(f"kreisel.advance({t})")


def until(page, t):
    """Waits for a jump to be at its goal."""
    wait_for(page, f"kreisel.page.clock === {t} * {TICKS} && kreisel.page.goal === null")


def drag(page, kind, by, number=0, button="left", key=None):
    """Drag a handle; return its places before and after."""
    where = f"kreisel.at('{kind}', 0, {number})"
    x, y = page.evaluate(where)
    if key:
        page.keyboard.down(key)
    page.mouse.move(x, y)
    page.mouse.down(button=button)
    page.mouse.move(x + by[0] / 2, y + by[1] / 2)
    page.mouse.move(x + by[0], y + by[1])
    page.mouse.up(button=button)
    if key:
        page.keyboard.up(key)
    return np.array((x, y)), np.array(page.evaluate(where))


# What the page says


def scene(page):
    return page.evaluate("kreisel.page.scene")


def differing_keys(before, after):
    """The words in which two scenes of the page differ, but for its name and what it tells."""
    return {key for key in before if before[key] != after[key]} - {"name", "about"}


def clock(page):
    return page.evaluate("kreisel.page.clock")


def states(page):
    """(t, q, m) of each top."""
    return page.evaluate("kreisel.states()")


def measure(page, top, name):
    """Return the present measurements of a top."""
    return page.evaluate(f"kreisel.stage.measure({top}).{name}")


def record(page, top, name):
    """Return the recorded measurements of a top."""
    values = page.evaluate(f"kreisel.stage.record({top}, '{name}')")
    return np.array(values, float)


def words(page):
    """Return the messages of the page."""
    return page.locator("#words").inner_text()


def colours(page):
    """Return the number of colours in the reduced picture."""
    return page.evaluate("""(() => {
        const c = document.createElement('canvas'), x = c.getContext('2d');
        [c.width, c.height] = [160, 100];
        x.drawImage(kreisel.view.canvas, 0, 0, 160, 100);
        return new Set(new Uint32Array(x.getImageData(0, 0, 160, 100).data.buffer)).size;
    })()""")


def scene_in_python(given, second=False):
    """The kreisel.Scene that a scene of the page is."""
    body = given["body"]
    if "half" in body:
        made = kr.Body.cuboid(**body)
    else:
        made = kr.Body(
            body["mass"], np.reshape(body["inertia"], (3, 3)), body["com"], unphysical=True
        )
    start = given["second"] if second else [*given["attitude"], *given["momentum"]]
    return kr.Scene(made, start[4:], start[:4], given["gravity"])
