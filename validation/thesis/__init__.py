"""The thesis again, true: Bodack (2008), its figures, its sentences and its errata."""
