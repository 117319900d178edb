"""Checksums of whole files, stored inside the files.

A mark is followed by the SHA-256 of the file with zeros in the place of the digest. Parquet has
checksums of its pages only: a change in the schema or the statistics would go unnoticed.
"""

from __future__ import annotations

import hashlib

_MARK, _SIZE = b"kreisel-sha256:", 64
PLACEHOLDER = (_MARK + b"0" * _SIZE).decode()  # the mark of a file without its digest


def add_checksum(data: bytearray) -> bytearray:
    """Write the digest of a file into its last placeholder, and return the file."""
    at = data.rindex(PLACEHOLDER.encode()) + len(_MARK)
    data[at : at + _SIZE] = hashlib.sha256(data).hexdigest().encode()
    return data


def has_checksum(data: bytes) -> bool:
    """Return True if a file has the right checksum."""
    at = data.rfind(_MARK) + len(_MARK)
    if at < len(_MARK):
        return False
    view, digest = memoryview(data), hashlib.sha256()
    for piece in (view[:at], PLACEHOLDER.encode()[len(_MARK) :], view[at + _SIZE :]):
        digest.update(piece)
    return digest.hexdigest().encode() == data[at : at + _SIZE]
