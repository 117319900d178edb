"""Checksums of whole files, stored inside the files.

The checksum of a file is its SHA-256 digest, computed with zeros in place of the stored digest. The
digest is stored after the text "kreisel-sha256:".

Parquet's own checksums cover only data pages, and would not detect changes to the schema or the
statistics.
"""

from __future__ import annotations

import hashlib

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
