"""Command-line interface, with commands and options named like Python functions and arguments."""

from .main_command import main

__all__ = ["main"]
