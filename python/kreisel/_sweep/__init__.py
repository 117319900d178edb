"""Sweeps: ensembles that are too large for memory, computed and stored in parts."""
