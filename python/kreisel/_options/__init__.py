"""Options that are validated before any run: methods, quantities, times and plans."""
