"""Results of runs: paths, ensembles of paths, and exceptions."""
