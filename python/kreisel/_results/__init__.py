"""Results of runs: the core is called, its result becomes a path, and a failure an exception."""
