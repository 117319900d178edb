"""The command line, whose commands and options have the names of functions and arguments."""

from .main_command import main

__all__ = ["main"]
