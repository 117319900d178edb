"""Programs that measure how well tests detect faults.

Run one with `python -m validation.mutation.NAME`.
"""
