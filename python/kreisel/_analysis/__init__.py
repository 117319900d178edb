"""Analysis of paths: apex traces, elastic rods, frequencies and comparisons."""
