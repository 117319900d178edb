"""Estimation of bodies and starts from measurements."""
