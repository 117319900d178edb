"""Benchmarks of speed and accuracy. Run one with `python -m validation.benchmarks.NAME`."""
