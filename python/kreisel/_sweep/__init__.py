"""Sweeps: ensembles larger than memory, which are computed and stored in parts."""
