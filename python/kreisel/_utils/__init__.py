"""Utilities that every other package uses: validation, errors, files and optional imports."""
