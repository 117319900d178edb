"""What the tests of the page share: visits without a network, drags, and what the page says of itself."""

import kreisel as kr
import numpy as np
from kreisel._showing.view import _PAGE


def visit(browser, file=_PAGE, size=(1280, 800), fragment="", **how):
    """The page in a window of its own; `troubles`: complaints in the console, and what was asked of the network."""
    context = browser.new_context(
        viewport=dict(zip(("width", "height"), size)), offline=True, **how
    )
    context.set_default_timeout(10000)
    page = context.new_page()
    page.troubles = troubles = []
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on(
        "console",
        lambda message: message.type in {"error", "warning"} and troubles.append(message.text),
    )
    page.on(
        "request",
        lambda request: request.url.startswith(("http", "ws")) and troubles.append(request.url),
    )
    page.goto(file.as_uri() + fragment)
    page.wait_for_function("window.kreisel")
    return page


def scene(page):
    return page.evaluate("kreisel.page.scene")


def clock(page):
    return page.evaluate("kreisel.page.clock")


def scene_in_python(given, second=False):
    body = given["body"]
    if "half" in body:
        made = kr.Body.cuboid(**body)
    else:
        made = kr.Body(body["mass"], np.reshape(body["inertia"], (3, 3)), body["com"])
    attitude, momentum = (
        (given["second"][:4], given["second"][4:])
        if second
        else (given["attitude"], given["momentum"])
    )
    return kr.Scene(made, momentum, attitude, given["gravity"])


def drag(page, kind, by, number=0, button="left", key=None):
    """Where the handle was, and where it is then."""
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


def changed(before, after):
    return {key for key in before if before[key] != after[key] and key != "name"}
