"""Sweeps: ensembles larger than memory, computed and stored in parts."""
