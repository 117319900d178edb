"""Studies that chose constants of the library once: python -m validation.studies.NAME.

Each module states the conclusion of its study in its second paragraph. They are not part of CI.
"""
