"""Command-line interface whose commands and options have the names used in the package."""

from .main import main

__all__ = ["main"]
