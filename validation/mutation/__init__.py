"""Programs that measure how well tests detect faults.

Run a program with `python -m validation.mutation.NAME`.
"""
