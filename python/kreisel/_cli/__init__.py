"""Command-line interface, whose commands and options are named after Python functions."""

from .main_command import main

__all__ = ["main"]
