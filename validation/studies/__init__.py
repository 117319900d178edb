"""Studies that chose constants of the library once: python -m validation.studies.NAME."""
