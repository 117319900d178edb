"""Test problems and their reference solutions."""
