"""Functions that compute motions, closed-form solutions, Poincare sections and chaos indicators."""
