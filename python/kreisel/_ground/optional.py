"""What need not be installed: where it is missed, how to get it is said."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def installed(by: str) -> Iterator[None]:
    """Around imports of what `pip install` with these words brings; ImportError that says so where
    it is not there."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"this needs {error.name}, which is not installed: pip install {by}", name=error.name
        ) from None
