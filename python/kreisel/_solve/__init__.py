"""Functions that compute motions, Poincaré sections and chaos indicators."""
