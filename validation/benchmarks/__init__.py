"""Programs that measure: python -m validation.benchmarks.NAME."""
