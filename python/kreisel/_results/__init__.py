"""Results of runs as paths and ensembles, and exceptions for failed runs."""
