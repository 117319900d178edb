"""Validation of kreisel: reference solutions, and comparisons with other programs."""
