"""How far the tests can be trusted: programs that measure it, python -m validation.mutation.NAME."""
