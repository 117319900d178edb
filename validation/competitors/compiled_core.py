"""The shared library of the installed package, and the C struct of a scene.

Some references and studies read private attributes of a scene themselves.
"""

from pathlib import Path

from kreisel import _core

FILE = Path(_core.__file__)


def scene_bytes(scene):
    """Return the bytes of the C struct `kr_scene` for a scene."""
    return scene._block
