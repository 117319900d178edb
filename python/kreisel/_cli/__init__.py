"""The command line: the words of the Python package, as a shell says them."""

from .main_command import main

__all__ = ["main"]
