"""The page with the scene of an example in it. All examples share one file of the page, which takes
the scene from its address."""

import html
import json
from urllib.parse import quote

import kreisel as kr


def setup(app):
    kr.View._repr_html_ = in_a_frame


def in_a_frame(view):
    """In a notebook the same expression shows the page from memory."""
    address = "../_static/viewer.html#scene=" + quote(json.dumps(view.scene))
    return (
        f'<iframe class="live" loading="lazy" src="{html.escape(address)}" '
        f'title="{html.escape(view.scene["name"])}, in motion"></iframe>'
    )
