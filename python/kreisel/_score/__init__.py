"""Scores of the motions that other programs computed."""
