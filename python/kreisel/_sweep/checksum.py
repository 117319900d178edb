"""Seals: a file says itself what it must be, to the bit.

A mark is followed by the SHA-256 of the whole file with zeros in its place. It stands inside the
file, so that one renaming puts file and seal in their place, and nobody else need know of it.
"""

from __future__ import annotations

import hashlib

_MARK, _SIZE = b"kreisel-sha256:", 64
OPEN = (_MARK + b"0" * _SIZE).decode()  # what a file has where its seal will be


def add_checksum(data: bytearray) -> bytearray:
    """The bytes of a file, of which the last open seal is closed in place."""
    at = data.rindex(OPEN.encode()) + len(_MARK)
    data[at : at + _SIZE] = hashlib.sha256(data).hexdigest().encode()
    return data


def is_whole(data: bytes) -> bool:
    """Return True if the checksum of a file is right."""
    at = data.rfind(_MARK) + len(_MARK)
    if at < len(_MARK):
        return False
    view, digest = memoryview(data), hashlib.sha256()
    for piece in (view[:at], OPEN.encode()[len(_MARK) :], view[at + _SIZE :]):
        digest.update(piece)
    return digest.hexdigest().encode() == data[at : at + _SIZE]
