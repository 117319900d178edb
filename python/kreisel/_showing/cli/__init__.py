"""The command line: the words of the Python package, as a shell says them."""

from .front import main

__all__ = ["main"]
