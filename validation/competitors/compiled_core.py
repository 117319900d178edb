"""The compiled core of the installed package: its file, and the bytes of scenes for calls from C.

This is the only file of validation that uses private names of a scene.
"""

from pathlib import Path

from kreisel import _core

FILE = Path(_core.__file__)


def scene_bytes(scene):
    """Return the bytes of the C struct `kr_scene` for a scene."""
    return scene._block
