"""Results of runs: paths made from the output of the core, and exceptions for failed runs."""
