"""Utilities used by all other packages: validation, errors, files and optional imports."""
