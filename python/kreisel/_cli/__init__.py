"""The command line: its commands and options have the names of Python functions and arguments."""

from .main_command import main

__all__ = ["main"]
