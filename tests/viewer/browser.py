"""Helper functions for the tests of the viewer."""

import json

import kreisel as kr
import numpy as np
from internals import view
from kreisel import _core
from toolbox import HANG, ROOT, open_context

PAGE = view._PAGE
WIDE, PHONE, SMALL = (1280, 800), (390, 780), (720, 420)  # sizes of windows [pixels]
COARSE = 0.25  # screen pixels per page pixel, for tests that do not look at the picture
# While `sketches` is true, the first triangle of each part is drawn instead of the whole part, for
# tests that do not look at the picture: rendering without a GPU spends its time on the triangles.
# `drawPicture` draws all once.
SKETCHES = """window.sketches = true;
for (const [name, place] of [['drawArrays', 2], ['drawElements', 1]]) {
    const draw = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...given) {
        if (sketches) given[place] = Math.min(given[place], 3);
        draw.apply(this, given);
    };
}
window.drawPicture = () => {
    sketches = false;
    kreisel.view.isDirty = true;
    kreisel.view.render();
    sketches = true;
};"""
UPRIGHT = "Lagrange's top"  # the preset shown when a test of the shared page begins
PRESETS = [p["name"] for p in json.loads((ROOT / "python/viewer/presets.json").read_text())]
UNDAMPED = [  # presets whose energy is constant
    p["name"]
    for p in json.loads((ROOT / "python/viewer/presets.json").read_text())
    if "damping" not in p
]
TICKS = 1_000_000  # the viewer counts time in ticks; number of ticks per unit of time
LEVEL = [each for each in _core.quantities if each["doubles"] == 1 and not each["turns"]]
# names of the quantities that the viewer records
MEASURES = [*(each["name"] for each in LEVEL), "error", "modified_energy"]
TRACE = 2048  # largest number of points in a trace
ROD_SIDES = 12  # number of sides of the cross section of a rod, which is a polygon


def wait_for(page, condition, arg=None):
    """Wait until `condition` holds in the viewer.

    If `condition` is a function, it is called with `arg`.
    """
    page.evaluate(
        f"""(arg) => new Promise((done, fail) => {{
            const end = performance.now() + {1000 * HANG};
            const look = () => {{
                const result = ({condition});
                if (typeof result === 'function' ? result(arg) : result) return done();
                if (performance.now() > end) return fail(new Error('the condition does not hold'));
                setTimeout(look, 5);
            }};
            look();
        }})""",
        arg,
    )


def make_viewport(size):
    return dict(zip(("width", "height"), size, strict=True))


def is_trouble(message):
    """Return True if a console message is a relevant error or warning."""
    return message.type in {"error", "warning"} and "GPU stall" not in message.text


def visit(browser, file=PAGE, size=WIDE, fragment="", scale=COARSE, **options):
    """Open the viewer in a new window with `scale` screen pixels per CSS pixel."""
    return open_viewer(open_window(browser, size, scale, **options), file, fragment)


def open_window(browser, size=WIDE, scale=COARSE, **options):
    """Open an empty window.

    Errors, warnings and network requests are appended to the page's attribute `troubles`.
    """
    options = {"viewport": make_viewport(size), "device_scale_factor": scale, **options}
    context = open_context(browser, offline=True, **options)
    context.add_init_script(SKETCHES)
    page = context.new_page()
    page.troubles = troubles = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("console", lambda message: is_trouble(message) and troubles.append(message.text))
    page.on(
        "request",
        lambda request: request.url.startswith(("http", "ws")) and troubles.append(request.url),
    )
    return page


def open_viewer(page, file=PAGE, fragment=""):
    """Open the viewer in an empty window."""
    page.goto(file.as_uri() + fragment)
    wait_until_ready(page)
    return page


def wait_until_ready(page):
    """Wait until the viewer shows its presets, which are drawn last."""
    wait_for(page, "document.querySelector('#presets svg')?.childElementCount > 0")


def reload(page):
    page.reload()
    wait_until_ready(page)


# Actions


def load(page, preset=UPRIGHT, **changes):
    """Load a preset with changed values, at its initial state. A running viewer keeps running."""
    is_loaded = page.evaluate(
        """([name, changes]) => {
        const preset = kreisel.presets.find((preset) => preset.name === name);
        return !!preset && kreisel.page.load({...preset, ...changes});
    }""",
        [preset, changes],
    )
    assert is_loaded, f"the viewer has no preset {preset}, or refuses {changes}"


def advance(page, t):
    page.evaluate(f"kreisel.advance({t})")


def wait_until_time(page, t):
    """Wait until the viewer has reached the time `t`."""
    wait_for(page, f"kreisel.page.clock === {t} * {TICKS} && kreisel.page.goal === null")


def drag(page, kind, offset, number=0, button="left", key=None):
    """Drag a handle in the viewer, and return its positions before and after the drag."""
    script = f"kreisel.locate('{kind}', 0, {number})"
    x, y = page.evaluate(script)
    if key:
        page.keyboard.down(key)
    page.mouse.move(x, y)
    page.mouse.down(button=button)
    page.mouse.move(x + offset[0] / 2, y + offset[1] / 2)
    page.mouse.move(x + offset[0], y + offset[1])
    page.mouse.up(button=button)
    if key:
        page.keyboard.up(key)
    return np.array((x, y)), np.array(page.evaluate(script))


# Queries


def read_scene(page):
    return page.evaluate("kreisel.page.scene")


def list_changes(before, after):
    """Return the keys whose values differ between two scenes, ignoring the name and description."""
    return {key for key in before if before[key] != after[key]} - {"name", "about"}


def read_clock(page):
    return page.evaluate("kreisel.page.clock")


def read_states(page):
    """Return the time, attitude and momentum of each top in the viewer."""
    return page.evaluate("kreisel.readStates()")


def measure_top(page, top, name):
    """Return the current value of the quantity `name` of a top."""
    return page.evaluate(f"kreisel.simulation.measureTop({top}).{name}")


def read_record(page, top, name):
    """Return all values that the viewer has recorded for the quantity `name` of a top."""
    values = page.evaluate(f"kreisel.simulation.getRecord({top}, '{name}')")
    return np.array(values, float)


def read_message(page):
    """Return the text of the status message on the viewer's page."""
    return page.locator("#words").inner_text()


def count_colours(page):
    """Return the number of different colours in the viewer's picture."""
    return page.evaluate("""(() => {
        const c = document.createElement('canvas'), x = c.getContext('2d');
        [c.width, c.height] = [160, 100];
        x.drawImage(kreisel.view.canvas, 0, 0, 160, 100);
        return new Set(new Uint32Array(x.getImageData(0, 0, 160, 100).data.buffer)).size;
    })()""")


def turn_description(settings, turn):
    """Return the same motion of a body given by numbers, in axes that `turn` rotates.

    `turn` is a unit quaternion.
    """
    body = scene_in_python(settings).body.turn(turn)
    inertia = np.array(body.inertia)
    matrix = inertia if inertia.ndim == 2 else np.diag(inertia)
    numbers = {"mass": body.mass, "inertia": matrix.ravel().tolist(), "com": list(body.com)}

    def turn_back(attitude):
        return list(kr.quaternion.multiply(tuple(attitude), kr.quaternion.conjugate(turn)))

    second = settings["second"]
    return {
        **settings,
        "body": numbers,
        "attitude": turn_back(settings["attitude"]),
        "second": second and [*turn_back(second[:4]), *second[4:]],
        "rotor": list(kr.quaternion.turn(turn, settings["rotor"])),
    }


def scene_in_python(settings, second=False):
    """Convert a viewer scene to a kreisel.Scene."""
    body = settings["body"]
    if "half" in body:
        top_body = kr.Body.cuboid(**body)
    else:
        top_body = kr.Body(
            body["mass"], np.reshape(body["inertia"], (3, 3)), body["com"], unphysical=True
        )
    if any(settings["rotor"]):
        top_body = top_body.with_rotor(
            spin=1, inertia=np.linalg.norm(settings["rotor"]), axis=settings["rotor"]
        )
    start = settings["second"] if second else [*settings["attitude"], *settings["momentum"]]
    disturbances = {name: settings[name] for name in ("damping", "friction", "turning")}
    return kr.Scene(top_body, start[4:], start[:4], settings["gravity"], **disturbances)
