"""Results of runs: paths built from the output of the core, and exceptions for failed runs."""
