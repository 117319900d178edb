"""Animated outputs of examples: the interactive viewer and films.

Examples share one copy of the viewer, which reads the scene from its address. A film is shown
as a GIF, because matplotlib's HTML player fetches icons from the network.
"""

import base64
import html
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import quote

import kreisel as kr
from kreisel.types import View


def setup(app):
    View._repr_html_ = in_a_frame
    film = kr.solve(kr.scenes.thesis, t=[0.0, 1.0]).animate()
    type(film)._repr_html_ = as_gif


def in_a_frame(view):
    """Return a frame with the viewer. In a notebook, the viewer is embedded instead."""
    address = "../../_static/viewer.html#scene=" + quote(json.dumps(view.scene))
    return (
        f'<iframe class="live" loading="lazy" src="{html.escape(address)}" '
        f'title="{html.escape(view.scene["name"])}, in motion"></iframe>'
    )


def as_gif(film):
    with TemporaryDirectory() as folder:
        file = Path(folder) / "film.gif"
        film.save(file)
        data = base64.b64encode(file.read_bytes()).decode()
    return f'<img class="film" alt="{html.escape(repr(film))}" src="data:image/gif;base64,{data}">'
