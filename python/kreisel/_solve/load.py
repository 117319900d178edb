"""kreisel.load: reading of saved paths, scenes and runs."""

from __future__ import annotations

import os
import stat
from pathlib import Path as File
from typing import BinaryIO

from .._model.scene import Scene
from .._results.path import Events, Path
from .._results.serialization import read_saved_path_arguments
from .._utils.validation import short_repr
from .run import MAGIC, Run, resume

_ZIP = b"PK"  # the first bytes of an archive, which is a ZIP file
_MAX_SCENE_BYTES = 1 << 20


def load(file: str | os.PathLike[str]) -> Path | Scene | Run:
    """Load a path, a scene or a run from a file.

    The type of the returned object depends on the contents of the file. A path written by path.save
    is restored exactly, bit for bit. A scene is read from a TOML file. A run is restored from a
    checkpoint that was written by run.save.

        >>> import os, tempfile
        >>> import kreisel as kr
        >>> path = kr.solve(kr.scenes.thesis, [1.0, 2.0])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path.save(os.path.join(folder, "top.npz"))
        ...     kr.load(os.path.join(folder, "top.npz"))
        <kreisel.Path: 2 states, t = 1 .. 2; exact, 2 steps>

    Raises TypeError if `file` is not a str or a path of text. Raises OSError if the file cannot be
    read. Raises ValueError if the file is damaged, or contains neither a path nor a scene nor a
    run. Loading a file does not execute any code that the file contains. Memory use is bounded by
    the size of the file.
    """
    name = os.fspath(file)
    if not isinstance(name, str):
        raise TypeError(f"file must be the name of a file, not {short_repr(file)}")
    status = os.stat(name)
    if not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
        raise ValueError(f"{name} is not a regular file")
    with open(name, "rb") as stream:
        head = stream.read(len(MAGIC))
        if head == MAGIC:
            return resume(File(name))
        if head.startswith(_ZIP):
            return _load_path(name, stream, status.st_size)
    return _load_scene(name, status.st_size)


def _load_path(name: str, file: BinaryIO, size: int) -> Path:
    try:
        path, event_data = read_saved_path_arguments(file, size)
    except ValueError as error:
        raise ValueError(f"{name} is not a saved path: {error}") from None
    if event_data is None:
        return Path(*path)
    event_arguments, which, direction = event_data
    return Path(*path._replace(events=Events(Path(*event_arguments), which, direction)))


def _load_scene(name: str, size: int) -> Scene:
    kinds = "a saved path or run, nor a scene in TOML"
    if size > _MAX_SCENE_BYTES:
        raise ValueError(f"{name} is neither {kinds}, which would be smaller")
    try:
        return Scene.from_toml(File(name))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{error}; the file is neither {kinds}") from None
