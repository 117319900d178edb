"""Numerical experiments on which the choice of constants in the library is based.

A study is run with `python -m validation.studies.NAME`.
"""
