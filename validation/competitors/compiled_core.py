"""Access to the C functions in the shared library of the installed package.

No other module of `validation` uses private attributes of a scene.
"""

from pathlib import Path

from kreisel import _core

FILE = Path(_core.__file__)


def scene_bytes(scene):
    """Return the bytes of the C struct `kr_scene` for a scene."""
    return scene._block
