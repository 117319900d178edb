"""Estimation of bodies and their initial states from measurements."""
