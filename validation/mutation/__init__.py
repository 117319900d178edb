"""Programs that measure how well the tests detect faults: python -m validation.mutation.NAME."""
