"""Validation of options: methods, quantities, times and plans."""
