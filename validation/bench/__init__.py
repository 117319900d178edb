"""Programs that measure: python -m validation.bench.NAME."""
