"""Imports of optional dependencies."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def optional_dependency(requirement: str) -> Iterator[None]:
    """Return a context manager that adds an installation hint to the error for a missing module."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"this needs {error.name}, which is not installed: pip install {requirement}",
            name=error.name,
        ) from None
