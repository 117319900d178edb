"""Options of solve and the like, validated before any run: methods, quantities, times, plans."""
