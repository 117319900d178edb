"""Studies that determine the values of constants in the library.

Run a study with `python -m validation.studies.NAME`.

Each module states the conclusion of its study in its second paragraph. The studies are not part of
CI.
"""
