"""The chapter on Bodack's thesis (2008): its figures, sentences and errata, recomputed."""
