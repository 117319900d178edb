"""The chapter on Bodack's thesis (2008), with its figures, sentences and errata recomputed."""
