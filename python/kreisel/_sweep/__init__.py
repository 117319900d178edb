"""Sweeps: ensembles that exceed the memory, and are therefore computed and stored in parts."""
