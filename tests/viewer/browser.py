"""The viewer in a browser, for its tests."""

import json
import urllib.parse
from contextlib import contextmanager
from pathlib import Path

import kreisel as kr
import numpy as np
from toolbox import HANG, ROOT, open_context

PAGE = Path(kr.__file__).with_name("viewer.html")
WIDE, PHONE = (1280, 800), (390, 780)  # sizes of windows [pixels]
FINGERS = {"size": PHONE, "has_touch": True, "is_mobile": True}  # options of a phone's window
COARSE = 0.25  # screen pixels per page pixel, for tests that do not look at the picture
# While `sketches` is true, the first triangle of each part is drawn instead of the whole part, for
# tests that do not look at the picture: rendering without a GPU spends its time on the triangles.
# `drawPicture` draws all once.
SKETCHES = """window.sketches = true;
addEventListener('error', (event) => (window.failure ??= event.error?.message));
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
ALL = json.loads((ROOT / "python/viewer/presets.json").read_text(encoding="utf-8"))
PRESETS = [preset["name"] for preset in ALL]
IS_READY = "document.querySelector('#presets svg')?.childElementCount > 0"
TICKS = 1_000_000  # the viewer counts time in ticks; number of ticks per unit of time


def wait_for(page, condition, arg=None):
    """Wait until `condition` holds, or `condition(arg)` if it is a function, or the page fails."""
    page.evaluate(
        f"""(arg) => new Promise((done, fail) => {{
            const end = performance.now() + {1000 * HANG};
            const look = () => {{
                const result = ({condition});
                if (typeof result === 'function' ? result(arg) : result) return done();
                const late = performance.now() > end && 'the condition does not hold';
                if (window.failure || late) return fail(new Error(window.failure || late));
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


def list_changes(before, after):
    """Return the keys whose values differ between two scenes, ignoring the name and description."""
    return {key for key in before if before[key] != after[key]} - {"name", "about"}


def encode_link(scene):
    return "#scene=" + urllib.parse.quote(json.dumps(scene))


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
    names = "damping", "friction", "turning", "shaking", "gradient"
    disturbances = {name: settings[name] for name in names}
    return kr.Scene(top_body, start[4:], start[:4], settings["gravity"], **disturbances)


def turn_description(settings, turn):
    """Return the same motion of a body given by numbers, in axes that `turn` rotates.

    `turn` is a unit quaternion.
    """

    def turn_back(start):
        attitude = kr.quaternion.multiply(tuple(start[:4]), kr.quaternion.conjugate(turn))
        return [*attitude, *start[4:]]

    body = scene_in_python(settings).body.turn(turn)
    given = kr.view(kr.Scene(body, settings["momentum"], gravity=1), open=False).scene
    second = settings["second"] and turn_back(settings["second"])
    turned = {"attitude": turn_back(settings["attitude"]), "second": second}
    return {**settings, **turned, "body": given["body"], "rotor": given["rotor"]}


SWIPE = """([pointerType, [dx, dy], ...handle]) => {
    const {canvas} = kreisel.view;
    const [x, y] = isNaN(handle[0][0]) ? kreisel.locate(...handle) : handle[0];
    const points = [0, 0.5, 1, 1].map((k) => [x + k * dx, y + k * dy]);
    canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
    const touch = {pointerId: 7, pointerType, button: 0, buttons: 1, isPrimary: true};
    points.forEach(([clientX, clientY], i) => {
        const name = i === 0 ? 'down' : i === points.length - 1 ? 'up' : 'move';
        const event = {...touch, bubbles: true, cancelable: true, clientX, clientY};
        canvas.dispatchEvent(new PointerEvent(`pointer${name}`, event));
    });
}"""


class Viewer:
    """A page of a browser that shows the viewer. Other attributes are those of the page.

    Errors, warnings and network requests are appended to `troubles`.
    """

    def __init__(self, browser, size=WIDE, **options):
        """Open an empty window, in which motions wait and few pixels are drawn."""
        usual = {"device_scale_factor": COARSE, "reduced_motion": "reduce", "offline": True}
        context = open_context(browser, viewport=make_viewport(size), **usual | options)
        context.add_init_script(SKETCHES)
        self.page, self.troubles = context.new_page(), []
        note = self.troubles.append
        self.page.on("pageerror", lambda error: note(str(error)))
        self.page.on("console", lambda message: is_trouble(message) and note(message.text))
        is_web = ("http", "ws")
        self.page.on("request", lambda asked: asked.url.startswith(is_web) and note(asked.url))

    def __getattr__(self, name):
        return getattr(self.page, name)

    def open(self, file=PAGE, fragment=""):
        """Open the viewer, and wait until it shows its presets, which are drawn last."""
        self.page.goto(file.as_uri() + fragment)
        wait_for(self, IS_READY)
        return self

    def reload(self):
        self.page.reload()
        wait_for(self, IS_READY)

    def close(self):
        self.page.context.close()

    # Actions

    def load(self, preset=UPRIGHT, **changes):
        """Load a preset with changed values, at its start. A running viewer keeps running."""
        given = next(each for each in ALL if each["name"] == preset) | changes
        assert self.load_scene(given), f"the viewer refuses {changes}"

    def load_scene(self, given):
        return self.evaluate("(given) => kreisel.page.load(given)", given)

    def open_exercise(self, preset, exercise=None):
        """Open a preset or one of its exercises, at its start and at rest."""
        self.load(preset)
        if exercise:
            self.click_exercise(exercise)

    def click_exercise(self, exercise):
        self.find_button(exercise).click()
        self.evaluate("kreisel.page.setRunning(false); kreisel.page.rewind()")

    def follow_link(self, link):
        """Follow a link in the open page, and return the displayed message."""
        return self.follow_links([link])[0][0]

    def follow_links(self, links):
        """Follow links in the open page, and return the messages and scenes after each."""
        return self.evaluate(
            """async (links) => {
            const results = [], {page} = kreisel, words = document.getElementById('words');
            for (const link of links) {
                page.showMessage('');
                await new Promise((done) => {
                    addEventListener('hashchange', () => setTimeout(done), {once: true});
                    location.hash = link;
                });
                history.replaceState(null, '', '#');
                results.push([words.textContent, page.scene]);
            }
            return results;
        }""",
            links,
        )

    def advance(self, t):
        self.evaluate(f"kreisel.advance({t})")

    def wait_until_time(self, t):
        """Wait until the viewer has ended a jump, which must lead to the time `t`."""
        wait_for(self, "kreisel.page.goal === null")
        assert self.read_clock() == t * TICKS

    def fill_field(self, name, value):
        field = self.get_by_label(name, exact=True)
        field.fill(str(value))
        field.press("Tab")
        return field

    def find_button(self, name):
        return self.get_by_role("button", name=name, exact=True)

    def set_value(self, place, value):
        """Set a value at a place of the scene, as its control does."""
        self.evaluate("([place, value]) => kreisel.page.setValue(place, value)", [place, value])

    def resize(self, size):
        """Resize the window, and wait until the picture has the size of its frame."""
        self.page.set_viewport_size(make_viewport(size))
        frame = "document.querySelector('main').getBoundingClientRect()"
        fits = f"Math.abs(kreisel.view.pixels[i] - {frame}[key]) < 1"
        fits = f"['width', 'height'].every((key, i) => {fits})"
        wait_for(self, f"innerWidth === {size[0]} && innerHeight === {size[1]} && {fits}")

    def locate(self, kind, top=0, number=0):
        """Return the place of a handle in the window, in pixels."""
        return self.evaluate(f"kreisel.locate('{kind}', {top}, {number})")

    def drag(self, kind, offset, top=0, number=0, **how):
        """Drag a handle, and return its positions before and after the drag."""
        with self.hold(kind, offset, top, number, **how) as start:
            pass
        return np.array(start), np.array(self.locate(kind, top, number))

    @contextmanager
    def hold(self, kind, offset, top=0, number=0, button="left", key=None):
        """Hold a dragged handle, and release it afterwards."""
        x, y = self.locate(kind, top, number)
        if key:
            self.keyboard.down(key)
        self.mouse.move(x, y)
        self.mouse.down(button=button)
        self.mouse.move(x + offset[0] / 2, y + offset[1] / 2)
        self.mouse.move(x + offset[0], y + offset[1])
        yield x, y
        self.mouse.up(button=button)
        if key:
            self.keyboard.up(key)

    def swipe(self, kind, offset, pointer="touch", number=0):
        """Move a finger from a handle, or from a place in the window."""
        self.evaluate(SWIPE, [pointer, offset, kind, 0, number])

    def download(self, name, file):
        """Save a download of the viewer in `file`, and return `file`."""
        with self.expect_download() as event:
            self.find_button(name).click()
        file.write_bytes(event.value.path().read_bytes())
        return file

    def run_program(self, only_start=False):
        """Run the equivalent Python program of the scene, and return its names.

        If `only_start` is true, run the part that builds the scenes.
        """
        text, names = self.get_by_label("Equivalent Python program").input_value(), {}
        exec(text.partition("\nends")[0] if only_start else text, names)
        return names

    # Queries

    def read_scene(self):
        return self.evaluate("kreisel.page.scene")

    def build_scene(self, second=False):
        """Return the scene, or that of the second motion, as a kreisel.Scene."""
        return scene_in_python(self.read_scene(), second)

    def read_exact(self, second=False):
        """Return the closed form of the motion."""
        return kr.exact(self.build_scene(second))

    def read_clock(self):
        return self.evaluate("kreisel.page.clock")

    def read_states(self):
        """Return the time, attitude and momentum of each top."""
        return self.evaluate("kreisel.readStates()")

    def read_tops(self):
        return self.evaluate("kreisel.page.tops")

    def read_times(self):
        """Return the times of the record."""
        return np.array(self.evaluate("Array.from(kreisel.simulation.getTimes())"))

    def read_record(self, top, name):
        """Return all values that the viewer has recorded for the measure `name` of a top."""
        values = self.evaluate(f"kreisel.simulation.getRecord({top}, '{name}')")
        return np.array(values, float)

    def measure_top(self, top, name):
        """Return the current value of the measure `name` of a top."""
        return self.evaluate(f"kreisel.simulation.measureTop({top}).{name}")

    def read_message(self):
        """Return the text of the status message."""
        return self.locator("#words").inner_text()

    def read_numbers(self):
        """Return the numbers that the viewer displays over the picture, and the notes below."""
        return dict(
            self.evaluate("""(kreisel.page.onChange(),
                [...document.querySelectorAll('#numbers div')].map((box) => [
                    box.querySelector('dt').textContent,
                    [box.querySelector('dd').textContent, box.querySelector('small').textContent],
                ]))""")
        )
