"""Validation of kreisel: references, comparisons, the report, benchmarks and studies."""
