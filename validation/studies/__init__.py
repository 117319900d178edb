"""Studies by which constants of the library were chosen.

Run one with `python -m validation.studies.NAME`.

Each module states the conclusion of its study in its second paragraph. The studies are not part of
CI.
"""
