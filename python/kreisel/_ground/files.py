"""Files: written beside their place and put there at once, so that a reader, a full disk or a crash
never meets half a file."""

from __future__ import annotations

import os
import secrets
from pathlib import Path


def write(path: str | os.PathLike[str], data: bytes) -> None:
    """The file of this name with these bytes, on the disk; whatever fails, what stood there
    stays and nothing else is left behind. OSError where it cannot be written."""
    file = Path(os.path.realpath(path))
    if file.exists() and not file.is_file():  # a device or a pipe, which has no place beside it
        file.write_bytes(data)
        return
    new = file.with_name(f".{secrets.token_hex(8)}.new")
    try:
        with open(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _mode(file)), "wb") as out:
            out.write(data)
            out.flush()
            os.fsync(out.fileno())
        os.replace(new, file)
    except BaseException:
        new.unlink(missing_ok=True)
        raise
    _sync(file.parent)


def refuse_no_place(path: str | os.PathLike[str]) -> None:
    """OSError where a file of this name could not be written, before anything is computed."""
    file = Path(os.path.realpath(path))
    if file.is_dir():
        raise IsADirectoryError(f"{os.fspath(path)} is a folder")
    if not file.parent.is_dir():
        raise FileNotFoundError(f"{os.fspath(path)}: there is no folder {file.parent}")
    if not os.access(file if file.exists() and not file.is_file() else file.parent, os.W_OK):
        raise PermissionError(f"{os.fspath(path)} must not be written")


def _mode(file: Path) -> int:
    return file.stat().st_mode & 0o777 if file.exists() else 0o666


def _sync(folder: Path) -> None:
    """A name is on the disk once its folder is; not every system can open one."""
    try:
        there = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        os.fsync(there)
    except OSError:
        pass
    finally:
        os.close(there)
