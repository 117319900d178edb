"""The parts of the report: what each finds out, and its tables."""
