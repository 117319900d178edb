"""Proved enclosures of the motion, in the ball arithmetic of FLINT."""
