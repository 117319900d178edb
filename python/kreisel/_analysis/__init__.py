"""Analysis of paths: traces, rods, frequencies, comparisons."""
