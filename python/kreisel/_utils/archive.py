"""Archives of named texts and arrays in a single file, which numpy.load can also read.

An archive is a zip file of uncompressed .npy members. Archives whose members claim to be larger
than the file are rejected. Reading an archive never executes code.
"""

from __future__ import annotations

import io
import math
import re
import struct
from collections.abc import Mapping
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
import numpy.typing as npt

from .validation import Array

if TYPE_CHECKING:
    from zipfile import ZipFile

Integers = npt.NDArray[np.intc]
_HEADER = re.compile(
    rb"\x93NUMPY\x01\x00..\{'descr': '<(f8|i4|U[0-9]{1,12})', 'fortran_order': False, "
    rb"'shape': \(([0-9, ]{0,200})\), \} *\n",
    re.DOTALL,
)
_MAX_ERROR_LENGTH = 100  # characters kept of a message of zipfile, which may quote the file


def pack_archive(texts: Mapping[str, str], arrays: Mapping[str, Array | Integers]) -> bytes:
    """Return the bytes of an archive that contains `texts` and `arrays`."""
    from zipfile import ZipFile  # imported here to keep `import kreisel` fast

    buffer = io.BytesIO()
    with ZipFile(buffer, "w") as archive:
        for name, text in texts.items():
            _write_array(archive, name, np.array(text, dtype=f"<U{len(text)}"))
        for name, array in arrays.items():
            _write_array(archive, name, array.astype("<i4" if array.dtype.kind == "i" else "<f8"))
    return buffer.getvalue()


def _write_array(archive: ZipFile, name: str, array: npt.NDArray[np.generic]) -> None:
    from zipfile import ZipInfo

    with archive.open(ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
        data = np.ascontiguousarray(array).reshape(array.shape)
        np.lib.format.write_array(member, data, version=(1, 0), allow_pickle=False)


class ArchiveReader:
    """An archive that is opened for reading.

    Raises ValueError if the file is damaged or is not an archive.
    """

    def __init__(self, file: BinaryIO, size: int) -> None:
        from zipfile import BadZipFile, ZipFile

        try:
            with ZipFile(file) as archive:
                self._members = _read_archive_members(archive, size)
        except (EOFError, OSError, RuntimeError, struct.error, BadZipFile) as error:
            raise ValueError(f"the archive is damaged: {str(error)[:_MAX_ERROR_LENGTH]}") from None

    def read_archive_text(self, name: str) -> str:
        """Return the text stored in the archive member `name`."""
        return str(self._read_archive_member(name, "U", ()), "utf-32-le").rstrip("\0")

    def read_archive_doubles(self, name: str, n: int | None, *shape: int) -> Array:
        """Return the archive member `name` as an array of doubles of shape (n, *shape).

        If `n` is None, the first dimension can have any length.
        """
        data = self._read_archive_member(name, "f8", (n, *shape))
        rows = len(data) // (8 * math.prod(shape)) if n is None else n
        return np.frombuffer(data, "<f8").reshape(rows, *shape).astype(np.float64, copy=False)

    def read_archive_integers(self, name: str, n: int) -> Integers:
        """Return the archive member `name` as an array of `n` integers."""
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


def _read_archive_members(archive: ZipFile, size: int) -> dict[str, bytes]:
    """Return the contents of all members of a zip file.

    Raises ValueError if a member is compressed, or if the members are larger than the file.
    """
    from zipfile import ZIP_STORED

    members = archive.infolist()
    if any(each.compress_type != ZIP_STORED for each in members):
        raise ValueError("its members are compressed")
    if sum(each.file_size for each in members) > size:
        raise ValueError("its members are larger than the file")
    return {each.filename.removesuffix(".npy"): archive.read(each) for each in members}
