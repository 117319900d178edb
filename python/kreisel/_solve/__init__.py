"""Functions that compute motions: solve, runs, closed forms, sections and indicators of chaos."""
