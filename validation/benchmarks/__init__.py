"""Benchmarks of speed and accuracy: python -m validation.benchmarks.NAME."""
