"""Recomputation of the figures, statements and errata of a thesis on tops (Bodack 2008)."""
