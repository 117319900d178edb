"""Validation of kreisel: reference solutions, comparisons with other programs, and benchmarks."""
