"""Files: written beside their place and put there at once, so that a reader, a full disk or a crash
never meets half a file."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path


class Growing:
    """A file that is written piece by piece; its name is that of what could not be written."""

    def __init__(self, descriptor: int, name: str) -> None:
        self._descriptor, self._whole, self._name = descriptor, 0, name

    @property
    def is_empty(self) -> bool:
        """Whether nothing was written whole."""
        return self._whole == 0

    def add(self, data: bytes) -> None:
        """These bytes, or OSError and none of them where the file has a place beside it."""
        left = memoryview(data)
        try:
            while left:
                left = left[os.write(self._descriptor, left) :]
        except BaseException as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, self._whole)
            if isinstance(error, OSError):
                error.filename = self._name
            raise
        self._whole += len(data)


@contextlib.contextmanager
def growing(path: str | os.PathLike[str]) -> Iterator[Growing]:
    """A file that is written beside its place, and put there, on the disk, at the end; whatever is
    raised before that, and where nothing was written, what stood there stays and nothing else is
    left behind."""
    file, name = Path(os.path.realpath(path)), os.fspath(path)
    if file.exists() and not file.is_file():  # a device or a pipe, which has no place beside it
        with open(file, "wb", buffering=0) as out:
            yield Growing(out.fileno(), name)
        return
    new = _beside(file)
    try:
        with open(_begun(new, file, name), "wb") as out:
            grown = Growing(out.fileno(), name)
            yield grown
            os.fsync(out.fileno())
        if grown.is_empty:
            new.unlink()
        else:
            os.replace(new, file)
    except BaseException:
        new.unlink(missing_ok=True)
        raise
    sync(file.parent)


def write(path: str | os.PathLike[str], data: bytes) -> None:
    """The file of this name with these bytes, on the disk; whatever fails, what stood there
    stays and nothing else is left behind. OSError where it cannot be written."""
    with growing(path) as file:
        file.add(data)


def sync(folder: Path) -> None:
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


def refuse_no_place(path: str | os.PathLike[str]) -> None:
    """OSError where a file of this name could not be written, before anything is computed."""
    file = Path(os.path.realpath(path))
    if file.is_dir():
        raise IsADirectoryError(f"{os.fspath(path)} is a folder")
    if not file.parent.is_dir():
        raise FileNotFoundError(f"{os.fspath(path)}: there is no folder {file.parent}")
    if file.exists() and not file.is_file():
        if not os.access(file, os.W_OK):
            raise PermissionError(f"{os.fspath(path)} must not be written")
        return
    new = _beside(file)
    try:
        os.close(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
    except OSError as error:
        raise type(error)(f"{os.fspath(path)} cannot be written: {error.strerror}") from None
    new.unlink(missing_ok=True)


def _beside(file: Path) -> Path:
    return file.with_name(f".{os.urandom(8).hex()}.new")


def _begun(new: Path, file: Path, name: str) -> int:
    """The new file that becomes this one; what is refused is told of the name that was given."""
    try:
        return os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _mode(file))
    except OSError as error:
        error.filename = name
        raise


def _mode(file: Path) -> int:
    return file.stat().st_mode & 0o777 if file.exists() else 0o666
