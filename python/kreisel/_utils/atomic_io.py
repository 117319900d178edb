"""Atomic file output: write a temporary file, then rename it into place.

A file with the final name is always complete, even if the disk becomes full or the process crashes.
The temporary file of a killed process is removed when the file is next written. Its name depends on
the final name, and its lock shows whether a process is still writing it.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path


class BlockAppender:
    """A file that is written in blocks."""

    def __init__(self, descriptor: int, name: str) -> None:
        self._descriptor, self._whole, self._name = descriptor, 0, name

    @property
    def is_empty(self) -> bool:
        """True if nothing has been written to the file so far."""
        return self._whole == 0

    def append_bytes(self, data: bytes) -> None:
        """Append all of `data`.

        If an error occurs, the file is truncated to its previous length.
        """
        remainder = memoryview(data)
        try:
            while remainder:
                remainder = remainder[os.write(self._descriptor, remainder) :]
        except BaseException as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, self._whole)
            if isinstance(error, OSError):
                error.filename = self._name
            raise
        self._whole += len(data)


@contextlib.contextmanager
def atomic_open(path: str | os.PathLike[str]) -> Iterator[BlockAppender]:
    """Open a temporary file that replaces the file `path` at the end of a `with` block.

    If an exception occurs or nothing is written, the file `path` is left unchanged. If `path` is a
    device or a pipe, no temporary file is used.
    """
    file, name = Path(os.path.realpath(path)), os.fspath(path)
    if _is_device_or_pipe(path):  # it cannot be replaced by a rename
        with open(path, "wb", buffering=0) as stream:
            yield BlockAppender(stream.fileno(), name)
        return
    new, descriptor = _create_temp_file(file, name)
    try:
        with _hold_lock(descriptor):
            with open(descriptor, "wb") as stream:
                appender = BlockAppender(stream.fileno(), name)
                yield appender
                os.fsync(stream.fileno())
            if appender.is_empty:
                new.unlink()
            else:
                os.replace(new, file)
    except BaseException:
        new.unlink(missing_ok=True)
        raise
    sync_folder(file.parent)


def atomic_write(path: str | os.PathLike[str], data: bytes) -> None:
    """Write data to a file atomically, and sync the file to disk.

    Raises OSError if the file cannot be written, and leaves an existing file unchanged.
    """
    with atomic_open(path) as file:
        file.append_bytes(data)


def sync_folder(folder: Path) -> None:
    """Sync `folder` to disk. Does nothing on systems that cannot sync folders."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:
        return
    try:
        os.fsync(descriptor)
    except OSError:
        pass
    finally:
        os.close(descriptor)


def check_file_is_writable(path: str | os.PathLike[str]) -> None:
    """Raise OSError if a file cannot be written."""
    file = Path(os.path.realpath(path))
    if file.is_dir():
        raise IsADirectoryError(f"{os.fspath(path)} is a folder")
    if _is_device_or_pipe(path):
        if not os.access(path, os.W_OK):
            raise PermissionError(f"{os.fspath(path)} must not be written")
        return
    if not file.parent.is_dir():
        raise FileNotFoundError(f"{os.fspath(path)}: there is no folder {file.parent}")
    new = _make_random_temp_path(file)
    try:
        os.close(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600))
    except OSError as error:
        raise type(error)(f"{os.fspath(path)} cannot be written: {error.strerror}") from None
    new.unlink(missing_ok=True)


def _is_device_or_pipe(path: str | os.PathLike[str]) -> bool:
    """Return True if `path` exists and is not a regular file.

    `path` must not be resolved, because a pipe such as /dev/stdout has no other name.
    """
    return Path(path).exists() and not Path(path).is_file()


def _make_random_temp_path(file: Path) -> Path:
    return file.with_name(f".{os.urandom(8).hex()}.new")


def _create_temp_file(file: Path, name: str) -> tuple[Path, int]:
    """Create and lock a temporary file with the permissions of the final file."""
    key = hashlib.blake2b(os.fsencode(file.name), digest_size=8).hexdigest()
    new = file.with_name(f".{key}.new")
    _remove_if_abandoned(new)
    try:
        permissions = file.stat().st_mode & 0o777 if file.exists() else 0o666
        try:
            descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, permissions)
        except FileExistsError:  # another process is writing the same file
            new = _make_random_temp_path(file)
            descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, permissions)
    except OSError as error:
        error.filename = name
        raise
    _lock(descriptor, is_waiting=True)
    if os.fstat(descriptor).st_nlink:
        return new, descriptor
    os.close(descriptor)  # it was removed before it was locked
    return _create_temp_file(file, name)


def _remove_if_abandoned(new: Path) -> None:
    """Remove a temporary file that no process is writing."""
    with contextlib.suppress(OSError):
        descriptor = os.open(new, os.O_WRONLY)
        try:
            if _lock(descriptor, is_waiting=False):
                new.unlink()
        finally:
            os.close(descriptor)


def _lock(descriptor: int, is_waiting: bool) -> bool:
    """Lock a file until it is closed; return False if it is locked or cannot be locked."""
    if sys.platform == "win32":
        return False
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if is_waiting else fcntl.LOCK_NB))
    except OSError:
        return False
    return True


@contextlib.contextmanager
def _hold_lock(descriptor: int) -> Iterator[None]:
    """Keep a file locked after its descriptor is closed, until the end of a `with` block."""
    held = None if sys.platform == "win32" else os.dup(descriptor)
    try:
        yield
    finally:
        if held is not None:
            os.close(held)
