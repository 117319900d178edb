"""The shared library of the installed package, and C structs for direct calls of its functions.

No other module of `validation` uses private attributes of a scene.
"""

from pathlib import Path

from kreisel import _core

FILE = Path(_core.__file__)


def scene_bytes(scene):
    """Return the bytes of the C struct `kr_scene` for a scene."""
    return scene._block
