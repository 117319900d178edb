"""Files that are written whole or not at all, archives of arrays, and checksums."""

from __future__ import annotations

import contextlib
import hashlib
import io
import math
import os
import re
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from .arguments import Array


class BlockAppender:
    """A file that is written in blocks."""

    def __init__(self, descriptor: int, name: str) -> None:
        self._descriptor, self.size, self._name = descriptor, 0, name

    def append_bytes(self, data: bytes) -> None:
        """Append all of `data`, or nothing if an error occurs."""
        remainder = memoryview(data)
        try:
            while remainder:
                remainder = remainder[os.write(self._descriptor, remainder) :]
        except BaseException as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, self.size)
            if isinstance(error, OSError):
                error.filename = self._name
            raise
        self.size += len(data)


@contextlib.contextmanager
def atomic_open(path: str | os.PathLike[str]) -> Iterator[BlockAppender]:
    """Open a temporary file that replaces the file `path` at the end of a `with` block.

    If an exception occurs or nothing is written, the file `path` is left unchanged. If `path` is a
    device or a pipe, no temporary file is used. The temporary file has no name, so that a process
    that is killed leaves none, if the file system allows that.
    """
    file, name = Path(os.path.realpath(path)), os.fspath(path)
    if _is_device_or_pipe(path):  # it cannot be replaced by a rename
        with open(path, "wb", buffering=0) as stream:
            yield BlockAppender(stream.fileno(), name)
        return
    try:
        permissions = file.stat().st_mode & 0o777 if file.exists() else 0o666
        descriptor, new = _create_temporary_file(file, permissions)
    except OSError as error:
        error.filename = name
        raise
    try:
        with open(descriptor, "wb") as stream:
            appender = BlockAppender(stream.fileno(), name)
            yield appender
            os.fsync(stream.fileno())
            while appender.size and new is None:
                key = hashlib.blake2b(os.fsencode(file.name), digest_size=8).hexdigest()
                link = file.with_name(f".{key}.new")  # of a complete file
                try:
                    os.link(f"/proc/self/fd/{descriptor}", link, src_dir_fd=descriptor)
                    new = link
                except FileExistsError:  # another process was killed here, or is about to go on
                    with contextlib.suppress(FileNotFoundError):
                        os.replace(link, file)
        if appender.size and new is not None:
            try:
                os.replace(new, file)
            except FileNotFoundError:  # unless another process has done it
                if not file.exists():
                    raise
        elif new is not None:
            new.unlink()
    except BaseException:
        if new is not None:
            new.unlink(missing_ok=True)
        raise
    sync_folder(file.parent)


def _create_temporary_file(file: Path, permissions: int) -> tuple[int, Path | None]:
    """Create a file in the folder of `file`; return its descriptor, and its name if it has one."""
    if hasattr(os, "O_TMPFILE") and os.path.isdir("/proc/self/fd"):
        with contextlib.suppress(OSError):  # not all file systems have files without names
            return os.open(file.parent, os.O_TMPFILE | os.O_WRONLY, permissions), None
    new = file.with_name(f".{os.urandom(8).hex()}.new")
    return os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, permissions), new


def atomic_write(path: str | os.PathLike[str], data: bytes) -> None:
    """Write data to a file as a whole, or raise OSError and leave an existing file unchanged."""
    with atomic_open(path) as file:
        file.append_bytes(data)


def sync_folder(folder: Path) -> None:
    """Sync `folder` to disk. Does nothing on systems that cannot sync folders."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
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
    try:
        descriptor, new = _create_temporary_file(file, 0o600)
    except OSError as error:
        raise type(error)(f"{os.fspath(path)} cannot be written: {error.strerror}") from None
    os.close(descriptor)
    if new is not None:
        new.unlink(missing_ok=True)


def _is_device_or_pipe(path: str | os.PathLike[str]) -> bool:
    """Return True if `path` exists and is not a regular file.

    `path` must not be resolved, because a pipe such as /dev/stdout has no other name.
    """
    return Path(path).exists() and not Path(path).is_file()


Integers = npt.NDArray[np.intc]
_HEADER = re.compile(
    rb"\x93NUMPY\x01\x00..\{'descr': '<(f8|i4|U[0-9]{1,12})', 'fortran_order': False, "
    rb"'shape': \(([0-9, ]{0,200})\), \} *\n",
    re.DOTALL,
)
_MAX_ERROR_LENGTH = 100  # characters kept of a message of zipfile, which may quote the file


def pack_archive(texts: Mapping[str, str], arrays: Mapping[str, Array | Integers]) -> bytes:
    from zipfile import ZipFile, ZipInfo  # imported here to keep `import kreisel` fast

    buffer = io.BytesIO()
    with ZipFile(buffer, "w") as archive:
        members: dict[str, npt.NDArray[np.generic]] = {
            name: np.array(text, dtype=f"<U{len(text)}") for name, text in texts.items()
        }
        for name, array in arrays.items():
            members[name] = array.astype("<i4" if array.dtype.kind == "i" else "<f8")
        for name, values in members.items():
            with archive.open(ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                data = np.ascontiguousarray(values).reshape(values.shape)
                np.lib.format.write_array(member, data, version=(1, 0), allow_pickle=False)
    return buffer.getvalue()


class ArchiveReader:
    """An archive opened for reading; methods raise ValueError if it is damaged or is not one."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        from zipfile import ZIP_STORED, BadZipFile, ZipFile

        try:
            with ZipFile(file) as archive:
                members = archive.infolist()
                if any(each.compress_type != ZIP_STORED for each in members):
                    raise ValueError("its members are compressed")
                if sum(each.file_size for each in members) > size:
                    raise ValueError("its members are larger than the file")
                self._members = {
                    each.filename.removesuffix(".npy"): archive.read(each) for each in members
                }
        except (EOFError, OSError, RuntimeError, struct.error, BadZipFile) as error:
            raise ValueError(f"the archive is damaged: {str(error)[:_MAX_ERROR_LENGTH]}") from None

    def read_archive_text(self, name: str) -> str:
        return str(self._read_archive_member(name, "U", ()), "utf-32-le").rstrip("\0")

    def read_archive_doubles(self, name: str, n: int | None, *shape: int) -> Array:
        """Return an array of shape (n, *shape), of any length n if `n` is None."""
        data = self._read_archive_member(name, "f8", (n, *shape))
        rows = len(data) // (8 * math.prod(shape)) if n is None else n
        return np.frombuffer(data, "<f8").reshape(rows, *shape).astype(np.float64, copy=False)

    def read_archive_integers(self, name: str, n: int) -> Integers:
        return np.frombuffer(self._read_archive_member(name, "i4", (n,)), "<i4").astype(np.intc)

    def _read_archive_member(
        self, name: str, kind: str, shape: tuple[int | None, ...]
    ) -> memoryview:
        """Return the raw bytes of the archive member `name` after checking its type and shape."""
        data = self._members.get(name)
        if data is None:
            raise ValueError(f"it has no member {name}")
        header = _HEADER.match(data)
        if header is None or not header[1].decode().startswith(kind):
            raise ValueError(f"its {name} is damaged or has another type")
        sizes = [int(word) for word in header[2].decode().split(",") if word.strip()]
        is_match = len(sizes) == len(shape) and all(
            n in (None, size) for n, size in zip(shape, sizes, strict=True)
        )
        size = 4 * int(header[1][1:]) if kind == "U" else int(header[1][1:])
        rest = memoryview(data)[header.end() :]
        if not is_match or math.prod(sizes) * size != len(rest):
            raise ValueError(f"its {name} has the wrong size: its shape is {tuple(sizes)}")
        return rest


_MARK, _SIZE = b"kreisel-sha256:", 64
# The text before the digest, followed by zeros in place of the digest.
PLACEHOLDER = (_MARK + b"0" * _SIZE).decode()


def fill_in_checksum(data: bytearray) -> bytearray:
    """Replace the last placeholder in the contents of a file by the checksum."""
    position = data.rindex(PLACEHOLDER.encode()) + len(_MARK)
    data[position : position + _SIZE] = hashlib.sha256(data).hexdigest().encode()
    return data


def has_correct_checksum(data: bytes) -> bool:
    """Return True if the contents of a file include a correct checksum."""
    position = data.rfind(_MARK) + len(_MARK)
    if position < len(_MARK):
        return False
    view, digest = memoryview(data), hashlib.sha256()
    for piece in (view[:position], PLACEHOLDER.encode()[len(_MARK) :], view[position + _SIZE :]):
        digest.update(piece)
    return digest.hexdigest().encode() == data[position : position + _SIZE]
