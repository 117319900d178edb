"""The compiled core without the Python around it, to be timed as a peer's own loop is.

No other file of validation uses what kreisel keeps to itself.
"""

from functools import partial
from pathlib import Path

from kreisel import _core

FILE = Path(_core.__file__)


def scene_bytes(scene):
    """Gives the bytes of a scene as the core takes them: those of a kr_scene."""
    return scene._block


def make_recording_call(
    block, method, times, *, step=0.0, tol=0.0, digits=0, most=0, leave_heading=False
):
    """Makes a call ready to be timed. It gives a status, the states at the times (n, 8), what their
    doubles leave out (n, 8) or None, and what the run cost."""
    words = block, method, step, tol, digits, most, leave_heading, times
    return partial(_core.record, *words)
