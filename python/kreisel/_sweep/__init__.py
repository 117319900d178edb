"""Sweeps: ensembles too large for the memory, which are computed and stored in parts."""
