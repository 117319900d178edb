"""Utilities used by all other packages: validation, errors, files, signals, optional imports."""
