"""Benchmarks of speed and accuracy. Run a program with `python -m validation.benchmarks.NAME`."""
