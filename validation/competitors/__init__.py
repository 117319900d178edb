"""Other integrators, tools for timing them, and a description of the computer."""
